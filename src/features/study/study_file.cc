#include "features/study/study_file.h"

#include <fmt/format.h>
#include <fnmatch.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/inputs.h"
#include "base/text.h"
#include "features/study/design.h"
#include "mechanism/mechanism.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/checks.h"
#include "scenario/file_parts.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "scenario/section_readers.h"
#include "scenario/tables/text.h"
#include "verify/check_file.h"

namespace mbv::internal {

/// What numbers are varied of.
struct VariedScenario {
  const Mechanism* mechanism = nullptr;
  const YamlNode* root = nullptr;  ///< the scenario's document
  std::string file;
};

namespace {

const std::string kParametersStart = "parameters.";

std::string WithoutStart(const std::string& key) {
  return key.starts_with(kParametersStart) ? key.substr(kParametersStart.size()) : key;
}

// A factor being read: its own unit, and the SI unit of what it is ("" where it is not known).
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

// `listed`: a list gives the points, so that no distribution is needed. Findings go to `values`.
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

namespace mbv {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kStudyKeys = {"study",        "description", "scenario",   "vary",
                                             "design",       "witnesses",   "quantities", "limits",
                                             "correlations", "validation",  "missing",    "expect"};

class StudyReader {
 public:
  StudyReader(const std::string& file, const StudyOptions& options)
      : options_(options), yaml_(file), values_(&yaml_, &scope_) {
    study_.file = file;
  }

  StudyResult LoadFile() {
    const auto text = yaml_.ReadFile();
    if (text) return Load(*text);
    return {{}, yaml_.diagnostics()};
  }

  StudyResult Load(const std::string& text) {
    const YamlNodePtr root = yaml_.Parse(text);
    if (root != nullptr) Read(*root);
    StudyResult result;
    result.diagnostics = yaml_.diagnostics();
    result.diagnostics.Append(other_findings_);
    if (!result.diagnostics.has_errors()) result.study = std::move(study_);
    return result;
  }

 private:
  void Read(const YamlNode& root) {
    YamlMap map(&yaml_, &root, "", kStudyKeys);
    if (!map.valid()) return;
    if (const YamlNode* name = map.Required("study")) ReadName(*name);
    if (const YamlNode* text = map.Find("description")) {
      study_.description = yaml_.Text(*text, "description").value_or("");
    }
    ReadWitnesses(map.Find("witnesses"));
    if (const YamlNode* quantities = map.Required("quantities")) ReadQuantities(*quantities);
    if (const YamlNode* limits = map.Find("limits")) ReadLimits(*limits);
    if (const YamlNode* missing = map.Find("missing"))
      study_.missing = ReadShare(*missing, "missing");
    const Expectation expect = ReadExpectation(&values_, map.Find("expect"));
    study_.expected_exit = expect.exit_code;
    study_.mentions = expect.mentions;
    const YamlNode* scenario = map.Required("scenario");
    const YamlNode* vary = map.Required("vary");
    const YamlNode* design = map.Required("design");
    if (scenario == nullptr || !LoadVaried(*scenario) || vary == nullptr) return;
    study_.factors = internal::ReadFactors(
        &values_, *vary, {&*varied_.mechanism, varied_root_.get(), study_.scenario},
        internal::IsListDesign(design));
    if (design == nullptr) return;
    const std::uint64_t most =
        options_.many ? std::numeric_limits<std::uint64_t>::max() : kMostStudyPoints;
    study_.design = internal::ReadDesign(&values_, *design, study_.factors,
                                         {Folder(), most, options_.drawn, &other_findings_});
    const YamlNode* correlations = map.Find("correlations");
    if (correlations != nullptr && !yaml_.has_errors()) {
      internal::ReadCorrelations(&values_, *correlations, study_.factors, &study_.design);
    }
    if (const YamlNode* validation = map.Find("validation")) ReadValidation(*validation);
  }

