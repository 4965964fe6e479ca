#include "features/workspace/pose_space.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "kinematics/constraints.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

constexpr double kRank = 1e-9;          // pivots of A below this share of the first are zero
constexpr double kWeakest = 1e-6;       // at this share of what it is at home a constraint is lost
constexpr double kNearlyClosed = 1e-7;  // the step after such a one has the size of rounding
constexpr double kOpen = 1e-9;  // of rows that were redundant at home [rad, characteristic lengths]
constexpr double kLongStep = 0.3;    // longer ones are cut [rad, characteristic lengths]
constexpr double kTrusted = 0.5;     // a correction beyond this share of the step is not
constexpr double kOverlap = 0.3;     // of the motions before and behind a step: det N₁ᵀ N₂
constexpr double kSlopeStep = 1e-5;  // of difference quotients [rad, characteristic lengths]
constexpr int kMostIterations = 14, kMostHalvings = 8;

Eigen::RowVectorXd Projected(const ScalarRow& row, const MatX& J) {
  return row.J_parent.transpose() * J.middleRows<6>(6 * row.parent) +
         row.J_child.transpose() * J.middleRows<6>(6 * row.child);
}

}  // namespace

const char* WordOf(SetBound::Kind kind) {
  constexpr std::array<const char*, 8> kWords = {"drive",
                                                 "joint",
                                                 "cone",
                                                 "box",
                                                 "interference",
                                                 "constraint singularity",
                                                 "type-1 singularity",
                                                 "type-2 singularity"};
  return kWords.at(static_cast<size_t>(kind));
}

// All that is evaluated at a pose.
struct PoseSpace::Rows {
  BodyStates states;
  MatX J;   // twists of all bodies per scaled step of the tree
  MatX A;   // (1), scaled
  VecX r;   // residuals of A
  MatX C;   // d × n: coordinates, scaled
  VecX at;  // coordinates
  std::vector<CouplingRow> coupled;
  Eigen::ColPivHouseholderQR<MatX> qr;  // of Aᵀ
  MatX N;
};

PoseSpace::PoseSpace(const Mechanism& mechanism, SpaceSettings settings)
    : mechanism_(&mechanism),
      settings_(std::move(settings)),
      tree_(mechanism, std::vector<bool>(mechanism.joints.size(), false)),
      length_(CharacteristicLength(mechanism)),
      spins_(IdleSpins(mechanism)) {
  unit_ = VecX::Ones(tree_.dofs());
  for (int k = 0; k < tree_.dofs(); ++k) {
    if (!tree_.angular()[static_cast<size_t>(k)]) unit_[k] = length_;
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    driven_.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    driven_.push_back({Coordinate::Kind::kPrescribed, static_cast<int>(p), 0});
  }
  AddBounds();
}

PoseSpace PoseSpace::Section(int over) const {
  PoseSpace section = *this;
  VecX held = VecX::Zero(static_cast<Eigen::Index>(settings_.coordinates.size()) - over);
  const Eigen::Index same = std::min(held.size(), settings_.held.size());
  held.tail(same) = settings_.held.tail(same);
  section.settings_.held = held;
  section.settings_.over = over;
  return section;
}

double PoseSpace::UnitOf(int coordinate) const {
  return IsLength(*mechanism_, settings_.coordinates[static_cast<size_t>(coordinate)].coordinate)
             ? length_
             : 1.0;
}

void PoseSpace::AddRange(const Coordinate& coordinate, SetBound::Kind kind,
                         const std::string& subject, const CoordinateRange& range) {
  for (const bool upper : {false, true}) {
    const double limit = upper ? range.upper : range.lower;
    if (!std::isfinite(limit)) continue;
    int watched = -1;
    for (size_t w = 0; w < watched_.size(); ++w) {
      if (watched_[w].coordinate == coordinate) watched = static_cast<int>(w);
    }
    if (watched < 0) {
      watched = static_cast<int>(watched_.size());
      watched_.push_back({coordinate, HomeValue(*mechanism_, coordinate)});
    }
    // A drive on a joint with the same range bounds it once.
    bool known = false;
    for (const SetBound& bound : bounds_) {
      if (bound.watched < 0 || bound.upper != upper || bound.limit != limit) continue;
      const Coordinate& other = watched_[static_cast<size_t>(bound.watched)].coordinate;
      if (other.kind != Coordinate::Kind::kDrive) continue;
      const auto* on =
          std::get_if<JointDrive>(&mechanism_->drives[static_cast<size_t>(other.index)].kind);
      known = known || (on != nullptr && coordinate.kind == Coordinate::Kind::kJoint &&
                        on->joint == coordinate.index && on->coordinate == coordinate.component);
    }
    if (known) continue;
    const bool length = IsLength(*mechanism_, coordinate);
    bounds_.push_back(
        {kind,
         length ? fmt::format("{} at {:.6g} m", subject, limit)
                : fmt::format("{} at {:.6g}°", subject, limit * 180.0 / std::numbers::pi),
         subject, upper, limit, watched, length ? "m" : "rad"});
  }
}

