#include "features/workspace/quality.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <thread>

#include "kinematics/constraints.h"
#include "kinematics/singularity.h"
#include "reference/force_solver.h"
#include "reference/frame_stiffness.h"

namespace mbv {
namespace {

constexpr double kRankShare = 1e-9;                        // smaller singular values are none
constexpr double kSingularShare = 1e-12;                   // of D: no (1)
constexpr double kStiffnessStep = 1e-5;                    // [rad, characteristic lengths]
constexpr size_t kRankPoses = 256;                         // of the set, about
constexpr Eigen::Index kMostDrives = 12;                   // of corners
constexpr double kMostVertices = 4096, kMostFacets = 256;  // of redundant drives
constexpr Eigen::Index kMostHullVertices = 100;            // corners in three dimensions

// Reach of {K ṁ : |ṁ_i| ≤ 1} within the space that K spans: least and largest.
std::pair<double, double> ZonotopeReach(const MatX& K) {
  const Eigen::JacobiSVD<MatX> svd(K, Eigen::ComputeThinU);
  const VecX sigma = svd.singularValues();
  if (!(sigma[0] > 0.0)) return {0.0, 0.0};
  const auto rank = (sigma.array() > kRankShare * sigma[0]).count();
  const MatX G = svd.matrixU().leftCols(rank).transpose() * K;
  const Eigen::Index n = G.cols();
  if (n > kMostDrives) return {kNan, kNan};
  double most = 0.0, least = std::numeric_limits<double>::infinity();
  for (long corner = 0; corner < (1L << n); ++corner) {
    VecX sum = VecX::Zero(rank);
    for (Eigen::Index i = 0; i < n; ++i) sum += ((corner >> i) & 1 ? 1.0 : -1.0) * G.col(i);
    most = std::max(most, sum.norm());
  }
  // Facets' normals.
  const auto offer = [&](VecX normal) {
    if (!(normal.norm() > kRankShare * sigma[0])) return;
    normal.normalize();
    least = std::min(least, (normal.transpose() * G).cwiseAbs().sum());
  };
  for (Eigen::Index i = 0; i < n; ++i) {
    if (rank == 1) offer(VecX::Ones(1));
    if (rank == 2) offer(Eigen::Vector2d(-G(1, i), G(0, i)));
    for (Eigen::Index j = 0; rank == 3 && j < i; ++j) {
      offer(Vec3(G.col(i)).cross(Vec3(G.col(j))));
    }
  }
  return {least, most};
}

// All ways to choose `count` of n.
template <typename F>
void ForEachChoice(Eigen::Index n, Eigen::Index count, const F& f) {
  std::vector<Eigen::Index> chosen(static_cast<size_t>(count));
  const auto next = [&](auto&& self, size_t depth, Eigen::Index from) -> void {
    if (depth == chosen.size()) {
      f(chosen);
      return;
    }
    for (Eigen::Index i = from; i < n; ++i) {
      chosen[depth] = i;
      self(self, depth + 1, i + 1);
    }
  };
  next(next, 0, 0);
}
double Choices(Eigen::Index n, Eigen::Index count) {
  double ways = 1.0;
  for (Eigen::Index k = 0; k < count; ++k) {
    ways *= static_cast<double>(n - k) / static_cast<double>(k + 1);
  }
  return ways;
}

// Reach of {f : |k_i·f| ≤ 1} within the space that the k_i (columns) span.
std::pair<double, double> PolytopeReach(const MatX& K) {
  const Eigen::JacobiSVD<MatX> svd(K, Eigen::ComputeThinU);
  const VecX sigma = svd.singularValues();
  if (!(sigma[0] > 0.0)) return {kNan, kNan};
  const auto rank = (sigma.array() > kRankShare * sigma[0]).count();
  const MatX G = svd.matrixU().leftCols(rank).transpose() * K;
  const Eigen::Index n = G.cols();
  const double least = 1.0 / G.colwise().norm().maxCoeff();
  double most = 0.0;
  ForEachChoice(n, rank, [&](const std::vector<Eigen::Index>& chosen) {
    MatX A(rank, rank);
    for (Eigen::Index r = 0; r < rank; ++r) A.row(r) = G.col(chosen[static_cast<size_t>(r)]);
    const Eigen::FullPivLU<MatX> lu(A);
    if (!lu.isInvertible()) return;
    for (int signs = 0; signs < (1 << rank); ++signs) {
      VecX b(rank);
      for (Eigen::Index r = 0; r < rank; ++r) b[r] = (signs >> r) & 1 ? 1.0 : -1.0;
      const VecX f = lu.solve(b);
      if ((G.transpose() * f).cwiseAbs().maxCoeff() < 1.0 + 1e-9) most = std::max(most, f.norm());
    }
  });
  return {least, most};
}

// Reach of {W y : |A y| ≤ 1} within the space that W spans: least and largest. More rows than
// columns; NaN of too many.
std::pair<double, double> ImageReach(const MatX& A, const MatX& W) {
  const Eigen::Index n = A.cols();
  if (Choices(A.rows(), n) * std::exp2(n) > kMostVertices) return {kNan, kNan};
  const Eigen::JacobiSVD<MatX> svd(W, Eigen::ComputeThinU);
  const VecX sigma = svd.singularValues();
  if (!(sigma[0] > 0.0)) return {0.0, 0.0};
  const auto rank = (sigma.array() > kRankShare * sigma[0]).count();
  const MatX G = svd.matrixU().leftCols(rank).transpose() * W;
  std::vector<VecX> corners;
  ForEachChoice(A.rows(), n, [&](const std::vector<Eigen::Index>& rows) {
    MatX B(n, n);
    for (Eigen::Index r = 0; r < n; ++r) B.row(r) = A.row(rows[static_cast<size_t>(r)]);
    const Eigen::FullPivLU<MatX> lu(B);
    if (!lu.isInvertible()) return;
    for (long signs = 0; signs < (1L << n); ++signs) {
      VecX b(n);
      for (Eigen::Index r = 0; r < n; ++r) b[r] = (signs >> r) & 1 ? 1.0 : -1.0;
      const VecX y = lu.solve(b);
      if ((A * y).cwiseAbs().maxCoeff() < 1.0 + 1e-9) corners.emplace_back(G * y);
    }
  });
  double most = 0.0, least = std::numeric_limits<double>::infinity();
  for (const VecX& corner : corners) most = std::max(most, corner.norm());
  if (rank == 1) return {most, most};
  const auto count = static_cast<Eigen::Index>(corners.size());
  if (rank == 3 && count > kMostHullVertices) return {kNan, most};
  // Planes through corners with all others on one side.
  ForEachChoice(count, rank, [&](const std::vector<Eigen::Index>& of) {
    const auto corner = [&](size_t k) -> const VecX& {
      return corners[static_cast<size_t>(of[k])];
    };
    const VecX edge = corner(1) - corner(0);
    VecX normal = rank == 2 ? VecX(Eigen::Vector2d(-edge[1], edge[0]))
                            : VecX(Vec3(edge).cross(Vec3(corner(2) - corner(0))));
    if (!(normal.norm() > kRankShare * std::pow(most, static_cast<double>(rank - 1)))) return;
    normal.normalize();
    const double offset = std::abs(normal.dot(corner(0)));
    if (offset >= least) return;
    for (const VecX& other : corners) {
      if (std::abs(normal.dot(other)) > offset + 1e-9 * most) return;
    }
    least = offset;
  });
  return {least, most};
}

// Normals of the facets of {Dᵀτ : |τ_i| ≤ t_i}: each is orthogonal to n − 1 rows of D. Of as many
// drives as motions each drive's motion alone. Empty of too many.
MatX ForceNormals(const MatX& D) {
  const Eigen::Index n = D.cols();
  if (D.rows() == n) return D.inverse();
  if (n == 1) return MatX::Ones(1, 1);
  if (Choices(D.rows(), n - 1) > kMostFacets) return MatX(n, 0);
  std::vector<VecX> normals;
  ForEachChoice(D.rows(), n - 1, [&](const std::vector<Eigen::Index>& rows) {
    MatX B(n - 1, n);
    for (Eigen::Index r = 0; r + 1 < n; ++r) {
      B.row(r) = D.row(rows[static_cast<size_t>(r)]).normalized();
    }
    const MatX kernel = Eigen::FullPivLU<MatX>(B).kernel();
    if (kernel.cols() == 1) normals.emplace_back(kernel.col(0).normalized());
  });
  MatX Y(n, static_cast<Eigen::Index>(normals.size()));
  for (size_t k = 0; k < normals.size(); ++k) Y.col(static_cast<Eigen::Index>(k)) = normals[k];
  return Y;
}

struct Limits {
  VecX speed, force;  ///< per drive; 1 without motors
  bool speeds = false, forces = false;
};
Limits LimitsOf(const Mechanism& m) {
  const auto n = static_cast<Eigen::Index>(m.drives.size());
  Limits limits{VecX::Constant(n, kNan), VecX::Constant(n, kNan)};
  for (const Motor& motor : m.motors) {
    const double torque = ContinuousTorque(motor, 0.0);
    const double most = std::isfinite(torque) ? torque : PeakTorque(motor, 0.0);
    if (std::isfinite(most)) limits.force[motor.drive] = most * motor.gear_ratio * motor.efficiency;
    double fastest = motor.max_speed;
    if (!motor.peak_curve.empty()) fastest = std::min(fastest, motor.peak_curve.back().speed);
    if (std::isfinite(fastest)) limits.speed[motor.drive] = fastest / motor.gear_ratio;
  }
  limits.speeds = n > 0 && limits.speed.allFinite();
  limits.forces = n > 0 && limits.force.allFinite();
  if (!limits.speeds) limits.speed.setOnes();
  if (!limits.forces) limits.force.setOnes();
  return limits;
}

// A single chain from the base to the output's body.
struct Limb {
  int drive = -1;
  std::vector<int> joints;  // from the output on; none: a drive along a line
  Vec3 p = Vec3::Zero();    // on the output's body, in it
};

std::vector<Command> CommandsOf(const SpaceSettings& settings) {
  std::vector<Command> commands;
  for (const NamedCoordinate& named : settings.coordinates) {
    commands.push_back({named.name, {{named.coordinate, 1.0}}, {}});
  }
  return commands;
}

class QualityMapper {
 public:
  /// All coordinates of `space` are free. `poses`: some of the set.
  QualityMapper(const PoseSpace& space, const std::string& output,
                const std::vector<std::vector<Pose>>& poses)
      : space_(space),
        mechanism_(space.mechanism()),
        length_(space.length()),
        limits_(LimitsOf(mechanism_)),
        output_(mechanism_.outputs[static_cast<size_t>(mechanism_.FindOutput(output))]),
        meter_(mechanism_, CommandsOf(space.settings()), poses) {
    for (const Drive& drive : mechanism_.drives) {
      servos_ = servos_ && std::isfinite(drive.stiffness);
      drive_unit_.push_back(PositionUnit(mechanism_, drive) == "m" ? 1.0 : length_);
    }
    servos_ = servos_ && !mechanism_.drives.empty();
    dofs_ = static_cast<Eigen::Index>(space.settings().coordinates.size() -
                                      mechanism_.prescribed.size());
    FindLimbs();
    AddIndices();
  }

