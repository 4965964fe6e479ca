// mbverify study as a user types it: the same bytes for any number of jobs, shards and kills;
// limits end in exit codes; nothing of anybody's is lost.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <set>

#include "tests/cli/program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// A mass on a slide: holding it against gravity takes m g; the study varies m.
class StudyCommand : public testing::Test {
 protected:
  StudyCommand() {
    Write("model.yaml",
          "name: lift\nparameters: {m: {value: 2, unit: kg}, g: {value: 10, unit: m/s^2}}\n"
          "gravity: [0, 0, -g]\nbodies: {cart: {mass: m, inertia: [1, 1, 1]}}\n"
          "joints: {slide: {kind: prismatic, parent: world, child: cart, axis: z}}\n"
          "drives: {x: {kind: joint, joint: slide}}\n");
    Write("hold.yaml",
          "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
          "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse}\n");
  }
  // A study of mass and gravity with this design and what follows it.
  void WriteStudy(const std::string& design, const std::string& more = "") const {
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\n"
          "vary: {m: {uniform: {min: 1, max: 3}}, g: {uniform: {min: 9, max: 11}}}\n"
          "design: " +
              design + "\nquantities: [x.force.mean, closure_m]\n" + more);
  }
  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(mbverify.folder() / name, std::ios::binary) << text;
  }
  [[nodiscard]] std::string File(const std::string& name) const {
    return (mbverify.folder() / name).string();
  }
  [[nodiscard]] ProgramResult Study(const std::string& out, const std::string& more = "") const {
    return mbverify("study " + File("s.yaml") + " --out " + File(out) + " " + more);
  }
  [[nodiscard]] std::string Points(const std::string& out) const {
    return ReadAll(File(out + "/s/points.csv"));
  }
  [[nodiscard]] nlohmann::json Summary(const std::string& out) const {
    return nlohmann::json::parse(ReadAll(File(out + "/s/summary.json")));
  }
  // Of the reference's column, summed as the study does.
  static double MeanForce(const std::string& traces) {
    std::istringstream lines(traces);
    std::string line;
    std::getline(lines, line);
    std::vector<std::string> names;
    std::istringstream heads(line);
    for (std::string name; std::getline(heads, name, ',');) names.push_back(name);
    const auto column = std::find(names.begin(), names.end(), "x.force.reference");
    EXPECT_NE(column, names.end()) << line;
    std::vector<double> values;
    while (std::getline(lines, line)) {
      std::istringstream cells(line);
      std::string cell;
      for (auto at = names.begin(); at <= column; ++at) std::getline(cells, cell, ',');
      values.push_back(std::stod(cell));
    }
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
  }
  Program mbverify{std::string("study_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(StudyCommand, RowsAreTheSameForAnyNumberOfJobsAndShards) {
  WriteStudy("{sobol: 16}");
  ASSERT_EQ(Study("one", "--jobs 1").exit_code, 0);
  ASSERT_EQ(Study("three", "--jobs 3").exit_code, 0);
  const std::string rows = Points("one");
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 17);
  EXPECT_EQ(Points("three"), rows);
  EXPECT_EQ(ReadAll(File("three/s/summary.json")), ReadAll(File("one/s/summary.json")));
  EXPECT_EQ(ReadAll(File("three/s/report.html")), ReadAll(File("one/s/report.html")));
  std::string folders;
  for (const char* shard : {"3", "1", "2"}) {
    ASSERT_EQ(Study("parts", std::string("--shard ") + shard + "/3").exit_code, 0);
    folders += " " + File(std::string("parts/s.shard-") + shard + "-of-3");
  }
  EXPECT_FALSE(fs::exists(File("parts/s.shard-1-of-3/summary.json")));
  const ProgramResult merged = mbverify("study merge" + folders + " -o " + File("merged"));
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  for (const char* name : {"points.csv", "forces.bin", "summary.json", "report.html"}) {
    EXPECT_EQ(ReadAll(File(std::string("merged/s/") + name)),
              ReadAll(File(std::string("one/s/") + name)))
        << name;
  }
  const std::string two = folders.substr(0, folders.rfind(' '));
  const ProgramResult partly = mbverify("study merge" + two + " -o " + File("partly"));
  EXPECT_EQ(partly.exit_code, 2);
  EXPECT_NE(partly.err.find("shard 2/3 is missing"), std::string::npos) << partly.err;
  EXPECT_FALSE(fs::exists(File("partly/s")));
}

// Rows that could be read but are not those that were computed: one digit, or one force.
TEST_F(StudyCommand, AShardThatSomebodyTouchedIsNotMergedButComputedAgain) {
  WriteStudy("{sobol: 8}");
  for (const char* shard : {"1/2", "2/2"}) {
    ASSERT_EQ(Study("parts", std::string("--shard ") + shard).exit_code, 0);
  }
  const std::string touched = "parts/s.shard-2-of-2";
  const std::string merge =
      "study merge " + File("parts/s.shard-1-of-2") + " " + File(touched) + " -o " + File("merged");
  for (const char* name : {"points.csv", "forces.bin"}) {
    std::string bytes = ReadAll(File(touched + "/" + name));
    char& last = bytes[bytes.size() - 2];
    last = last == '1' ? '2' : '1';
    Write(touched + "/" + name, bytes);
    const ProgramResult refused = mbverify(merge);
    EXPECT_EQ(refused.exit_code, 2) << name;
    EXPECT_NE(refused.err.find("not as they were written"), std::string::npos) << refused.err;
    EXPECT_FALSE(fs::exists(File("merged/s"))) << name;
    ASSERT_EQ(Study("parts", "--shard 2/2 --resume").exit_code, 0);
    EXPECT_NE(ReadAll(File(touched + "/" + name)), bytes);
    EXPECT_EQ(mbverify(merge).exit_code, 0) << name;
    fs::remove_all(File("merged"));
  }
}

// What a kill leaves: whole rows, perhaps forces of one more, and a line without its end.
TEST_F(StudyCommand, GoesOnWithWhatAKillLeft) {
  WriteStudy("{sobol: 16}");
  ASSERT_EQ(Study("whole").exit_code, 0);
  const std::string rows = Points("whole"), forces = ReadAll(File("whole/s/forces.bin"));
  size_t cut = 0;
  for (int line = 0; line < 6; ++line) cut = rows.find('\n', cut) + 1;
  const size_t record = forces.size() / 16;
  fs::create_directories(File("killed/s.part"));
  fs::copy_file(File("whole/s/study.json"), File("killed/s.part/study.json"));
  Write("killed/s.part/points.csv", rows.substr(0, cut + 7));
  Write("killed/s.part/forces.bin", forces.substr(0, 6 * record));
  const ProgramResult refused = Study("killed");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("--resume goes on with them"), std::string::npos) << refused.err;
  EXPECT_EQ(ReadAll(File("killed/s.part/points.csv")), rows.substr(0, cut + 7));
  ASSERT_EQ(Study("killed", "--resume").exit_code, 0);
  EXPECT_EQ(Points("killed"), rows);
  EXPECT_EQ(ReadAll(File("killed/s/forces.bin")), forces);
  EXPECT_FALSE(fs::exists(File("killed/s.part")));
  // What is finished is told again; what is damaged is computed again.
  const auto written = fs::last_write_time(File("killed/s/points.csv"));
  const ProgramResult again = Study("killed", "--resume");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_NE(again.out.find("16 points by sobol"), std::string::npos) << again.out;
  EXPECT_EQ(fs::last_write_time(File("killed/s/points.csv")), written);
  Write("killed/s/points.csv", rows.substr(0, cut));
  EXPECT_EQ(Study("killed", "--resume").exit_code, 0);
  EXPECT_EQ(Points("killed"), rows);
}

// What somebody else killed (a machine without memory, say) is computed once more.
TEST_F(StudyCommand, AWorkerThatIsKilledCostsNoPoint) {
  WriteStudy("{latin_hypercube: 8192}");
  const ProgramResult killed = mbverify.Script(
      "\"$mbverify\" study " + File("s.yaml") + " --out " + File("killed") +
      " --jobs 2 >/dev/null 2>&1 & pid=$!; rows=" + File("killed/s.part/points.csv") +
      "; until [ \"$(cat \"$rows\" 2>/dev/null | wc -l)\" -gt 100 ]; do sleep 0.01; done; "
      "kill -KILL $(cut -d ' ' -f 1 /proc/$pid/task/$pid/children) && wait $pid");
  ASSERT_EQ(killed.exit_code, 0) << killed.out << killed.err;
  ASSERT_EQ(Study("whole").exit_code, 0);
  EXPECT_TRUE(Points("killed") == Points("whole"));
}

TEST_F(StudyCommand, DoesNotMixRowsOfChangedFiles) {
  WriteStudy("{sobol: 8}");
  ASSERT_EQ(Study("a").exit_code, 0);
  fs::create_directories(File("b/s.part"));
  for (const char* name : {"study.json", "points.csv", "forces.bin"}) {
    fs::copy_file(File(std::string("a/s/") + name), File(std::string("b/s.part/") + name));
  }
  const std::string model = ReadAll(File("model.yaml"));
  Write("model.yaml", model + "# changed\n");
  const ProgramResult result = Study("b", "--resume");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("files that have changed since"), std::string::npos) << result.err;
  const ProgramResult merged = mbverify("study merge " + File("a/s") + " -o " + File("c"));
  EXPECT_EQ(merged.exit_code, 2);
  EXPECT_NE(merged.err.find("has changed since"), std::string::npos) << merged.err;
}

TEST_F(StudyCommand, LeavesFoldersOfOthersAlone) {
  WriteStudy("{sobol: 8}");
  fs::create_directories(File("out/s.part"));
  Write("out/s.part/notes.txt", "mine");
  const ProgramResult result = Study("out");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("is a folder of something else"), std::string::npos) << result.err;
  EXPECT_EQ(ReadAll(File("out/s.part/notes.txt")), "mine");
  Write("file", "mine");
  EXPECT_EQ(Study("file").exit_code, 2);
  EXPECT_EQ(ReadAll(File("file")), "mine");
}

