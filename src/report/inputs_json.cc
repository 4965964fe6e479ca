#include "report/inputs_json.h"

#include "core/json_text.h"

namespace mbv {

using Json = nlohmann::ordered_json;

std::string ToJson(const std::vector<InputFile>& inputs) {
  Json json = {{"schema", "mbverify.inputs/1"}, {"inputs", Json::array()}};
  for (const InputFile& input : inputs) {
    json["inputs"].push_back({{"file", input.file}, {"fingerprint", input.fingerprint}});
  }
  return Dump(json);
}

}  // namespace mbv