void PoseSpace::AddBounds() {
  const Mechanism& m = *mechanism_;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    AddRange({Coordinate::Kind::kDrive, static_cast<int>(d), 0}, SetBound::Kind::kDrive,
             m.drives[d].name, m.drives[d].range);
  }
  for (const NamedCoordinate& named : NamedJointCoordinates(m)) {
    const Joint& joint = m.joints[static_cast<size_t>(named.coordinate.index)];
    AddRange(named.coordinate, SetBound::Kind::kJoint, named.name,
             joint.range[static_cast<size_t>(named.coordinate.component)]);
  }
  // A spherical joint's range is one of its rotation as a whole.
  for (const Joint& joint : m.joints) {
    if (joint.max_rotation < std::numbers::pi) {
      settings_.cones.push_back(
          {static_cast<int>(&joint - m.joints.data()), Vec3::Zero(), joint.max_rotation});
    }
  }
  for (size_t c = 0; c < settings_.cones.size(); ++c) {
    const JointCone& cone = settings_.cones[c];
    const std::string& joint = m.joints[static_cast<size_t>(cone.joint)].name;
    bounds_.push_back({SetBound::Kind::kCone,
                       fmt::format("{} of {} at {:.6g}°", cone.axis.isZero() ? "rotation" : "cone",
                                   joint, cone.angle * 180.0 / std::numbers::pi),
                       joint, true, cone.angle, static_cast<int>(c), "rad"});
  }
  for (size_t k = 0; k < settings_.box.size(); ++k) {
    for (const bool upper : {false, true}) {
      const double limit = upper ? settings_.box[k].upper : settings_.box[k].lower;
      if (!std::isfinite(limit)) continue;
      const std::string& name = settings_.coordinates[k].name;
      bounds_.push_back({SetBound::Kind::kBox, fmt::format("box {} = {:.6g}", name, limit), name,
                         upper, limit, static_cast<int>(k),
                         UnitOf(static_cast<int>(k)) == length_ ? "m" : "rad"});
    }
  }
  if (settings_.clearance > 0.0) {
    shapes_ = std::make_shared<ShapePairs>(PairsOfShapes(m, settings_.clearance));
    for (size_t k = 0; k < shapes_->pairs.size(); ++k) {
      bounds_.push_back({SetBound::Kind::kShapes, shapes_->names[k], shapes_->names[k], false,
                         settings_.clearance, static_cast<int>(k), "m"});
    }
  }
  bounds_.push_back({SetBound::Kind::kConstraint, "constraint singularity", "", false, 0.0, -1});
  bounds_.push_back({SetBound::Kind::kType1, "type-1 singularity", "", false, 0.0, -1});
  if (driven_.size() == settings_.coordinates.size() && !settings_.cross_type2) {
    type2_bound_ = static_cast<int>(bounds_.size());
    bounds_.push_back({SetBound::Kind::kType2, "type-2 singularity", "", false, 0.0, -1});
  }
}

