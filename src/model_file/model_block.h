// A level of declarations of a model file: the model itself, or one instance of a part. Stages run
// over all blocks one after the other, so that every name exists before it is referred to. Internal
// to the model loader.
#pragma once

#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "input/expressions.h"
#include "input/yaml_reader.h"

namespace mbv::internal {

/// A place in the model file; line 0: not in it.
struct Place {
  int line = 0, column = 0;
};
[[nodiscard]] inline Place PlaceOf(const YamlEntry& entry) { return {entry.line, entry.column}; }

struct Block {
  const YamlNode* node = nullptr;
  Scope* scope = nullptr;
  std::string path;                 ///< YAML path for messages: "" or "parts.limb"
  std::string prefix;               ///< "" or "limb1." or "limb1.left."
  std::vector<std::string> levels;  ///< prefixes in which a name is looked up, inner first
  std::vector<std::string> parts;   ///< names of the parts around, to find endless nesting
  std::vector<std::string> given;   ///< parameters that the instance sets

  [[nodiscard]] bool is_model() const { return prefix.empty(); }
  [[nodiscard]] const YamlNode* Section(std::string_view key) const;
  /// The entries of a section, and a finding if it is no map of names.
  [[nodiscard]] const std::vector<YamlEntry>& Entries(const char* section, YamlReader* yaml) const;
  [[nodiscard]] std::string Note() const;  ///< " (in limb1)" for messages
  [[nodiscard]] std::string PathOf(std::string_view key) const { return JoinPath(path, key); }
};

/// All blocks with their scopes, the model first; their addresses stay.
struct ModelBlocks {
  std::deque<Scope> scopes;
  std::deque<Block> blocks;
  std::deque<YamlNodePtr> made;  ///< what blocks stand on that no file contains

  explicit ModelBlocks(const YamlNode* root);
  [[nodiscard]] const Block& model() const { return blocks.front(); }
};

}  // namespace mbv::internal
