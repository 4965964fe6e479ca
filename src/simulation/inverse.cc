// Inverse mode: at each sample Newton closure on MuJoCo's residuals, consistent velocities and
// accelerations, inverse dynamics of the tree, and the forces of drives, bases and loops from
// Jᵀλ = τ.
#include <fmt/format.h>

#include <chrono>

#include "simulation/session.h"

namespace mbv::simulation {
namespace {

// Positions, velocities and accelerations of the last two samples predict the next: the velocity
// is extrapolated by the cubic through both ends and integrated.
class Predictor {
 public:
  explicit Predictor(const EngineModel& engine) : engine_(engine) {}

  void Predict(double h, mjData* d) {
    const Eigen::Map<const VecX> v(d->qvel, engine_.m->nv), a(d->qacc, engine_.m->nv);
    if (known_ > 0) {
      mean_ = v + 0.5 * h * a;
      if (known_ > 1) {
        const auto A = v_old_ - v + h * a;
        const auto B = h * (a_old_ - a);
        mean_ += 1.5 * A + 7.0 / 12.0 * B;
      }
      v_new_ = v + h * a;
      AdvancePositions(engine_, h, mean_, v, v_new_, &work_, d->qpos);
      v_old_ = v;
      a_old_ = a;
    }
    known_ = std::min(known_ + 1, 2);
  }

 private:
  const EngineModel& engine_;
  int known_ = 0;
  VecX v_old_, a_old_, mean_, v_new_, work_;
};

void SolveDynamics(Session* s, double t_s, VecX* tau) {
  const mjModel* m = s->engine.m.get();
  mjData* d = s->data.get();
  mj_rne(m, d, 1, tau->data());
  s->system.EvaluatePassive();
  *tau -= Eigen::Map<const VecX>(d->qfrc_passive, m->nv);
  s->loads.Evaluate(t_s, *d);
  if (!s->loads.world().empty()) {
    *tau = -*tau;
    s->loads.AddGeneralized(d, tau->data());
    *tau = -*tau;
  }
  s->solver.SolveForces(*tau);
}

RunSummary At(RunSummary summary, double t_s) {
  summary.time_s = t_s;
  return summary;
}

}  // namespace

RunSummary RunInverse(Session* s, const DrivenMotion& driven) {
  const std::vector<double>& times = s->run->trace.time_s;
  std::vector<DrivenSample> samples(times.size());
  for (size_t i = 0; i < times.size(); ++i) {
    if (RunSummary summary = driven(times[i], &samples[i]); !summary.ok()) return summary;
  }
  mjData* d = s->data.get();
  Predictor predictor(s->engine);
  VecX tau(s->engine.m->nv);
  const auto start = std::chrono::steady_clock::now();
  for (size_t i = 0; i < times.size(); ++i) {
    if (i > 0) predictor.Predict(times[i] - times[i - 1], d);
    if (RunSummary summary = s->solver.Follow(
            i > 0 ? samples[i - 1].position : HomePositions(s->engine), samples[i].position);
        !summary.ok()) {
      return At(summary, times[i]);
    }
    if (s->solver.undriven() > 0) {
      return {
          .stop = Stop::kUnsupported,
          .message = fmt::format("{} freedoms are not driven: their motion follows from forces, "
                                 "use mode: forward",
                                 s->solver.undriven()),
          .time_s = times[i],
          .where = {},
          .unit = {}};
    }
    s->solver.SolveVelocity(samples[i].velocity);
    s->solver.SolveAcceleration(samples[i].acceleration);
    SolveDynamics(s, times[i], &tau);
    s->Record(i);
  }
  s->run->loop_wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  s->run->steps = static_cast<long>(times.size());
  return RunSummary::Done();
}

}  // namespace mbv::simulation
