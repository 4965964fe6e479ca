// Loops that do not close as they are stated: what would close them.
#include <fmt/format.h>

#include <algorithm>

#include "core/text.h"
#include "kinematics/home.h"
#include "mechanism/mechanism.h"
#include "mechanism/reach.h"
#include "model_file/model_checks.h"

namespace mbv::internal {
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

// CAD exporters know no balls and write hinges of that name, to be mended by hand in the closure
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

std::string WhatWouldClose(const Mechanism& mechanism, const HomeResult& home) {
  std::string text;
  if (!home.gaps.empty()) {
    const Joint& joint = mechanism.joints[home.gaps.front().joint];
    const Pose X_FM = (mechanism.X_WB_home[joint.parent] * joint.X_PF).inverse() *
                      (mechanism.X_WB_home[joint.child] * joint.X_CM);
    const Vec3 d = X_FM.translation();
    text = fmt::format(
        "at the pose of least gaps the frame of '{}' on '{}' would have to move by [{:.4g}, "
        "{:.4g}, "
        "{:.4g}] m in its own axes",
        joint.name, mechanism.bodies[joint.parent].name, d.x(), d.y(), d.z());
  }
  // Would points do where frames are welded?
  Mechanism points = mechanism;
  std::vector<std::string> names;
  for (const LoopGap& gap : home.gaps) {
    Joint& joint = points.joints[gap.joint];
    if (joint.kind != JointKind::kFixed) continue;
    MakeBall(&joint);
    names.push_back(joint.name);
  }
  if (!names.empty() && SolveHome(&points).closed) {
    text +=
        fmt::format("; all loops close where the welded frames (6d) meet in points only (3d): {}",
                    Joined(names, 12));
  }
  return text;
}

}  // namespace mbv::internal
