// `parameters` of a model and of its parts, of the files in `parameters_from`, and overrides.
// Internal to the model loader.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "input/yaml_reader.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/model_block.h"

namespace mbv::internal {

/// Reads parameters into the scopes of blocks, and lists them.
class ParameterReader {
 public:
  /// `others`: findings that have no place in the model file.
  ParameterReader(const LoadOptions& options, YamlReader* yaml, Diagnostics* others)
      : options_(options), yaml_(*yaml), others_(*others) {}

  /// The model's own parameters after those of the files it takes them from; the nearer file wins.
  /// `file`: the whole model file.
  void ReadModel(const Block& model, const YamlMap& file);
  /// A part's parameters in two steps: its defaults, then, when the instance has set its values,
  /// overrides and the list.
  void DefinePart(const Block& instance, const YamlNode* parameters);
  void FinishPart(const Block& instance, const YamlNode* parameters);
  /// Findings about overrides that no block has taken, and about values that are no number.
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
  static void Define(YamlReader* yaml, const Block& block, const YamlNode* node,
                     const std::string& path);
  void Override(const Block& block);
  void Evaluate(YamlReader* yaml, const Block& block, const YamlNode* node, const std::string& path,
                const std::set<std::string>& replaced = {});
  [[nodiscard]] Finding PlaceOfOverride(const std::string& name) const;

  const LoadOptions& options_;
  YamlReader& yaml_;
  Diagnostics& others_;
  std::vector<Parameter> parameters_;
  std::map<std::string, std::string> overridden_;  // full name of a parameter → name as given
  std::set<std::string> used_overrides_;           // names as given
  std::vector<std::string> known_;                 // dotted names, for "did you mean"
};

}  // namespace mbv::internal
