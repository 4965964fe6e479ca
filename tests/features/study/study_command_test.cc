// mbverify study as a user types it: the same bytes for any number of jobs, shards and kills;
// limits end in exit codes; nothing of anybody's is lost.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <map>
#include <regex>
#include <set>

#include "features/regress/database.h"
#include "features/study/study.h"
#include "tests/features/study/study_fixture.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

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
  const std::string merge = "study merge" + folders + " -o " + File("merged") + " --sqlite ";
  const ProgramResult merged = mbverify(merge + File("all.sqlite"));
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  Database database(File("all.sqlite"), Database::Mode::kRead);
  Statement all(&database, "SELECT count(*), sum(exit) FROM points");
  ASSERT_TRUE(all.Step()) << database.trouble();
  EXPECT_EQ(all.Integer(0), 16);
  EXPECT_EQ(all.Integer(1), 0);
  Statement of_five(&database, "SELECT m, \"x.force.mean\" FROM points WHERE point = 5");
  ASSERT_TRUE(of_five.Step()) << database.trouble();
  const std::string row = fmt::format("\n5,1,0,,{:.17g},", of_five.Real(0));
  EXPECT_NE(rows.find(row), std::string::npos) << row;
  EXPECT_NE(rows.find(fmt::format(",{:.17g},", of_five.Real(1))), std::string::npos);
  EXPECT_EQ(mbverify(merge + File("all.sqlite")).exit_code, 3);  // nothing is replaced
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
TEST_F(StudyCommand, AModifiedShardIsNotMergedButComputedAgain) {
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
  // What is finished is reported again; what is damaged is computed again.
  const auto written = fs::last_write_time(File("killed/s/points.csv"));
  const ProgramResult again = Study("killed", "--resume");
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_NE(again.out.find("16 points by sobol"), std::string::npos) << again.out;
  EXPECT_EQ(fs::last_write_time(File("killed/s/points.csv")), written);
  Write("killed/s/points.csv", rows.substr(0, cut));
  EXPECT_EQ(Study("killed", "--resume").exit_code, 0);
  EXPECT_EQ(Points("killed"), rows);
}

