#include "mesh/inertia_diagnosis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/text.h"
#include "mechanism/impossible_inertia.h"
#include "mesh/tensor_guesses.h"
#include "mesh/weld.h"

namespace mbv {
namespace {

using internal::Guess;
using internal::TensorOff;

// The meshes of a body in its frame, each made closed where small gaps allow it.
struct Surface {
  TriangleMesh whole;
  std::vector<MassShape> parts;  // solids that do not touch each other
  std::vector<Mat3> R_BG;        // axes of the files
  std::vector<Vec3> p_BG;
  std::string open;  // files that bound no volume, and where
};

constexpr double kLeastVolume = 1e-9;  // of a mesh's size cubed: no sheet metal is so thin
constexpr double kGap = 1e-5;          // of a mesh's size: numbers in files have about seven digits

Surface SurfaceOf(const Body& body, std::vector<std::string>* files) {
  Surface surface;
  for (const Shape& shape : body.shapes) {
    const auto* mesh = std::get_if<Mesh>(&shape.geometry);
    if (mesh == nullptr) continue;
    files->push_back(mesh->file);
    TriangleMesh placed = *mesh->surface;
    for (Vec3& p : placed.vertices) p = mesh->X_BG * p;
    if (OpenEdges(placed) > 0) placed = Welded(placed, kGap * DiagonalOf(placed));
    const size_t open = OpenEdges(placed);
    // A sheet with two sides is closed, too.
    const double diagonal = DiagonalOf(placed);
    const bool flat =
        open == 0 && !(SolidShape(placed).amount > kLeastVolume * std::pow(diagonal, 3));
    if (open > 0 || flat) {
      surface.open += (surface.open.empty() ? "" : ", ") + mesh->file +
                      (flat ? " (no volume)" : fmt::format(" ({} open edges)", open));
    }
    for (const TriangleMesh& part : PartsOf(placed)) surface.parts.push_back(SolidShape(part));
    surface.R_BG.emplace_back(mesh->X_BG.linear());
    surface.p_BG.emplace_back(mesh->X_BG.translation());
    const int first = static_cast<int>(surface.whole.vertices.size());
    surface.whole.vertices.insert(surface.whole.vertices.end(), placed.vertices.begin(),
                                  placed.vertices.end());
    for (const auto& t : placed.triangles) {
      surface.whole.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
  }
  return surface;
}

class Diagnosis {
 public:
  Diagnosis(const Body& body, const Surface& surface, BodyInertia* result)
      : body_(body), surface_(surface), result_(*result), solid_(result->solid) {}

  void Run() {
    JudgeDensity();
    Measure();
    if (result_.centre_off > kInertiaLimit) ExplainTogether();
    if (!explained_ && result_.centre_off > kInertiaLimit) ExplainCentre();
    const std::string impossible = Impossible();
    if (!explained_ && (result_.tensor_off > kInertiaLimit || !impossible.empty())) {
      ExplainTensor(impossible);
    }
  }

 private:
  void Add(InertiaMistake mistake, const std::string& text, const std::string& hint) {
    result_.findings.push_back({mistake, text, hint});
  }

  [[nodiscard]] std::string Impossible() const {
    const Mat3& I = body_.I_Bcm_B;
    const double least = Eigen::SelfAdjointEigenSolver<Mat3>(I).eigenvalues()[0];
    if (least < -1e-9 * I.norm()) {
      return fmt::format("a principal inertia is {:.4g} kg m², below zero", least);
    }
    return TriangleViolation(body_);
  }

  [[nodiscard]] static bool IsProbable(double density) {
    return density >= kLeastDensity && density <= kMostDensity;
  }

  // A mesh in the wrong unit is taken in the right one from here on, so is a mass.
  void JudgeDensity() {
    const double density = result_.density;
    mass_ = body_.mass;
    if (IsProbable(density)) return;
    const std::string implied =
        fmt::format("mass {:.4g} kg in a volume of {:.4g} m³ is a density of {:.3g} kg/m³",
                    body_.mass, solid_.amount, density);
    for (const double millimetres : {1e3, 1e-3}) {
      const double unit = millimetres * millimetres * millimetres;
      if (!IsProbable(density * unit)) continue;
      Add(InertiaMistake::kMeshMillimetres,
          fmt::format("{}, with the mesh {} it is {:.4g} kg/m³", implied,
                      millimetres > 1.0 ? "in millimetres" : "scaled by 0.001 once only",
                      density * unit),
          millimetres > 1.0 ? "give the mesh the scale 0.001" : "give the mesh the scale 1");
      solid_.amount /= unit;
      solid_.p_cm = MovedCentre(1.0 / millimetres);
      solid_.G_cm /= millimetres * millimetres;
      scale_ = 1.0 / millimetres;
      return;
    }
    std::string hint = "no material has this density";
    for (const double unit : {1e3, 1e-3}) {
      if (!IsProbable(density * unit)) continue;
      hint = fmt::format("times {:g} it is {:.4g} kg/m³: g for kg, or g/cm³ for kg/m³?", unit,
                         density * unit);
      // The tensor may come from either mass.
      const Mat3 G = body_.I_Bcm_B / (unit * body_.mass);
      if (TensorOff(G, solid_.G_cm) < kInertiaLimit) mass_ *= unit;
    }
    Add(InertiaMistake::kImprobableDensity, implied, hint);
  }

  // The file's frame stays where it is when the file is scaled.
  [[nodiscard]] Vec3 MovedCentre(double scale) const {
    const Vec3& p = surface_.p_BG.front();
    return p + scale * (solid_.p_cm - p);
  }

  void Measure() {
    r_m_ = std::sqrt(0.5 * solid_.G_cm.trace());
    G_ = body_.I_Bcm_B / mass_;
    result_.r_m = r_m_;
    result_.centre_off = (body_.p_BoBcm_B - solid_.p_cm).norm() / r_m_;
    result_.tensor_off = TensorOff(G_, solid_.G_cm);
  }

  // True when centre and tensor are both what a mistake would give.
  [[nodiscard]] bool Explains(const Vec3& p, const Mat3& G) const {
    const double centre = (body_.p_BoBcm_B - p).norm() / r_m_, tensor = TensorOff(G_, G);
    const double before = std::max(result_.centre_off, result_.tensor_off);
    return std::max(centre, tensor) <= std::min(kInertiaLimit, kExplainedShare * before);
  }

  // Mistakes of the whole part: centre and tensor alike.
  void ExplainTogether() {
    for (int k = 0; k < 3; ++k) {
      Mat3 M = Mat3::Identity();
      M(k, k) = -1.0;
      if (!Explains(M * solid_.p_cm, M * solid_.G_cm * M)) continue;
      explained_ = true;
      Add(InertiaMistake::kMirrored,
          fmt::format("centre of mass and tensor are those of the part mirrored in {}", "xyz"[k]),
          "the values of the left part on the right one, or a mesh without its negative scale");
      return;
    }
    for (const Mat3& R : surface_.R_BG) {
      for (size_t i = 0; i < surface_.p_BG.size(); ++i) {
        const Vec3 p = R.transpose() * (solid_.p_cm - surface_.p_BG[i]);
        const bool turned = !R.isIdentity(1e-3);
        if (!turned || !Explains(p, R.transpose() * solid_.G_cm * R)) continue;
        explained_ = true;
        Add(InertiaMistake::kOtherAxes,
            "centre of mass and tensor are given in the mesh's frame, not in the body's",
            "move both by the mesh's origin (xyz and rpy)");
        return;
      }
    }
    const MassShape shell = ShellShape(surface_.whole);
    if (scale_ == 1.0 && Explains(shell.p_cm, shell.G_cm)) {
      explained_ = true;
      AddShell();
    }
  }

  void AddShell() {
    Add(InertiaMistake::kShell, "the tensor is that of a thin shell on the mesh, not of the solid",
        "if the part is solid, compute it as such");
  }

  void ExplainCentre() {
    const Vec3 &p = body_.p_BoBcm_B, &c = solid_.p_cm;
    const auto near = [&](const Vec3& q, double size) {
      return (p - q).norm() <= std::min(kInertiaLimit * size, kExplainedShare * (p - c).norm());
    };
    const std::string off =
        fmt::format("the centre of mass is {:.4g} mm off the mesh's", 1e3 * (p - c).norm());
    if (near(1e3 * c, 1e3 * r_m_) || near(1e-3 * c, 1e-3 * r_m_)) {
      Add(InertiaMistake::kCentreMillimetres, off + ": a factor of 1000, metres and millimetres",
          "state it in metres");
    } else if (p.norm() <= 1e-3 * r_m_) {
      Add(InertiaMistake::kCentreAtOrigin, off + ": it lies in the body's origin",
          "state the centre of mass (URDF: <origin> of <inertial>)");
    } else {
      Add(InertiaMistake::kUnexplained, off, "no usual mistake explains it");
    }
  }

  void ExplainTensor(const std::string& impossible) {
    const internal::TensorCase tensor{
        .G = G_,
        .solid = solid_,
        .shell = ShellShape(surface_.whole).G_cm * scale_ * scale_,
        .parts = scale_ == 1.0 ? surface_.parts : std::vector<MassShape>{},
        .R_BG = surface_.R_BG,
        .p_BG = surface_.p_BG,
        .density = result_.density};
    if (const auto guess = internal::BestGuess(tensor)) {
      Add(guess->mistake, guess->text + (impossible.empty() ? "" : " (nothing has such a tensor)"),
          guess->hint);
    } else if (!impossible.empty()) {
      Add(InertiaMistake::kImpossibleTensor, impossible, "no distribution of mass has this tensor");
    } else {
      Add(InertiaMistake::kUnexplained,
          fmt::format("the tensor is {:.0f} % off that of the mesh as a homogeneous solid",
                      100.0 * result_.tensor_off),
          "no usual mistake explains it");
    }
  }

  const Body& body_;
  const Surface& surface_;
  BodyInertia& result_;
  MassShape solid_;  // in the right unit
  double scale_ = 1.0;
  double mass_ = 0.0, r_m_ = kNan;
  Mat3 G_ = Mat3::Zero();  // stated
  bool explained_ = false;
};

}  // namespace

const char* WordOf(InertiaMistake mistake) {
  switch (mistake) {
    case InertiaMistake::kNoMass:
      return "no_mass";
    case InertiaMistake::kOpenMesh:
      return "open_mesh";
    case InertiaMistake::kImpossibleTensor:
      return "impossible_tensor";
    case InertiaMistake::kImprobableDensity:
      return "improbable_density";
    case InertiaMistake::kMeshMillimetres:
      return "mesh_millimetres";
    case InertiaMistake::kCentreMillimetres:
      return "centre_millimetres";
    case InertiaMistake::kCentreAtOrigin:
      return "centre_at_origin";
    case InertiaMistake::kSteinerAdded:
      return "steiner_added";
    case InertiaMistake::kSteinerTwice:
      return "steiner_twice";
    case InertiaMistake::kSteinerMissing:
      return "steiner_missing";
    case InertiaMistake::kProductSigns:
      return "product_signs";
    case InertiaMistake::kOtherAxes:
      return "other_axes";
    case InertiaMistake::kTensorUnits:
      return "tensor_units";
    case InertiaMistake::kOtherDensity:
      return "other_density";
    case InertiaMistake::kShell:
      return "shell";
    case InertiaMistake::kMirrored:
      return "mirrored";
    case InertiaMistake::kUnexplained:
      return "unexplained";
  }
  return "";
}

BodyInertia DiagnoseInertia(const Body& body) {
  BodyInertia result;
  result.body = body.name;
  result.mass = body.mass;
  result.p_stated = body.p_BoBcm_B;
  result.I_stated = body.I_Bcm_B;
  const Surface surface = SurfaceOf(body, &result.meshes);
  const auto add_no_mass = [&](const std::string& volume) {
    if (body.mass > 0.0) return;
    result.findings.push_back(
        {InertiaMistake::kNoMass, "it has a mesh" + volume + " and no mass",
         "state its mass properties (URDF: <inertial>); a body that never moves needs none"});
  };
  if (!surface.open.empty()) {
    add_no_mass("");
    result.findings.push_back({InertiaMistake::kOpenMesh, "not closed: " + surface.open,
                               "without a volume there is nothing to compare with"});
    return result;
  }
  result.solid = SolidShape(surface.whole);
  result.r_m = std::sqrt(0.5 * result.solid.G_cm.trace());
  add_no_mass(fmt::format(" of {:.4g} cm³", 1e6 * result.solid.amount));
  if (body.mass <= 0.0) return result;
  result.density = body.mass / result.solid.amount;
  Diagnosis(body, surface, &result).Run();
  return result;
}

}  // namespace mbv
