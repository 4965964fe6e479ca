// `--set key=value`: replacing values of a YAML tree from the command line.
#pragma once

#include "input/yaml_reader.h"
#include "model_file/load_model.h"
#include "scenario/load_scenario.h"

namespace mbv {

/// The tree with the values put in; maps on the way are made when missing. Values that are no YAML
/// are findings. Nodes that came from the k-th value carry the line −(k + 1).
[[nodiscard]] YamlNodePtr SetValues(YamlNodePtr root, const std::vector<SetValue>& values,
                                    YamlReader* reader);

/// The node that `key` would replace; null where there is none.
[[nodiscard]] const YamlNode* FindSetNode(const YamlNode& root, const std::string& key);

/// Overrides of parameters by `--set NAME=VALUE`: numbers and expressions as a scenario's
/// `parameters` takes them. Findings name the option.
[[nodiscard]] Diagnostics ReadParameterOptions(const std::vector<SetValue>& values,
                                               LoadOptions* options);

/// Moves findings about such nodes from the file to "--set key=value", and sorts all by place.
[[nodiscard]] Diagnostics PlaceSetFindings(const Diagnostics& diagnostics,
                                           const std::vector<SetValue>& values);

}  // namespace mbv
