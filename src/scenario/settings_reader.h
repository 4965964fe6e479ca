// The sections of a scenario file that do not concern motion.
#pragma once

#include "model_file/yaml/value_reader.h"
#include "scenario/scenario.h"

namespace mbv {

/// A forward simulation takes at most this many steps; each needs about 200 bytes.
inline constexpr double kMaxSteps = 1e7;

[[nodiscard]] AnalyticSettings ReadAnalytic(ValueReader* values, const YamlNode* node);
[[nodiscard]] ReferenceSettings ReadReference(ValueReader* values, const YamlNode* node);
[[nodiscard]] SimulationSettings ReadSimulation(ValueReader* values, const YamlNode* node);
/// Findings if a gain leaves drives out or names what is none.
void CheckGain(const YamlNode& node, const std::string& path, const Gain& gain,
               const Mechanism& mechanism, YamlReader* yaml);
/// Limits that a scenario leaves out: those of lengths are in proportion to the characteristic
/// length, and not below what the distance from the origin rounds.
[[nodiscard]] CheckLimits DefaultLimits(const Mechanism& mechanism);
/// Limits, and `start_window_s` if it is given; without a mechanism (it could not be read) defaults
/// are those of a metre.
[[nodiscard]] CheckLimits ReadChecks(ValueReader* values, const YamlNode* node,
                                     const Mechanism* mechanism, double* start_window_s);
/// Limits of a stiffness at a pose.
[[nodiscard]] CheckLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node);
[[nodiscard]] Expectation ReadExpectation(ValueReader* values, const YamlNode* node);

}  // namespace mbv
