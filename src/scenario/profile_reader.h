// Time profiles in scenario files: a number, one term, or a list of terms that are added.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "math/profile.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"

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
  /// Laws that come to an end.
  struct Law {
    const YamlNode* node;
    std::string path;
    double start_s, end_s;
  };
  std::vector<Law> laws = {};
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

// Numbers of profiles in the unit of what they are for. Internal to the readers of profiles.

class AmountReader {
 protected:
  AmountReader(ValueReader* values, const ProfileContext& context)
      : values_(values), context_(context) {}

  /// A term's map; `amount` is the key that may be given in several units.
  YamlMap Map(const YamlNode* node, const std::string& path, const std::string& amount,
              std::vector<std::string> keys);
  /// A length or angle, or its rates; the unit must suit the coordinate. Empty when left out.
  YamlMap::InUnit FindAmount(const YamlMap& map, const std::string& key);
  std::optional<double> Amount(const YamlMap& map, const std::string& key);
  /// A required list.
  std::optional<std::vector<double>> Amounts(const YamlMap& map, const std::string& key);
  std::optional<double> PositiveAmount(const YamlMap& map, const std::string& key);
  std::optional<double> RequiredAmount(const YamlMap& map, const std::string& key);

  ValueReader* values_;
  const ProfileContext& context_;
};

// `cam` terms of profiles: rises, dwells and returns one after the other.

/// Words of the laws from rest to rest.
[[nodiscard]] const std::vector<std::string>& StepLaws();

/// A step by the law of this word.
[[nodiscard]] ProfileTerm StepTerm(const std::string& law, double start_s, double duration_s,
                                   double delta);

/// Adds a cam's terms to the profile; findings for what does not fit.
void ReadCam(ValueReader* values, const YamlNode& node, const std::string& path,
             const ProfileContext& context, Profile* profile);

}  // namespace mbv
