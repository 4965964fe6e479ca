#include "pipeline/foreign_witness.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "core/files.h"
#include "core/scratch_folder.h"
#include "core/worker_pool.h"
#include "exchange/mechanism_json.h"
#include "exchange/motion_text.h"
#include "exchange/witness_answer.h"
#include "pipeline/model_text.h"
#include "pipeline/not_run.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kBytesPerMb = 1e6;
constexpr size_t kMostLog = 200;  // characters of what a program said last

// A program that stands beside ours is found there, as those are that are built with it.
std::string OursOr(const std::string& program) {
  std::error_code error;
  const fs::path beside = fs::read_symlink("/proc/self/exe", error).parent_path() / program;
  const bool plain = program.find('/') == std::string::npos;
  return plain && !error && fs::is_regular_file(beside, error) ? beside.string() : program;
}

class ForeignRunner {
 public:
  ForeignRunner(const ForeignWitness& witness, const Prepared& prepared, const Mechanism& mechanism)
      : witness_(witness),
        motion_(prepared.scenario.motion),
        mechanism_(mechanism),
        scratch_("witness") {
    record_.foreign = Witness::Foreign{.program = "",
                                       .limits = witness.limits,
                                       .force_nrmse = witness.force_nrmse,
                                       .declined = {}};
  }

  WitnessRecord Run(const DrivenMotion& driven) {
    std::string trouble = WhyNotAsked();
    if (trouble.empty()) trouble = scratch_.trouble();
    if (trouble.empty()) trouble = HandOver(driven);
    if (trouble.empty()) trouble = Call();
    if (trouble.empty()) trouble = ReadBack();
    record_.name = record_.trace.witness = witness_.name;
    record_.summary = trouble.empty() ? RunSummary::Done() : NotRun(trouble);
    record_.summary.wall_s = wall_s_;
    if (!trouble.empty()) record_.trace = {};
    return std::move(record_);
  }

 private:
  [[nodiscard]] std::string WhyNotAsked() const {
    if (motion_.free()) return "free motions are not handed to foreign witnesses";
    for (const Load& load : motion_.loads) {
      if (!load.following.empty()) {
        return "loads that are expressions of the state are not handed to foreign witnesses";
      }
    }
    return "";
  }

  std::string HandOver(const DrivenMotion& driven) {
    HandedMotion handed;
    handed.time_s = SampleTimes(motion_.duration_s, motion_.sample_s);
    CommandSample sample;
    for (const double t_s : handed.time_s) {
      const RunSummary there = driven(t_s, &handed.driven.emplace_back());
      if (!there.ok()) return "there is no drive motion: " + there.message;
      EvaluateMotion(motion_, t_s, &sample);
      handed.loads.push_back(sample.loads);
    }
    times_s_ = handed.time_s;
    const std::pair<const char*, std::string> files[] = {
        {"mechanism.json", MechanismJson(mechanism_)},
        {"motion.csv", MotionCsv(mechanism_, handed)},
        {"loads.csv", LoadsCsv(mechanism_, handed)},
        {"model.xml", MjcfFor(mechanism_, ModelDrives::kHeld).text},
        {"model.urdf", ModelText(mechanism_, ModelFormat::kUrdf)}};
    for (const auto& [name, text] : files) {
      const std::string trouble = WriteFile(scratch_.path() / name, text, false);
      if (!trouble.empty()) return trouble;
    }
    return "";
  }

  std::string Call() {
    WorkerJob job{.argv = witness_.command, .log = scratch_.path() / "log"};
    job.argv.front() = OursOr(job.argv.front());
    job.folder = scratch_.path();
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

  // The last line that the program printed.
  [[nodiscard]] std::string Said() const {
    std::string log = Text("log").value_or("");
    while (!log.empty() && static_cast<unsigned char>(log.back()) <= ' ') log.pop_back();
    const size_t line = log.rfind('\n');
    if (line != std::string::npos) log = log.substr(line + 1);
    for (char& c : log) {
      if (static_cast<unsigned char>(c) < ' ') c = ' ';
    }
    return log.empty() ? "" : ": " + log.substr(0, kMostLog);
  }

  // Of a file in the folder that is not longer than it may be.
  [[nodiscard]] std::optional<std::string> Text(const char* name) const {
    std::error_code error;
    const auto bytes = fs::file_size(scratch_.path() / name, error);
    if (error || static_cast<double>(bytes) > witness_.output_mb * kBytesPerMb) return {};
    return ReadWholeFile(scratch_.path() / name);
  }

  std::string ReadBack() {
    const auto json = Text("witness.json");
    if (!json) return "left no witness.json" + Said();
    std::string trouble;
    const auto answer = ReadAnswer(*json, &trouble);
    if (!answer) return trouble;
    record_.foreign->program =
        answer->program + (answer->version.empty() ? "" : " " + answer->version);
    record_.foreign->declined = answer->declined;
    if (!answer->refused.empty()) return "declines: " + answer->refused;
    const auto csv = Text("traces.csv");
    if (!csv) return "left no traces.csv" + Said();
    auto trace = ReadWitnessTrace(*csv, mechanism_, times_s_, &trouble);
    if (trace) record_.trace = std::move(*trace);
    return trouble;
  }

  const ForeignWitness& witness_;
  const Motion& motion_;
  const Mechanism& mechanism_;
  ScratchFolder scratch_;
  std::vector<double> times_s_;
  double wall_s_ = 0.0;
  WitnessRecord record_;
};

}  // namespace

WitnessRecord RunForeign(const ForeignWitness& witness, const Prepared& prepared,
                         const Mechanism& mechanism, const DrivenMotion& driven) {
  return ForeignRunner(witness, prepared, mechanism).Run(driven);
}

}  // namespace mbv
