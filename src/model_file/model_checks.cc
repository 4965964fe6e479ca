// Checks on the whole model: masses, the graph of joints, loops closed at home, ranges, and the
// isostatic rule.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "kinematics/assembly.h"
#include "kinematics/constraints.h"
#include "kinematics/data_projection.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "kinematics/tilted_axis.h"
#include "mechanism/concession.h"
#include "mechanism/impossible_inertia.h"
#include "mechanism/reach.h"
#include "model_file/model_reader.h"

namespace mbv {

namespace {

// Beside larger ones, usual masses and lengths are lost in a sum.
constexpr double kLargestMass_kg = 1e15;
constexpr double kLargestLength_m = 1e12;
// Joint frames may have to move farther than the gap that they leave at home is wide.
constexpr double kProjectionReach = 10.0;
// Guesses are given to some digits; a driven joint that home moves farther is told [rad,
// characteristic lengths].
constexpr double kMovedDrive = 1e-3;

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

}  // namespace

void ModelReader::CheckMasses() {
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    const Body& body = mechanism_.bodies[b];
    if (!std::isfinite(body.mass)) continue;  // already reported
    Reason reason = WhyTooLarge(body);
    if (reason.text.empty()) reason = WhyNotPhysical(body);
    if (!reason.text.empty()) {
      AddBodyFinding(Severity::kError, b, reason.text, reason.hint);
    } else if (const std::string violation = TriangleViolation(body); !violation.empty()) {
      CheckImpossibleInertia(b, violation);
    }
  }
  yaml_.SetNote("");
}

void ModelReader::AddBodyFinding(Severity severity, size_t b, const std::string& text,
                                 const std::string& hint) {
  const Body& body = mechanism_.bodies[b];
  if (const YamlEntry* at = body_places_[b]; at != nullptr) {
    yaml_.SetNote(body.name == at->key ? "" : fmt::format(" (body {})", body.name));
    yaml_.AddAt(severity, at->line, at->column, body_paths_[b] + ": " + text, hint);
  } else {
    other_findings_.Add(
        {severity, body_paths_[b], 0, 0, fmt::format("link '{}': {}", body.name, text), hint});
  }
}

void ModelReader::CheckImpossibleInertia(size_t b, const std::string& violation) {
  if (!impossible_inertia_allowed_) {
    AddBodyFinding(Severity::kError, b, violation,
                   "no distribution of mass has such inertias; look for exchanged or missing "
                   "digits, and that they are about the centre of mass; `allow: "
                   "impossible_inertia` in the model takes them as they are");
    return;
  }
  AddBodyFinding(Severity::kWarning, b,
                 fmt::format("{}impossible inertia of {}: {}", kConcession,
                             mechanism_.bodies[b].name, violation),
                 "");
}

bool ModelReader::CheckTree() {
  const SpanningTreeResult tree = BuildSpanningTree(&mechanism_, hints_);
  ReportTree(tree);
  return tree.ok();
}

void ModelReader::CloseLoops() {
  const HomeResult home = SolveHome(&mechanism_);
  if (home.closed) {
    if (home.guesses_moved) {
      WarnAboutAssembly(home);
    } else if (home.drives_moved) {
      WarnAboutMovedDrives();
    }
    return;
  }
  const double gap_m = home.gap * CharacteristicLength(mechanism_);
  const int redundant = CountNearlyRedundant(mechanism_, home.gap);
  if (redundant > 0 && gap_m <= closure_tolerance_m_ && ProjectRoundedData(home)) return;
  if (TakeNamedBalls()) return;
  std::string hint = "improve the guesses of the loop's joints, or look for a wrong length or axis";
  if (bare_urdf_) hint += "; " + WhatWouldClose(home);
  if (redundant > 0) {
    hint = fmt::format(
        "the loops are overconstrained by {} and closed except for {:.2g} m: rounded data? More "
        "digits close them; `closure_tolerance: {:.0e}` in the model moves the joint frames by as "
        "little as closes them",
        redundant, gap_m, 2 * gap_m);
  }
  CheckAxes(false);
  ReportGaps(home, hint);
}

