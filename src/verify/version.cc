#include "verify/version.h"

#include <fmt/format.h>

#include <Eigen/Core>

#include "base/json_text.h"
#include "simulation/engine/engine.h"

namespace mbv {

std::vector<std::pair<std::string, std::string>> Versions() {
  return {{"mbverify", kVersion},
          {"mujoco", EngineVersion()},
          {"eigen",
           fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"compiler", __VERSION__}};
}

std::string InputsJson(const std::vector<InputFile>& inputs,
                       const std::vector<std::pair<std::string, std::string>>& set) {
  using Json = nlohmann::ordered_json;
  Json json = {{"schema", "mbverify.inputs/1"},
               {"program", fmt::format("mbverify {}", kVersion)},
               {"set", Json::object()},
               {"inputs", Json::array()}};
  for (const auto& [key, value] : set) json["set"][key] = value;
  for (const InputFile& input : inputs) {
    json["inputs"].push_back({{"file", input.file}, {"fingerprint", input.fingerprint}});
  }
  return Dump(json);
}

}  // namespace mbv
