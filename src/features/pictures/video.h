// Videos: frames of one size piped into ffmpeg, where it is installed.
#pragma once

#include <sys/types.h>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/scratch_folder.h"
#include "render/render.h"
#include "verify/pictures.h"

namespace mbv {

/// How a video file is written, by its ending.
enum class VideoFormat { kAnimatedPng, kFfmpeg, kUnknown };

/// .png, .apng: animated PNG, needs nothing; .mp4, .mkv, .webm, .gif: by ffmpeg.
[[nodiscard]] VideoFormat VideoFormatOf(const std::string& file);

/// "" if a video of this name can be written here, else what is missing and what would do.
[[nodiscard]] std::string CheckVideo(const std::string& file);

/// Encodes frames as they come; the video is built in a file of its own in the temporary folder.
class VideoEncoder {
 public:
  /// the ending of `file` gives the format.
  VideoEncoder(std::string file, double frames_per_s);
  ~VideoEncoder();
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  /// All frames have the size of the first. False when ffmpeg is gone: see Finish().
  [[nodiscard]] bool Add(const Picture& picture);
  /// Ends the video and reads it into `content`. "" or what went wrong.
  [[nodiscard]] std::string Finish(std::string* content);

 private:
  [[nodiscard]] bool Start(const Picture& picture);
  [[nodiscard]] std::filesystem::path Film() const;  // where ffmpeg writes
  [[nodiscard]] std::string LogTail() const;

  const std::string file_;
  const double frames_per_s_;
  std::optional<ScratchFolder> folder_;  // the video and ffmpeg's log
  std::string trouble_;
  int pipe_ = -1;
  pid_t pid_ = -1;
  void (*old_sigpipe_)(int) = nullptr;
};

// Animated PNG: a video that every browser plays and that needs no codec.

/// Joins PNG pictures of one size and colour type into an endless animation.
/// [APNG Specification 1.0: acTL, fcTL, fdAT]
[[nodiscard]] std::string AnimatedPng(const std::vector<PictureFile>& pictures,
                                      double frames_per_s);

}  // namespace mbv
