// Points computed in memory give what loading everything anew with `--set` gives, to the last bit.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "external/mechanism_json.h"
#include "features/study/study_bench.h"
#include "features/study/study_file.h"
#include "mechanism/motion.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> ShippedFiles(bool studies) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator("scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    const ScenarioHead head = ReadScenarioHead(entry.path());
    const bool motion = head.is_scenario && head.kind != "stiffness";
    if (studies ? head.HasKey("study") : motion) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string Bits(const auto& numbers) {
  std::string text;
  for (const double number : numbers) text += fmt::format("{:a} ", number);
  return text;
}

// All that a witness reads of it.
std::string TextOf(const ScenarioResult& loaded) {
  std::string text = loaded.diagnostics.Text();
  for (const Finding& finding : loaded.diagnostics.findings()) {
    text += finding.set.first + "=" + finding.set.second + "\n";
  }
  if (!loaded.scenario) return text;
  const Mechanism& mechanism = *loaded.mechanism;
  text += MechanismJson(mechanism);
  for (const Pose& X : mechanism.X_WB_home) text += Bits(X.matrix().reshaped());
  for (const Joint& joint : mechanism.joints) {
    text += Bits(joint.guess) + Bits(joint.home);
    for (const CoordinateRange& range : joint.range) {
      text += Bits(std::vector{range.lower, range.upper});
    }
  }
  for (const Drive& drive : mechanism.drives) {
    text += Bits(std::vector{drive.range.lower, drive.range.upper});
  }
  const Scenario& scenario = *loaded.scenario;
  const Motion& motion = scenario.motion;
  text += Bits(std::vector{motion.duration_s, motion.sample_s, scenario.simulation.step_s,
                           scenario.start_window_s});
  for (const MetricRow& row : MetricRows()) {
    const MetricLimits& limits = scenario.checks[row.metric];
    text += Bits(std::vector{limits.forward.value_or(kNan), limits.inverse.value_or(kNan),
                             limits.reference.value_or(kNan)});
  }
  for (const Overrides* own : {&scenario.parameters, &scenario.analytic.parameters,
                               &scenario.reference.parameters, &scenario.simulation.parameters}) {
    for (const auto& [name, value] : *own) text += fmt::format("{}={:a} ", name, value);
  }
  text += Bits(scenario.snapshots.times_s);
  CommandSample sample;
  for (const double share : {0.0, 0.31, 1.0}) {
    EvaluateMotion(motion, share * motion.duration_s, &sample);
    text += Bits(sample.position) + Bits(sample.velocity) + Bits(sample.acceleration);
    for (const LoadSample& load : sample.loads) text += Bits(load.force) + Bits(load.moment);
  }
  if (scenario.reference.table) text += Bits(scenario.reference.table->values.reshaped());
  return text;
}

// Keys of everything in a scenario file that is a number, and of its model's parameters.
void AddKeys(const YamlNode& node, const std::string& path, std::vector<std::string>* keys) {
  for (const YamlEntry& entry : node.entries) {
    AddKeys(*entry.value, JoinPath(path, entry.key), keys);
  }
  for (size_t k = 0; k < node.items.size(); ++k) {
    AddKeys(*node.items[k], fmt::format("{}.{}", path, k), keys);
  }
  if (node.is_scalar() && PlainNumber(node.text)) keys->push_back(path);
}

class ScenarioMemoryTest : public testing::Test {
 protected:
  void SetUp() override { fs::current_path(kSourceDir); }
};

