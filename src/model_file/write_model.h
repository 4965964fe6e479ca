// A mechanism as the text of a model.yaml.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Reads back to the same numbers to the last bit; guesses are the home pose, so that loops close
/// from there. Names become such as model files take (letters, digits, _ and -). Parameters are
/// written as the numbers they gave; beams are left out.
[[nodiscard]] std::string WriteModel(const Mechanism& mechanism);

/// The names that WriteModel() gives, by index; the world's body keeps its name.
struct WrittenNames {
  std::vector<std::string> bodies, joints, drives, outputs;
};
[[nodiscard]] WrittenNames NamesInModel(const Mechanism& mechanism);

/// In double quotes, for YAML.
[[nodiscard]] std::string QuotedYaml(const std::string& text);

}  // namespace mbv