bool ModelReader::ProjectRoundedData(const HomeResult& home) {
  const DataProjection projection = ProjectData(&mechanism_, home.gap);
  if (!projection.closed) return false;
  const double moved_m =
      std::max(projection.moved_m, projection.turned_rad * CharacteristicLength(mechanism_));
  if (moved_m > kProjectionReach * closure_tolerance_m_) return false;
  const std::string text = fmt::format(
      "{}joint frames moved by up to {:.2g} m and {:.2g} rad, because the loops are "
      "overconstrained "
      "by {} and their data close them except for {:.2g} m (closure_tolerance {:g} m)",
      kConcession, projection.moved_m, projection.turned_rad, projection.redundant,
      home.gap * CharacteristicLength(mechanism_), closure_tolerance_m_);
  yaml_.SetNote("");
  yaml_.AddAt(Severity::kWarning, 0, 0, text);
  return true;
}

void ModelReader::ReportGaps(const HomeResult& home, const std::string& hint) {
  const double tolerance_m = home.tolerance * CharacteristicLength(mechanism_);
  for (const LoopGap& gap : home.gaps) {
    const bool in_place = gap.position_m <= tolerance_m;
    const bool turned = !(gap.rotation_rad <= home.tolerance);
    if (in_place && !turned) continue;
    const Joint& joint = mechanism_.joints[gap.joint];
    // Of a whole robot's loops the worst one tells what to do.
    const bool told = bare_urdf_ && &gap != home.gaps.data();
    std::string text = fmt::format("the loop at joint '{}' does not close: gap", joint.name);
    if (!in_place) text += fmt::format(" {:.3g} m", gap.position_m);
    if (turned) text += fmt::format(" {:.3g} rad", gap.rotation_rad);
    const YamlEntry* at = joint_places_[gap.joint];
    yaml_.SetNote("");
    if (const auto urdf = urdf_places_.find(joint.name);
        at == nullptr && urdf != urdf_places_.end()) {
      Finding finding = urdf->second;
      finding.message = text;
      finding.hint =
          told ? ""
               : hint + "; guesses of URDF joints stand in the model file under `urdf: {guess: …}`";
      other_findings_.Add(finding);
    } else {
      yaml_.AddAt(Severity::kError, at ? at->line : 0, at ? at->column : 0, text, hint);
    }
  }
  if (!yaml_.has_errors() && !other_findings_.has_errors())
    yaml_.AddAt(Severity::kError, 0, 0, "the home pose was not found");
}

// The drives that home could not leave at their guesses: commands that count from home do so from
// elsewhere.
void ModelReader::WarnAboutMovedDrives() {
  const double length_m = CharacteristicLength(mechanism_);
  std::string text;
  const YamlEntry* at = nullptr;
  const auto add = [&](int j, const std::string& name) {
    const Joint& joint = mechanism_.joints[j];
    const bool is_length = IsLength(joint.kind, 0);
    const double moved = std::abs(joint.home[0] - joint.guess[0]) / (is_length ? length_m : 1.0);
    if (FreedomsOf(joint.kind) != 1 || !(moved > kMovedDrive)) return;
    if (at == nullptr) at = joint_places_[j];
    text += fmt::format("{}{} from {:.5g} to {:.5g} {}", text.empty() ? "" : ", ", name,
                        joint.guess[0], joint.home[0], is_length ? "m" : "rad");
  };
  for (const Drive& drive : mechanism_.drives) {
    if (const auto* d = std::get_if<JointDrive>(&drive.kind)) add(d->joint, drive.name);
  }
  for (const Prescribed& p : mechanism_.prescribed) add(p.joint, p.name);
  if (text.empty()) return;
  yaml_.SetNote("");
  yaml_.AddAt(Severity::kWarning, at ? at->line : 0, at ? at->column : 0,
              "the loops do not close with the driven joints at their guesses: home has " + text,
              "if that is not the pose you mean, look for a wrong length, or give guesses that "
              "close the loops");
}

