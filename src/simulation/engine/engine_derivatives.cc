#include "simulation/engine/engine_derivatives.h"

#include <Eigen/QR>

#include "simulation/engine/engine.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/session.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {
namespace {

using simulation::EngineError;
using simulation::EngineModel;

constexpr double kStep_s = 1e-4;
constexpr double kDifference = 1e-6;  // mjd_transitionFD's usual one

std::string UnsupportedReason(const Mechanism& mechanism) {
  if (!mechanism.elements.empty()) return "its force elements are not all MuJoCo's own";
  if (HasGravityCompensation(mechanism)) return "gravity is compensated";
  if (!mechanism.prescribed.empty()) return "joints are prescribed";
  return "";
}

void Differentiate(const EngineModel& engine, const std::vector<Pose>& X_WB, const MatX& T,
                   const VecX& drive_force, EngineDerivatives* out) {
  const Mechanism& mechanism = *engine.mechanism;
  mjModel& m = *engine.m;
  const simulation::DataHandle data = simulation::MakeData(m);
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  const Eigen::Index n = T.cols(), nv = m.nv;
  MatX& U = out->U;
  U.resize(nv, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (size_t b = 1; b < X_WB.size(); ++b) {
      states.V_WB[b] = T.block<6, 1>(6 * (static_cast<Eigen::Index>(b) - 1), k);
    }
    if (!simulation::PutStates(engine, Motion(), states, data.get())) {
      out->summary = {.stop = Stop::kUnsupported,
                      .message = "a ball beside a hinge on its body has no coordinates to vary"};
      return;
    }
    U.col(k) = Eigen::Map<const VecX>(data->qvel, nv);
  }
  mju_zero(data->qvel, m.nv);
  out->qpos = Eigen::Map<const VecX>(data->qpos, m.nq);
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    data->ctrl[simulation::IdOf(m, mjOBJ_ACTUATOR, mechanism.drives[d].name)] =
        drive_force[static_cast<Eigen::Index>(d)];
  }
  const Eigen::Index size = 2 * nv + m.na;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A(size, size);
  mjd_transitionFD(&m, data.get(), kDifference, 1, A.data(), nullptr, nullptr, nullptr);
  // v⁺ = v + h a
  const double h = m.opt.timestep;
  const MatX by_q = A.block(nv, 0, nv, nv) / h;
  const MatX by_v = (MatX(A.block(nv, nv, nv, nv)) - MatX::Identity(nv, nv)) / h;
  out->by_position = out->InCoordinates(by_q * U);
  out->by_velocity = out->InCoordinates(by_v * U);
  out->summary = RunSummary::Done();
}

}  // namespace

MatX EngineDerivatives::InCoordinates(const MatX& rates) const {
  return U.colPivHouseholderQr().solve(rates);
}

EngineDerivatives DifferentiateEngine(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                                      const MatX& T, const VecX& drive_force,
                                      bool default_softness) {
  EngineDerivatives out;
  out.summary.stop = Stop::kUnsupported;
  out.summary.message = UnsupportedReason(mechanism);
  if (!out.summary.message.empty()) return out;
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  try {
    MjcfOptions options;
    options.step_s = kStep_s;
    options.pictures = false, options.prescribed = false;
    options.default_softness = default_softness;
    EngineModel engine;
    out.mjcf = WriteMjcf(mechanism, options);
    out.summary = MakeEngineModel(mechanism, out.mjcf, &engine);
    if (out.summary.ok()) Differentiate(engine, X_WB, T, drive_force, &out);
  } catch (const EngineError& error) {
    out.summary = {.stop = Stop::kEngineFailure, .message = error.what()};
  }
  return out;
}

}  // namespace mbv
