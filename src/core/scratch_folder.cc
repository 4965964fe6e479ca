#include "core/scratch_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "core/files.h"

namespace mbv {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder(const std::string& purpose) {
  std::error_code error;
  const fs::path below = fs::temp_directory_path(error);
  if (error) {
    const char* place = std::getenv("TMPDIR");
    trouble_ = fmt::format("no folder for temporary files (TMPDIR={}): {}",
                           place == nullptr ? "" : place, error.message());
    return;
  }
  path_ = MakePrivateFolder(below / fmt::format("mbverify-{}-", purpose));
  if (path_.empty()) {
    trouble_ = fmt::format("cannot make a folder in {}: {}", below.string(), std::strerror(errno));
  }
}

ScratchFolder::~ScratchFolder() {
  std::error_code error;
  if (!path_.empty()) fs::remove_all(path_, error);
}

}  // namespace mbv
