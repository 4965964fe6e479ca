#include "report/rerun_summary.h"

#include "core/json_text.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

namespace mbv {
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
    file.why = "is no summary";
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
