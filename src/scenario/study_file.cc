#include "scenario/study_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <limits>

#include "core/names.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "scenario/checks.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "scenario/settings_reader.h"
#include "scenario/study_design.h"
#include "scenario/study_factors.h"

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
    yaml_.Error(node, fmt::format("study = '{}' is no name: {}", *name, kNameRule),
                near.empty() ? "" : "e.g. " + near);
  }

  // The scenario as it is; findings about it are told with its own places.
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
    const ScenarioHead head = ReadScenarioHead(study_.scenario);
    if (!head.is_scenario || head.is_stiffness()) {
      yaml_.Error(node,
                  fmt::format("scenario = '{}' is {}", *name,
                              head.is_stiffness() ? "a stiffness scenario" : "no scenario"),
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
    if (items->empty()) yaml_.Error(*node, "witnesses: nobody computes anything");
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
        yaml_.Error(entry, fmt::format("limits: '{}' is none of the quantities", entry.key),
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