TEST_F(ScenarioMemoryTest, AnyNumbersGiveWhatLoadingAnewGives) {
  const ParsedDocuments documents;
  std::mt19937_64 random(20261125);
  const auto pick = [&](size_t count) { return static_cast<size_t>(random() % count); };
  int loads = 0, refused = 0;
  for (const std::string& file : ShippedFiles(false)) {
    YamlReader reader(file);
    const auto text = reader.ReadFile();
    const YamlNodePtr root = text ? reader.Parse(*text) : nullptr;
    const ScenarioResult nominal = LoadScenario(file);
    if (root == nullptr || !nominal.scenario) continue;
    std::vector<std::string> keys;
    AddKeys(*root, "", &keys);
    for (const Parameter& p : nominal.mechanism->parameters) keys.push_back("parameters." + p.name);
    ScenarioMemory memory;
    std::vector<SetValue> set;
    for (int round = 0; round < 6; ++round) {
      // New keys, or the same ones with other values; now and then none, or what is not a number.
      if (round % 3 == 0) {
        set.clear();
        for (size_t k = pick(4); k > 0; --k) set.emplace_back(keys[pick(keys.size())], "");
      }
      for (auto& [key, value] : set) {
        double number = std::uniform_real_distribution(0.97, 1.03)(random);
        const std::string name = key.substr(key.find('.') + 1);
        if (key.starts_with("parameters.") && nominal.mechanism->HasParameter(name)) {
          number *= nominal.mechanism->ParameterValue(name);
        } else if (const YamlNode* node = FindSetNode(*root, key)) {
          number *= PlainNumber(node->text).value_or(1.0);
        }
        const std::vector<std::string> odd = {
            "0", "-0.0", fmt::format("{}", -number), "1e40", "2*pi", "nothing", ".nan", "{a: 1}"};
        value = pick(6) == 0 ? odd[pick(odd.size())] : fmt::format("{:.17g}", number);
      }
      const ScenarioResult anew = LoadScenario(file, {.set = set});
      const ScenarioResult again = LoadScenario(file, {.set = set}, &memory);
      std::string what = file;
      for (const auto& [key, value] : set) what += fmt::format(" --set {}={}", key, value);
      ASSERT_EQ(TextOf(again), TextOf(anew)) << what;
      ++loads;
      refused += anew.scenario ? 0 : 1;
    }
  }
  EXPECT_GT(loads, 300);
  EXPECT_GT(refused, 30);
  EXPECT_LT(refused, loads / 2);
}

TEST_F(ScenarioMemoryTest, PointsOfShippedStudiesAreThoseOfTheirCommands) {
  const ParsedDocuments documents;
  int studies = 0;
  for (const std::string& file : ShippedFiles(true)) {
    const StudyResult read = LoadStudy(file);
    ASSERT_TRUE(read.study) << read.diagnostics.Text();
    const Study& study = *read.study;
    Diagnostics diagnostics;
    int exit_code = 0;
    const auto bench = StudyBench::Make(study, &diagnostics, &exit_code);
    ASSERT_TRUE(bench) << diagnostics.Text();
    ++studies;
    for (const std::uint64_t number : {std::uint64_t{5}, std::uint64_t{0}, std::uint64_t{3}}) {
      if (number >= bench->points().count()) continue;
      const PointRow row = bench->Run(number).row;
      std::vector<SetValue> set;
      for (size_t k = 0; k < row.varied.size(); ++k) {
        set.emplace_back(study.factors[k].key, fmt::format("{:.17g}", row.varied[k]));
      }
      if (const std::string mode = ModeOf(study.witnesses); !mode.empty()) {
        set.emplace_back("simulation.mode", mode);
      }
      Diagnostics found;
      const auto prepared = Prepare(study.scenario, {.set = set}, &found);
      if (!prepared) {
        EXPECT_EQ(row.exit_code, 2) << file << ' ' << number;
        const auto error =
            std::ranges::find(found.findings(), Severity::kError, &Finding::severity);
        EXPECT_EQ(row.reason, error->message) << file << ' ' << number;
        continue;
      }
      const StudyRun run = RunStudyWitnesses(*prepared, study.witnesses);
      if (!run.failure.empty()) {
        EXPECT_EQ(row.reason, run.failure) << file << ' ' << number;
        continue;
      }
      EXPECT_EQ(Bits(row.values), Bits(MeasureQuantities(run, study.quantities).values))
          << file << ' ' << number;
    }
  }
  EXPECT_GE(studies, 13);
}

// What a command is at some times.
std::string BitsOfCommands(const Motion& motion) {
  std::string text;
  for (const Command& command : motion.commands) {
    for (const double share : {0.0, 0.31, 1.0}) {
      const Jet jet = Evaluate(command.profile, share * motion.duration_s);
      text += Bits(std::vector{jet.value, jet.rate, jet.acceleration});
    }
  }
  return text;
}

