// Forces that friction at rest leaves open: known within a band, middle ± half-width.
//
// A trace records the middle as the force and the half-width beside it (BandChannels()); where
// everything slides the half-width is 0 and the force is a number.
#pragma once

#include <vector>

#include "base/types.h"
#include "math/trace.h"

namespace mbv {

/// middle ± half.
struct ForceBand {
  double middle = kNan, half = 0.0;

  [[nodiscard]] bool open() const { return half > 0.0; }
  [[nodiscard]] double lower() const { return middle - half; }
  [[nodiscard]] double upper() const { return middle + half; }
  /// The end that is farther from zero; the force itself where it is a number.
  [[nodiscard]] double worst() const { return middle < 0.0 ? lower() : upper(); }
};

/// A channel of a trace over its samples: forces of drives and prescribed joints with their bands,
/// all others as numbers. The trace outlives it.
class ForceSignal {
 public:
  ForceSignal(const Trace& trace, int column);

  [[nodiscard]] ForceBand At(Eigen::Index row) const;
  /// ForceBand::worst() at every sample.
  [[nodiscard]] VecX Worst() const;

 private:
  const Trace* trace_;
  int column_, band_;  // band_ < 0: no friction is known of
};

/// Which forces are recorded with a band; kOwn for all other quantities.
[[nodiscard]] Quantity BandOf(Quantity force);

/// How far a is from b. Two bands differ by the larger of what their lower and their upper ends
/// differ by, with the sign of their middles; a number differs from a band by what it lies
/// outside.
[[nodiscard]] double Difference(const ForceBand& a, const ForceBand& b);

/// A column as files give it: open forces are NaN, with their ends in NAME.lower and NAME.upper in
/// place of the half-width; where the force is a number both are it.
struct ShownColumn {
  enum class Part { kNumber, kLower, kUpper };
  Channel channel;
  int source = 0;  ///< the trace's column that it shows
  ForceSignal signal;
  Part part = Part::kNumber;

  [[nodiscard]] double At(Eigen::Index row) const;
};

/// In the order of the trace's columns. The trace outlives them.
[[nodiscard]] std::vector<ShownColumn> ShownColumns(const Trace& trace);

/// The trace of these columns.
[[nodiscard]] Trace AsShown(const Trace& trace);

/// Per sample: some force of the trace is open.
[[nodiscard]] std::vector<bool> AtRest(const Trace& trace);

}  // namespace mbv
