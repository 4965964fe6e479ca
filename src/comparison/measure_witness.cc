// What one witness shows by itself: commands followed, loops closed, power balanced, and rates
// that are the derivatives of their positions.
#include <cmath>

#include "comparison/comparison.h"
#include "comparison/derivatives.h"
#include "comparison/drive_motion.h"
#include "comparison/energy_audit.h"
#include "comparison/force_scale.h"
#include "comparison/motor_load.h"
#include "mechanism/followed_state.h"

namespace mbv {
namespace {

// What a coordinate and its rates are recorded as.
struct Recorded {
  Quantity drive, output, joint;
};
constexpr Recorded kValue{Quantity::kPosition, Quantity::kPose, Quantity::kJointPosition};
constexpr Recorded kRate{Quantity::kVelocity, Quantity::kPoseVelocity, Quantity::kJointVelocity};
constexpr Recorded kRate2{Quantity::kAcceleration, Quantity::kPoseAcceleration,
                          Quantity::kJointAcceleration};

// -1 where it is not recorded.
int ColumnOf(const Mechanism& mechanism, const Coordinate& coordinate, const Recorded& as,
             const Trace& trace) {
  const auto index = static_cast<size_t>(coordinate.index);
  switch (coordinate.kind) {
    case Coordinate::Kind::kDrive:
      return trace.Find(as.drive, mechanism.drives[index].name);
    case Coordinate::Kind::kOutput:
      return trace.Find(as.output, mechanism.outputs[index].name, coordinate.component);
    case Coordinate::Kind::kJoint:
      return trace.Find(as.joint, NameOf(mechanism, coordinate));
    case Coordinate::Kind::kPrescribed:
      return -1;
  }
  return -1;
}

// Columns of all terms of a command, or nothing if one of them is not recorded.
std::optional<std::vector<int>> ColumnsOf(const Mechanism& mechanism, const Command& command,
                                          const Trace& trace, const Recorded& as = kValue) {
  std::vector<int> columns;
  for (const Command::Term& term : command.terms) {
    columns.push_back(ColumnOf(mechanism, term.coordinate, as, trace));
    if (columns.back() < 0) return {};
  }
  return columns;
}

// Σ factor · channel in one row.
double ValueOf(const Trace& trace, const Command& command, const std::vector<int>& columns,
               Eigen::Index row) {
  double value = 0.0;
  for (size_t k = 0; k < columns.size(); ++k) {
    value += command.terms[k].factor * trace.values(row, columns[k]);
  }
  return value;
}

void MeasureCommands(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  for (const Command& command : input.motion->commands) {
    const auto columns = ColumnsOf(*input.mechanism, command, trace);
    if (!columns || columns->empty()) continue;
    const bool angle = trace.channels[static_cast<size_t>(columns->front())].unit == "rad";
    const Metric metric = angle ? Metric::kCommandRad : Metric::kCommandM;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const double value = ValueOf(trace, command, *columns, static_cast<Eigen::Index>(i));
      const double wanted = Evaluate(command.profile, trace.time_s[i]).value;
      const double error = angle ? AngleDifference(value, wanted) : value - wanted;
      KeepWorst(&out->metrics[metric], std::abs(error), trace.time_s[i], command.name);
    }
  }
}

// Rates or accelerations of commanded outputs and passive joints against their commands, pooled per
// unit. A command that holds still is judged by what counts as rest beside the drives' motion.
void MeasureCommandRates(const ComparisonInput& input, const Trace& trace, Metric metric,
                         WitnessMetrics* out) {
  const bool velocity = metric == Metric::kCommandVelocity;
  std::map<bool, ErrorSum> sums;  // by angle
  for (const Command& command : input.motion->commands) {
    const Coordinate& first = command.terms.front().coordinate;
    if (!IsOfTask(first)) continue;
    const auto columns = ColumnsOf(*input.mechanism, command, trace, velocity ? kRate : kRate2);
    if (!columns) continue;
    ErrorSum& sum = sums[!IsLength(*input.mechanism, first)];
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const Jet jet = Evaluate(command.profile, trace.time_s[i]);
      const double wanted = velocity ? jet.rate : jet.acceleration;
      const double value = ValueOf(trace, command, *columns, static_cast<Eigen::Index>(i));
      sum.Add(value - wanted, wanted, trace.time_s[i], command.name);
    }
  }
  for (const auto& [angle, sum] : sums) {
    const RestFloor rest = RestFloorOf(input, angle ? "rad" : "m", trace);
    KeepWorst(&out->metrics[metric],
              sum.MeasuredNrmse(velocity ? rest.velocity : rest.acceleration));
  }
}

