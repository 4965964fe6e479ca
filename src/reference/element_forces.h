// Forces, energies and powers of force elements along their coordinates q. Internal to reference/.
//
//   damping  F = −c q̇                                        P = −c q̇² to the dampers         (1)
//   spring   F = −(F0 + Σ_i k_i x^i),  x = q − free           E = F0 x + Σ_i k_i x^(i+1)/(i+1)  (2)
//   rotor    F = −J n² q̈                                      E = ½ J n² q̇²                     (3)
//   friction F = −(Fc + (Fs − Fc) exp(−(q̇/vs)²)) sign q̇       P = F q̇ to the dampers           (4)
//   stop     (1), (2) of StopLaw                              E = k δⁿ⁺¹/(n+1)
//   curve    F(q) or F(q̇) by Hermite's polynomials            E = −∫ F dq of F(q)
//            F(q, q̇) straight between such F(q)               P = F q̇ to the dampers
// A rotor about the axis a of a body that turns with ω and ε has the additional momentum h = J n q̇
// a:
//   M = −dh/dt = −J n (q̈ a + q̇ ω × a) on that body            E += J n q̇ a·ω                    (5)
//   F = −J n² q̈ − J n a·ε                                                                       (6)
//
// At rest friction is taken as the middle of what statics allows: 0 of |F| ≤ Fs, half of Fs of a
// freewheel.
#pragma once

#include <functional>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "kinematics/constraints.h"
#include "mechanism/mechanism.h"
#include "reference/reference.h"

namespace mbv::internal {

/// Per force element: the sign of its rate where it has dry friction; 0 at rest (RestRate()) and
/// for all that has none. Empty for a mechanism without dry friction.
void FrictionDirections(const Mechanism& mechanism, const BodyStates& states, double duration_s,
                        std::vector<int>* signs);

/// Takes the elements' forces away from the wrenches that bodies need (RequiredWrenches()); that
/// of rotors at states.A_WB, that of friction in the directions of FrictionDirections().
void TakeElementForces(const Mechanism& mechanism, const BodyStates& states,
                       const std::vector<int>& friction_signs, std::vector<Vec6>* wrench_W);

/// Per element that rests: breakaway force (with `load_friction`) times its coordinate's gradient:
/// the wrenches that statics may add or take.
[[nodiscard]] std::vector<VecX> RestingWrenches(const Mechanism& mechanism,
                                                const BodyStates& states,
                                                const std::vector<int>& friction_signs,
                                                const VecX& load_friction);
/// Power that friction by the joints' loads takes [W].
[[nodiscard]] double LoadFrictionLoss(const Mechanism& mechanism, const ReferenceSample& sample);
/// Gradient of a coordinate over the motions of all bodies but the world (6·bodies).
[[nodiscard]] VecX GradientOf(const ScalarRow& row, size_t bodies);

void AddElementEnergies(const Mechanism& mechanism, const BodyStates& states, Energies* energy);
/// Of the rotors: the rate of their kinetic energy.
void AddElementPowers(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<int>& friction_signs, Powers* power);

/// Inertia of the rotors: Σ J n² u uᵀ, u: gradient of the coordinate; with a carrier also
/// J n (u aᵀ + a uᵀ). In blocks of moving bodies, in an order that the mechanism gives.
using AddInertia = std::function<void(size_t row_body, size_t column_body, const Mat6& block)>;
void ForRotorInertias(const Mechanism& mechanism, const BodyStates& states, const AddInertia& add);

/// An element's slope of force over position and over rate, along `u` the gradient of its
/// coordinate: what vibrates or creeps. `unit`: 1 rad, or the characteristic length.
struct ElementSlope {
  double stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] ElementSlope SlopeOf(const ForceElement& element, double q, double unit);

// Friction that grows with the joint's own reaction, or with a coupling's force. Internal to
// reference/.
//
//   F_e = −c_e |v_e| sign q̇_e + ε_e Q_e,  S = c |v| by (1) of FrictionLaw, c = per_load()       (1)
// [Shigley, Mechanical Engineering Design, "Boundary-lubricated bearings"], with ε Q of couplings
// alone, |v|: the sum of the lengths of the load's three parts.
//
// The reactions depend on the friction, linearly: with p_e the load without friction by load, and
// P_ed the part of it per unit of force F_d,
//   v_e = p_e + Σ_d P_ed F_d                                                                    (2)
// which has one solution, and a fixed-point iteration that finds it, if
//   q = max_e Σ_d |P_ed| (c_d + |ε_d|) < 1                                                      (3)

/// Indices of the elements with friction by load.
[[nodiscard]] std::vector<size_t> LoadedElements(const Mechanism& mechanism);

/// What bears, in F's axes: the load of one bearing, that of the other, and the thrust, each times
/// its radius by the larger of both; or a coupling's force [N or N m].
using BearingLoad = Eigen::Matrix<double, 9, 1>;
/// Of an element, from FillReactions(). Linear in `reactions`.
[[nodiscard]] BearingLoad LoadOf(const Mechanism& mechanism, size_t element,
                                 const BodyStates& states, const MatX& reactions);
/// The sum of the lengths of the three parts, and its gradient; of parts that are zero 0.
[[nodiscard]] double SizeOf(const BearingLoad& load);
[[nodiscard]] BearingLoad SlopeOf(const BearingLoad& load);
/// FrictionLaw::per_load() of what is engaged.
[[nodiscard]] double PerLoad(const Mechanism& mechanism, size_t element, const BodyStates& states);

/// kUnsupported: redundant constraints share the load of an element's joint.
[[nodiscard]] RunSummary LoadShared(const Mechanism& mechanism, size_t element);

/// (2): all p and P of the loaded elements; `sign`: of their rates, 0 at rest.
struct LoadSystem {
  std::vector<BearingLoad> p;               ///< per loaded element [N or N m]
  std::vector<std::vector<BearingLoad>> P;  ///< [e][d]
  std::vector<double> sign, per_load, skew;

  /// Without P, which follows when all are known.
  void Add(const Mechanism& mechanism, size_t element, const BodyStates& states, int friction_sign,
           const BearingLoad& without);
  [[nodiscard]] double contraction() const;  ///< (3)
  /// The loaded element whose load the others raise most.
  [[nodiscard]] size_t MostRaised() const;
  /// v_e [N or N m]; kSingular where (3) does not hold, with q.
  [[nodiscard]] RunSummary Solve(std::vector<BearingLoad>* v) const;
  /// S_e and F_e of a load v_e [N or N m].
  [[nodiscard]] double Size(size_t e, const BearingLoad& v) const {
    return per_load[e] * SizeOf(v);
  }
  [[nodiscard]] double Force(size_t e, const BearingLoad& v) const {
    return skew[e] * v[6] - sign[e] * Size(e, v);
  }

 private:
  [[nodiscard]] double Raised(size_t e) const;
};

}  // namespace mbv::internal
