#include "kinematics/command_rank.h"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <algorithm>
#include <functional>

#include "base/text.h"
#include "kinematics/constraints.h"
#include "kinematics/row_stack.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"

namespace mbv {

namespace {

using internal::FindRank;
using internal::NullSpaces;
using internal::RankOf;
using internal::RowStack;

BodyStates HomeStates(const Mechanism& mechanism) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  return states;
}

// Of the joints, and of what needs no command.
RowStack HeldRows(const Mechanism& mechanism, const BodyStates& states) {
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  stack.AddIdle(mechanism, states);
  return stack;
}

// The gradient of a command, scaled as the joint rows.
void AddCommand(const Mechanism& mechanism, const BodyStates& states, const Command& command,
                RowStack* stack) {
  std::vector<ScalarRow> terms;
  bool turns = true;
  for (const Command::Term& term : command.terms) {
    ScalarRow& row = terms.emplace_back(CoordinateRow(mechanism, term.coordinate, states));
    row.J_parent *= term.factor;
    row.J_child *= term.factor;
    turns = turns && row.J_parent.tail<3>().isZero(0.0) && row.J_child.tail<3>().isZero(0.0);
  }
  stack->AddSum(terms, !turns);
}

// Names of the joints that some column of `motion` moves.
std::vector<std::string> MovingJoints(const Mechanism& mechanism, const BodyStates& states,
                                      const MatX& motion) {
  std::vector<std::string> names;
  if (motion.cols() == 0) return names;
  for (const Joint& joint : mechanism.joints) {
    RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      stack.Add(JointCoordinateRow(joint, c, states), IsLength(joint.kind, c));
    }
    if (stack.size() == 0) continue;
    const MatX rates = stack.Matrix() * motion;
    if (rates.cwiseAbs().maxCoeff() > internal::kStressTolerance) names.push_back(joint.name);
  }
  return names;
}

}  // namespace

CommandRank RankCommands(const Mechanism& mechanism, const std::vector<Command>& commands) {
  const BodyStates home = HomeStates(mechanism);
  RowStack rows = HeldRows(mechanism, home);
  const auto held_rows = rows.size();
  const int columns = 6 * (static_cast<int>(mechanism.bodies.size()) - 1);
  CommandRank out;
  for (const Command& command : commands) AddCommand(mechanism, home, command, &rows);
  const internal::NestedRanks ranks = internal::RanksInTree(rows, mechanism, home, held_rows);

  out.dofs = columns - ranks.first;
  out.undriven = columns - ranks.all;
  out.redundant = static_cast<int>(commands.size()) - (out.dofs - out.undriven);
  if (out.undriven > 0) {
    const MatX motion = FindRank(rows.Matrix(), NullSpaces::kMotion).motion;
    out.free_joints = MovingJoints(mechanism, home, motion);
  }
  if (out.redundant <= 0) return out;
  const MatX stress = FindRank(rows.Matrix(), NullSpaces::kSelfStress).self_stress;
  for (size_t k = 0; k < commands.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(held_rows) + static_cast<Eigen::Index>(k);
    if (stress.row(row).cwiseAbs().maxCoeff() > internal::kStressTolerance) {
      out.dependent.push_back(static_cast<int>(k));
    }
  }
  return out;
}

std::vector<size_t> IndependentCommands(const Mechanism& mechanism,
                                        const std::vector<Command>& commands,
                                        const std::vector<Command>& candidates, size_t count) {
  const BodyStates home = HomeStates(mechanism);
  RowStack rows = HeldRows(mechanism, home);
  for (const Command& command : commands) AddCommand(mechanism, home, command, &rows);
  int rank = RankOf(rows.Matrix());
  std::vector<size_t> chosen;
  for (size_t k = 0; k < candidates.size() && chosen.size() < count; ++k) {
    RowStack more = rows;
    AddCommand(mechanism, home, candidates[k], &more);
    const int new_rank = RankOf(more.Matrix());
    if (new_rank == rank) continue;
    rank = new_rank;
    rows = std::move(more);
    chosen.push_back(k);
  }
  return chosen;
}

