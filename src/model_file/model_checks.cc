// Masses, the graph of joints, ranges at home, and the isostatic rule.
#include "model_file/model_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "input/units.h"
#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "kinematics/tilted_axis.h"
#include "mechanism/impossible_inertia.h"
#include "mechanism/reach.h"

namespace mbv::internal {
namespace {

// Beside larger ones, usual masses and lengths are lost in a sum.
constexpr double kLargestMass_kg = 1e15;
constexpr double kLargestLength_m = 1e12;

struct Reason {
  std::string text;  // empty: nothing wrong
  std::string hint;
};

// Why no distribution of mass has this mass and inertia.
Reason WhyNotPhysical(const Body& body) {
  if (body.mass == 0.0) {
    if (body.I_Bcm_B.isZero(0.0)) return {};
    return {"an inertia without mass",
            "give the mass, or leave both out for a massless connecting piece"};
  }
  if (body.I_Bcm_B.isZero(0.0)) {
    return {fmt::format("mass = {} without inertia", body.mass),
            "give the inertia about the centre of mass"};
  }
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B).eigenvalues();
  if (!(principal[0] > 0.0)) return {PrincipalInertiaText(principal) + " violate I > 0", ""};
  return {};
}

Reason WhyTooLarge(const Body& body) {
  if (body.mass > kLargestMass_kg) {
    return {fmt::format("mass = {} violates mass <= {:g} kg", body.mass, kLargestMass_kg), ""};
  }
  const auto far = [](const Vec3& p) {
    return p.allFinite() && p.cwiseAbs().maxCoeff() > kLargestLength_m;
  };
  const std::string hint = fmt::format("within {:g} m, lengths are in metres", kLargestLength_m);
  if (far(body.p_BoBcm_B)) return {"its centre of mass is too far away", hint};
  for (const NamedFrame& frame : body.frames) {
    if (far(frame.X_BF.translation())) {
      return {fmt::format("its frame '{}' is too far away", frame.name), hint};
    }
  }
  return {};
}

// Marks what `joints` connect to the world.
std::vector<bool> ConnectedBodies(const Mechanism& mechanism) {
  std::vector<bool> connected(mechanism.bodies.size(), false);
  connected[0] = true;
  for (bool grown = true; grown;) {
    grown = false;
    for (const Joint& joint : mechanism.joints) {
      if (connected[joint.parent] == connected[joint.child]) continue;
      connected[joint.parent] = connected[joint.child] = grown = true;
    }
  }
  return connected;
}

void ReportTree(const Mechanism& mechanism, const SpanningTreeResult& tree, ModelReport* report) {
  const std::vector<bool> connected = ConnectedBodies(mechanism);
  for (const int body : tree.unconnected_bodies) {
    const Place at = report->places().bodies[body].place;
    const std::string& name = mechanism.bodies[body].name;
    if (connected[body]) {
      report->At(at, Severity::kError,
                 fmt::format("body '{}' is cut off from the world: every chain of joints to it "
                             "has a joint with closure: true",
                             name),
                 "a body that hangs on closures only needs a free joint to the world");
    } else {
      report->At(at, Severity::kError,
                 fmt::format("no chain of joints connects body '{}' to the world", name),
                 "a floating body needs a free joint");
    }
  }
  for (const int joint : tree.hints_broken) {
    report->AtJoint(
        joint, Severity::kError,
        fmt::format("joint '{}' has closure: false, but all joints of its loop have, and "
                    "one must be cut",
                    mechanism.joints[joint].name));
  }
}

}  // namespace

void CheckMasses(const Mechanism& mechanism, bool impossible_allowed, ModelReport* report) {
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    if (!std::isfinite(body.mass)) continue;  // already reported
    Reason reason = WhyTooLarge(body);
    if (reason.text.empty()) reason = WhyNotPhysical(body);
    if (!reason.text.empty()) {
      report->AtBody(mechanism, b, Severity::kError, reason.text, reason.hint);
      continue;
    }
    const std::string violation = TriangleViolation(body);
    if (violation.empty()) continue;
    if (impossible_allowed) {
      report->AtBody(
          mechanism, b, Severity::kWarning,
          report->Allow(fmt::format("impossible inertia of {}: {}", body.name, violation)), "");
    } else {
      report->AtBody(mechanism, b, Severity::kError, violation,
                     "no distribution of mass has such inertias; look for exchanged or missing "
                     "digits, and that they are about the centre of mass; `allow: "
                     "impossible_inertia` in the model takes them as they are");
    }
  }
}

