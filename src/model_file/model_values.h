// Numbers, vectors, axes and poses of a model file. Internal to the model loader.
#pragma once

#include <any>
#include <deque>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/types.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/yaml/expressions.h"
#include "model_file/yaml/units.h"
#include "model_file/yaml/yaml_reader.h"

// A level of declarations of a model file: the model itself, or one instance of a part. Stages run
// over all blocks one after the other, so that every name exists before it is referred to. Internal
// to the model loader.

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
  bool written = true;              ///< `node` is in the file, not made of it

  [[nodiscard]] bool is_model() const { return prefix.empty(); }
  [[nodiscard]] const YamlNode* Section(std::string_view key) const;
  /// The entries of a section, and a finding if it is not a map of names.
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

/// The numbers that a file writes out, in the order of reading.
class Literals {
 public:
  /// `replaced`: other values by place (LoadOptions::literals).
  explicit Literals(const std::map<std::string, double>& replaced) : replaced_(replaced) {}

  /// Takes note of a number; what it is replaced by, or itself.
  double At(const std::string& place, double value);
  [[nodiscard]] std::vector<Literal> Take() { return std::move(literals_); }

 private:
  const std::map<std::string, double>& replaced_;
  std::vector<Literal> literals_;
  std::set<std::string> places_;
};

/// What readers made of items of a model file (a body, a frame, a joint, a shape). At later loads
/// of the same document they are taken again where all numbers and frames that they were made of
/// are what they were. Items with findings are read each time.
class ItemMemory {
 public:
  /// Before the items of a load are read. Where its parameters are not those of the load before,
  /// but for their values, nothing is known. `bodies` outlive the load.
  void Begin(const std::vector<Parameter>& parameters, const std::vector<Body>& bodies);

  /// The next item of the load; false where it is not kept: a part of another item, or of a block
  /// that no file contains.
  bool Next(const Block& block, const YamlNode& node);
  /// What is known of it; null where it must be read.
  [[nodiscard]] const std::any* Known(Literals* literals) const;

  /// While it is read: what it is made of.
  void Record();
  void AddParametersOf(const std::string& expression, const std::vector<std::string>& levels);
  void AddFrame(int body, const NamedFrame& frame);
  void AddLiteral(Literal literal);
  void AddUnknown() { keeps_ = false; }
  /// What was read; nothing where it cannot be taken again.
  void Keep(std::any made);

 private:
  struct FrameUse {
    int body = 0;
    size_t frame = 0;
    Pose X_BF = Pose::Identity();
  };
  struct Item {
    const YamlNode* node = nullptr;
    std::string prefix = {};
    std::vector<size_t> parameters = {};
    std::vector<FrameUse> frames = {};
    std::vector<Literal> literals = {};
    std::any made = {};  // empty: to be read
  };

  std::map<std::string, size_t> places_;  // of parameters
  std::vector<double> values_;
  std::vector<bool> changed_;
  std::vector<Item> items_;  // in the order of reading
  size_t next_ = 0;
  bool reading_ = false, keeps_ = false;
  const std::vector<Body>* bodies_ = nullptr;
};

/// Reads one value each, in the scope of a block; empty after a finding. Keys may carry a unit.
class ModelValues {
 public:
  ModelValues(YamlReader* yaml, Literals* literals) : yaml_(*yaml), literals_(*literals) {}

