#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

namespace mbv {

namespace {

namespace fs = std::filesystem;

constexpr const char* kSelf = "/proc/self/exe";

std::string Reason() { return std::strerror(errno); }

// Temporary files of `path` are called this and six random letters.
std::string TemporaryPrefix(const fs::path& path) {
  return fmt::format(".{}.mbverify-", path.filename().string().substr(0, 200));
}

// A new file beside `path`, locked as long as it is open; -1 with errno.
int MakeTemporary(const fs::path& path, mode_t mode, std::string* name) {
  const fs::path folder = path.parent_path();
  for (int attempt = 0; attempt < 100; ++attempt) {
    *name = (folder / (TemporaryPrefix(path) + RandomLetters())).string();
    const int file = open(name->c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
    if (file < 0 && errno == EEXIST) continue;
    if (file < 0) return -1;
    // A sweep may come between, until the file is locked; where files cannot be, none can.
    struct stat status {};
    const bool swept = flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!swept && fstat(file, &status) == 0 && status.st_nlink > 0) return file;
    close(file);
  }
  errno = EEXIST;
  return -1;
}

// "" or the reason.
std::string Replace(const fs::path& path, const std::string& content, const struct stat* old) {
  // A file that the user protected is not replaced by way of its folder.
  if (old != nullptr && access(path.c_str(), W_OK) != 0) return Reason();
  std::string temporary;
  const int file = MakeTemporary(path, 0666, &temporary);
  if (file < 0) return Reason();
  std::string reason;
  if (old != nullptr) (void)fchmod(file, old->st_mode & 07777);
  if (!WriteAll(file, content)) reason = Reason();
  if (reason.empty() && rename(temporary.c_str(), path.c_str()) != 0) reason = Reason();
  if (!reason.empty()) unlink(temporary.c_str());
  close(file);
  if (reason.empty()) SyncFolder(path.has_parent_path() ? path.parent_path() : fs::path("."));
  return reason;
}

// A reader that goes away is a failed write, not the end of this process.
class WithoutSigpipe {
 public:
  WithoutSigpipe() : old_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~WithoutSigpipe() { std::signal(SIGPIPE, old_); }
  WithoutSigpipe(const WithoutSigpipe&) = delete;
  WithoutSigpipe& operator=(const WithoutSigpipe&) = delete;

 private:
  void (*old_)(int);
};

std::string WriteThrough(const fs::path& path, const std::string& content) {
  const int file = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOCTTY | O_CLOEXEC, 0666);
  if (file < 0) return Reason();
  const WithoutSigpipe guard;
  const bool written = WriteAll(file, content);
  const std::string reason = written ? "" : Reason();
  close(file);
  return reason;
}

void AddFilesBelow(const fs::path& folder, const std::string& ending,
                   std::vector<std::string>* files, std::vector<std::string>* unread) {
  std::error_code error;
  std::vector<fs::path> folders;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unknown;
    if (entry->symlink_status(unknown).type() == fs::file_type::directory) {
      folders.push_back(entry->path());
    } else if ((ending.empty() || entry->path().extension() == ending) &&
               entry->is_regular_file(unknown)) {
      files->push_back(entry->path());
    }
  }
  if (error)
    unread->push_back(
        fmt::format("{}: error: cannot be read: {}", folder.string(), error.message()));
  for (const fs::path& below : folders) AddFilesBelow(below, ending, files, unread);
}

}  // namespace

std::vector<std::string> FilesBelow(const fs::path& folder, const std::string& ending,
                                    std::vector<std::string>* unread) {
  std::vector<std::string> files;
  AddFilesBelow(folder, ending, &files, unread);
  std::sort(files.begin(), files.end());
  return files;
}

void SweepTemporaries(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end;
       !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename();
    const size_t mark = name.size() < 16 ? 0 : name.size() - 16;  // ".mbverify-" and six letters
    if (name.starts_with('.') && mark > 0 && name.compare(mark, 10, ".mbverify-") == 0) {
      found.push_back(entry->path());
    }
  }
  for (const fs::path& stale : found) {
    const int file = open(stale.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (file < 0) continue;
    // No process holds the lock of what a killed writer left.
    struct stat status {};
    if (fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_uid == geteuid() &&
        flock(file, LOCK_EX | LOCK_NB) == 0) {
      unlink(stale.c_str());
    }
    close(file);
  }
}

bool WriteBytes(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = write(descriptor, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    if (n == 0) {
      errno = ENOSPC;
      return false;
    }
    bytes.remove_prefix(static_cast<size_t>(n));
  }
  return true;
}

bool Sync(int descriptor) {
  // Pipes, devices and some file systems have nothing to make durable.
  return fsync(descriptor) == 0 || errno == EINVAL || errno == EROFS || errno == ENOTSUP;
}

bool WriteAll(int descriptor, std::string_view content) {
  return WriteBytes(descriptor, content) && Sync(descriptor);
}

void SyncFolder(const fs::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  close(descriptor);
}

