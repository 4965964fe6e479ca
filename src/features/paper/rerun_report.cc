#include "features/paper/rerun_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "comparison/table_tube.h"
#include "mechanism/reach.h"

namespace mbv {

namespace {

// The table of a packed trace: exact, so that its tubes are the stated limits.
AlignedTable ExactTable(Trace trace) {
  AlignedTable table;
  table.name = "packed";
  table.standard = table.bound = MatX::Zero(trace.values.rows(), trace.values.cols());
  table.trace = std::move(trace);
  table.coverage = 1.0;
  return table;
}

// Forces that friction at rest leaves open are NaN in both.
void AgreeOnUnknown(Trace* a, Trace* b) {
  for (Eigen::Index c = 0; c < a->values.cols(); ++c) {
    for (Eigen::Index i = 0; i < a->values.rows(); ++i) {
      double& x = a->values(i, c);
      double& y = b->values(i, c);
      if (std::isnan(x) && std::isnan(y)) x = y = 0.0;
    }
  }
}

// Signals that no limit is about share the scale of those that they belong to: rates of outputs
// that of the drives' rates, powers and energies one each. Alone, one that is zero but for
// round-off would be held to its round-off.
Quantity JudgedAs(Quantity quantity, const std::string& unit) {
  if (quantity == Quantity::kPoseVelocity) return Quantity::kVelocity;
  if (quantity == Quantity::kPoseAcceleration) return Quantity::kAcceleration;
  if (unit == "W") return Quantity::kInputPower;
  if (unit == "J") return Quantity::kKineticEnergy;
  return quantity;
}

// The largest force or moment of a trace as one or the other; what is below kLoadRoundoff of it is
// none.
constexpr double kLoadRoundoff = 1e-12;

double LargestLoad(const Trace& trace, const std::string& unit, double size_m) {
  double largest = 0.0;
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const std::string& of = trace.channels[c].unit;
    if (of != "N" && of != "N m") continue;
    const double value = trace.values.rows() == 0
                             ? 0.0
                             : trace.values.col(static_cast<Eigen::Index>(c)).cwiseAbs().maxCoeff();
    const double as = of == unit ? value : unit == "N m" ? value * size_m : value / size_m;
    if (as > largest) largest = as;
  }
  return largest;
}

double LargestOf(const Trace& trace, size_t column) {
  if (trace.values.rows() == 0) return 0.0;
  return trace.values.col(static_cast<Eigen::Index>(column)).cwiseAbs().maxCoeff();
}

double ShareOf(double part, double whole) { return part == 0.0 ? 0.0 : part / whole; }

}  // namespace

CheckLimits RerunLimits(const CheckLimits& limits) {
  CheckLimits own = limits;
  const auto or_default = [](std::optional<double>* limit, const std::optional<double>& usual) {
    if (!*limit) *limit = usual;
  };
  for (const auto rows : {MetricRows(), StiffnessMetricRows()}) {
    for (const MetricRow& row : rows) {
      MetricLimits& metric = own[row.metric];
      or_default(&metric.forward, row.limits.forward);
      or_default(&metric.inverse, row.limits.inverse);
      or_default(&metric.reference, row.limits.reference);
      or_default(&metric.servo, metric.forward);
      for (std::optional<double>* limit : {&metric.forward, &metric.servo}) {
        if (*limit) **limit *= kRerunShare;
      }
    }
  }
  return own;
}

std::vector<RerunSignal> CompareReruns(const ComparisonInput& input, Trace packed, Trace rerun,
                                       LimitColumn column) {
  AgreeOnUnknown(&packed, &rerun);
  for (Channel& channel : packed.channels) {
    channel.quantity = JudgedAs(channel.quantity, channel.unit);
  }
  const std::string witness = rerun.witness;
  const double size_m = CharacteristicLength(*input.mechanism);
  const AlignedTable table = ExactTable(std::move(packed));
  ComparisonInput judged = input;
  judged.table = &table;
  judged.limits = RerunLimits(input.limits);
  judged.start_window_s = 0.0;
  judged.reactions_not_unique.clear();
  std::vector<RerunSignal> signals;
  for (const TableColumnResult& result : JudgeColumns(judged, rerun, column)) {
    signals.push_back({.signal = result.channel + "." + witness,
                       .relative = ShareOf(result.error_max, LargestOf(table.trace, result.column)),
                       .use = result.ratio(),
                       .time_s = result.time_s});
    const std::string& unit = table.trace.channels[result.column].unit;
    const double roundoff = kLoadRoundoff * LargestLoad(table.trace, unit, size_m);
    const bool is_load = unit == "N" || unit == "N m";
    if (is_load && result.error_max <= roundoff) signals.back().use = 0.0;
  }
  return signals;
}

