#include "analytic/cabin_robot/stiffness_form.h"
#include "audit/cabin_audit.h"
#include "audit/stiffness_truth.h"
#include "core/demand.h"
#include "model_file/load_model.h"

namespace mbv {
namespace cabin_audit {

Lengths LengthsOf(const Mechanism& m) {
  const auto value = [&](const char* name) { return m.ParameterValue(name); };
  return {value("L1"), value("L2"), value("L3"), value("L4"), value("a2"),
          value("d3"), value("a3"), value("a4"), value("d6")};
}

}  // namespace cabin_audit

AuditTable AuditCabinRobot(const std::string& models_dir) {
  const LoadResult model = LoadModel(models_dir + "/cabin_robot/model.yaml");
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  const cabin_audit::Lengths lengths = cabin_audit::LengthsOf(*model.mechanism);
  const Mechanism elastic = stiffness_audit::LoadElastic(models_dir, "cabin_robot");
  AuditTable table;
  table.mechanism = "cabin_robot";
  table.source =
      "Liu Yi, Yao Jiantao, Guo Yutong, Yi Wangmin, Zhao Yongsheng, Design and analysis of hybrid "
      "cabin assembly attitude adjustment robot system, J. of National University of Defense "
      "Technology 47(2), 2025 (kinematics, dynamics and stiffness; directions of the figures are "
      "inferred "
      "from "
      "the equations)";
  for (auto rows :
       {cabin_audit::PositionRows(lengths, lengths), cabin_audit::WristRows(lengths, lengths),
        cabin_audit::VelocityRows(lengths, lengths),
        cabin_audit::DynamicsRows(*model.mechanism, *model.mechanism),
        cabin_audit::StiffnessRows(models_dir, cabin::StiffnessParametersOf(elastic))}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv
