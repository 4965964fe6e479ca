// A table in the reference's place, through all stages.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "features/run/run_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

std::string TableScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

std::string ResultText(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

RunOptions WithoutPictures(std::vector<SetValue> set = {}, const std::string& out = "") {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  options.out_dir = out;
  return options;
}

TEST(TableRun, WithoutClosedFormTheSolverTakesPartUnderItsOwnName) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_adams"), WithoutPictures());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.report->driven_by, "solver");
  for (const char* pair :
       {"simulated_vs_solver", "reference_vs_solver", "simulated_vs_reference"}) {
    const PairComparison* found = outcome.report->comparison.FindPair(pair);
    ASSERT_NE(found, nullptr) << pair;
    EXPECT_TRUE(found->compared) << pair;
  }
}

TEST(TableRun, WithAClosedFormTheTableIsJudgedByIt) {
  const RunOutcome outcome = RunScenario(TableScenario("spr_tripod/table"),
                                         WithoutPictures({{"analytic", "{model: full}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_EQ(outcome.report->driven_by, "analytic");
  ASSERT_TRUE(outcome.report->comparison.table);
  EXPECT_EQ(outcome.report->comparison.table->judged_against, "analytic");
  // The table is this closed form's, rounded: half a unit of the last of five digits.
  const PairComparison* pair = outcome.report->comparison.FindPair("reference_vs_analytic");
  ASSERT_NE(pair, nullptr);
  for (const TableColumnResult& column : pair->columns) EXPECT_LE(column.error_max, 5.01e-3);
  EXPECT_EQ(outcome.report->comparison.FindPair("simulated_vs_solver"), nullptr);
}

TEST(TableRun, AParameterThatIsOnePercentOffIsSeenThroughTheTable) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_matlab"),
                                         WithoutPictures({{"parameters", "{rho: 2.02}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "reference");
  const std::vector<std::string>& diagnoses = outcome.report->comparison.table->diagnoses;
  ASSERT_FALSE(diagnoses.empty());
  EXPECT_NE(diagnoses[0].find("0.990"), std::string::npos) << diagnoses[0];  // 1/1.01
}

TEST(TableRun, ATableOutsideTheMotionIsNotRunAndSaysSo) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_adams"),
                                         WithoutPictures({{"reference.time_offset_s", "100"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 3);
  bool said = false;
  for (const WitnessRecord& witness : outcome.report->witnesses) {
    said = said || witness.summary.message.find("no row of adams.tab lies inside the motion") !=
                       std::string::npos;
  }
  EXPECT_TRUE(said);
}

TEST(TableRun, ATableOfAnotherMotionIsReportedToBe) {
  const RunOutcome outcome = RunScenario(
      TableScenario("four_bar/table_matlab"),
      WithoutPictures(
          {{"motion.commands.motor", "[\"pi/2\", {cycloid: {duration_s: 2, delta: pi}}]"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.report->comparison.attribution.text.find("does it belong to another motion?"),
            std::string::npos)
      << outcome.report->comparison.attribution.text;
}

TEST(TableRun, DurationAndSamplesFollowTheTableWhereTheyAreLeftOut) {
  const RunOutcome outcome =
      RunScenario(TableScenario("four_bar/table_noisy"),
                  WithoutPictures({{"motion",
                                    "{commands: {motor: [\"pi/2\", {cycloid: {duration_s: 2, "
                                    "delta: 2*pi}}]}}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_DOUBLE_EQ(outcome.report->duration_s, 2.0);
  EXPECT_DOUBLE_EQ(outcome.report->sample_s, 0.01);
}

TEST(TableRun, FilesHoldTheTableItsTubeAndItsGaps) {
  const auto out = std::filesystem::temp_directory_path() / "mbv_table_run";
  std::filesystem::remove_all(out);
  const RunOutcome outcome =
      RunScenario(TableScenario("four_bar/table_adams"), WithoutPictures({}, out.string()));
  ASSERT_EQ(outcome.exit_code, 0);
  const std::filesystem::path folder = outcome.folder;
  const auto json = nlohmann::json::parse(ResultText(folder / "summary.json"));
  const auto& table = json["reference_table"];
  EXPECT_EQ(table["name"], "adams.tab");
  EXPECT_EQ(table["judged_against"], "solver");
  ASSERT_EQ(table["columns"].size(), 2u);
  const auto& force = table["columns"][0];
  EXPECT_EQ(force["signal"], "motor.force");
  EXPECT_EQ(force["column"], "MOTION_1.TM");
  EXPECT_DOUBLE_EQ(force["factor"].get<double>(), -1e-3);  // N mm, turned round
  EXPECT_GT(force["uncertainty"]["digits"].get<double>(), 0.0);
  for (const char* pair : {"reference_vs_solver", "simulated_vs_reference"}) {
    const auto& judged = force["judged"][pair];
    EXPECT_TRUE(judged["inside"].get<bool>()) << pair;
    EXPECT_LE(judged["error_max"].get<double>(), judged["tube_max"].get<double>()) << pair;
  }
  bool widened = false;
  for (const auto& check : json["checks"]) widened = widened || check.contains("stated_limit");
  EXPECT_TRUE(widened);
  // Every second sample has a row: one number, one gap.
  std::istringstream csv(ResultText(folder / "traces.csv"));
  std::string head, first, second;
  std::getline(csv, head);
  std::getline(csv, first);
  std::getline(csv, second);
  ASSERT_NE(head.find("motor.force.reference"), std::string::npos) << head;
  EXPECT_EQ(first.find("nan"), std::string::npos) << first;
  EXPECT_NE(second.find("nan"), std::string::npos) << second;
  const std::string page = ResultText(folder / "report.html");
  for (const char* text : {"The table in the reference's place",
                           "Columns of adams.tab against "
                           "solver",
                           "motor.force: adams.tab − solver", "tube ±"}) {
    // Apostrophes are escaped.
    std::string wanted = text;
    if (const size_t at = wanted.find('\''); at != std::string::npos) wanted.resize(at);
    EXPECT_NE(page.find(wanted), std::string::npos) << text;
  }
  std::filesystem::remove_all(out);
}

// A smooth motion as encoders and planners print it: this many decimals of a degree or a
// millimetre.
struct Printed {
  const char* scenario;
  std::vector<std::pair<const char*, const char*>> commands;  // name, and what is added
  const char* unit;
  double amplitude, period_s;
  const char* simulation;
};

// motion: of the tables, which it writes.
std::string PrintedMotion(const Printed& printed, int decimals, double row_s, bool rates,
                          bool smooth) {
  const auto folder = std::filesystem::temp_directory_path() / "mbv_printed";
  std::filesystem::create_directories(folder);
  const std::string file = (folder / "motion.csv").string(), unit = printed.unit;
  const double w = 2.0 * std::numbers::pi / printed.period_s, duration_s = 2.0;
  std::ofstream csv(file);
  csv << "t (s)";
  for (size_t c = 0; c < printed.commands.size(); ++c) {
    csv << fmt::format(",p{0} ({1}),v{0} ({1}/s)", c, unit);
  }
  for (int i = 0; i <= std::lround(duration_s / row_s); ++i) {
    csv << fmt::format("\n{:.3f}", i * row_s);
    for (size_t c = 0; c < printed.commands.size(); ++c) {
      const double phase = 0.9 * static_cast<double>(c), x = w * i * row_s + phase;
      csv << fmt::format(",{:.{}f},{:.{}f}", printed.amplitude * (std::sin(x) - std::sin(phase)),
                         decimals, printed.amplitude * w * std::cos(x), decimals);
    }
  }
  std::string motion = fmt::format("{{duration_s: {}, sample_s: 0.01, commands: {{", duration_s);
  for (size_t c = 0; c < printed.commands.size(); ++c) {
    motion += fmt::format("{}{}: [{}, {{table: {{csv: \"{}\", column: \"p{} ({})\"{}{}}}}}]",
                          c == 0 ? "" : ", ", printed.commands[c].first, printed.commands[c].second,
                          file, c, unit,
                          rates ? fmt::format(", rate: {{column: \"v{} ({}/s)\"}}", c, unit) : "",
                          smooth ? ", smoothing: auto" : "");
  }
  return motion + "}}";
}

TEST(TableRun, RoundedTrajectoriesOfRightModelsAgreeAndThoseOfWrongOnesDoNot) {
  const Printed all[] = {
      {"four_bar/turn", {{"motor", "home"}}, "deg", 40.0, 0.9, "{mode: forward}"},
      {"slider_crank/turn", {{"motor", "home"}}, "deg", 60.0, 0.7, "{mode: inverse}"},
      {"spr_tripod/random",
       {{"platform.x", "home"}, {"platform.y", "home"}, {"platform.z", "home"}},
       "mm",
       30.0,
       1.1,
       "{mode: inverse}"}};
  for (const Printed& printed : all) {
    for (const int decimals : {3, 5}) {
      for (const double row_s : {0.002, 0.01}) {
        for (const int kind : {0, 1, 2}) {  // positions, with rates, smoothed
          const auto run = [&](std::vector<SetValue> set) {
            set.emplace_back("motion",
                             PrintedMotion(printed, decimals, row_s, kind == 1, kind == 2));
            return RunScenario(TableScenario(printed.scenario), WithoutPictures(std::move(set)));
          };
          const std::string what =
              fmt::format("{} {} {} {}", printed.scenario, decimals, row_s, kind);
          const RunOutcome right = run({{"simulation", printed.simulation}});
          ASSERT_TRUE(right.report) << what << right.diagnostics.Text();
          EXPECT_EQ(right.exit_code, 0)
              << what << ": " << right.report->comparison.attribution.text;
        }
      }
    }
  }
  // One percent of a mass, and a centre of mass on the other side.
  const auto wrong = [&](const Printed& printed, const std::string& parameters) {
    return RunScenario(
        TableScenario(printed.scenario),
        WithoutPictures(
            {{"motion", PrintedMotion(printed, 3, 0.01, false, false)},
             {"simulation", fmt::format("{{mode: inverse, parameters: {{{}}}}}", parameters)}}));
  };
  EXPECT_EQ(wrong(all[0], "rho: 2.02").exit_code, 1);
  EXPECT_EQ(wrong(all[2], "m_platform: 30.3").exit_code, 1);
  EXPECT_EQ(wrong(all[2], "c_platform_z: -0.05").exit_code, 1);
}

TEST(TableRun, StepsResolveATableAndAStatedOneThatDoesNotIsWarnedOf) {
  const Printed printed{"four_bar/turn", {{"motor", "home"}}, "deg", 40.0, 0.9, ""};
  const auto run = [&](int decimals, double row_s, const char* simulation) {
    return RunScenario(
        TableScenario(printed.scenario),
        WithoutPictures({{"motion", PrintedMotion(printed, decimals, row_s, false, false)},
                         {"simulation", simulation}}));
  };
  const RunOutcome fine = run(4, 0.002, "{mode: forward}");
  ASSERT_TRUE(fine.report);
  EXPECT_LT(fine.report->step_s, 5e-4);
  EXPECT_EQ(fine.exit_code, 0);
  const RunOutcome smooth = run(6, 0.01, "{mode: forward}");
  ASSERT_TRUE(smooth.report);
  EXPECT_EQ(smooth.report->step_s, 1e-3);
  const std::string found = run(4, 0.002, "{mode: forward, step_s: 0.001}").diagnostics.Text();
  EXPECT_NE(found.find("simulation.step_s = 0.001 s does not resolve motion.csv"),
            std::string::npos)
      << found;
  EXPECT_EQ(run(6, 0.01, "{mode: forward, step_s: 0.001}").diagnostics.Text().find("resolve"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
