#include "comparison/driven.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "comparison/attribution.h"
#include "comparison/verdict.h"
#include "mechanism/reach.h"

namespace mbv {

namespace {

using internal::Failed;

bool IsMotion(Metric metric) {
  return IsTrajectory(metric) || metric == Metric::kVelocity || metric == Metric::kAcceleration ||
         metric == Metric::kReaction || metric == Metric::kReactionOwn ||
         metric == Metric::kBaseForce;
}

std::string Amount(const CheckResult& check) {
  const char* unit = RowOf(check.metric).unit;
  return fmt::format("{:.1e}{}{}", check.value, *unit == '\0' ? "" : " ", unit);
}

double UseOf(const CheckResult& check) {
  if (std::isnan(check.value)) return 1e300;
  return check.value == 0.0 ? 0.0 : check.value / *check.limit;
}

bool IsPlace(const CheckResult& check) {
  return IsTrajectory(check.metric) || check.metric == Metric::kCommandM ||
         check.metric == Metric::kCommandRad;
}

bool IsOf(const CheckResult& check, const std::string& a, const std::string& b) {
  return (check.measured == a && check.truth == b) || (check.measured == b && check.truth == a);
}

// The simulation's check of lengths and angles that is worst against its limit, held against the
// command and the driver; what it is held against otherwise may be wrong itself.
const CheckResult* WorstPlace(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* worst = nullptr;
  for (const CheckResult& check : comparison.checks) {
    if (!IsEngine(check.measured) || !check.limit || !IsPlace(check)) continue;
    if (check.of_pair() && check.truth != input.driven_by) continue;
    if (worst == nullptr || UseOf(check) > UseOf(*worst)) worst = &check;
  }
  return worst;
}

// Of the simulation's failed checks of motion against the command and the driver the worst; places
// rather than rates, and what has a measure of growth rather than what has none.
const CheckResult* WorstLeaving(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* worst = nullptr;
  const auto rank = [](const CheckResult& check) {
    return std::tuple(*check.limit > 0.0, IsPlace(check), UseOf(check));
  };
  for (const CheckResult& check : comparison.checks) {
    if (!IsEngine(check.measured) || !Failed(&check)) continue;
    const bool of_command = !check.of_pair() && IsCommand(check.metric);
    const bool of_driver = check.truth == input.driven_by &&
                           (IsTrajectory(check.metric) || IsDriveMotion(check.metric));
    if (!of_command && !of_driver) continue;
    if (worst == nullptr || rank(check) > rank(*worst)) worst = &check;
  }
  return worst;
}

// The worst failed check between two computations: of forces, else of motion.
const CheckResult* WorstDifference(const Comparison& comparison, const std::string& a,
                                   const std::string& b) {
  const CheckResult* worst = nullptr;
  const auto rank = [](const CheckResult& check) {
    const bool rms = check.metric == Metric::kForceNrmse;
    return std::tuple(IsDriveForce(check.metric), rms, UseOf(check));
  };
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || !IsOf(check, a, b)) continue;
    if (!IsDriveForce(check.metric) && !IsDriveMotion(check.metric)) continue;
    if (worst == nullptr || rank(check) > rank(*worst)) worst = &check;
  }
  return worst;
}

const CheckResult* FindOf(const Comparison& comparison, const std::string& a, const std::string& b,
                          Metric metric) {
  for (const CheckResult& check : comparison.checks) {
    if (check.metric == metric && IsOf(check, a, b)) return &check;
  }
  return nullptr;
}

// Another witness that has computed the driver's motion and forces: the reference, a closed form,
// else a program outside. "" if there is none.
std::string OtherThan(const std::string& driver, const Comparison& comparison) {
  for (const PairComparison& pair : comparison.pairs) {
    if (!pair.compared || IsEngine(pair.measured) || pair.truth == role::kReached) continue;
    if (pair.measured == driver) return pair.truth;
    if (pair.truth == driver) return pair.measured;
  }
  return "";
}

// By which share of their RMS the driver's forces would have to be wrong to lead the simulation as
// far from it and from the command as it is: by the most sensitive check, whatever its verdict.
double ForceErrorSeen(const ComparisonInput& input, const Comparison& comparison) {
  double most = 0.0;
  for (const CheckResult& check : comparison.checks) {
    if (!IsEngine(check.measured) || check.truth != input.driven_by || !check.limit) continue;
    if (!IsTrajectory(check.metric) && !IsDriveMotion(check.metric)) continue;
    if (check.value == 0.0) continue;
    most = std::max(most, UseOf(check) * input.perturbation);
  }
  return most;
}