  // E = S − D of the table in the reference's place, by the first witness.
  void ReadValidation(const YamlNode& node) {
    StudyValidation validation;
    validation.line = node.line;
    validation.column = node.column;
    YamlMap map(&yaml_, &node, "validation", {"coverage", "share", "u_num"});
    if (!map.valid()) return;
    if (const YamlNode* k = map.Find("coverage")) {
      validation.coverage = values_.Positive(*k, "validation.coverage").value_or(2.0);
    }
    if (const YamlNode* share = map.Find("share"))
      validation.share = ReadShare(*share, "validation.share");
    if (const YamlNode* u_num = map.Find("u_num")) {
      validation.u_num = values_.Number(*u_num, "validation.u_num");
      if (validation.u_num && !(*validation.u_num >= 0.0)) {
        yaml_.Error(*u_num,
                    fmt::format("validation.u_num = {:g} violates >= 0", *validation.u_num));
      }
    }
    if (!study_.design.draws() || study_.design.kind == DesignKind::kSaltelli) {
      yaml_.Error(node, "validation: the inputs' uncertainty needs drawn points",
                  "design: {sobol: 256} or {latin_hypercube: 200}");
    }
    if (varied_.scenario && varied_.scenario->reference.table == nullptr) {
      yaml_.Error(node, "validation: the scenario has no table to validate against",
                  "reference: {csv: measured.csv} there");
    }
    if (!study_.witnesses.empty() && study_.witnesses.front() == "reference") {
      yaml_.Error(node, "validation: the first witness is the table itself",
                  "witnesses: [analytic], [inverse] or [forward]");
    }
    study_.validation = validation;
  }

  double ReadShare(const YamlNode& node, const std::string& path) {
    const double share = values_.Number(node, path).value_or(0.0);
    if (share >= 0.0 && share < 1.0) return share;
    yaml_.Error(node, fmt::format("{} = {:g} violates 0 <= share < 1", path, share),
                "the share that may violate the limit");
    return 0.0;
  }

  [[nodiscard]] std::string Folder() const { return fs::path(study_.file).parent_path().string(); }

  void ReadName(const YamlNode& node) {
    const auto name = yaml_.Text(node, "study");
    if (!name) return;
    study_.name = *name;
    if (IsName(*name)) return;
    const std::string near = NearestName(*name);
    yaml_.Error(node, fmt::format("study = '{}' is not a name: {}", *name, kNameRule),
                near.empty() ? "" : "e.g. " + near);
  }

  // The scenario as it is; findings about it have its own places.
  bool LoadVaried(const YamlNode& node) {
    const auto name = yaml_.Text(node, "scenario");
    if (!name) return false;
    const fs::path beside = (fs::path(Folder()) / *name).lexically_normal();
    std::error_code error;
    study_.scenario = fs::exists(beside, error) ? beside.string() : FindScenario(*name);
    if (!fs::is_regular_file(study_.scenario, error)) {
      yaml_.Error(node, fmt::format("scenario = '{}': there is no such file", *name),
                  DidYouMeanPath(beside.string()));
      return false;
    }
    if (const DocumentKind& kind = KindOf(study_.scenario); !kind.in_time) {
      yaml_.Error(node, fmt::format("scenario = '{}' is a {}", *name, kind.name),
                  "a study varies a scenario with a motion; of a model alone, mbverify init writes "
                  "a first one");
      return false;
    }
    varied_ = LoadScenario(study_.scenario);
    other_findings_.Append(varied_.diagnostics);
    if (!varied_.mechanism) return false;
    YamlReader reader(study_.scenario);
    const auto text = reader.ReadFile();
    if (text) varied_root_ = reader.Parse(*text);
    for (const Parameter& p : varied_.mechanism->parameters) scope_.Set(p.name, p.value);
    return true;
  }

  void ReadWitnesses(const YamlNode* node) {
    study_.witnesses = {"reference"};
    if (node == nullptr) return;
    const auto items = yaml_.Items(*node, "witnesses");
    if (!items) return;
    study_.witnesses.clear();
    const std::vector<std::string> words(std::begin(kStudyWitnesses), std::end(kStudyWitnesses));
    int simulations = 0;
    for (const YamlNode* item : *items) {
      const auto choice = yaml_.Choice(*item, "witnesses", words);
      if (!choice) continue;
      const std::string& word = words[static_cast<size_t>(*choice)];
      if (Contains(study_.witnesses, word)) {
        yaml_.Error(*item, fmt::format("witnesses: {} is named twice", word));
      }
      if (*choice >= 2 && ++simulations > 1) {
        yaml_.Error(*item, "witnesses: one simulation computes a point, in one mode",
                    "write a second study for the other mode");
      }
      study_.witnesses.push_back(word);
    }
    if (items->empty()) yaml_.Error(*node, "witnesses: the list is empty");
  }

