// Checks on a whole model: what no section shows alone. Internal to the model loader.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "kinematics/home.h"
#include "mechanism/mechanism.h"
#include "mechanism/spanning_tree.h"
#include "model_file/model_bodies.h"
#include "model_file/model_values.h"
#include "model_file/yaml/yaml_reader.h"

// Findings about a model as a whole, at the places where its parts are described. Internal to the
// model loader.

namespace mbv::internal {

/// Where the parts of a mechanism are described.
struct ModelPlaces {
  std::vector<BodyPlace> bodies;               ///< per body
  std::vector<Place> joints;                   ///< per joint
  std::vector<Place> beams;                    ///< per beam
  SignalPlaces signals;                        ///< drives, prescribed joints, outputs, couplings
  std::map<std::string, Finding> urdf_joints;  ///< of a URDF file, by name
};

class ModelReport {
 public:
  ModelReport(const ModelPlaces& places, YamlReader* yaml, Diagnostics* others,
              std::vector<ModelCaveat>* caveats)
      : places_(places), yaml_(*yaml), others_(*others), caveats_(*caveats) {}

  /// What a robot's loops have and the mechanism has not: as Allow().
  [[nodiscard]] std::string LeaveOut(const std::string& text) {
    caveats_.push_back({.kind = ModelCaveat::Kind::kLeftOut, .text = text, .source = "closure"});
    return text;
  }
  /// What the model makes acceptable; the warning that says it, and a caveat of every verdict.
  [[nodiscard]] std::string Allow(const std::string& text) {
    caveats_.push_back({.kind = ModelCaveat::Kind::kAllowed, .text = text});
    return "ALLOWED BY THE MODEL: " + text;
  }

  void At(Place place, Severity severity, const std::string& message, const std::string& hint = "");
  void AtBody(const Mechanism& mechanism, size_t body, Severity severity,
              const std::string& message, const std::string& hint);
  /// At the joint's line in the model file, or at none.
  void AtJoint(size_t joint, Severity severity, const std::string& message,
               const std::string& hint = "");
  void AtJoint(size_t joint, Finding finding);
  /// About the file as a whole.
  void AtFile(Severity severity, const std::string& message, const std::string& hint = "");
  /// The same without a place, for what is not written in the model file.
  void AddOther(Finding finding) { others_.Add(std::move(finding)); }

  /// Where a joint is described that stands in a URDF file; null for those of the model file.
  [[nodiscard]] const Finding* InUrdf(const Mechanism& mechanism, int joint) const;

  [[nodiscard]] const ModelPlaces& places() const { return places_; }
  [[nodiscard]] const std::string& file() const { return yaml_.file(); }
  [[nodiscard]] bool has_errors() const { return yaml_.has_errors() || others_.has_errors(); }
  /// Of these, findings with a place in the model file, or about it.
  [[nodiscard]] bool has_own_errors() const { return yaml_.has_errors(); }
  /// How many there are, caveats included.
  [[nodiscard]] size_t findings() const {
    return yaml_.diagnostics().findings().size() + others_.findings().size() + caveats_.size();
  }

 private:
  const ModelPlaces& places_;
  YamlReader& yaml_;
  Diagnostics& others_;
  std::vector<ModelCaveat>& caveats_;
};

/// What is made of inertias that no distribution of mass has: an error, a caveat of what the model
/// allows, a warning about another one's file (its model file allows them then).
enum class Impossible { kRefused, kAllowed, kOfRobot };
/// Masses and inertias that no body has; impossible ones may be allowed.
void CheckMasses(const Mechanism& mechanism, Impossible impossible, ModelReport* report);

/// Beams of a body that hold together, and joints, legs and springs that sit on their ends.
void CheckBeams(const Mechanism& mechanism, ModelReport* report);

/// Chooses the spanning tree; false after a finding.
bool CheckTree(const ClosureHints& hints, Mechanism* mechanism, ModelReport* report);

/// How loops may be closed that their data leave open.
struct ClosureRules {
  double tolerance_m = 0.0;      ///< up to which rounded data are projected, or …
  double farthest_m = 0.0;       ///< joint frames are moved no farther; CloseLoops() sets it
  PrintedRounding printed = {};  ///< … as far as the digits of a robot's file explain
  bool bare_urdf = false;        ///< no model file: joints named as balls are taken for such
  bool is_robot = false;         ///< of a foreign format: options say what a model file would
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

/// Joints that transmit a force only must not gain DOFs by it.
void CheckIsostaticRule(const Mechanism& mechanism, ModelReport* report);

/// Warnings about what is possible but hardly meant: units, reference points. Warnings only.
void CheckPlausible(const Mechanism& mechanism, ModelReport* report);

/// That only a search closed the loops.
void WarnAboutAssembly(const Mechanism& mechanism, const HomeResult& home, ModelReport* report);
/// Makes hinges balls that are named so, if that closes the loops; false if not.
bool TakeNamedBalls(Mechanism* mechanism, ModelReport* report);
/// The same for closures that weld frames: as balls, with a caveat.
bool TakeWeldsAsPoints(const HomeResult& home, Mechanism* mechanism, ModelReport* report);
/// One sentence for those who state closures in a URDF file.
[[nodiscard]] std::string WhatWouldClose(const Mechanism& mechanism, const HomeResult& home);

}  // namespace mbv::internal