// The force is m (g + a): at m = 3, g = 11 it is largest; a point's value is exact.
TEST_F(StudyCommand, ValuesAreThoseOfTheScenarioWithTheNumbersSet) {
  WriteStudy("{one_at_a_time: true}");
  const ProgramResult result = Study("out", "--json " + File("study.json"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = Summary("out");
  EXPECT_EQ(json, nlohmann::json::parse(ReadAll(File("study.json"))));
  const auto& force = json["quantities"][0];
  const double nominal = force["nominal"];
  EXPECT_EQ(json["points"], 5);
  EXPECT_EQ(force["one_at_a_time"][0]["varied"], "m");  // the wider swing comes first
  EXPECT_NEAR(force["one_at_a_time"][0]["most"].get<double>(), 1.5 * nominal, 1e-12 * nominal);
  EXPECT_NEAR(force["one_at_a_time"][1]["least"].get<double>(), nominal - 2.0, 1e-12 * nominal);
  // The command that is told gives that value, to the last bit.
  const std::string command = force["worst"][0]["command"];
  ASSERT_TRUE(command.starts_with("mbverify run ")) << command;
  const ProgramResult run = mbverify(command.substr(9) + " --out " + File("run"));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const double value = force["worst"][0]["value"];
  EXPECT_NEAR(MeanForce(ReadAll(File("run/lift/hold/traces.csv"))), value, 1e-15 * value);
}

TEST_F(StudyCommand, ALimitThatTooManyPointsViolateEndsWithOne) {
  const std::string limit = "limits: {x.force.mean: {below: 25, share: ";
  WriteStudy("{latin_hypercube: 40}", limit + "0.5}}\n");
  ASSERT_EQ(Study("wide").exit_code, 0);
  const auto kept = Summary("wide")["limits"][0];
  const int violations = kept["violations"];
  EXPECT_GT(violations, 0);
  EXPECT_LT(kept["interval"][0].get<double>(), violations / 40.0);
  EXPECT_GT(kept["interval"][1].get<double>(), violations / 40.0);
  // Exactly as many as there are may violate it; one fewer is too few.
  WriteStudy("{latin_hypercube: 40}", limit + std::to_string(violations / 40.0) + "}}\n");
  EXPECT_EQ(Study("just").exit_code, 0);
  WriteStudy("{latin_hypercube: 40}", limit + std::to_string((violations - 0.5) / 40.0) + "}}\n");
  const ProgramResult violated = Study("less");
  EXPECT_EQ(violated.exit_code, 1);
  EXPECT_NE(violated.out.find("VIOLATED x.force.mean < 25"), std::string::npos) << violated.out;
  EXPECT_NE(violated.out.find("mbverify run "), std::string::npos) << violated.out;
}

// The mean force is m (g + a), a < 0.1 m/s² from the motion's mean: of two uniform numbers with
// means M = 2 and G = 10 + a and variances v = 1/3 each, S_m = v G² / (v G² + v M² + v²).
TEST_F(StudyCommand, IndicesOfAProductAreThoseByHand) {
  WriteStudy("{saltelli: 128}");
  ASSERT_EQ(Study("out").exit_code, 0);
  const auto force = Summary("out")["quantities"][0];
  const double G = force["nominal"].get<double>() / 2.0, v = 1.0 / 3.0;
  const double variance = v * G * G + v * 4.0 + v * v;
  const auto indices = force["sobol"]["indices"];
  EXPECT_NEAR(force["sobol"]["variance"].get<double>(), variance, 0.05 * variance);
  EXPECT_NEAR(indices[0]["first"].get<double>(), v * G * G / variance, 0.02);
  EXPECT_NEAR(indices[1]["first"].get<double>(), v * 4.0 / variance, 0.02);
  EXPECT_NEAR(indices[1]["total"].get<double>(), (v * 4.0 + v * v) / variance, 0.02);
  EXPECT_LT(indices[0]["first_interval"][0], indices[0]["first"]);
}

// At every time the force is m (g + a(t)): its percentiles are those of m where m alone is varied.
// The second drive carries three times as much.
TEST_F(StudyCommand, BandsArePercentilesOfEachDriveAtEachTime) {
  Write("model.yaml",
        "name: lifts\nparameters: {m: {value: 2, unit: kg}}\ngravity: [0, 0, -10]\n"
        "bodies: {a: {mass: m, inertia: [1, 1, 1]}, b: {mass: 3*m, inertia: [1, 1, 1]}}\n"
        "joints:\n  p: {kind: prismatic, parent: world, child: a, axis: z}\n"
        "  q: {kind: prismatic, parent: world, child: b, axis: z}\n"
        "drives: {x: {kind: joint, joint: p}, y: {kind: joint, joint: q}}\n");
  Write("hold.yaml",
        "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
        "{amplitude: 0.1, period_s: 1}}, y: 0}}\nanalytic: none\nsimulation: off\n");
  Write("s.yaml",
        "study: s\nscenario: hold.yaml\nvary: {m: {uniform: {min: 1, max: 3}}}\n"
        "design: {sobol: 64}\nquantities: [x.force.mean]\n");
  const ProgramResult result = Study("out");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto bands = Summary("out")["force_bands"];
  ASSERT_EQ(bands.size(), 2u);
  EXPECT_EQ(bands[1]["drive"], "y");
  EXPECT_NEAR(bands[1]["nominal"][0].get<double>(), 60.0, 1e-5);
  for (const auto& band : bands) {
    ASSERT_EQ(band["points"], 64);
    ASSERT_EQ(band["time_s"].size(), 11u);
    for (size_t t = 0; t < 11; ++t) {
      const double nominal = band["nominal"][t];  // 2 kg
      EXPECT_NEAR(band["p5"][t].get<double>(), nominal * 0.55, 0.02 * nominal) << t;
      EXPECT_NEAR(band["p50"][t].get<double>(), nominal, 0.02 * nominal) << t;
      EXPECT_NEAR(band["p95"][t].get<double>(), nominal * 1.45, 0.02 * nominal) << t;
    }
  }
}

TEST_F(StudyCommand, PointsThatFailStayRowsWithTheirReason) {
  Write("list.csv", "m,g\n2,10\n-1,10\n2,11\n");
  Write("s.yaml",
        "study: s\nscenario: hold.yaml\nvary: {m: , g: }\ndesign: {list: list.csv}\n"
        "quantities: [x.force.mean]\nlimits: {x.force.mean: {below: 100}}\n");
  const ProgramResult result = Study("out");
  EXPECT_EQ(result.exit_code, 1) << result.out;  // a point without a value keeps no limit
  EXPECT_NE(Points("out").find("\n1,1,2,"), std::string::npos) << Points("out");
  const auto json = Summary("out");
  EXPECT_EQ(json["failures"]["points"], 1);
  EXPECT_EQ(json["limits"][0]["violations"], 1);
  EXPECT_EQ(json["force_bands"][0]["points"], 2);  // no NaN among what percentiles are taken of
  EXPECT_EQ(json["force_bands"][0]["left_out"], 1);
  EXPECT_NE(json["failures"]["reasons"][0]["reason"].get<std::string>().find("mass"),
            std::string::npos);
  Write("list.csv", "m,g\n-2,10\n");
  EXPECT_EQ(Study("none").exit_code, 3);
}

TEST_F(StudyCommand, NamesThatNobodyRecordsAreFoundBeforeAnythingIsComputed) {
  WriteStudy("{sobol: 8}");
  std::string text = ReadAll(File("s.yaml"));
  text.replace(text.find("x.force.mean"), 12, "y.force.mean");
  text.replace(text.find("closure_m"), 9, "force_nrmse");
  text.replace(text.find("{m:"), 3, "{motion.commands.y.sine.amplitude: {grid: [1]}, m:");
  Write("s.yaml", text);
  const ProgramResult result = Study("out");
  EXPECT_EQ(result.exit_code, 2);
  for (const char* part :
       {"s.yaml:3:8: error: vary.motion.commands.y.sine.amplitude", "did you mean 'x"}) {
    EXPECT_NE(result.err.find(part), std::string::npos) << part << " in\n" << result.err;
  }
  EXPECT_FALSE(fs::exists(File("out")));
  EXPECT_EQ(mbverify("check " + File("s.yaml")).exit_code, 2);
  WriteStudy("{sobol: 8}");
  EXPECT_EQ(mbverify("check " + File("s.yaml")).exit_code, 0);
}

TEST_F(StudyCommand, BadArgumentsAreRefused) {
  WriteStudy("{sobol: 8}");
  EXPECT_EQ(mbverify("study").exit_code, 2);
  EXPECT_EQ(Study("out", "--shard 3/2").exit_code, 2);
  EXPECT_EQ(Study("out", "--shard 9/9").exit_code, 2);  // nothing left for the ninth
  EXPECT_EQ(mbverify("study " + File("none.yaml")).exit_code, 2);
  EXPECT_EQ(mbverify("study merge " + File("nowhere")).exit_code, 2);
  EXPECT_EQ(mbverify("run " + File("s.yaml")).exit_code, 2);
}

// examples/cluster with stand-ins for what schedules: one call after the other. tests/cluster has
// the real ones.
TEST_F(StudyCommand, ClusterExamplesComputeAndMergeShards) {
  WriteStudy("{sobol: 8}");
  ASSERT_EQ(Study("one").exit_code, 0);
  Write("srun", "#!/bin/bash\nwhile [ \"$1\" != mbverify ]; do shift; done\nexec \"$@\"\n");
  Write("parallel",
        "#!/bin/bash\nwhile [ \"$1\" != mbverify ]; do shift; done\n"
        "while read -r k; do \"${@//\\{\\}/$k}\" || exit 1; done\n");
  const std::string start = "chmod +x '" + File("srun") + "' '" + File("parallel") +
                            "' && export PATH=\"" + mbverify.folder().string() +
                            ":$(dirname $mbverify):$PATH\" && here=$PWD && cd '" +
                            mbverify.folder().string() + "' && ";
  const ProgramResult array = mbverify.Script(
      start +
      "for k in 1 2; do SLURM_ARRAY_TASK_ID=$k SLURM_ARRAY_TASK_COUNT=2 SLURM_CPUS_PER_TASK=1 "
      "bash $here/examples/cluster/slurm-array.sh s.yaml || exit 1; done && "
      "mkdir slurm && mv shards slurm && bash $here/examples/cluster/slurm-merge.sh 2 slurm");
  EXPECT_EQ(array.exit_code, 0) << array.err;
  EXPECT_EQ(Points("slurm"), Points("one"));
  const ProgramResult parallel = mbverify.Script(
      start + "bash $here/examples/cluster/parallel.sh s.yaml 3 gnu --sshloginfile nodes");
  EXPECT_EQ(parallel.exit_code, 0) << parallel.err;
  EXPECT_EQ(Points("gnu"), Points("one"));
}

TEST_F(StudyCommand, OtherCountsAndSeedsAreOtherStudiesOfTheSameFile) {
  WriteStudy("{sobol: 8}");
  ASSERT_EQ(Study("a").exit_code, 0);
  ASSERT_EQ(Study("b", "--count 16").exit_code, 0);
  EXPECT_EQ(Points("b").substr(0, Points("a").size()), Points("a"));  // Sobol's go on
  EXPECT_EQ(Summary("b")["points"], 16);
  ASSERT_EQ(Study("c", "--seed 9").exit_code, 0);
  EXPECT_NE(Points("c"), Points("a"));
  // What is left of another seed's is not gone on with; shards join with the seed they were asked.
  for (const char* shard : {"1/2", "2/2"}) {
    ASSERT_EQ(Study("shards", std::string("--seed 9 --shard ") + shard).exit_code, 0);
  }
  const ProgramResult merged = mbverify("study merge " + File("shards/s.shard-1-of-2") + " " +
                                        File("shards/s.shard-2-of-2") + " -o " + File("d"));
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  EXPECT_EQ(Points("d"), Points("c"));
  const ProgramResult odd = Study("e", "--count 10");
  EXPECT_EQ(odd.exit_code, 2);
  EXPECT_NE(odd.err.find("10 is no power of two"), std::string::npos) << odd.err;
}

TEST_F(StudyCommand, PlotsAreFilesToo) {
  WriteStudy("{sobol: 16}");
  ASSERT_EQ(Study("out").exit_code, 0);
  const std::string page = ReadAll(File("out/s/report.html"));
  for (const char* name : {"histogram_x.force.mean", "band_x", "scatter_matrix"}) {
    const std::string svg = ReadAll(File(std::string("out/s/plots/") + name + ".svg"));
    EXPECT_EQ(svg.substr(0, 4), "<svg") << name;
    EXPECT_NE(page.find(svg.substr(svg.find('\n'), 200)), std::string::npos) << name;
  }
  const std::string scatter = ReadAll(File("out/s/plots/scatter_matrix.svg"));
  std::uint64_t dots = 0;
  for (size_t at = scatter.find("h0"); at != std::string::npos; at = scatter.find("h0", at + 1)) {
    ++dots;
  }
  EXPECT_EQ(dots, 16u * 4u);  // two numbers, two quantities
}

// The table is m g of a mass of 2 kg; a study of the same mass is within it, one of 2.1 kg is not.
TEST_F(StudyCommand, AMeasuredTableIsValidatedAgainstTheBand) {
  std::string table = "time,x.force\n";
  std::minstd_rand random(7);
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.001 * i, w = 2.0 * 3.14159265358979;
    const double force = 2.0 * (10.0 - 0.1 * w * w * std::sin(w * t));
    table += fmt::format("{},{:.9f}\n", t, force + 0.02 * (random() % 2001 / 1000.0 - 1.0));
  }
  Write("measured.csv", table);
  Write("hold.yaml",
        "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.001, commands: {x: {sine: "
        "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse}\n"
        "reference: {csv: measured.csv}\n");
  const auto with = [&](const std::string& mass) {
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\nvary: {m: {normal: {sigma: 0.002}}}\n"
          "design: {latin_hypercube: 200}\nwitnesses: [inverse]\nquantities: [x.force.mean]\n"
          "validation: {}\n");
    Write("model.yaml", std::regex_replace(ReadAll(File("model.yaml")),
                                           std::regex("m: .value: [0-9.]+"), "m: {value: " + mass));
    return Study("out" + mass);
  };
  const ProgramResult same = with("2.0");
  ASSERT_EQ(same.exit_code, 0) << same.out << same.err;
  const nlohmann::json drive = Summary("out2.0")["validation"]["drives"][0];
  const double noise = 0.02 / std::sqrt(3.0);
  EXPECT_NEAR(drive["error_rms"].get<double>(), noise, 0.15 * noise);
  EXPECT_NEAR(drive["u_data"].get<double>(), noise, 0.3 * noise);  // as estimated
  const double input = 0.001 * drive["measured_rms"].get<double>();
  EXPECT_NEAR(drive["u_input"].get<double>(), input, 0.02 * input);
  EXPECT_EQ(drive["u_num"], 0.0);
  EXPECT_EQ(drive["largest"], "u_input");
  const ProgramResult heavier = with("2.1");
  EXPECT_EQ(heavier.exit_code, 1) << heavier.out << heavier.err;
  EXPECT_NE(heavier.out.find("BEYOND   x"), std::string::npos) << heavier.out;
  EXPECT_NE(ReadAll(File("out2.1/s/report.html")).find("Not validated"), std::string::npos);
}