// What was killed from outside (a machine without memory, say) is computed once more.
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
// The mean force is m (g + a), a < 0.1 m/s² from the motion's mean: of two uniform numbers with
// means M = 2 and G = 10 + a and variances v = 1/3 each, S_m = v G² / (v G² + v M² + v²).
// At every time the force is m (g + a(t)): its percentiles are those of m where m alone is varied.
// The second drive carries three times as much.
TEST_F(StudyCommand, UnknownChannelsAreFoundBeforeAnythingIsComputed) {
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

TEST_F(StudyCommand, MoreShardsThanPointsWork) {
  WriteStudy("{sobol: 4}");
  ASSERT_EQ(Study("one", "").exit_code, 0);
  std::string folders;
  for (int shard = 1; shard <= 6; ++shard) {
    const ProgramResult run = Study("parts", fmt::format("--shard {}/6", shard));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    folders += " " + File(fmt::format("parts/s.shard-{}-of-6", shard));
  }
  const ProgramResult merged = mbverify("study merge" + folders + " -o " + File("merged"));
  ASSERT_EQ(merged.exit_code, 0) << merged.err;
  for (const char* name : {"points.csv", "forces.bin", "summary.json"}) {
    EXPECT_EQ(ReadAll(File(std::string("merged/s/") + name)),
              ReadAll(File(std::string("one/s/") + name)))
        << name;
  }
}

TEST_F(StudyCommand, BadArgumentsAreRefused) {
  WriteStudy("{sobol: 8}");
  EXPECT_EQ(mbverify("study").exit_code, 2);
  EXPECT_EQ(Study("out", "--shard 3/2").exit_code, 2);
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
  EXPECT_NE(odd.err.find("10 is not a power of two"), std::string::npos) << odd.err;
  for (const char* option : {"--seed -3", "--seed 18446744073709551616", "--count -8",
                             "--count 18446744073709551624", "--seed 1.5"}) {
    const ProgramResult refused = Study("f", option);
    EXPECT_EQ(refused.exit_code, 2) << option;
    EXPECT_NE(refused.err.find("from 0 to 2^64 - 1"), std::string::npos) << refused.err;
  }
}

// The table is m g of a mass of 2 kg; a study of the same mass is within it, one of 2.1 kg is not.
// In forward mode the step's error is what converge extrapolates.
TEST_F(StudyCommand, ARegressionHasStudies) {
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
  const ProgramResult regression =
      mbverify("regress " + File("scenarios") + " --out " + File("regression") + " --no-pictures");
  EXPECT_EQ(regression.exit_code, 1) << regression.out << regression.err;
  const nlohmann::json report = nlohmann::json::parse(ReadAll(File("regression/regress.json")));
  std::map<std::string, nlohmann::json> cases;
  for (const auto& entry : report["cases"]) cases[entry["key"]] = entry;
  EXPECT_EQ(cases["lift/kept"]["status"], "as_expected") << cases["lift/kept"];
  EXPECT_EQ(cases["lift/violated"]["status"], "as_expected") << cases["lift/violated"];
  EXPECT_EQ(cases["lift/unexpected"]["status"], "unexpected") << cases["lift/unexpected"];
  EXPECT_TRUE(fs::exists(File("regression/lift/kept/points.csv")));
  EXPECT_FALSE(cases["lift/kept"]["inputs"].get<std::string>().empty());
}

// With bars of another mass in the simulation alone, every point disagrees; others keep their
// numbers.

TEST_F(StudyCommand, ANumberThatMovesNothingIsReportedAndALimitThatNothingMovesIsRefused) {
  const auto with = [&](const std::string& vary, const std::string& limits) {
    Write("s.yaml", "study: s\nscenario: hold.yaml\nvary: {" + vary +
                        "}\ndesign: {sobol: 4}\nquantities: [x.force.mean]\n" + limits);
    return Study("out");
  };
  const std::string mass = "m: {uniform: {min: 1, max: 3}}";
  const std::string step = "simulation.step_s: {uniform: {min: 0.0005, max: 0.001}}";
  const std::string limit = "limits: {x.force.mean: {below: 100}}\n";
  const ProgramResult both = with(mass + ", " + step, limit);
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_NE(both.err.find("s.yaml:3:"), std::string::npos) << both.err;
  EXPECT_NE(both.err.find("warning: vary.simulation.step_s: moves no quantity of this study"),
            std::string::npos)
      << both.err;
  EXPECT_NE(both.out.find("4 points by sobol; simulation.step_s moves no quantity"),
            std::string::npos)
      << both.out;
  EXPECT_TRUE(Summary("out")["varied"][0]["moves"]);
  EXPECT_FALSE(Summary("out")["varied"][1]["moves"]);
  const ProgramResult alone = with(step, limit);
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("error: limits.x.force.mean: none of the varied numbers moves it"),
            std::string::npos)
      << alone.err;
  EXPECT_EQ(mbverify("check " + File("s.yaml")).exit_code, 2);
  const ProgramResult slip = with("simulation.stp_s: {uniform: {min: 1, max: 2}}", "");
  EXPECT_EQ(slip.exit_code, 2);
  EXPECT_NE(slip.err.find("error: vary.simulation.stp_s: simulation: unknown key 'stp_s'"),
            std::string::npos)
      << slip.err;
  EXPECT_EQ(with(step, "").exit_code, 0);  // asks nothing, and says what moves nothing
  const ProgramResult moved = with(mass, limit);
  EXPECT_EQ(moved.exit_code, 0);
  EXPECT_EQ(moved.err.find("moves no quantity"), std::string::npos) << moved.err;
}