RerunSignal CompareColumns(const std::string& name, const std::vector<double>& packed,
                           const std::vector<double>& rerun, double limit, bool absolute) {
  ErrorSum sum;
  for (size_t i = 0; i < packed.size() && i < rerun.size(); ++i) {
    const bool unknown = std::isnan(packed[i]) && std::isnan(rerun[i]);
    sum.Add(unknown ? 0.0 : rerun[i] - packed[i], unknown ? 0.0 : packed[i], kNan, name);
  }
  RerunSignal signal{.signal = name};
  const bool comparable = packed.size() == rerun.size();
  signal.relative = comparable ? sum.MaxRelative() : kNan;
  signal.use = ShareOf(absolute && comparable ? sum.max_error() : signal.relative, limit);
  return signal;
}

namespace {

using Json = nlohmann::ordered_json;

std::string SignalText(const RerunSignal& signal) {
  std::string text = signal.signal;
  if (std::isfinite(signal.relative)) {
    text += fmt::format(" by {:.2g} of its largest value", signal.relative);
  } else {
    text += std::isnan(signal.relative) ? " is not a number in both"
                                        : " differs where the archive has zero";
  }
  if (signal.time_s == signal.time_s) text += fmt::format(" at t = {:g} s", signal.time_s);
  if (std::isfinite(signal.use)) return text + fmt::format(", {:.2g} of its limit", signal.use);
  return text + ", outside its limit";
}

std::string FileText(const RerunFile& file, bool all) {
  static constexpr const char* kWords[] = {"the same bytes", "within its limits", "not judged",
                                           "DIFFERS"};
  std::string text =
      fmt::format("  {:<17} {}", kWords[static_cast<size_t>(file.outcome)], file.path);
  if (!file.why.empty()) text += ": " + file.why;
  text += "\n";
  const RerunSignal* worst = WorstSignal(file.signals);
  for (const RerunSignal& signal : file.signals) {
    const bool shown = all || &signal == worst || !signal.inside();
    if (shown) text += "                      " + SignalText(signal) + "\n";
  }
  return text;
}

std::string ScenarioText(const RerunScenario& scenario, bool all) {
  std::string text = fmt::format("{}: {}", scenario.file, scenario.verdict);
  if (scenario.verdict != scenario.packed_verdict ||
      scenario.exit_code != scenario.packed_exit_code) {
    text += fmt::format(" (exit code {}); the archive says {} (exit code {})", scenario.exit_code,
                        scenario.packed_verdict, scenario.packed_exit_code);
  }
  text += "\n";
  if (!scenario.failure.empty()) text += "  " + scenario.failure + "\n";
  const auto same = std::ranges::count(scenario.files, RerunOutcome::kSame, &RerunFile::outcome);
  if (!all && same > 0) text += fmt::format("  the same bytes    {} files\n", same);
  for (const RerunFile& file : scenario.files) {
    if (all || file.outcome != RerunOutcome::kSame) text += FileText(file, all);
  }
  return text;
}

Json FileJson(const RerunFile& file) {
  Json json = {{"path", file.path}, {"outcome", ToText(file.outcome)}, {"why", file.why}};
  json["signals"] = Json::array();
  for (const RerunSignal& signal : file.signals) {
    json["signals"].push_back({{"signal", signal.signal},
                               {"relative", Number(signal.relative)},
                               {"use", Number(signal.use)},
                               {"time_s", Number(signal.time_s)},
                               {"inside", signal.inside()}});
  }
  return json;
}

size_t CountOf(const RerunReport& report, RerunOutcome outcome) {
  size_t count = 0;
  for (const RerunScenario& scenario : report.scenarios) {
    count += static_cast<size_t>(std::ranges::count(scenario.files, outcome, &RerunFile::outcome));
  }
  return count;
}

}  // namespace

