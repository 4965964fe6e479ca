#include "pipeline/upgrade_rows.h"

#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Of the softness, and of the largest velocity term: less is round-off. Both versions compute them
// by other sums in double precision, from aref whose largest part is 1e6 times as large.
constexpr double kRoundOff = 1e-6;

// What is known of MuJoCo's history between 2.2.2 and 3.14.
struct KnownChange {
  const char* kind;
  bool of_softness;  // else of the velocity term
  const char* text;
};
constexpr KnownChange kKnownChanges[] = {
    {"weld", true, "3.0: a weld's rotations are softened by their own inertia"},
    {"connect", false, "3.7.0: the velocity term is supplied"},
    {"weld", false, "3.7.0: the velocity term is supplied"},
};

std::string Explained(const std::string& kind, bool of_softness) {
  for (const KnownChange& change : kKnownChanges) {
    if (kind == change.kind && of_softness == change.of_softness) return change.text;
  }
  return of_softness ? "not explained: another softness" : "not explained: another velocity term";
}

std::string WhyOf(const RowChange& change, double scale) {
  std::vector<std::string> reasons;
  const bool softness = std::max(std::abs(change.softness_least - 1.0),
                                 std::abs(change.softness_most - 1.0)) > kRoundOff;
  if (softness) reasons.push_back(Explained(change.kind, true));
  const bool old = change.left_out_old > kRoundOff * scale,
             now = change.left_out_new > kRoundOff * scale;
  if (old && !now) reasons.push_back(Explained(change.kind, false));
  if (old && now) reasons.emplace_back("the velocity term is left out by both");
  if (!old && now) reasons.emplace_back("not explained: the velocity term was right before");
  return reasons.empty() ? "nothing changed" : fmt::format("{}", fmt::join(reasons, "; "));
}

void Widen(const SurveyedState& state, const RowMeasures& now, Eigen::Index row,
           RowChange* change) {
  const double ratio = now.R[row] / state.present.R[row], term = state.velocity_term[row];
  change->softness_least = std::min(change->softness_least, ratio);
  change->softness_most = std::max(change->softness_most, ratio);
  change->velocity_term = std::max(change->velocity_term, std::abs(term));
  change->left_out_old = std::max(change->left_out_old, std::abs(term - state.present.bias[row]));
  change->left_out_new = std::max(change->left_out_new, std::abs(term - now.bias[row]));
}

RowChange ChangeOf(const std::string& kind, const RowSurvey& survey, const RowAnswer& answer) {
  RowChange change{.kind = kind, .softness_least = HUGE_VAL, .softness_most = 0.0, .why = {}};
  for (size_t row = 0; row < survey.kinds.size(); ++row) {
    if (survey.kinds[row] != kind) continue;
    ++change.rows;
    for (size_t i = 0; i < survey.states.size(); ++i) {
      Widen(survey.states[i], answer.states[i], static_cast<Eigen::Index>(row), &change);
    }
  }
  return change;
}

}  // namespace

std::vector<RowChange> CompareRows(const RowSurvey& survey, const RowAnswer& answer) {
  if (survey.equalities != answer.equalities) return {};
  std::vector<RowChange> changes;
  double scale = 0.0;
  for (const SurveyedState& state : survey.states) {
    scale = std::max(scale, state.velocity_term.cwiseAbs().maxCoeff());
  }
  for (const std::string& kind : survey.kinds) {
    const bool known = std::any_of(changes.begin(), changes.end(),
                                   [&](const RowChange& change) { return change.kind == kind; });
    if (!known) changes.push_back(ChangeOf(kind, survey, answer));
  }
  for (RowChange& change : changes) change.why = WhyOf(change, scale);
  return changes;
}

}  // namespace mbv
