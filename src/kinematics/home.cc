// Levenberg–Marquardt on the loop closures in tree coordinates.
//
// Lengths are divided by a characteristic length L (kinematics/home.h).

#include "kinematics/home.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "kinematics/tree_motion.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::ClosureResidual;
using internal::TreeMotion;
using Coordinates = std::vector<std::array<double, 6>>;

struct Attempt {
  std::vector<Pose> X_FM;
  BodyStates states;
  double gap = std::numeric_limits<double>::infinity();
};

LoopGap GapOf(const Mechanism& mechanism, int j, const BodyStates& states) {
  const Joint& joint = mechanism.joints[j];
  const ConstraintRows rows = RowsOf(joint, states, false);
  const Pose X_FM =
      (states.X_WB[joint.parent] * joint.X_PF).inverse() * (states.X_WB[joint.child] * joint.X_CM);
  LoopGap gap{.joint = j, .position_m = 0.0, .rotation_rad = RotationGap(joint, X_FM)};
  if (rows.translation_rows > 0) {
    gap.position_m = rows.residual.head(rows.translation_rows).cwiseAbs().maxCoeff();
  }
  return gap;
}

// Largest gap, lengths relative to `length`.
double LargestGap(const Mechanism& mechanism, const BodyStates& states, double length) {
  double largest = 0.0;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (!mechanism.joints[j].closure) continue;
    const LoopGap gap = GapOf(mechanism, static_cast<int>(j), states);
    largest = std::max({largest, gap.position_m / length, gap.rotation_rad});
  }
  for (const CouplingRow& row : CouplingRows(mechanism, states)) {
    largest = std::max(largest, std::abs(row.value) / (row.angular ? 1.0 : length));
  }
  return largest;
}

// Steps in rad, or characteristic lengths.
constexpr internal::DampingRule kDamping{.most_steps = 100,
                                         .largest_step = 0.5,
                                         .first = 1e-4,
                                         .least = 1e-24,
                                         .most = 3e9,
                                         .easier = 0.1,
                                         .stronger = 30.0};

// Of every term of the couplings.
std::vector<double> CoupledAt(const Mechanism& mechanism, const Coordinates& q) {
  std::vector<double> coupled;
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      coupled.push_back(q[term.joint][term.coordinate]);
    }
  }
  return coupled;
}

Attempt Close(const Mechanism& mechanism, const std::vector<bool>& locked,
              const Coordinates& start) {
  const double length = CharacteristicLength(mechanism);
  const TreeMotion tree(mechanism, locked);
  VecX unit(tree.dofs());
  for (int c = 0; c < tree.dofs(); ++c) unit[c] = tree.angular()[c] ? 1.0 : length;

  Attempt now;
  for (size_t j = 0; j < start.size(); ++j) {
    now.X_FM.push_back(JointPose(mechanism.joints[j], start[j]));
  }
  now.states.coupled = CoupledAt(mechanism, start);
  const auto evaluate = [&](Attempt* at, MatX* J) {
    std::vector<double> coupled = std::move(at->states.coupled);
    at->states = tree.States(at->X_FM);
    at->states.coupled = std::move(coupled);
    FollowCouplings(mechanism, &at->states);
    MatX J_q;
    VecX r = ClosureResidual(mechanism, tree, at->states, length, &J_q);
    *J = J_q * unit.asDiagonal();
    return r;
  };
  const auto move = [&](const VecX& s, Attempt* at) { tree.Step(unit.cwiseProduct(s), &at->X_FM); };
  const auto enough = [](const internal::DampedStepMade& step) {
    if (step.r.size() == 0) return true;
    const double largest = step.r.cwiseAbs().maxCoeff();
    // At round-off no step helps any more.
    return largest < 1e-16 || (!step.better && largest < 0.1 * kHomeTolerance);
  };
  internal::DampedSearch(kDamping, &now, evaluate, move, enough);
  now.gap = LargestGap(mechanism, now.states, length);
  return now;
}