  [[nodiscard]] std::string NoneReason() const {
    if (dofs_ <= static_cast<Eigen::Index>(mechanism_.drives.size())) return "";
    return fmt::format("{} drives for {} degrees of freedom: they do not hold the mechanism",
                       mechanism_.drives.size(), dofs_);
  }
  [[nodiscard]] const std::vector<QualityIndex>& indices() const { return indices_; }

  // All values of a pose; NaN of what is not defined.
  [[nodiscard]] bool Evaluate(const PlacedPose& at, VecX* values) const {
    *values = VecX::Constant(static_cast<Eigen::Index>(indices_.size()), kNan);
    const BodyStates states = space_.States(at.pose);
    const MatX T = Motions(at, states);
    const Eigen::Index n = T.cols();
    if (n != dofs_) return false;
    const MatX D = DriveRates(states, T);
    const MatX W = TwistOf(output_.body, output_.X_BO.translation(), states, T) -
                   TwistOf(output_.reference_body, ReferencePoint(states), states, T);
    const Eigen::Map<const VecX> unit(drive_unit_.data(), D.rows());
    const MatX counted = unit.asDiagonal() * D;
    const VecX sizes = Eigen::JacobiSVD<MatX>(counted).singularValues();
    size_t i = 0;
    const auto put = [&](double value) { (*values)[static_cast<Eigen::Index>(i++)] = value; };
    // (4)
    const auto distances = meter_.At(states);
    for (const SingularityKind kind :
         {SingularityKind::kForward, SingularityKind::kInverse, SingularityKind::kConstraint}) {
      put(distances[static_cast<size_t>(kind)].value);
    }
    if (!(sizes[n - 1] > kSingularShare * sizes[0])) return true;
    // Motions at unit speed of the drives together, |U D y| = 1: y = back z, |z| = 1.
    const MatX R = Eigen::HouseholderQR<MatX>(counted).matrixQR().topRows(n);
    const MatX back = R.triangularView<Eigen::Upper>().solve(MatX::Identity(n, n));
    // Twists with lengths by the characteristic one, drives in units of theirs.
    MatX scaled = W * back;
    scaled.topRows<3>() *= length_;
    const VecX sigma = Eigen::JacobiSVD<MatX>(scaled).singularValues();
    const auto rank = (sigma.array() > kRankShare * sigma[0]).count();
    put(rank == n ? sigma[0] / sigma[n - 1] : kNan);
    put(rank == n ? sigma.prod() : 0.0);
    // (3), (8)
    const MatX Y = ForceNormals(D);
    const VecX reach = (D * Y).cwiseAbs().transpose() * limits_.force;
    const MatX by_force = W * Y * reach.cwiseInverse().asDiagonal();
    const MatX by_speed = limits_.speed.cwiseInverse().asDiagonal() * D;
    for (const bool translation : {true, false}) {
      const Eigen::Index first = translation ? 3 : 0;
      const MatX part = W.middleRows<3>(first);
      const auto [slow, fast] =
          redundant() ? ImageReach(by_speed, part) : ZonotopeReach(part * by_speed.inverse());
      const auto [weak, strong] =
          Y.cols() > 0 ? PolytopeReach(by_force.middleRows<3>(first)) : std::pair(kNan, kNan);
      for (const double value : {slow, fast, weak, strong}) put(value);
    }
    // (5)
    MatX M = T.transpose() * internal::Momenta(mechanism_, states, T);
    M = 0.5 * (M + M.transpose()).eval();
    if (redundant()) {
      const MatX mobility = D * M.ldlt().solve(D.transpose());
      for (Eigen::Index k = 0; k < D.rows(); ++k) put(1.0 / mobility(k, k));
    } else {
      const MatX alone = D.inverse();
      for (Eigen::Index k = 0; k < n; ++k) put(alone.col(k).dot(M * alone.col(k)));
      for (const Limb& limb : limbs_) put(Transmission(limb, states, T * alone.col(limb.drive)));
    }
    if (limits_.forces) {
      const VecX per_mass = -W.bottomRows<3>().transpose() * mechanism_.gravity_W;
      put(Y.cols() > 0
              ? Payload(Y.transpose() * ForcesAtRest(states, T), Y.transpose() * per_mass, reach)
              : kNan);
    }
    std::optional<MatX> stiffness;
    if (servos_) {
      stiffness = Stiffness(at, states, T, D);
      put(stiffness ? Frequency(*stiffness, M) : kNan);
    }
    if (servos_ || elastic()) {
      const auto [soft, stiff] = elastic()   ? FrameReach(states)
                                 : stiffness ? OutputStiffness(*stiffness, W.bottomRows<3>())
                                             : std::pair(kNan, kNan);
      put(soft);
      put(stiff);
    }
    return true;
  }
  [[nodiscard]] std::vector<std::string> NoLimb() const {
    std::vector<std::string> names;
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      if (std::ranges::find(limbs_, static_cast<int>(d), &Limb::drive) == limbs_.end()) {
        names.push_back(mechanism_.drives[d].name);
      }
    }
    return names;
  }

