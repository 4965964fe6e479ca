// A table that Newton's method starts from, with a proof of where a fixed number of steps does.
//
// For every cell of a box of q, with y what a block searches, c and G = ∂y/∂q at the cell's centre,
// and all functions by interval arithmetic (Boost.Interval):
//   y = c + G (q − q_c) + e,  K(E) = −A r(c + G (q − q_c)) + (1 − A J(Y)) E ⊂ E
//                                               one solution y*(q), e in E, for each q         (1)
//   e_0 <= |y_0(q_c) − c| + |E| + Σ_i |∂_i y_0 − G_i| h_i / 2                                  (2)
//   e_k+1 <= ½ β Λ (e_k + D ε)² + D ε                                                          (3)
// [Krawczyk 1969; Moore, Kearfott, Cloud 2009, ch. 8; Ortega 1968]. A: about J⁻¹; y_0: the table
// between its nodes, multilinear; β: bound of |J⁻¹|, Λ: of the second derivatives, on Y widened by
// e_0; ε: the error that the blocks before are left with, which end their steps first; D: bound of
// |J⁻¹ ∂r/∂y_before|. Cells are connected with the one at home by common solutions on their faces,
// so that the branch is that of home.
#pragma once

#include <functional>

#include "features/code/code_text.h"

namespace mbv {

/// Over the box; cells that are not proved are outside. At most three coordinates. An empty table
/// (no cells) with `why` where a proof is beyond it: balls that are searched, large blocks.
[[nodiscard]] StartTable MakeStartTable(const MechanismFormulas& formulas, const VecX& low,
                                        const VecX& high, std::string* why,
                                        const std::function<void(double)>& progress);

/// Over the cells that `start` proves.
[[nodiscard]] LookupTable MakeLookupTable(const MechanismFormulas& formulas,
                                          const StartTable& start);

}  // namespace mbv