// Joint coordinates of an attempt: coupled ones in the turns that it counts, other angles within
// half a turn of `near`.
Coordinates CoordinatesOf(const Mechanism& mechanism, const Attempt& attempt, Coordinates near) {
  const double* value = attempt.states.coupled.data();
  for (const Coupling& coupling : mechanism.couplings) {
    for (const Coupling::Term& term : coupling.terms) near[term.joint][term.coordinate] = *value++;
  }
  return JointCoordinatesAt(mechanism, attempt.states.X_WB, near);
}

// Where couplings lead what is in no loop, once the loops are closed without it: a start from which
// followers have no turns to go.
Coordinates Followed(const Mechanism& mechanism, const std::vector<bool>& locked,
                     const Coordinates& start) {
  std::vector<bool> follows(mechanism.joints.size(), true);
  for (const LoopGroup& group : LoopGroups(mechanism)) {
    for (const int j : group.joints) follows[j] = false;
    for (const int j : group.closures) follows[j] = false;
  }
  CoordinateSet known;
  for (size_t j = 0; j < follows.size(); ++j) {
    if (follows[j] && !locked[j]) continue;
    for (int c = 0; c < DofsOf(mechanism.joints[j].kind); ++c) {
      known.insert({static_cast<int>(j), c});
    }
  }
  Mechanism loops = mechanism;
  std::erase_if(loops.couplings, [&](const Coupling& coupling) {
    return std::ranges::any_of(coupling.terms, [&](const Coupling::Term& term) {
      return !known.contains({term.joint, term.coordinate});
    });
  });
  if (loops.couplings.size() == mechanism.couplings.size()) return start;
  Coordinates q = CoordinatesOf(loops, Close(loops, locked, start), start);
  SolveFollowers(mechanism, &known, &q);
  return q;
}

std::vector<bool> DrivenJoints(const Mechanism& mechanism) {
  std::vector<bool> driven(mechanism.joints.size(), false);
  for (const Drive& drive : mechanism.drives) {
    if (const auto* d = std::get_if<JointDrive>(&drive.kind)) {
      // A joint with undriven DOFs beside the driven one cannot be locked as a whole.
      driven[d->joint] = DofsOf(mechanism.joints[d->joint].kind) == 1;
    }
  }
  for (const Prescribed& p : mechanism.prescribed) driven[p.joint] = true;
  return driven;
}

Coordinates Disturbed(const Mechanism& mechanism, const Coordinates& guess,
                      const std::vector<bool>& locked, double amplitude, std::mt19937_64* random) {
  const double length = CharacteristicLength(mechanism);
  std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
  Coordinates out = guess;
  for (const int j : mechanism.tree_joints) {
    if (locked[j]) continue;
    const Joint& joint = mechanism.joints[j];
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      out[j][c] += uniform(*random) * (IsLength(joint.kind, c) ? length : 1.0);
    }
  }
  return out;
}

// kHomeTolerance, or what rounding leaves of coordinates that are large beside the mechanism.
double ToleranceAt(const Mechanism& mechanism, const std::vector<Pose>& X_WB) {
  const double reach = Reach(LongestLever(mechanism), X_WB);
  return std::max(kHomeTolerance, GapRounding(reach) / CharacteristicLength(mechanism));
}

// Of a body, from one pose to another [rad].
double LargestTurn(const BodyStates& from, const BodyStates& to) {
  double largest = 0.0;
  for (size_t b = 1; b < from.X_WB.size(); ++b) {
    const Mat3 R = from.X_WB[b].linear().transpose() * to.X_WB[b].linear();
    largest = std::max(largest, Eigen::AngleAxisd(R).angle());
  }
  return largest;
}
// A pose with a body turned farther is another assembly, not the least gap of rounded data.
constexpr double kElsewhere = 0.3;

