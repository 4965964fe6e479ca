// inputs.json: which files a run read.
#pragma once

#include <string>
#include <vector>

#include "base/inputs.h"

namespace mbv {

/// {schema, inputs: [{file, fingerprint}]}.
[[nodiscard]] std::string ToJson(const std::vector<InputFile>& inputs);

}  // namespace mbv
