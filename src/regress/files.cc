#include "regress/files.h"

#include <fcntl.h>
#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool WriteAll(int descriptor, const std::string& content) {
  size_t done = 0;
  while (done < content.size()) {
    const ssize_t n = write(descriptor, content.data() + done, content.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<size_t>(n);
  }
  return fsync(descriptor) == 0;
}

}  // namespace

std::string WriteDurably(const fs::path& path, const std::string& content) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  const std::string temporary = fmt::format("{}.tmp-{}", path.string(), getpid());
  errno = 0;
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  const bool written = descriptor >= 0 && WriteAll(descriptor, content);
  std::string reason = written ? "" : std::strerror(errno);
  if (descriptor >= 0) close(descriptor);
  if (reason.empty()) {
    fs::rename(temporary, path, error);
    if (!error) return "";
    reason = error.message();
  }
  fs::remove(temporary, error);
  return fmt::format("cannot write {}: {}", path.string(), reason);
}

std::optional<std::string> ReadWholeFile(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

void Fingerprint::Mix(const char* bytes, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    hash_ = (hash_ ^ static_cast<unsigned char>(bytes[i])) * 1099511628211ULL;
  }
}

void Fingerprint::Add(const std::string& bytes) {
  const std::uint64_t size = bytes.size();
  Mix(reinterpret_cast<const char*>(&size), sizeof size);
  Mix(bytes.data(), bytes.size());
}

void Fingerprint::AddFile(const fs::path& path) {
  Add(path.filename().string());
  Add(ReadWholeFile(path).value_or("(no such file)"));
}

std::string Fingerprint::Text() const { return fmt::format("{:016x}", hash_); }

std::string WithoutControls(const std::string& text) {
  std::string clean;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == 0x1b && i + 1 < text.size() && text[i + 1] == '[') {  // a terminal's colour
      i += 2;
      while (i < text.size() && (text[i] < '@' || text[i] > '~')) ++i;
      continue;
    }
    if (c >= 0x20 || c == '\n' || c == '\t') clean += text[i];
  }
  return clean;
}

std::string LastLines(const std::string& text, int count) {
  const std::string clean = WithoutControls(text);
  const size_t end = clean.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  size_t at = end;
  for (int i = 0; i < count; ++i) {
    const size_t newline = clean.rfind('\n', at);
    if (newline == std::string::npos || newline == 0) return clean.substr(0, end + 1);
    at = newline - 1;
  }
  return clean.substr(at + 2, end - at - 1);
}

std::string UtcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace mbv
