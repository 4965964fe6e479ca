// What one stiffness shows a designer: its weakest directions, what each element contributes to the
// compliance, and indices that every mechanism has.
#pragma once

#include <string>
#include <vector>

#include "math/stiffness.h"

namespace mbv {

/// The unit direction of a pure force (or moment) under which the output yields most along it, and
/// the stiffness against it; world axes.
struct WeakDirection {
  Vec3 direction = Vec3::Constant(kNan);
  double stiffness = kNan;  ///< [N/m] or [N m/rad]
};
[[nodiscard]] WeakDirection WeakestTranslation(const Mat6& C);
[[nodiscard]] WeakDirection WeakestRotation(const Mat6& C);

/// The weakest motion of all, rotation and translation together. That needs a length L, by which
/// rotations are made displacements; L = sqrt(tr C_εε / tr C_γγ) makes both count alike, and stays
/// with the mechanism when units change.
struct WeakScrew {
  double length_m = kNan;             ///< L
  double stiffness = kNan;            ///< [N/m]
  Vec6 twist = Vec6::Constant(kNan);  ///< [γ; ε], world, of the output's origin; |[Lγ; ε]| = 1
  Vec3 axis = Vec3::Constant(kNan);   ///< unit direction of the screw (of ε if it does not turn)
  Vec3 point = Vec3::Constant(kNan);  ///< of the axis nearest to the output's origin [m]
  double pitch_m = kNan;              ///< displacement along the axis per radian; infinite without
                                      ///< rotation
};
[[nodiscard]] WeakScrew WeakestScrew(const Mat6& C, double length_m = kNan);  ///< NaN: the above L

/// Parts of the compliance that one element causes; each column adds up to 1 over the elements.
struct Contribution {
  std::string element;
  double translation = kNan, rotation = kNan;  ///< in the weakest directions
  Vec6 axis = Vec6::Constant(kNan);            ///< of C_ii, order [rotations; translations]
};
/// Largest in the weakest translation first. Empty without shares or a compliance.
[[nodiscard]] std::vector<Contribution> Contributions(const StiffnessResult& result);

struct NamedIndex {
  std::string name, unit, meaning;
  double value = kNan;
};
/// Indices of any stiffness: weakest and largest principal stiffnesses, condition number.
[[nodiscard]] std::vector<NamedIndex> GeneralIndices(const StiffnessResult& result);

/// Unit of an entry of K ("N m/rad", "N/rad", "N m/m", "N/m") and of C.
[[nodiscard]] const char* StiffnessUnit(int row, int column);
[[nodiscard]] const char* ComplianceUnit(int row, int column);

}  // namespace mbv
