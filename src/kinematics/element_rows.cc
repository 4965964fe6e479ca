#include "kinematics/element_rows.h"

namespace mbv {
namespace {

ScalarRow RowOf(const Mechanism& mechanism, const ForceElement& element, const BodyStates& states,
                const double* near) {
  if (element.drive >= 0) {
    return DriveRow(mechanism, mechanism.drives[static_cast<size_t>(element.drive)], states);
  }
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  const auto k = static_cast<size_t>(element.coordinate);
  return JointCoordinateRow(joint, element.coordinate, states,
                            near == nullptr ? joint.home[k] : *near);
}

}  // namespace

std::vector<ScalarRow> ElementRows(const Mechanism& mechanism, const BodyStates& states) {
  std::vector<ScalarRow> rows;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    rows.push_back(RowOf(mechanism, mechanism.elements[e], states,
                         states.sprung.empty() ? nullptr : &states.sprung[e]));
  }
  return rows;
}

void FollowElements(const Mechanism& mechanism, BodyStates* states) {
  if (mechanism.elements.empty()) return;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, *states);
  states->sprung.clear();
  for (const ScalarRow& row : rows) states->sprung.push_back(row.value);
}

}  // namespace mbv
