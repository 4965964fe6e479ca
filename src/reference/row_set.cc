#include "reference/row_set.h"

#include <algorithm>

namespace mbv::internal {

void RowSet::Clear() {
  start.resize(1);
  body.clear();
  J.clear();
  value.clear();
  bias.clear();
  angular.clear();
}

void RowSet::Take(const RowSet& other, const std::vector<int>& rows) {
  Clear();
  for (const int i : rows) {
    const auto row = static_cast<size_t>(i);
    const int first = other.start[row], last = other.start[row + 1];
    body.insert(body.end(), other.body.begin() + first, other.body.begin() + last);
    J.insert(J.end(), other.J.begin() + first, other.J.begin() + last);
    CloseRow(other.value[row], other.bias[row], other.angular[row] != 0);
  }
}

void RowSet::AddPiece(int body_index, const Vec6& J_piece) {
  if (body_index == 0) return;
  // Insert in order, or add to the piece of the same body.
  const auto first = static_cast<size_t>(start.back());
  size_t at = body.size();
  while (at > first && body[at - 1] > body_index) --at;
  if (at > first && body[at - 1] == body_index) {
    J[at - 1] += J_piece;
    return;
  }
  if (at == body.size()) {
    body.push_back(body_index);
    J.push_back(J_piece);
    return;
  }
  body.insert(body.begin() + static_cast<std::ptrdiff_t>(at), body_index);
  J.insert(J.begin() + static_cast<std::ptrdiff_t>(at), J_piece);
}

void RowSet::CloseRow(double row_value, double row_bias, bool is_angle) {
  start.push_back(static_cast<int>(body.size()));
  value.push_back(row_value);
  bias.push_back(row_bias);
  angular.push_back(is_angle ? 1 : 0);
}

void RowSet::Add(const ConstraintRows& rows, int count) {
  if (rows.parent != 0 && rows.child != 0 && rows.parent != rows.child) {
    AddBetween(rows, count);
    return;
  }
  for (int i = 0; i < count; ++i) {
    AddPiece(rows.parent, rows.J_parent.row(i));
    AddPiece(rows.child, rows.J_child.row(i));
    CloseRow(rows.residual[i], rows.bias[i], i >= rows.translation_rows);
  }
}

// Two pieces a row, in the same order.
void RowSet::AddBetween(const ConstraintRows& rows, int count) {
  const bool parent_first = rows.parent < rows.child;
  const auto &first = parent_first ? rows.J_parent : rows.J_child,
             &second = parent_first ? rows.J_child : rows.J_parent;
  const size_t pieces = body.size(), before = value.size(), more = static_cast<size_t>(count);
  body.resize(pieces + 2 * more);
  J.resize(pieces + 2 * more);
  start.resize(before + more + 1);
  value.resize(before + more);
  bias.resize(before + more);
  angular.resize(before + more);
  for (size_t i = 0; i < more; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const size_t at = pieces + 2 * i;
    body[at] = std::min(rows.parent, rows.child);
    body[at + 1] = std::max(rows.parent, rows.child);
    J[at] = first.row(row);
    J[at + 1] = second.row(row);
    start[before + i + 1] = static_cast<int>(at + 2);
    value[before + i] = rows.residual[row];
    bias[before + i] = rows.bias[row];
    angular[before + i] = row >= rows.translation_rows ? 1 : 0;
  }
}

void RowSet::Add(const CouplingRow& row) {
  double bias_sum = 0.0;
  for (const ScalarRow& piece : row.pieces) {
    AddPiece(piece.parent, piece.J_parent);
    AddPiece(piece.child, piece.J_child);
    bias_sum += piece.bias;
  }
  CloseRow(row.value, bias_sum, row.angular);
}

void RowSet::Add(const ScalarRow& row, bool is_angle) {
  AddPiece(row.parent, row.J_parent);
  AddPiece(row.child, row.J_child);
  CloseRow(row.value, row.bias, is_angle);
}

void RowSet::Add(const Mechanism& mechanism, const Command& command, const BodyStates& states,
                 std::vector<double>* near_values) {
  double sum = 0.0, sum_bias = 0.0;
  bool is_angle = true;
  for (size_t k = 0; k < command.terms.size(); ++k) {
    const auto& [coordinate, factor] = command.terms[k];
    const ScalarRow row = CoordinateRow(mechanism, coordinate, states, (*near_values)[k]);
    (*near_values)[k] = row.value;
    AddPiece(row.parent, factor * row.J_parent);
    AddPiece(row.child, factor * row.J_child);
    sum += factor * row.value;
    sum_bias += factor * row.bias;
    is_angle = is_angle && !IsLength(mechanism, coordinate);
  }
  CloseRow(sum, sum_bias, is_angle);
}

VecX RowSet::Rates(const std::vector<Vec6>& motion) const {
  VecX rates(size());
  for (int i = 0; i < size(); ++i) rates[i] = Rate(i, motion.data());
  return rates;
}

void RowSet::AddWrenches(const VecX& force, std::vector<Vec6>* wrench_W) const {
  for (int i = 0; i < size(); ++i) {
    for (int p = start[i]; p < start[i + 1]; ++p) (*wrench_W)[body[p]] += force[i] * J[p];
  }
}

}  // namespace mbv::internal
