// Masses, the graph of joints, ranges at home, and the isostatic rule.

#include "model_file/model_checks.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "base/text.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"
#include "mechanism/reach.h"
#include "model_file/yaml/units.h"

namespace mbv::internal {

void ModelReport::At(Place place, Severity severity, const std::string& message,
                     const std::string& hint) {
  yaml_.AddAt(severity, place.line, place.column, message, hint);
}

void ModelReport::AtBody(const Mechanism& mechanism, size_t body, Severity severity,
                         const std::string& message, const std::string& hint) {
  const BodyPlace& at = places_.bodies[body];
  if (at.place.line == 0) {
    others_.Add({severity, at.path, 0, 0,
                 fmt::format("link '{}': {}", mechanism.bodies[body].name, message), hint});
    return;
  }
  yaml_.SetNote(at.note);
  At(at.place, severity, at.path + ": " + message, hint);
  yaml_.SetNote("");
}

void ModelReport::AtJoint(size_t joint, Severity severity, const std::string& message,
                          const std::string& hint) {
  At(places_.joints[joint], severity, message, hint);
}

void ModelReport::AtJoint(size_t joint, Finding finding) {
  finding.line = places_.joints[joint].line;
  finding.column = places_.joints[joint].column;
  yaml_.Add(std::move(finding));
}

void ModelReport::AtFile(Severity severity, const std::string& message, const std::string& hint) {
  At({}, severity, message, hint);
}

const Finding* ModelReport::InUrdf(const Mechanism& mechanism, int joint) const {
  if (places_.joints[joint].line > 0) return nullptr;
  const auto found = places_.urdf_joints.find(mechanism.joints[joint].name);
  return found == places_.urdf_joints.end() ? nullptr : &found->second;
}

namespace {

// Beside larger ones, usual masses and lengths are lost in a sum.
constexpr double kLargestMass_kg = 1e15;
constexpr double kLargestLength_m = 1e12;
constexpr double kRoundoff = 1e-9;         // of principal inertias
constexpr double kLeastGyration_m = 1e-7;  // radius below which a body is a point

struct Reason {
  std::string text;  // empty: nothing wrong
  std::string hint;
};

// What no computation can take.
Reason UnusableReason(const Body& body) {
  if (body.I_Bcm_B.isZero(0.0)) return {};
  if (body.mass == 0.0) {
    return {"an inertia without mass",
            "give the mass, or leave both out for a massless connecting piece"};
  }
  const Vec3 principal = Eigen::SelfAdjointEigenSolver<Mat3>(body.I_Bcm_B).eigenvalues();
  if (principal[0] < -std::max(kRoundoff * std::abs(principal[2]),
                               body.mass * kLeastGyration_m * kLeastGyration_m)) {
    return {PrincipalInertiaText(principal) + " violate I > 0", ""};
  }
  return {};
}

Reason TooLargeReason(const Body& body) {
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

void CheckMasses(const Mechanism& mechanism, Impossible impossible, ModelReport* report) {
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    if (!std::isfinite(body.mass)) continue;  // already reported
    Reason reason = TooLargeReason(body);
    if (reason.text.empty()) reason = UnusableReason(body);
    if (!reason.text.empty()) {
      report->AtBody(mechanism, b, Severity::kError, reason.text, reason.hint);
      continue;
    }
    const std::string violation = ImpossibleInertia(body);
    if (violation.empty()) continue;
    const std::string cause = body.I_Bcm_B.isZero(0.0)
                                  ? "give the inertia about the centre of mass"
                                  : "no distribution of mass has such inertias; look for exchanged "
                                    "or missing digits, and "
                                    "that they are about the centre of mass";
    const std::string text = fmt::format("impossible inertia of {}: {}", body.name, violation);
    switch (impossible) {
      case Impossible::kAllowed:
        report->AtBody(mechanism, b, Severity::kWarning, report->Allow(text), "");
        break;
      case Impossible::kOfRobot:
        report->AtBody(mechanism, b, Severity::kWarning, text + ", taken as it is", cause);
        break;
      case Impossible::kRefused:
        report->AtBody(mechanism, b, Severity::kError, violation,
                       cause + "; `allow: impossible_inertia` in the model takes them as they are");
    }
  }
}

bool CheckTree(const ClosureHints& hints, Mechanism* mechanism, ModelReport* report) {
  const SpanningTreeResult tree = BuildSpanningTree(mechanism, hints);
  ReportTree(*mechanism, tree, report);
  if (!tree.ok()) return false;
  bool good = true;
  for (const Drive& drive : mechanism->drives) {
    if (!drive.compensates_gravity) continue;
    const Joint& joint =
        mechanism->joints[static_cast<size_t>(std::get<JointDrive>(drive.kind).joint)];
    if (!joint.closure) continue;
    good = false;
    report->At(report->places().signals.Of(drive.name), Severity::kError,
               fmt::format("drive '{}' carries gravity compensation, but joint '{}' closes a loop: "
                           "no body is beyond it",
                           drive.name, joint.name),
               "closure: true at another joint of the loop");
  }
  return good;
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
      closed_at_home ? fmt::format("the mechanism has {} degrees of freedom instead of {}",
                                   tilted->dofs_aligned, tilted->dofs)
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
    for (int k = 0; k < DofsOf(joint.kind); ++k) {
      if (report->places().joints[j].line == 0 ||
          !outside(joint.home[k], joint.range[k], IsLength(joint.kind, k))) {
        continue;
      }
      report->AtJoint(
          j, Severity::kWarning,
          fmt::format("joint '{}' is at {:.6g} at home, its range is {:.6g} … {:.6g}", joint.name,
                      joint.home[k], joint.range[k].lower, joint.range[k].upper));
    }
    const double angle = LogRotation(JointPose(joint, joint.home).linear()).norm();
    if (report->places().joints[j].line == 0 || !outside(angle, {0.0, joint.max_rotation}, false)) {
      continue;
    }
    report->AtJoint(j, Severity::kWarning,
                    fmt::format("joint '{}' is turned by {:.6g} at home, its range ends at {:.6g}",
                                joint.name, angle, joint.max_rotation));
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
  std::optional<size_t> last;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (joint.transmits_force_only && joint.kind != JointKind::kSpherical) last = j;
  }
  if (!last) return;
  const auto [dofs, as_balls] = CountIsostaticDofs(mechanism);
  if (dofs == as_balls) return;
  report->AtJoint(
      *last, Severity::kError,
      fmt::format("transmits: force changes the mechanism: {} degrees of freedom instead of {}",
                  as_balls, dofs),
      "only a redundant constraint can be left out of the reactions");
}

// Checks on elastic bodies: beams that hold together, and joints on beam ends.

namespace {

// Points nearer than this are one node [m].
constexpr double kSamePoint = 1e-9;

bool Same(const Vec3& a, const Vec3& b) { return (a - b).norm() < kSamePoint; }

// Whether p lies between the ends of the beam.
bool IsWithin(const Beam& beam, const Vec3& p) {
  if (Same(p, beam.p_from) || Same(p, beam.p_to)) return false;
  const double L = beam.length(), x = beam.R_BE.col(0).dot(p - beam.p_from);
  return x > 0.0 && x < L && Same(p, beam.p_from + x * beam.R_BE.col(0));
}

std::string Shown(const Vec3& p) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", p.x() + 0.0, p.y() + 0.0, p.z() + 0.0);
}

void CheckFrameOfBeams(const Mechanism& mechanism, int body, ModelReport* report) {
  std::vector<size_t> own;
  for (size_t i = 0; i < mechanism.beams.size(); ++i) {
    if (mechanism.beams[i].body == body) own.push_back(i);
  }
  if (own.empty()) return;
  const auto& beams = mechanism.beams;
  std::vector<size_t> reached = {own.front()};  // grows from the first beam
  for (size_t k = 0; k < reached.size(); ++k) {
    const Beam& beam = beams[reached[k]];
    for (const size_t i : own) {
      if (std::find(reached.begin(), reached.end(), i) != reached.end()) continue;
      for (const Vec3& end : {beams[i].p_from, beams[i].p_to}) {
        if (!Same(end, beam.p_from) && !Same(end, beam.p_to)) continue;
        reached.push_back(i);
        break;
      }
    }
  }
  const std::string& name = mechanism.bodies[body].name;
  for (const size_t i : own) {
    for (const size_t other : own) {
      for (const Vec3& end : {beams[i].p_from, beams[i].p_to}) {
        if (!IsWithin(beams[other], end)) continue;
        report->At(report->places().beams[i], Severity::kError,
                   fmt::format("beam '{}' ends at {} within beam '{}'", beams[i].name, Shown(end),
                               beams[other].name),
                   fmt::format("cut '{}' there: beams meet at their ends", beams[other].name));
      }
    }
    if (std::find(reached.begin(), reached.end(), i) != reached.end()) continue;
    report->At(report->places().beams[i], Severity::kError,
               fmt::format("beam '{}' is not connected with the other beams of body '{}'",
                           beams[i].name, name),
               "beams of one body meet at their ends; two pieces are two bodies");
  }
}

bool IsOnBeamEnd(const Mechanism& mechanism, int body, const Vec3& p) {
  bool elastic = false;
  for (const Beam& beam : mechanism.beams) {
    if (beam.body != body) continue;
    elastic = true;
    if (Same(p, beam.p_from) || Same(p, beam.p_to)) return true;
  }
  return !elastic;
}

// Joints, legs and springs move with a beam end or with a rigid body.
void CheckEndsOnBeams(const Mechanism& mechanism, ModelReport* report) {
  const auto check = [&](Place at, const std::string& what, int body, const Vec3& p) {
    if (IsOnBeamEnd(mechanism, body, p)) return;
    report->At(at, Severity::kError,
               fmt::format("{} sits at {} of body '{}', where no beam ends", what, Shown(p),
                           mechanism.bodies[body].name),
               "a body with beams is elastic: what holds it sits on ends of its beams");
  };
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const std::string what = fmt::format("joint '{}'", joint.name);
    check(report->places().joints[j], what, joint.parent, joint.X_PF.translation());
    check(report->places().joints[j], what, joint.child, joint.X_CM.translation());
  }
  for (const Drive& drive : mechanism.drives) {
    const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
    if (leg == nullptr) continue;
    const Place at = report->places().signals.Of(drive.name);
    check(at, fmt::format("drive '{}'", drive.name), leg->body_from, leg->p_from);
    check(at, fmt::format("drive '{}'", drive.name), leg->body_to, leg->p_to);
  }
  for (const SpringDamper& spring : mechanism.springs) {
    check({}, fmt::format("spring '{}'", spring.name), spring.body_from, spring.p_from);
    check({}, fmt::format("spring '{}'", spring.name), spring.body_to, spring.p_to);
  }
}

}  // namespace

