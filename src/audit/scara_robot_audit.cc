#include "audit/scara_robot_audit.h"
#include "analytic/scara_robot/stiffness_form.h"
#include "audit/scara_audit.h"
#include "audit/stiffness_truth.h"
#include "core/demand.h"
#include "model_file/load_model.h"

namespace mbv {

AuditTable AuditScaraRobot(const std::string& models_dir) {
  const LoadResult model = LoadModel(models_dir + "/scara_robot/model.yaml");
  MBV_DEMAND(model.mechanism.has_value(), model.diagnostics.Text());
  const scara::Parameters parameters = scara::ParametersOf(*model.mechanism);
  const std::vector<scara_audit::State> states = scara_audit::Sweep(*model.mechanism);
  const Mechanism elastic = stiffness_audit::LoadElastic(models_dir, "scara_robot");
  AuditTable table;
  table.mechanism = "scara_robot";
  table.source =
      "Zhu Wei, Guo Qian, Ma Zhiyuan, Shen Huiping, Wu Guanglei, Stiffness and dynamics analysis "
      "of SCARA parallel mechanism, Trans. Chinese Society for Agricultural Machinery 50(10), "
      "2019 (position, kinematics, dynamics and stiffness)";
  for (auto rows :
       {scara_audit::PositionRows(*model.mechanism, parameters, states),
        scara_audit::VelocityRows(parameters, states), scara_audit::LinkRows(parameters, states),
        scara_audit::DynamicsRows(parameters, states),
        scara_audit::StiffnessRows(models_dir, scara::StiffnessParametersOf(elastic))}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv
