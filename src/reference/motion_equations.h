// Accelerations of a mechanism from one sparse factorisation, where the rows that hold it are
// known. Internal to reference/.
//
//   [M  −J₁ᵀ] [A]   [F − w(0)]
//   [J₁   0 ] [λ] = [ẍ − b   ] (1)
// with w(0) what Newton–Euler asks of each body that does not accelerate, and J₁ independent rows
// of loops and commands. M is a block per body, and blocks of two bodies of rotors. Massless bodies
// are no trouble as long as what J₁ leaves has inertia.
#pragma once

#include <vector>

#include "math/sparse.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/element_forces.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {

class MotionEquations {
 public:
  MotionEquations(const Mechanism& mechanism, double length);

  /// The independent rows from now on.
  void Choose(std::vector<int> rows);
  [[nodiscard]] bool chosen() const { return chosen_; }

  /// A with J₁ A = `rates` (per row of `rows`), stacked, under the wrenches F − w(0). False, and
  /// nothing chosen any more, where (1) is nearly singular.
  [[nodiscard]] bool Solve(const BodyStates& states, const RowSet& rows, const VecX& wrenches,
                           const VecX& rates, VecX* A);

 private:
  void ForInertias(const BodyStates& states, const AddInertia& add) const;
  void FillInertias(const BodyStates& states);

  const Mechanism& mechanism_;
  double mass_ = 1.0;    ///< the largest, in whose units inertias are
  SquareSystem system_;  ///< for its scales
  std::vector<int> rows_;
  bool chosen_ = false, made_ = false;
  std::vector<int> places_;  ///< per block of ForInertias(): of its first entry in M_
  SparseSaddle::Matrix M_, columns_;
  SparseSaddle saddle_;
};

}  // namespace mbv::internal
