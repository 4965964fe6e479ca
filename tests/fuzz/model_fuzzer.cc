// Any text as model.yaml.
#include <string>

#include "model_file/load_model.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const auto result = mbv::LoadModelText(mbv::Text(data, size), "fuzz.yaml");
  mbv::Require(result.mechanism.has_value() != result.diagnostics.has_errors());
  (void)result.diagnostics.Text();
  return 0;
}
