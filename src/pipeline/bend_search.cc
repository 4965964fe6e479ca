#include "pipeline/bend_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbv {
namespace {

constexpr double kRatioRoundoff = 1.0 + 1e-9;  // of a ratio of sizes

bool FailsByForce(const BentRun& run) {
  return std::any_of(run.comparison.checks.begin(), run.comparison.checks.end(),
                     [](const CheckResult& check) {
                       return check.limit && !check.pass && IsDriveForce(check.metric);
                     });
}

std::string NameOf(const BestCheck& best) {
  return best.check == nullptr ? "model" : best.check->name;
}

}  // namespace

BestCheck BestOf(const MutationBench& bench, const BentRun& run) {
  BestCheck best;
  for (const CheckResult& check : run.comparison.checks) {
    if (!check.limit) continue;
    if (check.value <= MutationBench::Visible(bench.base().ValueOf(check.name))) continue;
    const double ratio = std::isnan(check.value) ? std::numeric_limits<double>::infinity()
                                                 : check.value / *check.limit;
    if (best.check == nullptr || ratio > best.ratio) best = {&check, ratio};
  }
  return best;
}

BentRun BendSearch::RunAt(const Bendable& number, double error) {
  count_(fmt::format("{} by {:+.1e}", number.name, error));
  return bench_.Run(number.At(error));
}

Direction BendSearch::Try(const Bendable& number, double sign) {
  Direction way{.sign = sign, .run = RunAt(number, sign * options_.size)};
  way.ran = way.run.ran;
  way.detected = way.run.detected();
  if (!way.ran) {
    way.check = "model";
    return way;
  }
  way.force_change = way.run.ValueOf(bench_.ForceCheck());
  way.by_force = FailsByForce(way.run);
  if (!way.detected) way.unseen = options_.size;
  return way;
}

Sighting BendSearch::Look(const Bendable& number, bool further) {
  double guess = 0.0;  // what one direction shows, the other probably does
  for (size_t k = 0; k < 2; ++k) {
    Direction& way = ways_[k];
    way = Try(number, k == 0 ? 1.0 : -1.0);
    if (!way.detected) {
      if (further) BendFurther(number, &way);
    } else if (way.ran) {
      const BestCheck best = BestOf(bench_, way.run);
      way.check = NameOf(best);
      if (options_.smallest) {
        FindSmallest(number, options_.size, best.ratio, guess, &way);
      } else if (best.check != nullptr) {
        way.smallest = options_.size / best.ratio;
      }
      guess = way.smallest;
    }
  }
  return Join();
}

const Direction& BendSearch::Weaker() const {
  const Direction &up = ways_[0], &down = ways_[1];
  if (up.ran != down.ran) return up.ran ? up : down;
  if (up.detected != down.detected) return up.detected ? down : up;
  if (!up.detected && std::isnan(up.smallest) && std::isnan(down.smallest)) {
    return down.unseen > up.unseen ? down : up;
  }
  return down.smallest > up.smallest ? down : up;
}

Sighting BendSearch::Join() const {
  const Direction &up = ways_[0], &down = ways_[1], &weaker = Weaker();
  Sighting s;
  s.ran = weaker.ran;
  s.detected = up.detected && down.detected;
  s.by_force = s.ran && (up.by_force || !up.ran) && (down.by_force || !down.ran);
  s.force_change = std::fmin(up.force_change, down.force_change);
  s.smallest = weaker.smallest;
  s.best_check = weaker.check;
  if (up.ran != down.ran) s.only = up.ran ? "larger" : "smaller";
  if (!s.ran) s.reason = up.run.failure;
  return s;
}

// Not seen at the size asked for: bent by kLargestBend, and if that is seen or refused, by ten
// times as much as before until it is.
void BendSearch::BendFurther(const Bendable& number, Direction* way) {
  if (way->unseen >= kLargestBend) return;
  BentRun largest = RunAt(number, way->sign * kLargestBend);
  if (largest.ran && !largest.detected()) {
    way->unseen = kLargestBend;
    way->run = std::move(largest);
    return;
  }
  for (double size = 10.0 * options_.size; way->unseen < kLargestBend; size *= 10.0) {
    size = std::min(size, kLargestBend);
    BentRun run = size < kLargestBend ? RunAt(number, way->sign * size) : std::move(largest);
    if (!run.ran) return;  // the model itself objects; forces have not seen it up to here
    if (run.detected()) {
      const BestCheck best = BestOf(bench_, run);
      way->check = NameOf(best);
      if (options_.smallest) FindSmallest(number, size, best.ratio, 0.0, way);
      return;
    }
    way->unseen = size;
    way->run = std::move(run);
  }
}

// Between way->unseen (0: not known) and `seen`; `ratio` is value over limit at `seen`. `known`: a
// size that may be the one, or 0.
void BendSearch::FindSmallest(const Bendable& number, double seen, double ratio, double known,
                              Direction* way) {
  const double fine = 1.0 + options_.resolution;
  double unseen = way->unseen, step = fine;
  // Where proportion puts the limit, a little beyond; 0 where nothing is proportional.
  double guess = std::isfinite(ratio) && ratio > 1.0 ? seen / ratio * std::sqrt(fine) : 0.0;
  if (known > 0.0) guess = known;
  while ((unseen == 0.0 || seen / unseen > fine * kRatioRoundoff) && seen > kSmallestBend) {
    double size = 0.0;
    if (guess > unseen && guess < seen) {
      size = guess;
    } else if (unseen == 0.0) {
      size = seen / step;
      step *= step;
    } else if (unseen * step * fine < seen) {
      size = unseen * step;
      step *= step;
    } else {
      size = std::sqrt(unseen * seen);
    }
    guess = 0.0;
    size = std::max(size, kSmallestBend);
    const BentRun run = RunAt(number, way->sign * size);
    if (!run.detected()) {
      unseen = size;
      continue;
    }
    seen = size;
    way->check = NameOf(BestOf(bench_, run));
  }
  way->smallest = seen;
}

}  // namespace mbv
