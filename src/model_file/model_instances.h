// `parts` and `instances` of a model file: the blocks that it is made of. Internal to the model
// loader.
#pragma once

#include <string>

#include "model_file/model_block.h"
#include "model_file/model_parameters.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Adds a block for each instance of a part, those within parts included.
class InstanceReader {
 public:
  InstanceReader(const YamlNode& root, ModelValues* values, ParameterReader* parameters,
                 ModelBlocks* blocks)
      : parts_(root.Find("parts")), values_(*values), parameters_(*parameters), blocks_(*blocks) {}

  /// The instances in `block`; of the model itself: all.
  void Expand(const Block& block);

 private:
  void Add(const Block& block, const YamlEntry& entry);
  void Read(const Block& block, const YamlEntry& entry, const YamlNode& part,
            const std::string& part_name);
  [[nodiscard]] const YamlNode* FindPart(const std::string& name) const;

  const YamlNode* parts_;  // null when there are none
  ModelValues& values_;
  ParameterReader& parameters_;
  ModelBlocks& blocks_;
};

}  // namespace mbv::internal