void PoseSpace::Evaluate(SpacePose* pose, Rows* rows) const {
  const Mechanism& m = *mechanism_;
  const Eigen::Index n = tree_.dofs();
  BodyStates& states = rows->states;
  states.Resize(m.bodies.size());
  states.X_WB = ChainPoses(m, pose->X_FM);
  states.coupled = pose->coupled;
  FollowCouplings(m, &states, &rows->coupled);
  pose->coupled = states.coupled;
  rows->J = tree_.Jacobian(states) * unit_.asDiagonal();
  Eigen::Index count = static_cast<Eigen::Index>(rows->coupled.size() + spins_.size());
  for (const Joint& joint : m.joints) {
    if (joint.closure) count += 6 - DofsOf(joint.kind);
  }
  rows->A.resize(count, n);
  rows->r.resize(count);
  Eigen::Index at = 0;
  for (const Joint& joint : m.joints) {
    if (!joint.closure) continue;
    const ConstraintRows closure = RowsOf(joint, states, false, false);
    for (int i = 0; i < closure.rows; ++i, ++at) {
      const double scale = i < closure.translation_rows ? 1.0 / length_ : 1.0;
      rows->A.row(at) =
          scale * (closure.J_parent.row(i) * rows->J.middleRows<6>(6 * closure.parent) +
                   closure.J_child.row(i) * rows->J.middleRows<6>(6 * closure.child));
      rows->r[at] = scale * closure.residual[i];
    }
  }
  for (const CouplingRow& coupling : rows->coupled) {
    const double scale = coupling.angular ? 1.0 : 1.0 / length_;
    rows->A.row(at).setZero();
    for (const ScalarRow& piece : coupling.pieces) {
      rows->A.row(at) += scale * Projected(piece, rows->J);
    }
    rows->r[at++] = scale * coupling.value;
  }
  for (const Spin& spin : spins_) {
    rows->A.row(at) = Projected(IdleRow(spin, states), rows->J);
    rows->r[at++] = 0.0;
  }
  const auto d = static_cast<Eigen::Index>(settings_.coordinates.size());
  rows->C.resize(d, n);
  rows->at.resize(d);
  for (Eigen::Index k = 0; k < d; ++k) {
    const Coordinate& coordinate = settings_.coordinates[static_cast<size_t>(k)].coordinate;
    const ScalarRow row = CoordinateRow(m, coordinate, states, pose->at[k]);
    rows->C.row(k) = Projected(row, rows->J) / UnitOf(static_cast<int>(k));
    rows->at[k] = row.value;
  }
}

bool PoseSpace::Factor(Rows* rows) const {
  const Eigen::Index n = tree_.dofs();
  if (!rows->A.allFinite() || !rows->C.allFinite()) return false;
  if (rank_ == 0) {
    rows->N = MatX::Identity(n, n);
    return true;
  }
  rows->qr.compute(rows->A.transpose());
  rows->N.setZero(n, n - rank_);
  rows->N.bottomRows(n - rank_).setIdentity();
  rows->N = rows->qr.householderQ() * rows->N;
  return true;
}

void PoseSpace::Move(const VecX& scaled, SpacePose* pose) const {
  const VecX step = scaled.cwiseProduct(unit_);
  tree_.Step(step, &pose->X_FM);
}

VecX PoseSpace::Target(const VecX& x) const {
  VecX target(x.size() + settings_.held.size());
  target << x, settings_.held;
  return target;
}

// Newton's method: the least step to (1), and motions (2) to the coordinates.
bool PoseSpace::Correct(const PlacedPose& from, const VecX& target, double most, PlacedPose* to,
                        const OnBound* on) const {
  ++closings_;
  const auto d = static_cast<Eigen::Index>(settings_.coordinates.size());
  const Eigen::Index over = settings_.over;
  Rows rows;
  double moved = 0.0, last = kNan;
  for (int i = 0; i < kMostIterations; ++i) {
    Evaluate(&to->pose, &rows);
    if (!Factor(&rows)) return false;
    if (last < kNearlyClosed) {
      // Rows that were redundant may open elsewhere.
      const double open = rows.r.size() > 0 ? rows.r.cwiseAbs().maxCoeff() : 0.0;
      return open <= kOpen && Finish(from.N, &rows, to);
    }
    VecX step = VecX::Zero(tree_.dofs());
    if (rank_ > 0) {
      const VecX wanted = rows.qr.colsPermutation().transpose() * VecX(-rows.r);
      VecX y = VecX::Zero(tree_.dofs());
      y.head(rank_) = rows.qr.matrixQR()
                          .topLeftCorner(rank_, rank_)
                          .triangularView<Eigen::Upper>()
                          .transpose()
                          .solve(wanted.head(rank_));
      step = rows.qr.householderQ() * y;
    }
    // All coordinates, or those that are held.
    const Eigen::Index first = target.size() > 0 ? 0 : over, asked = d - first;
    if (asked > 0 || on != nullptr) {
      VecX miss(asked);
      for (Eigen::Index k = 0; k < asked; ++k) {
        const double goal = target.size() > 0 ? target[k] : settings_.held[k];
        miss[k] = (goal - rows.at[first + k]) / UnitOf(static_cast<int>(first + k));
      }
      MatX C = rows.C.bottomRows(asked);
      if (on != nullptr) {
        Eigen::RowVectorXd rate;
        const double margin = MarginOf(on->bound, to->pose, rows, &rate);
        C.conservativeResize(d, Eigen::NoChange);
        C.row(asked) = rate;
        C.row(asked + 1) = on->along.transpose();
        miss.conservativeResize(d);
        miss[asked] = -margin;
        miss[asked + 1] = 0.0;
      }
      miss -= C * step;
      const MatX G = C * rows.N;
      if (miss.size() == d) {
        step += rows.N * G.partialPivLu().solve(miss);
      } else {
        step += rows.N * G.transpose() * (G * G.transpose()).ldlt().solve(miss);
      }
    }
    if (!step.allFinite()) return false;
    const double size = step.norm();
    moved += size;
    if (moved > most) return false;
    Move(step, &to->pose);
    to->pose.at = rows.at;
    last = size;
  }
  return false;
}

