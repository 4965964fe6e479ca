// Points computed in memory give what loading everything anew with `--set` gives, to the last bit.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <random>
#include <set>
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

// What `make` gives where nothing was loaded before: a thread of its own keeps no documents.
auto Anew(const auto& make) { return std::async(std::launch::async, make).get(); }

std::string TextOf(const Shape& shape) {
  struct Text {
    std::string operator()(const Capsule& at) const {
      return Bits(at.p_from) + Bits(at.p_to) + Bits(std::vector{at.radius});
    }
    std::string operator()(const Cylinder& at) const {
      return Bits(at.p_from) + Bits(at.p_to) + Bits(std::vector{at.radius});
    }
    std::string operator()(const Box& at) const {
      return Bits(at.X_BG.matrix().reshaped()) + Bits(at.size);
    }
    std::string operator()(const Ball& at) const {
      return Bits(at.p_centre) + Bits(std::vector{at.radius});
    }
    std::string operator()(const Mesh& at) const {
      return at.file + Bits(at.X_BG.matrix().reshaped()) + Bits(at.scale);
    }
  };
  return shape.color + std::visit(Text(), shape.geometry);
}

// All that a witness reads of it, and what pictures show.
std::string TextOf(const ScenarioResult& loaded) {
  std::string text = loaded.diagnostics.Text();
  for (const Finding& finding : loaded.diagnostics.findings()) {
    text += finding.set.first + "=" + finding.set.second + "\n";
  }
  if (!loaded.scenario) return text;
  const Mechanism& mechanism = *loaded.mechanism;
  text += MechanismJson(mechanism);
  for (const Pose& X : mechanism.X_WB_home) text += Bits(X.matrix().reshaped());
  for (const Body& body : mechanism.bodies) {
    for (const NamedFrame& frame : body.frames) {
      text += frame.name + Bits(frame.X_BF.matrix().reshaped());
    }
    for (const Shape& shape : body.shapes) text += TextOf(shape);
  }
  for (const Parameter& parameter : mechanism.parameters) {
    text += fmt::format("{}={:a} {} {} {} {}\n", parameter.name, parameter.value, parameter.unit,
                        static_cast<int>(parameter.source), parameter.note, parameter.written_out);
  }
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
      const ScenarioResult anew = Anew([&] { return LoadScenario(file, {.set = set}); });
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
      const auto prepared = Anew([&] { return Prepare(study.scenario, {.set = set}, &found); });
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

// What commands and loads are at some times.
std::string BitsOfProfiles(const Motion& motion) {
  std::string text;
  const auto add = [&](const Profile& profile) {
    for (const double share : {0.0, 0.31, 1.0}) {
      const Jet jet = Evaluate(profile, share * motion.duration_s);
      text += Bits(std::vector{jet.value, jet.rate, jet.acceleration});
    }
  };
  for (const Command& command : motion.commands) add(command.profile);
  for (const Load& load : motion.loads) {
    for (const Profile& component : load.force) add(component);
    for (const Profile& component : load.moment) add(component);
  }
  return text;
}

TEST_F(ScenarioMemoryTest, NumbersOfMotionsAreThoseThatLoadingGives) {
  const ParsedDocuments documents;
  std::mt19937_64 random(20261129);
  int found = 0, of_loads = 0;
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
      const bool of_load = key.starts_with("loads.");
      if (!of_load && !key.starts_with("motion.commands.")) continue;
      const double value = std::uniform_real_distribution(0.97, 1.03)(random) *
                           *PlainNumber(FindSetNode(*root, key)->text);
      const std::vector<SetValue> set = {{key, fmt::format("{:.17g}", value)}};
      const ScenarioResult loaded = LoadScenario(file, {.set = set}, &memory);
      if (!loaded.scenario) continue;
      Motion motion = nominal.scenario->motion;
      const auto number = memory.FindMotionNumber(key, loaded.scenario->motion);
      if (!number) continue;
      ASSERT_TRUE(number->Put(value, &motion)) << file << ' ' << key;
      EXPECT_EQ(BitsOfProfiles(motion), BitsOfProfiles(loaded.scenario->motion))
          << file << ' ' << key;
      // Another number is seen.
      ASSERT_TRUE(number->Put(1.001 * value + 1e-3, &motion));
      EXPECT_NE(BitsOfProfiles(motion), BitsOfProfiles(loaded.scenario->motion))
          << file << ' ' << key;
      ++(of_load ? of_loads : found);
    }
  }
  EXPECT_GT(found, 200);
  EXPECT_GT(of_loads, 20);
}

