// How many ways there are to put the limbs of chosen joints together.
//
// A limb is a crank, slider or cylinder that a drive moves, and a rod of length L between a point A
// of it and a point B of a body that the joints move. All it asks for is
//
//   |B(q) − A(m)|² = L²                                                                       (1)
//
// seen in the axes of the drive's joint, w = B(q):
//   crank     A = a∥ + a⊥ cos m + (e × a⊥) sin m,  P cos m + Q sin m = K                      (2)
//             m = atan2(Q, P) ± acos(K/√(P² + Q²)): two ways, one at a dead centre, or none
//   slider    A = a + e m: m = h ± √(L² − |d − h e|²), d = w − a, h = d·e                     (3)
//   cylinder  between points of distance D: |v + e m| = D, the root on the side of home       (4)
//
// The other way round, joints for given drives: (1) is linear in cos q_k, sin q_k of a joint
// between the rod and the drive. Of two joints one follows from one limb in two ways, and the
// other limb is then a function of the other joint alone: all its zeros over a turn are the poses.
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "features/standin/standin.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

constexpr double kSamePoint = 1e-9;  // [characteristic lengths]: joints that near meet in a point
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr int kSteps = 720;  // of a turn

size_t Nth(Eigen::Index k) { return static_cast<size_t>(k); }

// An end of a rod, and of the tube or piston of a cylinder.
struct LimbEnd {
  int body = -1;
  Vec3 p_B = Vec3::Zero();  // its point there
  double rod = 0.0;         // distance to the first point; 0: no rod on the way
};

}  // namespace

struct StandinBranches::Limb {
  enum class Kind { kUnknown, kDirect, kCrank, kSlider, kCylinder, kDistance };
  Kind kind = Kind::kUnknown;
  Eigen::Index joint = -1;  // kDirect: of the chosen ones
  int base = 0, end = 0;    // bodies that the joints move against each other
  Pose X_BJ = Pose::Identity();
  Vec3 axis = Vec3::UnitZ(), a = Vec3::Zero();  // e and A at m = 0, in J
  Vec3 p_base = Vec3::Zero(), p_end = Vec3::Zero();
  double sign = 1.0, rod = 0.0, side = 1.0;
};

struct StandinBranches::Impl {
  Impl(const Mechanism& m, const Transmission& t) : mechanism(m), transmission(t) {
    for (const int d : t.drives) limbs.push_back(Find(m.drives[static_cast<size_t>(d)]));
  }

  [[nodiscard]] static bool IsPoint(const Joint& joint) {
    return joint.kind == JointKind::kRevolute || joint.kind == JointKind::kUniversal ||
           joint.kind == JointKind::kSpherical;
  }
  // The joints of a body and of those that fixed joints weld to it; with a kept body among these,
  // that one alone is of interest.
  struct Welded {
    int kept = -1;
    std::vector<int> bodies, joints;
  };
  [[nodiscard]] Welded WeldedTo(int body) const {
    Welded welded{.bodies = {body}, .joints = {}};
    std::vector<int>& bodies = welded.bodies;
    for (size_t b = 0; b < bodies.size(); ++b) {
      if (Kept(bodies[b])) {
        welded.kept = bodies[b];
        return welded;
      }
      for (size_t j = 0; j < mechanism.joints.size(); ++j) {
        const Joint& joint = mechanism.joints[j];
        if (joint.parent != bodies[b] && joint.child != bodies[b]) continue;
        const int other = joint.parent == bodies[b] ? joint.child : joint.parent;
        if (joint.kind != JointKind::kFixed) {
          welded.joints.push_back(static_cast<int>(j));
        } else if (std::ranges::count(bodies, other) == 0) {
          bodies.push_back(other);
        }
      }
    }
    return welded;
  }
  [[nodiscard]] const Joint& JointAt(int j) const {
    return mechanism.joints[static_cast<size_t>(j)];
  }
  // Of a joint, at home in the world.
  [[nodiscard]] Vec3 PointOf(int j) const {
    const Joint& joint = JointAt(j);
    return AtHome(joint.parent) * joint.X_PF.translation();
  }
  [[nodiscard]] const Pose& AtHome(int body) const {
    return mechanism.X_WB_home[static_cast<size_t>(body)];
  }
  [[nodiscard]] bool Kept(int body) const { return transmission.kept[static_cast<size_t>(body)]; }

