// Forward mode: the step loops of the corrected and of the stock engine.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mjcf/mjcf.h"
#include "mjcf/plan.h"
#include "simulation/fastest_rate.h"
#include "simulation/integrator.h"
#include "simulation/session.h"
#include "simulation/steps.h"
#include "simulation/stick_slip.h"

namespace mbv::simulation {
namespace {

// A closure open by more than this part of the mechanism's extent has come apart.
constexpr double kApart = 0.01;

RunSummary Failure(const std::string& message, double t_s) {
  return {.stop = Stop::kEngineFailure,
          .message = message + "; a smaller step may help",
          .time_s = t_s,
          .where = {},
          .unit = {}};
}

// Home to the first driven sample, with consistent velocities and accelerations.
RunSummary PutAtStart(Session* s, const DrivenSample& first) {
  if (s->motion.free()) return PutAtFreeStart(s, first);
  if (s->options.drives != DriveMode::kGuided) return PutAtCommandedStart(s, first);
  if (RunSummary summary = CloseAtStart(s->motion, first, &s->system, &s->solver, &s->run->notes);
      !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  if (RunSummary summary = s->spins.TakeLeastTurns(&s->solver, first); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  s->solver.SolveVelocity(first.velocity);
  s->spins.StopVelocity();
  s->solver.SolveAcceleration(first.acceleration);
  s->spins.StopAcceleration();
  return RunSummary::Done();
}

// A number rounded down to one digit.
double Rounded(double x) {
  const double digit = std::pow(10.0, std::floor(std::log10(x)));
  return digit * std::floor(x / digit);
}

// Springs, dampers and servos against the step: a coarse step is told, one that cannot follow them
// is refused before it gives numbers.
RunSummary CheckStep(Session* s) {
  const FastestRate fastest = FastestRateOf(s->system, s->options.servo, s->motion.duration_s);
  const double h = AdjustedStep(s->motion, s->options.step_s);
  const double per_period = 2.0 * std::numbers::pi / (fastest.per_s * h);
  if (fastest.per_s > 0.0 && per_period < kLeastStepsPerPeriod) {
    const double wanted_s = Rounded(0.2 / fastest.per_s);
    return {
        .stop = Stop::kEngineFailure,
        .message = fmt::format("{} has a rate of {:.3g} rad/s at the start, which a step of {:g} "
                               "s cannot follow: simulation.step_s = {:.1g} or less is needed",
                               fastest.part, fastest.per_s, h, wanted_s),
        .time_s = 0.0,
        .where = fastest.part,
        .amount = wanted_s,
        .unit = "s"};
  }
  const double drift = fastest.drift * std::pow(h, 4);
  if (drift <= kMostDrift) return RunSummary::Done();
  s->run->notes.push_back(fmt::format(
      "{} vibrates at {:.3g} rad/s at the start: with a step of {:g} s that drifts by about {:.0e} "
      "of its amplitude; simulation.step_s = {:.1g} or less is needed",
      fastest.drift_part, fastest.drift_per_s, h, drift,
      Rounded(h * std::pow(kMostDrift / drift, 0.25))));
  return RunSummary::Done();
}

// Of what was recorded.
RunSummary TroubleAt(const Session& s, double t_s) {
  RunSummary summary = s.trouble;
  if (!summary.ok()) summary.time_s = t_s;
  return summary;
}

// After a recorded sample: the motion must be finite and the loops closed.
RunSummary CheckSample(const Session& s, double largest_gap_m, double t_s) {
  const ConstraintSystem::Gap gap = s.system.LargestGap();
  if (gap.position_m < largest_gap_m) return TroubleAt(s, t_s);
  return Failure(fmt::format("the simulated loops came apart by {:.3g} m", gap.position_m), t_s);
}

}  // namespace

RunSummary RunCorrected(Session* s, const DrivenMotion& driven) {
  const std::vector<Step> steps = MakeSteps(s->motion, s->options.step_s);
  // What is commanded is evaluated before the loop.
  const auto command = [&](double t_s, Commanded* at) {
    RunSummary summary = driven(t_s, &at->motion);
    return summary.ok() && s->options.forces ? s->options.forces(t_s, &at->force) : summary;
  };
  std::vector<Commanded> ends(steps.size()), middles(steps.size());
  Commanded first;
  if (RunSummary summary = command(0.0, &first); !summary.ok()) return summary;
  for (size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].uniform < 4) {
      const double middle = 0.5 * (steps[i].from_s + steps[i].to_s);
      if (RunSummary summary = command(middle, &middles[i]); !summary.ok()) return summary;
    }
    if (RunSummary summary = command(steps[i].to_s, &ends[i]); !summary.ok()) return summary;
  }
  if (RunSummary summary = PutAtStart(s, first.motion); !summary.ok()) return summary;
  if (RunSummary summary = CheckStep(s); !summary.ok()) return summary;
  const double largest_gap = kApart * mjcf::Extent(*s->engine.mechanism);
  Integrator integrator(s, AdjustedStep(s->motion, s->options.step_s));
  StickSlip friction(s, &integrator, command);
  const LoopClock clock;
  if (friction.acts()) friction.FindSliding();
  integrator.Start(first);
  if (friction.acts()) {
    if (RunSummary summary = friction.Begin(); !summary.ok()) return summary;
  }
  s->FindShared();
  s->work.Start(s->WorkRates());
  s->Record(0);
  if (RunSummary summary = TroubleAt(*s, 0.0); !summary.ok()) return summary;
  for (size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const double h = step.to_s - step.from_s;
    if (friction.acts()) {
      if (RunSummary summary = friction.Advance(step); !summary.ok()) return summary;
    } else if (step.uniform == 4) {
      integrator.MultiStep(h, ends[i], step.to_s);
    } else {
      integrator.RungeKutta(h, middles[i], ends[i], step.from_s);
    }
    if (!integrator.healthy()) return Failure("the simulated motion diverged", step.to_s);
    if (!friction.acts()) s->work.Step(h, step.uniform == 4, s->WorkRates());
    if (step.sample < 0) continue;
    s->Record(static_cast<size_t>(step.sample));
    if (RunSummary summary = CheckSample(*s, largest_gap, step.to_s); !summary.ok()) return summary;
  }
  clock.Stop(s->run);
  s->run->steps = static_cast<long>(steps.size());
  return RunSummary::Done();
}

void TargetsWithRates(const DrivenSample& at, double time_constant_s, VecX* targets) {
  const double d = kMjcfImpedance, tc = time_constant_s;
  const double b = 2.0 / (d * tc), k_d = d / (d * d * tc * tc);
  *targets = at.position + (b * at.velocity + at.acceleration) / k_d;
}

RunSummary RunStock(Session* s, const DrivenMotion& driven) {
  const double h = AdjustedStep(s->motion, s->options.step_s);
  const std::vector<double>& times = s->run->trace.time_s;
  const long per_sample = std::lround(s->motion.sample_s / h);
  const long last = static_cast<long>(times.size() - 1) * per_sample;
  std::vector<DrivenSample> samples(static_cast<size_t>(last + 1));
  for (long n = 0; n <= last; ++n) {
    if (RunSummary summary = driven(static_cast<double>(n) * h, &samples[n]); !summary.ok()) {
      return summary;
    }
  }
  if (RunSummary summary = PutAtStart(s, samples[0]); !summary.ok()) return summary;
  if (RunSummary summary = CheckStep(s); !summary.ok()) return summary;
  const bool rates = s->options.engine == Engine::kStock;
  const double tc = s->options.stock_time_constant_steps * h;
  s->FindShared();
  const mjModel* m = s->engine.m.get();
  mjData* data = s->data.get();
  VecX targets;
  const LoopClock clock;
  for (long n = 0; n <= last; ++n) {
    const DrivenSample& at = samples[n];
    targets = at.position;
    if (rates) TargetsWithRates(at, tc, &targets);
    s->system.SetTargets(targets);
    if (s->system.has_given_forces() || s->lacking || s->loads.follow()) {
      s->system.EvaluatePosition();
      mj_comVel(m, data);
    }
    s->ApplyForces(static_cast<double>(n) * h, {.motion = at, .force = {}});
    if (n % per_sample == 0) {
      mj_forward(m, data);
      s->system.TakeJacobian();
      s->Record(static_cast<size_t>(n / per_sample));
      if (RunSummary summary = TroubleAt(*s, static_cast<double>(n) * h); !summary.ok()) {
        return summary;
      }
    }
    {
      const OwnJacobians jacobians(s->engine);
      mj_step(m, data);
    }
    if (data->warning[mjWARN_BADQACC].number > 0 || data->warning[mjWARN_BADQPOS].number > 0 ||
        data->warning[mjWARN_BADQVEL].number > 0) {
      return Failure("MuJoCo reset the simulation, which had diverged", static_cast<double>(n) * h);
    }
  }
  clock.Stop(s->run);
  s->run->steps = last;
  return RunSummary::Done();
}

}  // namespace mbv::simulation
