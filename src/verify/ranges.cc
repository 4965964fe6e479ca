#include "verify/ranges.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "kinematics/home.h"
#include "math/spatial.h"

namespace mbv {
namespace {

// A coordinate that touches its limit within roundoff is inside.
constexpr double kTouch = 1e-9;

bool IsBounded(const CoordinateRange& range) {
  return std::isfinite(range.lower) || std::isfinite(range.upper);
}

// Keeps the worst violation of one coordinate.
void Visit(double value, double time_s, RangeViolation* worst) {
  const double amount = std::max(worst->range.lower - value, value - worst->range.upper);
  if (!(amount > std::max(worst->amount, kTouch))) return;
  worst->amount = amount;
  worst->value = value;
  worst->time_s = time_s;
}

constexpr int kRotation = -1;  // in the place of a coordinate

// |log R_FM|
double RotationOf(const Joint& joint, const std::vector<Pose>& X_WB) {
  const Mat3 R_WF = X_WB[static_cast<size_t>(joint.parent)].linear() * joint.X_PF.linear();
  const Mat3 R_WM = X_WB[static_cast<size_t>(joint.child)].linear() * joint.X_CM.linear();
  return LogRotation(R_WF.transpose() * R_WM).norm();
}

const char* UnitOf(const Joint& joint, int coordinate) {
  return IsLength(joint.kind, coordinate) ? "m" : "rad";
}

std::string JointText(const Joint& joint, int coordinate) {
  if (DofsOf(joint.kind) == 1) return "joint " + joint.name;
  if (coordinate == kRotation) return fmt::format("joint {} (angle of rotation)", joint.name);
  return fmt::format("joint {} (coordinate {})", joint.name, coordinate + 1);
}

}  // namespace

std::string RangeViolation::Text() const {
  return fmt::format(
      "at t = {:.6g} s {} needs {:.6g} {}, its range is {:.6g} … {:.6g} {} ({:.3g} {} beyond)",
      time_s, what, value, unit, range.lower, range.upper, unit, amount, unit);
}

std::vector<RangeViolation> DriveViolations(const Mechanism& mechanism, const Trace& trace) {
  std::vector<RangeViolation> violations;
  for (const Drive& drive : mechanism.drives) {
    if (!IsBounded(drive.range)) continue;
    const int column = trace.Find(Quantity::kPosition, drive.name);
    if (column < 0) continue;
    RangeViolation worst{.what = {}, .range = drive.range, .unit = {}};
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      Visit(trace.values(static_cast<Eigen::Index>(i), column), trace.time_s[i], &worst);
    }
    if (!(worst.amount > 0.0)) continue;
    worst.what = "drive " + drive.name;
    worst.unit = PositionUnit(mechanism, drive);
    violations.push_back(std::move(worst));
  }
  return violations;
}

std::vector<RangeViolation> JointViolations(const Mechanism& mechanism,
                                            const std::vector<double>& time_s,
                                            const std::vector<std::vector<Pose>>& X_WB) {
  // One entry per bounded joint coordinate.
  struct Watched {
    size_t joint;
    int coordinate;
    RangeViolation worst;
  };
  std::vector<Watched> watched;
  std::vector<std::array<double, 6>> coordinates;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    coordinates.push_back(joint.home);
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      const CoordinateRange& range = joint.range[static_cast<size_t>(c)];
      if (!IsBounded(range)) continue;
      watched.push_back(
          {j, c, {.what = JointText(joint, c), .range = range, .unit = UnitOf(joint, c)}});
    }
    if (!std::isfinite(joint.max_rotation)) continue;
    watched.push_back(
        {j,
         kRotation,
         {.what = JointText(joint, kRotation), .range = {0.0, joint.max_rotation}, .unit = "rad"}});
  }
  if (watched.empty()) return {};
  for (size_t i = 0; i < X_WB.size() && i < time_s.size(); ++i) {
    if (X_WB[i].size() != mechanism.bodies.size()) break;
    coordinates = JointCoordinatesAt(mechanism, X_WB[i], coordinates);
    for (Watched& w : watched) {
      const double value = w.coordinate == kRotation
                               ? RotationOf(mechanism.joints[w.joint], X_WB[i])
                               : coordinates[w.joint][static_cast<size_t>(w.coordinate)];
      Visit(value, time_s[i], &w.worst);
    }
  }
  std::vector<RangeViolation> violations;
  for (Watched& w : watched) {
    if (w.worst.amount > 0.0) violations.push_back(std::move(w.worst));
  }
  return violations;
}

bool HasRanges(const Mechanism& mechanism) {
  return std::any_of(mechanism.joints.begin(), mechanism.joints.end(),
                     [](const Joint& joint) {
                       return std::isfinite(joint.max_rotation) ||
                              std::any_of(joint.range.begin(), joint.range.end(), IsBounded);
                     }) ||
         std::any_of(mechanism.drives.begin(), mechanism.drives.end(),
                     [](const Drive& drive) { return IsBounded(drive.range); });
}

bool IsWithinRanges(const Mechanism& mechanism, const std::vector<Pose>& X_WB) {
  std::vector<std::array<double, 6>> home;
  for (const Joint& joint : mechanism.joints) home.push_back(joint.home);
  const auto coordinates = JointCoordinatesAt(mechanism, X_WB, home);
  const auto inside = [](double value, const CoordinateRange& range) {
    return value >= range.lower - kTouch && value <= range.upper + kTouch;
  };
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    for (size_t c = 0; c < static_cast<size_t>(DofsOf(joint.kind)); ++c) {
      if (!inside(coordinates[j][c], joint.range[c])) return false;
    }
    const bool limited = std::isfinite(joint.max_rotation);
    if (limited && !inside(RotationOf(joint, X_WB), {0.0, joint.max_rotation})) return false;
  }
  return std::all_of(mechanism.drives.begin(), mechanism.drives.end(), [&](const Drive& drive) {
    if (const auto* of_joint = std::get_if<JointDrive>(&drive.kind)) {
      const auto j = static_cast<size_t>(of_joint->joint);
      return inside(coordinates[j][static_cast<size_t>(of_joint->coordinate)], drive.range);
    }
    const auto& line = std::get<DistanceDrive>(drive.kind);
    const Vec3 from = X_WB[static_cast<size_t>(line.body_from)] * line.p_from;
    const Vec3 to = X_WB[static_cast<size_t>(line.body_to)] * line.p_to;
    return inside((to - from).norm(), drive.range);
  });
}

RunSummary LimitSummary(const std::vector<RangeViolation>& violations) {
  MBV_DEMAND(!violations.empty(), violations.size());
  const RangeViolation* worst = &violations.front();
  for (const RangeViolation& v : violations) {
    if (v.amount > worst->amount) worst = &v;
  }
  return {.stop = Stop::kLimit,
          .message = "stroke violation: " + worst->Text(),
          .time_s = worst->time_s,
          .where = worst->what,
          .amount = worst->amount,
          .unit = worst->unit,
          .names_where = true,
          .states_time = true};
}

void AddFindings(const std::vector<RangeViolation>& violations, const std::string& file,
                 Severity severity, Diagnostics* findings) {
  for (const RangeViolation& violation : violations) {
    Finding finding;
    finding.severity = severity;
    finding.file = file;
    finding.message = "motion: stroke violation: " + violation.Text();
    findings->Add(std::move(finding));
  }
}

}  // namespace mbv
