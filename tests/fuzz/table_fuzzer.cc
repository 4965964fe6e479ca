// Any text as table of forces. The first character chooses what the scenario states about it.
#include <string>

#include "model_file/load_model.h"
#include "scenario/tables/table.h"
#include "tests/fuzz/fuzz.h"

namespace {

const mbv::Mechanism& FourBar() {
  static const mbv::LoadResult loaded =
      mbv::LoadModel(MBV_SOURCE_DIR "/models/four_bar/model.yaml");
  return *loaded.mechanism;
}

mbv::TableSettings SettingsFrom(unsigned char choice) {
  mbv::TableSettings settings;
  if (choice & 1) settings.format.delimiter = ';';
  if (choice & 2) settings.format.decimal_comma = true;
  if (choice & 4) settings.format.heading_rows = 1;
  if (choice & 8) settings.time_unit = "ms";
  if (choice & 16) settings.time_offset_s = -0.1;
  if (choice & 32) settings.tolerance = mbv::TableTolerance{.absolute = 0.1, .relative = 0.01};
  return settings;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, size_t size) {
  if (size == 0) return 0;
  // Shipped tables start with a letter: lower case means no statement.
  const unsigned char choice = data[0] >= 0x80 ? data[0] & 0x3F : 0;
  const std::string text = mbv::Text(data + (choice != 0 ? 1 : 0), size - (choice != 0 ? 1 : 0));
  mbv::YamlReader yaml("fuzz.yaml");
  mbv::Diagnostics diagnostics;
  const auto table = mbv::LoadTableText(text, SettingsFrom(choice), FourBar(), &yaml, &diagnostics);
  if (table == nullptr) return 0;
  mbv::Motion motion;
  motion.duration_s = 2.0;
  motion.sample_s = 0.01;
  (void)mbv::AlignTable(*table, motion);
  (void)mbv::SuggestSample(*table);
  return 0;
}