const RerunSignal* WorstSignal(const std::vector<RerunSignal>& signals) {
  const auto rank = [](const RerunSignal& signal) {
    return signal.use == signal.use ? signal.use : HUGE_VAL;
  };
  const auto worst = std::ranges::max_element(signals, {}, rank);
  return worst == signals.end() ? nullptr : &*worst;
}

const char* ToText(RerunOutcome outcome) {
  switch (outcome) {
    case RerunOutcome::kSame:
      return "same";
    case RerunOutcome::kWithin:
      return "within";
    case RerunOutcome::kNotJudged:
      return "not_judged";
    case RerunOutcome::kDiffers:
      return "differs";
  }
  return "";
}

bool RerunScenario::agrees() const {
  return failure.empty() && !files.empty() && verdict == packed_verdict &&
         exit_code == packed_exit_code && std::ranges::none_of(files, [](const RerunFile& file) {
           return file.outcome == RerunOutcome::kDiffers;
         });
}

int RerunReport::exit_code() const {
  return std::ranges::all_of(scenarios, &RerunScenario::agrees) ? 0 : 1;
}

std::string ToText(const RerunReport& report, bool all) {
  std::string text;
  for (const OtherVersion& other : report.other_versions) {
    text += fmt::format("{}: the archive was written with {} {}, this is {}\n", report.archive,
                        other.name, other.packed.empty() ? "(none)" : other.packed,
                        other.here.empty() ? "(none)" : other.here);
  }
  for (const RerunScenario& scenario : report.scenarios) text += ScenarioText(scenario, all);
  text += fmt::format(
      "{}: {} files the same, {} within their limits, {} not judged, {} differ: {}\n",
      report.archive, CountOf(report, RerunOutcome::kSame), CountOf(report, RerunOutcome::kWithin),
      CountOf(report, RerunOutcome::kNotJudged), CountOf(report, RerunOutcome::kDiffers),
      report.exit_code() == 0 ? "repeated" : "NOT REPEATED");
  return text;
}

std::string ToJson(const RerunReport& report, int exit_code) {
  Json json = {{"schema", "mbverify.verify/1"},
               {"archive", report.archive},
               {"exit_code", exit_code},
               {"repeated", exit_code == 0}};
  json["other_versions"] = Json::array();
  for (const OtherVersion& other : report.other_versions) {
    json["other_versions"].push_back(
        {{"name", other.name}, {"packed", other.packed}, {"here", other.here}});
  }
  json["inputs"] = Json::array();
  for (const PackedFile& input : report.inputs) {
    json["inputs"].push_back({{"path", input.path}, {"sha256", input.sha256}});
  }
  json["scenarios"] = Json::array();
  for (const RerunScenario& scenario : report.scenarios) {
    Json files = Json::array();
    for (const RerunFile& file : scenario.files) files.push_back(FileJson(file));
    json["scenarios"].push_back({{"file", scenario.file},
                                 {"kind", scenario.kind},
                                 {"exit_code", scenario.exit_code},
                                 {"packed_exit_code", scenario.packed_exit_code},
                                 {"verdict", scenario.verdict},
                                 {"packed_verdict", scenario.packed_verdict},
                                 {"failure", scenario.failure},
                                 {"files", std::move(files)}});
  }
  return Dump(json);
}

