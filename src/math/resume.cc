#include "math/resume.h"

#include <unistd.h>
#include <array>
#include <cerrno>
#include <utility>

#include "base/output_folder.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEnding = ".log";
constexpr std::uint64_t kLargest = 1ULL << 32U;  // a result

std::uint64_t Sum(const std::string& bytes) {
  Fingerprint sum;
  sum.Add(bytes);
  return std::stoull(sum.Text(), nullptr, 16);
}

}  // namespace

// The identity, then of each result its size, its sum, and itself.
ResultLog::ResultLog(fs::path file, std::string identity)
    : file_(std::move(file)), from_(file_, std::ios::binary) {
  std::string there(identity.size(), '\0');
  from_.read(there.data(), static_cast<std::streamsize>(there.size()));
  if (from_ && there == identity) {
    end_ = last_ = identity.size();
    return;
  }
  from_.close();
  to_ = std::make_unique<GrowingFile>(file_);
  if (!to_->Open(0).empty() || !to_->Append(identity).empty()) file_.clear();
}

bool ResultLog::Next(std::string* bytes) {
  if (!from_.is_open()) return false;
  std::array<std::uint64_t, 2> head{};
  from_.read(reinterpret_cast<char*>(head.data()), sizeof head);
  if (from_ && head[0] < kLargest) {
    bytes->assign(head[0], '\0');
    from_.read(bytes->data(), static_cast<std::streamsize>(head[0]));
    if (from_ && Sum(*bytes) == head[1]) {
      last_ = std::exchange(end_, end_ + sizeof head + head[0]);
      ++kept_;
      return true;
    }
  }
  last_ = end_;
  Forget();
  return false;
}

void ResultLog::Forget() {
  end_ = last_;
  from_.close();
  to_ = std::make_unique<GrowingFile>(file_);
  if (!to_->Open(end_).empty()) file_.clear();
}

void ResultLog::Append(const std::string& bytes) {
  const std::array<std::uint64_t, 2> head = {bytes.size(), Sum(bytes)};
  std::string record(reinterpret_cast<const char*>(head.data()), sizeof head);
  record += bytes;
  // A full disk keeps nothing more.
  if (!to_->Append(record).empty()) file_.clear();
}

ResumeFolder::ResumeFolder(fs::path folder, std::string identity)
    : folder_(std::move(folder)), identity_(std::move(identity)) {
  std::error_code error;
  for (fs::path p = folder_; !p.empty() && !fs::exists(p, error); p = p.parent_path()) {
    made_.push_back(p);
  }
  fs::create_directories(folder_, error);
  lock_ = LockFolder(folder_);
  taken_ = lock_ < 0 && errno == EWOULDBLOCK;
  if (lock_ < 0) return;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    std::ifstream from(entry.path(), std::ios::binary);
    std::string there(identity_.size(), '\0');
    from.read(there.data(), static_cast<std::streamsize>(there.size()));
    resumes_ = resumes_ || (from && there == identity_);
  }
}

void ResumeFolder::Forget() {
  if (lock_ < 0) return;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path().extension() == kEnding) fs::remove(entry.path(), error);
  }
  resumes_ = false;
}

ResumeFolder::~ResumeFolder() {
  if (lock_ < 0) return;
  Forget();
  std::error_code error;
  // Unless something else is in them.
  fs::remove(folder_, error);
  for (const fs::path& made : made_) fs::remove(made, error);
  close(lock_);
}

ResultLog ResumeFolder::Log(const std::string& name) const {
  return lock_ < 0 ? ResultLog() : ResultLog(folder_ / (name + kEnding), identity_);
}

}  // namespace mbv
