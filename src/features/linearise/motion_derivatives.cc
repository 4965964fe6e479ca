// Derivatives along a run's motion, both ways.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "base/json_text.h"
#include "features/linearise/linearise.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

struct SampleDerivatives {
  double time_s = kNan, error = kNan, limit = kNan, control = kNan;
  std::string why_not = {};  ///< not empty: there are none

  [[nodiscard]] bool agrees() const { return error <= limit; }
};

struct SampledDerivatives {
  std::string why_not;  ///< not empty: the motion is of a kind that is not served
  std::vector<SampleDerivatives> samples;

  [[nodiscard]] size_t computed() const {
    return static_cast<size_t>(std::ranges::count_if(
        samples, [](const SampleDerivatives& s) { return s.why_not.empty(); }));
  }
  [[nodiscard]] const SampleDerivatives* Worst() const {
    const SampleDerivatives* worst = nullptr;
    for (const SampleDerivatives& s : samples) {
      if (!s.why_not.empty()) continue;
      if (worst == nullptr || s.error / s.limit > worst->error / worst->limit) worst = &s;
    }
    return worst;
  }
  [[nodiscard]] std::string Sentence() const {
    const SampleDerivatives* worst = Worst();
    if (!why_not.empty()) return "there are no derivatives: " + why_not;
    if (worst == nullptr) return "there are no derivatives: " + samples.front().why_not;
    return fmt::format("derivatives of forces {} to {:.1e} at {} of {} samples",
                       worst->agrees() ? "agree" : "DISAGREE", worst->error, computed(),
                       samples.size());
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
  ExactDerivatives dual;
  sample.why_not = DifferentiateExactly(mechanism, motion, model->states(), command, &dual);
  if (!sample.why_not.empty()) return sample;
  const DerivativeScales scales(mechanism, unit, by, dual.force);
  sample.error = scales.Error(by, dual.by_position, dual.by_velocity, dual.by_acceleration);
  sample.limit = DualLimit(sample.control);
  return sample;
}

SampledDerivatives Compute(const Mechanism& mechanism, const Motion& motion, size_t count,
                           const std::function<void(double)>& progress) {
  SampledDerivatives result;
  if (motion.free()) {
    result.why_not = "a free motion: forces are given, and motions are integrated";
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
  return result;
}

ReportSection SectionOf(const SampledDerivatives& result) {
  ReportSection section{.title = "Derivatives of forces", .link = "Derivatives"};
  section.Add(Paragraph{result.Sentence()});
  Table table{.columns = {Digits("t, s"), Digits("error"), Digits("limit"), Text(""), Wide("")}};
  for (const SampleDerivatives& s : result.samples) {
    if (!s.why_not.empty()) {
      table.rows.push_back(
          {fmt::format("{:.4g}", s.time_s), "–", "–", Cell("none", Mark::kOff), s.why_not});
      continue;
    }
    table.rows.push_back(
        {fmt::format("{:.4g}", s.time_s), fmt::format("{:.1e}", s.error),
         fmt::format("{:.1e}", s.limit),
         Cell(s.agrees() ? "agrees" : "differs", s.agrees() ? Mark::kOk : Mark::kFail), ""});
  }
  section.Add(std::move(table), On::kPage);
  section.Note(
      "∂f/∂q, ∂f/∂v and ∂f/∂a of the forces along the commands: by implicit differentiation of the "
      "reference, and by dual numbers through another formulation; of the largest entries.");
  return section;
}

nlohmann::ordered_json JsonOf(const SampledDerivatives& result) {
  const auto number = [](double x) {
    return std::isfinite(x) ? nlohmann::ordered_json(x) : nlohmann::ordered_json();
  };
  nlohmann::ordered_json json = {{"sentence", result.Sentence()}, {"why_not", result.why_not}};
  json["samples"] = nlohmann::ordered_json::array();
  for (const SampleDerivatives& s : result.samples) {
    json["samples"].push_back({{"time_s", s.time_s},
                               {"error", number(s.error)},
                               {"limit", number(s.limit)},
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
