#include "report/load_figures.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace mbv {
namespace {

constexpr const char* kFirstReaction = ".reaction.fx";

// A channel and its unit; empty when the trace has none.
struct Signal {
  VecX values;
  std::string unit;
};
Signal SignalOf(const Trace& trace, const std::string& channel) {
  const int column = trace.Find(channel);
  if (column < 0) return {};
  return {trace.values.col(column), trace.channels[static_cast<size_t>(column)].unit};
}

DriveLoad DriveLoadOf(const WitnessRecord& record, const std::string& drive) {
  const Trace& trace = record.trace;
  DriveLoad load{.drive = drive, .witness = record.name};
  const Signal force = SignalOf(trace, drive + ".force");
  const Signal velocity = SignalOf(trace, drive + ".velocity");
  const Signal position = SignalOf(trace, drive + ".position");
  load.force = FiguresOf(trace.time_s, force.values, force.unit);
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

// Magnitude of three components; empty unless all are there.
Signal MagnitudeOf(const Trace& trace, const std::string& joint, const char* quantity) {
  VecX squares;
  std::string unit;
  for (const char* axis : {"x", "y", "z"}) {
    const Signal component = SignalOf(trace, joint + ".reaction." + quantity + axis);
    if (component.values.size() == 0) return {};
    if (squares.size() == 0) squares = VecX::Zero(component.values.size());
    squares += component.values.cwiseAbs2();
    unit = component.unit;
  }
  return {squares.cwiseSqrt(), unit};
}

// All joints of which some witness records the reaction, each once.
std::vector<std::string> JointsOf(const Report& report) {
  std::vector<std::string> joints;
  for (const WitnessRecord& record : report.witnesses) {
    for (const Channel& channel : record.trace.channels) {
      if (!channel.name.ends_with(kFirstReaction)) continue;
      std::string joint =
          channel.name.substr(0, channel.name.size() - std::string(kFirstReaction).size());
      if (std::find(joints.begin(), joints.end(), joint) == joints.end()) {
        joints.push_back(std::move(joint));
      }
    }
  }
  return joints;
}

bool IsOpen(const Report& report, const std::string& joint) {
  return std::any_of(
      report.reactions_not_unique.begin(), report.reactions_not_unique.end(),
      [&](const std::string& channel) { return channel.starts_with(joint + ".reaction."); });
}

}  // namespace

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
  for (const std::string& drive : report.drives) {
    for (const WitnessRecord* record : ran) {
      DriveLoad load = DriveLoadOf(*record, drive);
      if (!load.force.unit.empty()) loads.drives.push_back(std::move(load));
    }
  }
  for (const std::string& joint : JointsOf(report)) {
    for (const WitnessRecord* record : ran) {
      const Trace& trace = record->trace;
      const Signal force = MagnitudeOf(trace, joint, "f");
      const Signal moment = MagnitudeOf(trace, joint, "m");
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
