// One number of the model bent on one bench: is the error seen, and from which size on?
#pragma once

#include <array>
#include <functional>

#include "pipeline/bendable.h"
#include "pipeline/mutate.h"
#include "pipeline/mutation_bench.h"

namespace mbv {

/// What is known of errors of one sign.
struct Direction {
  double sign = 1.0;  ///< of the relative error
  BentRun run;        ///< at the size asked for, then the largest that was not seen
  bool ran = false;   ///< at the size asked for
  bool detected = false, by_force = false;  ///< the same; not running is noticed, too
  double force_change = kNan;               ///< the same
  double unseen = 0.0;                      ///< largest error known not to be seen
  double smallest = kNan;                   ///< smallest error known to be seen
  std::string check = {};                   ///< that saw it; "model" where it was refused
};

class BendSearch {
 public:
  /// `count` is called before each simulation with what is bent.
  BendSearch(const MutationOptions& options, const MutationBench& bench,
             std::function<void(const std::string& what)> count)
      : options_(options), bench_(bench), count_(std::move(count)) {}

  /// Both directions at the size asked for; with the smallest errors if these are asked for. What
  /// is not seen is made worse up to kLargestBend, if `further`.
  [[nodiscard]] Sighting Look(const Bendable& number, bool further);

  /// After Look(): the direction that shows less, of those that ran.
  [[nodiscard]] const Direction& Weaker() const;

 private:
  BentRun RunAt(const Bendable& number, double error);
  Direction Try(const Bendable& number, double sign);
  void BendFurther(const Bendable& number, Direction* way);
  void FindSmallest(const Bendable& number, double seen, double ratio, double guess,
                    Direction* way);
  [[nodiscard]] Sighting Join() const;

  const MutationOptions& options_;
  const MutationBench& bench_;
  std::function<void(const std::string&)> count_;
  std::array<Direction, 2> ways_;  // larger, smaller
};

/// The check that shows a bend best: largest value over limit among those that the bend moves.
struct BestCheck {
  const CheckResult* check = nullptr;
  double ratio = 0.0;  ///< value over limit
};
[[nodiscard]] BestCheck BestOf(const MutationBench& bench, const BentRun& run);

}  // namespace mbv