namespace {

constexpr double kStill = 1e-7;  // a gradient of what cannot move: rounding

Command HeldAt(const Coordinate& coordinate) { return {.name = "", .terms = {{coordinate, 1.0}}}; }

// A row per coordinate, a column per DOF.
MatX GradientsInDofs(const Mechanism& mechanism, const std::vector<Coordinate>& coordinates) {
  const BodyStates home = HomeStates(mechanism);
  const MatX motion = FindRank(HeldRows(mechanism, home).Matrix(), NullSpaces::kMotion).motion;
  RowStack rows(mechanism.bodies.size(), CharacteristicLength(mechanism));
  for (const Coordinate& coordinate : coordinates) {
    AddCommand(mechanism, home, HeldAt(coordinate), &rows);
  }
  return rows.Matrix() * motion;
}

}  // namespace

std::optional<NamedChoice> ChooseNamedCoordinates(const Mechanism& mechanism,
                                                  const std::vector<std::string>& names,
                                                  const std::vector<Coordinate>& first,
                                                  Diagnostics* diagnostics) {
  constexpr size_t kNamed = 8;
  NamedChoice choice;
  const std::vector<NamedCoordinate> all = NamedMotionCoordinates(mechanism);
  const auto error = [&](const std::string& message, const std::string& hint) {
    diagnostics->AddError(mechanism.file, message, hint);
    return std::nullopt;
  };
  std::vector<NamedCoordinate> candidates;
  const auto is_candidate = [&](const std::string& name) {
    return std::ranges::find(candidates, name, &NamedCoordinate::name) != candidates.end();
  };
  for (const NamedCoordinate& at : all) {
    const bool held = at.coordinate.kind == Coordinate::Kind::kPrescribed;
    if (held && !Contains(names, at.name)) candidates.push_back(at);
  }
  choice.held = candidates;
  for (const std::string& name : names) {
    const auto at = std::ranges::find(all, name, &NamedCoordinate::name);
    if (at == all.end()) {
      const std::vector<std::string> known = NamesOf(all);
      return error("there is no coordinate '" + name + "'",
                   DidYouMean(name, known, "there are: " + Joined(known, kNamed)));
    }
    if (is_candidate(name)) return error("coordinate '" + name + "' is chosen twice", "each once");
    candidates.push_back(*at);
  }
  const auto add = [&](auto wanted) {
    for (const NamedCoordinate& at : all) {
      if (wanted(at.coordinate) && !is_candidate(at.name)) candidates.push_back(at);
    }
  };
  if (names.empty()) {
    add([&](const Coordinate& c) { return std::ranges::find(first, c) != first.end(); });
    add([](const Coordinate& c) { return c.kind == Coordinate::Kind::kDrive; });
  }
  const size_t preferred = candidates.size();
  add([](const Coordinate& /*any*/) { return true; });
  std::vector<Coordinate> at;
  at.reserve(candidates.size());
  for (const NamedCoordinate& candidate : candidates) at.push_back(candidate.coordinate);
  const CoordinateChoice found = ChooseCoordinates(mechanism, at, preferred);
  std::vector<std::string> chosen, depend;
  for (const size_t k : found.chosen) {
    if (k < choice.held.size()) continue;
    chosen.push_back(candidates[k].name);
    choice.coordinates.push_back(candidates[k]);
  }
  for (const size_t k : found.dependent) depend.push_back(candidates[k].name);
  const bool all_chosen =
      std::ranges::all_of(found.chosen, [&](size_t k) { return k < preferred; });
  if (!names.empty() && (!depend.empty() || !all_chosen)) {
    return error(depend.empty()
                     ? fmt::format("{} has {} degrees of freedom, of which {} are held or chosen",
                                   mechanism.name, found.dofs, preferred)
                     : "at home these depend on those before: " + Joined(depend, kNamed),
                 "a set that does: " + Joined(chosen, kNamed));
  }
  if (found.left() > 0 || choice.coordinates.empty()) {
    return error("no set of coordinates holds the mechanism at home",
                 "a mechanism whose motion coordinates of joints, drives or outputs determine");
  }
  return choice;
}

std::vector<size_t> StuckDrives(const Mechanism& mechanism) {
  std::vector<Coordinate> drives;
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    drives.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  const MatX gradients = GradientsInDofs(mechanism, drives);
  std::vector<size_t> stuck;
  for (size_t d = 0; d < drives.size(); ++d) {
    if (!(gradients.row(static_cast<Eigen::Index>(d)).norm() > kStill)) stuck.push_back(d);
  }
  return stuck;
}

