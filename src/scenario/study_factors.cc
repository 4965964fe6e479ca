#include "scenario/study_factors.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <cmath>

#include "core/word_hints.h"
#include "scenario/file_parts.h"
#include "scenario/set_values.h"

namespace mbv::internal {
namespace {

const std::string kParametersStart = "parameters.";

std::string WithoutStart(const std::string& key) {
  return key.starts_with(kParametersStart) ? key.substr(kParametersStart.size()) : key;
}

// A factor being read: its own unit, and the SI unit of what it is ("" where nobody knows).
struct FactorDraft {
  Factor factor;
  UnitSuffix unit = kPlain;
  std::string si;
};

class FactorReader {
 public:
  FactorReader(ValueReader* values, const VariedScenario& varied)
      : values_(*values), yaml_(values->yaml()), varied_(varied) {}

  /// `name`: of the number that is varied; the entry's key, or what that as a pattern stands for.
  Factor Read(const std::string& name, const YamlEntry& entry, bool listed) {
    draft_ = {};
    draft_.factor.name = name;
    draft_.factor.line = entry.line;
    draft_.factor.column = entry.column;
    path_ = "vary." + name;
    Locate(name, entry);
    if (listed && entry.value->is_null()) return draft_.factor;
    YamlMap map(&yaml_, entry.value.get(), path_, {"normal", "uniform", "grid"});
    const int given = map.Has("normal") + map.Has("uniform") + map.Has("grid");
    if (map.valid() && given != 1) {
      yaml_.Error(entry, path_ + ": give one of normal, uniform and grid",
                  "e.g. {normal: {sigma_percent: 1}} or {grid: [1, 2, 3]}");
    }
    if (const YamlNode* node = map.Find("normal")) ReadNormal(*node);
    if (const YamlNode* node = map.Find("uniform")) ReadUniform(*node);
    if (const YamlNode* node = map.Find("grid")) ReadLevels(*node);
    return draft_.factor;
  }

 private:
  // What `--set` sets, and the nominal value.
  void Locate(const std::string& key, const YamlEntry& entry) {
    Factor& factor = draft_.factor;
    const std::string name = WithoutStart(key);
    const NameInUnit plain = PlainName(name, *varied_.mechanism);
    if (varied_.mechanism->HasParameter(plain.name)) {
      factor.key = kParametersStart + name;
      draft_.unit = plain.unit;
      const Parameter& parameter = ParameterOf(plain.name);
      draft_.si = parameter.unit;
      factor.axis.nominal = parameter.value / plain.unit.to_si(1.0);
      return;
    }
    factor.key = key;
    factor.axis.nominal = kNan;
    draft_.unit = SplitUnit(key).unit;
    const YamlNode* node = varied_.root == nullptr ? nullptr : FindSetNode(*varied_.root, key);
    if (node == nullptr) return CheckKey(entry);
    YamlReader scenario(varied_.file);
    Scope scope;
    for (const Parameter& p : varied_.mechanism->parameters) scope.Set(p.name, p.value);
    factor.axis.nominal = ValueReader(&scenario, &scope).Number(*node, key).value_or(kNan);
    if (std::isnan(factor.axis.nominal)) {
      yaml_.Error(entry, fmt::format("{}: {}:{} has {} there, no number", path_, varied_.file,
                                     node->line, Describe(*node)));
    }
  }

  // A key that the scenario does not have must at least lie in something that it has: the rest is
  // said by whoever reads the scenario with the key set.
  void CheckKey(const YamlEntry& entry) {
    if (entry.key.find('.') != std::string::npos) return;
    std::vector<std::string> known;
    for (const Parameter& p : varied_.mechanism->parameters) known.push_back(p.name);
    yaml_.Error(
        entry,
        fmt::format("{}: {} has no parameter '{}'", path_, varied_.mechanism->name, entry.key),
        DidYouMean(entry.key, known,
                   "a parameter of the model, or a key that --set knows, such as "
                   "motion.duration_s"));
  }

  const Parameter& ParameterOf(const std::string& name) const {
    const auto& parameters = varied_.mechanism->parameters;
    return *std::find_if(parameters.begin(), parameters.end(),
                         [&](const Parameter& p) { return p.name == name; });
  }

  // A number in the factor's unit under `key`, `key_mm` or `key_deg`; empty if left out or wrong.
  std::optional<double> Amount(const YamlMap& map, const std::string& key) {
    const auto given = map.FindInUnit(key, {kPlain, kMm, kDeg});
    if (given.node == nullptr) return {};
    const auto number = values_.Number(*given.node, map.PathOf(given.key));
    if (!number || given.unit.suffix == draft_.unit.suffix || given.unit.suffix.empty()) {
      return number;
    }
    const bool suits =
        draft_.unit.suffix.empty() && (draft_.si.empty() || given.unit.Suits(draft_.si));
    if (!suits) {
      yaml_.Error(*given.node,
                  fmt::format("{}: {} is in {}", map.PathOf(given.key), draft_.factor.name,
                              draft_.si.empty() ? draft_.unit.suffix : draft_.si));
      return {};
    }
    return given.unit.to_si(*number);
  }

