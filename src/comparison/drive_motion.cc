#include "comparison/drive_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace mbv {
namespace {

bool IsOfDrives(const Command& command) {
  return std::all_of(command.terms.begin(), command.terms.end(), [](const Command::Term& term) {
    return term.coordinate.kind == Coordinate::Kind::kDrive;
  });
}

// Per drive: its motion follows from commands of drives alone.
std::vector<bool> CommandedDrives(const ComparisonInput& input) {
  const auto drives = static_cast<Eigen::Index>(input.mechanism->drives.size());
  std::vector<VecX> rows;
  for (const Command& command : input.motion->commands) {
    if (!IsOfDrives(command)) continue;
    rows.emplace_back(VecX::Zero(drives));
    for (const Command::Term& term : command.terms) {
      rows.back()[term.coordinate.index] += term.factor;
    }
  }
  MatX transposed(drives, static_cast<Eigen::Index>(rows.size()));
  for (size_t k = 0; k < rows.size(); ++k) {
    transposed.col(static_cast<Eigen::Index>(k)) = rows[k];
  }
  std::vector<bool> commanded(static_cast<size_t>(drives), false);
  if (rows.empty()) return commanded;
  const Eigen::ColPivHouseholderQR<MatX> qr(transposed);
  for (Eigen::Index d = 0; d < drives; ++d) {
    const VecX unit = VecX::Unit(drives, d);
    commanded[static_cast<size_t>(d)] = (transposed * qr.solve(unit) - unit).norm() < 1e-9;
  }
  return commanded;
}

// All drives that a metric is about are commanded as such.
bool AllCommanded(const ComparisonInput& input, Metric metric) {
  const std::vector<bool> commanded = CommandedDrives(input);
  bool any = false;
  for (size_t d = 0; d < commanded.size(); ++d) {
    const bool angle = PositionUnit(*input.mechanism, input.mechanism->drives[d]) == "rad";
    if (metric == Metric::kPositionM && angle) continue;
    if (metric == Metric::kPositionRad && !angle) continue;
    if (!commanded[d]) return false;
    any = true;
  }
  return any;
}

// All commands that a witness can be held against are about drives.
bool OnlyDriveCommands(const ComparisonInput& input, Metric metric) {
  for (const Command& command : input.motion->commands) {
    const Coordinate& first = command.terms.front().coordinate;
    const bool angle = !IsLength(*input.mechanism, first);
    const bool recorded =
        std::none_of(command.terms.begin(), command.terms.end(), [](const Command::Term& term) {
          return term.coordinate.kind == Coordinate::Kind::kPrescribed;
        });
    if (!recorded || angle != (metric == Metric::kCommandRad)) continue;
    if (!IsOfDrives(command)) return false;
  }
  return !input.motion->free();  // start values are measured, not followed
}

}  // namespace

bool IsOfTask(const Coordinate& coordinate) {
  return coordinate.kind == Coordinate::Kind::kOutput ||
         coordinate.kind == Coordinate::Kind::kJoint;
}

bool IsTaskSpace(const Motion& motion) {
  return std::any_of(motion.commands.begin(), motion.commands.end(), [](const Command& command) {
    return std::any_of(command.terms.begin(), command.terms.end(),
                       [](const Command::Term& term) { return IsOfTask(term.coordinate); });
  });
}

namespace {

// How the simulation is driven; "" without one.
std::string SimulationDriving(const ComparisonInput& input) {
  const auto simulated =
      std::find_if(input.witnesses.begin(), input.witnesses.end(),
                   [](const Witness& witness) { return IsEngine(witness.name); });
  if (simulated == input.witnesses.end() || simulated->trace == nullptr) return "";
  if (input.motion->free()) {
    return "free motion: the simulation starts from the state that the reference computes from the "
           "initial values; then forces alone move it";
  }
  if (!PrescribesMotion(input.mode)) {
    const char* driver =
        (input.driven_by == role::kAnalytic ? role::kAnalytic : role::kReference).method;
    if (input.mode == DriveMode::kServo) {
      return fmt::format(
          "MuJoCo's servos follow the drive motion that the {} computes; nothing else "
          "guides the simulation's drives",
          driver);
    }
    return fmt::format(
        "the drive forces that the {} computes push the simulation in open loop from "
        "the commanded start; nothing guides its drives",
        driver);
  }
  if (GivesAllDriveMotion(input)) {
    return "commanded in joint space, every computation is given the same drive motion";
  }
  const Role* driver = FindRole(input.driven_by);
  return fmt::format(
      "commanded in {}, the simulation follows the drive positions, rates and accelerations that "
      "the {} computes",
      !IsTaskSpace(*input.motion)              ? "joint space"
      : input.motion->RecordedJoints().empty() ? "task space"
                                               : "coordinates of passive joints",
      (driver == nullptr ? role::kSolver : *driver).method);
}

// "planar (planar.py 1) is given the same drive motion".
std::string ForeignDriving(const ComparisonInput& input) {
  std::string text;
  for (const Witness& witness : input.witnesses) {
    if (!witness.foreign || witness.trace == nullptr) continue;
    text += fmt::format("{}{} ({}) is given the {}", text.empty() ? "" : ", ", witness.name,
                        witness.foreign->program,
                        input.motion->free() ? "same start and forces" : "drive motion");
  }
  return text;
}

bool IsForeign(const ComparisonInput& input, const std::string& name) {
  return std::any_of(input.witnesses.begin(), input.witnesses.end(), [&](const Witness& witness) {
    return witness.foreign && witness.name == name;
  });
}

}  // namespace

std::string DrivingText(const ComparisonInput& input) {
  std::string text = SimulationDriving(input);
  const std::string foreign = ForeignDriving(input);
  return text + (text.empty() || foreign.empty() ? "" : "; ") + foreign;
}

bool GivesAllDriveMotion(const ComparisonInput& input) {
  const std::vector<bool> commanded = CommandedDrives(input);
  return std::find(commanded.begin(), commanded.end(), false) == commanded.end();
}

bool ComparesMotionWithItself(const ComparisonInput& input, const CheckResult& check) {
  const Metric metric = check.metric;
  const bool table = input.table != nullptr && check.Involves(role::kReference);
  const bool foreign = IsForeign(input, check.measured) || IsForeign(input, check.truth);
  const bool engine = IsEngine(check.measured) || IsEngine(check.truth);
  // Force-controlled drives and servos move as forces determine.
  const bool by_forces = !PrescribesMotion(input.mode) && engine;
  if (by_forces && metric != Metric::kDerivatives) return false;
  switch (metric) {
    case Metric::kPositionM:
    case Metric::kPositionRad:
    case Metric::kVelocity:
    case Metric::kAcceleration:
      if (!input.motion->free() && (engine || foreign)) return true;
      return !table && AllCommanded(input, metric);
    case Metric::kDerivatives:
      return AllCommanded(input, metric);
    case Metric::kCommandM:
    case Metric::kCommandRad:
      return !table && OnlyDriveCommands(input, metric);
    default:
      return false;
  }
}

}  // namespace mbv
