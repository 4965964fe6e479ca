#include "pipeline/program_call.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/files.h"
#include "core/worker_pool.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerMb = 1e6;
constexpr size_t kMostLog = 200;  // characters of what a program said last
constexpr const char* kLog = "log";

// A program that stands beside ours is found there, as those are that are built with it.
std::string OursOr(const std::string& program) {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / program;
  const bool plain = program.find('/') == std::string::npos;
  return plain && !error && fs::is_regular_file(beside, error) ? beside.string() : program;
}

}  // namespace

std::string ProgramCall::Give(const std::string& name, const std::string& text) const {
  if (!folder_.trouble().empty()) return folder_.trouble();
  return WriteFile(folder_.path() / name, text, false);
}

std::string ProgramCall::Run() {
  if (!folder_.trouble().empty()) return folder_.trouble();
  WorkerJob job{.argv = witness_.command, .log = folder_.path() / kLog};
  job.argv.front() = OursOr(job.argv.front());
  job.folder = folder_.path();
  job.data_bytes = witness_.memory_mb * kBytesPerMb;
  job.file_bytes = witness_.output_mb * kBytesPerMb;
  WorkerEnd end;
  WorkerPool pool;
  pool.timeout_s = witness_.timeout_s;
  pool.ended = [&](size_t, const WorkerEnd& how) { end = how; };
  if (!pool.Run({job})) return "was stopped";
  wall_s_ = end.cost.wall_s;
  if (end.timed_out) return fmt::format("took longer than {:g} s", witness_.timeout_s) + Said();
  if (!end.trouble.empty()) return fmt::format("'{}' {}", job.argv.front(), end.trouble) + Said();
  if (end.signal != 0) return fmt::format("was ended by signal {}", end.signal) + Said();
  if (end.exit_code != 0) return fmt::format("ended with exit code {}", end.exit_code) + Said();
  return "";
}

std::string ProgramCall::Said() const {
  std::string log = Text(kLog).value_or("");
  while (!log.empty() && static_cast<unsigned char>(log.back()) <= ' ') log.pop_back();
  const size_t line = log.rfind('\n');
  if (line != std::string::npos) log = log.substr(line + 1);
  for (char& c : log) {
    if (static_cast<unsigned char>(c) < ' ') c = ' ';
  }
  return log.empty() ? "" : ": " + log.substr(0, kMostLog);
}

std::optional<std::string> ProgramCall::Text(const std::string& name) const {
  std::error_code error;
  const auto bytes = fs::file_size(folder_.path() / name, error);
  if (error || static_cast<double>(bytes) > witness_.output_mb * kBytesPerMb) return {};
  return ReadWholeFile(folder_.path() / name);
}

}  // namespace mbv
