// How several joints at rest share their load, where statics does not tell.
//
// In the motions N that the loops leave (J N = 0), MuJoCo's rows of friction exert λ with
//   (J_f N)ᵀ λ = r                                                                             (1)
// Where the rows of J_f N depend on each other, MuJoCo shares r by the softness of its rows.
// Recorded are the forces of which the largest share |λ_e|/F_e of a breakaway force is least. Of
// one freedom these are λ_e = r F_e sign(G_e) / Σ F_e |G_e|, G = J_f N: at the start of a motion
// what all exert. With more freedoms MuJoCo's own are recorded. F follows the joints' loads and
// these the shares: both are found in turns.
#pragma once

#include "simulation/session.h"

namespace mbv::simulation {

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
