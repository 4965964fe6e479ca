#include "simulation/import/read_mjcf.h"

#include <map>
#include <string>
#include <vector>

#include "simulation/import/mjcf_import.h"
#include "simulation/mjcf/foreign.h"

namespace mbv {
namespace simulation {
namespace {

// Compiles once more if attached models have keyframes: how long these are follows from the whole.
ModelHandle Compile(mjcf::ForeignMjcf* foreign) {
  ModelHandle model = CompileMjcf(foreign->Text());
  std::map<std::string, int> address;
  for (int j = 0; j < model->njnt; ++j) {
    const char* name = mj_id2name(model.get(), mjOBJ_JOINT, j);
    if (name != nullptr) address[name] = model->jnt_qposadr[j];
  }
  const std::vector<double> reference(model->qpos0, model->qpos0 + model->nq);
  if (foreign->PlaceKeyframes(reference, address)) model = CompileMjcf(foreign->Text());
  return model;
}

// What MuJoCo 3 takes by default: pyramids from a centre to the faces, all counted as positive;
// exact where all are seen from there. The centre is that of the pyramids from the surface's own
// centre. By mesh [m³].
std::map<std::string, double> MeshVolumes(const mjModel& m) {
  std::map<std::string, double> volumes;
  for (int mesh = 0; mesh < m.nmesh; ++mesh) {
    const float* vertices = m.mesh_vert + 3 * m.mesh_vertadr[mesh];
    const int* faces = m.mesh_face + 3 * m.mesh_faceadr[mesh];
    const auto corner = [&](int face, int k) {
      return Vec3(
          Eigen::Map<const Eigen::Vector3f>(vertices + 3 * faces[3 * face + k]).cast<double>());
    };
    const int count = m.mesh_facenum[mesh];
    Vec3 centre = Vec3::Zero();
    double area = 0.0, volume = 0.0;
    for (int f = 0; f < count; ++f) {
      const Vec3 a = corner(f, 0), b = corner(f, 1), c = corner(f, 2);
      const double of_face = 0.5 * (b - a).cross(c - a).norm();
      area += of_face;
      centre += of_face * (a + b + c) / 3.0;
    }
    if (area > 0.0) centre /= area;
    for (const bool last : {false, true}) {
      Vec3 moment = Vec3::Zero();
      volume = 0.0;
      for (int f = 0; f < count; ++f) {
        const Vec3 a = corner(f, 0) - centre, b = corner(f, 1) - centre, c = corner(f, 2) - centre;
        const double of_face = std::abs(a.cross(b).dot(c)) / 6.0;
        volume += of_face;
        moment += of_face * (a + b + c) / 4.0;
      }
      if (!last && volume > 0.0) centre += moment / volume;
    }
    if (const char* name = mj_id2name(&m, mjOBJ_MESH, mesh)) volumes.emplace(name, volume);
  }
  return volumes;
}

ImportedMjcf Import(mjcf::ForeignMjcf* source, const std::string& file, const FloatingBase& base,
                    Diagnostics* diagnostics) {
  const mjcf::ForeignMjcf& foreign = *source;
  ImportedMjcf imported;
  imported.model = Compile(source);
  if (source->StateMeshMasses(MeshVolumes(*imported.model))) imported.model = Compile(source);
  imported.text = foreign.Text();
  imported.printed = RoundingOf(imported.text);
  const mjModel& m = *imported.model;
  MjcfImport in{.m = m, .foreign = foreign, .file = file, .diagnostics = diagnostics, .base = base};
  in.mechanism.name = foreign.ModelName();
  in.mechanism.file = file;
  in.left_out = foreign.left_out();
  in.mechanism.gravity_W = in.IsOff(mjDSBL_GRAVITY) ? Vec3(Vec3::Zero()) : VecAt(m.opt.gravity);
  if (in.mechanism.gravity_W.norm() > 0.0) {
    in.mechanism.up_W = -in.mechanism.gravity_W.normalized();
  }
  ChooseHeld(&in);
  AddTree(&in);
  AddDrives(&in);
  AddMotors(&in);
  AddEqualities(&in);
  AddElements(&in);
  AddCompensation(&in);
  AddSites(&in);
  AddShapes(&in);
  WarnWhatIsLost(&in);
  imported.mechanism = std::move(in.mechanism);
  imported.left_out = std::move(in.left_out);
  imported.joint_of = std::move(in.joint_of);
  imported.closure_of = std::move(in.closure_of);
  for (int e = 0; e < m.neq; ++e) {
    const char* name = mj_id2name(&m, mjOBJ_EQUALITY, e);
    imported.closed_by_sites.push_back(name != nullptr &&
                                       foreign.closures_by_sites().contains(name));
  }
  return imported;
}

}  // namespace

std::optional<ImportedMjcf> ImportMjcf(const std::string& text, const std::string& file,
                                       const FloatingBase& base,
                                       const std::vector<std::string>& warnings,
                                       Diagnostics* diagnostics) {
  mjcf::ForeignMjcf foreign(text, file, diagnostics);
  if (!foreign.ok()) return std::nullopt;
  constexpr int kMostRounds = 200;
  for (int round = 0; round < kMostRounds; ++round) {
    try {
      ImportedMjcf imported = Import(&foreign, file, base, diagnostics);
      for (const std::string& warning : warnings) {
        diagnostics->Add({Severity::kWarning, file, 0, 0, "MuJoCo: " + warning, ""});
      }
      if (diagnostics->has_errors()) return std::nullopt;
      return imported;
    } catch (const EngineError& error) {
      if (foreign.DropWhatIsUnknown(error.what())) continue;
      diagnostics->AddError(file, std::string("MuJoCo: ") + error.what());
      return std::nullopt;
    }
  }
  diagnostics->AddError(file, "too many things in it are unknown to MuJoCo 2.2");
  return std::nullopt;
}

}  // namespace simulation

std::optional<MjcfModel> ReadMjcf(const std::string& text, const std::string& file,
                                  const FloatingBase& base, Diagnostics* diagnostics) {
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  auto imported = simulation::ImportMjcf(text, file, base, warnings, diagnostics);
  if (!imported) return std::nullopt;
  return MjcfModel{std::move(imported->mechanism), std::move(imported->left_out),
                   imported->printed};
}

}  // namespace mbv