  // The same, or as a percentage of the nominal value; must be above 0.
  std::optional<double> Width(const YamlMap& map, const std::string& key) {
    auto width = Amount(map, key);
    const YamlNode* percent = map.Find(key + "_percent");
    const YamlNode* at = percent != nullptr ? percent : map.node();
    if (percent != nullptr) {
      if (width) yaml_.Error(*percent, map.path() + ": " + key + " is given twice");
      const auto number = values_.Positive(*percent, map.PathOf(key + "_percent"));
      if (!number || !NominalIsKnown(*percent)) return {};
      width = *number / 100.0 * std::abs(draft_.factor.axis.nominal);
      if (*width == 0.0) {
        yaml_.Error(
            *percent,
            fmt::format("{}_percent of {} = 0 is nothing", map.PathOf(key), draft_.factor.name),
            fmt::format("state {} itself", key));
        return {};
      }
    }
    if (width && !(*width > 0.0)) {
      yaml_.Error(*at, fmt::format("{} = {:g} violates > 0", map.PathOf(key), *width));
      return {};
    }
    return width;
  }

  bool NominalIsKnown(const YamlNode& at) {
    if (!std::isnan(draft_.factor.axis.nominal)) return true;
    yaml_.Error(
        at,
        fmt::format("{}: the scenario does not state {}, so it has no nominal value", path_,
                    draft_.factor.name),
        "state it in the scenario, or give {min: …, max: …}, {mean: …, sigma: …} or a grid");
    return false;
  }

  void ReadNormal(const YamlNode& node) {
    YamlMap map(&yaml_, &node, path_ + ".normal",
                {"mean", "mean_mm", "mean_deg", "sigma", "sigma_mm", "sigma_deg", "sigma_percent"});
    const auto mean = Amount(map, "mean");
    const auto sigma = Width(map, "sigma");
    if (!map.valid() || (!mean && !NominalIsKnown(node))) return;
    if (!sigma) return Missing(node, map, "sigma_percent: 1");
    draft_.factor.axis.distribution = Normal{mean.value_or(draft_.factor.axis.nominal), *sigma};
  }

  void ReadUniform(const YamlNode& node) {
    YamlMap map(&yaml_, &node, path_ + ".uniform",
                {"plus_minus", "plus_minus_mm", "plus_minus_deg", "plus_minus_percent", "min",
                 "min_mm", "min_deg", "max", "max_mm", "max_deg"});
    const auto width = Width(map, "plus_minus");
    const auto lower = Amount(map, "min"), upper = Amount(map, "max");
    if (!map.valid()) return;
    const double nominal = draft_.factor.axis.nominal;
    if (width && !lower && !upper) {
      if (NominalIsKnown(node)) {
        draft_.factor.axis.distribution = Uniform{nominal - *width, nominal + *width};
      }
    } else if (!width && lower && upper) {
      if (!(*lower < *upper)) {
        yaml_.Error(node, fmt::format("{}: min = {:g}, max = {:g} violate min < max", map.path(),
                                      *lower, *upper));
      }
      draft_.factor.axis.distribution = Uniform{*lower, *upper};
    } else {
      Missing(node, map, "plus_minus: 1, or min: 1, max: 2");
    }
  }

  void ReadLevels(const YamlNode& node) {
    const auto levels = values_.Numbers(node, path_ + ".grid");
    if (!levels) return;
    if (levels->empty()) yaml_.Error(node, path_ + ".grid: has no values");
    draft_.factor.axis.distribution = Levels{*levels};
  }

  // Unless something about it was said already.
  void Missing(const YamlNode& node, const YamlMap& map, const std::string& example) {
    if (node.is_map() && node.entries.empty()) {
      yaml_.Error(node, map.path() + ": is empty", "e.g. {" + example + "}");
    } else if (!yaml_.has_errors()) {
      yaml_.Error(node, map.path() + ": is incomplete, or says more than one thing",
                  "e.g. {" + example + "}");
    }
  }

  ValueReader& values_;
  YamlReader& yaml_;
  const VariedScenario& varied_;
  FactorDraft draft_;
  std::string path_;
};

// The entries of `vary`, patterns replaced by what they stand for.
class FactorList {
 public:
  FactorList(YamlReader* yaml, const VariedScenario& varied, const std::vector<YamlEntry>& entries)
      : yaml_(*yaml), varied_(varied), entries_(entries) {}

  // Names of numbers, each with its entry; "NAME: fixed" keeps a number out of patterns.
  std::vector<std::pair<std::string, const YamlEntry*>> Names() {
    std::vector<std::pair<std::string, const YamlEntry*>> names;
    for (const YamlEntry& entry : entries_) {
      if (IsFixed(entry)) {
        CheckFixed(entry);
      } else if (!IsPattern(entry.key)) {
        names.emplace_back(entry.key, &entry);
      } else {
        for (const std::string& name : Matches(entry)) Take(name, entry, &names);
      }
    }
    return names;
  }