 private:
  // T: twists of the moving bodies, prescribed joints at rest.
  [[nodiscard]] MatX Motions(const PlacedPose& at, const BodyStates& states) const {
    const MatX T = space_.Twists(at, states);
    const auto held = static_cast<Eigen::Index>(mechanism_.prescribed.size());
    if (held == 0) return T;
    MatX rates(held, T.cols());
    for (Eigen::Index p = 0; p < held; ++p) {
      rates.row(p) =
          RateOf(CoordinateRow(mechanism_, {Coordinate::Kind::kPrescribed, static_cast<int>(p), 0},
                               states),
                 T);
    }
    const Eigen::FullPivLU<MatX> lu(rates);
    return T * lu.kernel();
  }
  [[nodiscard]] static Eigen::RowVectorXd RateOf(const ScalarRow& row, const MatX& T) {
    Eigen::RowVectorXd rate = Eigen::RowVectorXd::Zero(T.cols());
    if (row.parent > 0) rate += row.J_parent.transpose() * T.middleRows<6>(6 * (row.parent - 1));
    if (row.child > 0) rate += row.J_child.transpose() * T.middleRows<6>(6 * (row.child - 1));
    return rate;
  }
  [[nodiscard]] MatX DriveRates(const BodyStates& states, const MatX& T) const {
    MatX D(static_cast<Eigen::Index>(mechanism_.drives.size()), T.cols());
    for (Eigen::Index d = 0; d < D.rows(); ++d) {
      const Coordinate drive{Coordinate::Kind::kDrive, static_cast<int>(d), 0};
      D.row(d) = RateOf(CoordinateRow(mechanism_, drive, states), T);
    }
    return D;
  }
  [[nodiscard]] bool elastic() const { return !mechanism_.beams.empty(); }
  [[nodiscard]] bool redundant() const {
    return dofs_ < static_cast<Eigen::Index>(mechanism_.drives.size());
  }
  // By the motions, beyond no load; friction at rest counts as 0.
  [[nodiscard]] VecX ForcesAtRest(const BodyStates& states, const MatX& T) const {
    std::vector<Vec6> required;
    internal::RequiredWrenches(mechanism_, states, {},
                               std::vector<int>(mechanism_.elements.size(), 0), &required);
    return T.transpose() * internal::Stack(required);
  }

