// What the mechanisms' papers give, one row each: motion, stiffness, workspace.
#include <vector>

#include "analytic/cabin_robot/closed_form.h"
#include "analytic/cabin_robot/stiffness.h"
#include "analytic/closed_form.h"
#include "analytic/register_closed_form.h"
#include "analytic/scara_robot/closed_form.h"
#include "analytic/scara_robot/stiffness.h"
#include "analytic/scara_robot/workspace.h"
#include "analytic/spr_tripod/closed_form.h"
#include "analytic/spr_tripod/workspace.h"
#include "analytic/stabilizing_platform/closed_form.h"
#include "base/demand.h"

namespace mbv {

namespace {

std::vector<ClosedFormRow>& ClosedFormRows() {
  static std::vector<ClosedFormRow> rows = {
      {"stabilizing_platform",
       {"full", "massless", "paper_text"},
       {"E2"},
       &stabilizing_platform::MakeClosedForm,
       &stabilizing_platform::CoverageOf,
       true},
      {"spr_tripod", {"full"}, {}, &spr_tripod::MakeClosedForm, &spr_tripod::CoverageOf, true},
      {"cabin_robot", {"full"}, {}, &cabin_robot::MakeClosedForm, &cabin_robot::CoverageOf, true},
      {"scara_robot",
       {"full", "thin_rods"},
       {},
       &scara_robot::MakeClosedForm,
       &scara_robot::CoverageOf},
  };
  return rows;
}

std::vector<StiffnessFormRow>& StiffnessFormRows() {
  static std::vector<StiffnessFormRow> rows = {
      {"scara_robot", "platform", scara_robot::StiffnessModels(), &scara_robot::MakeStiffnessForm,
       &scara_robot::StiffnessCoverageOf, scara_robot::ExampleStiffnessPose(),
       scara_robot::UsualStiffnessMaps()},
      {"cabin_robot", "tool", cabin_robot::StiffnessModels(), &cabin_robot::MakeStiffnessForm,
       &cabin_robot::StiffnessCoverageOf, cabin_robot::ExampleStiffnessPose(),
       cabin_robot::UsualStiffnessMaps()},
  };
  return rows;
}

std::vector<WorkspaceFormRow>& WorkspaceFormRows() {
  static std::vector<WorkspaceFormRow> rows = {
      {"scara_robot", &scara_robot::ComputeWorkspaceForm},
      {"spr_tripod", &spr_tripod::ComputeWorkspaceForm},
  };
  return rows;
}

// One row per mechanism: a later one takes the place of an earlier one.
template <typename Row>
void Replace(std::vector<Row>* rows, Row row) {
  std::erase_if(*rows, [&](const Row& old) { return old.mechanism == row.mechanism; });
  rows->push_back(std::move(row));
}

template <typename Row>
const Row* FindRow(const std::vector<Row>& rows, const std::string& mechanism) {
  for (const Row& row : rows) {
    if (row.mechanism == mechanism) return &row;
  }
  return nullptr;
}

}  // namespace

ClosedFormRegistration::ClosedFormRegistration(ClosedFormRow row) {
  MBV_DEMAND(!row.mechanism.empty() && !row.models.empty() && row.factory != nullptr,
             row.mechanism);
  Replace(&ClosedFormRows(), std::move(row));
}
StiffnessFormRegistration::StiffnessFormRegistration(StiffnessFormRow row) {
  MBV_DEMAND(!row.mechanism.empty() && !row.output.empty() && !row.models.empty() &&
                 row.factory != nullptr,
             row.mechanism);
  Replace(&StiffnessFormRows(), std::move(row));
}
WorkspaceFormRegistration::WorkspaceFormRegistration(WorkspaceFormRow row) {
  MBV_DEMAND(!row.mechanism.empty() && row.compute != nullptr, row.mechanism);
  Replace(&WorkspaceFormRows(), std::move(row));
}

std::span<const ClosedFormRow> ClosedForms() { return ClosedFormRows(); }
std::span<const StiffnessFormRow> StiffnessForms() { return StiffnessFormRows(); }
std::span<const WorkspaceFormRow> WorkspaceForms() { return WorkspaceFormRows(); }

const ClosedFormRow* FindClosedForm(const std::string& mechanism) {
  return FindRow(ClosedFormRows(), mechanism);
}
const StiffnessFormRow* FindStiffnessForm(const std::string& mechanism) {
  return FindRow(StiffnessFormRows(), mechanism);
}
const WorkspaceFormRow* FindWorkspaceForm(const std::string& mechanism) {
  return FindRow(WorkspaceFormRows(), mechanism);
}

std::vector<Finding> FindUncovered(const Mechanism& mechanism) {
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr || row->coverage == nullptr) return {};
  return FindUncovered(row->coverage(mechanism), mechanism, Concern::kDynamics);
}

}  // namespace mbv
