#include "simulation/compliant.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "core/demand.h"
#include "simulation/statics.h"

namespace mbv {
namespace {

using simulation::EngineError;
using simulation::EngineSession;
using simulation::Statics;

// Small loads move the output by no more than this fraction of the mechanism's size (or rad).
constexpr double kSmallMotion = 1e-4;
// Scaled eigenvalues of K below this fraction of the largest are zero.
constexpr double kSingular = 1e-9;
constexpr int kLevels = 3;  // load sizes: full, half, quarter

// Central differences at load sizes h, h/2, h/4 have errors in h², h⁴, …: Richardson's tableau.
struct Extrapolated {
  VecX value;
  VecX change;  // between the last two extrapolates of one order
};
Extrapolated Extrapolate(const std::array<VecX, kLevels>& D) {
  const VecX first = (4.0 * D[1] - D[0]) / 3.0, second = (4.0 * D[2] - D[1]) / 3.0;
  return {(16.0 * second - first) / 15.0, second - first};
}

RunSummary Trouble(Stop stop, const std::string& message) {
  return {.stop = stop, .message = message, .where = {}, .unit = {}};
}

class Witness {
 public:
  Witness(const mjcf::CompliantModel& model, Statics* statics, const CompliantOptions& options,
          CompliantRun* run)
      : model_(model), statics_(*statics), options_(options), run_(*run) {
    const double L = statics_.size();
    size_ << 1, 1, 1, L, L, L;
  }

  RunSummary Measure(const std::vector<Vec6>& wrenches) {
    base_ = statics_.UnderLoad(statics_.Home(), Vec6::Zero(), options_.force_N);
    if (RunSummary summary = Note(base_, "without load"); !summary.ok()) return summary;
    if (RunSummary summary = LinearAnswers(); !summary.ok()) return summary;
    RunSummary end = singular_ ? MeasureStiffness() : MeasureCompliance();
    if (!end.ok()) return end;
    for (size_t k = 0; k < wrenches.size(); ++k) {
      RunSummary loaded = MeasureLoaded(wrenches[k], fmt::format("under wrench {}", k + 1));
      if (!loaded.ok()) end = loaded;
    }
    if (!end.ok() || !singular_) return end;
    return Trouble(Stop::kSingular,
                   fmt::format("the stiffness has rank {}: the output can move without force",
                               run_.result.rank));
  }

 private:
  // The worst residual counts for the run; a state that does not balance ends it.
  RunSummary Note(const Statics::State& state, const std::string& where) {
    if (!(state.residual <= run_.residual)) run_.residual = state.residual;
    if (state.converged()) return RunSummary::Done();
    RunSummary summary = Trouble(
        Stop::kNoConvergence,
        fmt::format("no static equilibrium {}: unbalanced force {:.2g} of the load, gap {:.2g}",
                    where, state.residual, state.gap));
    summary.where = where;
    summary.amount = state.residual;
    return summary;
  }

  // First-order K and C at the unloaded pose: the rank, and how large small loads may be.
  RunSummary LinearAnswers() {
    for (int i = 0; i < 6; ++i) {
      Vec6 column;
      if (!statics_.LinearWrench(Vec6::Unit(i), &column)) {
        return Trouble(Stop::kSingular,
                       "the output is rigidly held in some direction: infinite stiffness");
      }
      K_linear_.col(i) = column;
    }
    const Mat6 scaled = size_.asDiagonal() * K_linear_ * size_.asDiagonal();
    const VecX eigenvalues =
        Eigen::SelfAdjointEigenSolver<Mat6>(Mat6(0.5 * (scaled + scaled.transpose())))
            .eigenvalues();
    const double largest = eigenvalues.cwiseAbs().maxCoeff();
    run_.result.rank = static_cast<int>((eigenvalues.array() > kSingular * largest).count());
    singular_ = run_.result.rank < 6;
    if (singular_) return RunSummary::Done();
    for (int i = 0; i < 6; ++i) {
      Vec6 column;
      if (!statics_.LinearDisplacement(Vec6::Unit(i), &column)) {
        return Trouble(Stop::kSingular, "a load on the output finds no resistance");
      }
      C_linear_.col(i) = column;
    }
    return RunSummary::Done();
  }

  // The output's displacement and all springs' deformations per unit of wrench i.
  RunSummary Respond(int i, Extrapolated* response) {
    const double motion = C_linear_.col(i).cwiseQuotient(size_).cwiseAbs().maxCoeff();
    const double allowed = i < 3 ? options_.moment_Nm : options_.force_N;
    double load = std::min(allowed, kSmallMotion / motion);
    std::array<VecX, kLevels> D;
    for (VecX& difference : D) {
      std::array<VecX, 2> seen;
      for (const int side : {0, 1}) {
        const Vec6 F = (side == 0 ? load : -load) * Vec6::Unit(i);
        const Statics::State state = statics_.UnderLoad(base_, F, options_.force_N);
        if (RunSummary summary = Note(state, fmt::format("under small load {}", i + 1));
            !summary.ok()) {
          return summary;
        }
        seen[side].resize(6 + static_cast<Eigen::Index>(model_.springs.size()));
        seen[side] << statics_.Displacement(base_, state), statics_.Deformations(state);
      }
      difference = (seen[0] - seen[1]) / (2.0 * load);
      load /= 2.0;
    }
    *response = Extrapolate(D);
    return RunSummary::Done();
  }

