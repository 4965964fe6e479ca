#include "kinematics/command_rank.h"

#include <algorithm>

#include "kinematics/constraints.h"
#include "kinematics/row_stack.h"
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
  const internal::SparseRows J = rows.Matrix();
  const internal::NestedRanks ranks = internal::RanksOf(J, held_rows);

  out.dofs = columns - ranks.first;
  out.undriven = columns - ranks.all;
  out.redundant = static_cast<int>(commands.size()) - (out.dofs - out.undriven);
  if (out.undriven > 0) {
    const MatX motion = FindRank(J, NullSpaces::kMotion).motion;
    out.free_joints = MovingJoints(mechanism, home, motion);
  }
  if (out.redundant <= 0) return out;
  const MatX stress = FindRank(J, NullSpaces::kSelfStress).self_stress;
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

Command HeldAt(const Coordinate& coordinate) {
  return {.name = "", .terms = {{coordinate, 1.0}}, .profile = {}};
}

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
                                   const std::vector<Coordinate>& candidates, size_t preferred) {
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
  while (choice.left() > 0 && gradients.rows() > 0) {
    Eigen::Index best = 0;
    const double most = gradients.rowwise().norm().maxCoeff(&best);
    if (most <= kIndependent) break;
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

}  // namespace mbv
