#include "base/inputs.h"

#include <algorithm>
#include <filesystem>

#include "base/files.h"

namespace mbv {
namespace {

thread_local InputWatch* innermost = nullptr;

}  // namespace

std::string ContentFingerprint(const std::string& content) {
  Fingerprint fingerprint;
  fingerprint.Add(content);
  return fingerprint.Text();
}

void NoteInput(const std::string& file, const std::string& content) {
  if (innermost == nullptr) return;
  const std::string fingerprint = ContentFingerprint(content);
  for (InputWatch* watch = innermost; watch != nullptr; watch = watch->outer_) {
    const bool known = std::any_of(watch->files_.begin(), watch->files_.end(),
                                   [&](const InputFile& input) { return input.file == file; });
    if (!known) watch->files_.push_back({file, fingerprint});
  }
}

InputWatch::InputWatch() : outer_(innermost) { innermost = this; }

InputWatch::~InputWatch() { innermost = outer_; }

std::string SameFile(const std::string& path, const std::vector<InputFile>& inputs) {
  for (const InputFile& input : inputs) {
    std::error_code error;
    if (std::filesystem::equivalent(path, input.file, error) && !error) return input.file;
  }
  return "";
}

}  // namespace mbv
