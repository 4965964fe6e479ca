// MuJoCo's derivatives beside ours: its own in two versions, and those of its corrected inverse
// dynamics.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "external/witness_answer.h"
#include "features/linearise/linearise.h"
#include "mechanism/channels.h"
#include "mechanism/reach.h"
#include "simulation/engine/engine_derivatives.h"
#include "simulation/engine/simulation.h"
#include "verify/program_call.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNewest = "mbverify-witness-mujoco";
constexpr double kFirstDifference = 0.01;  // in units of lengths and angles
constexpr double kSample_s = 1e-3;

// Of the largest entry of `y`, or of `least`; rows and columns in units of the coordinates.
double ShareApart(const MatX& x, const MatX& y, const VecX& rows, const VecX& columns,
                  double least) {
  const MatX unit = rows * columns.transpose();
  return (x - y).cwiseProduct(unit).cwiseAbs().maxCoeff() /
         std::max(y.cwiseProduct(unit).cwiseAbs().maxCoeff(), least);
}

Json NumbersOf(const VecX& x) { return std::vector<double>(x.data(), x.data() + x.size()); }

// Rows of a matrix are columns here.
bool ReadColumns(const nlohmann::json& of, Eigen::Index rows, Eigen::Index columns, MatX* out) {
  out->resize(rows, columns);
  if (!of.is_array() || static_cast<Eigen::Index>(of.size()) != columns) return false;
  for (Eigen::Index k = 0; k < columns; ++k) {
    const auto& column = of[static_cast<size_t>(k)];
    if (!column.is_array() || static_cast<Eigen::Index>(column.size()) != rows) return false;
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto& entry = column[static_cast<size_t>(i)];
      if (!entry.is_number()) return false;
      (*out)(i, k) = entry.get<double>();
    }
  }
  return true;
}

// What the newest one makes of the same model and state; why nothing, or "".
std::string AskNewest(const Mechanism& mechanism, const EngineDerivatives& handed,
                      const VecX& drive_force, std::string* version, MatX* by_position,
                      MatX* by_velocity) {
  Json state = {{"qpos", NumbersOf(handed.qpos)}};
  state["directions"] = Json::array(), state["motors"] = Json::object();
  for (Eigen::Index k = 0; k < handed.U.cols(); ++k) {
    state["directions"].push_back(NumbersOf(handed.U.col(k)));
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    state["motors"][mechanism.drives[d].name] = drive_force[static_cast<Eigen::Index>(d)];
  }
  ForeignWitness witness;
  witness.name = "mujoco_newest", witness.command = {kNewest, "--derivatives"};
  ProgramCall call(witness);
  for (const auto& [name, text] :
       {std::pair("model.xml", handed.mjcf), std::pair("state.json", state.dump())}) {
    if (std::string trouble = call.WriteInput(name, text); !trouble.empty()) return trouble;
  }
  if (const auto failure = call.Run()) return failure->text;
  std::string trouble;
  const auto answer = ReadAnswer(call.Text("witness.json").value_or(""), &trouble);
  if (!answer) return trouble;
  if (!answer->refused.empty()) return answer->refused;
  *version = answer->version;
  const auto json =
      nlohmann::json::parse(call.Text("derivatives.json").value_or(""), nullptr, false);
  MatX of_q, of_v;
  if (!json.is_object() || !json.contains("by_position") || !json.contains("by_velocity") ||
      !ReadColumns(json["by_position"], handed.U.rows(), handed.U.cols(), &of_q) ||
      !ReadColumns(json["by_velocity"], handed.U.rows(), handed.U.cols(), &of_v)) {
    return "answers with other derivatives";
  }
  *by_position = handed.InCoordinates(of_q), *by_velocity = handed.InCoordinates(of_v);
  return "";
}

}  // namespace

std::vector<EngineDerivative> AskMujoco(const Mechanism& mechanism, const Linearisation& at,
                                        const BodyStates& resting, const MatX& T,
                                        const VecX& unit) {
  const Eigen::Index n = unit.size();
  const MatX q = at.A.bottomLeftCorner(n, n), v = at.A.bottomRightCorner(n, n);
  const VecX per_unit = unit.cwiseInverse();
  const double fast = std::sqrt(q.cwiseProduct(per_unit * unit.transpose()).cwiseAbs().maxCoeff());
  std::vector<EngineDerivative> all;
  const auto judge = [&](EngineDerivative engine, const std::string& why_not, const MatX& by_q,
                         const MatX& by_v) {
    engine.why_not = why_not;
    if (why_not.empty()) {
      engine.position_error = ShareApart(by_q, q, per_unit, unit, 0.0);
      engine.velocity_error = ShareApart(by_v, v, per_unit, unit, fast);
    }
    all.push_back(std::move(engine));
  };
  for (const bool soft : {true, false}) {
    const char* softness = soft ? "default softness" : "as stiff as its step allows";
    const EngineDerivatives by =
        DifferentiateEngine(mechanism, resting.X_WB, T, at.drive_force, soft);
    judge({.engine = "MuJoCo 2.2.2", .softness = softness},
          by.summary.ok() ? "" : by.summary.message, by.by_position, by.by_velocity);
    if (!by.summary.ok() || !IsInstalledProgram(kNewest)) continue;
    std::string version;
    MatX by_q, by_v;
    const std::string trouble = AskNewest(mechanism, by, at.drive_force, &version, &by_q, &by_v);
    judge({.engine = "MuJoCo " + version, .softness = softness}, trouble, by_q, by_v);
  }
  return all;
}