  // From the one joint of `body` beside `not_this` on, through bodies that are mere points, at most
  // one rod among them, to a body that the joints move. `first`: the point where it begins, at home
  // in the world.
  [[nodiscard]] std::optional<LimbEnd> Follow(int body, int not_this, bool with_rod,
                                              Vec3* first) const {
    LimbEnd end;
    Vec3 at = Vec3::Zero();  // where the body before ended
    for (bool begun = false;; begun = true) {
      Welded here = WeldedTo(body);
      if (here.kept >= 0) {
        if (!begun || with_rod != (end.rod > 0.0)) return std::nullopt;
        end.body = here.kept;
        end.p_B = AtHome(here.kept).inverse() * at;
        return end;
      }
      std::erase(here.joints, not_this);
      if (here.joints.size() != 1 || !IsPoint(JointAt(here.joints[0]))) return std::nullopt;
      not_this = here.joints[0];
      const Vec3 p = PointOf(not_this);
      if (!begun) {
        *first = p;
      } else if (const double length = (p - at).norm();
                 length > kSamePoint * CharacteristicLength(mechanism)) {
        if (!with_rod || end.rod > 0.0) return std::nullopt;
        end.rod = length;
      }
      at = p;
      // The side of the joint that is not welded to this body.
      const Joint& joint = JointAt(not_this);
      body = std::ranges::count(here.bodies, joint.parent) > 0 ? joint.child : joint.parent;
    }
  }

