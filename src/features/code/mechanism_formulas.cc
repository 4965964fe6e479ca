#include "features/code/mechanism_formulas.h"

#include <fmt/format.h>
#include <Eigen/QR>
#include <algorithm>
#include <functional>
#include <map>
#include <random>
#include <set>
#include <utility>

#include "base/demand.h"
#include "mechanism/idle_spins.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv {

// What joint_pose.h asks of a pair of frames, as formulas.
namespace {

struct PoseE {
  Mat3E R = Mat3E::Identity();
  Vec3E p = Vec3E::Zero();
};
PoseE operator*(const PoseE& a, const PoseE& b) { return {a.R * b.R, a.p + a.R * b.p}; }
PoseE Inverse(const PoseE& a) {
  const Mat3E R = a.R.transpose();
  return {R, -(R * a.p)};
}

// An angle is known by multiples of its sine and cosine, as it may count turns.
struct CoordinateFormula {
  bool angle = false;
  Expr s = {}, c = {}, value = {};
};

struct PairE {
  const PoseE& X_FM;
};
struct CosineE {
  Expr value;
};
// Entries that are rounding errors of 0 and ±1 are these.
Expr Snapped(double value) {
  constexpr double kRounding = 4.0 * kEps;
  const double nearest = std::round(value);
  return std::abs(value - nearest) <= kRounding ? nearest : value;
}
Vec3E Constant3(const Vec3& v) { return {Snapped(v.x()), Snapped(v.y()), Snapped(v.z())}; }
Vec3E Length3(const Vec3& v) { return {Expr(v.x()), Expr(v.y()), Expr(v.z())}; }
Mat3E Constant33(const Mat3& M) {
  Mat3E E;
  for (int i = 0; i < 3; ++i) E.col(i) = Constant3(M.col(i));
  return E;
}
PoseE ConstantPose(const Pose& X) { return {Constant33(X.linear()), Length3(X.translation())}; }

CosineE Cosine(const PairE& pair, const Vec3& f_F, const Vec3& m_M) {
  return {Constant3(f_F).dot(pair.X_FM.R * Constant3(m_M))};
}
CoordinateFormula Along(const PairE& pair, const Vec3& n_F) {
  return {.value = Constant3(n_F).dot(pair.X_FM.p)};
}
CoordinateFormula Angle(CosineE s, CosineE c) {
  return {true, s.value, c.value, atan2(s.value, c.value)};
}
CoordinateFormula RollPitchYaw(const PairE& pair, int component) {
  const Mat3E& R = pair.X_FM.R;
  if (component == 0) return Angle({R(2, 1)}, {R(2, 2)});
  if (component == 2) return Angle({R(1, 0)}, {R(0, 0)});
  return Angle({-R(2, 0)}, {sqrt(R(0, 0) * R(0, 0) + R(1, 0) * R(1, 0))});
}

Vec3E Cross(const Vec3E& a, const Vec3E& b) {
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(),
          a.x() * b.y() - a.y() * b.x()};
}

Mat3E Turn(const Vec3& axis, Expr angle) {
  const Expr s = sin(angle), c = cos(angle), d = Expr(1.0) - c;
  const Vec3E a = Constant3(axis);
  Mat3E R;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j)
      R(i, j) = i == j && axis[i] * axis[i] == 1.0 ? Expr(1.0) : a[i] * a[j] * d;
  }
  for (int i = 0; i < 3; ++i) {
    if (axis[i] * axis[i] != 1.0) R(i, i) += c;
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    R(j, i) += a[k] * s;
    R(i, j) -= a[k] * s;
  }
  return R;
}
// Of a unit quaternion w, x, y, z.
Mat3E Turn(const std::array<Expr, 4>& q) {
  const auto& [w, x, y, z] = q;
  const Expr two(2.0), one(1.0);
  Mat3E R;
  R << one - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y),
      two * (x * y + w * z), one - two * (x * x + z * z), two * (y * z - w * x),
      two * (x * z - w * y), two * (y * z + w * x), one - two * (x * x + y * y);
  return R;
}

constexpr int kGenericPoses = 2;

class FormulaMaker {
 public:
  FormulaMaker(const Mechanism& mechanism, Diagnostics* diagnostics)
      : m_(mechanism), diagnostics_(*diagnostics), made_(std::make_unique<MechanismFormulas>()) {
    made_->length = CharacteristicLength(mechanism);
    for (const Spin& spin : IdleSpins(mechanism)) TakeSpin(spin);
  }

  std::unique_ptr<MechanismFormulas> Make(const std::vector<NamedCoordinate>& coordinates,
                                          const std::vector<NamedCoordinate>& held,
                                          const std::vector<NamedCoordinate>& actuators) {
    AddOutputJoints(coordinates);
    AddOutputJoints(held);
    BuildTree(coordinates);
    made_->held = held;
    AddCoordinatesOfTree(held);
    FindMotion();
    AddLoopRows();
    for (const NamedCoordinate& at : held) {
      if (DirectOf(at.coordinate) == kNotDirect) {
        rows_.push_back(RowOf(FormulaOf(at.coordinate), HomeValue(m_, at.coordinate)));
      }
    }
    const auto closure = Close(coordinates, "q");
    if (!closure) return nullptr;
    made_->closure = *closure;
    AddActuators(actuators);
    if (actuators.size() == coordinates.size()) {
      made_->from_actuators = Close(actuators, "d", /*silent=*/true);
    }
    AddForces();
    for (const Output& output : m_.outputs) {
      const PoseE X = Between(output.reference_body, output.X_RbR, output.body, output.X_BO);
      OutputFormula formula{.name = output.name, .pose = {X.p.x(), X.p.y(), X.p.z()}};
      for (int k = 0; k < 3; ++k) formula.pose.push_back(RollPitchYaw(PairE{X}, k).value);
      made_->outputs.push_back(std::move(formula));
    }
    return std::move(made_);
  }

 private:
  static constexpr int kNotDirect = -1, kHeld = -2;

