// Time profiles in scenario files: a number, one term, or a list of terms that are added.
#pragma once

#include <optional>
#include <string>

#include <vector>

#include "core/profile.h"
#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Tables that profiles name: loads them, and keeps what is known of them.
struct ProfileTables {
  const Mechanism* mechanism = nullptr;
  Diagnostics* files = nullptr;  ///< findings about the files
  std::vector<MotionTable> loaded = {};
  struct Place {
    const YamlNode* node;  ///< `csv`
    std::string path;
  };
  std::vector<Place> places = {};  ///< of loaded
  bool failed = false;             ///< some table could not be loaded
};

/// What a profile's values are.
struct ProfileContext {
  std::string unit;            ///< "m", "rad" or another unit; "_deg" keys need "rad", "_mm" "m"
  std::optional<double> home;  ///< value of the word `home`; empty where it has no meaning
  std::string name = {};       ///< of what it is for: "crank.drive"
  bool moves = false;          ///< of a command: its derivatives count
  ProfileTables* tables = nullptr;  ///< null where a table has no meaning
};

/// Reads a profile; findings for what does not fit.
[[nodiscard]] Profile ReadProfile(ValueReader* values, const YamlNode& node,
                                  const std::string& path, const ProfileContext& context);

}  // namespace mbv