double PoseSpace::MarginOf(int bound, const SpacePose& pose, const Rows& rows,
                           Eigen::RowVectorXd* rate) const {
  const SetBound& of = bounds_[static_cast<size_t>(bound)];
  const double sign = of.upper ? -1.0 : 1.0;
  if (of.kind == SetBound::Kind::kBox) {
    const double unit = UnitOf(of.watched);
    *rate = sign * rows.C.row(of.watched);
    return sign * (rows.at[of.watched] - of.limit) / unit;
  }
  const Coordinate& coordinate = watched_[static_cast<size_t>(of.watched)].coordinate;
  const ScalarRow row =
      CoordinateRow(*mechanism_, coordinate, rows.states, pose.watched[of.watched]);
  const double unit = IsLength(*mechanism_, coordinate) ? length_ : 1.0;
  *rate = sign * Projected(row, rows.J) / unit;
  return sign * (row.value - of.limit) / unit;
}

bool PoseSpace::Finish(const MatX& N_before, Rows* rows, PlacedPose* to) const {
  const Mechanism& m = *mechanism_;
  SpacePose& pose = to->pose;
  if (N_before.size() > 0) {
    const double overlap = (N_before.transpose() * rows->N).determinant();
    if (std::abs(overlap) < kOverlap) return false;
    pose.side *= overlap < 0.0 ? -1.0 : 1.0;
  }
  to->N = rows->N;
  pose.at = rows->at;
  to->G.noalias() = rows->C * rows->N;
  const MatX& G = to->G;
  const Eigen::Index over = settings_.over, held = G.rows() - over;
  to->type1 = pose.side * G.determinant() / home_type1_;
  const double first = rank_ > 0 ? std::abs(rows->qr.matrixQR()(0, 0)) : 1.0;
  to->least = rank_ > 0 ? std::abs(rows->qr.matrixQR()(rank_ - 1, rank_ - 1)) / first : 1.0;
  if (held > 0) {
    const Eigen::HouseholderQR<MatX> qr(G.bottomRows(held).transpose());
    MatX Z = MatX::Zero(G.cols(), over);
    Z.bottomRows(over).setIdentity();
    to->N_free = rows->N * (qr.householderQ() * Z);
  } else {
    to->N_free = rows->N;
  }
  to->C_free = rows->C.topRows(over) * to->N_free;
  for (Eigen::Index k = 0; k < over; ++k) to->C_free.row(k) *= UnitOf(static_cast<int>(k));
  MatX D(static_cast<Eigen::Index>(driven_.size()), G.cols());
  to->type2 = kNan;
  if (D.rows() == D.cols()) {
    for (Eigen::Index k = 0; k < D.rows(); ++k) {
      const Coordinate& coordinate = driven_[static_cast<size_t>(k)];
      D.row(k) = Projected(CoordinateRow(m, coordinate, rows->states), rows->J) * rows->N;
      if (IsLength(m, coordinate)) D.row(k) /= length_;
    }
    to->type2 = pose.side * D.determinant() / home_type2_;
    to->type2_size = D.rowwise().norm().prod();
  }
  if (pose.watched.size() == 0) {
    pose.watched.resize(static_cast<Eigen::Index>(watched_.size()));
    for (size_t w = 0; w < watched_.size(); ++w) {
      pose.watched[static_cast<Eigen::Index>(w)] = watched_[w].home;
    }
  }
  to->watched_free.resize(pose.watched.size(), over);
  for (size_t w = 0; w < watched_.size(); ++w) {
    const auto k = static_cast<Eigen::Index>(w);
    const ScalarRow row = CoordinateRow(m, watched_[w].coordinate, rows->states, pose.watched[k]);
    pose.watched[k] = row.value;
    to->watched_free.row(k) = Projected(row, rows->J) * to->N_free;
  }
  pose.margin.resize(static_cast<Eigen::Index>(bounds_.size()));
  for (size_t b = 0; b < bounds_.size(); ++b) {
    const SetBound& bound = bounds_[b];
    double& margin = pose.margin[static_cast<Eigen::Index>(b)];
    const auto past = [&](double value) {
      return bound.upper ? bound.limit - value : value - bound.limit;
    };
    switch (bound.kind) {
      case SetBound::Kind::kDrive:
      case SetBound::Kind::kJoint:
        margin = past(pose.watched[bound.watched]);
        break;
      case SetBound::Kind::kBox:
        margin = past(pose.at[bound.watched]);
        break;
      case SetBound::Kind::kCone: {
        const JointCone& cone = settings_.cones[static_cast<size_t>(bound.watched)];
        const Joint& joint = m.joints[static_cast<size_t>(cone.joint)];
        const Mat3 R_FM =
            (rows->states.X_WB[static_cast<size_t>(joint.parent)].linear() * joint.X_PF.linear())
                .transpose() *
            rows->states.X_WB[static_cast<size_t>(joint.child)].linear() * joint.X_CM.linear();
        const Vec3 turned = R_FM * cone.axis;
        margin = cone.angle - (cone.axis.isZero() ? Eigen::AngleAxisd(R_FM).angle()
                                                  : std::atan2(cone.axis.cross(turned).norm(),
                                                               cone.axis.dot(turned)));
        break;
      }
      case SetBound::Kind::kShapes: {
        const auto& [i, j] = shapes_->pairs[static_cast<size_t>(bound.watched)];
        const ConvexShape &one = shapes_->shapes[i], &other = shapes_->shapes[j];
        margin = GapOf(one, rows->states.X_WB[static_cast<size_t>(one.body)], other,
                       rows->states.X_WB[static_cast<size_t>(other.body)]) -
                 bound.limit;
        break;
      }
      case SetBound::Kind::kConstraint:
        margin = to->least / home_least_ - kWeakest;
        break;
      case SetBound::Kind::kType1:
        margin = to->type1;
        break;
      case SetBound::Kind::kType2:
        margin = to->type2;
        break;
    }
  }
  return pose.margin.allFinite();
}