  // A universal joint across the line between two balls stands for one of them, and inertia about
  // the line for nothing: its momentum is zero in any case (mechanism/idle_spins.h, eq. 2).
  void TakeSpin(const Spin& spin) {
    const auto home = [this](int body) -> const Pose& {
      return m_.X_WB_home[static_cast<size_t>(body)];
    };
    const Vec3 n_W = home(spin.bodies[0]).linear() * spin.n_B;
    for (const int b : spin.bodies) {
      const Vec3 n = home(b).linear().transpose() * n_W;
      Mat3& I = m_.bodies[static_cast<size_t>(b)].I_Bcm_B;
      I -= (n.dot(I * n) * n * n.transpose()).eval();
    }
    Joint& joint = m_.joints[static_cast<size_t>(spin.balls[0])];
    const Mat3 R_WF = home(joint.parent).linear() * joint.X_PF.linear();
    const Vec3 n = (R_WF.transpose() * n_W).normalized();
    joint.kind = JointKind::kUniversal;
    joint.X_CM.linear() = home(joint.child).linear().transpose() * R_WF;
    joint.axis = n.unitOrthogonal();
    joint.axis2 = n.cross(joint.axis);
    joint.home.fill(0.0);
    joint.transmits_force_only = false;
  }

  // A free joint from an output's reference frame to its frame, whose coordinates are the output's.
  void AddOutputJoints(const std::vector<NamedCoordinate>& coordinates) {
    if (own_joints_ < 0) own_joints_ = static_cast<int>(m_.joints.size());
    for (const NamedCoordinate& at : coordinates) {
      if (at.coordinate.kind != Coordinate::Kind::kOutput) continue;
      const int o = at.coordinate.index;
      if (output_joints_.contains(o)) continue;
      const Output& output = m_.outputs[static_cast<size_t>(o)];
      Joint joint;
      joint.name = output.name;
      joint.kind = JointKind::kFree;
      joint.parent = output.reference_body;
      joint.X_PF = output.X_RbR;
      joint.child = output.body;
      joint.X_CM = output.X_BO;
      output_joints_[o] = static_cast<int>(m_.joints.size());
      m_.joints.push_back(joint);
    }
  }
  [[nodiscard]] bool IsOutputJoint(int joint) const { return joint >= own_joints_; }

  [[nodiscard]] ClosureHints Hints() const {
    ClosureHints hints(m_.joints.size());
    std::vector<int> group(m_.bodies.size());
    for (size_t b = 0; b < group.size(); ++b) group[b] = static_cast<int>(b);
    for (const auto& [output, joint] : output_joints_) {
      const Joint& at = m_.joints[static_cast<size_t>(joint)];
      const int from = group[static_cast<size_t>(at.parent)],
                to = group[static_cast<size_t>(at.child)];
      hints[static_cast<size_t>(joint)] = from == to;  // two outputs of a body: one carries it
      if (from != to) std::replace(group.begin(), group.end(), from, to);
    }
    return hints;
  }

  // Chosen coordinates stay in the tree, if they can. What has no mass counts like other bodies
  // here.
  void BuildTree(const std::vector<NamedCoordinate>& coordinates) {
    std::vector<double> masses;
    for (Body& body : m_.bodies) masses.push_back(std::exchange(body.mass, 1.0));
    ClosureHints hints = Hints();
    for (const NamedCoordinate& at : coordinates) {
      if (at.coordinate.kind != Coordinate::Kind::kJoint) continue;
      std::optional<bool>& hint = hints[static_cast<size_t>(at.coordinate.index)];
      if (!hint) hint = false;
    }
    if (!BuildSpanningTree(&m_, hints).ok() && !BuildSpanningTree(&m_, Hints()).ok()) {
      // Without the joints of outputs.
      while (static_cast<int>(m_.joints.size()) > own_joints_) m_.joints.pop_back();
      output_joints_.clear();
      MBV_DEMAND(BuildSpanningTree(&m_, {}).ok(), m_.name);
    }
    for (size_t b = 0; b < masses.size(); ++b) m_.bodies[b].mass = masses[b];
  }

  bool Refuse(const std::string& message, const std::string& hint) {
    diagnostics_.AddError(m_.file, message, hint);
    return false;
  }

  [[nodiscard]] Pose HomePose(const Joint& joint) const {
    return (m_.X_WB_home[static_cast<size_t>(joint.parent)] * joint.X_PF).inverse() *
           (m_.X_WB_home[static_cast<size_t>(joint.child)] * joint.X_CM);
  }

  // Entries of x and u of each tree joint; what is held has none.
  void AddCoordinatesOfTree(const std::vector<NamedCoordinate>& held) {
    std::set<std::pair<int, int>> fixed;
    for (const NamedCoordinate& at : held) {
      if (const auto [joint, c] = JointCoordinateOf(at.coordinate); joint >= 0)
        fixed.insert({joint, c});
    }
    value_.resize(m_.joints.size());
    rate_.assign(m_.joints.size(), {});
    std::vector<double> home;
    for (const int j : m_.tree_joints) {
      const Joint& joint = m_.joints[static_cast<size_t>(j)];
      const std::array<double, 6> at_home = CoordinatesOf(joint, HomePose(joint));
      const int dofs = DofsOf(joint.kind);
      const bool ball = HasBall(joint.kind) && !IsOutputJoint(j);
      for (int c = 0; c < dofs; ++c) {
        const bool of_ball = ball && IsOfBall(joint.kind, c);
        const auto name = dofs == 1 ? joint.name : fmt::format("{}.{}", joint.name, c);
        // Angles that count turns are within half a turn of the model's home.
        double value = at_home[static_cast<size_t>(c)];
        if (!IsLength(joint.kind, c) && !IsOutputJoint(j)) {
          const double turns = (joint.home[static_cast<size_t>(c)] - value) / (2.0 * M_PI);
          value += 2.0 * M_PI * std::round(turns);
        }
        if (fixed.contains({j, c}) && !of_ball) {
          value_[static_cast<size_t>(j)].push_back(value);
          rate_[static_cast<size_t>(j)].push_back(kHeld);
          continue;
        }
        const int first = dofs - 3;  // of a ball
        rate_[static_cast<size_t>(j)].push_back(static_cast<int>(made_->rates.size()));
        made_->rates.push_back(
            {name, IsLength(joint.kind, c),
             of_ball && c > first ? made_->rates.back().x : static_cast<int>(home.size()),
             of_ball ? c - first : -1});
        if (!of_ball) {
          home.push_back(value);
          value_[static_cast<size_t>(j)].push_back(NewX());
        } else if (c == first) {
          const Eigen::Quaterniond q(HomePose(joint).linear());
          for (const double part : {q.w(), q.x(), q.y(), q.z()}) {
            home.push_back(part);
            value_[static_cast<size_t>(j)].push_back(NewX());
          }
        }
      }
    }
    made_->x_home = Eigen::Map<VecX>(home.data(), static_cast<Eigen::Index>(home.size()));
    for (size_t k = 0; k < made_->rates.size(); ++k) {
      made_->u.push_back(made_->graph.Input(fmt::format("u[{}]", k)));
      made_->du.push_back(made_->graph.Input(fmt::format("du[{}]", k)));
    }
    // ẋ: of a quaternion ½ q ω.
    for (size_t k = 0; k < made_->rates.size(); ++k) {
      const TreeRate& rate = made_->rates[k];
      const auto x = static_cast<size_t>(rate.x);
      if (rate.ball < 0) {
        dx_.emplace_back(made_->x[x], made_->u[k]);
      } else if (rate.ball == 0) {
        const Expr half(0.5), &a = made_->u[k], &b = made_->u[k + 1], &c = made_->u[k + 2];
        const Expr &w = made_->x[x], &i = made_->x[x + 1], &j = made_->x[x + 2],
                   &l = made_->x[x + 3];
        dx_.emplace_back(w, half * (-(i * a) - j * b - l * c));
        dx_.emplace_back(i, half * (w * a + j * c - l * b));
        dx_.emplace_back(j, half * (w * b + l * a - i * c));
        dx_.emplace_back(l, half * (w * c + i * b - j * a));
      }
    }
  }
  Expr NewX() {
    made_->x.push_back(made_->graph.Input(fmt::format("x[{}]", made_->x.size())));
    return made_->x.back();
  }

  // d/dt of formulas of x and u.
  [[nodiscard]] std::vector<Expr> Rates(const std::vector<Expr>& of) {
    std::vector<std::pair<Expr, Expr>> rates = dx_;
    for (size_t k = 0; k < made_->u.size(); ++k) rates.emplace_back(made_->u[k], made_->du[k]);
    return made_->graph.Derivatives(of, rates);
  }
  [[nodiscard]] Expr Rate(Expr of) { return Rates({of})[0]; }
  [[nodiscard]] Vec3E Rate(const Vec3E& of) {
    const std::vector<Expr> rates = Rates({of.x(), of.y(), of.z()});
    return {rates[0], rates[1], rates[2]};
  }
  // Coefficient of u[k].
  [[nodiscard]] std::vector<Expr> Coefficients(const std::vector<Expr>& rates, size_t k) {
    return made_->graph.Derivatives(rates, {{made_->u[k], Expr(1.0)}});
  }
  // With du = 0.
  [[nodiscard]] std::vector<Expr> Bias(const std::vector<Expr>& rates) {
    return made_->graph.Derivatives(rates, dx_);
  }

  // X_FM of a tree joint.
  [[nodiscard]] PoseE JointPoseE(int j) const {
    const Joint& joint = m_.joints[static_cast<size_t>(j)];
    const std::vector<Expr>& q = value_[static_cast<size_t>(j)];
    PoseE X;
    const auto slide = [&](const Vec3& direction, Expr by) {
      X.p += (Constant3(direction) * by).eval();
    };
    const auto ball = [&](size_t first) {
      X.R = Turn(std::array<Expr, 4>{q[first], q[first + 1], q[first + 2], q[first + 3]});
    };
    switch (joint.kind) {
      case JointKind::kFixed:
        break;
      case JointKind::kRevolute:
        X.R = Turn(joint.axis, q[0]);
        break;
      case JointKind::kPrismatic:
        slide(joint.axis, q[0]);
        break;
      case JointKind::kCylindrical:
        slide(joint.axis, q[0]);
        X.R = Turn(joint.axis, q[1]);
        break;
      case JointKind::kUniversal:
        X.R = Turn(joint.axis, q[0]) * Turn(joint.axis2, q[1]);
        break;
      case JointKind::kSpherical:
        ball(0);
        break;
      case JointKind::kPlanar:
        slide(JointBasis(joint).col(0), q[0]);
        slide(JointBasis(joint).col(1), q[1]);
        X.R = Turn(joint.axis, q[2]);
        break;
      case JointKind::kPointOnLine:
        slide(joint.axis, q[0]);
        ball(1);
        break;
      case JointKind::kPointOnPlane:
        slide(JointBasis(joint).col(0), q[0]);
        slide(JointBasis(joint).col(1), q[1]);
        ball(2);
        break;
      case JointKind::kFree:
        for (int k = 0; k < 3; ++k) slide(Vec3::Unit(k), q[static_cast<size_t>(k)]);
        if (IsOutputJoint(j)) {
          X.R = Turn(Vec3::UnitZ(), q[5]) * Turn(Vec3::UnitY(), q[4]) * Turn(Vec3::UnitX(), q[3]);
        } else {
          ball(3);
        }
        break;
    }
    return X;
  }

  // Angular velocity of M in F, in M's axes.
  [[nodiscard]] Vec3E JointSpin(int j, const Mat3E& R_FM) const {
    const Joint& joint = m_.joints[static_cast<size_t>(j)];
    const auto rate = [&](int c) {
      const int k = rate_[static_cast<size_t>(j)][static_cast<size_t>(c)];
      return k == kHeld ? Expr(0.0) : made_->u[static_cast<size_t>(k)];
    };
    const Vec3E axis_M = R_FM.transpose() * Constant3(joint.axis);
    const int first = DofsOf(joint.kind) - 3;
    switch (joint.kind) {
      case JointKind::kFixed:
      case JointKind::kPrismatic:
        return Vec3E::Zero();
      case JointKind::kRevolute:
        return Constant3(joint.axis) * rate(0);
      case JointKind::kCylindrical:
        return Constant3(joint.axis) * rate(1);
      case JointKind::kPlanar:
        return Constant3(joint.axis) * rate(2);
      case JointKind::kUniversal:
        return axis_M * rate(0) + Constant3(joint.axis2) * rate(1);
      case JointKind::kFree:
        if (IsOutputJoint(j)) {
          const Mat3E Rx = Turn(Vec3::UnitX(), value_[static_cast<size_t>(j)][3]);
          const Mat3E Ry = Turn(Vec3::UnitY(), value_[static_cast<size_t>(j)][4]);
          const Vec3E roll(rate(3), 0.0, 0.0), pitch(0.0, rate(4), 0.0), yaw(0.0, 0.0, rate(5));
          return roll + Rx.transpose() * (pitch + Ry.transpose() * yaw);
        }
        [[fallthrough]];
      case JointKind::kSpherical:
      case JointKind::kPointOnLine:
      case JointKind::kPointOnPlane:
        return {rate(first), rate(first + 1), rate(first + 2)};
    }
    ThrowDemand("a joint kind", __FILE__, __LINE__, joint.name);
  }