  void ReadQuantities(const YamlNode& node) {
    const auto items = yaml_.Items(node, "quantities");
    if (!items) return;
    for (const YamlNode* item : *items) ReadQuantity(*item);
    if (items->empty()) {
      yaml_.Error(node, "quantities: nothing is asked for", "e.g. [closure_m, motor_margin]");
    }
  }

  void ReadQuantity(const YamlNode& item) {
    const auto name = yaml_.Text(item, "quantities");
    if (!name) return;
    StudyQuantity quantity;
    quantity.name = *name;
    quantity.line = item.line;
    quantity.column = item.column;
    const size_t point = name->rfind('.');
    std::vector<std::string> words;
    for (const StatisticWord& row : kStatisticWords) {
      words.emplace_back(row.word);
      if (point == std::string::npos || name->substr(point + 1) != row.word) continue;
      quantity.channel = name->substr(0, point);
      quantity.statistic = row.statistic;
    }
    if (quantity.is_check()) {
      const MetricRow* row = FindMetric(*name);
      if (row == nullptr) UnknownQuantity(item, *name, point, words);
      quantity.of_pair = row != nullptr && row->of_pair;
    }
    const auto same = [&](const StudyQuantity& q) { return q.name == *name; };
    if (std::any_of(study_.quantities.begin(), study_.quantities.end(), same)) {
      yaml_.Error(item, fmt::format("quantities: {} is named twice", *name));
    }
    study_.quantities.push_back(std::move(quantity));
  }

  void UnknownQuantity(const YamlNode& item, const std::string& name, size_t point,
                       const std::vector<std::string>& words) {
    std::vector<std::string> known;
    for (const MetricRow& row : MetricRows()) known.emplace_back(row.key);
    std::string hint = DidYouMean(name, known);
    if (hint.empty() && point != std::string::npos)
      hint = DidYouMean(name.substr(point + 1), words);
    if (hint.empty()) {
      hint = "a check such as closure_m, or CHANNEL.STATISTIC with one of " + Joined(words);
    }
    yaml_.Error(
        item, fmt::format("quantities: '{}' is neither a check nor a statistic of a channel", name),
        hint);
  }

  void ReadLimits(const YamlNode& node) {
    std::vector<std::string> names;
    for (const StudyQuantity& quantity : study_.quantities) names.push_back(quantity.name);
    for (const YamlEntry& entry : yaml_.Entries(node, "limits")) {
      const auto found = std::find(names.begin(), names.end(), entry.key);
      if (found == names.end()) {
        yaml_.Error(entry, fmt::format("limits: '{}' is not one of the quantities", entry.key),
                    DidYouMean(entry.key, names, "name it under quantities, too"));
        continue;
      }
      ReadLimit(entry, static_cast<size_t>(found - names.begin()));
    }
  }

  void ReadLimit(const YamlEntry& entry, size_t quantity) {
    const std::string path = "limits." + entry.key;
    YamlMap map(&yaml_, entry.value.get(), path, {"below", "above", "share"});
    StudyLimit limit{.quantity = quantity, .below = {}, .above = {}};
    if (const YamlNode* below = map.Find("below"))
      limit.below = values_.Number(*below, path + ".below");
    if (const YamlNode* above = map.Find("above"))
      limit.above = values_.Number(*above, path + ".above");
    if (map.valid() && !map.Has("below") && !map.Has("above")) {
      yaml_.Error(entry, path + ": says neither below nor above",
                  "e.g. {below: 1200, share: 0.01}");
    }
    if (limit.below && limit.above && !(*limit.above < *limit.below)) {
      yaml_.Error(entry, fmt::format("{}: above = {:g}, below = {:g}: nothing lies between", path,
                                     *limit.above, *limit.below));
    }
    if (const YamlNode* share = map.Find("share")) limit.share = ReadShare(*share, path + ".share");
    study_.limits.push_back(limit);
  }