  // From each joint of the output's body through bodies with two joints to the base.
  void FindLimbs() {
    const auto& joints = mechanism_.joints;
    std::vector<std::vector<int>> joints_of(mechanism_.bodies.size());
    for (size_t j = 0; j < joints.size(); ++j) {
      if (joints[j].kind == JointKind::kFree) continue;
      joints_of[static_cast<size_t>(joints[j].parent)].push_back(static_cast<int>(j));
      joints_of[static_cast<size_t>(joints[j].child)].push_back(static_cast<int>(j));
    }
    std::vector<bool> coupled(joints.size(), false), on_line(mechanism_.bodies.size(), false);
    for (const Coupling& coupling : mechanism_.couplings) {
      for (const Coupling::Term& term : coupling.terms) {
        coupled[static_cast<size_t>(term.joint)] = true;
      }
    }
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      const auto* line = std::get_if<DistanceDrive>(&mechanism_.drives[d].kind);
      if (line == nullptr) continue;
      const auto is_base = [&](int body) { return body == 0 || body == output_.reference_body; };
      if (line->body_to == output_.body && is_base(line->body_from)) {
        limbs_.push_back({static_cast<int>(d), {}, line->p_to});
      } else if (line->body_from == output_.body && is_base(line->body_to)) {
        limbs_.push_back({static_cast<int>(d), {}, line->p_from});
      } else {
        on_line[static_cast<size_t>(line->body_from)] = true;
        on_line[static_cast<size_t>(line->body_to)] = true;
      }
    }
    for (const int first : joints_of[static_cast<size_t>(output_.body)]) {
      const Joint& held = joints[static_cast<size_t>(first)];
      Limb limb{.joints = {},
                .p = (held.parent == output_.body ? held.X_PF : held.X_CM).translation()};
      int body = output_.body, joint = first, drives = 0;
      bool single = true;
      while (single) {
        limb.joints.push_back(joint);
        single = !coupled[static_cast<size_t>(joint)];
        for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
          const auto* on = std::get_if<JointDrive>(&mechanism_.drives[d].kind);
          if (on == nullptr || on->joint != joint) continue;
          limb.drive = static_cast<int>(d);
          ++drives;
        }
        const Joint& passed = joints[static_cast<size_t>(joint)];
        body = passed.parent == body ? passed.child : passed.parent;
        if (body == 0 || body == output_.reference_body) break;
        const auto& around = joints_of[static_cast<size_t>(body)];
        // A loop that floats leads back.
        single = single && around.size() == 2 && !on_line[static_cast<size_t>(body)] &&
                 body != output_.body;
        if (single) joint = around[0] == joint ? around[1] : around[0];
      }
      if (single && drives == 1) limbs_.push_back(std::move(limb));
    }
    std::ranges::sort(limbs_, {}, &Limb::drive);
    // One for each drive: else several share its force.
    std::vector<int> limbs_of(mechanism_.drives.size(), 0);
    for (const Limb& limb : limbs_) ++limbs_of[static_cast<size_t>(limb.drive)];
    std::erase_if(limbs_,
                  [&](const Limb& limb) { return limbs_of[static_cast<size_t>(limb.drive)] > 1; });
  }

  // (10) [°]; `twists` of the moving bodies while the drive moves alone.
  [[nodiscard]] double Transmission(const Limb& limb, const BodyStates& states,
                                    const MatX& twists) const {
    const Vec3 p_W = states.X_WB[static_cast<size_t>(output_.body)] * limb.p;
    const Vec3 p_R = states.X_WB[static_cast<size_t>(output_.reference_body)].inverse() * p_W;
    const Vec3 v = TwistOf(output_.body, limb.p, states, twists).bottomRows<3>() -
                   TwistOf(output_.reference_body, p_R, states, twists).bottomRows<3>();
    const Vec3 f = ForceOf(limb, states, p_W);
    const double sizes = f.norm() * v.norm();
    if (!(sizes > 0.0)) return kNan;
    return std::asin(std::min(1.0, std::abs(f.dot(v)) / sizes)) * 180.0 / std::numbers::pi;
  }
  // By unit force of the drive on the output's body at the point; NaN where there is a moment, too.
  [[nodiscard]] Vec3 ForceOf(const Limb& limb, const BodyStates& states, const Vec3& p_W) const {
    if (limb.joints.empty()) {
      const auto& line =
          std::get<DistanceDrive>(mechanism_.drives[static_cast<size_t>(limb.drive)].kind);
      return states.X_WB[static_cast<size_t>(line.body_to)] * line.p_to -
             states.X_WB[static_cast<size_t>(line.body_from)] * line.p_from;
    }
    const ScalarRow drive =
        CoordinateRow(mechanism_, {Coordinate::Kind::kDrive, limb.drive, 0}, states);
    // What each joint allows its child, [L ω; v of the point], and the drive's rate with it.
    std::vector<Vec6> allowed;
    std::vector<double> rates;
    for (const int j : limb.joints) {
      const Joint& joint = mechanism_.joints[static_cast<size_t>(j)];
      const ConstraintRows rows = RowsOf(joint, states, false, false);
      const MatX kernel = Eigen::FullPivLU<MatX>(rows.J_child.topRows(rows.rows)).kernel();
      if (rows.rows == 6) continue;
      const Vec3 arm = p_W - states.X_WB[static_cast<size_t>(joint.child)].translation();
      const auto* on =
          std::get_if<JointDrive>(&mechanism_.drives[static_cast<size_t>(limb.drive)].kind);
      for (Eigen::Index k = 0; k < kernel.cols(); ++k) {
        const Vec6 V = kernel.col(k);
        Vec6 at_point;
        at_point << length_ * V.head<3>(), V.tail<3>() + Vec3(V.head<3>()).cross(arm);
        allowed.push_back(at_point);
        rates.push_back(on->joint == j ? drive.J_child.dot(V) : 0.0);
      }
    }
    MatX A(static_cast<Eigen::Index>(allowed.size()), 6);
    for (Eigen::Index r = 0; r < A.rows(); ++r) A.row(r) = allowed[static_cast<size_t>(r)];
    const Eigen::Map<const VecX> b(rates.data(), A.rows());
    const Vec6 wrench = A.completeOrthogonalDecomposition().solve(b);  // [m / L; f]
    const bool transmits = (A * wrench - b).norm() <= 1e-9 * b.norm();
    if (!transmits || wrench.head<3>().norm() > 1e-9 * wrench.tail<3>().norm()) {
      return Vec3::Constant(kNan);
    }
    return wrench.tail<3>();
  }
  // (9) of beams and servos, at the poses' shape without weight.
  [[nodiscard]] std::pair<double, double> FrameReach(const BodyStates& states) const {
    const StiffnessResult frame = FrameStiffness(
        mechanism_, states.X_WB, static_cast<int>(&output_ - mechanism_.outputs.data()));
    const Mat3 C = frame.C.bottomRightCorner<3, 3>();
    if (!C.allFinite()) return {kNan, kNan};
    const Vec3 sizes = Eigen::SelfAdjointEigenSolver<Mat3>(C, Eigen::EigenvaluesOnly).eigenvalues();
    return {1.0 / sizes[2], sizes[0] > kRankShare * sizes[2] ? 1.0 / sizes[0] : kNan};
  }

  void Add(std::string name, std::string unit, std::string about, bool low_is_bad = true) {
    indices_.push_back({std::move(name), std::move(unit), std::move(about), low_is_bad});
  }
  void AddIndices() {
    const std::string speed =
        limits_.speeds ? "at the motors' highest speeds" : "per unit speed of each drive";
    const std::string force =
        limits_.forces ? "at the motors' torques" : "per unit force of each drive";
    Add("type2_distance", "1", "least speed of the drives by that of the bodies (type 2)");
    Add("type1_distance", "1",
        "least speed of the set's coordinates by that of the bodies (type 1)");
    Add("constraint_distance", "1", "least speed that loops open with, by that of the bodies");
    Add("condition", "1",
        fmt::format("of the twist by the drives' speeds, lengths by {:.4g} m", length_), false);
    Add("manipulability", "1", "product of its singular values");
    Add("speed_least", "m/s", "in every direction, " + speed);
    Add("speed_most", "m/s", "in the best direction, " + speed);
    Add("force_least", "N", "in every direction, " + force);
    Add("force_most", "N", "in the best direction, " + force);
    Add("turn_least", "rad/s", "about every axis, " + speed);
    Add("turn_most", "rad/s", "about the best axis, " + speed);
    Add("moment_least", "N m", "about every axis, " + force);
    Add("moment_most", "N m", "about the best axis, " + force);
    for (const Drive& drive : mechanism_.drives) {
      Add("mass_" + drive.name, PositionUnit(mechanism_, drive) == "m" ? "kg" : "kg m²",
          redundant() ? "as the drive feels it, the others without force"
                      : "as the drive feels it, the others at rest",
          false);
    }
    for (const Limb& limb : limbs_) {
      if (redundant()) break;  // none moves alone
      Add("transmission_" + mechanism_.drives[static_cast<size_t>(limb.drive)].name, "°",
          "90° less the pressure angle between the limb's force on the output's body and the "
          "velocity there, the other drives at rest");
    }
    if (limits_.forces) Add("payload", "kg", "at the output's origin, held by the motors");
    if (servos_) Add("frequency", "Hz", "lowest natural frequency on the servos");
    if (servos_ || elastic()) {
      Add("stiffness_least", "N/m",
          elastic() ? "at the output's origin by elastic bodies and servos, without weight, in the "
                      "softest direction"
                    : "at the output's origin on the servos, in the softest direction");
      Add("stiffness_most", "N/m", "in the stiffest direction that it moves in");
    }
  }

  // World twist of a body's point: 6 × n.
  [[nodiscard]] static MatX TwistOf(int body, const Vec3& p_BP, const BodyStates& states,
                                    const MatX& T) {
    if (body == 0) return MatX::Zero(6, T.cols());
    MatX W = T.middleRows<6>(6 * (body - 1));
    const Vec3 p = states.X_WB[static_cast<size_t>(body)].linear() * p_BP;
    for (Eigen::Index k = 0; k < W.cols(); ++k) {
      W.col(k).tail<3>() += Vec3(W.col(k).head<3>()).cross(p);
    }
    return W;
  }
  // The output's origin in its reference body.
  [[nodiscard]] Vec3 ReferencePoint(const BodyStates& states) const {
    const Vec3 p_W = states.X_WB[static_cast<size_t>(output_.body)] * output_.X_BO.translation();
    return states.X_WB[static_cast<size_t>(output_.reference_body)].inverse() * p_W;
  }

  // (7)
  [[nodiscard]] static double Payload(const VecX& held, const VecX& per_mass, const VecX& limit) {
    double most = std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < held.size(); ++k) {
      if (limit[k] < std::abs(held[k])) return 0.0;
      // Of rounding: a facet that the load does not press on.
      if (std::abs(per_mass[k]) <= kRankShare * per_mass.cwiseAbs().maxCoeff()) continue;
      const double room = per_mass[k] > 0.0 ? limit[k] - held[k] : limit[k] + held[k];
      most = std::min(most, room / std::abs(per_mass[k]));
    }
    return std::isfinite(most) ? most : kNan;
  }

  // (6) by the motions N: what the servos, weight and springs do against a small one. Drives keep
  // the forces of least norm that hold the pose, servos add theirs.
  [[nodiscard]] std::optional<MatX> Stiffness(const PlacedPose& at, const BodyStates& states,
                                              const MatX& T, const MatX& D) const {
    const Eigen::Index n = T.cols();
    if (at.N_free.cols() != n) return std::nullopt;  // prescribed joints
    const VecX held = D * (D.transpose() * D).ldlt().solve(ForcesAtRest(states, T));
    MatX K(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      std::array<VecX, 2> force;
      for (size_t s = 0; s < 2; ++s) {
        PlacedPose there;
        if (!space_.Step(at, (s == 0 ? -kStiffnessStep : kStiffnessStep) * VecX::Unit(n, k),
                         &there)) {
          return std::nullopt;
        }
        const BodyStates moved = space_.States(there.pose);
        const MatX T_there = Motions(there, moved);
        // By N there, then by N here.
        const VecX open =
            ForcesAtRest(moved, T_there) - DriveRates(moved, T_there).transpose() * held;
        force.at(s) = (there.N.transpose() * at.N).transpose() * open;
      }
      K.col(k) = (force[1] - force[0]) / (2 * kStiffnessStep);
    }
    K = 0.5 * (K + K.transpose()).eval();
    for (Eigen::Index d = 0; d < D.rows(); ++d) {
      K += mechanism_.drives[static_cast<size_t>(d)].stiffness * D.row(d).transpose() * D.row(d);
    }
    return K;
  }
  [[nodiscard]] static double Frequency(const MatX& K, const MatX& M) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> modes(K, M, Eigen::EigenvaluesOnly);
    if (modes.info() != Eigen::Success) return kNan;
    const double lowest = modes.eigenvalues()[0];
    return lowest > 0.0 ? std::sqrt(lowest) / (2 * std::numbers::pi) : 0.0;
  }
  // (9): least and largest, of the directions that the output can move in; 0 of a pose that falls.
  [[nodiscard]] static std::pair<double, double> OutputStiffness(const MatX& K, const MatX& W) {
    const Eigen::LLT<MatX> llt(K);
    if (llt.info() != Eigen::Success) return {0.0, 0.0};
    const Eigen::SelfAdjointEigenSolver<Mat3> soft(Mat3(W * llt.solve(W.transpose())),
                                                   Eigen::EigenvaluesOnly);
    const Vec3 sizes = soft.eigenvalues();
    if (!(sizes[2] > 0.0)) return {kNan, kNan};
    double least = sizes[2];
    for (int k = 2; k >= 0; --k) {
      if (sizes[k] > kRankShare * sizes[2]) least = sizes[k];
    }
    return {1.0 / sizes[2], 1.0 / least};
  }

  const PoseSpace& space_;
  const Mechanism& mechanism_;
  const double length_;
  const Limits limits_;
  const Output& output_;
  Eigen::Index dofs_ = 0;
  const SingularityMeter meter_;
  std::vector<double> drive_unit_;
  std::vector<Limb> limbs_;
  std::vector<QualityIndex> indices_;
  bool servos_ = true;
};