TEST_F(ScenarioMemoryTest, NumbersOfCommandsAreThoseThatLoadingGives) {
  const ParsedDocuments documents;
  std::mt19937_64 random(20261129);
  int found = 0;
  for (const std::string& file : ShippedFiles(false)) {
    YamlReader reader(file);
    const auto text = reader.ReadFile();
    const YamlNodePtr root = text ? reader.Parse(*text) : nullptr;
    const ScenarioResult nominal = LoadScenario(file);
    if (root == nullptr || !nominal.scenario || nominal.scenario->motion.free()) continue;
    std::vector<std::string> keys;
    AddKeys(*root, "", &keys);
    ScenarioMemory memory;
    for (const std::string& key : keys) {
      if (!key.starts_with("motion.commands.")) continue;
      const double value = std::uniform_real_distribution(0.97, 1.03)(random) *
                           *PlainNumber(FindSetNode(*root, key)->text);
      const std::vector<SetValue> set = {{key, fmt::format("{:.17g}", value)}};
      const ScenarioResult loaded = LoadScenario(file, {.set = set}, &memory);
      if (!loaded.scenario) continue;
      Motion motion = nominal.scenario->motion;
      const auto number = memory.FindCommandNumber(key, loaded.scenario->motion);
      if (!number) continue;
      ASSERT_TRUE(number->Put(value, &motion)) << file << ' ' << key;
      EXPECT_EQ(BitsOfCommands(motion), BitsOfCommands(loaded.scenario->motion))
          << file << ' ' << key;
      // Where the number moves the command, another one is seen.
      ASSERT_TRUE(number->Put(1.001 * value + 1e-3, &motion));
      EXPECT_NE(BitsOfCommands(motion), BitsOfCommands(loaded.scenario->motion))
          << file << ' ' << key;
      ++found;
    }
  }
  EXPECT_GT(found, 200);
}

TEST_F(ScenarioMemoryTest, NumbersThatTheReaderRefusesAreNotPut) {
  Motion motion;
  motion.commands.push_back({.name = "a", .profile = {{SineTerm{1.0, 2.0, 0.5}}}});
  CommandNumber number{.field = CommandNumber::Field::kPeriod, .to_si = kPlain.to_si};
  for (const double refused : {0.0, -1.0, kNan, HUGE_VAL}) {
    EXPECT_FALSE(number.Put(refused, &motion)) << refused;
  }
  EXPECT_EQ(std::get<SineTerm>(motion.commands[0].profile.terms[0]).frequency_hz, 2.0);
  EXPECT_TRUE(number.Put(4.0, &motion));
  EXPECT_EQ(std::get<SineTerm>(motion.commands[0].profile.terms[0]).frequency_hz, 0.25);
}

// A closed form that serves any profiles gives, after another motion of its commands, what a new
// one gives.
TEST_F(ScenarioMemoryTest, FormsThatServeAnyProfilesForgetTheMotionBefore) {
  const ParsedDocuments documents;
  int served = 0;
  for (const std::string& file : ShippedFiles(false)) {
    const ClosedFormRow* row = FindClosedForm(ReadScenarioHead(file).mechanism);
    if (row == nullptr || !row->serves_any_profiles) continue;
    Diagnostics diagnostics;
    const auto used = Prepare(file, {}, &diagnostics), fresh = Prepare(file, {}, &diagnostics);
    if (!used || !used->has_closed_form() || !used->scenario.analytic.equations.empty()) continue;
    const Motion& motion = used->scenario.motion;
    Motion other = motion;
    for (Command& command : other.commands) {
      for (ProfileTerm& term : command.profile.terms) {
        if (auto* sine = std::get_if<SineTerm>(&term)) sine->phase_rad += 0.7;
        if (auto* constant = std::get_if<ConstantTerm>(&term)) constant->value *= 1.01;
      }
    }
    const auto run = [&](const Prepared& prepared, const Motion& along) {
      return RunClosedForm(prepared.mechanisms.analytic, along,
                           prepared.closed_form.closed_form.get());
    };
    (void)run(*used, other);
    const ClosedFormRun again = run(*used, motion), anew = run(*fresh, motion);
    EXPECT_EQ(again.summary.message, anew.summary.message) << file;
    EXPECT_EQ(Bits(again.trace.values.reshaped()), Bits(anew.trace.values.reshaped())) << file;
    ++served;
  }
  EXPECT_GT(served, 20);
}

