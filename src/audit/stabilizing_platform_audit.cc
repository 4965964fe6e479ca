#include "audit/stabilizing_platform_audit.h"

#include "audit/platform_audit.h"

namespace mbv {

AuditTable AuditStabilizingPlatform(const std::string& models_dir) {
  using namespace platform_audit;
  const Case full = MakeCase(models_dir, 1.0), massless = MakeCase(models_dir, 0.0);
  AuditTable table;
  table.mechanism = "stabilizing_platform";
  table.source =
      "Li Erwei, Zhao Tieshi, Wang Chang, Bian Hui, Hu Qiangqiang, Ji Wenjie, Dynamics of "
      "large-scale heavy-burden parallel stabilizing cargo-receiving platform, Trans. Chinese "
      "Society for Agricultural Machinery 49(3), 2018. Compared with the generic reference solver "
      "at 61 instants of the example motion (12 s)";
  for (auto rows : {PoseRows(full), TwistRows(full), LimbRows(full), ForceRows(full, massless),
                    ClaimRows(full, massless)}) {
    for (AuditRow& row : rows) table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace mbv
