#include "audit/spr_tripod_audit.h"

namespace mbv {

AuditTable AuditSprTripod(const std::string& models_dir) {
  const spr_tripod_audit::Case c = spr_tripod_audit::MakeCase(models_dir);
  AuditTable table;
  table.mechanism = "spr_tripod";
  table.source =
      "Mei Jiangping, Gao Ben, Tan Yang, Wang Lan: Kinematic Analysis of 3-SPR Parallel Mechanism. "
      "Transactions of the Chinese Society for Agricultural Machinery 43 (8), 2012, 215–220";
  for (auto* rows : {&spr_tripod_audit::PositionRows, &spr_tripod_audit::VelocityRows,
                     &spr_tripod_audit::PathRows, &spr_tripod_audit::DynamicsRows}) {
    for (AuditRow& row : (*rows)(c)) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv
