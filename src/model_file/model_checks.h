// Checks on a whole model: what no section can tell alone. Internal to the model loader.
#pragma once

#include <set>
#include <string>

#include "kinematics/home.h"
#include "mechanism/mechanism.h"
#include "mechanism/spanning_tree.h"
#include "model_file/model_report.h"

namespace mbv::internal {

/// Masses and inertias that no body has; impossible ones may be allowed.
void CheckMasses(const Mechanism& mechanism, bool impossible_allowed, ModelReport* report);

/// Beams of a body that hold together, and joints, legs and springs that sit on their ends.
void CheckBeams(const Mechanism& mechanism, ModelReport* report);

/// Chooses the spanning tree; false after a finding.
bool CheckTree(const ClosureHints& hints, Mechanism* mechanism, ModelReport* report);

/// How loops may be closed that their data leave open.
struct ClosureRules {
  double tolerance_m = 0.0;      ///< up to which rounded data are projected
  bool bare_urdf = false;        ///< no model file: joints named as balls are taken for such
  AssemblyChoice assembly = {};  ///< by option
  std::set<int> guessed = {};    ///< joints with a stated guess
};
/// Solves the home pose. Coupled coordinates without a stated guess follow the others; driven ones
/// lead where none of a coupling is stated. What it had to do for that are warnings; open loops are
/// errors.
void CloseLoops(const ClosureRules& rules, Mechanism* mechanism, ModelReport* report);

/// Coordinates at home against their ranges, ends of legs that coincide.
void CheckHome(const Mechanism& mechanism, ModelReport* report);

/// An axis that is tilted by a typing slip: the cause behind what else is wrong.
void CheckAxes(const Mechanism& mechanism, bool closed_at_home, ModelReport* report);

/// Joints that transmit a force only must not gain freedoms by it.
void CheckIsostaticRule(const Mechanism& mechanism, ModelReport* report);

/// Doubts about what is possible but hardly meant: units, reference points. Warnings only.
void CheckPlausible(const Mechanism& mechanism, ModelReport* report);

/// That only a search closed the loops.
void WarnAboutAssembly(const Mechanism& mechanism, const HomeResult& home, ModelReport* report);
/// Makes hinges balls that are named so, if that closes the loops; false if not.
bool TakeNamedBalls(Mechanism* mechanism, ModelReport* report);
/// A sentence for people who state closures in a URDF file.
[[nodiscard]] std::string WhatWouldClose(const Mechanism& mechanism, const HomeResult& home);

}  // namespace mbv::internal
