#include "report/data/data_file.h"

#include <algorithm>

#include "base/files.h"
#include "base/scratch_folder.h"

namespace mbv {

const std::array<DataFormat, 3>& DataFormats() {
  static const std::array<DataFormat, 3> kFormats = {
      {{"mat", "traces.mat", &internal::WriteMat},
       {"mat73", "traces_v73.mat", &internal::WriteMat73},
       {"h5", "traces.h5", &internal::WriteHdf5}}};
  return kFormats;
}

const DataFormat* FindDataFormat(const std::string& word) {
  const auto& formats = DataFormats();
  const auto found =
      std::ranges::find_if(formats, [&](const DataFormat& f) { return f.word == word; });
  return found == formats.end() ? nullptr : &*found;
}

// The libraries write to paths only.
std::string DataBytes(const DataFormat& format, const DataAbout& about,
                      const std::vector<const Trace*>& traces, std::string* trouble) {
  const ScratchFolder scratch("data");
  *trouble = scratch.trouble();
  if (!trouble->empty()) return "";
  const std::string path = (scratch.path() / format.file).string();
  *trouble = format.write(path, about, traces);
  if (!trouble->empty()) return "";
  const auto bytes = ReadWholeFile(path);
  if (!bytes) *trouble = "cannot read " + path;
  return bytes.value_or("");
}

}  // namespace mbv