void CheckBeams(const Mechanism& mechanism, ModelReport* report) {
  for (size_t b = 0; b < mechanism.bodies.size(); ++b) {
    CheckFrameOfBeams(mechanism, static_cast<int>(b), report);
  }
  CheckEndsOnBeams(mechanism, report);
}

// Loops that do not close as they are stated: what would close them.

namespace {

bool SaysBall(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name.find("spherical") != std::string::npos || name.find("rotule") != std::string::npos;
}

bool HasDriveOn(const Mechanism& mechanism, int joint) {
  return std::any_of(mechanism.drives.begin(), mechanism.drives.end(), [joint](const Drive& drive) {
    const auto* on = std::get_if<JointDrive>(&drive.kind);
    return on != nullptr && on->joint == joint;
  });
}

void MakeBall(Joint* joint) {
  joint->kind = JointKind::kSpherical;
  joint->guess = joint->home = {};
  joint->range = {};
}

}  // namespace

// CAD exporters know no balls and write hinges of that name, to be corrected by hand in the closure
// file (joint_name, joint_type). Where that was forgotten loops do not close.
bool TakeNamedBalls(Mechanism* mechanism, ModelReport* report) {
  Mechanism balls = *mechanism;
  std::vector<std::string> names;
  for (size_t j = 0; j < balls.joints.size(); ++j) {
    Joint& joint = balls.joints[j];
    const bool hinge = joint.kind == JointKind::kRevolute && !joint.closure;
    if (!hinge || !SaysBall(joint.name) || HasDriveOn(balls, static_cast<int>(j))) continue;
    MakeBall(&joint);
    names.push_back(joint.name);
  }
  if (names.empty()) return false;
  const HomeResult home = SolveHome(&balls);
  if (!home.closed) return false;
  *mechanism = std::move(balls);
  report->AddOther(
      {Severity::kWarning, report->file(), 0, 0,
       fmt::format("the loops do not close as they are stated; they do with {} joint{} as ball{} "
                   "whose name{} so, and which the URDF states as hinges: {}",
                   names.size(), names.size() == 1 ? "" : "s", names.size() == 1 ? "" : "s",
                   names.size() == 1 ? " says" : "s say", Joined(names, 4)),
       "list them in the closure file: joint_name: […], joint_type: [SPHERICAL, …]"});
  if (home.guesses_moved) WarnAboutAssembly(*mechanism, home, report);
  return true;
}