 private:
  // The last pattern that fits a number wins.
  static void Take(const std::string& name, const YamlEntry& entry,
                   std::vector<std::pair<std::string, const YamlEntry*>>* names) {
    const auto same = [&](const auto& taken) { return taken.first == name; };
    const auto found = std::find_if(names->begin(), names->end(), same);
    if (found != names->end()) {
      found->second = &entry;
    } else {
      names->emplace_back(name, &entry);
    }
  }

  static bool IsPattern(const std::string& key) { return key.find('*') != std::string::npos; }
  static bool IsFixed(const YamlEntry& entry) {
    return entry.value->is_scalar() && entry.value->text == "fixed";
  }

  void CheckFixed(const YamlEntry& entry) {
    const std::string name = PlainName(WithoutStart(entry.key), *varied_.mechanism).name;
    const bool known =
        varied_.mechanism->HasParameter(name) ||
        (varied_.root != nullptr && FindSetNode(*varied_.root, entry.key) != nullptr);
    if (known || IsPattern(entry.key)) return;
    std::vector<std::string> names;
    for (const Parameter& p : varied_.mechanism->parameters) names.push_back(p.name);
    yaml_.Error(entry, fmt::format("vary.{}: there is no such number to keep", entry.key),
                DidYouMean(entry.key, names));
  }

  // Whether an entry of its own says what happens to the number.
  [[nodiscard]] bool IsNamed(const std::string& name) const {
    return std::any_of(entries_.begin(), entries_.end(), [&](const YamlEntry& entry) {
      const std::string key = WithoutStart(entry.key);
      if (IsPattern(key)) return IsFixed(entry) && Fits(key, name);
      return key == name || PlainName(key, *varied_.mechanism).name == name;
    });
  }

  static bool Fits(const std::string& pattern, const std::string& name) {
    return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
  }

  // Parameters that the model writes out, else numbers of the scenario; none that are zero, which
  // percentages cannot vary.
  std::vector<std::string> Matches(const YamlEntry& entry) {
    const std::string pattern = WithoutStart(entry.key);
    std::vector<std::string> names;
    for (const Parameter& p : varied_.mechanism->parameters) {
      if (p.written_out && p.value != 0.0 && Fits(pattern, p.name)) names.push_back(p.name);
    }
    if (names.empty() && varied_.root != nullptr) AddNumbers(*varied_.root, "", pattern, &names);
    if (names.empty()) {
      yaml_.Error(
          entry,
          fmt::format("vary.{}: fits no parameter that {} writes out and that is not 0, and "
                      "no number of the scenario",
                      entry.key, varied_.mechanism->name),
          "'*' stands for any letters");
    }
    std::erase_if(names, [&](const std::string& name) { return IsNamed(name); });
    return names;
  }

  static void AddNumbers(const YamlNode& node, const std::string& path, const std::string& pattern,
                         std::vector<std::string>* names) {
    for (const YamlEntry& entry : node.entries) {
      AddNumbers(*entry.value, JoinPath(path, entry.key), pattern, names);
    }
    for (size_t k = 0; k < node.items.size(); ++k) {
      AddNumbers(*node.items[k], JoinPath(path, fmt::format("{}", k)), pattern, names);
    }
    if (!node.is_scalar() || node.quoted || !IsWrittenOut(node.text)) return;
    Scope none;
    const ExpressionResult number = none.Evaluate(node.text);
    if (number.value && *number.value != 0.0 && Fits(pattern, path)) names->push_back(path);
  }

  YamlReader& yaml_;
  const VariedScenario& varied_;
  const std::vector<YamlEntry>& entries_;
};

}  // namespace

std::vector<Factor> ReadFactors(ValueReader* values, const YamlNode& node,
                                const VariedScenario& varied, bool listed) {
  std::vector<Factor> factors;
  YamlReader& yaml = values->yaml();
  FactorReader reader(values, varied);
  const std::vector<YamlEntry> entries = yaml.Entries(node, "vary");
  for (const auto& [name, entry] : FactorList(&yaml, varied, entries).Names()) {
    if (factors.size() == kMostAxes) {
      yaml.Error(*entry, fmt::format("vary: more than {} numbers", kMostAxes));
      break;
    }
    Factor factor = reader.Read(name, *entry, listed);
    const auto same = [&](const Factor& f) { return f.key == factor.key; };
    if (std::any_of(factors.begin(), factors.end(), same)) {
      yaml.Error(*entry, fmt::format("vary: {} is varied twice", factor.key));
    }
    factors.push_back(std::move(factor));
  }
  if (factors.empty() && !yaml.has_errors()) {
    yaml.Error(node, "vary: nothing is varied", "e.g. vary: {m_p: {normal: {sigma_percent: 1}}}");
  }
  return factors;
}

}  // namespace mbv::internal