// The start of a free motion against the given start values.
void MeasureStart(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  if (trace.time_s.empty() || trace.time_s.front() != 0.0) return;
  for (const InitialValue& value : input.motion->initial) {
    const int column = ColumnOf(*input.mechanism, value.coordinate, kValue, trace);
    if (column < 0) continue;
    const bool angle = trace.channels[static_cast<size_t>(column)].unit == "rad";
    const double error = angle ? AngleDifference(trace.values(0, column), value.position)
                               : trace.values(0, column) - value.position;
    KeepWorst(&out->metrics[angle ? Metric::kCommandRad : Metric::kCommandM], std::abs(error), 0.0,
              value.name);
  }
}

void MeasureClosure(const Trace& trace, WitnessMetrics* out) {
  for (const auto& [quantity, metric] : {std::pair{Quantity::kLoopGap, Metric::kClosureM},
                                         std::pair{Quantity::kLoopTwist, Metric::kClosureRad}}) {
    const std::string name = ChannelName(quantity);
    const int column = trace.Find(name);
    if (column < 0) continue;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      KeepWorst(&out->metrics[metric], std::abs(trace.values(static_cast<Eigen::Index>(i), column)),
                trace.time_s[i], name);
    }
  }
}

// Input without the word of the witness for it: what the recorded forces do at the recorded
// velocities. Nothing where the trace lacks a part.
std::optional<VecX> InputOf(const Mechanism& mechanism, const Trace& trace) {
  VecX input = VecX::Zero(trace.values.rows());
  for (const Drive& drive : mechanism.drives) {
    const int force = trace.Find(Quantity::kForce, drive.name);
    const int velocity = trace.Find(Quantity::kVelocity, drive.name);
    if (force < 0 || velocity < 0) return {};
    input += trace.values.col(force).cwiseProduct(trace.values.col(velocity));
  }
  for (const Quantity part : {Quantity::kBasePower, Quantity::kLoadPower, Quantity::kDamperPower}) {
    const int column = trace.Find(part);
    if (column < 0) return {};
    input += trace.values.col(column);
  }
  return input;
}

