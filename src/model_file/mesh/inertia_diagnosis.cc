#include "model_file/mesh/inertia_diagnosis.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "model_file/mesh/mass_properties.h"

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

namespace mbv::internal {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

using Guesses = std::vector<Guess>;

// Products with other signs: all three are one convention against the other.
void AddProductSigns(const Mat3& G, Guesses* guesses) {
  const std::array<const char*, 3> names{"yz", "xz", "xy"};
  for (const int flipped : {7, 1, 2, 4, 3, 5, 6}) {  // bits of yz, xz, xy
    Mat3 other = G;
    std::string which;
    for (int k = 0; k < 3; ++k) {
      if ((flipped >> k & 1) == 0) continue;
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      other(i, j) = other(j, i) = -G(i, j);
      which += (which.empty() ? "" : ", ") + std::string(names[k]);
    }
    guesses->push_back({InertiaMistake::kProductSigns, other,
                        flipped == 7
                            ? "the products of inertia have the other sign"
                            : fmt::format("products of inertia ({}) have the other sign", which),
                        "CAD may give +∫xy dm; the tensor's element is −∫xy dm"});
  }
}

void AddSteiner(const TensorCase& t, Guesses* guesses) {
  const Mat3& G = t.solid.G_cm;
  const Mat3 S = PointInertia(t.solid.p_cm);
  guesses->push_back({InertiaMistake::kSteinerAdded, G + S,
                      "the tensor is about the body's origin: Steiner's term m(|c|² 1 − c cᵀ) is "
                      "in it",
                      "state it about the centre of mass"});
  guesses->push_back({InertiaMistake::kSteinerTwice, G + 2.0 * S,
                      "Steiner's term m(|c|² 1 − c cᵀ) is added twice",
                      "state the tensor about the centre of mass: without it"});
  guesses->push_back({InertiaMistake::kSteinerMissing, G - S,
                      "Steiner's term m(|c|² 1 − c cᵀ) is missing: it was taken from a tensor that "
                      "was about the centre of mass already",
                      "state the tensor as it was"});
  for (const Vec3& p : t.p_BG) {
    if (p.isZero(0.0)) continue;
    guesses->push_back({InertiaMistake::kSteinerAdded, G + PointInertia(t.solid.p_cm - p),
                        "the tensor is about the mesh's origin: Steiner's term is in it",
                        "state it about the centre of mass"});
  }
  double volume = 0.0;
  Mat3 sum = Mat3::Zero();
  for (const MassShape& part : t.parts) {
    volume += part.amount;
    sum += part.amount * part.G_cm;
  }
  if (t.parts.size() < 2) return;
  guesses->push_back({InertiaMistake::kSteinerMissing, sum / volume,
                      fmt::format("Steiner's terms are missing: the tensor is the sum of those of "
                                  "its {} parts, each about its own centre of mass",
                                  t.parts.size()),
                      "add m(|d|² 1 − d dᵀ) of each part, d from the common centre of mass"});
}

void AddUnits(const Mat3& G, Guesses* guesses) {
  struct Unit {
    double factor;
    const char* meaning;
  };
  for (const Unit& unit :
       {Unit{1e6, "kg mm²"}, Unit{1e9, "g mm²"}, Unit{1e3, "g m²"}, Unit{1e4, "kg cm²"},
        Unit{1e7, "g cm²"}, Unit{1e-6, ""}, Unit{1e-3, ""}, Unit{1e-9, ""}}) {
    const std::string unit_text = *unit.meaning != '\0' ? fmt::format(" ({})", unit.meaning) : "";
    guesses->push_back(
        {InertiaMistake::kTensorUnits, unit.factor * G,
         fmt::format("the tensor is {:g} times that of the mesh{}", unit.factor, unit_text),
         "state it in kg m²"});
  }
}

// "x y z → −y x z": where the axes of a rotation by quarter turns point.
std::string AxesText(const Mat3& R) {
  std::string text;
  for (int k = 0; k < 3; ++k) {
    int row = 0;
    R.col(k).cwiseAbs().maxCoeff(&row);
    text += fmt::format("{}{}{}", k == 0 ? "" : " ", R(row, k) < 0.0 ? "-" : "", "xyz"[row]);
  }
  return text;
}

std::vector<Mat3> QuarterTurns() {
  std::vector<Mat3> turns;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 R = Mat3::Zero();
      for (int k = 0; k < 3; ++k) R(axes[k], k) = (signs >> k & 1) != 0 ? -1.0 : 1.0;
      if (R.determinant() > 0.0 && !R.isIdentity()) turns.push_back(R);
    }
  } while (std::next_permutation(axes.begin(), axes.end()));
  return turns;
}