  // From body to body of the tree: poses and velocities, each in the outboard body's axes.
  void FindMotion() {
    const size_t bodies = m_.bodies.size();
    inboard_.assign(bodies, 0);
    depth_.assign(bodies, 0);
    X_IO_.resize(bodies);
    spin_.resize(bodies);
    omega_.assign(bodies, Vec3E::Zero());
    for (size_t t = 0; t < m_.tree_joints.size(); ++t) {
      const int j = m_.tree_joints[t];
      const Joint& joint = m_.joints[static_cast<size_t>(j)];
      const auto in = static_cast<size_t>(InboardBody(m_, t));
      const auto out = static_cast<size_t>(OutboardBody(m_, t));
      const PoseE X_FM = JointPoseE(j);
      const PoseE X_PC = ConstantPose(joint.X_PF) * X_FM * ConstantPose(joint.X_CM.inverse());
      const Vec3E w_M = JointSpin(j, X_FM.R);  // of the child, seen from the parent
      inboard_[out] = static_cast<int>(in);
      depth_[out] = depth_[in] + 1;
      if (m_.tree_reversed[t]) {
        X_IO_[out] = Inverse(X_PC);
        spin_[out] = -(Constant33(joint.X_PF.linear()) * (X_FM.R * w_M));
      } else {
        X_IO_[out] = X_PC;
        spin_[out] = Constant33(joint.X_CM.linear()) * w_M;
      }
      omega_[out] = X_IO_[out].R.transpose() * omega_[in] + spin_[out];
    }
  }

  // Frames on two bodies, seen from the body where their ways through the tree meet.
  struct Meeting {
    PoseE from, to;
  };
  [[nodiscard]] Meeting Meet(int a, const Pose& X_a, int b, const Pose& X_b) const {
    Meeting meeting;
    while (a != b) {
      int& deeper = depth_[static_cast<size_t>(a)] >= depth_[static_cast<size_t>(b)] ? a : b;
      PoseE& way = &deeper == &a ? meeting.from : meeting.to;
      way = X_IO_[static_cast<size_t>(deeper)] * way;
      deeper = inboard_[static_cast<size_t>(deeper)];
    }
    return {meeting.from * ConstantPose(X_a), meeting.to * ConstantPose(X_b)};
  }
  // Pose of frame B in A.
  [[nodiscard]] PoseE Between(int a, const Pose& X_a, int b, const Pose& X_b) const {
    const Meeting meeting = Meet(a, X_a, b, X_b);
    return Inverse(meeting.from) * meeting.to;
  }

  void AddLoopRows() {
    const Expr per_length(1.0 / made_->length);
    for (const Joint& joint : m_.joints) {
      if (!joint.closure || joint.kind == JointKind::kFree) continue;
      const auto [F, M] = Meet(joint.parent, joint.X_PF, joint.child, joint.X_CM);
      const Vec3E d = M.p - F.p;
      Mat3 directions;
      const int locked = LockedDirections(joint, &directions);
      for (int k = 0; k < locked; ++k) {
        // Where all are locked, along axes that the joint does not turn: the rows stay apart.
        AddRow((locked == 3 ? d[k] : (F.R * Constant3(directions.col(k))).dot(d)) * per_length);
      }
      const PoseE X_FM = Inverse(F) * M;
      std::array<LockedCosine, 3> cosines;
      const int turns = LockedCosines(joint, &cosines);
      for (int k = 0; k < turns; ++k) {
        const LockedCosine& at = cosines[static_cast<size_t>(k)];
        AddRow(Cosine(PairE{X_FM}, at.f_F, at.m_M).value - Snapped(at.value));
      }
    }
    for (const Coupling& coupling : m_.couplings) {
      Expr sum(coupling.constant);
      for (const Coupling::Term& term : coupling.terms) {
        Expr part(0.0);
        const Expr q = FormulaOf({Coordinate::Kind::kJoint, term.joint, term.coordinate}).value;
        for (size_t i = term.polynomial.size(); i-- > 0;) part = (part + term.polynomial[i]) * q;
        sum += part;
      }
      const Coupling::Term& first = coupling.terms.front();
      const bool slides =
          IsLength(m_.joints[static_cast<size_t>(first.joint)].kind, first.coordinate);
      AddRow(slides ? sum * per_length : sum);
    }
  }
  void AddRow(Expr residual) { rows_.push_back({residual, Rate(residual)}); }

