// `parts` and `instances` of a model file: the blocks that it is made of. Internal to the model
// loader.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/model_values.h"
#include "model_file/yaml/yaml_reader.h"

// `parameters` of a model and of its parts, of the files in `parameters_from`, and overrides.
// Internal to the model loader.

namespace mbv::internal {

/// What a file says of a parameter beside its value, for later loads of the same document.
struct ParameterText {
  const YamlNode* value = nullptr;
  UnitSuffix in_unit = kPlain;
  std::string unit, note;
  Source source = Source::kUnstated;
  bool written_out = false;
};
/// By the entry in the document's tree; of those without findings.
using ParameterTexts = std::unordered_map<const YamlEntry*, ParameterText>;

/// Reads parameters into the scopes of blocks, and lists them.
class ParameterReader {
 public:
  /// `others`: findings that have no place in the model file. `known`: texts of the model file that
  /// an earlier load read; null: none is.
  ParameterReader(const LoadOptions& options, YamlReader* yaml, Diagnostics* others,
                  ParameterTexts* known)
      : options_(options), yaml_(*yaml), others_(*others), known_texts_(known) {}

  /// The model's own parameters after those of the files it takes them from; the nearer file wins.
  /// `file`: the whole model file.
  void ReadModel(const Block& model, const YamlMap& file);
  /// A part's parameters in two steps: its defaults, then, when the instance has set its values,
  /// overrides and the list.
  void DefinePart(const Block& instance, const YamlNode* parameters);
  void FinishPart(const Block& instance, const YamlNode* parameters);
  /// Findings about overrides that no block has taken, and about values that are not a number.
  void CheckOverrides();

  [[nodiscard]] std::vector<Parameter> Take() { return std::move(parameters_); }

 private:
  /// Another model file whose parameters this one takes.
  struct File {
    YamlReader yaml;
    YamlNodePtr root;
  };
  void OpenFiles(YamlReader* yaml, const YamlNode& root, const std::vector<std::string>& chain,
                 std::deque<File>* files);
  [[nodiscard]] const ParameterText* Known(const YamlEntry& entry) const;
  void Define(YamlReader* yaml, const Block& block, const YamlNode* node, const std::string& path);
  void Override(const Block& block);
  void Evaluate(YamlReader* yaml, const Block& block, const YamlNode* node, const std::string& path,
                const std::set<std::string>& replaced = {});
  static ParameterText ReadText(YamlReader* yaml, const YamlEntry& entry, const std::string& path);
  [[nodiscard]] Finding PlaceOfOverride(const std::string& name) const;

  const LoadOptions& options_;
  YamlReader& yaml_;
  Diagnostics& others_;
  std::vector<Parameter> parameters_;
  std::map<std::string, std::string> overridden_;  // full name of a parameter → name as given
  std::set<std::string> used_overrides_;           // names as given
  std::vector<std::pair<const Scope*, std::string>> scopes_;  // that take overrides, their prefixes
  ParameterTexts* known_texts_;
};

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
