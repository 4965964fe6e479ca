#include "report/data/data_file.h"

#include <algorithm>

#include "base/files.h"
#include "base/scratch_folder.h"

namespace mbv {
namespace {

#ifdef MBV_WITH_MAT
constexpr auto kWriteMat = &internal::WriteMat;
#else
constexpr decltype(&internal::WriteMat) kWriteMat = nullptr;
#endif
#ifdef MBV_WITH_HDF5
constexpr auto kWriteMat73 = &internal::WriteMat73;
constexpr auto kWriteHdf5 = &internal::WriteHdf5;
#else
constexpr decltype(&internal::WriteMat73) kWriteMat73 = nullptr;
constexpr decltype(&internal::WriteHdf5) kWriteHdf5 = nullptr;
#endif

}  // namespace

const std::array<DataFormat, 3>& DataFormats() {
  static const std::array<DataFormat, 3> kFormats = {
      {{"mat", "traces.mat", kWriteMat, "MBV_WITH_MAT"},
       {"mat73", "traces_v73.mat", kWriteMat73, "MBV_WITH_HDF5"},
       {"h5", "traces.h5", kWriteHdf5, "MBV_WITH_HDF5"}}};
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
  if (format.write == nullptr) {
    *trouble = std::string("this mbverify writes no ") + format.file + ": it was built with " +
               format.option + "=OFF";
    return "";
  }
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