  // The joint's coordinate that a coordinate is, or −1.
  [[nodiscard]] std::pair<int, int> JointCoordinateOf(const Coordinate& at) const {
    const auto index = static_cast<size_t>(at.index);
    switch (at.kind) {
      case Coordinate::Kind::kPrescribed:
        return {m_.prescribed[index].joint, 0};
      case Coordinate::Kind::kJoint:
        return {at.index, at.component};
      case Coordinate::Kind::kDrive:
        if (const auto* on = std::get_if<JointDrive>(&m_.drives[index].kind)) {
          return {on->joint, on->coordinate};
        }
        return {-1, 0};
      case Coordinate::Kind::kOutput:
        if (const auto joint = output_joints_.find(at.index); joint != output_joints_.end()) {
          return {joint->second, at.component};
        }
        return {-1, 0};
    }
    ThrowDemand("a kind of coordinate", __FILE__, __LINE__, "");
  }
  // The entry of u, kHeld or kNotDirect.
  [[nodiscard]] int DirectOf(const Coordinate& at) const {
    const auto [joint, c] = JointCoordinateOf(at);
    if (joint < 0 || m_.joints[static_cast<size_t>(joint)].closure) return kNotDirect;
    const int k = rate_[static_cast<size_t>(joint)][static_cast<size_t>(c)];
    if (k >= 0 && made_->rates[static_cast<size_t>(k)].ball >= 0) return kNotDirect;
    return k;
  }
  [[nodiscard]] CoordinateFormula FormulaOf(const Coordinate& at) const {
    const auto [joint, c] = JointCoordinateOf(at);
    if (joint >= 0) {
      const Joint& on = m_.joints[static_cast<size_t>(joint)];
      if (const int k = DirectOf(at); k >= 0) {
        return {.value = made_->x[static_cast<size_t>(made_->rates[static_cast<size_t>(k)].x)]};
      } else if (k == kHeld) {
        return {.value = value_[static_cast<size_t>(joint)][static_cast<size_t>(c)]};
      }
      const PoseE X_FM = Between(on.parent, on.X_PF, on.child, on.X_CM);
      return AroundHome(internal::CoordinateBetween(on, c, PairE{X_FM}),
                        on.home[static_cast<size_t>(c)]);
    }
    if (at.kind == Coordinate::Kind::kOutput) {
      const Output& output = m_.outputs[static_cast<size_t>(at.index)];
      const PoseE X = Between(output.reference_body, output.X_RbR, output.body, output.X_BO);
      if (at.component < 3) return {.value = X.p[at.component]};
      return RollPitchYaw(PairE{X}, at.component - 3);
    }
    const auto& leg = std::get<DistanceDrive>(m_.drives[static_cast<size_t>(at.index)].kind);
    Pose from = Pose::Identity(), to = Pose::Identity();
    from.translation() = leg.p_from;
    to.translation() = leg.p_to;
    const PoseE X = Between(leg.body_from, from, leg.body_to, to);
    return {.value = sqrt(X.p.dot(X.p))};
  }
  // Its value within half a turn of home.
  static CoordinateFormula AroundHome(CoordinateFormula formula, double home) {
    if (formula.angle && home != 0.0) {
      const Expr s(std::sin(home)), c(std::cos(home));
      formula.value =
          Expr(home) + atan2(formula.s * c - formula.c * s, formula.c * c + formula.s * s);
    }
    return formula;
  }
  // A coordinate that is to have a value.
  [[nodiscard]] RowFormula RowOf(const CoordinateFormula& formula, Expr value) {
    Expr residual = formula.value - value;
    if (formula.angle) {
      const Expr size = sqrt(formula.s * formula.s + formula.c * formula.c);
      residual = (formula.s * cos(value) - formula.c * sin(value)) / size;
    }
    return {residual, Rate(residual)};
  }

  std::optional<ClosureFormulas> Close(const std::vector<NamedCoordinate>& coordinates,
                                       const std::string& array, bool silent = false) {
    ClosureFormulas closure{.coordinates = coordinates};
    std::vector<RowFormula> rows;
    std::vector<bool> known(made_->rates.size(), false);
    closure.home.resize(static_cast<Eigen::Index>(coordinates.size()));
    for (size_t k = 0; k < coordinates.size(); ++k) {
      closure.q.push_back(made_->graph.Input(fmt::format("{}[{}]", array, k)));
      const CoordinateFormula formula = FormulaOf(coordinates[k].coordinate);
      closure.values.push_back(formula.value);
      closure.home[static_cast<Eigen::Index>(k)] = HomeValue(m_, coordinates[k].coordinate);
      const int direct = DirectOf(coordinates[k].coordinate);
      closure.direct.push_back(std::max(direct, -1));
      if (direct >= 0 && !known[static_cast<size_t>(direct)]) {
        known[static_cast<size_t>(direct)] = true;
      } else {
        const bool slides = IsLength(m_, coordinates[k].coordinate);
        const double weight = slides ? 1.0 / made_->length : 1.0;
        const RowFormula row = RowOf(formula, closure.q.back());
        rows.push_back({row.residual * weight, row.rate * weight, static_cast<int>(k), weight});
        closure.direct.back() = -1;
      }
    }
    rows.insert(rows.end(), rows_.begin(), rows_.end());
    std::vector<int> unknown;
    for (size_t k = 0; k < known.size(); ++k) {
      if (!known[k]) unknown.push_back(static_cast<int>(k));
    }
    for (const RowFormula& row : rows) {
      if (!made_->graph.IsZero(row.residual)) closure.gaps.push_back(row.residual);
    }
    std::vector<Expr> rates;
    rates.reserve(rows.size());
    for (const RowFormula& row : rows) rates.push_back(row.rate);
    std::vector<std::vector<Expr>> J(made_->rates.size());  // by column
    for (size_t k = 0; k < J.size(); ++k) J[k] = Coefficients(rates, k);
    if (!SplitIntoBlocks(rows, J, unknown, &closure, silent)) return std::nullopt;
    return closure;
  }

  // Values of all inputs at x.
  [[nodiscard]] std::vector<double> InputsAt(const VecX& x, const ClosureFormulas& closure,
                                             const VecX& q) const {
    std::vector<double> inputs(made_->graph.inputs(), 0.0);
    for (size_t i = 0; i < made_->x.size(); ++i) {
      inputs[made_->graph.InputOf(made_->x[i])] = x[static_cast<Eigen::Index>(i)];
    }
    for (size_t k = 0; k < closure.q.size(); ++k) {
      inputs[made_->graph.InputOf(closure.q[k])] = q[static_cast<Eigen::Index>(k)];
    }
    return inputs;
  }
  void Step(const VecX& step, VecX* x) const {
    for (size_t k = 0; k < made_->rates.size(); ++k) {
      const TreeRate& rate = made_->rates[k];
      const double by = step[static_cast<Eigen::Index>(k)];
      if (rate.ball < 0) (*x)[rate.x] += by;
      if (rate.ball != 0) continue;
      const auto at = static_cast<Eigen::Index>(k);
      auto q = x->segment<4>(rate.x);
      const Eigen::Quaterniond turned =
          Eigen::Quaterniond(q[0], q[1], q[2], q[3]) *
          Eigen::Quaterniond(1.0, 0.5 * by, 0.5 * step[at + 1], 0.5 * step[at + 2]).normalized();
      q << turned.w(), turned.x(), turned.y(), turned.z();
    }
  }