  const StudyOptions options_;
  YamlReader yaml_;
  Scope scope_;
  ValueReader values_;
  Study study_;
  ScenarioResult varied_;
  YamlNodePtr varied_root_;
  Diagnostics other_findings_;  // of the scenario, and of a list of points
};

}  // namespace

StudyResult LoadStudy(const std::string& file, const StudyOptions& options) {
  return StudyReader(file, options).LoadFile();
}

StudyResult LoadStudyText(const std::string& text, const std::string& file,
                          const StudyOptions& options) {
  return StudyReader(file, options).Load(text);
}

}  // namespace mbv

namespace mbv::internal {
namespace {

const std::vector<std::string> kDesignWords = {"sobol", "saltelli",      "latin_hypercube",
                                               "grid",  "one_at_a_time", "list"};

// The points of a file with commas between cells, in the order of the factors; its first line names
// the columns.
class PointList {
 public:
  PointList(std::string file, const std::vector<Factor>& factors, Diagnostics* findings)
      : file_(std::move(file)), factors_(factors), findings_(findings) {}

  std::vector<std::vector<double>> Read() {
    const auto text = ReadWholeFile(file_);
    if (!text) {
      findings_->AddError(file_, "cannot be read", DidYouMeanPath(file_));
      return {};
    }
    NoteInput(file_, *text);
    std::vector<std::vector<double>> points;
    std::istringstream lines(text->starts_with("\xEF\xBB\xBF") ? text->substr(3) : *text);
    CutLine cut;
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      CutCells(line, ',', &cut);
      if (cut.cells.size() == 1 && cut.cells[0].text.empty()) continue;
      if (!columns_.empty()) {
        points.push_back(PointOf({line, number}, cut));
      } else if (!FindColumns(cut)) {
        return {};
      }
    }
    if (points.empty()) findings_->AddError(file_, "has no points");
    return points;
  }

 private:
  // The heading: names as they are, whatever units they look like.
  bool FindColumns(const CutLine& heading) {
    std::vector<std::string> names;
    for (const TableCell& cell : heading.cells) names.emplace_back(cell.text);
    for (const Factor& factor : factors_) {
      const auto found = std::find(names.begin(), names.end(), factor.name);
      columns_.push_back(static_cast<size_t>(found - names.begin()));
      if (found != names.end()) continue;
      findings_->AddError(file_, fmt::format("has no column '{}'", factor.name),
                          DidYouMean(factor.name, names, "its first line names what is varied"));
    }
    return !findings_->has_errors();
  }

  std::vector<double> PointOf(const TableLine& line, const CutLine& cut) {
    std::vector<double> point;
    for (size_t k = 0; k < factors_.size(); ++k) {
      const bool there = columns_[k] < cut.cells.size();
      const auto cell = there ? ReadCell(cut.cells[columns_[k]].text, false) : CellNumber();
      point.push_back(cell.value);
      if (cell.kind == CellNumber::Kind::kNumber) continue;
      Finding finding;
      finding.file = file_;
      finding.line = line.number;
      finding.column = there ? cut.cells[columns_[k]].column : 1;
      finding.message = fmt::format("'{}' is not a number of {}",
                                    there ? cut.cells[columns_[k]].text : "", factors_[k].name);
      if (findings_->findings().size() < 20) findings_->Add(std::move(finding));
    }
    return point;
  }