// What agrees must agree this much better than the third one differs.
bool IsNothingBeside(double near, double far) { return near * kClearlyFarther <= far; }

std::string Astray(const ComparisonInput& input, const CheckResult& check) {
  if (!(*check.limit > 0.0)) return "";
  const char* unit = RowOf(check.metric).unit;
  return fmt::format("; forces perturbed by {:.0e} would make it deviate by {:.1e}{}{}",
                     input.perturbation, *check.limit, *unit == '\0' ? "" : " ", unit);
}

// "drive force, RMS, by 1.2e-04, worst at leg1.force, t = 0.2 s"
std::string DifferenceText(const CheckResult& check) {
  return fmt::format("{} by {}, worst at {}", RowOf(check.metric).title, Amount(check),
                     internal::ChannelAndTime(check.channel, check.time_s));
}

// The simulation goes where the driver's forces lead it, so that it judges these forces; the other
// computation judges them, too:
//
//   the other differs   the simulation leaves the command   wrong is
//   yes                 yes                                 the driver
//   no                  yes                                 the simulation
//   yes                 no                                  the other, if the simulation could have
//                                                           seen a force error of that size
Attribution AttributeForceDriven(const ComparisonInput& input, const Comparison& comparison) {
  const std::string& driver = input.driven_by;
  if (comparison.verdict == Verdict::kAgree) {
    const CheckResult* worst = WorstPlace(input, comparison);
    if (worst == nullptr) return {};
    return {"",
            fmt::format("driven by the {} forces in open loop for {:g} s, the simulation stays "
                        "within {} of the commanded motion{}",
                        driver, input.motion->duration_s, Amount(*worst), Astray(input, *worst))};
  }
  const std::string other = OtherThan(driver, comparison);
  const CheckResult* leaves = WorstLeaving(input, comparison);
  const CheckResult* differ = other.empty() ? nullptr : WorstDifference(comparison, driver, other);
  if (leaves == nullptr && differ == nullptr) return {};
  const std::string name = internal::NameOf(comparison, other);
  if (leaves != nullptr) {
    const std::string text = fmt::format(
        "driven by the {} forces, the simulation leaves the commanded motion: {} {} at {}{}",
        driver, RowOf(leaves->metric).title, Amount(*leaves),
        internal::ChannelAndTime(leaves->channel, leaves->time_s), Astray(input, *leaves));
    if (other.empty()) {
      return {"", text +
                      "; a third witness would show whether the forces or the simulated model "
                      "are wrong"};
    }
    if (differ == nullptr) {
      const CheckResult* forces = FindOf(comparison, driver, other, Metric::kForceNrmse);
      return {leaves->measured,
              fmt::format("{} and {} agree on the drive forces{}, but {}", driver, name,
                          forces == nullptr ? "" : " to " + Amount(*forces), text)};
    }
    return {driver, fmt::format("{}; {} differs from {}, too: {}", text, name, driver,
                                DifferenceText(*differ))};
  }
  const std::string text =
      fmt::format("{} and {} differ in {}", name, driver, DifferenceText(*differ));
  double seen = ForceErrorSeen(input, comparison);
  if (!IsDriveForce(differ->metric)) {
    const CheckResult* simulated =
        FindOf(comparison, role::kSimulated.name, driver, differ->metric);
    seen = simulated == nullptr ? kNan : simulated->value;
  }
  const CheckResult* rms = FindOf(comparison, driver, other, Metric::kForceNrmse);
  const double size = IsDriveForce(differ->metric) && rms != nullptr ? rms->value : differ->value;
  const bool confirms = IsNothingBeside(seen, size) || std::isnan(size);
  if (!confirms) {
    return {"", fmt::format("{}; the simulation, driven by the {} forces, stays within its limits: "
                            "it does not resolve a difference so small",
                            text, driver)};
  }
  return {other,
          fmt::format("{}; the simulation, driven by the {} forces, stays on the commanded motion: "
                      "forces wrong by {:.1e} would lead it as far off as it is",
                      text, driver, seen),
          Attribution::Split{.agree = {role::kSimulated.name, driver},
                             .agree_to = seen,
                             .differs = other,
                             .differs_by = size,
                             .measure = RowOf(differ->metric).title,
                             .unit = RowOf(differ->metric).unit}};
}

// Judged both between the two computations and on the motion that servos reached, what is reported
// apart there: drive forces, else reactions.
constexpr Metric kOfForces[] = {Metric::kForceNrmse, Metric::kForceOwn,    Metric::kForceMax,
                                Metric::kReaction,   Metric::kReactionOwn, Metric::kBaseForce};

