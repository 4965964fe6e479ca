#include "kinematics/element_rows.h"

#include <algorithm>

#include "kinematics/coupling_rows.h"

namespace mbv {
namespace {

ScalarRow RowOf(const Mechanism& mechanism, const ForceElement& element, const BodyStates& states,
                const double* near) {
  if (element.drive >= 0) {
    return DriveRow(mechanism, mechanism.drives[static_cast<size_t>(element.drive)], states);
  }
  if (element.bushing >= 0) {
    return BushingRow(mechanism.bushings[static_cast<size_t>(element.bushing)], element.coordinate,
                      states);
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  const auto k = static_cast<size_t>(element.coordinate);
  return JointCoordinateRow(joint, element.coordinate, states,
                            near == nullptr ? joint.home[k] : *near);
}

// Drives, then prescribed joints.
std::vector<Coordinate> Driven(const Mechanism& mechanism) {
  std::vector<Coordinate> driven;
  for (size_t k = 0; k < mechanism.drives.size(); ++k) {
    driven.push_back({Coordinate::Kind::kDrive, static_cast<int>(k), 0});
  }
  for (size_t k = 0; k < mechanism.prescribed.size(); ++k) {
    driven.push_back({Coordinate::Kind::kPrescribed, static_cast<int>(k), 0});
  }
  return driven;
}

// Where nothing was followed yet, the poses lie within half a turn of home.
std::vector<double>* TurnsOf(const Mechanism& mechanism, BodyStates* states) {
  if (!states->turns.empty()) return &states->turns;
  for (const ForceElement& element : mechanism.elements) {
    const Coordinate on{Coordinate::Kind::kJoint, element.joint, element.coordinate};
    states->turns.push_back(element.joint < 0 ? 0.0 : HomeValue(mechanism, on));
  }
  for (const Coordinate& driven : Driven(mechanism)) {
    states->turns.push_back(HomeValue(mechanism, driven));
  }
  return &states->turns;
}

ScalarRow DrivenRow(const Mechanism& mechanism, const Coordinate& driven, const BodyStates& states,
                    double near) {
  const auto k = static_cast<size_t>(driven.index);
  if (driven.kind == Coordinate::Kind::kDrive) {
    return DriveRow(mechanism, mechanism.drives[k], states, near);
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(mechanism.prescribed[k].joint)];
  return JointCoordinateRow(joint, 0, states, near);
}

void Put(const std::vector<ScalarRow>& rows, size_t first, std::vector<double>* turns) {
  for (size_t k = 0; k < rows.size(); ++k) (*turns)[first + k] = rows[k].value;
}

// c + ċ Δt + c̈ Δt²/2
double Later(const ScalarRow& row, const BodyStates& states, double dt_s) {
  return row.value +
         dt_s * (RateOf(row, states.V_WB) + 0.5 * dt_s * (RateOf(row, states.A_WB) + row.bias));
}

}  // namespace

std::vector<ScalarRow> ElementRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<ScalarRow> rows;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    rows.push_back(RowOf(mechanism, mechanism.elements[e], states,
                         states.turns.empty() ? nullptr : &states.turns[e]));
  }
  return rows;
}

std::vector<ScalarRow> DrivenRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<ScalarRow> rows;
  for (const Coordinate& driven : Driven(mechanism)) {
    const size_t k = mechanism.elements.size() + rows.size();
    const double near = states.turns.empty() ? HomeValue(mechanism, driven) : states.turns[k];
    rows.push_back(DrivenRow(mechanism, driven, states, near));
  }
  return rows;
}

void FollowElements(const Mechanism& mechanism, BodyStates* states) {
  if (mechanism.elements.empty()) return;
  Put(ElementRows(mechanism, *states), 0, TurnsOf(mechanism, states));
}

void FollowDriven(const Mechanism& mechanism, BodyStates* states) {
  Put(DrivenRows(mechanism, *states), mechanism.elements.size(), TurnsOf(mechanism, states));
}

void PredictTurns(const Mechanism& mechanism, double dt_s, BodyStates* states) {
  std::vector<double> turns, coupled;
  for (auto* rows_of : {&ElementRows, &DrivenRows}) {
    for (const ScalarRow& row : rows_of(mechanism, *states)) {
      turns.push_back(Later(row, *states, dt_s));
    }
  }
  for (const ScalarRow& row : CoupledCoordinates(mechanism, *states)) {
    coupled.push_back(Later(row, *states, dt_s));
  }
  states->turns = std::move(turns);
  states->coupled = std::move(coupled);
}

}  // namespace mbv
