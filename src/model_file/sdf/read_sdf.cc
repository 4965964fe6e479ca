#include "model_file/sdf/read_sdf.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "base/files.h"
#include "base/scratch_folder.h"
#include "base/worker_pool.h"
#include "math/bytes.h"

namespace mbv {
namespace internal {
extern const char* const kInstalledReaders;  // where the program was configured to be installed
}  // namespace internal

namespace {

namespace fs = std::filesystem;

constexpr const char* kReader = "mbverify-read-sdf";

// Beside the program, or the library that this is a part of, or one of two folders above (tests,
// the Python package in a build), else where it was installed.
fs::path FindSdfReader() {
  std::error_code error;
  Dl_info here;
  fs::path object;
  if (dladdr(reinterpret_cast<const void*>(&FindSdfReader), &here) != 0 &&
      here.dli_fname != nullptr) {
    object = fs::canonical(here.dli_fname, error);
  }
  for (const fs::path& file : {ProgramFile(), object}) {
    if (file.empty()) continue;
    fs::path folder = file.parent_path();
    for (int level = 0; level < 3; ++level, folder = folder.parent_path()) {
      for (const fs::path& path : {folder / kReader, folder / "libexec" / "mbverify" / kReader}) {
        if (fs::is_regular_file(path, error)) return path;
      }
    }
  }
  const fs::path installed = fs::path(internal::kInstalledReaders) / kReader;
  return fs::is_regular_file(installed, error) ? installed : fs::path();
}

// What the reader may know: where libraries and meshes are.
std::vector<std::string> EnvironmentOfReader() {
  std::vector<std::string> variables;
  for (const char* name : {"LD_LIBRARY_PATH", "ASAN_OPTIONS", "TMPDIR", "ROS_PACKAGE_PATH",
                           "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH", "AMENT_PREFIX_PATH"}) {
    if (const char* value = std::getenv(name)) {
      variables.push_back(fmt::format("{}={}", name, value));
    }
  }
  return variables;
}

// Calls the reader; empty, with the reason, where it gives nothing.
std::optional<ForeignModel> CallReader(const fs::path& reader, const SdfSource& source,
                                       std::string* trouble) {
  constexpr double kTimeout_s = 60.0, kMostBytes = 4e9;
  const ScratchFolder scratch("sdf");
  *trouble = scratch.trouble();
  if (trouble->empty()) *trouble = WriteFile(scratch.path() / "source", ToBytes(source));
  if (!trouble->empty()) return std::nullopt;
  WorkerPool pool;
  pool.timeout_s = kTimeout_s;
  pool.ended = [&](size_t, const WorkerEnd& end) { *trouble = end.trouble; };
  WorkerJob job{.argv = {reader.string(), "source", "answer"}, .log = scratch.path() / "log"};
  job.folder = scratch.path();
  job.data_bytes = kMostBytes;
  job.environment = EnvironmentOfReader();
  const bool ran = pool.Run({job});
  const auto bytes = ReadWholeFile(scratch.path() / "answer");
  auto answer = ran && bytes ? FromBytes<ForeignModel>(*bytes) : std::nullopt;
  if (!answer && trouble->empty()) {
    *trouble = fmt::format("libsdformat crashed on it, or took longer than {:g} s", kTimeout_s);
  }
  return answer;
}

}  // namespace

ForeignModel ReadSdf(const std::string& text, const std::string& file, const FloatingBase& base) {
  Diagnostics found;
  ForeignModel model;
  auto source = InspectSdf(text, file, &found);
  const fs::path reader = FindSdfReader();
  if (source && reader.empty()) {
    found.AddError(file,
                   fmt::format("this mbverify reads no SDF: there is no {} beside it", kReader),
                   "it is built with -DMBV_WITH_SDF=ON where libsdformat-dev is installed");
  } else if (source) {
    source->base = base;
    std::string trouble;
    if (auto answer = CallReader(reader, *source, &trouble)) {
      model = std::move(*answer);
    } else {
      found.AddError(file, trouble);
    }
  }
  std::vector<Finding> findings = found.findings();
  findings.insert(findings.end(), model.findings.begin(), model.findings.end());
  model.findings = std::move(findings);
  if (source) {
    model.left_out.insert(model.left_out.begin(), source->left_out.begin(), source->left_out.end());
  }
  model.printed = RoundingOf(text);
  return model;
}

}  // namespace mbv
