// The `motion:`, `loads:` and `forces:` sections of a scenario.
#pragma once

#include <optional>

#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Times for a motion that states none, from a table that it is compared with.
struct MotionTimes {
  std::optional<double> duration_s, sample_s;
};

/// Reads the sections against a mechanism, with the tables that profiles name. Findings go to the
/// reader, those about tables' files to `files`; the motion is complete only if there was no error.
[[nodiscard]] Motion ReadMotion(ValueReader* values, const Mechanism& mechanism,
                                const YamlNode* motion, const YamlNode* loads,
                                const YamlNode* forces, const MotionTimes& otherwise,
                                Diagnostics* files);

}  // namespace mbv