// Which way to close the group is chosen, from 0; what cannot be met is reported.
std::optional<size_t> Chosen(const Mechanism& mechanism, const GroupAssemblies& found,
                             const AssemblyChoice& choice, HomeResult* result) {
  for (const int c : found.group.closures) {
    const auto at = choice.find(mechanism.joints[c].name);
    if (at == choice.end()) continue;
    const int ways = static_cast<int>(found.assemblies.size());
    if (at->second >= 1 && at->second <= ways) return static_cast<size_t>(at->second - 1);
    result->unmet.push_back({.closure = at->first, .wanted = at->second, .found = ways});
  }
  return {};
}

bool IsNamed(const Mechanism& mechanism, const LoopGroup& group, const AssemblyChoice& choice) {
  return std::ranges::any_of(group.closures,
                             [&](int c) { return choice.contains(mechanism.joints[c].name); });
}

Attempt BestAttempt(const Mechanism& mechanism, const Coordinates& guess,
                    const AssemblyChoice& choice, HomeResult* result) {
  const std::vector<bool> driven = DrivenJoints(mechanism);
  const std::vector<bool> none(mechanism.joints.size(), false);
  Attempt best = Close(mechanism, driven, guess);
  const auto open = [&] { return best.gap > ToleranceAt(mechanism, best.states.X_WB); };
  const auto try_from = [&](const std::vector<bool>& locked, const Coordinates& start) {
    Attempt attempt = Close(mechanism, locked, start);
    if (attempt.gap >= best.gap) return false;
    best = std::move(attempt);
    return true;
  };
  if (open() && !mechanism.couplings.empty()) {
    (void)try_from(driven, Followed(mechanism, driven, guess));
  }
  const bool any_driven = std::find(driven.begin(), driven.end(), true) != driven.end();
  if (open() && any_driven) result->drives_moved = try_from(none, guess);

  if (!open() && choice.empty()) return best;

  // Loops that are open at the best pose so far, each group by itself; then all from there.
  Coordinates start = guess;
  const Coordinates at_best = CoordinatesOf(mechanism, best, guess);
  bool any = false, drives_moved = false, chosen = false;
  for (const LoopGroup& group : LoopGroups(mechanism)) {
    double gap = 0.0;
    for (const int c : group.closures) {
      const LoopGap at = GapOf(mechanism, c, best.states);
      gap = std::max({gap, at.position_m / CharacteristicLength(mechanism), at.rotation_rad});
    }
    // What is open by as little is rounded data: another way to close it is none.
    constexpr double kRounded = 5e-3;  // characteristic lengths, rad
    const bool is_open = gap > kRounded || IsNamed(mechanism, group, choice);
    GroupAssemblies found;
    if (is_open) found = FindAssemblies(mechanism, group, driven, guess);
    if (const auto named = Chosen(mechanism, found, choice, result)) {
      chosen = true;
      std::rotate(found.assemblies.begin(),
                  found.assemblies.begin() + static_cast<std::ptrdiff_t>(*named),
                  found.assemblies.begin() + static_cast<std::ptrdiff_t>(*named) + 1);
    }
    const Coordinates& way = found.assemblies.empty() ? found.best : found.assemblies.front().q;
    for (size_t k = 0; k < group.joints.size(); ++k) {
      start[group.joints[k]] = k < way.size() ? way[k] : at_best[group.joints[k]];
    }
    if (!is_open) continue;
    any = true;
    drives_moved = drives_moved || found.drives_moved;
    result->searched.push_back(std::move(found));
  }
  if (chosen) best.gap = std::numeric_limits<double>::infinity();  // closed another way
  bool closer = any && !drives_moved && try_from(driven, start);
  if (any && open()) closer = try_from(none, start) || closer;
  if (closer) {
    result->guesses_moved = !chosen;
    result->drives_moved = result->drives_moved || drives_moved;
  }
  // Rounded data: the least gap near the guesses.
  std::mt19937_64 random(20220101);
  for (int i = 0; i < 12 && !any && open(); ++i) {
    const std::vector<bool>& locked = i % 2 == 0 ? driven : none;
    const double amplitude = 0.05 * (1 + i);
    const Attempt before = best;
    if (!try_from(locked, Disturbed(mechanism, guess, locked, amplitude, &random))) continue;
    if (LargestTurn(before.states, best.states) > kElsewhere) {
      best = before;
      continue;
    }
    result->guesses_moved = true;
    result->drives_moved = any_driven && i % 2 == 1;
  }
  return best;
}

}  // namespace