// Where power flows within the mechanism and little comes in, the flow is the scale: what gravity
// and springs exchange with the motion, and the kinetic energy per duration. A base that moves
// bodies which no drive carries has power of its own, which must not hide what the drives do: flows
// count up to what the carried bodies can take.
struct PowerSize {
  double scale = 0.0;     // of the balance [W]
  double roundoff = 0.0;  // that the base's power leaves
};
PowerSize SizeOfPower(const ComparisonInput& input, const Trace& trace) {
  constexpr double kRoundings = 16.0;
  const ForceScale force = ForceScaleOf(input, trace);
  const auto largest = [&](Quantity quantity, const std::string& subject = "") {
    const int column = trace.Find(quantity, subject);
    return column < 0 ? 0.0 : trace.values.col(column).cwiseAbs().maxCoeff();
  };
  double flow = 0.0;
  for (const Quantity power :
       {Quantity::kInputPower, Quantity::kEnergyRate, Quantity::kBasePower, Quantity::kLoadPower,
        Quantity::kDamperPower, Quantity::kGravityPower, Quantity::kSpringPower}) {
    flow = std::max(flow, largest(power));
  }
  const double duration_s = trace.time_s.back() - trace.time_s.front();
  if (duration_s > 0.0) flow = std::max(flow, largest(Quantity::kKineticEnergy) / duration_s);
  // A mechanism at rest has no power: forces count at the speed of rest.
  double scale = RestFloorOf(input, "m").velocity * ForceScale::kIdle * force.force_N;
  double carried = force.power_W;
  for (const Drive& drive : input.mechanism->drives) {
    const double rest = RestFloorOf(input, PositionUnit(*input.mechanism, drive)).velocity;
    const int f = trace.Find(Quantity::kForce, drive.name);
    const int v = trace.Find(Quantity::kVelocity, drive.name);
    scale = std::max(scale, rest * largest(Quantity::kForce, drive.name));
    if (f < 0 || v < 0) continue;
    carried = std::max(carried,
                       trace.values.col(f).cwiseProduct(trace.values.col(v)).cwiseAbs().maxCoeff());
  }
  const bool base = !input.mechanism->prescribed.empty();
  return {std::max(scale, std::min(flow, carried)), base ? kRoundings * kEps * flow : 0.0};
}

void MeasurePower(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  const std::string name = ChannelName(Quantity::kInputPower);
  const int in = trace.Find(name), rate = trace.Find(Quantity::kEnergyRate);
  if (in < 0 || rate < 0 || trace.time_s.empty()) return;
  const PowerSize size = SizeOfPower(input, trace);
  std::vector<VecX> inputs = {trace.values.col(in)};
  if (auto recorded = InputOf(*input.mechanism, trace)) inputs.push_back(*std::move(recorded));
  for (const VecX& power : inputs) {
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double error = std::abs(power[row] - trace.values(row, rate)) - size.roundoff;
      KeepWorst(&out->metrics[Metric::kPower], error <= 0.0 ? 0.0 : error / size.scale,
                trace.time_s[i], name);
    }
  }
}

// The hardest used motor, where a margin is required.
void MeasureMotors(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  if (!input.limits[Metric::kMotorUse].reference) return;
  for (const Motor& motor : input.mechanism->motors) {
    const MotorLoad load = MotorLoadOf(*input.mechanism, motor, trace);
    if (!load.known()) continue;
    KeepWorst(&out->metrics[Metric::kMotorUse], load.largest_use(), load.largest_use_time_s(),
              load.drive);
  }
}

}  // namespace

WitnessMetrics MeasureWitness(const ComparisonInput& input, const Trace& trace) {
  WitnessMetrics metrics{.witness = trace.witness, .metrics = {}};
  MeasureCommands(input, trace, &metrics);
  // A table follows a motion; it has no bodies, and its digits leave no derivatives to check.
  if (input.table != nullptr && trace.witness == role::kReference) return metrics;
  MeasureCommandRates(input, trace, Metric::kCommandVelocity, &metrics);
  MeasureCommandRates(input, trace, Metric::kCommandAcceleration, &metrics);
  MeasureClosure(trace, &metrics);
  MeasurePower(input, trace, &metrics);
  MeasureMotors(input, trace, &metrics);
  if (input.motion->free()) MeasureStart(input, trace, &metrics);
  const bool engine = IsEngine(trace.witness);
  const LimitColumn column = engine ? input.simulation_limits : LimitColumn::kReference;
  metrics.energy = AuditEnergy(input, trace, input.limits[Metric::kEnergy].Of(column));
  // Work from samples has their error; only integrated work is judged.
  if (metrics.energy && metrics.energy->integrated) {
    metrics.metrics[Metric::kEnergy] = metrics.energy->drift;
  }
  // An integrated velocity carries the integrator's error; only computed ones are checked.
  if (!engine) MeasureDerivatives(input, trace, &metrics);
  return metrics;
}

}  // namespace mbv