// In forward mode the step's error is what converge extrapolates.
TEST_F(StudyCommand, AForwardStudyTakesUNumFromConvergence) {
  const ProgramResult result = mbverify.Script(
      "here=$PWD; cd " + mbverify.folder().string() +
      " && cp $here/scenarios/four_bar/tables/noisy.csv . && sed 's/inverse/forward/; "
      "s#tables/##' $here/scenarios/four_bar/table_noisy.yaml > f.yaml && "
      "sed 's/table_noisy/f/; s/inverse/forward/; s/64/4/' "
      "$here/scenarios/four_bar/study_validation.yaml > s.yaml && $mbverify study s.yaml");
  ASSERT_EQ(result.exit_code, 0) << result.out << result.err;
  const nlohmann::json validation =
      nlohmann::json::parse(ReadAll(File("out/four_bar_validation/summary.json")))["validation"];
  EXPECT_NE(validation["u_num_from"].get<std::string>().find("grid convergence index"),
            std::string::npos);
  EXPECT_GT(validation["drives"][0]["u_num"].get<double>(), 0.0);
  EXPECT_LT(validation["drives"][0]["u_num"].get<double>(), 1e-6);
}

TEST_F(StudyCommand, ANightHasStudies) {
  fs::create_directories(File("scenarios/lift"));
  WriteStudy("{sobol: 4}", "limits: {x.force.mean: {below: 20, share: 0.9}}\n");
  for (const char* name : {"model.yaml", "hold.yaml"}) {
    fs::copy_file(File(name), File(std::string("scenarios/lift/") + name));
  }
  const std::string study = ReadAll(File("s.yaml"));
  Write("scenarios/lift/kept.yaml", study);
  Write("scenarios/lift/violated.yaml",
        std::regex_replace(study, std::regex("share: 0.9"), "share: 0") +
            "expect: {verdict: disagree, mentions: points violate it}\n");
  Write("scenarios/lift/unexpected.yaml",
        std::regex_replace(study, std::regex("share: 0.9"), "share: 0"));
  const ProgramResult night =
      mbverify("regress " + File("scenarios") + " --out " + File("night") + " --no-pictures");
  EXPECT_EQ(night.exit_code, 1) << night.out << night.err;
  const nlohmann::json report = nlohmann::json::parse(ReadAll(File("night/regress.json")));
  std::map<std::string, nlohmann::json> cases;
  for (const auto& entry : report["cases"]) cases[entry["key"]] = entry;
  EXPECT_EQ(cases["lift/kept"]["status"], "as_expected") << cases["lift/kept"];
  EXPECT_EQ(cases["lift/violated"]["status"], "as_expected") << cases["lift/violated"];
  EXPECT_EQ(cases["lift/unexpected"]["status"], "unexpected") << cases["lift/unexpected"];
  EXPECT_TRUE(fs::exists(File("night/lift/kept/points.csv")));
  EXPECT_FALSE(cases["lift/kept"]["inputs"].get<std::string>().empty());
}