std::string TrackingText(const Comparison& comparison) {
  for (const Role* truth : {&role::kAnalytic, &role::kReference}) {
    const auto find = [&](Metric metric) {
      return comparison.FindCheck(role::kSimulated, *truth, metric);
    };
    const CheckResult* tracking = find(Metric::kPositionM);
    if (tracking == nullptr) tracking = find(Metric::kPositionRad);
    const CheckResult* cost = find(Metric::kForceNrmse);
    if (tracking == nullptr || cost == nullptr) continue;
    return fmt::format(
        "; they follow the command to {}, with forces that differ from the "
        "commanded motion's by {}",
        Amount(*tracking), Amount(*cost));
  }
  return "";
}

// The reference stands between the two others: it is held against the simulation on the motion that
// the servos reached, and against the closed form on the commanded one.
//
//   differs on the reached motion   differs from the closed form   wrong is
//   yes                             no                             the simulation
//   no                              yes                            the closed form
//   yes, by as much                 yes                            the reference
Attribution AttributeServo(const Comparison& comparison) {
  for (const Metric metric : kOfForces) {
    const CheckResult* reached = comparison.FindCheck(role::kSimulated, role::kReached, metric);
    const CheckResult* computed = comparison.FindCheck(role::kReference, role::kAnalytic, metric);
    if (reached == nullptr || (!Failed(reached) && !Failed(computed))) continue;
    const std::string there = fmt::format(
        "on the motion that the servos reached, simulation and reference {}",
        Failed(reached) ? "differ in " + DifferenceText(*reached) : "agree to " + Amount(*reached));
    if (computed == nullptr) {
      return {"", there + "; a third witness would show which one is wrong"};
    }
    const std::string text =
        fmt::format("{}; on the commanded motion analytic and reference {}", there,
                    Failed(computed) ? "differ in " + DifferenceText(*computed)
                                     : "agree to " + Amount(*computed));
    Attribution::Split split{.measure = RowOf(metric).title, .unit = RowOf(metric).unit};
    const auto stands_alone = [&](const Role& odd, const Role& with, const CheckResult& near,
                                  const CheckResult& far) -> Attribution {
      split.agree = {role::kReference.name, with.name};
      split.agree_to = near.value;
      split.differs = odd.name;
      split.differs_by = far.value;
      return {odd.name, text, split};
    };
    if (Failed(reached) && IsNothingBeside(computed->value, reached->value)) {
      return stands_alone(role::kSimulated, role::kAnalytic, *computed, *reached);
    }
    if (Failed(computed) && IsNothingBeside(reached->value, computed->value)) {
      return stands_alone(role::kAnalytic, role::kSimulated, *reached, *computed);
    }
    if (Failed(reached) && Failed(computed)) {
      return {role::kReference.name, text + ": the reference differs from both"};
    }
    return {"", text + ": on the reached motion a difference so small is not resolved"};
  }
  if (comparison.verdict != Verdict::kAgree) return {};
  const CheckResult* reached =
      comparison.FindCheck(role::kSimulated, role::kReached, Metric::kForceNrmse);
  if (reached == nullptr) return {};
  return {"",
          fmt::format("on the motion that the servos reached, simulation and reference agree to "
                      "{}{}",
                      Amount(*reached), TrackingText(comparison))};
}

}  // namespace

bool SharesForces(const ComparisonInput& input, const std::string& measured,
                  const std::string& truth) {
  return input.mode == DriveMode::kForceDriven && IsEngine(measured) && truth != role::kReached;
}

LimitColumn ColumnOfPair(const ComparisonInput& input, const std::string& measured,
                         const std::string& truth) {
  for (const Witness& witness : input.witnesses) {
    const bool of_pair = witness.name == measured || witness.name == truth;
    // The looser limits of the two.
    if (of_pair && witness.foreign && witness.foreign->limits != LimitColumn::kReference) {
      return witness.foreign->limits;
    }
  }
  if (!IsEngine(measured)) return LimitColumn::kReference;
  const bool servo = input.mode == DriveMode::kServo && truth != role::kReached;
  return servo ? LimitColumn::kServo : input.simulation_limits;
}

std::map<Metric, double> GrowthLimits(const ComparisonInput& input, const Trace& simulated) {
  std::map<Metric, double> limits;
  if (input.mode != DriveMode::kForceDriven) return limits;
  PairComparison growth;
  if (input.perturbed != nullptr) growth = ComparePair(input, *input.perturbed, simulated);
  for (const MetricRow& row : MetricRows()) {
    if (!IsMotion(row.metric)) continue;
    const auto found = growth.metrics.find(row.metric);
    limits[row.metric] = found == growth.metrics.end() ? kNan : found->second.value;
  }
  return limits;
}

