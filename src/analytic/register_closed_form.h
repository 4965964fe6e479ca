// Adds closed forms (motion, stiffness, workspace) from outside this source tree: a namespace-scope
// object in any source file of a program that links mbverify::mbverify.
//
//   const mbv::ClosedFormRegistration kMine({.mechanism = "my_arm", .models = {"full"},
//                                            .errata = {}, .factory = &MakeMyArm,
//                                            .coverage = &CoverageOfMyArm});
#pragma once

#include "analytic/closed_form.h"
#include "analytic/stiffness_form.h"
#include "analytic/workspace_form.h"

namespace mbv {

/// Adds a row to ClosedForms(); one for a mechanism that has a row already takes its place. Before
/// main() or before the first look-up only.
struct ClosedFormRegistration {
  explicit ClosedFormRegistration(ClosedFormRow row);
};
/// The same for StiffnessForms().
struct StiffnessFormRegistration {
  explicit StiffnessFormRegistration(StiffnessFormRow row);
};
/// The same for WorkspaceForms().
struct WorkspaceFormRegistration {
  explicit WorkspaceFormRegistration(WorkspaceFormRow row);
};

}  // namespace mbv
