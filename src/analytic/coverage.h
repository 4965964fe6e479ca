// Coverage: what a paper's equations take for granted about a mechanism, as data.
//
// Equations compute from parameters; the other witnesses compute from the bodies and joints that a
// model file makes of them. Both mean one mechanism only as long as the model keeps what the
// equations assume: which bodies and joints there are, where their joints and centres of mass lie,
// which products of inertia vanish. Each form states its assumptions as a Coverage; FindUncovered
// compares them with the resolved mechanism before the form is made.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Components that the equations do not depend on.
inline const Vec3 kAnyVector = Vec3::Constant(kNan);
inline const Mat3 kAnyMatrix = Mat3::Constant(kNan);

/// A body of the equations; NaN entries are of no influence.
struct AssumedBody {
  std::string name{};
  double mass = kNan;         ///< [kg]
  Vec3 com = kAnyVector;      ///< in the body frame [m]
  Mat3 inertia = kAnyMatrix;  ///< about the centre of mass, body axes [kg m²]
  std::string why{};          ///< what the equations assume, in words
  bool takes_loads = true;    ///< external wrenches on it enter the equations
};

/// A joint of the equations; NaN entries are of no influence.
struct AssumedJoint {
  std::string name{};
  JointKind kind = JointKind::kFixed;
  std::string parent{}, child{};  ///< bodies
  Vec3 p_parent = kAnyVector;     ///< centre, in the parent's frame [m]
  Vec3 p_child = kAnyVector;      ///< centre, in the child's frame [m]
  Vec3 axis_parent = kAnyVector;  ///< axis in the parent's frame; universal: the first axis
  Vec3 axis_child = kAnyVector;   ///< axis in the child's frame; universal: the second axis
  Mat3 R_zero = kAnyMatrix;       ///< child in the parent where the coordinates are zero
  bool reversible = false;        ///< parent and child may be exchanged, and the axes' sense
};

/// A drive on a joint's only coordinate, or between two points.
struct AssumedDrive {
  std::string name{};
  std::string joint{};  ///< "" for a distance
  std::string body_from{}, body_to{};
  Vec3 p_from = kAnyVector, p_to = kAnyVector;
  double stiffness = kNan;  ///< of its servo [N/m or N m/rad], infinite: locked; stiffness only
};

/// An output whose frame is a body's frame, seen from the world.
struct AssumedOutput {
  std::string name{}, body{};
};

/// A straight uniform beam between two points of a body; stiffness only.
struct AssumedBeam {
  std::string name{};  ///< Beam::name
  double length = kNan;
  Section section{};
  double youngs_modulus = kNan, shear_modulus = kNan;
};

/// Any other number that the equations assume.
struct AssumedNumber {
  std::string subject{}, quantity{};  ///< "gravity", "component x"
  double actual = kNan, assumed = kNan;
  double scale = 1.0;  ///< of what is negligible
  std::string unit{}, why{};
  bool inertial = false;  ///< without influence on kinematics and stiffness
};

struct Coverage {
  std::string form;                      ///< "the closed form of the cabin robot"
  std::vector<std::string> missing;      ///< parameters that the equations read and the model lacks
  std::vector<AssumedBody> bodies;       ///< all; any other body with a mass is outside
  std::vector<AssumedJoint> joints;      ///< all; free joints need not be named
  std::vector<AssumedDrive> drives;      ///< all, in any order
  std::vector<AssumedDrive> prescribed;  ///< all, in any order
  std::vector<AssumedOutput> outputs;    ///< others may be there
  std::vector<AssumedBeam> beams;        ///< all
  std::vector<AssumedNumber> numbers;
};

/// States the assumptions for a mechanism of the form's name with its parameters.
using CoverageFunction = Coverage (*)(const Mechanism&);

/// Reads parameters by name; NaN for a missing one, which is noted in the coverage.
class ParameterReader {
 public:
  ParameterReader(const Mechanism& mechanism, Coverage* coverage)
      : mechanism_(mechanism), coverage_(coverage) {}
  [[nodiscard]] double operator()(const std::string& name) const;
  /// `fallback` for a missing one.
  [[nodiscard]] double operator()(const std::string& name, double fallback) const;
  /// STEM_x, STEM_y, STEM_z.
  [[nodiscard]] Vec3 Vector(const std::string& stem) const;
  [[nodiscard]] Vec3 Vector(const std::string& stem, double fallback) const;

 private:
  const Mechanism& mechanism_;
  Coverage* coverage_;
};

/// Direction in the world of a body's axis (0, 1, 2) at home; NaN where the mechanism has no such
/// body or no home.
[[nodiscard]] Vec3 HomeAxis(const Mechanism& mechanism, const std::string& body, int axis);
/// States that `value` is positive at home: the assembly that the equations choose among several.
/// NaN states nothing.
void StateBranch(const std::string& subject, double value, const std::string& why,
                 Coverage* coverage);

/// Which assumptions a form needs.
enum class Concern {
  kDynamics,    ///< all but the beams
  kKinematics,  ///< masses and loads aside
  kStiffness,   ///< kinematics and beams
};

/// What a mechanism has that the equations do not, or the other way round: one warning each, which
/// names the body or joint, the number and the assumption. Lengths are compared to 1e-9 of the
/// mechanism's size, masses and inertias to 1e-9 of the body's.
[[nodiscard]] std::vector<Finding> FindUncovered(const Coverage& coverage,
                                                 const Mechanism& mechanism, Concern concern);
/// Loads on bodies whose loads do not enter the equations.
[[nodiscard]] std::vector<Finding> FindUncoveredLoads(const Coverage& coverage,
                                                      const Mechanism& mechanism,
                                                      const Motion& motion);

/// "outside what the equations cover: <the first finding> (and 3 more)"; "" if there are none.
[[nodiscard]] std::string ReasonNotApplicable(std::span<const Finding> uncovered);

}  // namespace mbv
