// The home pose: where all loops close, solved from the joint guesses.
#pragma once

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/types.h"
#include "kinematics/assembly.h"
#include "kinematics/tree_motion.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Loops count as closed below this gap [characteristic lengths, rad], or where it is rounding.
inline constexpr double kHomeTolerance = 1e-12;

/// Gap of one loop closure at the end of the home solution.
struct LoopGap {
  int joint = -1;              ///< index of the closure joint
  double position_m = kNan;    ///< largest translation row
  double rotation_rad = kNan;  ///< rotation that is not a motion of the joint
};

/// Which of the ways to close that are found is meant, by the name of a closure in the group of
/// loops: 1 is the nearest to the guesses (GroupAssemblies::assemblies).
using AssemblyChoice = std::map<std::string, int>;

/// A choice that cannot be met.
struct UnmetChoice {
  std::string closure;
  int wanted = 0, found = 0;  ///< found -1: there is no such closure
};

/// What is left of a coupling that could not be met at home.
struct CouplingGap {
  int coupling = -1;
  double amount = kNan;  ///< [rad] or [m]
  bool angular = true;
};

struct HomeResult {
  bool closed = false;
  /// Largest gap of all closures [characteristic lengths, rad], at the solution and at the guesses.
  double gap = kNan, gap_at_guess = kNan;
  double tolerance = kHomeTolerance;  ///< for `gap`
  bool drives_moved = false;   ///< driven joints had to leave their guesses to close the loops
  bool guesses_moved = false;  ///< closed only by a search: may be another assembly than meant
  /// Of the groups of loops that had to be searched: the ways to close them.
  std::vector<GroupAssemblies> searched;
  std::vector<LoopGap> gaps;                ///< per closure joint, worst first
  std::vector<CouplingGap> couplings = {};  ///< that are missed
  std::vector<UnmetChoice> unmet = {};

  /// One line to read: "limb1.S is open by 0.12 m and 0.3 rad; …" (at most three loops).
  [[nodiscard]] std::string Text(const Mechanism& mechanism) const;
};

/// Solves all loop closures and couplings in the coordinates of the spanning tree
/// (BuildSpanningTree first), from Joint::guess: Levenberg–Marquardt, first with driven and
/// prescribed joints held at their guesses, then with them free; loops that stay open are searched
/// (assembly.h), and the way to close them that is nearest to the guesses is taken. Fills X_WB_home
/// and Joint::home of every joint, closures included (angles within π of their guess); with the
/// best pose found if the loops do not close. Groups that `choice` names are searched however they
/// close, and the way that it names is taken.
HomeResult SolveHome(Mechanism* mechanism, const AssemblyChoice& choice = {});

/// Coordinates of every joint at given body poses; angles within π of `near[joint]`.
[[nodiscard]] std::vector<std::array<double, 6>> JointCoordinatesAt(
    const Mechanism& mechanism, const std::vector<Pose>& X_WB,
    const std::vector<std::array<double, 6>>& near);

}  // namespace mbv

// Levenberg–Marquardt for states that are no vectors (poses, joint coordinates), with any residual.

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

/// Ends a search whose residual is small enough, or whose steps win little again and again.
struct StallRule {
  double done;   ///< residual
  double share;  ///< of the residual that a step must win
  int most;      ///< steps in a row that may win less
  int stalled = 0;

  bool operator()(const DampedStepMade& step) {
    const double now = step.r.norm();
    if (step.better) stalled = now > (1.0 - share) * step.before ? stalled + 1 : 0;
    return now < done || stalled > most;
  }
};

/// Makes |r(state)| small from `state` on. `evaluate(&state, &J)` gives r and its Jacobian by the
/// scaled steps, `move(s, &state)` makes a step, `enough(DampedStepMade)` ends the search (it is
/// asked before the first step, too). Returns the last residual.
template <typename State, typename Evaluate, typename Move, typename Enough>
VecX DampedSearch(const DampingRule& rule, State* state, const Evaluate& evaluate, const Move& move,
                  Enough&& enough) {
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
