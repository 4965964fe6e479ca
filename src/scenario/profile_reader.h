// Time profiles in scenario files: a number, one term, or a list of terms that are added.
#pragma once

#include <optional>
#include <string>

#include "core/profile.h"
#include "input/value_reader.h"

namespace mbv {

/// What a profile's values are.
struct ProfileContext {
  std::string unit;            ///< "m", "rad" or another unit; "_deg" keys need "rad", "_mm" "m"
  std::optional<double> home;  ///< value of the word `home`; empty where it has no meaning
};

/// Reads a profile; findings for what does not fit.
[[nodiscard]] Profile ReadProfile(ValueReader* values, const YamlNode& node,
                                  const std::string& path, const ProfileContext& context);

}  // namespace mbv
