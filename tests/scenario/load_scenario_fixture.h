// Scenarios of the stabilizing platform from text.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {

// Scenario texts are loaded as if they lay beside the platform's; paths in messages are relative to
// the project's folder.
inline constexpr const char* kScenarioFile = "scenarios/stabilizing_platform/t.yaml";

class LoadScenarioTest : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::current_path(kSourceDir); }

  static ScenarioResult Load(const std::string& text, const std::vector<SetValue>& set = {}) {
    ScenarioOptions options;
    options.set = set;
    return LoadScenarioText(text, kScenarioFile, options);
  }
  // A complete scenario; `more` is appended.
  static std::string Complete(const std::string& more = "") {
    return "mechanism: stabilizing_platform\n"
           "motion:\n"
           "  duration_s: 12\n"
           "  sample_s: 0.01\n"
           "  commands:\n"
           "    roll: {sine: {amplitude_deg: 6, period_s: 6, phase_deg: 90}}\n"
           "    pitch: 0\n"
           "    heave: [0.5, {cycloid: {start_s: 1, duration_s: 6, delta_mm: 600}}]\n"
           "    platform.z: z_0 + 0.25\n"
           "    platform.roll: 0\n"
           "    platform.pitch: {value_deg: 1}\n"
           "  equal:\n"
           "    - [limb1.drive, limb1.drive_p]\n"
           "    - [limb2.drive, limb2.drive_p]\n"
           "    - [limb3.drive, limb3.drive_p]\n" +
           more;
  }
  static std::string Messages(const std::string& text, const std::vector<SetValue>& set = {}) {
    return Load(text, set).diagnostics.Text();
  }
};

}  // namespace mbv
