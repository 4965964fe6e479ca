// Which files a computation read: loaders report each one.
#pragma once

#include <string>
#include <vector>

namespace mbv {

/// A file that a loader read.
struct InputFile {
  std::string file;         ///< as it was opened
  std::string fingerprint;  ///< of the bytes that were read
};

/// Fingerprint of a file's content as NoteInput() gives it.
[[nodiscard]] std::string ContentFingerprint(const std::string& content);

/// Called by whatever reads an input file. Reported to every InputWatch of this thread.
void NoteInput(const std::string& file, const std::string& content);

/// Collects what is read in this thread while it lives.
class InputWatch {
 public:
  InputWatch();
  ~InputWatch();
  InputWatch(const InputWatch&) = delete;
  InputWatch& operator=(const InputWatch&) = delete;

  /// In the order first read, each file once.
  [[nodiscard]] const std::vector<InputFile>& files() const { return files_; }

 private:
  friend void NoteInput(const std::string& file, const std::string& content);
  std::vector<InputFile> files_;
  InputWatch* outer_;
};

/// The file of `inputs` that `path` is, under any name (links included); "" if it is not one of
/// them.
[[nodiscard]] std::string SameFile(const std::string& path, const std::vector<InputFile>& inputs);

}  // namespace mbv
