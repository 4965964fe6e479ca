#include "mechanism/mechanism.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/demand.h"
#include "math/trace.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

// Straight lines between the points; the first torque below them, nothing beyond them.
double OnCurve(const std::vector<CurvePoint>& curve, double speed) {
  if (speed <= curve.front().speed) return curve.front().torque;
  if (speed > curve.back().speed) return 0.0;
  const auto above =
      std::lower_bound(curve.begin(), curve.end(), speed,
                       [](const CurvePoint& point, double x) { return point.speed < x; });
  const CurvePoint &a = *(above - 1), &b = *above;
  return a.torque + (b.torque - a.torque) * (speed - a.speed) / (b.speed - a.speed);
}

double TorqueAt(const std::vector<CurvePoint>& curve, double constant, double highest,
                double speed) {
  if (speed > highest) return 0.0;
  return curve.empty() ? constant : OnCurve(curve, speed);
}

}  // namespace

double ContinuousTorque(const Motor& motor, double speed) {
  return TorqueAt(motor.continuous_curve, motor.continuous, motor.max_speed, std::abs(speed));
}

double PeakTorque(const Motor& motor, double speed) {
  return TorqueAt(motor.peak_curve, motor.peak, motor.max_speed, std::abs(speed));
}

bool HasSides(const Motor& motor) {
  return std::isfinite(motor.least) || std::isfinite(motor.most);
}

double PeakShare(const Motor& motor, double torque, double speed) {
  const auto share = [](double used, double limit) {
    if (used <= 0.0) return 0.0;
    return limit > 0.0 ? used / limit : std::numeric_limits<double>::infinity();
  };
  const double of_both = share(std::abs(torque), PeakTorque(motor, speed));
  if (torque < motor.least && motor.least > 0.0) return share(1.0, 0.0);
  if (torque > motor.most && motor.most < 0.0) return share(1.0, 0.0);
  return std::max({of_both, share(torque, motor.most), share(-torque, -motor.least)});
}

