#include "reference/closure_failure.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "core/spatial.h"
#include "kinematics/damped_search.h"
#include "mechanism/reach.h"
#include "reference/closure_solver.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

constexpr double kHard = 1e3;      // weight of rows that should hold, against 1 of the others
constexpr double kReached = 1e-6;  // residual [1] of a pose that closes after all
// Steps in rad, or characteristic lengths: short, so that assemblies stay apart.
constexpr DampingRule kDamping{.most_steps = 60,
                               .largest_step = 0.3,
                               .first = 1e-3,
                               .least = 1e-12,
                               .most = 1e12,
                               .easier = 0.1,
                               .stronger = 10.0};

// All joint rows and commands as a weighted dense least-squares problem, lengths per L.
class OpenLoops {
 public:
  OpenLoops(const Mechanism& mechanism, const std::vector<Command>& commands, const VecX& target,
            const std::vector<std::vector<double>>& near_values)
      : mechanism_(mechanism),
        commands_(commands),
        target_(target),
        near_values_(near_values),
        length_(CharacteristicLength(mechanism)),
        any_closure_(!mechanism.couplings.empty() ||
                     std::any_of(mechanism.joints.begin(), mechanism.joints.end(),
                                 [](const Joint& joint) { return joint.closure; })) {}

  // Weighted residual; with the Jacobian when J is given.
  VecX Evaluate(const BodyStates& states, bool weighted, MatX* J) {
    RowSet rows;
    std::vector<double> weight;
    for (const Joint& joint : mechanism_.joints) {
      const ConstraintRows joint_rows = RowsOf(joint, states, false);
      rows.Add(joint_rows, joint_rows.rows);
      weight.resize(rows.size(), weighted && !joint.closure ? kHard : 1.0);
    }
    for (const CouplingRow& row : CouplingRows(mechanism_, states)) rows.Add(row);
    weight.resize(rows.size(), 1.0);
    for (size_t k = 0; k < commands_.size(); ++k) {
      rows.Add(mechanism_, commands_[k], states, &near_values_[k]);
      rows.value.back() -= target_[k];
    }
    weight.resize(rows.size(), weighted && any_closure_ ? kHard : 1.0);

    VecX r(rows.size());
    if (J != nullptr) J->setZero(rows.size(), 6 * (mechanism_.bodies.size() - 1));
    for (int i = 0; i < rows.size(); ++i) {
      const double scale = weight[i] / (rows.angular[i] ? 1.0 : length_);
      r[i] = scale * rows.value[i];
      if (J == nullptr) continue;
      for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
        const int at = 6 * (rows.body[p] - 1);
        J->block<1, 3>(i, at) = scale * rows.J[p].head<3>().transpose();
        J->block<1, 3>(i, at + 3) = scale * length_ * rows.J[p].tail<3>().transpose();
      }
    }
    return r;
  }

  // Unscales a step of twists whose velocities are per L.
  [[nodiscard]] VecX Unscaled(VecX twists) const {
    for (Eigen::Index i = 3; i < twists.size(); i += 6) twists.segment<3>(i) *= length_;
    return twists;
  }

  // From `states`, which end at the best compromise.
  void Minimise(BodyStates* states) {
    constexpr double kSettled = 1e-9;    // a smaller share of the residual is no progress
    constexpr double kRounding = 1e-12;  // of scaled rows
    const auto evaluate = [&](BodyStates* at, MatX* J) { return Evaluate(*at, true, J); };
    const auto move = [&](const VecX& s, BodyStates* at) {
      MoveBodies(Unscaled(s), at);
      FollowCouplings(mechanism_, at);
    };
    const auto enough = [](const internal::DampedStepMade& step) {
      const double now = step.r.norm();
      return step.better && (now > (1 - kSettled) * step.before || now < kRounding);
    };
    internal::DampedSearch(kDamping, states, evaluate, move, enough);
  }

  [[nodiscard]] double length() const { return length_; }

 private:
  const Mechanism& mechanism_;
  const std::vector<Command>& commands_;
  const VecX& target_;
  std::vector<std::vector<double>> near_values_;
  double length_;
  bool any_closure_;
};

