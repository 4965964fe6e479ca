// What always holds, by rates of the spanning tree. Internal to kinematics/.
#pragma once

#include <vector>

#include "kinematics/constraints.h"

namespace mbv::internal {

/// The rate of a row per unit of each motion: `J` has the twists of all bodies (6·bodies × motions,
/// TreeMotion::Jacobian).
[[nodiscard]] Eigen::RowVectorXd RowAlong(const ScalarRow& row, const MatX& J);

/// Closures, couplings, then idle spins, as speeds: rows × motions. Rotations count by `length`.
[[nodiscard]] MatX LoopRows(const Mechanism& mechanism, const std::vector<Spin>& spins,
                            const BodyStates& states, const MatX& J, double length);

}  // namespace mbv::internal
