#include "pipeline/out_of_memory.h"

#include <fmt/format.h>

#include <new>

#include "mechanism/channel_count.h"

namespace mbv {
namespace {

constexpr double kBytes = 8.0, kPoseBytes = 128.0;  // of a number, of a body's pose
constexpr double kMegabyte = 1e6;

// "" when the scenario is no motion, or cannot be read either.
std::string WhatIsLarge(const std::string& file, const ScenarioOptions& options) {
  try {
    const ScenarioResult loaded = LoadScenario(file, options);
    if (!loaded.scenario) return "";
    const Motion& motion = loaded.scenario->motion;
    const double samples = motion.duration_s / motion.sample_s;
    const auto signals = static_cast<double>(MostChannels(*loaded.mechanism));
    const auto bodies = static_cast<double>(loaded.mechanism->bodies.size());
    return fmt::format(
        "{:.0f} samples of {:.0f} signals and {:.0f} poses take about {:.0f} MB for each witness",
        samples, signals, bodies, samples * (signals * kBytes + bodies * kPoseBytes) / kMegabyte);
  } catch (const std::bad_alloc&) {
    return "";
  }
}

}  // namespace

RunOutcome OutOfMemory(const std::string& file, const ScenarioOptions& options) {
  const std::string large = WhatIsLarge(file, options);
  RunOutcome outcome;
  outcome.exit_code = 3;
  Finding finding;
  finding.file = file;
  finding.message = "could not run: out of memory" + (large.empty() ? "" : ": " + large);
  finding.hint = "choose a larger motion.sample_s, or a shorter motion";
  outcome.diagnostics.Add(std::move(finding));
  return outcome;
}

}  // namespace mbv
