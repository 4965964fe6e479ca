// The planar six-bar of the cabin robot: three parallel sliders carry the platform BC.
//
//             B ───────── C            A, D, F slide along x of the carriage (y = 0);
//           ⟋  ╲ (L1/2)   ╲            AB = L1 with the strut's pin E at its middle,
//         ⟋     E          ╲           BC = L2, CD = L3, EF = L4.
//       A     ⟍  ╲          D          α, γ: angles of AB and BC from +x, counter-clockwise;
//      [X1]     F[X3]      [X2]        β, ε: interior angles at D and F, so that D→C points along
//                                      (−cos β, sin β) and F→E along (−cos ε, sin ε).
//
// Assembly branch: AB leans right, CD and EF lean left, all three angles in (0, π/2) for the
// inverse problem. K is the middle of BC with coordinates (X, Y).
//
// [Liu 2025, Eqs. 1–4, 8, 9, 14–25, 35–46], corrected where the print is wrong
// (docs/results/equation_audit.md): AD = X_C − X1 + L3 cos β, β = β1 + β2 in (9), the signs of
// (23)–(25).
#pragma once

#include "base/run_summary.h"
#include "base/types.h"

namespace mbv::cabin_robot {

struct PlanarGeometry {
  double L1 = 0.0, L2 = 0.0, L3 = 0.0, L4 = 0.0;  ///< [m]
};

/// A scalar with its two time derivatives.
struct Motion1 {
  double p = 0.0, v = 0.0, a = 0.0;
};

/// Everything that moves in the plane.
struct PlanarState {
  Motion1 X1, X2, X3;                   ///< sliders A, D, F [m]
  Motion1 alpha, beta, epsilon, gamma;  ///< [rad]
  Motion1 X, Y;                         ///< platform centre K in the carriage frame [m]
};

/// Sensitivity of the angles to the slider speeds (V2 = Ẋ3 − Ẋ1, V3 = Ẋ2 − Ẋ1), as row vectors over
/// (Ẋ1, Ẋ2, Ẋ3).
struct AngleRates {
  Vec3 alpha, beta, epsilon, gamma;
};

/// (1)–(4) with both derivatives: X, Y, gamma given (p, v, a each) → the rest of `state`.
/// kUnreachable with the missing length when a link is too short.
[[nodiscard]] RunSummary SolveInverse(const PlanarGeometry& geometry, PlanarState* state);

/// (8), (9), (14)–(23), (35)–(46): the sliders given → the rest of `state`. Valid on β + γ > 0.
/// kUnreachable / kSingular with the joint and the amount.
[[nodiscard]] RunSummary SolveForward(const PlanarGeometry& geometry, PlanarState* state);

/// Partial derivatives of (14)–(25) in absolute slider coordinates, at the angles of `state`.
[[nodiscard]] AngleRates RatesOf(const PlanarGeometry& geometry, const PlanarState& state);

}  // namespace mbv::cabin_robot