  [[nodiscard]] Limb Find(const Drive& drive) const {
    Limb limb;
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      limb.base = leg->body_from;
      limb.end = leg->body_to;
      limb.p_base = leg->p_from;
      limb.p_end = leg->p_to;
      if (Kept(limb.base) && Kept(limb.end)) limb.kind = Limb::Kind::kDistance;
      return limb;
    }
    const auto& on = std::get<JointDrive>(drive.kind);
    const Joint& joint = JointAt(on.joint);
    for (size_t k = 0; k < transmission.joints.size(); ++k) {
      const Coordinate& chosen = transmission.joints[k].coordinate;
      if (chosen.index != on.joint || chosen.component != on.coordinate) continue;
      limb.kind = Limb::Kind::kDirect;
      limb.joint = static_cast<Eigen::Index>(k);
      return limb;
    }
    const bool slides = joint.kind == JointKind::kPrismatic;
    if (!slides && joint.kind != JointKind::kRevolute) return limb;
    limb.axis = joint.axis;
    Vec3 near, far;
    if (Kept(joint.parent) != Kept(joint.child)) {
      // The crank's or slider's frame where m = 0 falls on the base's.
      const bool forth = Kept(joint.parent);
      const int crank = forth ? joint.child : joint.parent;
      const auto end = Follow(crank, on.joint, true, &near);
      if (!end) return limb;
      limb.base = forth ? joint.parent : joint.child;
      limb.X_BJ = forth ? joint.X_PF : joint.X_CM;
      limb.a = (forth ? joint.X_CM : joint.X_PF).inverse() * (AtHome(crank).inverse() * near);
      limb.sign = forth ? 1.0 : -1.0;
      limb.end = end->body;
      limb.p_end = end->p_B;
      limb.rod = end->rod;
      limb.kind = slides ? Limb::Kind::kSlider : Limb::Kind::kCrank;
    } else if (slides && !Kept(joint.parent)) {
      const auto base = Follow(joint.parent, on.joint, false, &near);
      const auto end = Follow(joint.child, on.joint, false, &far);
      if (!base || !end) return limb;
      limb.base = base->body;
      limb.p_base = base->p_B;
      limb.end = end->body;
      limb.p_end = end->p_B;
      limb.a = joint.X_CM.inverse() * (AtHome(joint.child).inverse() * far) -
               joint.X_PF.inverse() * (AtHome(joint.parent).inverse() * near);
      limb.side = joint.home[0] + limb.a.dot(limb.axis) < 0.0 ? -1.0 : 1.0;
      limb.kind = Limb::Kind::kCylinder;
    }
    return limb;
  }

  // Of a kept body, the joints that are not chosen at home.
  [[nodiscard]] Pose PoseOf(int body, const VecX& q) const {
    const int j = transmission.toward_world[static_cast<size_t>(body)];
    if (body == 0 || j < 0) return Pose::Identity();
    const Joint& joint = JointAt(j);
    std::array<double, 6> at = joint.home;
    for (size_t k = 0; k < transmission.joints.size(); ++k) {
      const Coordinate& chosen = transmission.joints[k].coordinate;
      if (chosen.index == j)
        at[static_cast<size_t>(chosen.component)] = q[static_cast<Eigen::Index>(k)];
    }
    const Pose X_FM = JointPose(joint, at);
    return joint.child == body
               ? PoseOf(joint.parent, q) * joint.X_PF * X_FM * joint.X_CM.inverse()
               : PoseOf(joint.child, q) * joint.X_CM * X_FM.inverse() * joint.X_PF.inverse();
  }

  // w of (1), in J; of cylinders and distances from p_base.
  [[nodiscard]] Vec3 End(const Limb& limb, const VecX& q) const {
    const Vec3 p = (PoseOf(limb.base, q).inverse() * PoseOf(limb.end, q)) * limb.p_end;
    return limb.kind == Limb::Kind::kCrank || limb.kind == Limb::Kind::kSlider
               ? Vec3(limb.X_BJ.inverse() * p)
               : Vec3(p - limb.p_base);
  }

  [[nodiscard]] std::vector<double> Ways(const Limb& limb, const VecX& q, double* apart) const {
    *apart = kNan;
    if (limb.kind == Limb::Kind::kDirect) return {q[limb.joint]};
    const Vec3 w = End(limb, q);
    if (limb.kind == Limb::Kind::kDistance) return {w.norm()};
    const Vec3& e = limb.axis;
    if (limb.kind == Limb::Kind::kCrank) {
      const Vec3 along = e * limb.a.dot(e), across = limb.a - along;
      const double P = w.dot(across), Q = w.dot(e.cross(across));
      const double K =
          0.5 * (w.squaredNorm() + limb.a.squaredNorm() - limb.rod * limb.rod) - w.dot(along);
      const double c = K / std::hypot(P, Q);
      if (!(std::abs(c) <= 1.0)) return {};
      const double middle = std::atan2(Q, P), half = std::acos(c);
      *apart = 2.0 * std::min(half, std::numbers::pi - half);
      return {limb.sign * std::remainder(middle + half, kTurn),
              limb.sign * std::remainder(middle - half, kTurn)};
    }
    if (limb.kind == Limb::Kind::kSlider) {
      const Vec3 d = w - limb.a;
      const double h = d.dot(e), root = limb.rod * limb.rod - (d - h * e).squaredNorm();
      if (!(root >= 0.0)) return {};
      *apart = 2.0 * std::sqrt(root);
      return {limb.sign * (h + std::sqrt(root)), limb.sign * (h - std::sqrt(root))};
    }
    const double along = limb.a.dot(e);
    const double root = w.squaredNorm() - (limb.a - along * e).squaredNorm();
    if (!(root >= 0.0)) return {};
    return {limb.side * std::sqrt(root) - along};
  }

  // (1) as left side less right side [m²]; of a direct drive a sine that is zero once in a turn.
  [[nodiscard]] double Off(const Limb& limb, const VecX& q, double m) const {
    if (limb.kind == Limb::Kind::kDirect) return std::sin(0.5 * (q[limb.joint] - m));
    const Vec3 w = End(limb, q), along = limb.axis * (limb.sign * m);
    switch (limb.kind) {
      case Limb::Kind::kCrank:
        return (w - Eigen::AngleAxisd(limb.sign * m, limb.axis) * limb.a).squaredNorm() -
               limb.rod * limb.rod;
      case Limb::Kind::kSlider:
        return (w - limb.a - along).squaredNorm() - limb.rod * limb.rod;
      case Limb::Kind::kDistance:
        return w.squaredNorm() - m * m;
      default:
        return w.squaredNorm() - (limb.a + along).squaredNorm();
    }
  }

  // Both angles of one joint that meet a limb, the others of `q` given; true: it depends on it.
  bool Solve(const Limb& limb, double m, Eigen::Index joint, VecX* q,
             std::array<double, 2>* roots) const {
    roots->fill(kNan);
    if (limb.kind == Limb::Kind::kDirect) {
      (*roots)[0] = m;
      return limb.joint == joint;
    }
    double f[3];  // c₀ + c₁ cos q + c₂ sin q at three angles
    for (int k = 0; k < 3; ++k) {
      (*q)[joint] = kTurn * k / 3.0;
      f[k] = Off(limb, *q, m);
    }
    const double c0 = (f[0] + f[1] + f[2]) / 3.0, c1 = f[0] - c0,
                 c2 = (f[1] - f[2]) / std::numbers::sqrt3;
    const double size = std::hypot(c1, c2);
    if (!(size > kSamePoint * (limb.rod * limb.rod + End(limb, *q).squaredNorm()))) return false;
    if (std::abs(c0) > size) return true;
    const double middle = std::atan2(c2, c1), half = std::acos(-c0 / size);
    *roots = {middle + half, middle - half};
    return true;
  }

  // Zeros over a turn of a function that is NaN where it has no value.
  template <typename Function>
  static std::vector<double> Zeros(const Function& f) {
    std::vector<double> zeros;
    const auto bisect = [](double low, double high, const auto& is_low) {
      for (int i = 0; i < 50; ++i) {
        const double middle = 0.5 * (low + high);
        (is_low(middle) ? low : high) = middle;
      }
      return low;
    };
    // Symmetric mechanisms have zeros at 0 and half a turn, which are no steps.
    constexpr double kFrom = 0.1234567;
    double t0 = kFrom, f0 = f(t0);
    for (int i = 1; i <= kSteps; ++i) {
      double low = t0, f_low = f0;
      const double t = kFrom + kTurn * i / kSteps, f_t = f(t);
      t0 = t;
      f0 = f_t;
      if (std::isnan(f_low) && std::isnan(f_t)) continue;
      double high = t, f_high = f_t;
      // Where the function ends or begins, as far as it has values.
      const auto known = [&](double x) { return !std::isnan(f(x)); };
      if (std::isnan(f_t)) f_high = f(high = bisect(low, high, known));
      if (std::isnan(f_low)) f_low = f(low = bisect(high, low, known));
      const bool negative = f_low < 0.0;
      if (negative == (f_high < 0.0)) continue;
      zeros.push_back(bisect(low, high, [&](double x) { return (f(x) < 0.0) == negative; }));
    }
    return zeros;
  }

  const Mechanism& mechanism;
  const Transmission& transmission;
  std::vector<Limb> limbs;
};