  // Independent rows at generic poses near home, matched with the rates that they determine.
  bool SplitIntoBlocks(const std::vector<RowFormula>& rows, const std::vector<std::vector<Expr>>& J,
                       const std::vector<int>& unknown, ClosureFormulas* closure, bool silent) {
    const auto m = static_cast<Eigen::Index>(rows.size());
    const auto n = static_cast<Eigen::Index>(J.size());
    std::vector<Expr> all;
    all.reserve(rows.size() * (J.size() + 1) + closure->values.size());
    for (const RowFormula& row : rows) all.push_back(row.residual);
    for (const auto& column : J) all.insert(all.end(), column.begin(), column.end());
    all.insert(all.end(), closure->values.begin(), closure->values.end());
    const FormulaTape tape(all);
    const auto commands = static_cast<Eigen::Index>(
        std::ranges::count_if(rows, [](const RowFormula& row) { return row.coordinate >= 0; }));
    VecX q = closure->home;
    VecX scale(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      scale[k] = made_->rates[static_cast<size_t>(k)].length ? made_->length : 1.0;
    }
    std::vector<double> work, values;
    VecX x = made_->x_home, r(m);
    MatX A(m, n), of_all = MatX::Zero(m, n);
    const auto evaluate = [&] {
      tape.Evaluate(InputsAt(x, *closure, q), &work, &values);
      r = Eigen::Map<VecX>(values.data(), m);
      A = Eigen::Map<MatX>(values.data() + m, m, n) * scale.asDiagonal();
      q = Eigen::Map<VecX>(values.data() + m + m * n, q.size());
    };
    MatX U(m, static_cast<Eigen::Index>(unknown.size()));
    MatX best;
    Eigen::Index best_rank = -1;
    std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same each time
    std::uniform_real_distribution<double> spread(-0.05, 0.05);
    // What is in which row, also where loops are open.
    for (int pose = 0; pose < kGenericPoses; ++pose) {
      x = made_->x_home;
      Step(scale.asDiagonal() * VecX::NullaryExpr(n, [&] { return 10.0 * spread(random); }), &x);
      evaluate();
      of_all = of_all.cwiseMax(A.cwiseAbs());
    }
    x = made_->x_home;
    q = closure->home;
    for (int pose = 0; pose <= kGenericPoses; ++pose) {
      if (pose > 0) {  // a step in all degrees of freedom, then back into the loops
        VecX free = VecX::NullaryExpr(n, [&] { return spread(random); });
        for (int pass = 0; pass < 8; ++pass) {
          evaluate();
          const MatX loops = A.bottomRows(m - commands);
          const VecX open = r.tail(m - commands);
          VecX step = VecX::Zero(n);
          if (pass == 0) step = free;
          if (loops.rows() > 0) {  // Eigen decomposes nothing that is empty
            Eigen::CompleteOrthogonalDecomposition<MatX> solver(loops);
            solver.setThreshold(1e-9);
            step -= solver.solve(VecX(loops * step + open));
          }
          Step(scale.asDiagonal() * step, &x);
        }
        evaluate();  // q
      }
      evaluate();
      for (size_t k = 0; k < unknown.size(); ++k) {
        U.col(static_cast<Eigen::Index>(k)) = A.col(unknown[k]);
      }
      Eigen::Index rank = 0;
      if (U.size() > 0) {
        Eigen::ColPivHouseholderQR<MatX> qr(U);
        qr.setThreshold(1e-8);
        rank = qr.rank();
      }
      if (rank < best_rank) continue;
      best_rank = rank;
      best = U;
    }
    if (best_rank < static_cast<Eigen::Index>(unknown.size())) {
      return silent ? false
                    : Refuse(fmt::format("the coordinates determine {} of {} rates of the joints",
                                         best_rank, unknown.size()),
                             "choose as many independent coordinates as degrees of freedom");
    }
    const std::vector<int> chosen = IndependentRows(best);
    std::vector<std::vector<int>> used(chosen.size());  // per row: unknowns in it
    for (size_t i = 0; i < chosen.size(); ++i) {
      for (size_t k = 0; k < unknown.size(); ++k) {
        if (of_all(chosen[i], unknown[k]) > 1e-14) used[i].push_back(static_cast<int>(k));
      }
    }
    const std::vector<int> row_of = Match(used, best, chosen);
    for (const std::vector<int>& part : StrongParts(used, row_of)) {
      ClosureBlock block;
      std::vector<int> block_rows;
      for (const int k : part) {
        block.rates.push_back(unknown[static_cast<size_t>(k)]);
        block_rows.push_back(chosen[static_cast<size_t>(row_of[static_cast<size_t>(k)])]);
      }
      for (Eigen::Index k = 0; k < n; ++k) {
        if (std::ranges::find(block.rates, static_cast<int>(k)) != block.rates.end()) continue;
        const bool in = std::ranges::any_of(block_rows, [&](int row) {
          return !made_->graph.IsZero(J[static_cast<size_t>(k)][static_cast<size_t>(row)]) &&
                 of_all(row, k) > 1e-14;
        });
        if (in) block.known.push_back(static_cast<int>(k));
      }
      std::vector<Expr> rates;
      for (const int row : block_rows) {
        const auto i = static_cast<size_t>(row);
        block.residual.push_back(rows[i].residual);
        block.commanded.push_back(rows[i].coordinate);
        block.weight.push_back(rows[i].weight);
        rates.push_back(rows[i].rate);
        for (const int k : block.rates) block.columns.push_back(J[static_cast<size_t>(k)][i]);
        for (const int k : block.known) block.others.push_back(J[static_cast<size_t>(k)][i]);
      }
      block.bias = Bias(rates);
      closure->blocks.push_back(std::move(block));
    }
    return true;
  }

  // As many as there are columns; clear ones first.
  static std::vector<int> IndependentRows(const MatX& U) {
    std::vector<int> chosen;
    MatX basis(U.cols(), U.cols());
    Eigen::Index have = 0;
    for (const double clear : {0.2, 0.02, 1e-3, 1e-5, 1e-8}) {
      for (Eigen::Index i = 0; i < U.rows() && have < U.cols(); ++i) {
        if (std::ranges::find(chosen, static_cast<int>(i)) != chosen.end()) continue;
        VecX row = U.row(i).transpose();
        const double size = row.norm();
        if (size == 0.0) continue;
        for (int pass = 0; pass < 2; ++pass) {
          row -= basis.leftCols(have) * (basis.leftCols(have).transpose() * row);
        }
        if (row.norm() <= clear * size) continue;
        basis.col(have++) = row.normalized();
        chosen.push_back(static_cast<int>(i));
      }
    }
    MBV_DEMAND(have == U.cols(), have);
    return chosen;
  }

