#include "report/load_figures.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "comparison/force_band.h"

namespace mbv {
namespace {

LoadSignal SignalOf(const Trace& trace, Quantity quantity, const std::string& subject,
                    int component = -1) {
  const int column = trace.Find(quantity, subject, component);
  if (column < 0) return {};
  return {trace.values.col(column), trace.channels[static_cast<size_t>(column)].unit};
}

// A drive's force, at rest the end of its band that is farther from zero; empty without any.
VecX WorstForce(const Trace& trace, const std::string& drive) {
  const int column = trace.Find(Quantity::kForce, drive);
  return column < 0 ? VecX() : ForceSignal(trace, column).Worst();
}

DriveLoad DriveLoadOf(const WitnessRecord& record, const std::string& drive) {
  const Trace& trace = record.trace;
  DriveLoad load{.drive = drive, .witness = record.name};
  const LoadSignal force = SignalOf(trace, Quantity::kForce, drive);
  const LoadSignal velocity = SignalOf(trace, Quantity::kVelocity, drive);
  const LoadSignal position = SignalOf(trace, Quantity::kPosition, drive);
  load.force = FiguresOf(trace.time_s, WorstForce(trace, drive), force.unit);
  load.speed = FiguresOf(trace.time_s, velocity.values, velocity.unit);
  if (force.values.size() > 0 && velocity.values.size() > 0) {
    load.power = FiguresOf(trace.time_s, force.values.cwiseProduct(velocity.values), "W");
  }
  double low = kNan, high = kNan;
  for (const double value : position.values) {
    low = std::fmin(low, value);
    high = std::fmax(high, value);
  }
  load.stroke = high - low;
  load.stroke_unit = position.unit;
  return load;
}

// All joints of which some witness records the reaction, each once.
std::vector<std::string> JointsOf(const Report& report) {
  std::vector<std::string> joints;
  for (const WitnessRecord& record : report.witnesses) {
    for (const Channel& channel : record.trace.channels) {
      if (channel.quantity != Quantity::kReaction || channel.component != 0) continue;
      if (std::find(joints.begin(), joints.end(), channel.subject) == joints.end()) {
        joints.push_back(channel.subject);
      }
    }
  }
  return joints;
}

bool IsOpen(const Report& report, const std::string& joint) {
  for (int c = 0; c < 6; ++c) {
    const std::string channel = ChannelName(Quantity::kReaction, joint, c);
    if (Contains(report.reactions_not_unique, channel)) return true;
  }
  return false;
}

}  // namespace

LoadSignal ReactionMagnitude(const Trace& trace, const std::string& joint, int first) {
  VecX squares;
  std::string unit;
  for (int c = first; c < first + 3; ++c) {
    const LoadSignal component = SignalOf(trace, Quantity::kReaction, joint, c);
    if (component.values.size() == 0) return {};
    if (squares.size() == 0) squares = VecX::Zero(component.values.size());
    squares += component.values.cwiseAbs2();
    unit = component.unit;
  }
  return {squares.cwiseSqrt(), unit};
}

Figures FiguresOf(const std::vector<double>& time_s, const VecX& values, const std::string& unit) {
  Figures figures{.unit = unit};
  double span_s = 0.0, integral = 0.0, squares = 0.0;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const auto k = static_cast<size_t>(i);
    if (!std::isfinite(values[i])) continue;
    if (!(std::abs(values[i]) <= std::abs(figures.peak))) {
      figures.peak = values[i];
      figures.time_s = time_s[k];
    }
    if (i == 0 || !std::isfinite(values[i - 1])) continue;
    const double dt = time_s[k] - time_s[k - 1];
    span_s += dt;
    integral += 0.5 * dt * (values[i - 1] + values[i]);
    squares += 0.5 * dt * (values[i - 1] * values[i - 1] + values[i] * values[i]);
  }
  // A single sample is all there is.
  figures.mean = span_s > 0.0 ? integral / span_s : figures.peak;
  figures.rms = span_s > 0.0 ? std::sqrt(squares / span_s) : std::abs(figures.peak);
  return figures;
}

LoadFigures LoadFiguresOf(const Report& report) {
  std::vector<const WitnessRecord*> ran;
  for (const WitnessRecord& record : report.witnesses) {
    if (record.summary.ok() && !record.trace.time_s.empty()) ran.push_back(&record);
  }
  LoadFigures loads;
  for (const WitnessMetrics& witness : report.comparison.witnesses) {
    if (witness.unresolved.empty()) continue;
    loads.unresolved.emplace_back(witness.witness, witness.unresolved);
  }
  for (const std::string& drive : report.drives) {
    for (const WitnessRecord* record : ran) {
      DriveLoad load = DriveLoadOf(*record, drive);
      if (!load.force.unit.empty()) loads.drives.push_back(std::move(load));
    }
  }
  for (const std::string& joint : JointsOf(report)) {
    for (const WitnessRecord* record : ran) {
      const Trace& trace = record->trace;
      const LoadSignal force = ReactionMagnitude(trace, joint, 0);
      const LoadSignal moment = ReactionMagnitude(trace, joint, 3);
      if (force.values.size() + moment.values.size() == 0) continue;
      loads.joints.push_back({.joint = joint,
                              .witness = record->name,
                              .force = FiguresOf(trace.time_s, force.values, force.unit),
                              .moment = FiguresOf(trace.time_s, moment.values, moment.unit),
                              .not_unique = IsOpen(report, joint)});
    }
  }
  return loads;
}

}  // namespace mbv
