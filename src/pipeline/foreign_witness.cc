#include "pipeline/foreign_witness.h"

#include "exchange/mechanism_json.h"
#include "exchange/motion_text.h"
#include "exchange/witness_answer.h"
#include "mjcf/mjcf.h"
#include "pipeline/model_text.h"
#include "pipeline/not_run.h"
#include "pipeline/program_call.h"

namespace mbv {
namespace {

class ForeignRunner {
 public:
  ForeignRunner(const ForeignWitness& witness, const Prepared& prepared, const Mechanism& mechanism)
      : witness_(witness),
        motion_(prepared.scenario.motion),
        mechanism_(mechanism),
        step_s_(prepared.scenario.simulation.step_s),
        call_(witness) {
    record_.foreign = Witness::Foreign{.program = "",
                                       .limits = witness.limits,
                                       .force_nrmse = witness.force_nrmse,
                                       .declined = {}};
  }

  WitnessRecord Run(const DrivenMotion& driven) {
    std::string trouble = WhyNotAsked();
    if (trouble.empty()) trouble = HandOver(driven);
    if (trouble.empty()) trouble = call_.Run();
    if (trouble.empty()) trouble = ReadBack();
    record_.name = record_.trace.witness = witness_.name;
    record_.summary = trouble.empty() ? RunSummary::Done() : NotRun(trouble);
    record_.summary.wall_s = call_.wall_s();
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
        {"model.xml", WriteMjcf(mechanism_, {.step_s = step_s_})},
        {"model.urdf", ModelText(mechanism_, ModelFormat::kUrdf)}};
    for (const auto& [name, text] : files) {
      const std::string trouble = call_.Give(name, text);
      if (!trouble.empty()) return trouble;
    }
    return "";
  }

  std::string ReadBack() {
    const auto json = call_.Text("witness.json");
    if (!json) return "left no witness.json" + call_.Said();
    std::string trouble;
    const auto answer = ReadAnswer(*json, &trouble);
    if (!answer) return trouble;
    record_.foreign->program =
        answer->program + (answer->version.empty() ? "" : " " + answer->version);
    record_.foreign->declined = answer->declined;
    record_.foreign->compute_s = answer->compute_s;
    if (!answer->refused.empty()) return "declines: " + answer->refused;
    const auto csv = call_.Text("traces.csv");
    if (!csv) return "left no traces.csv" + call_.Said();
    auto trace = ReadWitnessTrace(*csv, mechanism_, times_s_, &trouble);
    if (trace) record_.trace = std::move(*trace);
    return trouble;
  }

  const ForeignWitness& witness_;
  const Motion& motion_;
  const Mechanism& mechanism_;
  const double step_s_;
  ProgramCall call_;
  std::vector<double> times_s_;
  WitnessRecord record_;
};

}  // namespace

WitnessRecord RunForeign(const ForeignWitness& witness, const Prepared& prepared,
                         const Mechanism& mechanism, const DrivenMotion& driven) {
  return ForeignRunner(witness, prepared, mechanism).Run(driven);
}

}  // namespace mbv