  std::optional<double> Number(const Block& block, const YamlNode& node, const std::string& path,
                               const UnitSuffix& unit = kPlain);
  std::optional<Vec3> Vector(const Block& block, const YamlNode& node, const std::string& path,
                             const UnitSuffix& unit = kPlain);
  /// The same under a key; empty without a finding when it is left out.
  std::optional<double> Number(const Block& block, const YamlMap& map, const std::string& key,
                               std::initializer_list<UnitSuffix> units);
  std::optional<Vec3> Vector(const Block& block, const YamlMap& map, const std::string& key,
                             std::initializer_list<UnitSuffix> units);
  /// A required number > 0.
  std::optional<double> Positive(const Block& block, const YamlMap& map, const std::string& key,
                                 std::initializer_list<UnitSuffix> units);
  /// The required key `radius` > 0 [m].
  std::optional<double> Radius(const Block& block, const YamlMap& map);
  /// "x", "-y", or a vector of any length; unit.
  std::optional<Vec3> Axis(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Pose> PoseOf(const Block& block, const YamlNode& node, const std::string& path);
  /// [lower, upper], null for none.
  std::optional<CoordinateRange> Range(const Block& block, const YamlNode& node,
                                       const std::string& path, const UnitSuffix& unit);

  /// [[a, b], …], the a in a unit.
  std::optional<std::vector<std::pair<double, double>>> Pairs(const Block& block,
                                                              const YamlNode& node,
                                                              const std::string& path,
                                                              const UnitSuffix& unit);
  /// Points of a curve: pairs whose a increase, at least two.
  std::optional<std::vector<std::pair<double, double>>> Points(const Block& block,
                                                               const YamlNode& node,
                                                               const std::string& path,
                                                               const UnitSuffix& unit);

  [[nodiscard]] YamlReader& yaml() { return yaml_; }

  /// Takes items again that `memory` knows.
  void Remember(ItemMemory* memory) { memory_ = memory; }
  /// What `make` reads of an item, or made of it at an earlier load.
  template <typename Made, typename Make>
  std::optional<Made> Item(const Block& block, const YamlNode& node, const Make& make) {
    if (memory_ == nullptr || !memory_->Next(block, node)) return make();
    if (const std::any* known = memory_->Known(&literals_)) return *std::any_cast<Made>(known);
    const size_t findings = yaml_.diagnostics().findings().size();
    memory_->Record();
    std::optional<Made> made = make();
    const bool good = made && yaml_.diagnostics().findings().size() == findings;
    memory_->Keep(good ? std::any(*made) : std::any());
    return made;
  }
  /// The item that is read uses this frame, or has what is not to be taken again.
  void UseFrame(int body, const NamedFrame& frame) {
    if (memory_ != nullptr) memory_->AddFrame(body, frame);
  }
  void UseUnknown() {
    if (memory_ != nullptr) memory_->AddUnknown();
  }

 private:
  /// `path` gives the text where it is needed: in findings and of literals.
  template <typename PathOf>
  std::optional<double> NumberAt(const Block& block, const YamlNode& node, const PathOf& path,
                                 const UnitSuffix& unit);
  std::optional<Mat3> Rotation(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Mat3> RotationMatrix(const Block& block, const YamlNode& node,
                                     const std::string& path);
  std::optional<Mat3> RotationFromAxes(const Block& block, const YamlNode& node,
                                       const std::string& path);

  YamlReader& yaml_;
  Literals& literals_;
  ItemMemory* memory_ = nullptr;
};

// The names by which scenarios command and watch a model: of drives, prescribed joints, outputs and
// couplings.

/// Where each name is given. One name is one thing to command.
class SignalPlaces {
 public:
  /// `what`: "drive", …
  void Add(const std::string& name, const char* what, Place place) {
    places_[name].push_back({what, place});
  }
  /// Of the first one of this name, which exists.
  [[nodiscard]] Place Of(const std::string& name) const { return places_.at(name).front().place; }
  /// Findings about names that are given twice.
  void Check(YamlReader* yaml) const;

 private:
  struct Use {
    const char* what;
    Place place;
  };
  std::map<std::string, std::vector<Use>> places_;
};

/// Findings about coordinates of joints that two drives or prescribed joints move.
void CheckDrivenOnce(const std::vector<Drive>& drives, const std::vector<Prescribed>& prescribed,
                     const std::vector<Joint>& joints, const SignalPlaces& places,
                     YamlReader* yaml);

}  // namespace mbv::internal