std::string WriteFile(const fs::path& path, const std::string& content, bool sweep) {
  std::error_code error;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), error);
  struct stat status {};
  const bool exists = lstat(path.c_str(), &status) == 0;
  std::string reason;
  if (exists && !S_ISREG(status.st_mode)) {
    reason = WriteThrough(path, content);
  } else {
    if (sweep) SweepTemporaries(path.parent_path());
    reason = Replace(path, content, exists ? &status : nullptr);
  }
  return reason.empty() ? "" : fmt::format("cannot write {}: {}", path.string(), reason);
}

std::optional<std::string> ReadWholeFile(const fs::path& path) {
  const int file = open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return std::nullopt;
  struct stat status {};
  std::optional<std::string> text;
  if (fstat(file, &status) == 0 && S_ISREG(status.st_mode)) text.emplace();
  std::array<char, 65536> buffer{};
  while (text) {
    const ssize_t n = read(file, buffer.data(), buffer.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) text.reset();
    if (n <= 0) break;
    text->append(buffer.data(), static_cast<size_t>(n));
  }
  close(file);
  return text;
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

std::string Fingerprint::Text() const {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) text += kDigits[(hash_ >> shift) & 15U];
  return text;
}

std::string RandomLetters() {
  static constexpr char kLetters[] = "abcdefghijklmnopqrstuvwxyz012345";  // 32 of them
  std::array<unsigned char, 6> bytes{};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    static unsigned count = 0;  // names need only be new; O_EXCL sees to the rest
    const unsigned seed = static_cast<unsigned>(getpid()) * 2654435761U + ++count;
    for (size_t i = 0; i < bytes.size(); ++i) {
      bytes[i] = static_cast<unsigned char>(seed >> (5 * i));
    }
  }
  std::string letters;
  for (const unsigned char byte : bytes) letters += kLetters[byte % 32];
  return letters;
}

fs::path MakePrivateFolder(const fs::path& prefix) {
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    const fs::path folder = prefix.string() + RandomLetters();
    if (mkdir(folder.c_str(), S_IRWXU) == 0) return folder;
    if (errno != EEXIST) break;
  }
  return {};
}

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

std::filesystem::path ProgramCalled(const std::string& name) {
  std::error_code error;
  if (name.find('/') != std::string::npos) return fs::canonical(name, error);
  const char* variable = std::getenv("PATH");
  std::istringstream folders(variable != nullptr ? variable : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path file = fs::path(folder.empty() ? "." : folder) / name;
    if (access(file.c_str(), X_OK) == 0 && fs::is_regular_file(file, error)) {
      return fs::canonical(file, error);
    }
  }
  return {};
}

std::filesystem::path ProgramFile() {
  std::error_code error;
  const auto file = std::filesystem::read_symlink(kSelf, error);
  return error ? ProgramCalled(program_invocation_name) : file;
}

std::string ProgramToStart() { return access(kSelf, X_OK) == 0 ? kSelf : ProgramFile().string(); }

namespace {

constexpr size_t kLongestPart = 200;  // bytes; file systems take 255, endings are added

bool IsNameCharacter(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u < 0x80 && (std::isalnum(u) != 0 || c == '_');
}

bool IsLetter(char c) {
  return IsNameCharacter(c) && std::isalpha(static_cast<unsigned char>(c)) != 0;
}

bool IsPlainCharacter(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u >= 0x20 && u != 0x7F && c != '\\';
}

std::vector<std::string_view> PartsOf(std::string_view path) {
  std::vector<std::string_view> parts;
  for (size_t at = 0; at <= path.size();) {
    const size_t end = std::min(path.find('/', at), path.size());
    parts.push_back(path.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

}  // namespace

bool IsName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && IsLetter(name[0]) &&
         std::all_of(name.begin(), name.end(), IsNameCharacter);
}

std::string NearestName(const std::string& name) {
  std::string near;
  for (const char c : name.substr(0, kLongestName)) near += IsNameCharacter(c) ? c : '_';
  while (!near.empty() && !IsLetter(near[0])) near.erase(near.begin());
  while (!near.empty() && near.back() == '_') near.pop_back();
  return near;
}

bool IsPlainPath(std::string_view path) {
  const std::vector<std::string_view> parts = PartsOf(path);
  return std::all_of(parts.begin(), parts.end(), [](std::string_view part) {
    return !part.empty() && part[0] != '.' && part.size() <= kLongestPart &&
           std::all_of(part.begin(), part.end(), IsPlainCharacter);
  });
}

std::string NearestPlainPath(std::string_view path) {
  std::string near;
  for (const std::string_view part : PartsOf(path)) {
    if (part.empty()) continue;
    if (!near.empty()) near += '/';
    near += part[0] == '.' ? '_' : IsPlainCharacter(part[0]) ? part[0] : '_';
    for (const char c : part.substr(1, kLongestPart - 1)) near += IsPlainCharacter(c) ? c : '_';
  }
  return near;
}

}  // namespace mbv
