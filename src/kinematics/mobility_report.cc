#include "kinematics/mobility_report.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>

#include "core/spatial.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/loops.h"
#include "kinematics/row_stack.h"
#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::FindRank;
using internal::kStressTolerance;
using internal::NullSpaces;
using internal::RowStack;

BodyStates StatesOfPoses(const std::vector<Pose>& X_WB) {
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  return states;
}

// Rows of the stack by owner: joints and couplings first, then (with drives) drives and prescribed
// joints.
struct Owner {
  enum class Kind { kJoint, kCoupling, kDrive, kPrescribed } kind;
  int index = 0;
  int first_row = 0, rows = 0;
};

struct Stresses {
  std::vector<Owner> owners;
  MatX self_stress;
};

Stresses FindStresses(const Mechanism& mechanism, const BodyStates& states, bool with_drives) {
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  Stresses out;
  int row = 0;
  const auto own = [&](Owner::Kind kind, size_t index, int rows) {
    out.owners.push_back({kind, static_cast<int>(index), row, rows});
    row += rows;
  };
  stack.AddJoints(mechanism, states, with_drives);
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    own(Owner::Kind::kJoint, j, RowsOf(mechanism.joints[j], states, with_drives).rows);
  }
  for (size_t c = 0; c < mechanism.couplings.size(); ++c) own(Owner::Kind::kCoupling, c, 1);
  if (with_drives) {
    stack.AddDriven(mechanism, states);
    for (size_t d = 0; d < mechanism.drives.size(); ++d) own(Owner::Kind::kDrive, d, 1);
    for (size_t p = 0; p < mechanism.prescribed.size(); ++p) own(Owner::Kind::kPrescribed, p, 1);
  }
  out.self_stress = FindRank(stack.Matrix(), NullSpaces::kSelfStress).self_stress;
  return out;
}

// The projector on the self-stresses has no entries between parts that do not share one, whatever
// the basis; its trace over a part counts that part's self-stresses.
std::vector<StressGroup> GroupsOf(const Mechanism& mechanism, const Stresses& stresses) {
  if (stresses.self_stress.cols() == 0) return {};
  const MatX basis = internal::Orthonormal(stresses.self_stress);
  const MatX P = basis * basis.transpose();
  const std::vector<Owner>& owners = stresses.owners;
  std::vector<size_t> group(owners.size());
  std::iota(group.begin(), group.end(), size_t{0});
  for (size_t a = 0; a < owners.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const auto block =
          P.block(owners[a].first_row, owners[b].first_row, owners[a].rows, owners[b].rows);
      if (block.size() == 0 || block.cwiseAbs().maxCoeff() <= kStressTolerance) continue;
      const size_t from = group[a], to = group[b];
      std::replace(group.begin(), group.end(), from, to);
    }
  }
  std::vector<StressGroup> groups;
  for (size_t g = 0; g < owners.size(); ++g) {
    StressGroup part;
    double trace = 0.0;
    for (size_t a = 0; a < owners.size(); ++a) {
      if (group[a] != g) continue;
      const double share =
          P.diagonal().segment(owners[a].first_row, owners[a].rows).cwiseAbs().sum();
      if (share <= kStressTolerance) continue;
      trace += share;
      switch (owners[a].kind) {
        case Owner::Kind::kJoint:
          part.joints.push_back(mechanism.joints[owners[a].index].name);
          break;
        case Owner::Kind::kCoupling:
          part.couplings.push_back(mechanism.couplings[owners[a].index].name);
          break;
        case Owner::Kind::kDrive:
          part.drives.push_back(mechanism.drives[owners[a].index].name);
          break;
        case Owner::Kind::kPrescribed:
          part.prescribed.push_back(mechanism.prescribed[owners[a].index].name);
          break;
      }
    }
    part.count = static_cast<int>(std::lround(trace));
    if (part.count > 0) groups.push_back(part);
  }
  return groups;
}