// The largest open joint, or the largest missed command where no loop can open.
void NameWorst(const Mechanism& mechanism, const std::vector<Command>& commands,
               const BodyStates& states, const VecX& r, double length, RunSummary* summary) {
  double worst = 0.0;
  int row = 0;
  const auto offer = [&](const std::string& name, double size, double amount, const char* unit) {
    if (size <= worst) return;
    worst = size;
    summary->where = name;
    summary->amount = amount;
    summary->unit = unit;
  };
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows rows = RowsOf(joint, states, false);
    const double gap = rows.residual.head(rows.translation_rows).norm();
    const double turn =
        r.segment(row + rows.translation_rows, rows.rows - rows.translation_rows).norm();
    offer(joint.name, gap / length, gap, "m");
    offer(joint.name, turn, turn, "rad");
    row += rows.rows;
  }
  const std::vector<CouplingRow> coupled = CouplingRows(mechanism, states);
  for (size_t c = 0; c < coupled.size(); ++c) {
    const bool angular = coupled[c].angular;
    const double miss = std::abs(r[row++]);
    offer(mechanism.couplings[c].name, miss, angular ? miss : miss * length, angular ? "rad" : "m");
  }
  for (const Command& command : commands) {
    const bool angle = !IsLength(mechanism, command.terms.front().coordinate);
    const double miss = std::abs(r[row++]);
    offer(command.name, miss, angle ? miss : miss * length, angle ? "rad" : "m");
  }
}

}  // namespace

std::string MostMovingJoint(const Mechanism& mechanism, const BodyStates& states,
                            const VecX& twists) {
  std::vector<Vec6> motion(mechanism.bodies.size(), Vec6::Zero());
  if (twists.size() == 6 * (static_cast<Eigen::Index>(motion.size()) - 1)) {
    Unstack(twists, &motion);
  }
  const double length = CharacteristicLength(mechanism);
  std::string name;
  double most = 0.0;
  for (const Joint& joint : mechanism.joints) {
    for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
      const ScalarRow row = JointCoordinateRow(joint, c, states);
      const bool length_unit = !row.J_child.tail<3>().isZero();
      const double rate =
          std::abs(row.J_parent.dot(motion[joint.parent]) + row.J_child.dot(motion[joint.child])) /
          (length_unit ? length : 1.0);
      if (rate > most) {
        most = rate;
        name = joint.name;
      }
    }
  }
  return name;
}

RunSummary ExplainUnreached(const Mechanism& mechanism, const std::vector<Command>& commands,
                            const VecX& target, const BodyStates& nearest,
                            std::vector<std::vector<double>> near_values) {
  OpenLoops loops(mechanism, commands, target, near_values);
  BodyStates best = nearest;
  loops.Minimise(&best);
  const VecX r = loops.Evaluate(best, false, nullptr);

  RunSummary summary;
  if (r.norm() > kReached) {
    summary.stop = Stop::kUnreachable;
    NameWorst(mechanism, commands, best, r, loops.length(), &summary);
    summary.message =
        fmt::format("the commanded pose cannot be reached: {} stays open by {:.4g} {}",
                    summary.where, summary.amount, summary.unit);
    return summary;
  }
  MatX J;
  (void)loops.Evaluate(nearest, false, &J);
  const Eigen::BDCSVD<MatX> svd(J, Eigen::ComputeThinV);
  const Eigen::Index last = svd.singularValues().size() - 1;
  summary.stop = Stop::kSingular;
  summary.where = MostMovingJoint(mechanism, nearest, loops.Unscaled(svd.matrixV().col(last)));
  summary.amount = svd.singularValues()[last];
  summary.unit = "1";
  summary.message = fmt::format(
      "the commanded motion passes a singular pose near {} (smallest singular value {:.1e})",
      summary.where, summary.amount);
  return summary;
}

}  // namespace mbv::internal
