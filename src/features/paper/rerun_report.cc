#include "features/paper/rerun_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/json_text.h"

namespace mbv {
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
std::string WhyOutside(const std::map<std::string, CheckNumbers>& packed,
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
  RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = "", .signals = {}};
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
  file.why = WhyOutside(packed_checks, checks, file.signals);
  return file;
}

}  // namespace mbv