std::string HomeResult::Text(const Mechanism& mechanism) const {
  if (closed) return fmt::format("all loops close within {:.1e}", gap);
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(gaps.size(), 3); ++i) {
    text +=
        fmt::format("{}{} is open by {:.4g} m and {:.4g} rad", i == 0 ? "" : "; ",
                    mechanism.joints[gaps[i].joint].name, gaps[i].position_m, gaps[i].rotation_rad);
  }
  for (const CouplingGap& missed : couplings) {
    const Coupling& coupling = mechanism.couplings[missed.coupling];
    text += fmt::format("{}coupling {} of {} is missed by {:.4g} {}", text.empty() ? "" : "; ",
                        coupling.name, CoupledJoints(mechanism, coupling), missed.amount,
                        missed.angular ? "rad" : "m");
  }
  return text;
}

std::vector<std::array<double, 6>> JointCoordinatesAt(const Mechanism& mechanism,
                                                      const std::vector<Pose>& X_WB,
                                                      const Coordinates& near) {
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  Coordinates q(mechanism.joints.size());
  for (size_t j = 0; j < q.size(); ++j) {
    q[j].fill(0.0);
    for (int c = 0; c < DofsOf(mechanism.joints[j].kind); ++c) {
      q[j][c] = JointCoordinateRow(mechanism.joints[j], c, states, near[j][c]).value;
    }
  }
  return q;
}

HomeResult SolveHome(Mechanism* mechanism, const AssemblyChoice& choice) {
  const double length = CharacteristicLength(*mechanism);
  Coordinates guess;
  for (const Joint& joint : mechanism->joints) guess.push_back(joint.guess);

  HomeResult result;
  for (const auto& [closure, wanted] : choice) {
    const int j = mechanism->FindJoint(closure);
    if (j >= 0 && mechanism->joints[j].closure) continue;
    result.unmet.push_back({.closure = closure, .wanted = wanted, .found = -1});
  }
  const Attempt best = BestAttempt(*mechanism, guess, choice, &result);
  mechanism->X_WB_home = best.states.X_WB;
  const Coordinates home = CoordinatesOf(*mechanism, best, guess);
  BodyStates at_guess;
  at_guess.Resize(mechanism->bodies.size());
  at_guess.X_WB = TreePoses(*mechanism, guess);
  at_guess.coupled = CoupledGuesses(*mechanism);
  for (size_t j = 0; j < home.size(); ++j) {
    mechanism->joints[j].home = home[j];
    if (mechanism->joints[j].closure) {
      result.gaps.push_back(GapOf(*mechanism, static_cast<int>(j), best.states));
    }
  }
  const std::vector<CouplingRow> coupled = CouplingRows(*mechanism, best.states);
  for (size_t c = 0; c < coupled.size(); ++c) {
    const CouplingRow& row = coupled[c];
    if (std::abs(row.value) <= kHomeTolerance * (row.angular ? 1.0 : length)) continue;
    result.couplings.push_back(
        {.coupling = static_cast<int>(c), .amount = row.value, .angular = row.angular});
  }
  const auto size = [&](const LoopGap& g) {
    return std::max(g.position_m / length, g.rotation_rad);
  };
  std::stable_sort(result.gaps.begin(), result.gaps.end(),
                   [&](const LoopGap& a, const LoopGap& b) { return size(a) > size(b); });
  result.gap = best.gap;
  result.gap_at_guess = LargestGap(*mechanism, at_guess, length);
  result.tolerance = ToleranceAt(*mechanism, best.states.X_WB);
  result.closed = best.gap <= result.tolerance;
  return result;
}

}  // namespace mbv
