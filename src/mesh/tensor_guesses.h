// Mistakes that turn the tensor of a solid into another one. Internal to the inertia diagnosis.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mesh/inertia_diagnosis.h"
#include "mesh/mass_properties.h"

namespace mbv::internal {

/// |A − B| / max(|A|, |B|) (Frobenius); 1 where either is zero.
[[nodiscard]] double TensorOff(const Mat3& A, const Mat3& B);

/// A stated tensor, and what is known about the body. Everything per mass [m²], in body axes.
struct TensorCase {
  Mat3 G = Mat3::Zero();         ///< stated, about the centre of mass
  MassShape solid;               ///< of the mesh
  Mat3 shell = Mat3::Zero();     ///< of a skin on it
  std::vector<MassShape> parts;  ///< solids that the mesh consists of
  std::vector<Mat3> R_BG;        ///< axes of the mesh files
  std::vector<Vec3> p_BG;        ///< and their origins
  double density = kNan;         ///< that the mass implies [kg/m³]
};

/// What a mistake would make of the solid's tensor.
struct Guess {
  InertiaMistake mistake = InertiaMistake::kUnexplained;
  Mat3 G = Mat3::Zero();
  std::string text, hint;
};

/// The first mistake in the order of likelihood that explains the stated tensor and is no worse
/// than twice the best; empty without one.
[[nodiscard]] std::optional<Guess> BestGuess(const TensorCase& tensor);

}  // namespace mbv::internal