// With bars of another mass in the simulation alone, every point disagrees; others keep their
// numbers.
TEST_F(StudyCommand, PointsAreJudgedByTheScenariosChecks) {
  const auto with = [&](const std::string& scale) {
    Write("hold.yaml",
          "mechanism: model.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: {x: {sine: "
          "{amplitude: 0.1, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse, "
          "parameters: {g: " +
              scale + "}}\n");
    Write("s.yaml",
          "study: s\nscenario: hold.yaml\nvary: {m: {uniform: {min: 1, max: 3}}}\n"
          "design: {sobol: 4}\nwitnesses: [reference, inverse]\nquantities: [force_nrmse]\n");
    return Study("out" + scale);
  };
  EXPECT_EQ(with("10").exit_code, 0);
  const ProgramResult bent = with("10.00001");
  EXPECT_EQ(bent.exit_code, 1) << bent.out << bent.err;
  EXPECT_NE(bent.out.find("VIOLATED witnesses disagree at 4 of 4 points"), std::string::npos)
      << bent.out;
  const nlohmann::json summary = Summary("out10.00001");
  EXPECT_EQ(summary["verdict"], "disagree");
  EXPECT_EQ(summary["disagreements"]["points"], 4);
  EXPECT_NEAR(summary["quantities"][0]["most"].get<double>(), 1e-6, 2e-7);
  EXPECT_NE(Points("out10.00001").find("\n0,1,1,,"), std::string::npos);
}

}  // namespace
}  // namespace mbv
