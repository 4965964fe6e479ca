#include "report/result.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/verdict.h"

namespace mbv {

CheckEnd EndOf(const ShownCheck& check) {
  if (!check.limit) return CheckEnd::kOff;
  if (!check.pass) return CheckEnd::kFail;
  if (!check.blind.empty()) return CheckEnd::kVoid;
  return check.verifies.value_or(true) ? CheckEnd::kOk : CheckEnd::kHeld;
}

std::string WhereOf(const ShownCheck& check) {
  if (check.where.empty() || !std::isfinite(check.time_s)) return check.where;
  return fmt::format("{}, {:.4g} s", check.where, check.time_s);
}

const ShownCheck* ResultView::FindCheck(const std::string& name) const {
  return FindNamed(checks, name);
}

size_t ResultView::ran() const {
  return static_cast<size_t>(std::count_if(witnesses.begin(), witnesses.end(),
                                           [](const auto& one) { return one.second.ok(); }));
}

size_t ResultView::limits() const {
  return static_cast<size_t>(
      std::count_if(checks.begin(), checks.end(),
                    [](const ShownCheck& check) { return check.limit.has_value(); }));
}

RunCounts& RunCounts::operator+=(const RunCounts& other) {
  scenarios += other.scenarios;
  ran += other.ran;
  compared += other.compared;
  verified += other.verified;
  bad_input += other.bad_input;
  return *this;
}

RunCounts CountOf(const ResultView& view) {
  return {.scenarios = 1,
          .ran = view.ran() > 0 ? size_t{1} : 0,
          .compared = view.main_pair.empty() ? size_t{0} : 1,
          .verified = view.verdict == Verdict::kAgree ? size_t{1} : 0};
}

std::string CountLine(const RunCounts& counts) {
  std::string text =
      fmt::format("{} scenario{}: {} ran, {} compared, {} verified", counts.scenarios,
                  counts.scenarios == 1 ? "" : "s", counts.ran, counts.compared, counts.verified);
  if (counts.bad_input > 0) text += fmt::format(", {} with bad input", counts.bad_input);
  return text + "\n";
}

}  // namespace mbv