namespace {

using SummaryObject = nlohmann::json;

// "checks/3/value: 1.5e-9 in the archive, 1.6e-9 now"; "" of the same.
std::string FirstDifference(const SummaryObject& packed, const SummaryObject& rerun) {
  const SummaryObject patch = SummaryObject::diff(packed, rerun);
  if (patch.empty()) return "";
  const SummaryObject::json_pointer place(patch[0]["path"].get<std::string>());
  const auto shown = [&](const SummaryObject& json) {
    return json.contains(place) ? DumpLine(json[place]) : std::string("nothing");
  };
  return fmt::format("{}: {} in the archive, {} now", place.to_string().substr(1), shown(packed),
                     shown(rerun));
}

// Value and limit of every check, by name; NaN of what has no number.
struct CheckNumbers {
  double value = kNan, limit = kNan;
  bool pass = false;
};
std::map<std::string, CheckNumbers> ChecksOf(const SummaryObject& json) {
  std::map<std::string, CheckNumbers> checks;
  const auto list = json.find("checks");
  if (list == json.end() || !list->is_array()) return checks;
  for (const SummaryObject& check : *list) {
    if (!check.is_object() || !check.contains("name") || !check["name"].is_string()) continue;
    CheckNumbers& numbers = checks[check["name"].get<std::string>()];
    const auto number = [&](const char* key) {
      const auto found = check.find(key);
      return found != check.end() && found->is_number() ? found->get<double>() : kNan;
    };
    numbers = {number("value"), number("limit"),
               check.contains("pass") && check["pass"] == SummaryObject(true)};
  }
  return checks;
}

// How far a check has moved, in parts of what it may.
RerunSignal MovedBy(const std::string& name, const CheckNumbers& packed,
                    const CheckNumbers& rerun) {
  RerunSignal signal{.signal = name};
  const bool unknown = std::isnan(packed.value) && std::isnan(rerun.value);
  const double moved = unknown ? 0.0 : std::abs(rerun.value - packed.value);
  signal.relative = moved == 0.0 ? 0.0 : moved / std::abs(packed.value);
  signal.use = moved == 0.0 ? 0.0 : moved / (kRerunShare * packed.limit);
  if (packed.pass != rerun.pass) signal.use = kNan;
  return signal;
}

// The first check that only one of the two has, else the one that has moved farthest.
std::string OutsideReason(const std::map<std::string, CheckNumbers>& packed,
                          const std::map<std::string, CheckNumbers>& rerun,
                          const std::vector<RerunSignal>& signals) {
  for (const auto& [name, numbers] : packed) {
    if (!rerun.contains(name)) return fmt::format("the check {} is not made any more", name);
  }
  for (const auto& [name, numbers] : rerun) {
    if (!packed.contains(name)) return fmt::format("the check {} is not in the archive", name);
  }
  const RerunSignal* worst = WorstSignal(signals);
  if (worst == nullptr) return "";
  const CheckNumbers &was = packed.at(worst->signal), &is = rerun.at(worst->signal);
  if (was.pass != is.pass) {
    return fmt::format("{} {} in the archive, {} now", worst->signal, was.pass ? "passes" : "fails",
                       is.pass ? "passes" : "fails");
  }
  return fmt::format("{}: {:.6g} in the archive, {:.6g} now", worst->signal, was.value, is.value);
}

}  // namespace

RerunFile CompareSummaries(const std::string& path, const std::string& packed,
                           const std::string& rerun, bool exact) {
  RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = ""};
  const SummaryObject before = ParseIfJson<SummaryObject>(packed);
  const SummaryObject now = ParseIfJson<SummaryObject>(rerun);
  if (!before.is_object() || !now.is_object()) {
    file.why = "is not a summary";
    return file;
  }
  file.why = FirstDifference(before, now);
  if (exact) return file;
  for (const char* key : {"verdict", "exit_code"}) {
    const SummaryObject was = before.value(key, SummaryObject()),
                        is = now.value(key, SummaryObject());
    if (was == is) continue;
    file.why = fmt::format("{}: {} in the archive, {} now", key, DumpLine(was), DumpLine(is));
    return file;
  }
  const auto packed_checks = ChecksOf(before), checks = ChecksOf(now);
  bool inside = packed_checks.size() == checks.size();
  for (const auto& [name, numbers] : packed_checks) {
    const auto found = checks.find(name);
    file.signals.push_back(found == checks.end() ? RerunSignal{.signal = name}
                                                 : MovedBy(name, numbers, found->second));
    inside = inside && file.signals.back().inside();
  }
  if (inside) {
    file.outcome = RerunOutcome::kWithin;
    return file;
  }
  file.why = OutsideReason(packed_checks, checks, file.signals);
  return file;
}

}  // namespace mbv
