#include "features/study/summary.h"

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// How bad a value is: beyond its limit, or else far from nominal.
double Badness(const StudyLimit* limit, double nominal, double value) {
  if (limit == nullptr) return std::abs(value - nominal);
  const double above = limit->below ? value - *limit->below : -HUGE_VAL;
  const double below = limit->above ? *limit->above - value : -HUGE_VAL;
  return std::max(above, below);
}

class WorstList {
 public:
  WorstList(const StudyLimit* limit, double nominal) : limit_(limit), nominal_(nominal) {}

  void Add(const PointRow& row, double value) {
    if (!std::isfinite(value)) return;
    const double bad = Badness(limit_, nominal_, value);
    const auto at = std::find_if(list_.begin(), list_.end(), [&](const WorstPoint& w) {
      return bad > Badness(limit_, nominal_, w.value);
    });
    if (at == list_.end() && list_.size() == kWorstPoints) return;
    list_.insert(at, {row.point, value, row.varied});
    if (list_.size() > kWorstPoints) list_.pop_back();
  }
  [[nodiscard]] std::vector<WorstPoint> Take() { return std::move(list_); }

 private:
  const StudyLimit* limit_;
  double nominal_;
  std::vector<WorstPoint> list_;
};

void AddMoments(const std::vector<double>& sorted, QuantitySummary* summary) {
  if (sorted.empty()) return;
  const auto count = static_cast<double>(sorted.size());
  double sum = 0.0, squares = 0.0;
  for (const double value : sorted) sum += value;
  summary->mean = sum / count;
  for (const double value : sorted) squares += std::pow(value - summary->mean, 2);
  if (sorted.size() > 1) summary->deviation = std::sqrt(squares / (count - 1.0));
  summary->least = sorted.front();
  summary->most = sorted.back();
  summary->p50 = Percentile(sorted, 0.50);
  if (sorted.size() >= kFewestForPercentiles) {
    summary->p5 = Percentile(sorted, 0.05);
    summary->p95 = Percentile(sorted, 0.95);
  }
  summary->histogram = HistogramOf(sorted);
}

// Point 0 is nominal, then come each number's excursions.
std::vector<Swing> SwingsOf(const Study& study, const std::vector<double>& values) {
  std::vector<Swing> swings;
  size_t at = 1;
  for (size_t k = 0; k < study.factors.size(); ++k) {
    const size_t count = Excursions(study.factors[k].axis.distribution).size();
    Swing swing{k, values.front(), values.front()};
    for (size_t i = at; i < std::min(at + count, values.size()); ++i) {
      swing.lowest = std::fmin(swing.lowest, values[i]);
      swing.highest = std::fmax(swing.highest, values[i]);
    }
    swings.push_back(swing);
    at += count;
  }
  const auto width = [](const Swing& s) {
    return std::isnan(s.highest) ? -1.0 : s.highest - s.lowest;
  };
  std::stable_sort(swings.begin(), swings.end(),
                   [&](const Swing& a, const Swing& b) { return width(a) > width(b); });
  return swings;
}

QuantitySummary SummariseQuantity(const Study& study, size_t k, double nominal,
                                  const PointRows& rows) {
  QuantitySummary summary;
  summary.name = study.quantities[k].name;
  summary.nominal = nominal;
  const auto limit = std::find_if(study.limits.begin(), study.limits.end(),
                                  [&](const StudyLimit& l) { return l.quantity == k; });
  WorstList worst(limit == study.limits.end() ? nullptr : &*limit, nominal);
  std::vector<double> values;
  rows([&](const PointRow& row) {
    values.push_back(row.values[k]);
    worst.Add(row, row.values[k]);
  });
  summary.worst = worst.Take();
  if (study.design.kind == DesignKind::kSaltelli) {
    summary.sobol = SobolIndices(values, study.factors.size());
  }
  if (study.design.kind == DesignKind::kOneAtATime && !values.empty()) {
    summary.swings = SwingsOf(study, values);
  }
  const size_t all = values.size();
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  summary.count = values.size();
  summary.missing = all - values.size();
  std::sort(values.begin(), values.end());
  AddMoments(values, &summary);
  return summary;
}

}  // namespace

bool StudySummary::within_limits() const {
  return disagreed == 0 && few_missing() &&
         std::all_of(limits.begin(), limits.end(), [](const LimitResult& l) { return l.pass(); });
}

StudySummary SummariseStudy(const Study& study, const std::vector<double>& nominal,
                            const PointRows& rows) {
  StudySummary summary;
  summary.missing = study.missing;
  for (const StudyLimit& limit : study.limits)
    summary.limits.push_back({.limit = limit, .interval = {}});
  rows([&](const PointRow& row) {
    ++summary.points;
    const bool asked = row.reason.empty() || !study.missing;
    for (LimitResult& result : summary.limits) {
      if (!asked) break;
      ++result.count;
      if (!result.limit.Keeps(row.values[result.limit.quantity])) ++result.violations;
    }
    if (row.reason.empty() && row.exit_code == 1) {
      ++summary.disagreed;
      if (summary.first_disagreed.size() < kWorstPoints) summary.first_disagreed.push_back(row);
    }
    if (row.reason.empty()) return;
    ++summary.failed;
    const bool known = summary.reasons.contains(row.reason) || summary.reasons.size() < kReasons;
    ++summary.reasons[known ? row.reason : "…"];
    if (summary.first_failed.size() < kWorstPoints) summary.first_failed.push_back(row);
  });
  const bool independent = study.design.draws() && study.design.kind != DesignKind::kSaltelli;
  for (LimitResult& result : summary.limits) {
    if (independent) result.interval = ClopperPearson(result.violations, result.count);
  }
  for (size_t k = 0; k < study.quantities.size(); ++k) {
    summary.quantities.push_back(SummariseQuantity(study, k, nominal[k], rows));
  }
  return summary;
}

}  // namespace mbv
