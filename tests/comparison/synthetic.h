// A hand-made mechanism and traces of it: two sliders that carry a plate. Forces and motions are
// sines, so every metric can be worked out by hand.
#pragma once

#include <cmath>
#include <numbers>
#include <string>

#include "comparison/comparison.h"
#include "mechanism/channels.h"
#include "tests/mechanisms/two_sliders.h"

namespace mbv::synthetic {

inline Mechanism TwoSliders() {
  Mechanism mechanism = test::DrivenSliders();
  Output output;
  output.name = "plate";
  output.body = 2;
  mechanism.outputs = {output};
  return mechanism;
}

inline Motion TwoSines() {
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.01;
  motion.commands = {
      {"d1", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, {{SineTerm{0.5, 1.0, 0.0}}}},
      {"d2", {{{Coordinate::Kind::kDrive, 1, 0}, 1.0}}, {{SineTerm{0.2, 1.0, 0.3}}}}};
  return motion;
}

/// A trace that follows TwoSines() exactly, with forces 100 sin and 40 cos, a plate that turns, a
/// reaction, closed loops and balanced power.
inline Trace ExactTrace(const std::string& witness) {
  const Mechanism mechanism = TwoSliders();
  const Motion motion = TwoSines();
  std::vector<Channel> channels = DriveChannels(mechanism);
  std::vector<Channel> audit = AuditChannels();
  audit.resize(4);  // without the parts of the power: the power is not that of the forces
  for (const auto& more :
       {OutputChannels(mechanism), ReactionChannels(mechanism.joints[0]), audit}) {
    channels.insert(channels.end(), more.begin(), more.end());
  }
  if (witness == "simulated") {
    const std::vector<Channel> rates = OutputRateChannels(mechanism, mechanism.outputs[0]);
    channels.insert(channels.end(), rates.begin(), rates.end());
  }
  Trace trace;
  trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), channels);
  trace.witness = witness;
  trace.values.setZero();
  const double w = 2.0 * std::numbers::pi;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const double t = trace.time_s[i];
    const auto row = static_cast<Eigen::Index>(i);
    const auto set = [&](const std::string& name, double value) {
      trace.values(row, trace.Find(name)) = value;
    };
    for (size_t d = 0; d < 2; ++d) {
      const Jet jet = Evaluate(motion.commands[d].profile, t);
      const std::string name = d == 0 ? "d1" : "d2";
      set(name + ".position", jet.value);
      set(name + ".velocity", jet.rate);
      set(name + ".acceleration", jet.acceleration);
    }
    set("d1.force", 100.0 * std::sin(w * t));
    set("d2.force", 40.0 * std::cos(w * t));
    set("plate.x", 0.3 * t);
    set("plate.yaw", 3.0 + 0.5 * t);  // passes π
    if (witness == "simulated") {
      set("plate.x.velocity", 0.3);
      set("plate.yaw.velocity", 0.5);
    }
    set("slide1.reaction.fx", 10.0 + t);
    set("slide1.reaction.my", 2.0);
    set("power.input", 50.0 * std::sin(w * t));
    set("power.energy_rate", 50.0 * std::sin(w * t));
  }
  return trace;
}

/// Adds `amount` to a channel at every sample from index `from` to the end.
inline void Perturb(Trace* trace, const std::string& channel, double amount, size_t from = 0) {
  const int column = trace->Find(channel);
  for (size_t i = from; i < trace->time_s.size(); ++i) {
    trace->values(static_cast<Eigen::Index>(i), column) += amount;
  }
}

/// Multiplies a channel.
inline void Stretch(Trace* trace, const std::string& channel, double factor) {
  trace->values.col(trace->Find(channel)) *= factor;
}

/// Three witnesses that agree exactly; tests perturb one of them and compare.
struct Case {
  Mechanism mechanism = TwoSliders();
  Motion motion = TwoSines();
  Trace analytic = ExactTrace("analytic"), reference = ExactTrace("reference"),
        simulated = ExactTrace("simulated");
  RunSummary analytic_summary = RunSummary::Done(), reference_summary = RunSummary::Done(),
             simulated_summary = RunSummary::Done();
  LimitColumn column = LimitColumn::kInverse;
  CheckLimits limits;
  double start_window_s = 0.0;
  std::vector<std::string> reactions_not_unique;

  /// The plate's way is commanded instead of the drives'.
  void CommandPlate() {
    motion.commands = {{"plate.x", {{{Coordinate::Kind::kOutput, 0, 0}, 1.0}}, {{RampTerm{0.3}}}},
                       {"plate.yaw",
                        {{{Coordinate::Kind::kOutput, 0, 5}, 1.0}},
                        {{ConstantTerm{3.0}, RampTerm{0.5}}}}};
  }

  [[nodiscard]] ComparisonInput Input() const {
    return {.mechanism = &mechanism,
            .motion = &motion,
            .limits = limits,
            .simulation_limits = column,
            .start_window_s = start_window_s,
            .witnesses = {{"analytic", &analytic, analytic_summary},
                          {"reference", &reference, reference_summary},
                          {"simulated", &simulated, simulated_summary}},
            .driven_by = "analytic",
            .reactions_not_unique = reactions_not_unique};
  }
  [[nodiscard]] Comparison Run() const { return Compare(Input()); }
};

}  // namespace mbv::synthetic