// All states as samples of one motion, whose time means nothing: three central differences of each
// coordinate and rate, extrapolated to the sixth order.
EngineDerivative AskCorrectedMujoco(const Mechanism& mechanism, const Linearisation& at,
                                    const VecX& unit, ReducedModel* model) {
  EngineDerivative engine{.engine = "MuJoCo 2.2.2", .softness = "corrected inverse dynamics"};
  const EveryForce& by = at.every.by;
  if (!at.no_every.empty() || !by.of_drives) {
    engine.why_not = "drives do not exert the forces, or share them";
    return engine;
  }
  std::vector<DrivenSample> driven;
  const Eigen::Index n = unit.size();
  const double near = std::min(kFirstDifference, 0.2 * std::fmin(at.control, by.control));
  for (const bool rates : {false, true}) {
    const double step = rates ? 10.0 * kFirstDifference : near;
    for (Eigen::Index k = 0; k < n; ++k) {
      for (const double share : {1.0, -1.0, 0.5, -0.5, 0.25, -0.25}) {
        VecX q = at.q, v = at.v;
        (rates ? v : q)[k] += share * step * unit[k];
        if (RunSummary moved = model->Move(q, v, at.a); !moved.ok()) {
          engine.why_not = moved.message;
          return engine;
        }
        driven.push_back(model->sample().driven);
      }
    }
  }
  Motion motion;
  motion.sample_s = kSample_s,
  motion.duration_s = kSample_s * static_cast<double>(driven.size() - 1);
  SimulationOptions options;
  options.mode = DriveMode::kInverse;
  const SimulationRun run = Simulate(
      mechanism, motion,
      [&](double t_s, DrivenSample* sample) {
        *sample = driven[static_cast<size_t>(std::lround(t_s / kSample_s))];
        return RunSummary::Done();
      },
      options);
  if (!run.summary.ok()) engine.why_not = run.summary.message;
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  MatX forces(static_cast<Eigen::Index>(driven.size()), drives);
  for (Eigen::Index d = 0; d < drives && engine.why_not.empty(); ++d) {
    const int column =
        run.trace.Find(Quantity::kForce, mechanism.drives[static_cast<size_t>(d)].name);
    if (column < 0 || run.trace.values.rows() != forces.rows()) {
      engine.why_not = "it gives no force of every drive";
      return engine;
    }
    forces.col(d) = run.trace.values.col(column);
  }
  if (!engine.why_not.empty()) return engine;
  MatX slopes(drives, 2 * n);
  for (Eigen::Index k = 0; k < 2 * n; ++k) {
    const double h = (k < n ? near : 10.0 * kFirstDifference) * unit[k % n];
    const auto difference = [&](Eigen::Index i, double step) {
      return VecX((forces.row(6 * k + i) - forces.row(6 * k + i + 1)).transpose() / (2.0 * step));
    };
    slopes.col(k) =
        (difference(0, h) - 20.0 * difference(2, 0.5 * h) + 64.0 * difference(4, 0.25 * h)) / 45.0;
  }
  VecX rows(drives);
  for (Eigen::Index d = 0; d < drives; ++d) {
    const bool slides = IsLength(mechanism, {Coordinate::Kind::kDrive, static_cast<int>(d), 0});
    rows[d] = slides ? CharacteristicLength(mechanism) : 1.0;
  }
  const MatX size = rows * unit.transpose();
  const MatX q = by.acting.by_position.topRows(drives),
             a = by.acting.by_acceleration.topRows(drives);
  const double least = 1e-6 * a.cwiseProduct(size).cwiseAbs().maxCoeff();
  const double of_q = std::max(q.cwiseProduct(size).cwiseAbs().maxCoeff(), least);
  const double of_a = a.cwiseProduct(size).cwiseAbs().maxCoeff();
  engine.position_error = ShareApart(slopes.leftCols(n), q, rows, unit, least);
  engine.velocity_error = ShareApart(slopes.rightCols(n), by.acting.by_velocity.topRows(drives),
                                     rows, unit, std::sqrt(of_q * of_a));
  return engine;
}

}  // namespace mbv
