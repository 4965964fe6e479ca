// Channels that two traces share, over their common samples. Internal to comparison/.
#pragma once

#include <map>
#include <string>

#include "comparison/comparison.h"

namespace mbv::internal {

/// The same channel in both traces; absent if `measured` < 0 or `truth` < 0.
struct Columns {
  int measured = -1, truth = -1;
  [[nodiscard]] bool both() const { return measured >= 0 && truth >= 0; }
};

struct PairReader {
  const Trace& measured;
  const Trace& truth;
  CommonSamples samples;

  [[nodiscard]] Columns Find(const std::string& name) const {
    return {measured.Find(name), truth.Find(name)};
  }
  /// Error statistics of one channel over the samples from `start_s` on.
  [[nodiscard]] ErrorSum Sum(const std::string& name, Columns columns, double start_s,
                             bool angle) const;
  /// The same of a force, whose bands count as Difference() says.
  [[nodiscard]] ErrorSum SumForces(const std::string& name, Columns columns, double start_s) const;
};

inline void KeepWorst(std::map<Metric, Measured>* metrics, Metric metric,
                      const Measured& measured) {
  KeepWorst(&(*metrics)[metric], measured);
}

/// Fills drives, force metrics, and whether and why not the pair is compared.
void CompareForces(const ComparisonInput& input, const PairReader& reader, PairComparison* pair);
/// Why two witnesses cannot be compared: what stopped them; "" if both ran.
[[nodiscard]] std::string NotComparedReason(const Witness& measured, const Witness& truth);
/// What one would expect to be judged of stiffnesses and is not.
void AddStiffnessNotes(const ComparisonInput& input, Comparison* comparison);
/// Joint reactions that both give in the same frame and that statics determines, and the forces of
/// prescribed joints.
void CompareReactions(const ComparisonInput& input, const PairReader& reader, PairComparison* pair);

}  // namespace mbv::internal