// Whatever stands in study.json: a finding with file and key, exit code 2.
TEST_F(StudyCommand, ADamagedIdentityIsAFindingWithItsKey) {
  WriteStudy("{sobol: 4}");
  ASSERT_EQ(Study("parts", "--shard 1/2").exit_code, 0);
  const std::string folder = File("parts/s.shard-1-of-2"), file = "parts/s.shard-1-of-2/study.json";
  const auto good = nlohmann::json::parse(ReadAll(File(file)));
  const auto refused = [&](const std::string& text, const std::string& key) {
    Write(file, text);
    for (const std::string& command :
         {"study merge " + folder + " -o " + File("merged"),
          "study " + File("s.yaml") + " --shard 1/2 --resume --out " + File("parts")}) {
      const ProgramResult result = mbverify(command);
      EXPECT_EQ(result.exit_code, 2) << command << text << result.err;
      EXPECT_NE(result.err.find("study.json:"), std::string::npos) << result.err;
      EXPECT_NE(result.err.find("error: " + key), std::string::npos) << key << result.err;
    }
  };
  const nlohmann::json others[] = {nullptr,
                                   true,
                                   1.5,
                                   "x",
                                   nlohmann::json::array({1}),
                                   {{"a", nlohmann::json::array({nlohmann::json::object()})}}};
  for (const char* key : {"schema", "study", "file", "fingerprint", "shard", "points"}) {
    for (const nlohmann::json& other : others) {
      if (other.is_string() && good.at(key).is_string() && std::string(key) != "schema") continue;
      nlohmann::json damaged = good;
      damaged[key] = other;
      refused(damaged.dump(), key);
    }
  }
  nlohmann::json zero = good;
  zero["shard"] = {0, 0};
  refused(zero.dump(), "shard says 0 of 0");
  const std::string text = good.dump();
  refused(text.substr(0, text.size() / 2), "the file ends before its JSON does");
  refused("", "the file is empty");
  refused(std::string(200000, '['), "the JSON is nested more than 100 levels deep");
}

// What an earlier result of fewer points has stays, and the rest follows it.
TEST_F(StudyCommand, MorePointsKeepThoseThatAreThere) {
  for (const char* design : {"{sobol: 8}", "{saltelli: 8}"}) {
    const std::string out = design[1] == 's' && design[2] == 'o' ? "sobol" : "saltelli";
    WriteStudy(design);
    ASSERT_EQ(Study(out).exit_code, 0);
    const std::string few = Points(out);
    ASSERT_EQ(Study(out + "_anew", "--count 32").exit_code, 0);
    const ProgramResult more = Study(out, "--count 32 --resume --jobs 2");
    ASSERT_EQ(more.exit_code, 0) << more.err;
    EXPECT_TRUE(Points(out).starts_with(few)) << out;
    EXPECT_EQ(Points(out), Points(out + "_anew")) << out;
    EXPECT_EQ(Summary(out), Summary(out + "_anew")) << out;
    EXPECT_EQ(ReadAll(File(out + "/s/forces.bin")), ReadAll(File(out + "_anew/s/forces.bin")));
  }
}

// They are taken, not computed again: only where their fingerprint is that of the study.
TEST_F(StudyCommand, MorePointsTakeNoRowThatWasTouched) {
  WriteStudy("{sobol: 8}");
  for (const bool signed_anew : {false, true}) {
    const std::string out = signed_anew ? "taken" : "refused";
    ASSERT_EQ(Study(out).exit_code, 0);
    const std::string good = Points(out);
    std::string touched = good;
    touched[touched.size() - 2] = touched[touched.size() - 2] == '1' ? '2' : '1';
    Write(out + "/s/points.csv", touched);
    auto identity = nlohmann::json::parse(ReadAll(File(out + "/s/study.json")));
    if (signed_anew) identity["points"] = PointsFingerprint(File(out + "/s"));
    Write(out + "/s/study.json", identity.dump());
    ASSERT_EQ(Study(out, "--count 16 --resume").exit_code, 0);
    EXPECT_TRUE(Points(out).starts_with(signed_anew ? touched : good)) << out;
  }
}

// The interval of a share of one half, of n points, is about 4 √(0.25 / n) = 2 / √n wide.
TEST_F(StudyCommand, PointsAreDrawnUntilTheIntervalIsNarrow) {
  WriteStudy("{sobol: 4096}", "limits: {x.force.mean: {below: 20, share: 0.9}}\n");
  const ProgramResult result = Study("out", "--width 0.2");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = Summary("out");
  EXPECT_EQ(json["points"], 128);
  const auto interval = json["limits"][0]["interval"];
  EXPECT_LT(interval[1].get<double>() - interval[0].get<double>(), 0.2);
  ASSERT_EQ(Study("alone", "--count 128").exit_code, 0);
  EXPECT_EQ(Points("out"), Points("alone"));
  WriteStudy("{sobol: 4096}");
  EXPECT_EQ(Study("none", "--width 0.2").exit_code, 2);
  WriteStudy("{latin_hypercube: 100}");
  EXPECT_EQ(Study("none", "--width 0.2").exit_code, 2);
}

}  // namespace
}  // namespace mbv
