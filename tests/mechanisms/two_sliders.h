// Two driven sliders in a row, for tests that need a mechanism but no mechanics.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv::test {

inline Mechanism DrivenSliders() {
  Mechanism mechanism;
  mechanism.name = "two_sliders";
  mechanism.bodies = {{.name = "world", .frames = {}, .shapes = {}},
                      {.name = "a", .mass = 1.0, .frames = {}, .shapes = {}},
                      {.name = "b", .mass = 1.0, .frames = {}, .shapes = {}}};
  for (int j = 0; j < 2; ++j) {
    Joint joint;
    joint.name = j == 0 ? "slide1" : "slide2";
    joint.kind = JointKind::kPrismatic;
    joint.parent = j;
    joint.child = j + 1;
    mechanism.joints.push_back(joint);
    Drive drive;
    drive.name = j == 0 ? "d1" : "d2";
    drive.kind = JointDrive{j, 0};
    mechanism.drives.push_back(drive);
  }
  return mechanism;
}

}  // namespace mbv::test