bool PoseSpace::Home(PlacedPose* home) {
  const Mechanism& m = *mechanism_;
  SpacePose& pose = home->pose;
  pose = {};
  pose.X_FM.assign(m.joints.size(), Pose::Identity());
  for (size_t j = 0; j < m.joints.size(); ++j)
    pose.X_FM[j] = JointPose(m.joints[j], m.joints[j].home);
  const auto d = static_cast<Eigen::Index>(settings_.coordinates.size());
  pose.at.resize(d);
  for (Eigen::Index k = 0; k < d; ++k) {
    pose.at[k] = HomeValue(m, settings_.coordinates[static_cast<size_t>(k)].coordinate);
  }
  Rows rows;
  Evaluate(&pose, &rows);
  rank_ = 0;
  if (rows.A.rows() > 0) {
    Eigen::ColPivHouseholderQR<MatX> qr(rows.A.transpose());
    qr.setThreshold(kRank);
    rank_ = static_cast<int>(qr.rank());
  }
  home_type1_ = home_type2_ = home_least_ = 1.0;
  if (tree_.dofs() - rank_ != d || !Factor(&rows)) return false;
  return Finish({}, &rows, home);
}

void PoseSpace::CountFrom(PlacedPose* home) {
  home_type1_ *= home->type1;
  // Positive; by its rows' size, as home itself may be near type 2.
  if (std::isfinite(home->type2)) {
    home_type2_ = std::copysign(home->type2_size, home_type2_ * home->type2);
  }
  home_least_ = home->least;
  Rows rows;
  Evaluate(&home->pose, &rows);
  if (Factor(&rows)) (void)Finish({}, &rows, home);
}

