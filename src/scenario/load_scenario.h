// Scenario file → Scenario, resolved against its mechanism.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "kinematics/command_rank.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/yaml/value_reader.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/scenario.h"

namespace mbv {

struct LoadOptions;  // model_file/load_model.h

/// How the scenario's model is loaded: with its parameters, `more` on top, and its gravity.
[[nodiscard]] LoadOptions ModelOptions(const Scenario& scenario, const Overrides& more = {});

/// "simulation.step_s" = "0.002": replaces or adds a value of the file; the value is YAML text.
using SetValue = std::pair<std::string, std::string>;

/// Which phase of a scenario with `phases` is loaded, and from where.
struct PhaseStart {
  size_t index = 0;
  /// As ScenarioPhase::start.
  std::map<std::string, std::array<double, 6>> joints = {};
  /// The mechanism of the first phase, whose home is meant by `home`; null: this is the first one.
  const Mechanism* first = nullptr;
};

struct ScenarioOptions {
  std::vector<SetValue> set;          ///< applied in order
  const PhaseStart* phase = nullptr;  ///< null: the scenario must have no phases
};

struct ScenarioResult {
  std::optional<Scenario> scenario;    ///< empty when there are errors
  std::optional<Mechanism> mechanism;  ///< with the scenario's `parameters` applied
  Diagnostics diagnostics;             ///< all findings of the file and of its model
};

/// Loads a scenario file and the model it names (see find_model.h). Collects all findings; never
/// throws for bad input.
[[nodiscard]] ScenarioResult LoadScenario(const std::string& file,
                                          const ScenarioOptions& options = {});

class ScenarioMemory;
/// The same, with what `memory` has of earlier loads of this file.
[[nodiscard]] ScenarioResult LoadScenario(const std::string& file, const ScenarioOptions& options,
                                          ScenarioMemory* memory);

/// The same from text, for tests; `file` is used in messages and to find the model.
[[nodiscard]] ScenarioResult LoadScenarioText(const std::string& text, const std::string& file,
                                              const ScenarioOptions& options = {});

/// Only the mechanism name, description and `expect:` of a file, even if the rest is wrong. A file
/// that is not YAML may carry its expectation in a first line "# expect: {…}".
struct ScenarioHead {
  bool is_scenario = false;     ///< has a `mechanism:` key (or an expectation)
  bool names_programs = false;  ///< witnesses or a file of equations
  std::string kind;             ///< "motion", "stiffness"; "" means motion
  std::string mechanism, description;
  Expectation expect;
  std::vector<std::string> keys = {};  ///< at the file's top

  [[nodiscard]] bool HasKey(const std::string& key) const;
};
[[nodiscard]] ScenarioHead ReadScenarioHead(const std::string& file);

// `--set key=value`: replacing values of a YAML tree from the command line.

/// The tree with the values put in; maps on the way are made when missing. Values that are no YAML
/// are findings. Nodes that came from the k-th value carry the line −(k + 1).
[[nodiscard]] YamlNodePtr SetValues(YamlNodePtr root, const std::vector<SetValue>& values,
                                    YamlReader* reader);

/// The place of a finding about the option.
[[nodiscard]] Finding AtOption(const SetValue& value);

/// The node that `key` would replace; null where there is none.
[[nodiscard]] const YamlNode* FindSetNode(const YamlNode& root, const std::string& key);

/// Overrides of parameters by `--set NAME=VALUE`: numbers and expressions as a scenario's
/// `parameters` takes them. Findings name the option.
[[nodiscard]] Diagnostics ReadParameterOptions(const std::vector<SetValue>& values,
                                               LoadOptions* options);

/// A number that --set names, where it stands in a scenario's motion: a constant of a command's
/// profile or of a load's component, or one of a sine's numbers.
struct MotionNumber {
  enum class Field { kConstant, kAmplitude, kPhase, kFrequency, kPeriod };
  enum class Section { kCommands, kLoads };

  Section section = Section::kCommands;
  size_t item = 0;       ///< index into Motion::commands or Motion::loads
  size_t component = 0;  ///< of a load: 0 to 2 of the force, 3 to 5 of the moment
  size_t term = 0;       ///< index into Profile::terms
  Field field = Field::kConstant;
  double (*to_si)(double value) = nullptr;  ///< from the key's unit

  /// Writes a number in the key's unit. False, and nothing is written, where the reader of
  /// scenarios refuses it.
  [[nodiscard]] bool Put(double value, Motion* motion) const;
};

/// What loading a scenario file again with other numbers takes over from the loads before: files
/// are read and parsed once, a model is loaded and its commands are counted again only where a set
/// number changes it. Results are those without it. For one file, which does not change meanwhile,
/// and one thread.
class ScenarioMemory {
 public:
  /// The scenario's document, read by `reader`; null after a finding.
  [[nodiscard]] YamlNodePtr Document(YamlReader* reader);
  /// SetValues(); where only numbers differ from the last call, they are replaced in its tree.
  [[nodiscard]] YamlNodePtr Set(const YamlNodePtr& root, const std::vector<SetValue>& values,
                                YamlReader* reader);
  /// Where the number of `key` stands in the motion that was loaded last, if that is all that
  /// depends on it; else empty.
  [[nodiscard]] std::optional<MotionNumber> FindMotionNumber(const std::string& key,
                                                             const Motion& motion) const;
  /// FindModel() and LoadModel().
  [[nodiscard]] std::optional<std::string> Find(const std::string& model,
                                                const std::filesystem::path& folder);
  [[nodiscard]] LoadResult Load(const std::string& model_file, const LoadOptions& options);
  /// RankCommands() on the model as it was loaded last.
  [[nodiscard]] const CommandRank& Rank(const Mechanism& mechanism,
                                        const std::vector<Command>& commands);

 private:
  YamlNodePtr document_, root_;
  std::vector<SetValue> set_;
  std::vector<std::shared_ptr<YamlNode>> nodes_;  // of root_, with the values of set_
  std::map<std::string, std::optional<std::string>> models_, texts_;  // by name, by file
  std::string model_file_;
  LoadOptions options_;  // of model_
  LoadResult model_;     // loaded last; without a mechanism: not worth keeping
  std::vector<Command> commands_;
  std::optional<CommandRank> rank_;  // of commands_ and model_
};

/// Moves findings about such nodes from the file to "--set key=value", and sorts all by place.
[[nodiscard]] Diagnostics PlaceSetFindings(const Diagnostics& diagnostics,
                                           const std::vector<SetValue>& values);

// The `witnesses:` section of a scenario: programs that compute it in addition to our own
// witnesses.

/// In the order of the file. `folder`: of the scenario; words of a command that name a file in it
/// become its path.
[[nodiscard]] std::vector<ForeignWitness> ReadWitnesses(ValueReader* values, const YamlNode* node,
                                                        const std::string& folder);

}  // namespace mbv