// Only a search led to closed loops: which assembly is meant is not known.
void ModelReader::WarnAboutAssembly(const HomeResult& home) {
  constexpr size_t kMostJoints = 4;
  std::vector<std::pair<double, int>> moved;  // by how much, tree joint
  const double length_m = CharacteristicLength(mechanism_);
  for (const int j : mechanism_.tree_joints) {
    const Joint& joint = mechanism_.joints[j];
    double most = 0.0;
    for (int k = 0; k < FreedomsOf(joint.kind); ++k) {
      const double unit = IsLength(joint.kind, k) ? length_m : 1.0;
      most = std::max(most, std::abs(joint.home[k] - joint.guess[k]) / unit);
    }
    if (most > 0.0) moved.emplace_back(-most, j);
  }
  std::sort(moved.begin(), moved.end());
  std::string text;
  for (size_t i = 0; i < std::min(moved.size(), kMostJoints); ++i) {
    const Joint& joint = mechanism_.joints[moved[i].second];
    text += fmt::format("{}{} from {:.4g} to {:.4g}", i == 0 ? "" : ", ", joint.name,
                        joint.guess[0], joint.home[0]);
  }
  for (const GroupAssemblies& group : home.searched) {
    if (!group.assemblies.empty()) text += "; " + AssemblyText(mechanism_, group);
  }
  const YamlEntry* at = moved.empty() ? nullptr : joint_places_[moved.front().second];
  yaml_.SetNote("");
  yaml_.AddAt(Severity::kWarning, at ? at->line : 0, at ? at->column : 0,
              fmt::format("the loops close only by a search (gap {:.2g} at the guesses): "
                          "this may be another assembly than meant; {}",
                          home.gap_at_guess, text),
              "look at a picture of the home pose, and guess nearer to the pose that is meant");
}

namespace {

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

}  // namespace

void ModelReader::ReportTree(const SpanningTreeResult& tree) {
  const std::vector<bool> connected = ConnectedBodies(mechanism_);
  yaml_.SetNote("");
  for (const int body : tree.unconnected_bodies) {
    const YamlEntry* at = body_places_[body];
    const int line = at ? at->line : 0, column = at ? at->column : 0;
    const std::string& name = mechanism_.bodies[body].name;
    if (connected[body]) {
      yaml_.AddAt(Severity::kError, line, column,
                  fmt::format("body '{}' is cut off from the world: every chain of joints to it "
                              "has a joint with closure: true",
                              name),
                  "a body that hangs on closures only needs a free joint to the world");
    } else {
      yaml_.AddAt(Severity::kError, line, column,
                  fmt::format("no chain of joints connects body '{}' to the world", name),
                  "a floating body needs a free joint");
    }
  }
  for (const int joint : tree.hints_broken) {
    const YamlEntry* at = joint_places_[joint];
    yaml_.AddAt(Severity::kError, at ? at->line : 0, at ? at->column : 0,
                fmt::format("joint '{}' has closure: false, but all joints of its loop have, and "
                            "one must be cut",
                            mechanism_.joints[joint].name));
  }
}