  std::string file_;
  const std::vector<Factor>& factors_;
  Diagnostics* findings_;
  std::vector<size_t> columns_;
};

// A whole number from 1 on, exact in a double.
std::uint64_t ReadCount(ValueReader* values, const YamlNode& node, const std::string& path) {
  const auto number = values->yaml().Number(node, path);
  if (!number) return 1;
  if (*number >= 1.0 && *number <= 0x1p53 && *number == std::floor(*number)) {
    return static_cast<std::uint64_t>(*number);
  }
  values->yaml().Error(node,
                       fmt::format("{} = {:g} is not a whole number from 1 on", path, *number));
  return 1;
}

// 2^m points of Sobol's sequence are balanced in every number; others are not.
void CheckPower(const YamlNode& node, const std::string& path, std::uint64_t count,
                YamlReader* yaml) {
  if (std::has_single_bit(count)) return;
  const std::uint64_t below = std::bit_floor(count);
  yaml->Error(node, fmt::format("{} = {} is not a power of two", path, count),
              fmt::format("{} or {}: only these leave no part of a range out", below, 2 * below));
}

// Grids combine levels; the others need what points are drawn from.
void CheckFactors(const YamlNode& node, DesignKind kind, const std::vector<Factor>& factors,
                  YamlReader* yaml) {
  for (const Factor& factor : factors) {
    const bool levels = std::holds_alternative<Levels>(factor.axis.distribution);
    if (kind == DesignKind::kGrid && !levels) {
      yaml->Error(node, fmt::format("design.grid: {} has no levels", factor.name),
                  fmt::format("vary: {{{}: {{grid: […]}}}}, or another design", factor.name));
    }
    if (kind == DesignKind::kOneAtATime && std::isnan(factor.axis.nominal)) {
      yaml->Error(node,
                  fmt::format("design.one_at_a_time: the scenario does not state {}, so it has no "
                              "nominal value",
                              factor.name));
    }
  }
}

}  // namespace

bool IsListDesign(const YamlNode* node) {
  return node != nullptr && node->is_map() && node->Find("list") != nullptr;
}

Design ReadDesign(ValueReader* values, const YamlNode& node, const std::vector<Factor>& factors,
                  const DesignContext& context) {
  Design design;
  YamlReader& yaml = values->yaml();
  std::vector<std::string> keys = kDesignWords;
  keys.emplace_back("seed");
  YamlMap map(&yaml, &node, "design", keys);
  std::vector<size_t> given;
  for (size_t k = 0; k < kDesignWords.size(); ++k) {
    if (map.Has(kDesignWords[k])) given.push_back(k);
  }
  if (map.valid() && given.size() != 1) {
    yaml.Error(node,
               "design: give one of sobol, saltelli, latin_hypercube, grid, one_at_a_time, list",
               "e.g. design: {sobol: 256}");
  }
  if (given.size() != 1) return design;
  design.kind = static_cast<DesignKind>(given[0]);
  const std::string path = "design." + kDesignWords[given[0]];
  const YamlNode& value = *map.Find(kDesignWords[given[0]]);
  if (const YamlNode* seed = map.Find("seed")) {
    design.seed = ReadCount(values, *seed, "design.seed");
    if (!design.draws()) yaml.Error(*seed, path + " draws nothing: it has no seed");
  }
  if (design.draws()) {
    design.count = context.drawn.count.value_or(ReadCount(values, value, path));
    design.seed = context.drawn.seed.value_or(design.seed);
  } else if (context.drawn.count || context.drawn.seed) {
    yaml.Error(value, path + " draws nothing: --count and --seed are about points that are drawn");
  } else if (design.kind != DesignKind::kList) {
    if (yaml.Flag(value, path) == false) yaml.Error(value, path + " = false: nothing is computed");
  }
  if (design.kind == DesignKind::kSobol || design.kind == DesignKind::kSaltelli) {
    CheckPower(value, path, design.count, &yaml);
  }
  CheckFactors(value, design.kind, factors, &yaml);
  if (design.kind == DesignKind::kList) {
    const auto file = yaml.Text(value, path);
    if (file && !factors.empty()) {
      const std::string beside = (std::filesystem::path(context.folder) / *file).string();
      design.list = PointList(beside, factors, context.list_findings).Read();
    }
  }
  if (yaml.has_errors() || factors.empty()) return design;
  std::vector<Axis> axes;
  axes.reserve(factors.size());
  for (const Factor& factor : factors) axes.push_back(factor.axis);
  const std::uint64_t count = DesignPoints(std::move(axes), design).count();
  if (count > context.most) {
    yaml.Error(value,
               fmt::format("{}: {:.3g} points, more than {:g}", path, static_cast<double>(count),
                           static_cast<double>(context.most)),
               "mbverify study --yes computes them");
  }
  return design;
}

namespace {

// One entry: two normal numbers and a coefficient.
std::optional<Correlation> ReadCorrelation(ValueReader* values, const YamlNode& node,
                                           const std::vector<Factor>& factors) {
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, &node, "correlations", {"of", "coefficient"});
  const YamlNode* of = map.Required("of");
  const YamlNode* coefficient = map.Required("coefficient");
  if (of == nullptr || coefficient == nullptr) return {};
  const auto items = yaml.Items(*of, "correlations.of");
  const auto number = values->Number(*coefficient, "correlations.coefficient");
  if (!items || !number) return {};
  if (items->size() != 2) {
    yaml.Error(*of, "correlations.of: name two numbers", "e.g. {of: [m_p, m_1], coefficient: 0.8}");
    return {};
  }
  std::vector<std::string> names;
  names.reserve(factors.size());
  for (const Factor& factor : factors) names.push_back(factor.name);
  std::vector<size_t> axes;
  for (const YamlNode* item : *items) {
    const auto name = yaml.Text(*item, "correlations.of");
    if (!name) return {};
    const auto found = std::find(names.begin(), names.end(), *name);
    if (found == names.end()) {
      yaml.Error(*item, fmt::format("correlations.of: '{}' is not varied", *name),
                 DidYouMean(*name, names));
      continue;
    }
    axes.push_back(static_cast<size_t>(found - names.begin()));
    if (std::holds_alternative<Normal>(factors[axes.back()].axis.distribution)) continue;
    yaml.Error(*item, fmt::format("correlations.of: {} is not normal", *name),
               "only normal numbers have correlations here");
  }
  if (axes.size() < 2) return {};
  if (axes[0] == axes[1]) {
    yaml.Error(*of, fmt::format("correlations.of: {} with itself", names[axes[0]]));
    return {};
  }
  if (!(std::abs(*number) < 1.0)) {
    yaml.Error(
        *coefficient,
        fmt::format("correlations.coefficient = {:g} violates -1 < coefficient < 1", *number),
        "two numbers that always go together are one: vary a parameter that both are "
        "computed from");
    return {};
  }
  return Correlation{axes[0], axes[1], *number};
}

}  // namespace

