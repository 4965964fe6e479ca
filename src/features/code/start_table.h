// A table that Newton's method starts from, with a proof of where a fixed number of steps does.
//
// For every cell of a box of q, with y what a block searches and I interval arithmetic
// (Boost.Interval):
//   K(Y) = c − A r(c) + (1 − A J(Y)) (Y − c) ⊂ Y   one solution y*(q) in Y for each q        (1)
//   e_0 <= |y_0(q_c) − y*(q_c)| + Σ_i |∂_i y_0 − ∂_i y*| h_i / 2                             (2)
//   e_k+1 <= ½ β Λ (e_k + D ε)² + D ε                                                        (3)
// [Krawczyk 1969; Moore, Kearfott, Cloud 2009, ch. 8; Ortega 1968]. y_0: the table between its
// nodes, multilinear; β: bound of |J⁻¹|, Λ: of the second derivatives, on Y widened by e_0; ε: the
// error of the blocks before, D: bound of |J⁻¹ ∂r/∂y_before|. Cells are connected with the one at
// home by common solutions on their faces, so that the branch is that of home.
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
