// Friction that grows with the joint's own reaction, on MuJoCo's forces.
//
//   F_e = −c_e n_e sign q̇_e,  n_e = |p_e + Σ_d P_ed F_d|,  c = μ r                             (1)
// p: reaction force across the axis without such friction, as the recorder reads it; P: what a unit
// force F_d adds, with Jᵀλ = −u_d. Where the motion is commanded, friction changes forces only:
// it is found where forces are recorded and is not applied. Newton on n. Where DOFs move by
// forces, MuJoCo is loaded by (1) by the loads that it finds itself, until they no longer change
// (Integrator::Settle); what rests breaks away beyond Fs + c n.
#pragma once

#include "simulation/engine/session.h"

namespace mbv::simulation {

/// Indices of the elements with friction by load.
[[nodiscard]] std::vector<size_t> LoadedElements(const Mechanism& mechanism);

/// c_e n_e per force element, by the data's accelerations and constraint forces.
[[nodiscard]] VecX LoadFrictionOf(Session* session);

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
  void Apply();

  Session& s_;
  VecX found_;                        // constraint forces without
  std::vector<Vec3> p_;               // per loaded element [N]
  std::vector<std::vector<Vec3>> P_;  // [e][d]
  MatX unit_;                         // constraint forces per unit of each
  VecX signed_c_, n_;                 // sign q̇ c; loads [N]
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
  [[nodiscard]] double Share(const VecX& freedom, double load);

  Session& s_;
  VecX found_, held_;   // constraint forces, of friction
  VecX load_friction_;  // by MuJoCo's shares
};

}  // namespace mbv::simulation