// Where the drives lose their hold inside a set of two dimensions that crosses such poses.
std::vector<TracedArc> SingularCurves(const SetQuestion& question, const ReachableSet& set) {
  const auto ends = [&](const std::vector<SetBound>& bounds) {
    const auto at = std::ranges::find(bounds, SetBound::Kind::kType2, &SetBound::kind);
    return at == bounds.end() ? -1 : static_cast<int>(at - bounds.begin());
  };
  SpaceSettings settings = question.settings;
  settings.cross_type2 = false;
  PoseSpace space(question.mechanism, settings);
  const int bound = ends(space.bounds());
  PlacedPose start;
  if (bound < 0 || ends(set.bounds) >= 0 || settings.over != 2 || !space.Home(&start) ||
      !space.Place(set.start_pose, &start)) {
    return {};
  }
  space.CountFrom(&start);
  std::map<std::pair<long, long>, std::pair<const SpacePose*, double>> poses;
  for (const FloodPoint& point : set.flooded.lattice) {
    PlacedPose at;
    if (!point.inside || !space.Place(point.pose, &at)) continue;
    const auto& step = set.flooded.lattice_step;
    poses[{std::lround((point.at[0] - set.start[0]) / step[0]),
           std::lround((point.at[1] - set.start[1]) / step[1])}] = {&point.pose, at.type2};
  }
  std::vector<std::pair<SpacePose, SpacePose>> across;
  for (const auto& [key, pose] : poses) {
    for (const auto& other :
         {std::pair(key.first + 1, key.second), std::pair(key.first, key.second + 1)}) {
      const auto at = poses.find(other);
      if (at == poses.end() || (at->second.second > 0.0) == (pose.second > 0.0)) continue;
      const bool first = pose.second > 0.0;
      across.emplace_back(*(first ? pose : at->second).first, *(first ? at->second : pose).first);
    }
  }
  return TraceInside(space, bound, across);
}

