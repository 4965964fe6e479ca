#include "archive/zip.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zip.h>

#include <algorithm>
#include <memory>
#include <set>

#include "core/names.h"
#include "core/text.h"

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

class ZipReader {
 public:
  ZipReader(zip_t* archive, const std::string& file, const ArchiveLimits& limits,
            Diagnostics* diagnostics)
      : archive_(archive), file_(file), limits_(limits), diagnostics_(diagnostics) {}

  std::vector<ArchiveEntry> Read() {
    const auto count = static_cast<zip_uint64_t>(zip_get_num_entries(archive_, 0));
    if (count > limits_.entries) {
      Refuse(fmt::format("holds {} files, more than {}", count, limits_.entries), kNotOurs);
      return {};
    }
    for (zip_uint64_t i = 0; i < count && !full_; ++i) ReadEntry(i);
    std::ranges::sort(entries_, {}, &ArchiveEntry::path);
    CheckFolders();
    return std::move(entries_);
  }

 private:
  static constexpr const char* kNotOurs = "mbverify package writes no such archive";

  void Refuse(const std::string& message, const std::string& hint) {
    diagnostics_->AddError(file_, message, hint);
  }

  void ReadEntry(zip_uint64_t i) {
    zip_stat_t stat;
    if (zip_stat_index(archive_, i, 0, &stat) != 0 || (stat.valid & ZIP_STAT_NAME) == 0) {
      return Refuse(fmt::format("entry {} cannot be read: {}", i, zip_strerror(archive_)), "");
    }
    std::string path = stat.name;
    const bool folder = path.ends_with('/');
    if (folder) path.pop_back();
    const std::string shown = Printable(path);
    if (!IsPlainPath(path) || FindNonName(path) != std::string::npos) {
      return Refuse(fmt::format("'{}' leads outside of the archive, or is no plain path", shown),
                    kNotOurs);
    }
    bool executable = false;
    if (!CheckKind(i, stat, shown, &executable) || folder) return;
    if (!paths_.insert(path).second) return Refuse("holds '" + shown + "' twice", kNotOurs);
    if (auto content = ReadContent(i, stat, shown)) {
      entries_.push_back({path, *std::move(content), executable});
    }
  }

  // Plain files and folders, not encrypted.
  bool CheckKind(zip_uint64_t i, const zip_stat_t& stat, const std::string& shown,
                 bool* executable) {
    if ((stat.valid & ZIP_STAT_ENCRYPTION_METHOD) != 0 && stat.encryption_method != ZIP_EM_NONE) {
      Refuse("'" + shown + "' is encrypted", kNotOurs);
      return false;
    }
    zip_uint8_t system = 0;
    zip_uint32_t attributes = 0;
    if (zip_file_get_external_attributes(archive_, i, 0, &system, &attributes) != 0) return true;
    if (system != ZIP_OPSYS_UNIX) return true;
    const zip_uint32_t mode = attributes >> kModeShift, kind = mode & S_IFMT;
    *executable = (mode & S_IXUSR) != 0;
    if (kind == 0 || kind == S_IFREG || kind == S_IFDIR) return true;
    Refuse(fmt::format("'{}' is {}, no plain file", shown, S_ISLNK(kind) ? "a link" : "a device"),
           kNotOurs);
    return false;
  }

  // One byte more than is left is asked for: what an archive says of its sizes may be wrong.
  std::optional<std::string> ReadContent(zip_uint64_t i, const zip_stat_t& stat,
                                         const std::string& shown) {
    const std::unique_ptr<zip_file_t, EntryClose> entry(zip_fopen_index(archive_, i, 0));
    if (entry == nullptr) {
      Refuse(fmt::format("'{}' cannot be read: {}", shown, zip_strerror(archive_)), "");
      return {};
    }
    std::string content;
    if ((stat.valid & ZIP_STAT_SIZE) != 0) content.reserve(std::min(stat.size, limits_.bytes));
    char piece[1 << 16];
    zip_int64_t count = 0;
    while ((count = zip_fread(entry.get(), piece, sizeof piece)) > 0) {
      read_ += static_cast<std::uint64_t>(count);
      if (read_ > limits_.bytes) {
        full_ = true;
        Refuse(fmt::format("unpacks to more than {} MB (at '{}')", limits_.bytes >> 20, shown),
               kNotOurs);
        return {};
      }
      content.append(piece, static_cast<size_t>(count));
    }
    if (count == 0) return content;
    Refuse(fmt::format("'{}' is damaged: {}", shown, zip_file_strerror(entry.get())),
           "fetch the archive again");
    return {};
  }

  // No file lies below another.
  void CheckFolders() {
    for (const std::string& path : paths_) {
      for (size_t at = path.find('/'); at != std::string::npos; at = path.find('/', at + 1)) {
        if (!paths_.contains(path.substr(0, at))) continue;
        Refuse(fmt::format("'{}' is a file and the folder of '{}'", Printable(path.substr(0, at)),
                           Printable(path)),
               kNotOurs);
      }
    }
  }

  zip_t* archive_;
  const std::string& file_;
  const ArchiveLimits& limits_;
  Diagnostics* diagnostics_;
  std::vector<ArchiveEntry> entries_;
  std::set<std::string> paths_;
  std::uint64_t read_ = 0;
  bool full_ = false;
};

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

std::optional<std::vector<ArchiveEntry>> ReadZip(const std::string& bytes, const std::string& file,
                                                 const ArchiveLimits& limits,
                                                 Diagnostics* diagnostics) {
  zip_error_t error;
  zip_error_init(&error);
  const Source source(zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error));
  std::string trouble;
  if (source == nullptr) trouble = Reason(&error);
  const Archive archive = source == nullptr ? nullptr : Open(source.get(), ZIP_RDONLY, &trouble);
  if (archive != nullptr && zip_get_num_entries(archive.get(), 0) == 0) trouble = "it is empty";
  if (!trouble.empty()) {
    diagnostics->AddError(file, "is no ZIP archive: " + trouble, "fetch it again");
    return {};
  }
  Diagnostics found;
  auto entries = ZipReader(archive.get(), file, limits, &found).Read();
  diagnostics->Append(found);
  if (found.has_errors()) return {};
  return entries;
}

}  // namespace mbv
