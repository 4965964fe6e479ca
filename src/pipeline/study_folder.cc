#include "pipeline/study_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "core/files.h"
#include "core/json_document.h"
#include "core/json_text.h"
#include "core/output_folder.h"
#include "core/state_folder.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStudySchema = "mbverify.study/1";

// The file's bytes, piece by piece; what cannot be read any more ends it early, which `size` tells.
FileContent ContentOf(const fs::path& path, std::uint64_t* size) {
  return [path, size](const std::function<void(std::string_view)>& write) {
    std::ifstream stream(path, std::ios::binary);
    std::string piece(1 << 20, '\0');
    while (stream) {
      stream.read(piece.data(), static_cast<std::streamsize>(piece.size()));
      write(std::string_view(piece.data(), static_cast<size_t>(stream.gcount())));
      *size += static_cast<std::uint64_t>(stream.gcount());
    }
  };
}

StudyIdentity IdentityOf(const JsonValue& json) {
  StudyIdentity identity{json.at("study"), json.at("file"), json.at("fingerprint"), {}, {}, {}};
  if (json.contains("count")) identity.drawn.count = json.at("count").get<std::uint64_t>();
  if (json.contains("seed")) identity.drawn.seed = json.at("seed").get<std::uint64_t>();
  const JsonValue shard = json.at("shard");
  identity.share.count = shard.at(1).get<std::uint64_t>();
  identity.share.index = shard.at(0).get<std::uint64_t>() - 1;
  if (identity.share.index >= identity.share.count) {
    shard.Refuse(fmt::format("says {} of {}", identity.share.index + 1, identity.share.count));
  }
  identity.points = json.value("points", "");
  return identity;
}

std::string NameOf(const StudyIdentity& identity) {
  if (identity.share.count == 1) return identity.study;
  return fmt::format("{}.shard-{}-of-{}", identity.study, identity.share.index + 1,
                     identity.share.count);
}

}  // namespace

std::string ToJson(const StudyIdentity& identity) {
  nlohmann::ordered_json json = {{"schema", kStudySchema},
                                 {"study", identity.study},
                                 {"file", identity.file},
                                 {"fingerprint", identity.fingerprint},
                                 {"shard", {identity.share.index + 1, identity.share.count}},
                                 {"points", identity.points}};
  if (identity.drawn.count) json["count"] = *identity.drawn.count;
  if (identity.drawn.seed) json["seed"] = *identity.drawn.seed;
  return Dump(json);
}

std::optional<StudyIdentity> ReadIdentity(const fs::path& folder, std::optional<Finding>* damage) {
  const fs::path file = folder / kStudyFile;
  const auto text = ReadWholeFile(file);
  if (!text) return {};
  auto identity = ReadJson(*text, IdentityOf, kStudySchema);
  if (!identity && damage != nullptr) *damage = identity.refusal.FindingIn(file.string());
  return std::move(identity.value);
}

std::string PointsFingerprint(const fs::path& folder) {
  Fingerprint fingerprint;
  for (const char* grown : {kPointsFile, kForcesFile}) {
    std::uint64_t size = 0;
    ContentOf(folder / grown,
              &size)([&](std::string_view piece) { fingerprint.Add(std::string(piece)); });
  }
  return fingerprint.Text();
}

StudyFolder::StudyFolder(const fs::path& out, const StudyIdentity& identity)
    : out_(out), identity_(identity), name_(NameOf(identity)) {
  target_ = out_ / name_;
  path_ = out_ / (name_ + ".part");
}

StudyFolder::~StudyFolder() {
  if (lock_ >= 0) close(lock_);
}

std::optional<Finding> StudyFolder::Open(bool resume) {
  const auto refused = [&](std::string why, std::string hint) {
    return Finding{.file = path_.string(), .message = std::move(why), .hint = std::move(hint)};
  };
  const char* const elsewhere = "choose another folder with --out";
  std::error_code error;
  fs::create_directories(out_, error);
  const bool is_new = !error && fs::create_directory(path_, error);
  if (error) return refused("cannot make the folder: " + error.message(), elsewhere);
  lock_ = LockFolder(path_);
  if (lock_ < 0) {
    const bool held = errno == EWOULDBLOCK;
    return refused(std::string("cannot use the folder: ") +
                       (held ? "another process computes this study there" : std::strerror(errno)),
                   elsewhere);
  }
  std::optional<Finding> damage;
  const auto left = is_new ? std::nullopt : ReadIdentity(path_, &damage);
  if (damage) {
    if (damage->hint.empty()) {
      damage->hint = "remove " + path_.string() + ", or choose another folder with --out";
    }
    return damage;
  }
  if (left && left->fingerprint != identity_.fingerprint) {
    return refused("holds points of another study, or of files that have changed since",
                   "remove that folder, or choose another one with --out");
  }
  if (left && !resume) {
    return refused("holds points of this study that was not finished",
                   "--resume goes on with them; to start anew remove that folder");
  }
  if (!is_new && !left && !fs::is_empty(path_, error)) {
    return refused("is a folder of something else", elsewhere);
  }
  if (left) return {};
  const std::string trouble = WriteFile(path_ / kStudyFile, ToJson(identity_));
  if (trouble.empty()) return {};
  return Finding{.file = "", .message = trouble, .hint = elsewhere};
}

std::string StudyFolder::Publish(const std::vector<std::pair<std::string, std::string>>& files) {
  OutputFolder folder(out_, name_);
  std::string trouble = folder.Create();
  for (const char* grown : {kPointsFile, kForcesFile}) {
    std::uint64_t size = 0;
    std::error_code error;
    if (trouble.empty()) trouble = folder.Write(grown, ContentOf(path_ / grown, &size));
    if (trouble.empty() && size != fs::file_size(path_ / grown, error)) {
      trouble = fmt::format("cannot read {}", (path_ / grown).string());
    }
  }
  for (const auto& [name, content] : files) {
    if (trouble.empty()) trouble = folder.Write(name, content);
  }
  identity_.points = PointsFingerprint(path_);
  if (trouble.empty()) trouble = folder.Write(kStudyFile, ToJson(identity_));
  if (trouble.empty()) trouble = folder.Commit();
  if (!trouble.empty()) return trouble;
  std::error_code error;
  for (const char* ours : {kPointsFile, kForcesFile, kStudyFile}) fs::remove(path_ / ours, error);
  fs::remove(path_, error);  // unless somebody else put something there
  return "";
}

}  // namespace mbv
