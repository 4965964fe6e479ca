#include "analytic/stiffness_form.h"

#include <fmt/format.h>
#include <algorithm>

#include "base/text.h"

namespace mbv {
void CheckPoseNames(const Mechanism& mechanism, const PoseNames& names, const PoseCoordinates& pose,
                    Diagnostics* diagnostics) {
  for (const auto& [name, value] : pose) {
    if (Contains(names.needed, name) || Contains(names.accepted, name)) continue;
    diagnostics->AddError(
        "",
        fmt::format("the stiffness of {} cannot take the coordinate \"{}\"", mechanism.name, name),
        names.hint);
  }
  for (const std::string& name : names.needed) {
    if (!pose.contains(name)) {
      diagnostics->AddError("", fmt::format("{} is not given", name), names.hint);
    }
  }
}

void CheckStiffnessParameters(const Mechanism& mechanism, std::span<const std::string> positive,
                              std::span<const std::string> others, Diagnostics* diagnostics) {
  for (const auto& names : {positive, others}) {
    for (const std::string& name : names) {
      if (mechanism.HasParameter(name)) continue;
      diagnostics->AddError(
          "", fmt::format("the model has no parameter \"{}\"", name),
          fmt::format("the stiffness of {0} needs models/{0}/elastic.yaml", mechanism.name));
    }
  }
  for (const std::string& name : positive) {
    if (!mechanism.HasParameter(name)) continue;
    const double value = mechanism.ParameterValue(name);
    if (value > 0.0) continue;
    diagnostics->AddError("", fmt::format("{} = {:g} violates {} > 0", name, value, name));
  }
}

int IndexOfModel(std::span<const std::string> models, const std::string& model,
                 Diagnostics* diagnostics) {
  if (model.empty()) return 0;
  const auto found = std::find(models.begin(), models.end(), model);
  if (found != models.end()) return static_cast<int>(found - models.begin());
  diagnostics->AddError("", fmt::format("unknown model \"{}\"", model),
                        fmt::format("models: {}", fmt::join(models, ", ")));
  return -1;
}

}  // namespace mbv