void ReadCorrelations(ValueReader* values, const YamlNode& node, const std::vector<Factor>& factors,
                      Design* design) {
  YamlReader& yaml = values->yaml();
  const auto items = yaml.Items(node, "correlations");
  if (!items) return;
  if (design->kind != DesignKind::kSobol && design->kind != DesignKind::kLatinHypercube) {
    yaml.Error(node, "correlations: are drawn by sobol and latin_hypercube alone",
               design->kind == DesignKind::kSaltelli
                   ? "Sobol' indices share a variance among independent numbers"
                   : "");
    return;
  }
  for (const YamlNode* item : *items) {
    const auto read = ReadCorrelation(values, *item, factors);
    if (!read) continue;
    const auto same = [&](const Correlation& c) {
      return std::minmax(c.first, c.second) == std::minmax(read->first, read->second);
    };
    if (std::any_of(design->correlations.begin(), design->correlations.end(), same)) {
      yaml.Error(*item, fmt::format("correlations: that of {} and {} is given twice",
                                    factors[read->first].name, factors[read->second].name));
    }
    design->correlations.push_back(*read);
  }
  if (yaml.has_errors() || design->correlations.empty()) return;
  // Below this the root of the matrix loses its digits.
  constexpr double kSmallest = 1e-10;
  const double smallest = SmallestEigenvalue(CorrelationMatrix(*design, factors.size()));
  if (smallest >= kSmallest) return;
  yaml.Error(node,
             fmt::format("correlations: no numbers have these together: the smallest eigenvalue of "
                         "their matrix is {:.3g} and must be above 0",
                         smallest),
             "make the coefficients smaller, or state those that are left out");
}

}  // namespace mbv::internal
