#include "scenario/state_function_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/word_hints.h"
#include "scenario/free_motion_reader.h"
#include "scenario/motion_reader.h"

namespace mbv {
namespace {

constexpr const char* kTime = "t";

bool IsWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }

// A text in pieces: words with their dots, and what is between them.
struct Piece {
  std::string text;
  bool is_word = false;  // starts with a letter or _

  [[nodiscard]] bool is_dotted() const { return is_word && text.find('.') != std::string::npos; }
};

std::vector<Piece> PiecesOf(const std::string& text) {
  std::vector<Piece> pieces;
  for (size_t i = 0; i < text.size();) {
    size_t end = i;
    while (end < text.size() && (IsWord(text[end]) || text[end] == '.')) ++end;
    if (end == i) ++end;
    const bool letter = IsWord(text[i]) && std::isdigit(static_cast<unsigned char>(text[i])) == 0;
    pieces.push_back({text.substr(i, end - i), letter});
    i = end;
  }
  return pieces;
}

// Rotations of balls are coordinates for start values only.
bool CanFollow(const Mechanism& mechanism, const Coordinate& coordinate) {
  if (coordinate.kind != Coordinate::Kind::kJoint) return true;
  const Joint& joint = mechanism.joints[static_cast<size_t>(coordinate.index)];
  return !HasBall(joint.kind);
}

class FunctionReader {
 public:
  FunctionReader(ValueReader* values, const Mechanism& mechanism)
      : values_(*values), mechanism_(mechanism) {
    for (const NamedCoordinate& named : StateCoordinates(mechanism)) {
      if (!CanFollow(mechanism, named.coordinate)) continue;
      known_.push_back({named.name + ".position", Input(named.coordinate, false)});
      known_.push_back({named.name + ".velocity", Input(named.coordinate, true)});
    }
  }

  std::optional<StateFunction> Read(const YamlNode& node, const std::string& path) {
    std::string expression;
    bool good = true;
    for (const Piece& piece : PiecesOf(node.text)) {
      good = CheckTime(piece, node, path) && good;
      const auto name = piece.is_dotted() ? VariableOf(piece.text, node, path) : piece.text;
      good = good && name;
      expression += name.value_or("0");
    }
    if (!good) return std::nullopt;
    const auto formula = values_.Compile(node, path, expression, variables_);
    if (formula == nullptr) return std::nullopt;
    return StateFunction{.inputs = inputs_, .value = [formula](double t_s, auto inputs) {
                           std::vector<double> all{t_s};
                           all.insert(all.end(), inputs.begin(), inputs.end());
                           return formula->At(all);
                         }};
  }

 private:
  struct Known {
    std::string name;
    StateFunction::Input input;
  };

  [[nodiscard]] StateFunction::Input Input(const Coordinate& coordinate, bool rate) const {
    return {coordinate, rate, HomeValue(mechanism_, coordinate)};
  }

  bool CheckTime(const Piece& piece, const YamlNode& node, const std::string& path) {
    if (piece.text != kTime || !values_.HasParameter(kTime)) return true;
    values_.yaml().Error(
        node, fmt::format("{}: t is the time here, and a parameter of {}", path, mechanism_.name));
    return false;
  }

  // The variable that stands for a coordinate.
  std::optional<std::string> VariableOf(const std::string& name, const YamlNode& node,
                                        const std::string& path) {
    const auto found =
        std::ranges::find_if(known_, [&](const Known& known) { return known.name == name; });
    if (found == known_.end()) {
      std::vector<std::string> names;
      for (const Known& known : known_) names.push_back(known.name);
      values_.yaml().Error(node, fmt::format("{}: {} has no '{}'", path, mechanism_.name, name),
                           DidYouMean(name, names,
                                      "known: t [s], and .position and .velocity of drives, of "
                                      "OUTPUT.x … OUTPUT.yaw and of joints"));
      return std::nullopt;
    }
    inputs_.push_back(found->input);
    variables_.push_back(fmt::format("state_{}", variables_.size()));
    return variables_.back();
  }

  ValueReader& values_;
  const Mechanism& mechanism_;
  std::vector<Known> known_;
  std::vector<StateFunction::Input> inputs_;
  std::vector<std::string> variables_ = {kTime};
};

}  // namespace

bool FollowsState(const ValueReader& values, const YamlNode& node) {
  if (!node.is_scalar()) return false;
  const std::vector<Piece> pieces = PiecesOf(node.text);
  return std::ranges::any_of(pieces, [&](const Piece& piece) {
    return piece.is_dotted() || (piece.text == kTime && !values.HasParameter(kTime));
  });
}

std::optional<StateFunction> ReadStateFunction(ValueReader* values, const Mechanism& mechanism,
                                               const YamlNode& node, const std::string& path) {
  return FunctionReader(values, mechanism).Read(node, path);
}

}  // namespace mbv
