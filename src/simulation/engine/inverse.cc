// Inverse mode: at each sample Newton closure on MuJoCo's residuals, consistent velocities and
// accelerations, inverse dynamics of the tree, and the forces of drives, bases and loops from
// Jᵀλ = τ.

#include <fmt/format.h>
#include <algorithm>

#include "simulation/engine/closure_solver.h"
#include "simulation/engine/element_forces.h"
#include "simulation/engine/session.h"

namespace mbv::simulation {
namespace {

void SolveRates(Session* s, const DrivenSample& at) {
  s->solver.SolveVelocity(at.velocity);
  s->spins.StopVelocity();
  s->solver.SolveAcceleration(at.acceleration);
  s->spins.StopAcceleration();
}

RunSummary SolveDynamics(Session* s, double t_s, const DrivenSample& at, VecX* tau) {
  const mjModel* m = s->engine.m.get();
  mjData* d = s->data.get();
  s->system.EvaluateBodyForces();
  s->system.BodyForces(tau);
  s->system.EvaluatePassive();
  *tau -= Eigen::Map<const VecX>(d->qfrc_passive, m->nv);
  // The bodies know no armature.
  *tau += Eigen::Map<const VecX>(m->dof_armature, m->nv)
              .cwiseProduct(Eigen::Map<const VecX>(d->qacc, m->nv));
  s->EvaluateLoads(t_s);
  if (!s->loads.trouble().ok()) return s->loads.trouble();
  *tau = -*tau;
  s->loads.AddGeneralized(d, tau->data());
  if (s->lacking) AddLackingForces(s->system, at.acceleration, tau->data());
  *tau = -*tau;
  if (RunSummary summary = s->spins.CheckIdle(*tau); !summary.ok()) return summary;
  if (s->shared) {
    s->solver.SolveLeastDriven(*tau);
  } else {
    s->solver.SolveForces(*tau);
  }
  return RunSummary::Done();
}

RunSummary At(RunSummary summary, double t_s) {
  summary.time_s = t_s;
  return summary;
}

}  // namespace

RunSummary RunInverse(Session* s, const DrivenMotion& driven) {
  if (s->motion.free()) {
    return {.stop = Stop::kUnsupported,
            .message = "a motion that follows from forces needs mode: forward",
            .time_s = 0.0};
  }
  const std::vector<double>& times = s->run->trace.time_s;
  std::vector<DrivenSample> samples(times.size());
  for (size_t i = 0; i < times.size(); ++i) {
    if (RunSummary summary = driven(times[i], &samples[i]); !summary.ok()) return summary;
  }
  mjData* d = s->data.get();
  SamplePredictor predictor(s->engine);
  VecX tau(s->engine.m->nv), closed;
  const LoopClock clock;
  for (size_t i = 0; i < times.size(); ++i) {
    s->SetPayloads(times[i]);
    closed = Eigen::Map<const VecX>(d->qpos, s->engine.m->nq);
    if (i > 0) predictor.Predict(times[i] - times[i - 1], d);
    if (RunSummary summary =
            i == 0
                ? CloseAtStart(s->motion, samples[0], &s->system, &s->solver, &s->run->notes)
                : s->solver.FollowPredicted(closed, samples[i - 1].position, samples[i].position);
        !summary.ok()) {
      return At(summary, times[i]);
    }
    if (s->solver.undriven() > s->spins.count()) {
      return {.stop = Stop::kUnsupported,
              .message = fmt::format(
                  "{} degrees of freedom are not driven: their motion follows from forces, "
                  "use mode: forward",
                  s->solver.undriven() - s->spins.count()),
              .time_s = times[i]};
    }
    if (i == 0) {
      if (RunSummary summary = s->spins.TakeLeastTurns(&s->solver, samples[i]); !summary.ok()) {
        return At(summary, times[i]);
      }
      s->FindShared();
    }
    SolveRates(s, samples[i]);
    bool turned = false;
    if (RunSummary summary = s->spins.Transport(times[i], samples[i], &s->solver, &turned);
        !summary.ok()) {
      return At(summary, times[i]);
    }
    if (turned) SolveRates(s, samples[i]);
    if (RunSummary summary = SolveDynamics(s, times[i], samples[i], &tau); !summary.ok()) {
      return At(summary, times[i]);
    }
    s->Record(i);
    if (!s->trouble.ok()) return At(s->trouble, times[i]);
  }
  clock.Stop(s->run);
  s->run->steps = static_cast<long>(times.size());
  return RunSummary::Done();
}

}  // namespace mbv::simulation
