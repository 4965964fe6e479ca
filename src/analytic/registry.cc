// One row per mechanism with closed-form equations.
#include <vector>

#include "analytic/cabin_robot/cabin_robot.h"
#include "analytic/cabin_robot/coverage.h"
#include "analytic/closed_form.h"
#include "analytic/register_closed_form.h"
#include "analytic/scara_robot/closed_form.h"
#include "analytic/scara_robot/coverage.h"
#include "analytic/spr_tripod/closed_form.h"
#include "analytic/spr_tripod/coverage.h"
#include "analytic/stabilizing_platform/coverage.h"
#include "analytic/stabilizing_platform/stabilizing_platform.h"
#include "core/demand.h"

namespace mbv {

namespace {

std::vector<ClosedFormRow>& Rows() {
  static std::vector<ClosedFormRow> rows = {
      {"stabilizing_platform",
       {"full", "massless", "paper_text"},
       {"E2"},
       &stabilizing_platform::MakeClosedForm,
       &stabilizing_platform::CoverageOf},
      {"spr_tripod", {"full"}, {}, &MakeSprTripod, &spr_tripod::CoverageOf},
      {"cabin_robot", {"full"}, {}, &MakeCabinRobot, &cabin::CoverageOf},
      {"scara_robot", {"full", "thin_rods"}, {}, &scara::MakeClosedForm, &scara::CoverageOf},
  };
  return rows;
}

}  // namespace

ClosedFormRegistration::ClosedFormRegistration(ClosedFormRow row) {
  MBV_DEMAND(!row.mechanism.empty() && !row.models.empty() && row.factory != nullptr,
             row.mechanism);
  std::erase_if(Rows(), [&](const ClosedFormRow& old) { return old.mechanism == row.mechanism; });
  Rows().push_back(std::move(row));
}

std::span<const ClosedFormRow> ClosedForms() { return Rows(); }

const ClosedFormRow* FindClosedForm(const std::string& mechanism) {
  for (const ClosedFormRow& row : ClosedForms()) {
    if (row.mechanism == mechanism) return &row;
  }
  return nullptr;
}

std::vector<Finding> FindUncovered(const Mechanism& mechanism) {
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr || row->coverage == nullptr) return {};
  return FindUncovered(row->coverage(mechanism), mechanism, Concern::kDynamics);
}

}  // namespace mbv
