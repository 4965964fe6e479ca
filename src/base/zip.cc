#include "base/zip.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zip.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <memory>
#include <set>

#include "base/files.h"
#include "base/text.h"

namespace mbv {
namespace {

constexpr zip_uint16_t kFirstDosDate = 1 << 5 | 1;  // 1980-01-01, the first that ZIP knows
constexpr zip_uint32_t kPlainMode = S_IFREG | 0644, kProgramMode = S_IFREG | 0755;
constexpr int kModeShift = 16;  // of Unix modes in the external attributes

struct ArchiveDiscard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};
struct SourceFree {
  void operator()(zip_source_t* source) const { zip_source_free(source); }
};
struct EntryClose {
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};
using Archive = std::unique_ptr<zip_t, ArchiveDiscard>;
using Source = std::unique_ptr<zip_source_t, SourceFree>;

std::string Reason(zip_error_t* error) {
  std::string text = zip_error_strerror(error);
  zip_error_fini(error);
  return text;
}

// An archive in memory; `source` outlives it.
Archive Open(zip_source_t* source, int flags, std::string* trouble) {
  zip_error_t error;
  zip_error_init(&error);
  // The archive takes one reference, the caller keeps another.
  zip_source_keep(source);
  Archive archive(zip_open_from_source(source, flags, &error));
  if (archive == nullptr) {
    zip_source_free(source);
    *trouble = Reason(&error);
  }
  return archive;
}

// The entry is borrowed until the archive is written.
bool Add(zip_t* archive, const ArchiveEntry& entry) {
  zip_source_t* content = zip_source_buffer(archive, entry.content.data(), entry.content.size(), 0);
  if (content == nullptr) return false;
  const zip_int64_t index = zip_file_add(archive, entry.path.c_str(), content, ZIP_FL_ENC_UTF_8);
  if (index < 0) {
    zip_source_free(content);
    return false;
  }
  const auto at = static_cast<zip_uint64_t>(index);
  const zip_uint32_t mode = entry.executable ? kProgramMode : kPlainMode;
  return zip_file_set_dostime(archive, at, 0, kFirstDosDate, 0) == 0 &&
         zip_file_set_external_attributes(archive, at, 0, ZIP_OPSYS_UNIX, mode << kModeShift) == 0;
}

std::optional<std::string> BytesOf(zip_source_t* source) {
  zip_stat_t stat;
  if (zip_source_stat(source, &stat) != 0 || zip_source_open(source) != 0) return {};
  std::string bytes(stat.size, '\0');
  const zip_int64_t count = zip_source_read(source, bytes.data(), bytes.size());
  zip_source_close(source);
  if (count < 0 || static_cast<zip_uint64_t>(count) != stat.size) return {};
  return bytes;
}

constexpr const char* kNotOurs = "mbverify package writes no such archive";

// Plain files and folders, not encrypted; else what is wrong. `executable` if it is.
std::string NotPlainReason(zip_t* archive, const zip_stat_t& stat, bool* executable) {
  if ((stat.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && stat.encryption_method != ZIP_EM_NONE) {
    return "is encrypted";
  }
  zip_uint8_t system = 0;
  zip_uint32_t attributes = 0;
  if (zip_file_get_external_attributes(archive, stat.index, 0, &system, &attributes) != 0 ||
      system != ZIP_OPSYS_UNIX) {
    return "";
  }
  const zip_uint32_t mode = attributes >> kModeShift, kind = mode & S_IFMT;
  *executable = (mode & S_IXUSR) != 0;
  if (kind == 0 || kind == S_IFREG || kind == S_IFDIR) return "";
  return fmt::format("is {}, no plain file", S_ISLNK(kind) ? "a link" : "a device");
}

// True of archives with the 64-bit directory, whose number of entries is without a bound (libzip
// keeps all of them).
bool IsZip64(const std::string& file) {
  constexpr std::streamoff kTail = 22 + 65535, kLocator = 20;  // directory's end and comment
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  const std::streamoff size = stream.tellg();
  const std::streamoff from = std::max<std::streamoff>(0, size - kTail - kLocator);
  if (!stream || !stream.seekg(from)) return false;
  const std::string tail(std::istreambuf_iterator<char>(stream), {});
  const size_t end = tail.rfind("PK\5\6");
  return end != std::string::npos && end >= kLocator && tail.substr(end - kLocator, 4) == "PK\6\7";
}

}  // namespace

std::optional<std::string> WriteZip(std::vector<ArchiveEntry> entries, std::string* trouble) {
  std::ranges::sort(entries, {}, &ArchiveEntry::path);
  zip_error_t error;
  zip_error_init(&error);
  const Source source(zip_source_buffer_create(nullptr, 0, 0, &error));
  if (source == nullptr) {
    *trouble = Reason(&error);
    return {};
  }
  Archive archive = Open(source.get(), ZIP_TRUNCATE, trouble);
  if (archive == nullptr) return {};
  for (const ArchiveEntry& entry : entries) {
    if (Add(archive.get(), entry)) continue;
    *trouble = fmt::format("{}: {}", entry.path, zip_strerror(archive.get()));
    return {};
  }
  if (zip_close(archive.get()) != 0) {
    *trouble = zip_strerror(archive.get());
    return {};
  }
  (void)archive.release();
  auto bytes = BytesOf(source.get());
  if (!bytes) *trouble = "the archive cannot be read back";
  return bytes;
}

ZipFile::ZipFile(const std::string& file, const ArchiveLimits& limits, Diagnostics* diagnostics)
    : file_(file), limits_(limits), diagnostics_(diagnostics) {
  Diagnostics found;
  diagnostics_ = &found;
  if (Open()) List();
  diagnostics_ = diagnostics;
  diagnostics_->Append(found);
  if (found.has_errors()) entries_.clear();
}

ZipFile::~ZipFile() {
  if (archive_ != nullptr) zip_discard(archive_);
}

void ZipFile::Refuse(const std::string& message, const std::string& hint) {
  diagnostics_->AddError(file_, message, hint);
}

bool ZipFile::Open() {
  if (IsZip64(file_)) {
    Refuse("is a ZIP64 archive", kNotOurs);
    return false;
  }
  int code = 0;
  archive_ = zip_open(file_.c_str(), ZIP_RDONLY, &code);
  std::string trouble;
  if (archive_ == nullptr) {
    zip_error_t error;
    zip_error_init_with_code(&error, code);
    trouble = Reason(&error);
  } else if (zip_get_num_entries(archive_, 0) == 0) {
    trouble = "it is empty";
  }
  if (!trouble.empty()) Refuse("is not a ZIP archive: " + trouble, "fetch it again");
  return trouble.empty();
}

void ZipFile::List() {
  const auto count = static_cast<zip_uint64_t>(zip_get_num_entries(archive_, 0));
  if (count > limits_.entries) {
    return Refuse(fmt::format("holds {} files, more than {}", count, limits_.entries), kNotOurs);
  }
  for (zip_uint64_t i = 0; i < count; ++i) ListEntry(i);
  std::uint64_t bytes = 0;
  for (const ListedEntry& entry : entries_) {
    bytes += std::min(entry.bytes, limits_.bytes + 1);  // no sum of theirs overflows
    if (bytes <= limits_.bytes) continue;
    Refuse(fmt::format("unpacks to more than {} MB (at '{}')", limits_.bytes >> 20,
                       Printable(entry.path)),
           kNotOurs);
    break;
  }
  std::ranges::sort(entries_, {}, &ListedEntry::path);
  CheckFolders();
}

void ZipFile::ListEntry(std::uint64_t index) {
  zip_stat_t stat;
  constexpr zip_uint64_t kNeeded = ZIP_STAT_NAME | ZIP_STAT_SIZE | ZIP_STAT_INDEX;
  if (zip_stat_index(archive_, index, 0, &stat) != 0 || (stat.valid & kNeeded) != kNeeded) {
    return Refuse(fmt::format("entry {} cannot be read: {}", index, zip_strerror(archive_)), "");
  }
  ListedEntry entry{.path = stat.name, .bytes = stat.size, .index = index};
  const bool folder = entry.path.ends_with('/');
  if (folder) entry.path.pop_back();
  const std::string shown = Printable(entry.path);
  if (!IsPlainPath(entry.path) || FindNonName(entry.path) != std::string::npos) {
    return Refuse(fmt::format("'{}' leads outside of the archive, or is not a plain path", shown),
                  kNotOurs);
  }
  if (const std::string why = NotPlainReason(archive_, stat, &entry.executable); !why.empty()) {
    return Refuse(fmt::format("'{}' {}", shown, why), kNotOurs);
  }
  if (!folder) entries_.push_back(std::move(entry));
}

// No file twice, and none below another.
void ZipFile::CheckFolders() {
  std::set<std::string> paths;
  for (const ListedEntry& entry : entries_) {
    if (!paths.insert(entry.path).second) {
      Refuse("holds '" + Printable(entry.path) + "' twice", kNotOurs);
    }
  }
  for (const std::string& path : paths) {
    for (size_t at = path.find('/'); at != std::string::npos; at = path.find('/', at + 1)) {
      if (!paths.contains(path.substr(0, at))) continue;
      Refuse(fmt::format("'{}' is a file and the folder of '{}'", Printable(path.substr(0, at)),
                         Printable(path)),
             kNotOurs);
    }
  }
}

bool ZipFile::Read(const ListedEntry& entry, const std::function<bool(std::string_view)>& take) {
  const std::string shown = Printable(entry.path);
  const std::unique_ptr<zip_file_t, EntryClose> file(zip_fopen_index(archive_, entry.index, 0));
  if (file == nullptr) {
    Refuse(fmt::format("'{}' cannot be read: {}", shown, zip_strerror(archive_)), "");
    return false;
  }
  std::uint64_t left = entry.bytes;
  std::array<char, 1 << 16> piece;
  zip_int64_t count = 0;
  while ((count = zip_fread(file.get(), piece.data(), piece.size())) > 0) {
    if (static_cast<std::uint64_t>(count) > left) {
      Refuse(fmt::format("'{}' is longer than the archive says", shown), kNotOurs);
      return false;
    }
    left -= static_cast<std::uint64_t>(count);
    if (!take({piece.data(), static_cast<size_t>(count)})) return false;
  }
  if (count == 0 && left == 0) return true;
  Refuse(fmt::format("'{}' is damaged: {}", shown,
                     count == 0 ? "it ends early" : zip_file_strerror(file.get())),
         "fetch the archive again");
  return false;
}

}  // namespace mbv
