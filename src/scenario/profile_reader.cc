#include "scenario/profile_reader.h"

#include <fmt/format.h>

namespace mbv {
namespace {

class ProfileReader {
 public:
  ProfileReader(ValueReader* values, const ProfileContext& context)
      : values_(values), context_(context) {}

  void Read(const YamlNode& node, const std::string& path, Profile* profile) {
    if (node.is_sequence()) {
      for (size_t i = 0; i < node.items.size(); ++i) {
        ReadOne(*node.items[i], fmt::format("{}[{}]", path, i), profile);
      }
    } else {
      ReadOne(node, path, profile);
    }
  }

 private:
  void ReadOne(const YamlNode& node, const std::string& path, Profile* profile) {
    if (node.is_map()) {
      ReadTerm(node, path, profile);
    } else if (node.is_scalar() && node.text == "home") {
      if (context_.home) {
        profile->terms.emplace_back(ConstantTerm{*context_.home});
      } else {
        values_->yaml().Error(node, path + " = 'home' has no meaning here");
      }
    } else if (const auto number = values_->Number(node, path)) {
      profile->terms.emplace_back(ConstantTerm{*number});
    }
  }

  void ReadTerm(const YamlNode& node, const std::string& path, Profile* profile) {
    YamlMap map(&values_->yaml(), &node, path,
                {"value", "value_deg", "value_mm", "sine", "ramp", "poly345", "cycloid", "bump"});
    if (!map.valid()) return;
    if (node.entries.size() != 1) {
      values_->yaml().Error(node,
                            fmt::format("{} has {} terms in one map", path, node.entries.size()),
                            "write a list to add terms: [0.2, {sine: …}]");
      return;
    }
    const std::string& key = node.entries.front().key;
    const YamlNode* value = node.entries.front().value.get();
    const std::string term_path = JoinPath(path, key);
    if (key.starts_with("value")) {
      if (const auto number = Amount(map, "value"))
        profile->terms.emplace_back(ConstantTerm{*number});
    } else if (key == "sine") {
      ReadSine(value, term_path, profile);
    } else if (key == "ramp") {
      YamlMap term = Map(value, term_path, "rate", {});
      if (const auto rate = RequiredAmount(term, "rate")) {
        profile->terms.emplace_back(RampTerm{*rate});
      }
    } else if (key == "poly345" || key == "cycloid" || key == "bump") {
      ReadStep(key, value, term_path, profile);
    }
  }

  void ReadSine(const YamlNode* node, const std::string& path, Profile* profile) {
    YamlMap term = Map(node, path, "amplitude", {"frequency_hz", "period_s", "phase", "phase_deg"});
    if (!term.valid()) return;
    SineTerm sine;
    const auto amplitude = RequiredAmount(term, "amplitude");
    const YamlNode *frequency = term.Find("frequency_hz"), *period = term.Find("period_s");
    if ((frequency == nullptr) == (period == nullptr)) {
      values_->yaml().Error(*node, fmt::format("{} needs one of frequency_hz and period_s", path));
      return;
    }
    const auto rate = frequency != nullptr
                          ? values_->Positive(*frequency, term.PathOf("frequency_hz"))
                          : values_->Positive(*period, term.PathOf("period_s"));
    sine.phase_rad = values_->InUnit(term, "phase", {kPlain, kDeg}).value_or(0.0);
    if (!amplitude || !rate) return;
    sine.amplitude = *amplitude;
    sine.frequency_hz = frequency != nullptr ? *rate : 1.0 / *rate;
    profile->terms.emplace_back(sine);
  }

  void ReadStep(const std::string& key, const YamlNode* node, const std::string& path,
                Profile* profile) {
    const std::string size = key == "bump" ? "height" : "delta";
    YamlMap term = Map(node, path, size, {"start_s", "duration_s"});
    if (!term.valid()) return;
    const auto amount = RequiredAmount(term, size);
    const auto duration_s = values_->RequiredPositive(term, "duration_s");
    const double start_s = values_->InUnit(term, "start_s", {kPlain}).value_or(0.0);
    if (!amount || !duration_s) return;
    if (key == "bump") {
      profile->terms.emplace_back(BumpTerm{start_s, *duration_s, *amount});
    } else if (key == "cycloid") {
      profile->terms.emplace_back(CycloidStepTerm{start_s, *duration_s, *amount});
    } else {
      profile->terms.emplace_back(PolyStepTerm{start_s, *duration_s, *amount});
    }
  }

  // A term's map; `amount` is the key that may be given in several units.
  YamlMap Map(const YamlNode* node, const std::string& path, const std::string& amount,
              std::vector<std::string> keys) {
    for (std::string& key : InEveryUnit(amount)) keys.push_back(std::move(key));
    return {&values_->yaml(), node, path, keys};
  }

  // A length or angle; the unit must suit the coordinate.
  std::optional<double> Amount(const YamlMap& map, const std::string& key) {
    const YamlMap::InUnit found = map.FindInUnit(key, {kPlain, kDeg, kMm});
    if (found.node == nullptr) return {};
    if (!found.unit.Suits(context_.unit)) {
      values_->yaml().Error(
          *found.node,
          fmt::format("{} is given, but this value is in {}", map.PathOf(found.key), context_.unit),
          fmt::format("write {}", map.PathOf(key)));
      return {};
    }
    const auto number = values_->Number(*found.node, map.PathOf(found.key));
    if (!number) return {};
    return found.unit.to_si(*number);
  }

  std::optional<double> RequiredAmount(const YamlMap& map, const std::string& key) {
    if (!map.valid()) return {};
    if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) {
      (void)map.Required(key);  // reports it
      return {};
    }
    return Amount(map, key);
  }

  ValueReader* values_;
  const ProfileContext& context_;
};

}  // namespace

Profile ReadProfile(ValueReader* values, const YamlNode& node, const std::string& path,
                    const ProfileContext& context) {
  Profile profile;
  ProfileReader(values, context).Read(node, path, &profile);
  return profile;
}

}  // namespace mbv