bool CheckTree(const ClosureHints& hints, Mechanism* mechanism, ModelReport* report) {
  const SpanningTreeResult tree = BuildSpanningTree(mechanism, hints);
  ReportTree(*mechanism, tree, report);
  return tree.ok();
}

void CheckAxes(const Mechanism& mechanism, bool closed_at_home, ModelReport* report) {
  const auto tilted = FindTiltedAxis(mechanism, closed_at_home);
  if (!tilted) return;
  const Joint &joint = mechanism.joints[tilted->joint], &other = mechanism.joints[tilted->other];
  const bool like = (joint.kind == JointKind::kPrismatic) == (other.kind == JointKind::kPrismatic);
  const std::string text = fmt::format(
      "the axis of joint '{}' is tilted by {:.3g} deg against that of joint '{}' on {}: with {} "
      "axes "
      "{}",
      joint.name, tilted->angle_rad / FromDegrees(1.0), other.name,
      mechanism.bodies[tilted->body].name, like ? "parallel" : "perpendicular",
      closed_at_home ? fmt::format("the mechanism has {} freedoms instead of {}",
                                   tilted->freedoms_aligned, tilted->freedoms)
                     : "the loops close");
  const std::string hint = "look at its axis and at the rotations of its two frames";
  if (const Finding* urdf = report->InUrdf(mechanism, tilted->joint); urdf != nullptr) {
    report->AddOther({Severity::kWarning, urdf->file, urdf->line, urdf->column, text, hint});
  } else {
    report->AtJoint(tilted->joint, Severity::kWarning, text, hint);
  }
}

void CheckHome(const Mechanism& mechanism, ModelReport* report) {
  CheckAxes(mechanism, true, report);
  const double length = CharacteristicLength(mechanism);
  const auto outside = [&](double value, const CoordinateRange& range, bool is_length) {
    const double slack = 1e-9 * (is_length ? length : 1.0);
    return value < range.lower - slack || value > range.upper + slack;
  };
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    for (int k = 0; k < FreedomsOf(joint.kind); ++k) {
      if (report->places().joints[j].line == 0 ||
          !outside(joint.home[k], joint.range[k], IsLength(joint.kind, k))) {
        continue;
      }
      report->AtJoint(
          j, Severity::kWarning,
          fmt::format("joint '{}' is at {:.6g} at home, its range is {:.6g} … {:.6g}", joint.name,
                      joint.home[k], joint.range[k].lower, joint.range[k].upper));
    }
  }
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  for (const Drive& drive : mechanism.drives) {
    const double value = DriveRow(mechanism, drive, states).value;
    const Place at = report->places().signals.Of(drive.name);
    if (std::holds_alternative<DistanceDrive>(drive.kind) && value < 1e-9 * length) {
      report->At(at, Severity::kError,
                 fmt::format("drive '{}': its two ends are the same point at home", drive.name));
    } else if (outside(value, drive.range, PositionUnit(mechanism, drive) == "m")) {
      report->At(at, Severity::kWarning,
                 fmt::format("drive '{}' is at {:.6g} at home, its range is {:.6g} … {:.6g}",
                             drive.name, value, drive.range.lower, drive.range.upper));
    }
  }
}

void CheckIsostaticRule(const Mechanism& mechanism, ModelReport* report) {
  Mechanism balls = mechanism;
  std::optional<size_t> last;
  for (size_t j = 0; j < balls.joints.size(); ++j) {
    Joint& joint = balls.joints[j];
    if (!joint.transmits_force_only || joint.kind == JointKind::kSpherical) continue;
    joint.kind = JointKind::kSpherical;
    last = j;
  }
  if (!last) return;
  balls.drives.clear();
  balls.prescribed.clear();
  Mechanism passive = mechanism;
  passive.drives.clear();
  passive.prescribed.clear();
  const int freedoms = CountAllFreedoms(passive);
  const int as_balls = CountAllFreedoms(balls);
  if (freedoms == as_balls) return;
  report->AtJoint(*last, Severity::kError,
                  fmt::format("transmits: force changes the mechanism: {} freedoms instead of {}",
                              as_balls, freedoms),
                  "only a redundant constraint can be left out of the reactions");
}

}  // namespace mbv::internal
