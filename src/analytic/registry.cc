// One row per mechanism with closed-form equations.
#include <array>

#include "analytic/cabin_robot/cabin_robot.h"
#include "analytic/closed_form.h"
#include "analytic/stabilizing_platform/stabilizing_platform.h"
#include "analytic/scara_robot/closed_form.h"
#include "analytic/spr_tripod/closed_form.h"

namespace mbv {

std::span<const ClosedFormRow> ClosedForms() {
  static const std::vector<ClosedFormRow> rows = {
      {"stabilizing_platform",
       {"full", "massless", "paper_text"},
       {"E2"},
       &stabilizing_platform::MakeClosedForm},
      {"spr_tripod", {"full"}, {}, &MakeSprTripod},
      {"cabin_robot", {"full"}, {}, &MakeCabinRobot},
      {"scara_robot", {"full", "thin_rods"}, {}, &scara::MakeClosedForm},
  };
  return rows;
}

const ClosedFormRow* FindClosedForm(const std::string& mechanism) {
  for (const ClosedFormRow& row : ClosedForms()) {
    if (row.mechanism == mechanism) return &row;
  }
  return nullptr;
}

}  // namespace mbv
