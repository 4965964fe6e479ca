// Scalar rows over the bodies, kept flat. Internal to reference/.
#pragma once

#include <vector>

#include "base/types.h"
#include "kinematics/constraints.h"
#include "mechanism/motion.h"

namespace mbv::internal {

/// Rows r_i(states) with ṙ = J V and r̈ = J A + b. The order of the pieces depends on the mechanism
/// only, so a matrix pattern made from one filling fits all later ones.
struct RowSet {
  std::vector<int> start{0};  ///< pieces of row i: start[i] … start[i + 1] − 1
  std::vector<int> body;      ///< per piece; moving bodies only, increasing within a row
  std::vector<Vec6> J;        ///< per piece
  std::vector<double> value;  ///< per row: residual or coordinate
  std::vector<double> bias;   ///< per row
  std::vector<char> angular;  ///< per row: an angle, or a cosine; its J has no linear part

  [[nodiscard]] int size() const { return static_cast<int>(value.size()); }
  void Clear();
  /// Becomes these rows of another set.
  void Take(const RowSet& other, const std::vector<int>& rows);
  /// The first `count` rows of a joint.
  void Add(const ConstraintRows& rows, int count);
  void Add(const CouplingRow& row);
  void Add(const ScalarRow& row, bool is_angle);
  /// Σ factor · coordinate; angles near `near_values`, which are replaced by the values found.
  void Add(const Mechanism& mechanism, const Command& command, const BodyStates& states,
           std::vector<double>* near_values);

  /// J · motion for row i, in [m] or [rad] per unit; `motion` per body.
  [[nodiscard]] double Rate(int i, const Vec6* motion) const {
    double rate = 0.0;
    const int *first = start.data() + i, *of = body.data();
    for (int p = first[0]; p < first[1]; ++p) rate += J.data()[p].dot(motion[of[p]]);
    return rate;
  }
  /// The same for every row.
  [[nodiscard]] VecX Rates(const std::vector<Vec6>& motion) const;
  /// Adds Jᵀ · force to the wrenches of all bodies.
  void AddWrenches(const VecX& force, std::vector<Vec6>* wrench_W) const;

 private:
  void AddBetween(const ConstraintRows& rows, int count);
  void AddPiece(int body_index, const Vec6& J_piece);
  void CloseRow(double row_value, double row_bias, bool is_angle);
};

}  // namespace mbv::internal