namespace {

template <typename T>
int FindNamed(const std::vector<T>& items, const std::string& name) {
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

bool IsTranslation(const Mechanism& mechanism, const Drive& drive) {
  const auto* joint_drive = std::get_if<JointDrive>(&drive.kind);
  if (joint_drive == nullptr) return true;
  return IsLength(mechanism.joints[joint_drive->joint].kind, joint_drive->coordinate);
}

}  // namespace

int Mechanism::FindBody(const std::string& n) const { return FindNamed(bodies, n); }
int Mechanism::FindJoint(const std::string& n) const { return FindNamed(joints, n); }
int Mechanism::FindDrive(const std::string& n) const { return FindNamed(drives, n); }
int Mechanism::FindOutput(const std::string& n) const { return FindNamed(outputs, n); }

const NamedFrame* Mechanism::FindFrame(int body, const std::string& frame_name) const {
  const auto& frames = bodies[body].frames;
  const int i = FindNamed(frames, frame_name);
  return i < 0 ? nullptr : &frames[i];
}

double Mechanism::ParameterValue(const std::string& parameter_name) const {
  const int i = FindNamed(parameters, parameter_name);
  MBV_DEMAND(i >= 0, name + " has no parameter '" + parameter_name + "'");
  return parameters[i].value;
}

bool Mechanism::HasParameter(const std::string& parameter_name) const {
  return FindNamed(parameters, parameter_name) >= 0;
}

std::string PositionUnit(const Mechanism& mechanism, const Drive& drive) {
  return IsTranslation(mechanism, drive) ? "m" : "rad";
}

std::string ForceUnit(const Mechanism& mechanism, const Drive& drive) {
  return IsTranslation(mechanism, drive) ? "N" : "N m";
}

// The upper and the lower chain, each of left turns only [Andrew 1979].
std::vector<Eigen::Vector2d> ConvexHull(std::vector<Eigen::Vector2d> points) {
  const auto turns_left = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                             const Eigen::Vector2d& c) {
    const Eigen::Vector2d u = b - a, v = c - b;
    return u.x() * v.y() - u.y() * v.x() > 0.0;
  };
  std::ranges::sort(points, [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Eigen::Vector2d> hull;
  if (points.empty()) return hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t first = hull.size();
    for (const Eigen::Vector2d& p : points) {
      while (hull.size() >= first + 2 && !turns_left(hull[hull.size() - 2], hull.back(), p)) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();  // the other chain begins with it
    std::ranges::reverse(points);
  }
  return hull;
}

const char* WordOf(Contact::Kind kind) {
  static constexpr std::array<const char*, 3> kWords = {"point", "line", "sole"};
  return kWords.at(static_cast<size_t>(kind));
}

const char* WordOf(const ForceElement& element) {
  static constexpr std::array<const char*, std::variant_size_v<decltype(element.law)>> kWords = {
      "damping", "spring", "rotor", "friction", "stop", "curve", "curve", "expression"};
  return kWords.at(element.law.index());
}

bool ActsOnLength(const Mechanism& mechanism, const ForceElement& element) {
  if (element.bushing >= 0) return element.coordinate < 3;
  return element.drive >= 0 || element.spring >= 0 ||
         IsLength(mechanism.joints[static_cast<size_t>(element.joint)].kind, element.coordinate);
}

bool ActsOnBall(const Mechanism& mechanism, const ForceElement& element) {
  return element.joint >= 0 &&
         IsOfBall(mechanism.joints[static_cast<size_t>(element.joint)].kind, element.coordinate);
}

void AddOfBall(const ForceElement& element, JointKind kind, std::vector<ForceElement>* elements) {
  for (int axis = 0; axis < 3; ++axis) {
    elements->push_back(element);
    elements->back().name += std::array{".x", ".y", ".z"}.at(static_cast<size_t>(axis));
    elements->back().coordinate = FirstOfBall(kind) + axis;
  }
}

double RestRate(const Mechanism& mechanism, const ForceElement& element, double duration_s) {
  constexpr double kRest = 1e-6;
  return kRest * (ActsOnLength(mechanism, element) ? CharacteristicLength(mechanism) : 1.0) /
         duration_s;
}

bool IsGyroscopic(const ForceElement& element) {
  const auto* rotor = std::get_if<RotorLaw>(&element.law);
  return rotor != nullptr && rotor->carrier && rotor->inertia > 0.0;
}

std::string BushingWord(const ForceElement& element) {
  static constexpr std::array<const char*, 6> kCoordinates = {"x", "y", "z", "rx", "ry", "rz"};
  return (std::holds_alternative<DampingLaw>(element.law) ? "c" : "k") +
         std::string(kCoordinates.at(static_cast<size_t>(element.coordinate)));
}

bool HasFriction(const ForceElement& element) {
  const auto* friction = std::get_if<FrictionLaw>(&element.law);
  return friction != nullptr && (friction->breakaway > 0.0 || friction->by_load());
}

namespace {

// Free, and beyond each end: by (1), with c δ̇ cut to e, and without force.
int PieceOf(const StopLaw& law, double q, double v) {
  const bool above = q > law.upper;
  if (!above && !(q < law.lower)) return 0;
  const double depth = above ? q - law.upper : law.lower - q, rate = above ? v : -v;
  const int first = above ? 1 : 4;
  if (law.dissipation > 0.0) return first + (1.0 + law.dissipation * rate < 0.0 ? 2 : 0);
  const double e = law.stiffness * std::pow(depth, law.exponent);
  return first + (law.damping * rate > e ? 1 : law.damping * rate < -e ? 2 : 0);
}
bool IsCorner(const CurveLaw::Knot& knot) { return knot.slope_before != knot.slope_after; }
int PieceOf(const CurveLaw& law, double q, double v) {
  const double x = law.of_rate ? v : q;
  return static_cast<int>(std::ranges::count_if(
      law.knots, [x](const CurveLaw::Knot& knot) { return IsCorner(knot) && knot.at < x; }));
}
// Corners lie at rates, and where one of the curves has one.
int PieceOf(const CurvesLaw& law, double q, double v) {
  const auto knots = static_cast<int>(law.curves.front().knots.size());
  int before = 0;
  for (int k = 0; k < knots; ++k) {
    const auto is_corner = [k](const CurveLaw& curve) {
      return IsCorner(curve.knots[static_cast<size_t>(k)]);
    };
    const double at = law.curves.front().knots[static_cast<size_t>(k)].at;
    before += at < q && std::ranges::any_of(law.curves, is_corner) ? 1 : 0;
  }
  const auto slower = std::ranges::count_if(law.rates, [v](double rate) { return rate < v; });
  const int strip =
      law.held ? static_cast<int>(slower)
               : std::clamp(static_cast<int>(slower), 1, static_cast<int>(law.rates.size()) - 1);
  return strip * (knots + 1) + before;
}
int PieceOf(const ExpressionLaw& law, double q, double v) {
  return law.branch ? law.branch(q, v) : 0;
}
template <typename Law>
int PieceOf(const Law& /*law*/, double /*q*/, double /*v*/) {
  return 0;
}

}  // namespace

int PieceOf(const ForceElement& element, double position, double rate) {
  return std::visit([&](const auto& law) { return PieceOf(law, position, rate); }, element.law);
}

bool HasCorners(const ForceElement& element) {
  if (const auto* curve = std::get_if<CurveLaw>(&element.law)) {
    return std::ranges::any_of(curve->knots, IsCorner);
  }
  if (const auto* expression = std::get_if<ExpressionLaw>(&element.law)) {
    return static_cast<bool>(expression->branch);
  }
  return std::holds_alternative<StopLaw>(element.law) ||
         std::holds_alternative<CurvesLaw>(element.law);
}

bool IsRigidStop(const ForceElement& element) {
  const auto* stop = std::get_if<StopLaw>(&element.law);
  return stop != nullptr && stop->rigid();
}

std::string FirstFriction(const Mechanism& mechanism) {
  for (const ForceElement& element : mechanism.elements) {
    if (HasFriction(element)) return element.name;
  }
  return "";
}

bool HasGravityCompensation(const Mechanism& mechanism) {
  return std::ranges::any_of(mechanism.bodies,
                             [](const Body& body) { return body.gravity_compensation != 0.0; });
}

std::string Described(const Mechanism& mechanism, const ForceElement& element) {
  const std::string word = IsGyroscopic(element) ? "gyroscopic rotor" : WordOf(element);
  if (element.bushing >= 0) {
    return BushingWord(element) + " of bushing '" +
           mechanism.bushings[static_cast<size_t>(element.bushing)].name + "'";
  }
  if (element.drive >= 0) {
    return word + " of drive '" + mechanism.drives[static_cast<size_t>(element.drive)].name + "'";
  }
  if (element.spring >= 0) {
    return word + " along '" + mechanism.springs[static_cast<size_t>(element.spring)].name + "'";
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  if (ActsOnBall(mechanism, element))
    return word + " of the rotation of joint '" + joint.name + "'";
  const std::string of =
      DofsOf(joint.kind) == 1 ? "" : "coordinate " + std::to_string(element.coordinate) + " of ";
  return word + " of " + of + "joint '" + joint.name + "'";
}

SignalSheet SheetOf(const Mechanism& mechanism, const Drive& drive) {
  SignalSheet sheet{.signal = ChannelName(Quantity::kForce, drive.name),
                    .acts_on = {},
                    .exerted_by = {},
                    .frame = {},
                    .positive = {},
                    .unit = ForceUnit(mechanism, drive)};
  if (const auto* distance = std::get_if<DistanceDrive>(&drive.kind)) {
    sheet.acts_on = mechanism.bodies[distance->body_to].name + " (and, opposite, on " +
                    mechanism.bodies[distance->body_from].name + ")";
    sheet.exerted_by = "the drive leg " + drive.name;
    sheet.frame = "along the line from the ball on " + mechanism.bodies[distance->body_from].name +
                  " to the ball on " + mechanism.bodies[distance->body_to].name;
    sheet.positive = "push: the leg is in compression and drives its ends apart";
    return sheet;
  }
  const Joint& joint = mechanism.joints[std::get<JointDrive>(drive.kind).joint];
  const bool translation = IsTranslation(mechanism, drive);
  sheet.acts_on = mechanism.bodies[joint.child].name;
  sheet.exerted_by = mechanism.bodies[joint.parent].name + " through the drive of " + joint.name;
  sheet.frame = std::string(translation ? "along" : "about") + " the axis of " + joint.name +
                ", positive along the axis given on " + mechanism.bodies[joint.parent].name;
  sheet.positive =
      translation ? "push: towards a larger coordinate" : "turns the child towards a larger angle";
  return sheet;
}

SignalSheet SheetOf(const Mechanism& mechanism, const Joint& joint) {
  return {.signal = ChannelName(Quantity::kReaction, joint.name),
          .acts_on = mechanism.bodies[joint.child].name,
          .exerted_by = mechanism.bodies[joint.parent].name + " through " + joint.name +
                        " (drive forces excluded)",
          .frame = "joint frame on " + mechanism.bodies[joint.parent].name +
                   ", about the joint frame's origin on " + mechanism.bodies[joint.child].name,
          .positive = "along the positive axes of that frame",
          .unit = "N, N m"};
}

}  // namespace mbv
