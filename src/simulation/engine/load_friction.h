// Friction that grows with the joint's own reaction, or with a coupling's force, on MuJoCo's
// forces.
//
//   F_e = −|v_e| sign q̇_e + (ε/μ)_e v_e,  v_e = p_e + Σ_d P_ed F_d,  (1) of FrictionLaw        (1)
// p: loads of the bearings without such friction, as the recorder reads them (BearingLoad, |p| the
// sum of its columns' lengths, p itself of a coupling, whose ε alone is not 0); P: what a unit
// force F_d adds, with Jᵀλ = −u_d. Where the motion is commanded, friction changes forces only: it
// is found where forces are recorded and is not applied. Newton on v. Where DOFs move by forces,
// MuJoCo is loaded by (1) by the loads that it finds itself, until they no longer change
// (Integrator::Settle); what rests breaks away beyond Fs
// + S.
#pragma once

#include "simulation/engine/session.h"

namespace mbv::simulation {

/// Indices of the elements with friction by load.
[[nodiscard]] std::vector<size_t> LoadedElements(const Mechanism& mechanism);

/// Per force element, by the data's accelerations and constraint forces.
[[nodiscard]] ConstraintSystem::FrictionByLoad LoadFrictionOf(Session* session);

/// In commanded motion adds (1) to the session's constraint forces for as long as it lives. What
/// goes wrong is in Session::trouble, in all motions also that a load is not unique.
class LoadFriction {
 public:
  explicit LoadFriction(Session* session);
  ~LoadFriction();
  LoadFriction(const LoadFriction&) = delete;
  LoadFriction& operator=(const LoadFriction&) = delete;

 private:
  void FindLoads();
  void CheckUnique();
  [[nodiscard]] bool SolveLoads();
  [[nodiscard]] double Force(Eigen::Index d) const;
  void Apply();

  Session& s_;
  VecX found_;                               // constraint forces without
  std::vector<BearingLoad> p_;               // per loaded element [N or N m]
  std::vector<std::vector<BearingLoad>> P_;  // [e][d]
  MatX unit_;                                // constraint forces per unit of each
  VecX sign_, skew_;                         // of q̇; ε/μ
  VecX v_;                                   // signed of couplings, else its size [N or N m]
};

// How several joints at rest share their load, where statics does not determine it.
//
// In the motions N that the loops leave (J N = 0), MuJoCo's rows of friction exert λ with
//   (J_f N)ᵀ λ = r                                                                             (1)
// Where the rows of J_f N depend on each other, MuJoCo shares r by the softness of its rows.
// Recorded are the forces of which the largest share |λ_e|/F_e of a breakaway force is least. Of
// one DOF these are λ_e = r F_e sign(G_e) / Σ F_e |G_e|, G = J_f N: at the start of a motion
// what all exert. With more DOFs MuJoCo's own are recorded. F follows the joints' loads and
// these the shares: both are found in turns.

/// Puts these forces into the data for as long as it lives.
class HeldShares {
 public:
  explicit HeldShares(Session* session);
  ~HeldShares();
  HeldShares(const HeldShares&) = delete;
  HeldShares& operator=(const HeldShares&) = delete;

 private:
  [[nodiscard]] double Share(const VecX& direction, double load);

  Session& s_;
  VecX found_, held_;                               // constraint forces, of friction
  ConstraintSystem::FrictionByLoad load_friction_;  // by MuJoCo's shares
};

}  // namespace mbv::simulation
