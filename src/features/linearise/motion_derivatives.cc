// Derivatives along a run's motion, both ways.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/json_text.h"
#include "base/text.h"
#include "features/linearise/linearise.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

struct SampleDerivatives {
  double time_s = kNan, control = kNan;
  /// Of the forces along the commands; NaN with friction by load, which depends on where forces
  /// act.
  double error = kNan, limit = kNan;
  std::string why_not = {};  ///< not empty: there are none
  JudgedForces every = {};   ///< drive forces and reactions
  std::string no_every = {};

  [[nodiscard]] bool judged() const { return why_not.empty(); }
  /// Of the limits, the larger one.
  [[nodiscard]] double share() const {
    return std::fmax(error / limit, no_every.empty() ? every.dual_error / every.dual_limit : kNan);
  }
  [[nodiscard]] bool agrees() const { return share() <= 1.0; }
  [[nodiscard]] double worst() const {
    return std::fmax(error, no_every.empty() ? every.dual_error : kNan);
  }
};

struct SampledDerivatives {
  std::string why_not;  ///< not empty: the motion is of a kind that is not served
  std::vector<SampleDerivatives> samples;
  std::vector<std::string> left_out;  ///< sentences

  [[nodiscard]] size_t computed() const {
    return static_cast<size_t>(std::ranges::count_if(samples, &SampleDerivatives::judged));
  }
  [[nodiscard]] const SampleDerivatives* Worst() const {
    const SampleDerivatives* worst = nullptr;
    for (const SampleDerivatives& s : samples) {
      if (s.judged() && (worst == nullptr || s.share() > worst->share())) worst = &s;
    }
    return worst;
  }
  [[nodiscard]] std::string Sentence() const {
    const SampleDerivatives* worst = Worst();
    if (!why_not.empty()) return "there are no derivatives: " + why_not;
    if (worst == nullptr) return "there are no derivatives: " + samples.front().why_not;
    const bool reactions = std::ranges::any_of(
        samples, [](const SampleDerivatives& s) { return s.judged() && s.no_every.empty(); });
    return fmt::format("derivatives of forces{} {} to {:.1e} at {} of {} samples",
                       reactions ? " and reactions" : "", worst->agrees() ? "agree" : "DISAGREE",
                       worst->worst(), computed(), samples.size());
  }
};

SampleDerivatives Differentiate(const Mechanism& mechanism, const Motion& motion, const VecX& unit,
                                const CommandSample& command, ReducedModel* model) {
  SampleDerivatives sample{.time_s = command.time_s, .control = model->sample().control};
  MatX T;
  ForceDerivatives by;
  RunSummary summary = model->Motions(&T);
  if (summary.ok()) summary = model->Derivatives(T, command.loads, &by);
  sample.why_not = summary.message;
  if (!summary.ok()) return sample;
  sample.no_every = JudgeEveryForce(mechanism, motion, unit, command, T, model, &sample.every);
  if (model->friction_by_load() != nullptr) {
    sample.why_not = sample.no_every;
    return sample;
  }
  ExactDerivatives dual;
  sample.why_not = DifferentiateExactly(mechanism, motion, model->states(), command, &dual);
  if (!sample.why_not.empty()) return sample;
  sample.error = DerivativeScales(mechanism, unit, unit, by).Error(by, dual);
  sample.limit = DualLimit(sample.control);
  return sample;
}

// What of drive forces and reactions has no derivatives, and what exerts the forces.
void SayWhatIsLeftOut(const Mechanism& mechanism, SampledDerivatives* result) {
  constexpr size_t kMostNamed = 8;
  std::set<std::string> shared, none;
  bool of_commands = false;
  for (const SampleDerivatives& s : result->samples) {
    if (!s.judged()) continue;
    if (!s.no_every.empty()) {
      none.insert(s.no_every);
      continue;
    }
    of_commands = of_commands || !s.every.by.of_drives;
    for (std::string& name : s.every.NotUnique(mechanism)) shared.insert(std::move(name));
  }
  for (const std::string& why : none) {
    result->left_out.push_back("drive forces and reactions have none: " + why);
  }
  if (of_commands) {
    result->left_out.emplace_back(
        "drives are too few, or share their forces: reactions are those under forces along the "
        "commands");
  }
  if (shared.empty()) return;
  const std::vector<std::string> names(shared.begin(), shared.end());
  result->left_out.push_back(
      fmt::format("{} of {} components of reactions are not compared, redundant constraints share "
                  "them: {}",
                  names.size(), 6 * mechanism.joints.size(), Joined(names, kMostNamed)));
}