void Summarise(const ReachableSet& set, QualityMap* map) {
  // Every second pose along each coordinate.
  const auto is_coarse = [&](const Vec3& at) {
    for (size_t c = 0; c < set.over.size(); ++c) {
      const auto k = static_cast<Eigen::Index>(c);
      const double spacing = set.flooded.lattice_step.at(c);
      if (std::lround((at[k] - set.start[k]) / spacing) % 2 != 0) return false;
    }
    return true;
  };
  for (size_t i = 0; i < map->indices.size(); ++i) {
    QualityIndex& index = map->indices[i];
    double sum = 0.0, coarse = 0.0, count = 0.0, coarse_count = 0.0;
    for (size_t p = 0; p < map->points.size(); ++p) {
      const double value = map->values[p][static_cast<Eigen::Index>(i)];
      if (!std::isfinite(value)) continue;
      const Vec3& at = set.flooded.lattice[map->points[p]].at;
      sum += value;
      count += 1.0;
      if (is_coarse(at)) {
        coarse += value;
        coarse_count += 1.0;
      }
      if (!(value >= index.least)) {
        index.least = value;
        index.least_at = at;
      }
      if (!(value <= index.most)) {
        index.most = value;
        index.most_at = at;
      }
    }
    if (count > 0.0) index.mean = sum / count;
    if (coarse_count > 0.0) index.mean_error = std::abs(index.mean - coarse / coarse_count);
  }
}

}  // namespace

