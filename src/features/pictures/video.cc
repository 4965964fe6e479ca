#include "features/pictures/video.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "base/demand.h"
#include "base/files.h"

extern char** environ;

namespace mbv {
namespace {

namespace fs = std::filesystem;

// Codec options by ending. Players want even sizes and 4:2:0 colours; a video that starts before
// it is loaded whole has its index in front.
const std::map<std::string, std::vector<std::string>> kCodecs = {
    {".mp4",
     {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18", "-pix_fmt",
      "yuv420p", "-movflags", "+faststart"}},
    {".mkv",
     {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-c:v", "libx264", "-crf", "18", "-pix_fmt",
      "yuv420p"}},
    {".webm", {"-c:v", "libvpx-vp9", "-crf", "30", "-b:v", "0", "-pix_fmt", "yuv420p"}},
    {".gif", {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"}},
};

std::string EndingOf(const std::string& file) { return fs::path(file).extension().string(); }

bool IsInstalled(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (!folder.empty() && access((folder + "/" + program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

}  // namespace

VideoFormat VideoFormatOf(const std::string& file) {
  const std::string ending = EndingOf(file);
  if (ending == ".png" || ending == ".apng") return VideoFormat::kAnimatedPng;
  return kCodecs.contains(ending) ? VideoFormat::kFfmpeg : VideoFormat::kUnknown;
}

std::string CheckVideo(const std::string& file) {
  switch (VideoFormatOf(file)) {
    case VideoFormat::kAnimatedPng:
      return "";
    case VideoFormat::kUnknown:
      return fmt::format(
          "--video {}: no known video format; the name must end in .mp4, .mkv, .webm, .gif, or in "
          ".png or .apng (animated PNG)",
          file);
    case VideoFormat::kFfmpeg:
      break;
  }
  if (IsInstalled("ffmpeg")) return "";
  return fmt::format(
      "--video {}: ffmpeg is needed for {} and is not installed; install it (Debian: apt install "
      "ffmpeg), or write an animated PNG: --video {}",
      file, EndingOf(file), fs::path(file).replace_extension(".png").string());
}

VideoEncoder::VideoEncoder(std::string file, double frames_per_s)
    : file_(std::move(file)), frames_per_s_(frames_per_s) {
  MBV_DEMAND(VideoFormatOf(file_) == VideoFormat::kFfmpeg, file_);
  // A dead ffmpeg is a failed write, not the end of this process.
  old_sigpipe_ = std::signal(SIGPIPE, SIG_IGN);
}

VideoEncoder::~VideoEncoder() {
  if (pipe_ >= 0) close(pipe_);
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::signal(SIGPIPE, old_sigpipe_);
}

bool VideoEncoder::Start(const Picture& picture) {
  folder_.emplace("video");
  trouble_ = folder_->trouble();
  if (!trouble_.empty()) return false;
  std::vector<std::string> words = {
      "ffmpeg",    "-hide_banner",
      "-loglevel", "error",
      "-f",        "rawvideo",
      "-pix_fmt",  "rgb24",
      "-s",        fmt::format("{}x{}", picture.width, picture.height),
      "-r",        fmt::format("{}", frames_per_s_),
      "-i",        "-"};
  const auto& codec = kCodecs.at(EndingOf(file_));
  words.insert(words.end(), codec.begin(), codec.end());
  words.push_back(Film());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) {
    trouble_ = fmt::format("cannot make a pipe: {}", std::strerror(errno));
    return false;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, (folder_->path() / "log").c_str(),
                                   O_WRONLY | O_CREAT, 0600);
  const int failure = posix_spawnp(&pid_, "ffmpeg", &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[0]);
  pipe_ = ends[1];
  if (failure == 0) return true;
  pid_ = -1;
  trouble_ = fmt::format("cannot start ffmpeg: {}", std::strerror(failure));
  return false;
}

bool VideoEncoder::Add(const Picture& picture) {
  if (pid_ < 0 && (!trouble_.empty() || !Start(picture))) return false;
  const auto* at = reinterpret_cast<const char*>(picture.rgb.data());
  for (size_t left = picture.rgb.size(); left > 0;) {
    const ssize_t written = write(pipe_, at, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    at += written;
    left -= static_cast<size_t>(written);
  }
  return true;
}

fs::path VideoEncoder::Film() const { return folder_->path() / ("video" + EndingOf(file_)); }

std::string VideoEncoder::LogTail() const {
  const std::string log = ReadWholeFile(folder_->path() / "log").value_or("");
  return log.empty() ? "no message" : log.substr(log.size() - std::min<size_t>(log.size(), 400));
}

std::string VideoEncoder::Finish(std::string* content) {
  if (!trouble_.empty()) return trouble_;
  if (pid_ < 0) return "no frame was drawn";
  close(pipe_);
  pipe_ = -1;
  int status = 0;
  waitpid(pid_, &status, 0);
  pid_ = -1;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return "ffmpeg failed: " + LogTail();
  *content = ReadWholeFile(Film()).value_or("");
  return content->empty() ? "ffmpeg wrote nothing: " + LogTail() : "";
}

namespace {

constexpr size_t kSignature = 8;

std::uint32_t ReadU32(std::string_view bytes, size_t at) {
  std::uint32_t value = 0;
  for (size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

std::string U32(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string U16(std::uint32_t value) {
  return {static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string Chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const uLong crc =
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return U32(static_cast<std::uint32_t>(data.size())) + checked +
         U32(static_cast<std::uint32_t>(crc));
}

// The data of all chunks of one type.
std::vector<std::string> ChunksOf(std::string_view png, std::string_view type) {
  std::vector<std::string> chunks;
  for (size_t at = kSignature; at + 12 <= png.size();) {
    const size_t length = ReadU32(png, at);
    MBV_DEMAND(at + 12 + length <= png.size(), length);
    if (png.substr(at + 4, 4) == type) chunks.emplace_back(png.substr(at + 8, length));
    at += 12 + length;
  }
  return chunks;
}

}  // namespace

std::string AnimatedPng(const std::vector<PictureFile>& pictures, double frames_per_s) {
  MBV_DEMAND(!pictures.empty(), pictures.size());
  const std::string& first = pictures.front().content;
  const std::string header = ChunksOf(first, "IHDR").at(0);
  std::string text = first.substr(0, kSignature) + Chunk("IHDR", header);
  const auto frames = static_cast<std::uint32_t>(pictures.size());
  text += Chunk("acTL", U32(frames) + U32(0));
  const std::string delay =
      U16(1000) + U16(static_cast<std::uint32_t>(std::lround(1000 * frames_per_s)));
  std::uint32_t sequence = 0;
  for (const PictureFile& picture : pictures) {
    // Whole frame at (0, 0), no disposal, no blending.
    text += Chunk("fcTL", U32(sequence++) + header.substr(0, 8) + U32(0) + U32(0) + delay +
                              std::string(2, '\0'));
    for (const std::string& data : ChunksOf(picture.content, "IDAT")) {
      text += &picture == &pictures.front() ? Chunk("IDAT", data)
                                            : Chunk("fdAT", U32(sequence++) + data);
    }
  }
  return text + Chunk("IEND", "");
}

}  // namespace mbv
