#include "pipeline/foreign_witness.h"

#include "core/text.h"
#include "exchange/mechanism_json.h"
#include "exchange/motion_text.h"
#include "exchange/witness_answer.h"
#include "mjcf/mjcf.h"
#include "pipeline/model_text.h"
#include "pipeline/not_run.h"
#include "pipeline/program_call.h"
#include "reference/forward.h"

namespace mbv {
namespace {

constexpr size_t kMostVersion = 60, kMostReason = 500;  // bytes of what a program says of itself

class ForeignRunner {
 public:
  ForeignRunner(const ForeignWitness& witness, const Prepared& prepared, const Mechanism& mechanism)
      : witness_(witness),
        motion_(prepared.scenario.motion),
        mechanism_(mechanism),
        step_s_(prepared.scenario.simulation.step_s),
        call_(witness) {
    record_.required = witness.required;
    record_.foreign = Witness::Foreign{.program = "",
                                       .limits = witness.limits,
                                       .force_nrmse = witness.force_nrmse,
                                       .declined = {}};
  }

  WitnessRecord Run(const DrivenMotion& driven) {
    std::optional<ProgramFailure> failure;
    std::string trouble = WhyNotAsked();
    if (trouble.empty()) trouble = HandOver(driven);
    if (!trouble.empty()) failure = ProgramFailure{WitnessGap::kNotHandedOver, trouble};
    if (!failure) failure = call_.Run();
    if (!failure) failure = ReadBack();
    record_.name = record_.trace.witness = witness_.name;
    record_.summary =
        failure ? NotRun(Shortened(OneLine(failure->text), 1000)) : RunSummary::Done();
    record_.summary.wall_s = call_.wall_s();
    if (failure) record_.trace = {};
    if (failure) record_.gap = failure->gap;
    return std::move(record_);
  }

 private:
  [[nodiscard]] std::string WhyNotAsked() const {
    for (const Load& load : motion_.loads) {
      if (!load.following.empty()) {
        return "loads that are expressions of the state are not handed to foreign witnesses";
      }
    }
    return "";
  }

  std::string HandOver(const DrivenMotion& driven) {
    HandedMotion handed;
    handed.time_s = times_s_ = SampleTimes(motion_.duration_s, motion_.sample_s);
    std::string trouble = Sample(driven, &handed);
    if (trouble.empty() && motion_.free()) trouble = HandOverFree(&handed);
    const std::pair<const char*, std::string> files[] = {
        {"mechanism.json", MechanismJson(mechanism_)},
        {"motion.csv", MotionCsv(mechanism_, handed)},
        {"loads.csv", LoadsCsv(mechanism_, handed)},
        {"model.xml", WriteMjcf(mechanism_, {.step_s = step_s_})},
        {"model.urdf", ModelText(mechanism_, ModelFormat::kUrdf)}};
    for (const auto& [name, text] : files) {
      if (trouble.empty()) trouble = call_.Give(name, text);
    }
    return trouble;
  }

  std::string Sample(const DrivenMotion& driven, HandedMotion* handed) const {
    CommandSample sample;
    for (const double t_s : handed->time_s) {
      const RunSummary there = driven(t_s, &handed->driven.emplace_back());
      if (!there.ok()) return "there is no drive motion: " + there.message;
      EvaluateMotion(motion_, t_s, &sample);
      handed->loads.push_back(sample.loads);
    }
    return "";
  }

  // What moves by forces: where it starts, and which forces drives push with.
  std::string HandOverFree(HandedMotion* handed) {
    for (const Drive& drive : mechanism_.drives) Tell(drive.name, handed);
    for (const Prescribed& base : mechanism_.prescribed) Tell(base.name, handed);
    for (const DriveForce& force : motion_.forces) handed->forced.push_back(force.drive);
    for (const double t_s : handed->time_s) {
      std::vector<Jet>& jets = handed->forces.emplace_back();
      for (const DriveForce& force : motion_.forces) jets.push_back(Evaluate(force.force, t_s));
    }
    BodyStates start;
    const RunSummary there = InitialStates(mechanism_, motion_, &start);
    if (!there.ok()) return "there is no start: " + there.message;
    const std::string trouble = call_.Give("forces.csv", ForcesCsv(mechanism_, *handed));
    return trouble.empty() ? call_.Give("start.csv", StartCsv(mechanism_, start)) : trouble;
  }

  void Tell(const std::string& name, HandedMotion* handed) const {
    handed->told.push_back(motion_.FindCommand(name) >= 0);
  }

  std::optional<ProgramFailure> ReadBack() {
    const auto json = call_.Text("witness.json");
    if (!json) return ProgramFailure{WitnessGap::kNoAnswer, "left no witness.json" + call_.Said()};
    std::string trouble;
    const auto answer = ReadAnswer(*json, &trouble);
    if (!answer) return ProgramFailure{WitnessGap::kBadAnswer, trouble};
    record_.foreign->program =
        QuotedValue(answer->program) +
        (answer->version.empty() ? "" : " " + QuotedValue(answer->version, kMostVersion));
    for (const auto& [what, why] : answer->declined) {
      record_.foreign->declined.emplace_back(QuotedValue(what), QuotedValue(why, kMostReason));
    }
    record_.foreign->compute_s = answer->compute_s;
    if (!answer->refused.empty()) {
      return ProgramFailure{WitnessGap::kDeclined,
                            "declines: " + QuotedValue(answer->refused, kMostReason)};
    }
    const auto csv = call_.Text("traces.csv");
    if (!csv) return ProgramFailure{WitnessGap::kNoAnswer, "left no traces.csv" + call_.Said()};
    auto trace = ReadWitnessTrace(*csv, mechanism_, times_s_, &trouble);
    if (!trace) return ProgramFailure{WitnessGap::kBadAnswer, trouble};
    record_.trace = std::move(*trace);
    return {};
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