std::vector<std::string> FreeBodies(const Mechanism& mechanism, const BodyStates& states) {
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  stack.AddIdle(mechanism, states);
  stack.AddDriven(mechanism, states);
  const MatX motion = FindRank(stack.Matrix(), NullSpaces::kMotion).motion;
  std::vector<std::string> names;
  for (size_t b = 1; b < mechanism.bodies.size() && motion.cols() > 0; ++b) {
    const auto twist = motion.middleRows<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    if (twist.cwiseAbs().maxCoeff() > kStressTolerance) names.push_back(mechanism.bodies[b].name);
  }
  return names;
}

// A pose that closes the loops, a random step along the freedoms away from home.
std::optional<BodyStates> RandomPose(const Mechanism& mechanism, double step,
                                     std::mt19937_64* random) {
  const double length = CharacteristicLength(mechanism);
  const BodyStates home = StatesOfPoses(mechanism.X_WB_home);
  RowStack stack(mechanism.bodies.size(), length);
  stack.AddJoints(mechanism, home, false);
  const MatX motion = FindRank(stack.Matrix(), NullSpaces::kMotion).motion;
  if (motion.cols() == 0) return std::nullopt;
  std::normal_distribution<double> normal;
  VecX direction(motion.cols());
  for (int i = 0; i < direction.size(); ++i) direction[i] = normal(*random);
  VecX dx = motion * direction;
  dx *= step / dx.cwiseAbs().maxCoeff();

  std::vector<Pose> X_WB = mechanism.X_WB_home;
  for (size_t b = 1; b < X_WB.size(); ++b) {
    const Vec6 twist = dx.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    X_WB[b].linear() = ExpRotation(twist.head<3>()) * X_WB[b].linear();
    X_WB[b].translation() += length * twist.tail<3>();
  }
  Mechanism moved = mechanism;
  std::vector<std::array<double, 6>> near;
  for (const Joint& joint : mechanism.joints) near.push_back(joint.home);
  const auto guess = JointCoordinatesAt(mechanism, X_WB, near);
  for (size_t j = 0; j < guess.size(); ++j) moved.joints[j].guess = guess[j];
  if (!SolveHome(&moved).closed) return std::nullopt;
  return StatesOfPoses(moved.X_WB_home);
}

int Least(const MobilityReport& report, int Mobility::*count) {
  int least = report.home.*count;
  for (const Mobility& mobility : report.nearby) least = std::min(least, mobility.*count);
  return least;
}

}  // namespace

int MobilityReport::freedoms() const { return Least(*this, &Mobility::freedoms); }
int MobilityReport::undriven() const { return Least(*this, &Mobility::undriven); }
int MobilityReport::redundant_count() const { return Least(*this, &Mobility::redundant); }

MobilityReport ReportMobility(const Mechanism& mechanism, int poses) {
  MobilityReport report;
  report.home = AnalyseMobility(mechanism);
  const BodyStates home = StatesOfPoses(mechanism.X_WB_home);

  // Small enough to stay in reach, large against the tolerance of a rank.
  report.nearby_step = 0.02;
  std::mt19937_64 random(20260801);
  for (int i = 0; i < poses; ++i) {
    if (const auto states = RandomPose(mechanism, report.nearby_step, &random)) {
      report.nearby.push_back(AnalyseMobility(mechanism, *states));
    }
  }

  report.loops = CountLoops(mechanism);
  report.redundant = GroupsOf(mechanism, FindStresses(mechanism, home, false));
  report.undetermined = GroupsOf(mechanism, FindStresses(mechanism, home, true));
  for (const Spin& spin : FindSpins(mechanism)) {
    if (!spin.why_not.empty()) report.spins_not_idle.push_back(spin.name + ": " + spin.why_not);
  }
  if (report.home.undriven > 0) report.free_bodies = FreeBodies(mechanism, home);
  return report;
}

}  // namespace mbv