// A study of poses, which keeps what it prepared; far beyond the reach of the limbs some of them.
Study PlatformPoses(const std::vector<std::string>& witnesses) {
  Study study;
  study.name = "poses";
  study.scenario = "scenarios/stabilizing_platform/random.yaml";
  const auto vary = [&](const std::string& key, double lower, double upper) {
    study.factors.push_back(
        {.name = key, .key = "motion.commands." + key, .axis = {lower, Uniform{lower, upper}}});
  };
  vary("roll.sine.phase_deg", 0.0, 360.0);
  vary("pitch.sine.amplitude_deg", 1.0, 30.0);
  vary("heave.sine.period_s", 2.0, 9.0);
  study.design = {.kind = DesignKind::kSobol, .count = 64};
  study.witnesses = witnesses;
  study.quantities = {{.name = "limb1.drive.force.max", .channel = "limb1.drive.force"},
                      {.name = "limb2.drive_p.force.end",
                       .channel = "limb2.drive_p.force",
                       .statistic = Statistic::kEnd}};
  if (witnesses.size() > 1)
    study.quantities.push_back({.name = "force_nrmse", .channel = {}, .of_pair = true});
  study.limits = {{.quantity = 0, .below = 1e6, .above = {}}};
  return study;
}

TEST_F(ScenarioMemoryTest, KeptPointsAreThoseOfTheirCommands) {
  const ParsedDocuments documents;
  for (const std::vector<std::string>& witnesses :
       {std::vector<std::string>{"analytic"}, {"reference"}, {"analytic", "reference"}}) {
    const Study study = PlatformPoses(witnesses);
    Diagnostics diagnostics;
    int exit_code = 0;
    const auto bench = StudyBench::Make(study, &diagnostics, &exit_code);
    ASSERT_TRUE(bench) << diagnostics.Text();
    ASSERT_TRUE(bench->keeps());
    int failed = 0;
    for (std::uint64_t k = 0; k < 64; ++k) {
      const PointRow row = bench->Run((k * 37) % 64).row;
      std::vector<SetValue> set;
      for (size_t f = 0; f < row.varied.size(); ++f) {
        set.emplace_back(study.factors[f].key, fmt::format("{:.17g}", row.varied[f]));
      }
      Diagnostics found;
      const auto prepared = Prepare(study.scenario, {.set = set}, &found);
      ASSERT_TRUE(prepared);
      const StudyRun run = RunStudyWitnesses(*prepared, study.witnesses);
      if (!run.failure.empty()) {
        EXPECT_EQ(row.reason, run.failure) << k;
        ++failed;
        continue;
      }
      EXPECT_EQ(row.reason, UnresolvedBySamples(run)) << k;
      if (!row.reason.empty()) continue;
      EXPECT_EQ(Bits(row.values), Bits(MeasureQuantities(run, study.quantities).values)) << k;
    }
    EXPECT_GT(failed, 3);
    EXPECT_LT(failed, 60);
  }
}

TEST_F(ScenarioMemoryTest, PointsOfOtherMachinesAreNotKept) {
  const ParsedDocuments documents;
  Study study = PlatformPoses({"analytic"});
  study.factors[0].key = "parameters.m_p";
  study.factors[0].axis = {50000.0, Uniform{49000.0, 51000.0}};
  Diagnostics diagnostics;
  int exit_code = 0;
  const auto bench = StudyBench::Make(study, &diagnostics, &exit_code);
  ASSERT_TRUE(bench) << diagnostics.Text();
  EXPECT_FALSE(bench->keeps());
}

}  // namespace
}  // namespace mbv
