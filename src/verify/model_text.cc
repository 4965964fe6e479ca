#include "verify/model_text.h"

#include <fmt/format.h>
#include <Eigen/Dense>
#include <algorithm>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "base/worker_pool.h"
#include "external/mechanism_json.h"
#include "math/bytes.h"
#include "model_file/sdf/read_sdf.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"
#include "model_file/yaml/yaml_reader.h"
#include "report/result_tables.h"
#include "simulation/engine/engine_model.h"
#include "simulation/import/read_mjcf.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"

namespace mbv {
namespace {

bool IsSdf(const std::string& file) { return file.ends_with(".sdf"); }

bool IsXacro(const std::string& file) { return file.ends_with(".xacro"); }

// All but URDF, which model files may name, too.
bool IsForeign(const std::string& file) {
  return IsSdf(file) || IsXacro(file) || file.ends_with(".xml");
}

ForeignModel AnswerOfMjcf(const std::string& text, const std::string& file,
                          const FloatingBase& base) {
  Diagnostics findings;
  auto read = ReadMjcf(text, file, base, &findings);
  if (!read) return {.findings = findings.findings(), .model = "", .left_out = {}, .printed = {}};
  return {.findings = findings.findings(),
          .model = ForeignModelText(std::move(read->mechanism)),
          .left_out = std::move(read->left_out),
          .printed = read->printed};
}

ForeignModel ReadInChild(const std::string& text, const std::string& file,
                         const FloatingBase& base) {
  constexpr double kTimeout_s = 60.0;
  const auto answers =
      InChildren(1, kTimeout_s, [&](size_t) { return ToBytes(AnswerOfMjcf(text, file, base)); });
  if (auto answer = answers[0] ? FromBytes<ForeignModel>(*answers[0]) : std::nullopt) {
    return std::move(*answer);
  }
  Diagnostics findings;
  findings.AddError(
      file, fmt::format("MuJoCo's compiler crashed on it, or took longer than {:g} s", kTimeout_s));
  return {.findings = findings.findings(), .model = "", .left_out = {}, .printed = {}};
}

// The model that an MJCF or SDF file stands for, empty after errors, and what it leaves out.
std::optional<ForeignModel> ModelOf(const std::string& file, const FloatingBase& base,
                                    Diagnostics* findings) {
  if (IsXacro(file)) {
    findings->AddError(file, "a xacro file is no robot yet", XacroHint(file));
    return std::nullopt;
  }
  YamlReader reader(file);
  const auto text = reader.ReadFile();
  findings->Append(reader.diagnostics());
  if (!text) return std::nullopt;
  ForeignModel model = IsSdf(file) ? ReadSdf(*text, file, base) : ReadInChild(*text, file, base);
  for (const Finding& finding : model.findings) findings->Add(finding);
  return findings->has_errors() ? std::nullopt : std::optional(std::move(model));
}

// Findings point to generated lines.
void AddWithoutPlaces(const Diagnostics& from, Diagnostics* to) {
  for (Finding finding : from.findings()) {
    finding.line = finding.column = 0;
    to->Add(std::move(finding));
  }
}

LoadResult LoadForeign(const std::string& file, const LoadOptions& options) {
  LoadResult result;
  auto answer =
      ModelOf(file, {.held = options.base, .free = options.free_base}, &result.diagnostics);
  if (!answer) return result;
  LoadOptions of_text = options;
  of_text.printed = answer->printed;
  LoadResult loaded = LoadModelText(answer->model, file, of_text);
  AddWithoutPlaces(loaded.diagnostics, &result.diagnostics);
  result.mechanism = std::move(loaded.mechanism);
  result.literals = std::move(loaded.literals);
  result.caveats = std::move(answer->left_out);
  for (ModelCaveat& caveat : loaded.caveats) result.caveats.push_back(std::move(caveat));
  return result;
}

}  // namespace

LoadedBodies LoadRobotBodies(const std::string& file) {
  if (!IsForeign(file)) return LoadBodies(file);
  LoadedBodies result;
  const auto answer = ModelOf(file, {}, &result.diagnostics);
  if (!answer) return result;
  LoadedBodies loaded = LoadBodiesText(answer->model, file);
  AddWithoutPlaces(loaded.diagnostics, &result.diagnostics);
  result.bodies = std::move(loaded.bodies);
  return result;
}

LoadResult LoadRobot(const std::string& file, const LoadOptions& options) {
  return IsForeign(file) ? LoadForeign(file, options) : LoadModel(CompletedModel(file), options);
}

namespace {

constexpr double kServoRank = 1e-10;      // singular values below this share are zero
constexpr double kServoImbalance = 1e-6;  // of the load, which the drives leave unbalanced

// The rows of MuJoCo's constraint Jacobian at home, those of the drives apart.
struct HomeRows {
  MatX held;    // closures and prescribed joints
  MatX drives;  // one row each
};

HomeRows RowsAtHome(const simulation::EngineModel& engine, const mjData& d) {
  const int nv = engine.m->nv;
  const auto drives = static_cast<Eigen::Index>(engine.mechanism->drives.size());
  HomeRows rows{.held = MatX(0, nv), .drives = MatX::Zero(drives, nv)};
  for (int i = 0; i < d.nefc; ++i) {
    if (d.efc_type[i] != mjCNSTR_EQUALITY) continue;
    const Eigen::Map<const Eigen::RowVectorXd> row(d.efc_J + static_cast<long>(i) * nv, nv);
    Eigen::Index drive = 0;
    while (drive < drives && engine.driven[static_cast<size_t>(drive)].equality != d.efc_id[i]) {
      ++drive;
    }
    if (drive < drives) {
      rows.drives.row(drive) = row;
    } else {
      rows.held.conservativeResize(rows.held.rows() + 1, nv);
      rows.held.bottomRows(1) = row;
    }
  }
  return rows;
}

void SetGains(const MatX& M, const HomeRows& rows, double frequency_hz, HomeServos* servos) {
  const double omega = 2.0 * std::numbers::pi * frequency_hz;
  const Eigen::LLT<MatX> llt(M);
  MatX Q(M.rows(), 0);  // what the held rows take; Eigen decomposes no empty matrix
  if (rows.held.rows() > 0) {
    Eigen::ColPivHouseholderQR<MatX> qr;
    qr.setThreshold(kServoRank);
    qr.compute(llt.matrixL().solve(MatX(rows.held.transpose())));
    Q = OrthogonalFactor(qr).leftCols(qr.rank());
  }
  for (Eigen::Index k = 0; k < rows.drives.rows(); ++k) {
    // Acceleration of the drive per force on it: what the held rows leave of M⁻¹.
    VecX y = llt.matrixL().solve(VecX(rows.drives.row(k).transpose()));
    y -= Q * (Q.transpose() * y);
    y -= Q * (Q.transpose() * y);
    const double mobility = y.squaredNorm();
    const double inertia = mobility > 0.0 ? 1.0 / mobility : 0.0;
    servos->kp.push_back(omega * omega * inertia);
    servos->kv.push_back(2.0 * omega * inertia);
  }
}

RunSummary SetForces(const VecX& load, const HomeRows& rows, HomeServos* servos) {
  MatX A(load.size(), rows.held.rows() + rows.drives.rows());
  A << rows.held.transpose(), rows.drives.transpose();
  VecX forces = VecX::Zero(A.cols());
  if (A.size() > 0) {
    Eigen::CompleteOrthogonalDecomposition<MatX> solver;
    solver.setThreshold(kServoRank);
    solver.compute(A);
    forces = solver.solve(load);
  }
  if ((A * forces - load).norm() > kServoImbalance * load.norm()) {
    return {.stop = Stop::kUnsupported,
            .message =
                "the drives cannot hold the home pose: a degree of freedom that they do not drive "
                "gives way to gravity or springs"};
  }
  const VecX drives = forces.tail(rows.drives.rows());
  servos->force.assign(drives.begin(), drives.end());
  return RunSummary::Done();
}

RunSummary TuneInEngine(const Mechanism& mechanism, double frequency_hz, HomeServos* servos) {
  simulation::EngineModel engine;
  RunSummary summary =
      simulation::MakeEngineModel(mechanism, WriteMjcf(mechanism, {.pictures = false}), &engine);
  if (!summary.ok()) return summary;
  const mjModel& m = *engine.m;
  const simulation::DataHandle data = simulation::MakeData(m);
  mj_forward(&m, data.get());
  const HomeRows rows = RowsAtHome(engine, *data);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> M(m.nv, m.nv);
  mj_fullM(&m, M.data(), data->qM);
  SetGains(M, rows, frequency_hz, servos);
  const VecX load = Eigen::Map<const VecX>(data->qfrc_bias, m.nv) -
                    Eigen::Map<const VecX>(data->qfrc_passive, m.nv);
  return SetForces(load, rows, servos);
}

}  // namespace

HomeServos TuneHomeServos(const Mechanism& mechanism, double frequency_hz) {
  HomeServos servos;
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  try {
    servos.summary = TuneInEngine(mechanism, frequency_hz, &servos);
  } catch (const simulation::EngineError& error) {
    servos.summary = {.stop = Stop::kEngineFailure,
                      .message = std::string("MuJoCo: ") + error.what()};
  }
  return servos;
}

std::string ModelText(const Mechanism& mechanism, ModelFormat format,
                      const std::vector<ModelCaveat>& caveats) {
  switch (format) {
    case ModelFormat::kMobility:
      return MobilityText(mechanism, ReportMobility(mechanism));
    case ModelFormat::kJson:
      return MobilityJson(mechanism, ReportMobility(mechanism));
    case ModelFormat::kMjcf:
      return WriteMjcf(mechanism);
    case ModelFormat::kUrdf:
      return WriteUrdf(mechanism);
    case ModelFormat::kYaml:
      return WriteModel(mechanism, caveats);
    case ModelFormat::kMechanism:
      return MechanismJson(mechanism);
  }
  return "";
}

MjcfText MjcfFor(const Mechanism& mechanism, ModelDrives drives) {
  if (std::string trouble = mjcf::NestingTrouble(mjcf::MakePlan(mechanism)); !trouble.empty()) {
    return {.trouble = std::move(trouble)};
  }
  MjcfOptions options;
  options.friction = true;
  options.prescribed = drives == ModelDrives::kHeld;
  if (drives == ModelDrives::kServo) {
    HomeServos servos = TuneHomeServos(mechanism);
    if (!servos.summary.ok()) return {.trouble = servos.summary.message};
    options.kp = std::move(servos.kp);
    options.kv = std::move(servos.kv);
    options.motor_home = std::move(servos.force);
  }
  return {.text = WriteMjcf(mechanism, options),
          .trouble = {},
          .missing = MissingInMjcf(mechanism, options)};
}

}  // namespace mbv
