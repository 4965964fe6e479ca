// The home pose: loops that close, and what is said when they do not.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include "kinematics/assembly.h"
#include "kinematics/coupling_rows.h"
#include "kinematics/data_projection.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "mechanism/reach.h"
#include "model_file/model_checks.h"

namespace mbv::internal {
namespace {

// Joint frames may have to move farther than the gap that they leave at home is wide.
constexpr double kProjectionReach = 10.0;
// Guesses are given to some digits; a driven joint that home moves farther is told [rad,
// characteristic lengths].
constexpr double kMovedDrive = 1e-3;

bool ProjectRoundedData(const ClosureRules& rules, const HomeResult& home, Mechanism* mechanism,
                        ModelReport* report) {
  const DataProjection projection = ProjectData(mechanism, home.gap);
  if (!projection.closed) return false;
  const double moved_m =
      std::max(projection.moved_m, projection.turned_rad * CharacteristicLength(*mechanism));
  if (moved_m > kProjectionReach * rules.tolerance_m) return false;
  const std::string text = report->Allow(
      fmt::format("joint frames moved by up to {:.2g} m and {:.2g} rad, because the loops are "
                  "overconstrained "
                  "by {} and their data close them except for {:.2g} m (closure_tolerance {:g} m)",
                  projection.moved_m, projection.turned_rad, projection.redundant,
                  home.gap * CharacteristicLength(*mechanism), rules.tolerance_m));
  report->AtFile(Severity::kWarning, text);
  return true;
}

void ReportGaps(const ClosureRules& rules, const Mechanism& mechanism, const HomeResult& home,
                const std::string& hint, ModelReport* report) {
  const double tolerance_m = home.tolerance * CharacteristicLength(mechanism);
  for (const LoopGap& gap : home.gaps) {
    const bool in_place = gap.position_m <= tolerance_m;
    const bool turned = !(gap.rotation_rad <= home.tolerance);
    if (in_place && !turned) continue;
    const Joint& joint = mechanism.joints[gap.joint];
    // Of a whole robot's loops the worst one tells what to do.
    const bool told = rules.bare_urdf && &gap != home.gaps.data();
    std::string text = fmt::format("the loop at joint '{}' does not close: gap", joint.name);
    if (!in_place) text += fmt::format(" {:.3g} m", gap.position_m);
    if (turned) text += fmt::format(" {:.3g} rad", gap.rotation_rad);
    if (const Finding* urdf = report->InUrdf(mechanism, gap.joint); urdf != nullptr) {
      report->AddOther(
          {urdf->severity, urdf->file, urdf->line, urdf->column, text,
           told ? ""
                : hint +
                      "; guesses of URDF joints stand in the model file under `urdf: {guess: …}`"});
    } else {
      report->AtJoint(gap.joint, Severity::kError, text, hint);
    }
  }
  for (const CouplingGap& missed : home.couplings) {
    const Coupling& coupling = mechanism.couplings[missed.coupling];
    report->At(report->places().signals.Of(coupling.name), Severity::kError,
               fmt::format("coupling '{}' of {} does not hold at home: it is missed by {:.3g} {}",
                           coupling.name, CoupledJoints(mechanism, coupling), missed.amount,
                           missed.angular ? "rad" : "m"),
               hint);
  }
  if (!report->has_errors()) {
    report->AtFile(Severity::kError, "the home pose was not found");
  }
}

// Guesses of coupled coordinates that have none, in order of who leads: stated guesses, what is
// driven, what follows nothing, the later terms of a coupling.
void GuessFollowers(const std::set<int>& guessed, Mechanism* mechanism) {
  if (mechanism->couplings.empty()) return;
  std::vector<std::array<double, 6>> q;
  for (const Joint& joint : mechanism->joints) q.push_back(joint.guess);
  CoordinateSet known;
  const auto lead = [&](int j) {
    for (int c = 0; c < FreedomsOf(mechanism->joints[j].kind); ++c) known.insert({j, c});
  };
  for (const int j : guessed) lead(j);
  SolveFollowers(*mechanism, &known, &q);
  for (const Drive& drive : mechanism->drives) {
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
      known.insert({on->joint, on->coordinate});
    }
  }
  for (const Prescribed& base : mechanism->prescribed) lead(base.joint);
  SolveFollowers(*mechanism, &known, &q);
  CoordinateSet followers;
  for (const Coupling& coupling : mechanism->couplings) {
    followers.insert({coupling.terms[0].joint, coupling.terms[0].coordinate});
  }
  for (const Coupling& coupling : mechanism->couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      const std::pair<int, int> at(term.joint, term.coordinate);
      if (!followers.contains(at)) known.insert(at);
    }
  }
  SolveFollowers(*mechanism, &known, &q);
  for (const Coupling& coupling : mechanism->couplings) {
    for (size_t k = 1; k < coupling.terms.size(); ++k) {
      known.insert({coupling.terms[k].joint, coupling.terms[k].coordinate});
    }
    SolveFollowers(*mechanism, &known, &q);
  }
  for (size_t j = 0; j < q.size(); ++j) mechanism->joints[j].guess = q[j];
}