StandinBranches::StandinBranches(const Mechanism& mechanism, const Transmission& transmission)
    : impl_(std::make_unique<Impl>(mechanism, transmission)) {}
StandinBranches::~StandinBranches() = default;

std::string StandinBranches::KindOf(Eigen::Index drive) const {
  constexpr std::array<const char*, 6> kKinds = {
      "", "the joint itself", "crank and rod", "slider and rod", "cylinder", "leg"};
  return kKinds.at(static_cast<size_t>(impl_->limbs[Nth(drive)].kind));
}

bool StandinBranches::Fits(Eigen::Index drive, const VecX& q, double m) const {
  const Limb& limb = impl_->limbs[Nth(drive)];
  if (limb.kind == Limb::Kind::kUnknown || limb.kind == Limb::Kind::kDirect) return true;
  const double size = limb.rod * limb.rod + impl_->End(limb, q).squaredNorm();
  return std::abs(impl_->Off(limb, q, m)) < kSamePoint * size;
}

void StandinBranches::Recheck(Eigen::Index drive) {
  impl_->limbs[Nth(drive)].kind = Limb::Kind::kUnknown;
}

std::vector<double> StandinBranches::Ways(Eigen::Index drive, const VecX& q, double* apart) const {
  return impl_->Ways(impl_->limbs[Nth(drive)], q, apart);
}

std::optional<std::vector<VecX>> StandinBranches::Poses(const VecX& drives) const {
  const Impl& impl = *impl_;
  const auto n = static_cast<Eigen::Index>(impl.limbs.size());
  if (n > 2) return std::nullopt;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Coordinate& joint = impl.transmission.joints[Nth(k)].coordinate;
    if (impl.limbs[Nth(k)].kind == Limb::Kind::kUnknown || IsLength(impl.mechanism, joint)) {
      return std::nullopt;
    }
  }
  // The joint that follows from the limb `first`: one that it depends on.
  VecX q = VecX::Constant(n, 0.7);
  std::array<double, 2> roots{};
  std::vector<VecX> poses;
  for (Eigen::Index first = 0; first < n; ++first) {
    for (Eigen::Index joint = 0; joint < n; ++joint) {
      if (n == 2 && impl.limbs[Nth(1 - first)].kind == Limb::Kind::kDirect &&
          impl.limbs[Nth(first)].kind != Limb::Kind::kDirect) {
        continue;  // what is direct goes first
      }
      if (!impl.Solve(impl.limbs[Nth(first)], drives[first], joint, &q, &roots)) continue;
      if (n == 1) {
        for (const double root : roots) {
          if (!std::isnan(root)) poses.emplace_back(VecX::Constant(1, std::remainder(root, kTurn)));
        }
        return poses;
      }
      for (const size_t way : {size_t{0}, size_t{1}}) {
        const auto at = [&](double t) {
          q[1 - joint] = t;
          impl.Solve(impl.limbs[Nth(first)], drives[first], joint, &q, &roots);
          q[joint] = roots[way];
        };
        const std::vector<double> zeros = Impl::Zeros([&](double t) {
          at(t);
          return std::isnan(q[joint]) ? kNan
                                      : impl.Off(impl.limbs[Nth(1 - first)], q, drives[1 - first]);
        });
        for (const double zero : zeros) {
          at(zero);
          poses.push_back(q.unaryExpr([](double x) { return std::remainder(x, kTurn); }));
        }
      }
      return poses;
    }
  }
  return std::nullopt;
}

}  // namespace mbv
