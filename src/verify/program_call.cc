#include "verify/program_call.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "base/files.h"
#include "base/text.h"
#include "base/worker_pool.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerMb = 1e6;
constexpr size_t kMostLog = 200;  // characters of what a program said last
constexpr const char* kLog = "log";

constexpr const char* kInstalled[] = {"mbverify-witness-simbody", "mbverify-witness-ode",
                                      "mbverify-witness-mujoco"};

fs::path FolderOfMbverify() { return ProgramFile().parent_path(); }

}  // namespace

bool IsInstalledProgram(const std::string& program) {
  std::error_code error;
  return std::ranges::find(kInstalled, program) != std::end(kInstalled) &&
         fs::is_regular_file(FolderOfMbverify() / program, error);
}

// The program runs in another folder.
std::vector<std::string> CommandWords(const std::string& typed) {
  std::vector<std::string> words;
  for (size_t at = 0; at < typed.size();) {
    const size_t end = std::min(typed.find(' ', at), typed.size());
    std::error_code error;
    if (end > at) {
      std::string& word = words.emplace_back(typed.substr(at, end - at));
      if (fs::is_regular_file(word, error)) word = fs::absolute(word).string();
    }
    at = end + 1;
  }
  return words;
}

std::string ProgramCall::WriteInput(const std::string& name, const std::string& text) const {
  if (!folder_.trouble().empty()) return folder_.trouble();
  return WriteFile(folder_.path() / name, text, false);
}

std::optional<ProgramFailure> ProgramCall::Run() {
  if (!folder_.trouble().empty()) return ProgramFailure{.text = folder_.trouble()};
  const auto program = FindProgram(witness_.command.front());
  if (!program) {
    return ProgramFailure{.text = fmt::format("'{}' could not be started: there is no such program",
                                              QuotedValue(witness_.command.front()))};
  }
  WorkerJob job{.argv = witness_.command, .log = folder_.path() / kLog};
  job.argv.front() = *program;
  job.folder = folder_.path();
  job.data_bytes = witness_.memory_mb * kBytesPerMb;
  job.file_bytes = witness_.output_mb * kBytesPerMb;
  job.environment = BareEnvironment();
  WorkerEnd end;
  WorkerPool pool;
  pool.timeout_s = witness_.timeout_s;
  pool.ended = [&](size_t, const WorkerEnd& how) { end = how; };
  if (!pool.Run({job})) return ProgramFailure{WitnessGap::kSignal, "was stopped"};
  wall_s_ = end.cost.wall_s;
  cpu_s_ = end.cost.cpu_s;
  const auto failed = [&](WitnessGap gap, const std::string& how) {
    return ProgramFailure{gap, how + OutputTail()};
  };
  if (end.timed_out) {
    return failed(WitnessGap::kTimedOut,
                  fmt::format("took longer than {:g} s", witness_.timeout_s));
  }
  if (!end.trouble.empty()) {
    return failed(WitnessGap::kNotStarted,
                  fmt::format("'{}' {}", QuotedValue(job.argv.front()), end.trouble));
  }
  if (end.signal != 0) {
    return failed(WitnessGap::kSignal, fmt::format("was ended by signal {}", end.signal));
  }
  if (end.exit_code != 0) {
    return failed(WitnessGap::kExitCode, fmt::format("ended with exit code {}", end.exit_code));
  }
  return {};
}

std::string ProgramCall::OutputTail() const {
  std::string log = Text(kLog).value_or("");
  while (!log.empty() && static_cast<unsigned char>(log.back()) <= ' ') log.pop_back();
  const size_t line = log.rfind('\n');
  if (line != std::string::npos) log = log.substr(line + 1);
  return log.empty() ? "" : ": " + QuotedValue(log, kMostLog);
}

std::optional<std::string> ProgramCall::Text(const std::string& name) const {
  std::error_code error;
  const auto bytes = fs::file_size(folder_.path() / name, error);
  if (error || static_cast<double>(bytes) > witness_.output_mb * kBytesPerMb) return {};
  return ReadWholeFile(folder_.path() / name);
}

}  // namespace mbv
