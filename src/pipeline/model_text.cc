#include "pipeline/model_text.h"

#include "mjcf/mjcf.h"
#include "model_file/urdf.h"
#include "model_file/write_model.h"
#include "report/mobility_text.h"

namespace mbv {

std::string ModelText(const Mechanism& mechanism, ModelFormat format) {
  switch (format) {
    case ModelFormat::kMobility:
      return MobilityText(mechanism, ReportMobility(mechanism));
    case ModelFormat::kJson:
      return MobilityJson(mechanism, ReportMobility(mechanism));
    case ModelFormat::kMjcf:
      return WriteMjcf(mechanism);
    case ModelFormat::kUrdf:
      return WriteUrdf(mechanism);
    case ModelFormat::kYaml:
      return WriteModel(mechanism);
  }
  return "";
}

}  // namespace mbv
