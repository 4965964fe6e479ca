#include "report/data/data_file.h"

#include <algorithm>

#include "base/files.h"
#include "base/scratch_folder.h"

namespace mbv {
namespace {

using WriteTraces = decltype(DataFormat::write);
using WriteMatrices = std::string (*)(const std::string& path, const DataMatrices& data);
#ifdef MBV_WITH_MAT
constexpr WriteTraces kWriteMat = &internal::WriteMat;
constexpr WriteMatrices kWriteMatrices = &internal::WriteMat;
#else
constexpr WriteTraces kWriteMat = nullptr;
constexpr WriteMatrices kWriteMatrices = nullptr;
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

namespace {

// The libraries write to paths only; `write` returns "" or what went wrong.
template <typename Write>
std::string BytesOf(const char* file, const Write& write, std::string* trouble) {
  const ScratchFolder scratch("data");
  *trouble = scratch.trouble();
  if (!trouble->empty()) return "";
  const std::string path = (scratch.path() / file).string();
  *trouble = write(path);
  if (!trouble->empty()) return "";
  const auto bytes = ReadWholeFile(path);
  if (!bytes) *trouble = "cannot read " + path;
  return bytes.value_or("");
}

std::string NotBuilt(const std::string& file, const char* option) {
  return "this mbverify writes no " + file + ": it was built with " + option + "=OFF";
}

}  // namespace

std::string DataBytes(const DataFormat& format, const DataAbout& about,
                      const std::vector<const Trace*>& traces, std::string* trouble) {
  if (format.write == nullptr) {
    *trouble = NotBuilt(format.file, format.option);
    return "";
  }
  return BytesOf(
      format.file, [&](const std::string& path) { return format.write(path, about, traces); },
      trouble);
}

std::string MatBytes(const DataMatrices& data, std::string* trouble) {
  const DataFormat& mat = *FindDataFormat("mat");
  if (mat.write == nullptr) {
    *trouble = NotBuilt(".mat files", mat.option);
    return "";
  }
  return BytesOf(
      "matrices.mat", [&](const std::string& path) { return kWriteMatrices(path, data); }, trouble);
}

}  // namespace mbv
