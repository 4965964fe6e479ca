#include "mesh/tensor_guesses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/spatial.h"

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