void AddAxes(const TensorCase& t, Guesses* guesses) {
  const Mat3& G = t.solid.G_cm;
  const auto add = [&](const Mat3& other, const std::string& text) {
    guesses->push_back(
        {InertiaMistake::kOtherAxes, other, text, "turn it into the body's axes: R I Rᵀ"});
  };
  for (const Mat3& R : t.R_BG) {
    if (R.isIdentity(1e-3)) continue;
    add(R.transpose() * G * R, "the tensor is in the mesh's axes, not in the body's");
    add(R * G * R.transpose(), "the tensor is turned by the mesh's rpy once too often");
  }
  const Vec3 moments = Eigen::SelfAdjointEigenSolver<Mat3>(G).eigenvalues();
  std::array<int, 3> order{0, 1, 2};
  do {
    add(Vec3(moments[order[0]], moments[order[1]], moments[order[2]]).asDiagonal(),
        "the tensor is in the part's principal axes, not in the body's");
  } while (std::next_permutation(order.begin(), order.end()));
  for (const Mat3& R : QuarterTurns()) {
    add(R.transpose() * G * R,
        fmt::format("the tensor is in other axes: its x y z are the body's {}", AxesText(R)));
  }
}

// The same principal inertias about other axes.
Guess Turned(const TensorCase& t) {
  const Eigen::SelfAdjointEigenSolver<Mat3> stated(t.G), solid(t.solid.G_cm);
  Mat3 E = stated.eigenvectors();
  const Vec3 moments = solid.eigenvalues();
  if (E.determinant() < 0.0) E.col(0) = -E.col(0);
  // The smallest of the four turns that make the axes coincide.
  double angle = 2.0 * std::numbers::pi;
  Mat3 F = solid.eigenvectors();
  if (F.determinant() < 0.0) F.col(0) = -F.col(0);
  for (const Vec3& signs : {Vec3(1, 1, 1), Vec3(1, -1, -1), Vec3(-1, 1, -1), Vec3(-1, -1, 1)}) {
    angle = std::min(angle, LogRotation(E * signs.asDiagonal() * F.transpose()).norm());
  }
  return {InertiaMistake::kOtherAxes, E * moments.asDiagonal() * E.transpose(),
          fmt::format("the tensor has the mesh's principal inertias about axes that are "
                      "turned by {:.0f}°",
                      angle / kDegree),
          "turn it into the body's axes: R I Rᵀ"};
}

// Empty where motors and screws may make the difference.
std::optional<Guess> OtherDensity(const TensorCase& t) {
  constexpr double kLeast = 1.25;
  const double factor = t.G.norm() / t.solid.G_cm.norm();
  if (factor < kLeast && factor > 1.0 / kLeast) return std::nullopt;
  return Guess{
      InertiaMistake::kOtherDensity, factor * t.solid.G_cm,
      fmt::format("the tensor is {:.3g} times that of the stated mass: it belongs to a density "
                  "of {:.4g} kg/m³, the mass to one of {:.4g} kg/m³",
                  factor, factor * t.density, t.density),
      "compute mass and tensor with the same material"};
}

}  // namespace

double TensorOff(const Mat3& A, const Mat3& B) {
  const double size = std::max(A.norm(), B.norm());
  return size > 0.0 ? (A - B).norm() / size : 0.0;
}

std::optional<Guess> BestGuess(const TensorCase& tensor) {
  Guesses guesses;
  AddProductSigns(tensor.solid.G_cm, &guesses);
  AddSteiner(tensor, &guesses);
  guesses.push_back({InertiaMistake::kShell, tensor.shell,
                     "the tensor is that of a thin shell on the mesh, not of the solid",
                     "if the part is solid, compute it as such"});
  AddUnits(tensor.solid.G_cm, &guesses);
  AddAxes(tensor, &guesses);
  guesses.push_back(Turned(tensor));
  // What fits any factor or turn says least.
  if (const auto density = OtherDensity(tensor)) guesses.push_back(*density);
  const double limit =
      std::min(kInertiaLimit, kExplainedShare * TensorOff(tensor.G, tensor.solid.G_cm));
  double best = limit;
  for (const Guess& guess : guesses) best = std::min(best, TensorOff(tensor.G, guess.G));
  for (const Guess& guess : guesses) {
    const double off = TensorOff(tensor.G, guess.G);
    if (off <= limit && off <= std::max(2.0 * best, 0.5 * kInertiaLimit)) return guess;
  }
  return std::nullopt;
}

}  // namespace mbv::internal