QualityMap MapQuality(const SetQuestion& question, const ReachableSet& set,
                      const std::string& output, int threads,
                      const std::function<void(double)>& progress) {
  QualityMap map;
  map.output = output;
  if (question.mechanism.FindOutput(output) < 0) {
    map.why_none = "the model has no output";
    return map;
  }
  const auto all = static_cast<int>(question.settings.coordinates.size());
  PoseSpace placing = PoseSpace(question.mechanism, question.settings).Section(all);
  if (PlacedPose home; !placing.Home(&home)) {
    map.why_none = "the home pose is singular";
    return map;
  }
  map.singular = SingularCurves(question, set);
  std::vector<std::vector<Pose>> some;
  const size_t stride = 1 + set.flooded.lattice.size() / kRankPoses;
  for (size_t p = 0; p < set.flooded.lattice.size(); p += stride) {
    const FloodPoint& point = set.flooded.lattice[p];
    if (point.inside) some.push_back(placing.States(point.pose).X_WB);
  }
  const QualityMapper mapper(placing, output, some);
  map.why_none = mapper.NoneReason();
  if (!map.why_none.empty()) return map;
  map.indices = mapper.indices();
  map.no_limb = mapper.NoLimb();
  std::vector<size_t> inside;
  for (size_t p = 0; p < set.flooded.lattice.size(); ++p) {
    if (set.flooded.lattice[p].inside) inside.push_back(p);
  }
  std::vector<VecX> values(inside.size());
  std::atomic<size_t> next = 0;
  const auto run = [&](bool reports) {
    for (size_t i = next++; i < inside.size(); i = next++) {
      PlacedPose at;
      if (!placing.Place(set.flooded.lattice[inside[i]].pose, &at) ||
          !mapper.Evaluate(at, &values[i])) {
        values[i].resize(0);
      }
      if (reports && progress)
        progress(static_cast<double>(i) / static_cast<double>(inside.size()));
    }
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads; ++t) others.emplace_back(run, false);
  run(true);
  for (std::thread& other : others) other.join();
  for (size_t i = 0; i < inside.size(); ++i) {
    if (values[i].size() == 0) {
      ++map.missed;
      continue;
    }
    map.points.push_back(inside[i]);
    map.values.push_back(std::move(values[i]));
  }
  Summarise(set, &map);
  return map;
}

}  // namespace mbv
