// mbverify study as a user types it: the same bytes for any number of jobs, shards and kills;
// limits end in exit codes; nothing of anybody's is lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "scenario/load_scenario.h"
#include "scenario/study_file.h"
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

// examples/cluster with stand-ins for what schedules: one call after the other.
TEST_F(StudyCommand, ClusterExamplesComputeAndMergeShards) {
  WriteStudy("{sobol: 8}");
  ASSERT_EQ(Study("one").exit_code, 0);
  Write("srun", "#!/bin/bash\nexec \"$@\"\n");
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
      "mbverify study merge shards/*.shard-*-of-2 -o slurm");
  EXPECT_EQ(array.exit_code, 0) << array.err;
  EXPECT_EQ(Points("slurm"), Points("one"));
  const ProgramResult parallel = mbverify.Script(
      start + "bash $here/examples/cluster/parallel.sh s.yaml 3 gnu --sshloginfile nodes");
  EXPECT_EQ(parallel.exit_code, 0) << parallel.err;
  EXPECT_EQ(Points("gnu"), Points("one"));
}

// Every shipped study ends as it says, and they are none of the scenarios that a night runs.
TEST_F(StudyCommand, ShippedStudiesDoWhatTheyExpect) {
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(SourcePath("/scenarios"))) {
    if (entry.path().extension() != ".yaml" || !ReadScenarioHead(entry.path()).is_study) continue;
    const StudyResult study = LoadStudy(entry.path());
    ASSERT_TRUE(study.study) << entry.path() << "\n" << study.diagnostics.Text();
    ++count;
    const ProgramResult result =
        mbverify("study " + entry.path().string() + " --out " + File("out"));
    EXPECT_EQ(result.exit_code, study.study->expected_exit) << entry.path() << "\n"
                                                            << result.out << result.err;
    EXPECT_NE(result.out.find(study.study->mentions), std::string::npos)
        << study.study->mentions << " is missing in\n"
        << result.out;
  }
  EXPECT_GE(count, 6);
}

}  // namespace
}  // namespace mbv
