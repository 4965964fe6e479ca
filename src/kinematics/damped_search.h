// Levenberg–Marquardt for states that are no vectors (poses, joint coordinates), with any residual.
#pragma once

#include <algorithm>
#include <limits>
#include <utility>

#include "core/types.h"
#include "kinematics/closure_residual.h"

namespace mbv::internal {

/// How steps are damped. μ is in squares of the scaled Jacobian's singular values.
struct DampingRule {
  int most_steps;           ///< tried, better or not
  double largest_step;      ///< of a component; a longer step is shortened as a whole
  double first, least;      ///< μ at the start, and the least one
  double most;              ///< beyond it no step helps any more
  double easier, stronger;  ///< factors of μ after a better and after a worse step
};

/// What the search is asked after each step.
struct DampedStepMade {
  const VecX& r;  ///< where the state is now
  double before;  ///< norm of the residual before this step; ∞ where none was made yet
  bool better;    ///< else the state is where it was
};

/// Makes |r(state)| small from `state` on. `evaluate(&state, &J)` gives r and its Jacobian by the
/// scaled steps, `move(s, &state)` makes a step, `enough(DampedStepMade)` ends the search (it is
/// asked before the first step, too). Returns the last residual.
template <typename State, typename Evaluate, typename Move, typename Enough>
VecX DampedSearch(const DampingRule& rule, State* state, const Evaluate& evaluate, const Move& move,
                  const Enough& enough) {
  MatX J;
  VecX r = evaluate(state, &J);
  constexpr double kNoStepYet = std::numeric_limits<double>::infinity();
  if (J.size() == 0 || enough(DampedStepMade{r, kNoStepYet, true})) return r;
  double mu = rule.first;
  for (int i = 0; i < rule.most_steps && mu <= rule.most; ++i) {
    VecX s = DampedStep(J, r, mu);
    if (const double largest = s.cwiseAbs().maxCoeff(); largest > rule.largest_step) {
      s *= rule.largest_step / largest;
    }
    State next = *state;
    move(s, &next);
    MatX J_next;
    VecX r_next = evaluate(&next, &J_next);
    const double before = r.norm();
    const bool better = r_next.norm() < before;
    if (better) {
      *state = std::move(next);
      r.swap(r_next);
      J.swap(J_next);
      mu = std::max(rule.easier * mu, rule.least);
    } else {
      mu *= rule.stronger;
    }
    if (enough(DampedStepMade{r, before, better})) break;
  }
  return r;
}

}  // namespace mbv::internal
