// Any text as MJCF, up to MuJoCo's compiler: what is done to the file before it gets there, and
// what is removed at its word.
#include <string>

#include "simulation/mjcf/foreign.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  const std::string text = mbv::Text(data, size);
  mbv::Diagnostics diagnostics;
  mbv::mjcf::ForeignMjcf foreign(text, "fuzz.xml", &diagnostics);
  mbv::Require(foreign.ok() != diagnostics.has_errors());
  if (!foreign.ok()) return 0;
  (void)foreign.ModelName();
  const std::string whole = foreign.Text();
  // As 2.2.2 words it; the line number leads anywhere.
  for (const char* said : {"XML Error: Schema violation: unrecognized attribute: 'name'\nElement "
                           "'body', line 4, column -1\n",
                           "XML Error: Schema violation: unrecognized element\nElement 'joint', "
                           "line 7, column -1\n"}) {
    for (int round = 0; round < 3 && foreign.DropWhatIsUnknown(said); ++round) {
      mbv::Require(foreign.Text().size() <= whole.size());
    }
  }
  return 0;
}