  RunSummary MeasureCompliance() {
    Mat6 C, change;
    MatX deformation(model_.springs.size(), 6);
    for (int i = 0; i < 6; ++i) {
      Extrapolated response;
      if (RunSummary summary = Respond(i, &response); !summary.ok()) return summary;
      C.col(i) = response.value.head<6>();
      change.col(i) = response.change.head<6>();
      deformation.col(i) = response.value.tail(deformation.rows());
    }
    run_.extrapolation_error = Norm(change, size_.cwiseInverse()) / Norm(C, size_.cwiseInverse());
    run_.result.C = 0.5 * (C + C.transpose());
    const Mat6 K = run_.result.C.inverse();
    run_.result.K = 0.5 * (K + K.transpose());
    AddShares(deformation);
    return RunSummary::Done();
  }

  // C_e(i, j) = Σ k δ_i δ_j over the springs of an element.
  void AddShares(const MatX& deformation) {
    std::vector<ComplianceShare>& shares = run_.result.shares;
    for (size_t k = 0; k < model_.springs.size(); ++k) {
      const mjcf::ElasticSpring& spring = model_.springs[k];
      if (shares.empty() || shares.back().element != spring.element) {
        shares.push_back({.element = spring.element});
      }
      const Vec6 delta = deformation.row(static_cast<Eigen::Index>(k)).transpose();
      shares.back().C += spring.stiffness * delta * delta.transpose();
    }
  }

  // K where C does not exist: the wrench that holds the output in displaced poses.
  RunSummary MeasureStiffness() {
    const double turn = K_linear_.leftCols<3>().topRows<3>().norm();
    const double shift = K_linear_.rightCols<3>().bottomRows<3>().norm();
    Mat6 K, change;
    for (int i = 0; i < 6; ++i) {
      double step = i < 3 ? std::min(kSmallMotion, options_.moment_Nm / turn)
                          : std::min(kSmallMotion * statics_.size(), options_.force_N / shift);
      std::array<VecX, kLevels> D;
      for (VecX& difference : D) {
        const auto plus = statics_.Displaced(base_, step * Vec6::Unit(i), options_.force_N);
        const auto minus = statics_.Displaced(base_, -step * Vec6::Unit(i), options_.force_N);
        for (const auto* state : {&plus, &minus}) {
          const std::string where = fmt::format("at small displacement {}", i + 1);
          if (RunSummary summary = Note(*state, where); !summary.ok()) return summary;
        }
        difference = (plus.F - minus.F) / (2.0 * step);
        step /= 2.0;
      }
      const Extrapolated column = Extrapolate(D);
      K.col(i) = column.value;
      change.col(i) = column.change;
    }
    run_.extrapolation_error = Norm(change, size_) / Norm(K, size_);
    run_.result.K = 0.5 * (K + K.transpose());
    return RunSummary::Done();
  }

  [[nodiscard]] static double Norm(const Mat6& A, const Vec6& scale) {
    return (scale.asDiagonal() * A * scale.asDiagonal()).norm();
  }

  RunSummary MeasureLoaded(const Vec6& F, const std::string& where) {
    const Statics::State state = statics_.UnderLoad(base_, F, options_.force_N);
    run_.loaded.push_back({.residual = state.residual, .iterations = state.iterations});
    if (RunSummary summary = Note(state, where); !summary.ok()) return summary;
    run_.loaded.back().displacement = statics_.Displacement(base_, state);
    return RunSummary::Done();
  }

  const mjcf::CompliantModel& model_;
  Statics& statics_;
  const CompliantOptions& options_;
  CompliantRun& run_;
  Statics::State base_;
  Vec6 size_;  // of a unit step in each component
  Mat6 K_linear_ = Mat6::Zero(), C_linear_ = Mat6::Zero();
  bool singular_ = false;
};

RunSummary Simulate(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output,
                    const std::vector<Vec6>& wrenches, const CompliantOptions& options,
                    CompliantRun* run) {
  std::string error;
  const auto model = mjcf::MakeCompliantModel(mechanism, X_WB, output, &error);
  if (!model) return Trouble(Stop::kUnsupported, error);
  if (model->springs.empty()) return Trouble(Stop::kUnsupported, "nothing is elastic");
  if (model->mechanism.outputs[0].body == 0) {
    return Trouble(Stop::kSingular, "the output is rigidly fixed to the world");
  }
  run->mjcf = model->mjcf;
  std::vector<std::string> warnings;
  const EngineSession session(&warnings);
  try {
    RunSummary summary;
    Statics statics(*model, &summary);
    if (!summary.ok()) return summary;
    return Witness(*model, &statics, options, run).Measure(wrenches);
  } catch (const EngineError& e) {
    return Trouble(Stop::kEngineFailure, e.what());
  }
}

}  // namespace

CompliantRun SimulateStiffness(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                               int output, const std::vector<Vec6>& wrenches,
                               const CompliantOptions& options) {
  MBV_DEMAND(options.force_N > 0.0, options.force_N);
  MBV_DEMAND(options.moment_Nm > 0.0, options.moment_Nm);
  const auto start = std::chrono::steady_clock::now();
  CompliantRun run;
  run.result.summary = Simulate(mechanism, X_WB, output, wrenches, options, &run);
  run.result.summary.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

}  // namespace mbv
