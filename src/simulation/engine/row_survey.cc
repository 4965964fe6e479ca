#include "simulation/engine/row_survey.h"

#include "simulation/engine/session.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {
namespace simulation {
namespace {

const char* WordOfEquality(int type) {
  switch (type) {
    case mjEQ_CONNECT:
      return "connect";
    case mjEQ_WELD:
      return "weld";
    case mjEQ_JOINT:
      return "joint";
    case mjEQ_TENDON:
      return "tendon";
    default:
      return "other";
  }
}

class RowSurveyor {
 public:
  RowSurveyor(Session* session, RowSurvey* survey) : s_(*session), survey_(*survey) {}

  RunSummary Run(const DrivenMotion& driven, const std::vector<double>& times_s) {
    if (HasPayloads(s_.motion)) {
      return {.stop = Stop::kUnsupported,
              .message = "the mass of a body changes: rows are compared for one model"};
    }
    VecX from = HomePositions(s_.engine);
    for (const double t_s : times_s) {
      DrivenSample at;
      if (RunSummary summary = driven(t_s, &at); !summary.ok()) return summary;
      RunSummary summary = s_.solver.Follow(from, at.position);
      if (summary.ok() && s_.solver.undriven() > s_.spins.count()) {
        summary = {
            .stop = Stop::kUnsupported,
            .message = "degrees of freedom are not driven: their motion follows from forces"};
      }
      summary.time_s = t_s;
      if (!summary.ok()) return summary;
      Survey(t_s, at);
      from = at.position;
    }
    return RunSummary::Done();
  }

 private:
  void Survey(double t_s, const DrivenSample& at) {
    const mjModel* m = s_.engine.m.get();
    mjData* d = s_.data.get();
    SurveyedState& surveyed = survey_.states.emplace_back();
    RowState& state = surveyed.state;
    surveyed.time_s = t_s;
    s_.solver.SolveVelocity(at.velocity);
    s_.spins.StopVelocity();
    state.qpos = Eigen::Map<const VecX>(d->qpos, m->nq);
    state.qvel = Eigen::Map<const VecX>(d->qvel, m->nv);
    s_.system.Bias(&surveyed.velocity_term);
    TargetsWithRates(at, s_.options.stock_time_constant_steps * s_.options.step_s, &state.targets);
    s_.system.SetTargets(state.targets);
    s_.ApplyForces(t_s, {.motion = at, .force = {}});
    state.applied = Eigen::Map<const VecX>(d->qfrc_applied, m->nv);
    mju_zero(d->qacc_warmstart, m->nv);
    mj_forward(m, d);
    if (survey_.equalities.empty()) NameRows();
    Measure(&surveyed.present);
  }

  void NameRows() {
    const mjModel& m = *s_.engine.m;
    for (int row = 0; row < s_.system.rows(); ++row) {
      const int id = s_.data->efc_id[row];
      survey_.equalities.push_back(NameAt(m, mjOBJ_EQUALITY, id, "equality"));
      survey_.kinds.emplace_back(WordOfEquality(m.eq_type[id]));
    }
  }

  void Measure(RowMeasures* measures) {
    const mjData* d = s_.data.get();
    const int rows = s_.system.rows();
    measures->R = Eigen::Map<const VecX>(d->efc_R, rows);
    measures->bias.resize(rows);
    for (int row = 0; row < rows; ++row) {
      const mjtNum* k_b_i = d->efc_KBIP + 4 * row;
      measures->bias[row] =
          -d->efc_aref[row] - k_b_i[1] * d->efc_vel[row] - k_b_i[0] * k_b_i[2] * d->efc_pos[row];
    }
    measures->force.resize(static_cast<Eigen::Index>(s_.engine.driven.size()));
    for (int k = 0; k < measures->force.size(); ++k) measures->force[k] = s_.system.DrivenForce(k);
  }

  Session& s_;
  RowSurvey& survey_;
};

RunSummary RunSurvey(const Mechanism& mechanism, const Motion& motion, const DrivenMotion& driven,
                     const std::vector<double>& times_s, double step_s, RowSurvey* survey) {
  const SimulationOptions options{.engine = Engine::kStock, .step_s = step_s};
  survey->mjcf = WriteMjcf(mechanism, {.step_s = step_s, .pictures = false});
  EngineModel engine;
  if (RunSummary summary = MakeEngineModel(mechanism, survey->mjcf, &engine); !summary.ok()) {
    return summary;
  }
  for (const DrivenPlace& place : engine.driven) survey->driven.push_back(place.name);
  SimulationRun run;
  Session session(std::move(engine), motion, options, &run);
  return RowSurveyor(&session, survey).Run(driven, times_s);
}

}  // namespace
}  // namespace simulation

RowSurvey SurveyRows(const Mechanism& mechanism, const Motion& motion, const DrivenMotion& driven,
                     const std::vector<double>& times_s, double step_s) {
  RowSurvey survey;
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  try {
    survey.summary = simulation::RunSurvey(mechanism, motion, driven, times_s, step_s, &survey);
  } catch (const simulation::EngineError& error) {
    survey.summary = {.stop = Stop::kEngineFailure, .message = error.what()};
  }
  return survey;
}

}  // namespace mbv