TEST_F(ScenarioMemoryTest, NumbersThatTheReaderRefusesAreNotPut) {
  Motion motion;
  motion.commands.push_back({.name = "a", .profile = {{SineTerm{1.0, 2.0, 0.5}}}});
  MotionNumber number{.field = MotionNumber::Field::kPeriod, .to_si = kPlain.to_si};
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
    for (Load& load : other.loads) {
      for (Profile& component : load.force) component.terms.push_back(ConstantTerm{3.0});
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
      const auto prepared = Anew([&] { return Prepare(study.scenario, {.set = set}, &found); });
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

// A number that is varied, by the reference alone where nothing else is said.
struct Varied {
  const char* what;
  const char* scenario;
  const char* key;
  double least, most;
  const char* quantity;
  std::vector<std::string> witnesses = {"reference"};
  bool fails = false;  // at some of the values
};

const std::vector<Varied> kVaried = {
    {"a parameter of expressions", "stabilizing_platform/random", "parameters.r_a", 7.49, 7.51,
     "limb1.drive.force.max"},
    {"a mass", "stabilizing_platform/random", "parameters.m_1", 1600.0, 1800.0,
     "limb1.drive.force.max"},
    {"an inertia", "spr_tripod/random", "parameters.I_platform_zz", 0.5, 0.54, "leg1.force.max"},
    {"a placement", "spr_tripod/random", "parameters.c_platform_x", -0.01, 0.01, "leg1.force.max"},
    {"gravity in the model", "spr_tripod/random", "parameters.g", 9.7, 9.9, "leg1.force.max"},
    {"a friction number", "friction_five_bar/draw_inverse", "parameters.dry", 0.15, 0.25,
     "motor1.force.max"},
    {"a load",
     "cabin_robot/wrench",
     "loads.tool.moment.1",
     -9.0,
     9.0,
     "th4.force.max",
     {"analytic", "reference"}},
    {"a sine of a load", "scara_robot/tool_load", "loads.cutting.force.0.sine.period_s", 0.4, 0.6,
     "limb1.drive.force.max"},
    {"a number of one witness", "spr_tripod/random", "reference.parameters.m_platform", 29.0, 31.0,
     "leg1.force.max"},
    {"a tolerance",
     "stabilizing_platform/random",
     "checks.reference_force_nrmse",
     1e-17,
     4e-15,
     "force_nrmse",
     {"analytic", "reference"}},
    {"a mass that becomes negative",
     "spr_tripod/random",
     "parameters.m_rod",
     -4.0,
     4.0,
     "leg1.force.max",
     {"reference"},
     true},
    {"a pose out of reach",
     "stabilizing_platform/random",
     "parameters.L3",
     0.2,
     2.26,
     "limb1.drive.force.max",
     {"reference"},
     true},
    {"loops that do not close",
     "four_bar/static",
     "parameters.coupler",
     0.35,
     1.5,
     "motor.force.max",
     {"reference"},
     true},
};

// As a study computes it again and again, and as `mbverify run --set` does.
TEST_F(ScenarioMemoryTest, AnyKindOfNumberGivesWhatItsCommandGives) {
  const ParsedDocuments documents;
  for (const Varied& varied : kVaried) {
    SCOPED_TRACE(varied.what);
    Study study;
    study.name = "one";
    study.scenario = fmt::format("scenarios/{}.yaml", varied.scenario);
    study.factors = {{.name = varied.key,
                      .key = varied.key,
                      .axis = {varied.most, Uniform{varied.least, varied.most}}}};
    study.design = {.kind = DesignKind::kSobol, .count = 16};
    study.witnesses = varied.witnesses;
    const std::string quantity = varied.quantity;
    const bool check = FindMetric(quantity) != nullptr;
    study.quantities = {{.name = quantity,
                         .channel = check ? "" : quantity.substr(0, quantity.rfind('.')),
                         .of_pair = check}};
    Diagnostics diagnostics;
    int exit_code = 0;
    const auto bench = StudyBench::Make(study, &diagnostics, &exit_code);
    ASSERT_TRUE(bench) << diagnostics.Text();
    EXPECT_EQ(bench->keeps(), study.factors[0].key.starts_with("loads."));
    std::set<std::string> values;
    int refused = 0;
    for (std::uint64_t k = 0; k < 16; ++k) {
      const PointRow row = bench->Run((k * 5) % 16).row;
      std::vector<SetValue> set = {{varied.key, fmt::format("{:.17g}", row.varied[0])}};
      // The reference alone has no closed form made.
      if (varied.witnesses.size() == 1) set.emplace_back("analytic", "off");
      Diagnostics found;
      const auto prepared = Anew([&] { return Prepare(study.scenario, {.set = set}, &found); });
      if (!prepared) {
        const auto error =
            std::ranges::find(found.findings(), Severity::kError, &Finding::severity);
        EXPECT_EQ(row.exit_code, 2) << row.varied[0];
        EXPECT_EQ(row.reason, error->message) << row.varied[0];
        ++refused;
        continue;
      }
      const StudyRun run = RunStudyWitnesses(*prepared, study.witnesses);
      if (!run.failure.empty()) {
        EXPECT_EQ(row.reason, run.failure) << row.varied[0];
        ++refused;
        continue;
      }
      const StudyMeasures measured = MeasureQuantities(run, study.quantities);
      EXPECT_EQ(Bits(row.values), Bits(measured.values)) << row.varied[0];
      EXPECT_EQ(row.exit_code, measured.verdict == Verdict::kDisagree ? 1 : 0) << row.varied[0];
      values.insert(fmt::format("{} {}", Bits(row.values), row.exit_code));
    }
    EXPECT_GT(values.size(), 1U) << "nothing depends on it";
    EXPECT_EQ(refused > 0, varied.fails);
  }
}

// The last bit of each number counts: what was read of another one is not taken again.
TEST_F(ScenarioMemoryTest, TheNextNumberIsAnotherOne) {
  const ParsedDocuments documents;
  const std::string file = "scenarios/stabilizing_platform/random.yaml";
  ScenarioMemory memory;
  const ScenarioResult nominal = LoadScenario(file, {}, &memory);
  ASSERT_TRUE(nominal.mechanism);
  int moved = 0;
  for (const Parameter& parameter : nominal.mechanism->parameters) {
    if (!parameter.written_out || parameter.value == 0.0) continue;
    const double next = std::nextafter(parameter.value, HUGE_VAL);
    const std::vector<SetValue> set = {
        {"parameters." + parameter.name, fmt::format("{:.17g}", next)}};
    const std::string again = TextOf(LoadScenario(file, {.set = set}, &memory));
    ASSERT_EQ(again, TextOf(Anew([&] { return LoadScenario(file, {.set = set}); })))
        << parameter.name;
    moved += again != TextOf(nominal) ? 1 : 0;
    ASSERT_EQ(TextOf(LoadScenario(file, {}, &memory)), TextOf(nominal)) << parameter.name;
  }
  EXPECT_GT(moved, 20);
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
