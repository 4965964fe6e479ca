// Stated mass properties of a body against its meshes, and the mistake that explains a difference.
//
// Used terms: the meshes, taken as one homogeneous solid, give a centre of mass c and an inertia
// per mass G about it (mass_properties.h); the body states c', and G' = I' / m. Two of them differ
// by the share |G' − G| / max(|G'|, |G|) (Frobenius), two centres by |c' − c| / r with the radius
// of gyration r = sqrt(tr(G) / 2). Mass cannot be wrong against a mesh, only the density m / V
// improbable.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/mesh/mass_properties.h"

namespace mbv {

enum class InertiaMistake {
  kNoMass,             ///< meshes, and none stated
  kOpenMesh,           ///< a mesh that bounds no volume
  kImpossibleTensor,   ///< no distribution of mass has it
  kImprobableDensity,  ///< of no material
  kMeshMillimetres,    ///< mesh in mm, without its scale
  kCentreMillimetres,  ///< centre of mass in mm
  kCentreAtOrigin,     ///< left out, so that it lies in the origin
  kSteinerAdded,       ///< tensor about the body's origin
  kSteinerTwice,       ///< and Steiner's term added once more
  kSteinerMissing,     ///< subtracted where there was none, or left out between parts
  kProductSigns,       ///< of products of inertia
  kOtherAxes,          ///< tensor, or all, in other axes than the body's
  kTensorUnits,        ///< a power of 1000
  kOtherDensity,       ///< tensor of another mass than the stated one
  kShell,              ///< tensor of a thin skin
  kMirrored,           ///< of the mirrored part
  kUnexplained,        ///< differs, and none of these explains it
};

/// "steiner_twice", as in files.
[[nodiscard]] const char* WordOf(InertiaMistake mistake);

struct InertiaFinding {
  InertiaMistake mistake = InertiaMistake::kUnexplained;
  std::string text;  ///< one sentence without a full stop
  std::string hint;
};

/// What came of one body with meshes.
struct BodyInertia {
  std::string body;
  std::vector<std::string> meshes;  ///< files
  double mass = 0.0;                ///< stated [kg]
  MassShape solid;                  ///< of the meshes together, in the body frame; NaN: open
  double density = kNan;            ///< implied [kg/m³]
  double centre_off = kNan;         ///< share of r
  double tensor_off = kNan;         ///< share
  double r_m = kNan;                ///< radius of gyration of the meshes
  Vec3 p_stated = Vec3::Constant(kNan);
  Mat3 I_stated = Mat3::Constant(kNan);
  std::vector<InertiaFinding> findings;
};

/// Differences up to this share are those of meshing, rounding and bolts.
inline constexpr double kInertiaLimit = 0.08;
/// A mistake explains a difference when less than this share of it is left.
inline constexpr double kExplainedShare = 1.0 / 3.0;
/// Between styrofoam and osmium, with room for hollow parts [kg/m³].
inline constexpr double kLeastDensity = 50.0, kMostDensity = 23000.0;

/// Judges a body with at least one mesh. Other shapes are passed over.
[[nodiscard]] BodyInertia DiagnoseInertia(const Body& body);

}  // namespace mbv

// Mistakes that turn the tensor of a solid into another one. Internal to the inertia diagnosis.

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