  // Per unknown: its row; by augmenting ways, large entries first.
  static std::vector<int> Match(std::vector<std::vector<int>> used, const MatX& U,
                                const std::vector<int>& chosen) {
    for (size_t i = 0; i < used.size(); ++i) {
      std::ranges::stable_sort(used[i], [&](int a, int b) {
        return std::abs(U(chosen[i], a)) > std::abs(U(chosen[i], b));
      });
    }
    std::vector<int> row_of(used.size(), -1);
    for (size_t i = 0; i < used.size(); ++i) {
      std::vector<bool> seen(used.size(), false);
      const std::function<bool(size_t)> place = [&](size_t row) {
        for (const int k : used[row]) {
          if (seen[static_cast<size_t>(k)]) continue;
          seen[static_cast<size_t>(k)] = true;
          int& other = row_of[static_cast<size_t>(k)];
          if (other >= 0 && !place(static_cast<size_t>(other))) continue;
          other = static_cast<int>(row);
          return true;
        }
        return false;
      };
      MBV_DEMAND(place(i), i);
    }
    return row_of;
  }

  // Unknowns that need each other, in the order in which they can be solved [Tarjan 1972].
  static std::vector<std::vector<int>> StrongParts(const std::vector<std::vector<int>>& used,
                                                   const std::vector<int>& row_of) {
    const size_t n = row_of.size();
    std::vector<int> number(n, -1), low(n, 0), stack;
    std::vector<bool> on_stack(n, false);
    std::vector<std::vector<int>> parts;
    int next = 0;
    const std::function<void(int)> visit = [&](int k) {
      const auto i = static_cast<size_t>(k);
      number[i] = low[i] = next++;
      stack.push_back(k);
      on_stack[i] = true;
      for (const int other : used[static_cast<size_t>(row_of[i])]) {
        const auto o = static_cast<size_t>(other);
        if (number[o] < 0) visit(other);
        if (on_stack[o]) low[i] = std::min(low[i], low[o]);
      }
      if (low[i] != number[i]) return;
      std::vector<int> part;
      for (int top = -1; top != k;) {
        top = stack.back();
        stack.pop_back();
        on_stack[static_cast<size_t>(top)] = false;
        part.push_back(top);
      }
      std::ranges::sort(part);
      parts.push_back(std::move(part));
    };
    for (size_t k = 0; k < n; ++k) {
      if (number[k] < 0) visit(static_cast<int>(k));
    }
    return parts;
  }

  void AddActuators(const std::vector<NamedCoordinate>& actuators) {
    for (const NamedCoordinate& at : actuators) {
      ActuatorFormula actuator{.name = at.name, .unit = CoordinateUnit(m_, at.coordinate)};
      actuator.value = FormulaOf(at.coordinate).value;
      const Expr rate = Rate(actuator.value);
      for (size_t k = 0; k < made_->rates.size(); ++k) {
        const Expr factor = Coefficients({rate}, k)[0];
        if (!made_->graph.IsZero(factor)) actuator.rates.emplace_back(static_cast<int>(k), factor);
      }
      actuator.bias = Bias({rate})[0];
      made_->actuators.push_back(std::move(actuator));
    }
  }

  void Unsupported(const std::string& why) {
    if (made_->no_forces.empty()) made_->no_forces = why;
  }

  // τ of (2).
  void AddForces() {
    const size_t bodies = m_.bodies.size();
    std::vector<Vec3E> alpha(bodies, Vec3E::Zero()), a(bodies, Vec3E::Zero()),
        f(bodies, Vec3E::Zero()), moment(bodies, Vec3E::Zero()), g(bodies, Vec3E::Zero());
    std::vector<Vec3E> v_rel(bodies), w_rel(bodies);  // of O seen from I
    a[0] = -Length3(m_.gravity_W);                    // weight as if the world fell upwards
    g[0] = Length3(m_.gravity_W);
    for (size_t t = 0; t < m_.tree_joints.size(); ++t) {
      const auto in = static_cast<size_t>(InboardBody(m_, t));
      const auto out = static_cast<size_t>(OutboardBody(m_, t));
      const PoseE& X = X_IO_[out];
      const Mat3E R = X.R.transpose();
      const Vec3E v = Rate(X.p), w = R * omega_[in];
      alpha[out] = R * alpha[in] + Cross(w, spin_[out]) + Rate(spin_[out]);
      a[out] = R * (a[in] + Cross(alpha[in], X.p) + Cross(omega_[in], Cross(omega_[in], X.p)) +
                    Cross(omega_[in], v) * Expr(2.0) + Rate(v));
      g[out] = R * g[in];
      v_rel[out] = R * v;
      w_rel[out] = spin_[out];
    }
    for (size_t b = 1; b < bodies; ++b) {
      const Body& body = m_.bodies[b];
      if (body.mass == 0.0 && body.I_Bcm_B.isZero(0.0)) continue;
      const Vec3E c = Length3(body.p_BoBcm_B);
      Mat3E I;
      for (int i = 0; i < 9; ++i) I(i) = body.I_Bcm_B(i);
      const Vec3E& w = omega_[b];
      f[b] = (a[b] + Cross(alpha[b], c) + Cross(w, Cross(w, c))) * Expr(body.mass);
      f[b] += g[b] * Expr(body.gravity_compensation * body.mass);
      moment[b] = I * alpha[b] + Cross(w, I * w) + Cross(c, f[b]);
    }
    const size_t n = made_->rates.size();
    std::vector<Expr> along(n, Expr(0.0));  // forces of elements along u
    AddElements(alpha, &along, &moment);
    for (size_t t = m_.tree_joints.size(); t-- > 0;) {
      const auto in = static_cast<size_t>(InboardBody(m_, t));
      const auto out = static_cast<size_t>(OutboardBody(m_, t));
      const PoseE& X = X_IO_[out];
      for (const int k : rate_[static_cast<size_t>(m_.tree_joints[t])]) {
        if (k < 0) continue;
        const Vec3E v = Column(v_rel[out], k), w = Column(w_rel[out], k);
        along[static_cast<size_t>(k)] += v.dot(f[out]) + w.dot(moment[out]);
      }
      const Vec3E force = X.R * f[out];
      f[in] += force;
      moment[in] += (X.R * moment[out] + Cross(X.p, force)).eval();
    }
    if (made_->no_forces.empty()) made_->forces = along;
  }
  [[nodiscard]] Vec3E Column(const Vec3E& of, int k) {
    const std::vector<Expr> at = Coefficients({of.x(), of.y(), of.z()}, static_cast<size_t>(k));
    return {at[0], at[1], at[2]};
  }