// The drives that home could not leave at their guesses: commands that count from home do so from
// elsewhere.
void WarnAboutMovedDrives(const Mechanism& mechanism, ModelReport* report) {
  const double length_m = CharacteristicLength(mechanism);
  std::string text;
  Place at;
  const auto add = [&](int j, const std::string& name) {
    const Joint& joint = mechanism.joints[j];
    const bool is_length = IsLength(joint.kind, 0);
    const double moved = std::abs(joint.home[0] - joint.guess[0]) / (is_length ? length_m : 1.0);
    if (FreedomsOf(joint.kind) != 1 || !(moved > kMovedDrive)) return;
    if (at.line == 0) at = report->places().joints[j];
    text += fmt::format("{}{} from {:.5g} to {:.5g} {}", text.empty() ? "" : ", ", name,
                        joint.guess[0], joint.home[0], is_length ? "m" : "rad");
  };
  for (const Drive& drive : mechanism.drives) {
    if (const auto* d = std::get_if<JointDrive>(&drive.kind)) add(d->joint, drive.name);
  }
  for (const Prescribed& p : mechanism.prescribed) add(p.joint, p.name);
  if (text.empty()) return;
  report->At(at, Severity::kWarning,
             "the loops do not close with the driven joints at their guesses: home has " + text,
             "if that is not the pose you mean, look for a wrong length, or give guesses that "
             "close the loops");
}

}  // namespace

// Only a search led to closed loops: which assembly is meant is not known.
void WarnAboutAssembly(const Mechanism& mechanism, const HomeResult& home, ModelReport* report) {
  constexpr size_t kMostJoints = 4;
  std::vector<std::pair<double, int>> moved;  // by how much, tree joint
  const double length_m = CharacteristicLength(mechanism);
  for (const int j : mechanism.tree_joints) {
    const Joint& joint = mechanism.joints[j];
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
    const Joint& joint = mechanism.joints[moved[i].second];
    text += fmt::format("{}{} from {:.4g} to {:.4g}", i == 0 ? "" : ", ", joint.name,
                        joint.guess[0], joint.home[0]);
  }
  for (const GroupAssemblies& group : home.searched) {
    if (!group.assemblies.empty()) text += "; " + AssemblyText(mechanism, group);
  }
  const Place at = moved.empty() ? Place{} : report->places().joints[moved.front().second];
  report->At(at, Severity::kWarning,
             fmt::format("the loops close only by a search (gap {:.2g} at the guesses): "
                         "this may be another assembly than meant; {}",
                         home.gap_at_guess, text),
             "look at a picture of the home pose, and guess nearer to the pose that is meant");
}

namespace {

void ReportUnmet(const Mechanism& mechanism, const HomeResult& home, ModelReport* report) {
  std::vector<std::string> closures;
  for (const Joint& joint : mechanism.joints) {
    if (joint.closure) closures.push_back(joint.name);
  }
  for (const UnmetChoice& unmet : home.unmet) {
    if (unmet.found < 0) {
      report->AtFile(Severity::kError,
                     fmt::format("assembly {}={}: there is no closure of this name", unmet.closure,
                                 unmet.wanted),
                     DidYouMean(unmet.closure, closures));
    } else {
      report->AtFile(Severity::kError,
                     fmt::format("assembly {}={}: {} to close the loops of '{}' {} found",
                                 unmet.closure, unmet.wanted,
                                 unmet.found == 1 ? "1 way" : fmt::format("{} ways", unmet.found),
                                 unmet.closure, unmet.found == 1 ? "was" : "were"),
                     "they are counted from 1, the nearest to the guesses");
    }
  }
}

}  // namespace

void CloseLoops(const ClosureRules& rules, Mechanism* mechanism, ModelReport* report) {
  GuessFollowers(rules.guessed, mechanism);
  const HomeResult home = SolveHome(mechanism, rules.assembly);
  if (!home.unmet.empty()) return ReportUnmet(*mechanism, home, report);
  if (home.closed) {
    if (home.guesses_moved) {
      WarnAboutAssembly(*mechanism, home, report);
    } else if (home.drives_moved) {
      WarnAboutMovedDrives(*mechanism, report);
    }
    return;
  }
  const double gap_m = home.gap * CharacteristicLength(*mechanism);
  const int redundant = CountNearlyRedundant(*mechanism, home.gap);
  if (redundant > 0 && gap_m <= rules.tolerance_m &&
      ProjectRoundedData(rules, home, mechanism, report)) {
    return;
  }
  if (rules.bare_urdf && TakeNamedBalls(mechanism, report)) return;
  std::string hint = "improve the guesses of the loop's joints, or look for a wrong length or axis";
  if (rules.bare_urdf) hint += "; " + WhatWouldClose(*mechanism, home);
  if (redundant > 0) {
    hint = fmt::format(
        "the loops are overconstrained by {} and closed except for {:.2g} m: rounded data? More "
        "digits close them; `closure_tolerance: {:.0e}` in the model moves the joint frames by as "
        "little as closes them",
        redundant, gap_m, 2 * gap_m);
  }
  CheckAxes(*mechanism, false, report);
  ReportGaps(rules, *mechanism, home, hint, report);
}

}  // namespace mbv::internal
