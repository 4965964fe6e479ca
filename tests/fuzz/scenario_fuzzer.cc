// Any text as scenario, next to the shipped ones.
#include <string>

#include "features/stiffness/stiffness_scenario.h"
#include "scenario/load_scenario.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const std::string text = mbv::Text(data, size);
  const std::string file = MBV_SOURCE_DIR "/scenarios/four_bar/fuzz.yaml";
  const auto motion = mbv::LoadScenarioText(text, file);
  mbv::Require(motion.scenario.has_value() != motion.diagnostics.has_errors());
  if (text.find("stiffness") == std::string::npos) return 0;
  const auto stiffness = mbv::LoadStiffnessScenarioText(text, file);
  mbv::Require(stiffness.scenario.has_value() != stiffness.diagnostics.has_errors());
  return 0;
}
