// Values over time that are asked for again and again: each is computed once.
#pragma once

#include <cmath>
#include <functional>
#include <unordered_map>
#include <utility>

#include "base/run_summary.h"

namespace mbv {

/// The motion or the forces of drives, for many runs over the same times.
template <typename Value>
class ComputedOnce {
 public:
  using Source = std::function<RunSummary(double t_s, Value* value)>;

  /// Times that round to the same multiple of 1 / `per_s` count as one; 0: equal times only.
  explicit ComputedOnce(double per_s = 0.0) : per_s_(per_s) {}

  /// Gives what any source gave at this time, else asks `source`; failures are not kept. Refers to
  /// this object.
  [[nodiscard]] Source Of(Source source) {
    return [this, source = std::move(source)](double t_s, Value* value) {
      const double key = per_s_ > 0.0 ? std::round(t_s * per_s_) : t_s;
      const auto [entry, added] = known_.try_emplace(key);
      if (added) {
        if (RunSummary summary = source(t_s, &entry->second); !summary.ok()) {
          known_.erase(entry);
          return summary;
        }
      }
      *value = entry->second;
      return RunSummary::Done();
    };
  }

 private:
  double per_s_;
  std::unordered_map<double, Value> known_;
};

}  // namespace mbv
