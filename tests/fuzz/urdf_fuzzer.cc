// Any text as URDF with closures, alone and as the tree of a model.
#include "model_file/urdf/urdf_import.h"

#include <string>

#include "model_file/load_model.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const std::string text = mbv::Text(data, size);
  mbv::Diagnostics diagnostics;
  const mbv::UrdfTree tree = mbv::ReadUrdf(text, "fuzz.urdf", &diagnostics);
  if (diagnostics.has_errors()) return 0;
  const std::string urdf = mbv::WriteFile("robot.urdf", text);
  const auto result = mbv::LoadModelText("name: robot\nurdf: " + urdf + "\n", "fuzz.yaml");
  mbv::Require(result.mechanism.has_value() != result.diagnostics.has_errors());
  return 0;
}