bool PoseSpace::Place(const SpacePose& pose, PlacedPose* placed) const {
  placed->pose = pose;
  Rows rows;
  Evaluate(&placed->pose, &rows);
  return Factor(&rows) && Finish({}, &rows, placed);
}

bool PoseSpace::Step(const PlacedPose& from, const VecX& along, PlacedPose* to) const {
  PlacedPose next;
  next.pose = from.pose;
  Move(from.N_free * along, &next.pose);
  if (!Correct(from, {}, kTrusted * along.norm() + 1e-3, &next)) return false;
  *to = std::move(next);
  return true;
}

bool PoseSpace::StepOn(int bound, const PlacedPose& from, double tau, const VecX& t,
                       PlacedPose* to) const {
  PlacedPose next;
  next.pose = from.pose;
  const OnBound on{bound, from.N_free * t};
  Move(tau * on.along, &next.pose);
  if (!Correct(from, {}, kTrusted * std::abs(tau) + 1e-3, &next, &on)) return false;
  *to = std::move(next);
  return true;
}

bool PoseSpace::CloseOnce(const PlacedPose& from, const VecX& target, PlacedPose* to) const {
  // The first step of Newton's method is the tangent.
  VecX miss = target - from.pose.at;
  for (Eigen::Index k = 0; k < miss.size(); ++k) miss[k] /= UnitOf(static_cast<int>(k));
  PlacedPose next;
  next.pose = from.pose;
  const VecX along = from.G.partialPivLu().solve(miss);
  if (!along.allFinite() || along.norm() > kLongStep) return false;
  Move(from.N * along, &next.pose);
  if (!Correct(from, target, kTrusted * along.norm() + 1e-6, &next)) return false;
  *to = std::move(next);
  return true;
}

bool PoseSpace::Close(const PlacedPose& from, const VecX& target, PlacedPose* to) const {
  if (CloseOnce(from, target, to)) return to->type1 > 0.0;
  // Halves of the way, down to a fold.
  const VecX start = from.pose.at;
  PlacedPose at = from;
  double reached = 0.0, step = 0.5;
  while (reached < 1.0) {
    const double next = std::min(1.0, reached + step);
    PlacedPose there;
    if (CloseOnce(at, start + next * (target - start), &there) && there.type1 > 0.0) {
      at = std::move(there);
      reached = next;
      continue;
    }
    step *= 0.5;
    if (step < std::ldexp(1.0, -kMostHalvings)) return false;
  }
  *to = std::move(at);
  return true;
}

VecX PoseSpace::Slope(const PlacedPose& at, int bound) const {
  const SetBound& of = bounds_[static_cast<size_t>(bound)];
  const double sign = of.upper ? -1.0 : 1.0;
  if (of.kind == SetBound::Kind::kDrive || of.kind == SetBound::Kind::kJoint) {
    return sign * at.watched_free.row(of.watched).transpose();
  }
  if (of.kind == SetBound::Kind::kBox) return sign * at.C_free.row(of.watched).transpose();
  VecX slope(settings_.over);
  for (int k = 0; k < settings_.over; ++k) {
    PlacedPose beyond, before;
    const VecX step = kSlopeStep * VecX::Unit(settings_.over, k);
    if (!Step(at, step, &beyond) || !Step(at, -step, &before)) return VecX::Zero(settings_.over);
    slope[k] = (beyond.pose.margin[bound] - before.pose.margin[bound]) / (2 * kSlopeStep);
  }
  return slope;
}

MatX PoseSpace::Twists(const PlacedPose& at, const BodyStates& states) const {
  const MatX J = tree_.Jacobian(states);
  return J.bottomRows(J.rows() - 6) * (unit_.asDiagonal() * at.N);
}

BodyStates PoseSpace::States(const SpacePose& pose) const {
  BodyStates states;
  states.Resize(mechanism_->bodies.size());
  states.X_WB = ChainPoses(*mechanism_, pose.X_FM);
  states.coupled = pose.coupled;
  return states;
}

}  // namespace mbv