SampledDerivatives Compute(const Mechanism& mechanism, const Motion& motion, size_t count,
                           const std::function<void(double)>& progress) {
  SampledDerivatives result;
  if (motion.free()) {
    result.why_not = "forces are given, and the motion is integrated";
    return result;
  }
  if (!motion.switches.empty()) {
    result.why_not = "elements are switched";
    return result;
  }
  const std::vector<double> times = SampleTimes(motion.duration_s, motion.sample_s);
  std::set<size_t> chosen;
  const size_t spread = count == 0 ? times.size() : std::min(count, times.size());
  for (size_t k = 0; k < spread; ++k) {
    chosen.insert(spread == 1 ? 0 : k * (times.size() - 1) / (spread - 1));
  }
  ReducedModel model(mechanism, motion.commands);
  model.Explain(false);
  VecX unit(model.size());
  const double length = CharacteristicLength(mechanism);
  for (Eigen::Index k = 0; k < unit.size(); ++k) {
    const Command& command = motion.commands[static_cast<size_t>(k)];
    unit[k] = IsLength(mechanism, command.terms.front().coordinate) ? length : 1.0;
  }
  CommandSample command;
  for (size_t i = 0; i <= *chosen.rbegin(); ++i) {
    EvaluateMotion(motion, times[i], &command);
    command.time_s = times[i];
    const RunSummary moved = model.Move(command.position, command.velocity, command.acceleration);
    if (!moved.ok()) {
      result.samples.push_back({.time_s = times[i], .why_not = moved.message});
      break;
    }
    if (chosen.count(i) == 0) continue;
    result.samples.push_back(Differentiate(mechanism, motion, unit, command, &model));
    if (progress) {
      progress(static_cast<double>(result.samples.size()) / static_cast<double>(chosen.size()));
    }
  }
  SayWhatIsLeftOut(mechanism, &result);
  return result;
}

ReportSection SectionOf(const SampledDerivatives& result) {
  ReportSection section{.title = "Derivatives of forces", .link = "Derivatives"};
  section.Add(Paragraph{result.Sentence()});
  Table table{.columns = {Digits("t, s"), Digits("along commands"), Digits("limit"),
                          Digits("drives and reactions"), Digits("limit"), Text(""), Wide("")}};
  const auto number = [](double x) { return std::isnan(x) ? "–" : fmt::format("{:.1e}", x); };
  for (const SampleDerivatives& s : result.samples) {
    if (!s.judged()) {
      table.rows.push_back({fmt::format("{:.4g}", s.time_s), "–", "–", "–", "–",
                            Cell("none", Mark::kOff), s.why_not});
      continue;
    }
    table.rows.push_back(
        {fmt::format("{:.4g}", s.time_s), number(s.error), number(s.limit),
         number(s.every.dual_error), number(s.every.dual_limit),
         Cell(s.agrees() ? "agrees" : "differs", s.agrees() ? Mark::kOk : Mark::kFail), ""});
  }
  section.Add(std::move(table), On::kPage);
  for (const std::string& sentence : result.left_out) section.Note(sentence);
  section.Note(
      "Derivatives by positions, rates and accelerations of the commands: of the forces along "
      "them, "
      "and of drive forces and joint reactions; by implicit differentiation of the reference, and "
      "by dual numbers through another formulation; of the largest entries.");
  return section;
}

nlohmann::ordered_json JsonOf(const SampledDerivatives& result) {
  const auto number = [](double x) {
    return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json();
  };
  nlohmann::ordered_json json = {
      {"sentence", result.Sentence()}, {"why_not", result.why_not}, {"left_out", result.left_out}};
  json["samples"] = nlohmann::ordered_json::array();
  for (const SampleDerivatives& s : result.samples) {
    json["samples"].push_back({{"time_s", s.time_s},
                               {"error", number(s.error)},
                               {"limit", number(s.limit)},
                               {"every_error", number(s.every.dual_error)},
                               {"every_limit", number(s.every.dual_limit)},
                               {"control", number(s.control)},
                               {"why_not", s.why_not}});
  }
  return json;
}

}  // namespace

void AddDerivatives(const Prepared& prepared, size_t samples,
                    const std::function<void(double)>& progress, Report* report) {
  const SampledDerivatives result =
      Compute(prepared.base, prepared.scenario.motion, samples, progress);
  Comparison& comparison = report->comparison;
  comparison.reason += "; " + result.Sentence();
  const SampleDerivatives* worst = result.Worst();
  if (worst != nullptr && !worst->agrees() && comparison.verdict == Verdict::kAgree) {
    comparison.verdict = Verdict::kDisagree;
    comparison.reason = result.Sentence();
  }
  report->parts.push_back({"derivatives", SectionOf(result), Dump(JsonOf(result))});
}

}  // namespace mbv