std::map<Metric, double> CommandGrowth(const ComparisonInput& input,
                                       const WitnessMetrics& simulated) {
  std::map<Metric, double> limits;
  if (input.mode != DriveMode::kForceDriven) return limits;
  WitnessMetrics perturbed;
  if (input.perturbed != nullptr) perturbed = MeasureWitness(input, *input.perturbed);
  for (const auto& [metric, measured] : simulated.metrics) {
    if (!IsCommand(metric)) continue;
    const auto found = perturbed.metrics.find(metric);
    limits[metric] =
        found == perturbed.metrics.end() ? kNan : std::abs(found->second.value - measured.value);
  }
  return limits;
}

void ApplyOther(const OtherLimits& other, const ComparisonInput& input, CheckResult* check) {
  const auto tube = other.tubes.find(check->metric), growth = other.growth.find(check->metric);
  if (!check->limit) return;
  if (tube != other.tubes.end() && tube->second > *check->limit) {
    check->stated_limit = check->limit;
    check->limit = tube->second;
    check->limit_by = "the table's uncertainty";
  } else if (growth != other.growth.end()) {
    check->stated_limit = check->limit;
    check->limit = growth->second;
    check->limit_by = fmt::format("forces perturbed by {:.0e}", input.perturbation);
  } else if (other.integrated && IsTrajectory(check->metric)) {
    const bool metres = std::string(RowOf(check->metric).unit) == "m";
    const double error =
        input.integration_error * (metres ? CharacteristicLength(*input.mechanism) : 1.0);
    if (!(error > *check->limit)) return;
    check->stated_limit = check->limit;
    check->limit = error;
    check->limit_by = "the error that the reference states of itself";
    check->limit_is_integration_error = true;
  }
}

void LeaveOutReachedMotion(PairComparison* pair) {
  if (pair->truth != role::kReached) return;
  for (const Metric metric :
       {Metric::kPositionM, Metric::kPositionRad, Metric::kVelocity, Metric::kAcceleration}) {
    pair->metrics.erase(metric);
  }
}

bool IsEvidence(const ComparisonInput& input, const CheckResult& check) {
  if (!check.limit) return false;
  if (input.of_stiffness) {
    return check.metric == Metric::kStiffnessEntry || check.metric == Metric::kComplianceEntry;
  }
  if (input.motion->free()) return IsTrajectory(check.metric);
  switch (input.mode) {
    case DriveMode::kForceDriven:
      return IsTrajectory(check.metric) && check.of_pair() && IsEngine(check.measured);
    case DriveMode::kServo:
      return IsDriveForce(check.metric) && check.truth == role::kReached;
    case DriveMode::kInverse:
    case DriveMode::kPrescribedMotion:
      return IsDriveForce(check.metric);
  }
  return false;
}

std::string HorizonTooLongReason(const ComparisonInput& input, const Comparison& comparison) {
  constexpr double kMost = 1e-2;  // of a radian or of the characteristic length
  if (input.mode != DriveMode::kForceDriven) return "";
  if (input.perturbed == nullptr) {
    return "the run with perturbed forces failed, so errors have no measure";
  }
  const double length_m = CharacteristicLength(*input.mechanism);
  for (const CheckResult& check : comparison.checks) {
    if (!check.limit || !IsTrajectory(check.metric)) continue;
    if (!check.of_pair() || !IsEngine(check.measured)) continue;
    const double size = *RowOf(check.metric).unit == 'm' ? length_m : 1.0;
    if (!(*check.limit > kMost * size)) continue;  // one that is not a number fails its check
    return fmt::format(
        "{:g} s are too long to drive this mechanism in open loop: forces perturbed by "
        "{:.0e} make it deviate by {:.2g} {}",
        input.motion->duration_s, input.perturbation, *check.limit, RowOf(check.metric).unit);
  }
  return "";
}

Attribution AttributeDriven(const ComparisonInput& input, const Comparison& comparison) {
  if (input.motion->free()) return {};
  switch (input.mode) {
    case DriveMode::kForceDriven:
      return AttributeForceDriven(input, comparison);
    case DriveMode::kServo:
      return AttributeServo(comparison);
    case DriveMode::kInverse:
    case DriveMode::kPrescribedMotion:
      return {};
  }
  return {};
}

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
          "prescribes the simulation's drives",
          driver);
    }
    return fmt::format(
        "the drive forces that the {} computes drive the simulation in open loop from "
        "the commanded start; nothing prescribes its drives",
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