  // Force −F along a coordinate, as RequiredWrenches() counts: what is needed beyond it.
  void Take(Expr rate, Expr force, std::vector<Expr>* along) {
    for (size_t k = 0; k < along->size(); ++k) {
      const Expr factor = Coefficients({rate}, k)[0];
      if (!made_->graph.IsZero(factor)) (*along)[k] -= factor * force;
    }
  }

  void AddElements(const std::vector<Vec3E>& alpha, std::vector<Expr>* along,
                   std::vector<Vec3E>* moment) {
    for (const Drive& drive : m_.drives) {
      if (drive.compensates_gravity && HasGravityCompensation(m_)) {
        Unsupported("drive '" + drive.name + "' compensates gravity");
      }
    }
    for (const ForceElement& element : m_.elements) {
      if (element.bushing >= 0) {
        Unsupported("there is a bushing");
        continue;
      }
      if (element.spring >= 0 || std::holds_alternative<StopLaw>(element.law) ||
          std::holds_alternative<CurveLaw>(element.law) ||
          std::holds_alternative<CurvesLaw>(element.law) ||
          std::holds_alternative<ExpressionLaw>(element.law)) {
        Unsupported("there is a " + Described(m_, element));
        continue;
      }
      const Coordinate at =
          element.joint >= 0
              ? Coordinate{Coordinate::Kind::kJoint, element.joint, element.coordinate}
              : Coordinate{Coordinate::Kind::kDrive, element.drive, 0};
      Expr q, v;
      if (ActsOnBall(m_, element)) {  // no position; rates about the child's axes
        const int k = rate_[static_cast<size_t>(element.joint)].empty()
                          ? kNotDirect
                          : rate_[static_cast<size_t>(element.joint)]
                                 [static_cast<size_t>(element.coordinate)];
        if (k < 0) {
          Unsupported(Described(m_, element) + " acts on a spherical joint that closes a loop");
          continue;
        }
        v = made_->u[static_cast<size_t>(k)];
      } else {
        q = FormulaOf(at).value;
        v = Rate(q);
      }
      const Expr dv = Rate(v);
      if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
        Take(v, -(Expr(damping->damping) * v), along);
      } else if (const auto* spring = std::get_if<SpringLaw>(&element.law)) {
        Expr sum(0.0);
        const Expr x = q - Expr(spring->free);
        for (size_t i = spring->polynomial.size(); i-- > 0;)
          sum = (sum + spring->polynomial[i]) * x;
        Take(v, -(Expr(spring->preload) + sum), along);
      } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
        Expr force = -(Expr(rotor->reflected()) * dv);
        if (rotor->carrier && rotor->carrier->body > 0) {
          const auto b = static_cast<size_t>(rotor->carrier->body);
          const Vec3E axis = Constant3(rotor->carrier->axis_B);
          const Expr h(rotor->inertia * rotor->ratio);
          force -= h * axis.dot(alpha[b]);
          (*moment)[b] += (axis * (h * dv) + Cross(omega_[b], axis) * (h * v)).eval();
        }
        Take(v, force, along);
      } else if (const auto* friction = std::get_if<FrictionLaw>(&element.law)) {
        if (friction->by_load()) Unsupported(Described(m_, element) + " grows with its load");
        if (friction->resists != 0) Unsupported(Described(m_, element) + " resists one way only");
        const Expr direction = made_->graph.Make(FormulaOp::kDirection, v,
                                                 Expr(RestRate(m_, element, Motion().duration_s)));
        Expr size(friction->coulomb);
        if (friction->stribeck_rate != 0.0) {
          const Expr slowness = v / Expr(friction->stribeck_rate);
          size += Expr(friction->breakaway - friction->coulomb) * exp(-(slowness * slowness));
        }
        Take(v, -(direction * size), along);
      }
    }
    for (const SpringDamper& spring : m_.springs) {
      Pose from = Pose::Identity(), to = Pose::Identity();
      from.translation() = spring.p_from;
      to.translation() = spring.p_to;
      const PoseE X = Between(spring.body_from, from, spring.body_to, to);
      const Expr length = sqrt(X.p.dot(X.p));
      Take(Rate(length),
           -(Expr(spring.stiffness) * (length - Expr(spring.free_length_m)) +
             Expr(spring.damping) * Rate(length)),
           along);
    }
  }

  Mechanism m_;  ///< without idle spins, with joints of outputs, and the tree for them
  Diagnostics& diagnostics_;
  std::unique_ptr<MechanismFormulas> made_;
  int own_joints_ = -1;
  std::map<int, int> output_joints_;      // by output
  std::vector<std::vector<Expr>> value_;  // per joint: coordinates, a ball's quaternion
  std::vector<std::vector<int>> rate_;    // per joint and coordinate: entry of u, or kHeld
  std::vector<std::pair<Expr, Expr>> dx_;
  std::vector<int> inboard_, depth_;  // per body
  std::vector<PoseE> X_IO_;           // per body: in the inboard body
  std::vector<Vec3E> spin_, omega_;   // per body, own axes: seen from the inboard body, the world
  std::vector<RowFormula> rows_;
};

}  // namespace

std::unique_ptr<MechanismFormulas> MakeFormulas(const Mechanism& mechanism,
                                                const std::vector<NamedCoordinate>& coordinates,
                                                const std::vector<NamedCoordinate>& held,
                                                const std::vector<NamedCoordinate>& actuators,
                                                Diagnostics* diagnostics) {
  return FormulaMaker(mechanism, diagnostics).Make(coordinates, held, actuators);
}

}  // namespace mbv
