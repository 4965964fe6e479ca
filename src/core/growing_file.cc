#include "core/growing_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "core/files.h"

namespace mbv {

GrowingFile::~GrowingFile() {
  if (file_ >= 0) close(file_);
}

std::string GrowingFile::Trouble(const char* what) const {
  return fmt::format("cannot {} {}: {}", what, path_.string(), std::strerror(errno));
}

std::string GrowingFile::Open(std::uint64_t keep) {
  file_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (file_ < 0) return Trouble("write");
  const auto end = static_cast<off_t>(keep);
  if (ftruncate(file_, end) != 0 || lseek(file_, end, SEEK_SET) != end) return Trouble("cut");
  return "";
}

std::string GrowingFile::Append(std::string_view bytes) {
  return WriteBytes(file_, bytes) ? "" : Trouble("write");
}

std::string GrowingFile::Finish() { return Sync(file_) ? "" : Trouble("write"); }

}  // namespace mbv
