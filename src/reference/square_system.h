// One factorisation for both sides of the duality: Σ x_i J_iᵀ = wrenches and J_i · V = rates.
// Internal to reference/.
//
// Inside, lengths are measured in a characteristic length L, so that forces and moments, metres
// and radians weigh alike: the unknown force of an angular row is moment/L, and the rotational
// equations of a body are divided by L.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/types.h"
#include "math/sparse.h"
#include "reference/row_set.h"

namespace mbv::internal {

class SquareSystem {
 public:
  /// For `bodies` bodies, the world included.
  SquareSystem(size_t bodies, double length);

  [[nodiscard]] int size() const { return size_; }

  /// Chooses rows independent of each other `among` some, which increase, by QR with column
  /// pivoting, of many bodies by sparse QR where that is clear; increasing. Fewer than size() if
  /// their rank is less.
  [[nodiscard]] std::vector<int> IndependentRows(const RowSet& rows,
                                                 const std::vector<int>& among) const;

  /// Factors the matrix of the rows `selection` (size() of them, always the same ones unless
  /// `new_selection`). False if it is exactly singular.
  [[nodiscard]] bool Factor(const RowSet& rows, const std::vector<int>& selection,
                            bool new_selection);
  /// The scaled columns of the rows `selection`, with the pattern of any state; and filled
  /// again for another state of the same rows.
  void MakeColumns(const RowSet& rows, const std::vector<int>& selection,
                   SparseLu::Matrix* columns) const;
  void FillColumns(const RowSet& rows, const std::vector<int>& selection,
                   SparseLu::Matrix* columns) const;
  /// The same of the rows `among`, without entries that are zero.
  [[nodiscard]] SparseLu::Matrix ScaledColumns(const RowSet& rows,
                                               const std::vector<int>& among) const;
  /// Sign of the determinant of the last factorisation; comparable for the same selection.
  [[nodiscard]] int determinant_sign() const { return determinant_sign_; }

  /// x with Σ x_i J_iᵀ = b; b stacks the wrenches [m; f] of the moving bodies.
  void Solve(const VecX& wrenches, VecX* x) const;
  /// V with J_i · V = rates_i, stacked for the moving bodies.
  void SolveTransposed(const VecX& rates, VecX* V) const;

  /// Estimate of the smallest singular value (scaled, dimensionless; the largest is of order one)
  /// by inverse iteration started from the previous estimate.
  [[nodiscard]] double SmallestSingularValue(int iterations);
  /// The motion (twists stacked) that belongs to it: what the rows hardly hold.
  [[nodiscard]] VecX SoftMotion() const { return body_scale_.cwiseProduct(soft_motion_); }

  /// Scale of row i's unknown: 1 for lengths, L for angles.
  [[nodiscard]] double RowScale(bool angular) const { return angular ? length_ : 1.0; }
  /// Unit of row i's rate that is of the order one: 1/s for angles, L/s for lengths.
  [[nodiscard]] double RateUnit(bool angular) const { return angular ? 1.0 : length_; }
  [[nodiscard]] const VecX& body_scale() const { return body_scale_; }

 private:
  int size_;
  double length_;
  VecX body_scale_;  ///< 1/L for rotations, 1 for translations
  VecX row_scale_;   ///< per selected row
  SparseLu::Matrix matrix_;
  SparseLu lu_;
  int determinant_sign_ = 0;
  VecX soft_force_, soft_motion_;
};

/// Scaled singular values below this cannot be distinguished from zero. Near a singular pose loops
/// closed to 1e-13 leave the pose open to its square root, 3e-7, and the singular value with it;
/// ten times that. Loops that coordinates far from the origin close less well, to `rounding`
/// [characteristic lengths, GapRounding()], leave more open; a typical rounding is a tenth of the
/// bound.
[[nodiscard]] inline double SingularValueLimit(double rounding) {
  return std::max(3e-6, 10 * std::sqrt(0.1 * rounding));
}

/// Stacks the moving bodies' entries of `per_body` and back.
void Stack(const std::vector<Vec6>& per_body, VecX* stacked);
[[nodiscard]] VecX Stack(const std::vector<Vec6>& per_body);
void Unstack(const VecX& stacked, std::vector<Vec6>* per_body);
/// Largest rotation [rad] or translation [characteristic lengths] of stacked twists.
[[nodiscard]] double SizeOf(const VecX& twists, double length);

}  // namespace mbv::internal
