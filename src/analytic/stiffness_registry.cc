// One row per mechanism with a closed-form stiffness.
#include "analytic/cabin_robot/coverage.h"
#include "analytic/cabin_robot/stiffness_form.h"
#include "analytic/scara_robot/coverage.h"
#include "analytic/scara_robot/stiffness_form.h"
#include "analytic/stiffness_form.h"

namespace mbv {

std::span<const StiffnessFormRow> StiffnessForms() {
  static const std::vector<StiffnessFormRow> rows = {
      {"scara_robot", "platform", scara::StiffnessModels(), &scara::MakeStiffnessForm,
       &scara::StiffnessCoverageOf},
      {"cabin_robot", "tool", cabin::StiffnessModels(), &cabin::MakeStiffnessForm,
       &cabin::StiffnessCoverageOf},
  };
  return rows;
}

const StiffnessFormRow* FindStiffnessForm(const std::string& mechanism) {
  for (const StiffnessFormRow& row : StiffnessForms()) {
    if (row.mechanism == mechanism) return &row;
  }
  return nullptr;
}

}  // namespace mbv