// An axis that is tilted by a typing slip: the cause behind what else is wrong.
void ModelReader::CheckAxes(bool closed_at_home) {
  const auto tilted = FindTiltedAxis(mechanism_, closed_at_home);
  if (!tilted) return;
  const Joint &joint = mechanism_.joints[tilted->joint], &other = mechanism_.joints[tilted->other];
  const bool like = (joint.kind == JointKind::kPrismatic) == (other.kind == JointKind::kPrismatic);
  const std::string text = fmt::format(
      "the axis of joint '{}' is tilted by {:.3g} deg against that of joint '{}' on {}: with {} "
      "axes "
      "{}",
      joint.name, tilted->angle_rad / FromDegrees(1.0), other.name,
      mechanism_.bodies[tilted->body].name, like ? "parallel" : "perpendicular",
      closed_at_home ? fmt::format("the mechanism has {} freedoms instead of {}",
                                   tilted->freedoms_aligned, tilted->freedoms)
                     : "the loops close");
  const YamlEntry* at = joint_places_[tilted->joint];
  const std::string hint = "look at its axis and at the rotations of its two frames";
  if (const auto urdf = urdf_places_.find(joint.name);
      at == nullptr && urdf != urdf_places_.end()) {
    Finding finding = urdf->second;
    finding.severity = Severity::kWarning;
    finding.message = text;
    finding.hint = hint;
    other_findings_.Add(finding);
    return;
  }
  yaml_.AddAt(Severity::kWarning, at ? at->line : 0, at ? at->column : 0, text, hint);
}

void ModelReader::CheckHome() {
  yaml_.SetNote("");
  CheckAxes(true);
  const double length = CharacteristicLength(mechanism_);
  const auto outside = [&](double value, const CoordinateRange& range, bool is_length) {
    const double slack = 1e-9 * (is_length ? length : 1.0);
    return value < range.lower - slack || value > range.upper + slack;
  };
  for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
    const Joint& joint = mechanism_.joints[j];
    for (int k = 0; k < FreedomsOf(joint.kind); ++k) {
      if (joint_places_[j] == nullptr ||
          !outside(joint.home[k], joint.range[k], IsLength(joint.kind, k))) {
        continue;
      }
      yaml_.AddAt(
          Severity::kWarning, joint_places_[j]->line, joint_places_[j]->column,
          fmt::format("joint '{}' is at {:.6g} at home, its range is {:.6g} … {:.6g}", joint.name,
                      joint.home[k], joint.range[k].lower, joint.range[k].upper));
    }
  }
  BodyStates states;
  states.Resize(mechanism_.bodies.size());
  states.X_WB = mechanism_.X_WB_home;
  for (const Drive& drive : mechanism_.drives) {
    const double value = DriveRow(mechanism_, drive, states).value;
    const YamlEntry& at = *signal_places_[drive.name].front().entry;
    if (std::holds_alternative<DistanceDrive>(drive.kind) && value < 1e-9 * length) {
      yaml_.Error(at,
                  fmt::format("drive '{}': its two ends are the same point at home", drive.name));
    } else if (outside(value, drive.range, PositionUnit(mechanism_, drive) == "m")) {
      yaml_.AddAt(Severity::kWarning, at.line, at.column,
                  fmt::format("drive '{}' is at {:.6g} at home, its range is {:.6g} … {:.6g}",
                              drive.name, value, drive.range.lower, drive.range.upper));
    }
  }
}

// A joint that transmits a force only must not gain freedom by it: with all of them as balls, the
// mechanism must have the same number of freedoms.
void ModelReader::CheckIsostaticRule() {
  Mechanism balls = mechanism_;
  const YamlEntry* at = nullptr;
  for (size_t j = 0; j < balls.joints.size(); ++j) {
    Joint& joint = balls.joints[j];
    if (!joint.transmits_force_only || joint.kind == JointKind::kSpherical) continue;
    joint.kind = JointKind::kSpherical;
    at = joint_places_[j];
  }
  if (at == nullptr) return;
  balls.drives.clear();
  balls.prescribed.clear();
  Mechanism passive = mechanism_;
  passive.drives.clear();
  passive.prescribed.clear();
  const int freedoms = AnalyseMobility(passive).freedoms;
  const int as_balls = AnalyseMobility(balls).freedoms;
  if (freedoms == as_balls) return;
  yaml_.Error(*at,
              fmt::format("transmits: force changes the mechanism: {} freedoms instead of {}",
                          as_balls, freedoms),
              "only a redundant constraint can be left out of the reactions");
}

}  // namespace mbv