CoordinateChoice ChooseCoordinates(const Mechanism& mechanism,
                                   const std::vector<Coordinate>& candidates, size_t preferred,
                                   size_t makeshift) {
  constexpr double kOfMakeshift = 0.1;
  // Share of a gradient that others do not hold. Forces of what is chosen grow by its inverse.
  constexpr double kWell = 1e-2, kIndependent = 1e-5;
  // What is chosen is taken out of those that are left.
  MatX gradients = GradientsInDofs(mechanism, candidates);
  CoordinateChoice choice{
      .dofs = static_cast<int>(gradients.cols()), .chosen = {}, .dependent = {}};
  const VecX lengths = gradients.rowwise().norm();
  const auto take = [&](Eigen::Index k) {
    choice.chosen.push_back(static_cast<size_t>(k));
    const Eigen::RowVectorXd direction = gradients.row(k).normalized();
    gradients -= (gradients * direction.transpose()) * direction;
  };
  // What hardly differs from the others is taken only where nothing better is preferred.
  std::vector<size_t>& rest = choice.dependent;
  for (size_t k = 0; k < preferred; ++k) rest.push_back(k);
  for (const double share : {kWell, kIndependent}) {
    std::erase_if(rest, [&](size_t k) {
      const auto row = static_cast<Eigen::Index>(k);
      if (!(gradients.row(row).norm() > std::max(share * lengths[row], kStill))) return false;
      take(row);
      return true;
    });
  }
  std::ranges::sort(choice.chosen);
  const auto others =
      gradients.rows() - static_cast<Eigen::Index>(std::min(makeshift, candidates.size()));
  while (choice.left() > 0 && gradients.rows() > 0) {
    Eigen::Index best = 0;
    VecX moves = gradients.rowwise().norm();
    moves = (moves.array() > kIndependent).select(moves, 0.0);
    moves.tail(others) *= kOfMakeshift;
    if (moves.maxCoeff(&best) == 0.0) break;
    take(best);
  }
  return choice;
}

std::vector<Vec6> FreeMotion(const Mechanism& mechanism, const std::vector<Coordinate>& held) {
  const BodyStates home = HomeStates(mechanism);
  RowStack rows = HeldRows(mechanism, home);
  for (const Coordinate& coordinate : held) AddCommand(mechanism, home, HeldAt(coordinate), &rows);
  const MatX motion = FindRank(rows.Matrix(), NullSpaces::kMotion).motion;
  if (motion.cols() == 0) return {};
  const VecX first = motion.col(0) / motion.col(0).cwiseAbs().maxCoeff();
  std::vector<Vec6> twists(mechanism.bodies.size(), Vec6::Zero());
  const double length = CharacteristicLength(mechanism);
  for (size_t b = 1; b < twists.size(); ++b) {
    twists[b] = first.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    twists[b].tail<3>() *= length;
  }
  return twists;
}

// From the null space N of the joints' rows: the rates of all driven coordinates are D x for twists
// N x, so that one of them moves alone at x = D⁺ e.

namespace {

using internal::FindRank;
using internal::NullSpaces;
using internal::RowStack;

// A motion that a drive hardly sees at home (a dead centre) would get any size: it is left out.
constexpr double kSeen = 1e-3;
// Twists below this share of the largest one are round-off.
constexpr double kMoves = 1e-9;

BodyStates HomeOrFirstStates(const Mechanism& mechanism) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  if (!mechanism.X_WB_home.empty()) states.X_WB = mechanism.X_WB_home;
  return states;
}

// Rows of the driven coordinates (scaled as RowStack does) in terms of x; not held ones are zero.
MatX DrivenRows(const Mechanism& mechanism, const BodyStates& states, double length,
                const std::vector<bool>& held, const MatX& N) {
  RowStack stack(mechanism.bodies.size(), length);
  stack.AddDriven(mechanism, states);
  MatX D = stack.Matrix() * N;
  for (size_t d = 0; d < held.size(); ++d) {
    if (!held[d]) D.row(static_cast<Eigen::Index>(d)).setZero();
  }
  return D;
}

// Unscales the columns of X = N x: twists [ω; v] of every body, per column.
std::vector<std::vector<Vec6>> Twists(const MatX& X, size_t bodies, double length) {
  std::vector<std::vector<Vec6>> twists;
  for (Eigen::Index k = 0; k < X.cols(); ++k) {
    std::vector<Vec6> V(bodies, Vec6::Zero());
    for (size_t b = 1; b < bodies; ++b) {
      V[b] = X.col(k).segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
      V[b].tail<3>() *= length;
    }
    twists.push_back(std::move(V));
  }
  return twists;
}