bool TakeWeldsAsPoints(const HomeResult& home, Mechanism* mechanism, ModelReport* report) {
  Mechanism points = *mechanism;
  std::vector<std::string> names;
  for (const LoopGap& gap : home.gaps) {
    Joint& joint = points.joints[gap.joint];
    if (joint.kind != JointKind::kFixed) continue;
    MakeBall(&joint);
    names.push_back(joint.name);
  }
  if (names.empty()) return false;
  const HomeResult closed = SolveHome(&points);
  if (!closed.closed) return false;
  *mechanism = std::move(points);
  report->AddOther({Severity::kWarning, report->file(), 0, 0,
                    report->LeaveOut(fmt::format(
                        "the loops do not close where the file welds frames (6d), and "
                        "close where these meet in points (3d): of {} their turn against "
                        "each other is left out, and the moment that would hold it",
                        Joined(names, 12))),
                    "correct the frames, or write 3d in the closure file"});
  if (closed.guesses_moved) WarnAboutAssembly(*mechanism, closed, report);
  return true;
}

std::string WhatWouldClose(const Mechanism& mechanism, const HomeResult& home) {
  if (home.gaps.empty()) return "";
  const Joint& joint = mechanism.joints[home.gaps.front().joint];
  const Pose X_FM = (mechanism.X_WB_home[joint.parent] * joint.X_PF).inverse() *
                    (mechanism.X_WB_home[joint.child] * joint.X_CM);
  const Vec3 d = X_FM.translation();
  return fmt::format(
      "at the pose of least gaps the frame of '{}' on '{}' would have to move by [{:.4g}, {:.4g}, "
      "{:.4g}] m in its own axes",
      joint.name, mechanism.bodies[joint.parent].name, d.x(), d.y(), d.z());
}

}  // namespace mbv::internal