// Kinetic energy is xᵀ M x / 2; massless motions get a little, so that M can be inverted.
MatX MassMatrix(const Mechanism& mechanism, const BodyStates& states,
                const std::vector<std::vector<Vec6>>& basis) {
  constexpr double kMassless = 1e-12;
  const auto n = static_cast<Eigen::Index>(basis.size());
  MatX M = MatX::Zero(n, n);
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Mat3 R_WB = states.X_WB[b].linear();
    const Vec3 r_W = R_WB * body.p_BoBcm_B;
    MatX w(3, n), v(3, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec6& V = basis[static_cast<size_t>(k)][b];
      w.col(k) = V.head<3>();
      v.col(k) = V.tail<3>() + V.head<3>().cross(r_W);
    }
    M += body.mass * v.transpose() * v + w.transpose() * R_WB * body.I_Bcm_B * R_WB.transpose() * w;
  }
  const double least = kMassless * M.trace();
  M.diagonal().array() += least > 0.0 ? least : 1.0;
  return M;
}

// One column per driven coordinate: the x at which it alone has the rate 1 (in scaled units).
MatX MoveAlone(const MatX& D, const std::function<MatX()>& mass_matrix) {
  const MatX one = MatX::Identity(D.rows(), D.rows());
  Eigen::CompleteOrthogonalDecomposition<MatX> all(D.rows(), D.cols());
  all.setThreshold(kSeen);
  all.compute(D);
  if (all.rank() == D.cols()) return all.solve(one);
  const MatX response = mass_matrix().ldlt().solve(MatX(D.transpose()));
  const MatX A = D * response;
  const VecX size = A.diagonal().cwiseSqrt();
  const VecX scale = (size.array() > 0.0).select(size.cwiseInverse(), 0.0);
  Eigen::CompleteOrthogonalDecomposition<MatX> scaled(A.rows(), A.cols());
  scaled.setThreshold(kSeen * kSeen);
  scaled.compute(scale.asDiagonal() * A * scale.asDiagonal());
  return response * (scale.asDiagonal() * scaled.solve(MatX(scale.asDiagonal() * one)));
}

// Bodies that move in some x with the prescribed joints at rest.
std::vector<bool> Movable(const MatX& N, const MatX& prescribed, size_t bodies) {
  MatX free = N;
  if (prescribed.rows() > 0 && N.cols() > 0) {
    free = N * FindRank(prescribed, NullSpaces::kMotion).motion;
  }
  std::vector<bool> moved(bodies, false);
  const double largest = free.size() == 0 ? 0.0 : free.cwiseAbs().maxCoeff();
  for (size_t b = 1; b < bodies && largest > 0.0; ++b) {
    const auto rows = free.middleRows<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    moved[b] = rows.cwiseAbs().maxCoeff() > kMoves * largest;
  }
  return moved;
}

}  // namespace

DrivenTwists TwistsOfDriven(const Mechanism& mechanism, const std::vector<bool>& held) {
  const size_t bodies = mechanism.bodies.size();
  const double length = CharacteristicLength(mechanism);
  const BodyStates states = HomeOrFirstStates(mechanism);
  RowStack joints(bodies, length);
  joints.AddJoints(mechanism, states, false);
  const MatX N = FindRank(joints.Matrix(), NullSpaces::kMotion).motion;
  const MatX D = DrivenRows(mechanism, states, length, held, N);
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  DrivenTwists out;
  out.moved = Movable(N, D.bottomRows(D.rows() - drives), bodies);
  if (D.rows() == 0 || D.cols() == 0) {
    out.V_WB.assign(static_cast<size_t>(D.rows()), std::vector<Vec6>(bodies, Vec6::Zero()));
    return out;
  }
  const MatX X =
      N * MoveAlone(D, [&] { return MassMatrix(mechanism, states, Twists(N, bodies, length)); });
  out.V_WB = Twists(X, bodies, length);
  // The rows of lengths were divided by L: their unit rate is 1 m/s, not L.
  for (size_t k = 0; k < out.V_WB.size(); ++k) {
    const bool is_drive = k < mechanism.drives.size();
    const bool metres =
        is_drive
            ? PositionUnit(mechanism, mechanism.drives[k]) == "m"
            : IsLength(
                  mechanism.joints[mechanism.prescribed[k - mechanism.drives.size()].joint].kind,
                  0);
    for (Vec6& V : out.V_WB[k]) V *= metres ? 1.0 / length : 1.0;
  }
  return out;
}

}  // namespace mbv
