// The program from outside: exit codes, where output goes, what is left behind.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kGood = "scenarios/stabilizing_platform/static.yaml";
constexpr const char* kDisagrees = "scenarios/stabilizing_platform/must_fail/analytic_mass.yaml";
constexpr const char* kBadInput = "scenarios/stabilizing_platform/must_fail/no_yaml.yaml";
constexpr const char* kCannotRun = "scenarios/stabilizing_platform/must_fail/out_of_reach.yaml";

std::string RunArguments(const Program& mbverify, const std::string& arguments) {
  return "run --no-pictures --out " + mbverify.Out() + " " + arguments;
}

class CliTest : public testing::Test {
 protected:
  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(CliTest, VersionAndHelpGoToStdout) {
  const ProgramResult version = mbverify("--version");
  EXPECT_EQ(version.exit_code, 0);
  EXPECT_EQ(version.out.substr(0, 9), "mbverify ");
  const ProgramResult help = mbverify("run --help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_NE(help.out.find("Examples:"), std::string::npos);
}

TEST_F(CliTest, WrongUseIsBadInput) {
  for (const char* arguments : {"rum", "run", "run --mode backward x.yaml", "model",
                                "run x.yaml --set nonsense", "model no_such_model"}) {
    const ProgramResult result = mbverify(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments;
    EXPECT_FALSE(result.err.empty()) << arguments;
    EXPECT_TRUE(result.out.empty()) << result.out;
  }
}

TEST_F(CliTest, TheMobilityReportIsJsonToo) {
  const ProgramResult stewart = mbverify("model stewart --format json");
  EXPECT_EQ(stewart.exit_code, 0) << stewart.err;
  const auto json = nlohmann::json::parse(stewart.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << stewart.out;
  EXPECT_EQ(json["schema"], "mbverify.model/1");
  EXPECT_EQ(json["name"], "stewart");
  // 13 bodies and 18 joints in the legs: 6·13 − 6·(4 + 5 + 3) = 6.
  EXPECT_EQ(json["bodies"], 13);
  EXPECT_EQ(json["body_coordinates"], 78);
  EXPECT_EQ(json["constraint_rank"], 72);
  EXPECT_EQ(json["dof"], 6);
  EXPECT_EQ(json["drives"].size(), 6u);
  EXPECT_TRUE(json["redundant_constraints"].empty());
  EXPECT_FALSE(json["home_singular"].get<bool>());
  // A planar loop of four parallel hinges in space: 18 − 20 by counting, 1 in truth, 3 redundant.
  const auto four_bar = nlohmann::json::parse(mbverify("model four_bar --format json").out);
  EXPECT_EQ(four_bar["kutzbach"], -2);
  EXPECT_EQ(four_bar["dof"], 1);
  EXPECT_EQ(four_bar["home"]["redundant"], 3);
  ASSERT_EQ(four_bar["loops"].size(), 1u);
  EXPECT_EQ(four_bar["loops"][0]["screw_rank"], 3);
  EXPECT_FALSE(four_bar["undetermined_forces"].empty());
}

TEST_F(CliTest, TheJsonGoesToAFileWholeOrNotAtAll) {
  const std::string file = (mbverify.folder() / "report.json").string();
  const ProgramResult written = mbverify("model spr_tripod --format json --out " + file);
  EXPECT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(written.out, "");
  EXPECT_EQ(ReadAll(file), mbverify("model spr_tripod --format json").out);
  const ProgramResult bad =
      mbverify("model spr_tripod --format json --set m_rod=-1 --out " + file + ".bad");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_FALSE(fs::exists(file + ".bad"));
  EXPECT_EQ(mbverify("model spr_tripod --format toml").exit_code, 2);
}

TEST_F(CliTest, UrdfLeavesBeamsOutWithAWarning) {
  const ProgramResult elastic = mbverify("model models/scara_robot/elastic.yaml --format urdf");
  EXPECT_EQ(elastic.exit_code, 0);
  EXPECT_NE(elastic.err.find("URDF has rigid links only"), std::string::npos) << elastic.err;
  EXPECT_EQ(mbverify("model scara_robot --format urdf").err.find("beams"), std::string::npos);
}

// What URDF cannot say lies beside it, and is found there.
TEST_F(CliTest, UrdfIsCompletedByTheFileBesideIt) {
  const auto has = [](const std::string& text, const std::string& key) {
    return text.find(key) != std::string::npos;
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"geared_press", {"couplings:", "springs:"}},
      {"slider_crank", {"motors:"}},
      {"machine_five_bar", {"couplings:", "kind: friction", "kind: rotor"}}};
  for (const auto& [model, keys] : cases) {
    const std::string urdf = (mbverify.folder() / (model + ".urdf")).string();
    const std::string companion = (mbverify.folder() / (model + ".mbverify.yaml")).string();
    const ProgramResult written = mbverify("model " + model + " --format urdf --out " + urdf);
    ASSERT_EQ(written.exit_code, 0) << written.err;
    EXPECT_NE(written.err.find(model + ".mbverify.yaml completes it"), std::string::npos);
    const ProgramResult back = mbverify("model " + urdf + " --format yaml");
    EXPECT_EQ(back.exit_code, 0) << back.err;
    fs::rename(companion, companion + ".old");
    const ProgramResult alone = mbverify("model " + urdf + " --format yaml");
    for (const std::string& key : keys) {
      EXPECT_TRUE(has(back.out, key)) << key << "\n" << back.out;
      EXPECT_FALSE(has(alone.out, key)) << key;
    }
    // One that mbverify did not write stays, and nothing is written.
    std::ofstream(companion) << "shopping: list\n";
    fs::remove(urdf);
    EXPECT_EQ(mbverify("model " + model + " --format urdf --out " + urdf).exit_code, 2);
    EXPECT_FALSE(fs::exists(urdf));
    EXPECT_EQ(ReadAll(companion), "shopping: list\n");
  }
}

// What a robot's file was warned of is not repeated for the model that is made of it; what is wrong
// with a model that was changed by hand is.
TEST_F(CliTest, ARobotsWarningsAreGivenOnce) {
  fs::create_directories(mbverify.folder());
  const std::string robot = (mbverify.folder() / "arm.xml").string();
  std::ofstream(robot) << R"(<mujoco model="arm"><worldbody>
    <body name="trunk"><freejoint/><geom size="0.1"/>
      <body name="arm"><joint name="elbow" axis="0 1 0" armature="500"/><geom size="0.1" pos="0.3 0 0"/>
    </body></body></worldbody><actuator><motor joint="elbow"/></actuator></mujoco>)";
  const auto times = [](const std::string& text, const std::string& what) {
    size_t count = 0;
    for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
      ++count;
    return count;
  };
  const ProgramResult first = mbverify(RunArguments(mbverify, robot) + " --no-own-file");
  EXPECT_EQ(first.exit_code, 0) << first.err;
  for (const char* warned : {"behind its gear", "the free joint of trunk"}) {
    EXPECT_EQ(times(first.err, warned), 1U) << first.err;
  }
  const ProgramResult again = mbverify(RunArguments(
      mbverify, (mbverify.folder() / mbverify.Out()).string() + "/arm/setup/first.yaml"));
  for (const char* warned : {"behind its gear", "the free joint of trunk"}) {
    EXPECT_EQ(times(again.err, warned), 1U) << again.err;
  }
}

TEST_F(CliTest, MutateTakesPercentAndWritesJson) {
  const std::string json = (mbverify.folder() / "m.json").string();
  const ProgramResult result = mbverify(
      "sensitivity scenarios/four_bar/turn_inverse.yaml --parameter rho --size 1% --json " + json);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("1 of 1 numbers (1 parameters), each 1 % too large and too small"),
            std::string::npos)
      << result.out;
  const auto parsed = nlohmann::json::parse(ReadAll(json), nullptr, false);
  ASSERT_FALSE(parsed.is_discarded());
  EXPECT_EQ(parsed["size"], 0.01);
  EXPECT_EQ(parsed["numbers"][0]["name"], "rho");
  for (const char* size : {"0", "-1%", "one", "1 m"}) {
    const ProgramResult bad = mbverify("sensitivity scenarios/four_bar/turn_inverse.yaml --size '" +
                                       std::string(size) + "'");
    EXPECT_EQ(bad.exit_code, 2) << size;
    EXPECT_NE(bad.err.find("violates: a percentage above 0"), std::string::npos) << bad.err;
  }
}

TEST_F(CliTest, MutateSharesItsWorkOutToProcesses) {
  const std::string command =
      "sensitivity scenarios/four_bar/turn_inverse.yaml --no-search --json ";
  const std::string one = (mbverify.folder() / "1.json").string();
  const std::string two = (mbverify.folder() / "2.json").string();
  EXPECT_EQ(mbverify(command + one + " --jobs 1").exit_code, 0);
  EXPECT_EQ(mbverify(command + two + " --jobs 2").exit_code, 0);
  auto alone = nlohmann::json::parse(ReadAll(one), nullptr, false);
  auto shared = nlohmann::json::parse(ReadAll(two), nullptr, false);
  ASSERT_FALSE(alone.is_discarded() || shared.is_discarded());
  alone.erase("wall_s");
  shared.erase("wall_s");
  EXPECT_EQ(alone, shared);
  const ProgramResult bad = mbverify(
      "sensitivity scenarios/four_bar/turn_inverse.yaml --jobs 2 --parameter roh --parameter x");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE(bad.err.find("did you mean 'rho'?"), std::string::npos) << bad.err;
}

TEST_F(CliTest, TheWorstScenarioDecidesTheExitCode) {
  const std::string good = kGood, disagrees = kDisagrees, bad = kBadInput, cannot = kCannotRun;
  EXPECT_EQ(mbverify(RunArguments(mbverify, good)).exit_code, 0);
  EXPECT_EQ(mbverify(RunArguments(mbverify, good + " " + disagrees)).exit_code, 1);
  EXPECT_EQ(mbverify(RunArguments(mbverify, cannot + " " + disagrees)).exit_code, 3);
  const ProgramResult all =
      mbverify(RunArguments(mbverify, "-q " + cannot + " " + bad + " " + good + " " + disagrees));
  EXPECT_EQ(all.exit_code, 2);
  EXPECT_NE(all.out.find("4 scenarios: 2 ran, 2 compared, 1 verified, 1 with bad input"),
            std::string::npos)
      << all.out;
}

TEST_F(CliTest, FoldersStandForTheirScenariosButNotForThoseThatMustFail) {
  fs::create_directories(mbverify.folder() / "mine" / "must_fail");
  const fs::path source = kSourceDir;
  fs::copy(source / kGood, mbverify.folder() / "mine" / "a.yaml");
  fs::copy(source / kDisagrees, mbverify.folder() / "mine" / "must_fail" / "b.yaml");
  std::ofstream(mbverify.folder() / "mine" / "other.yaml") << "a: 1\n";
  setenv("MBVERIFY_MODELS", SourcePath("/models").c_str(), 1);
  const ProgramResult result =
      mbverify(RunArguments(mbverify, "-q " + (mbverify.folder() / "mine").string()));
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1) << result.out;
  fs::create_directories(mbverify.folder() / "empty");
  EXPECT_EQ(mbverify(RunArguments(mbverify, (mbverify.folder() / "empty").string())).exit_code, 2);
  unsetenv("MBVERIFY_MODELS");
}

TEST_F(CliTest, ResultsGoToStdoutTalkToStderrAndFilesToTheFolder) {
  const ProgramResult result = mbverify(RunArguments(mbverify, kGood));
  EXPECT_EQ(result.out.substr(0, 36), "stabilizing_platform / static: AGREE");
  EXPECT_NE(result.err.find("results in "), std::string::npos);
  EXPECT_EQ(result.out.find('\x1b'), std::string::npos);  // no colour into a file
  const fs::path folder = fs::path(mbverify.Out()) / "stabilizing_platform" / "static";
  for (const char* name : {"summary.json", "traces.csv", "model.xml"}) {
    EXPECT_TRUE(fs::exists(folder / name)) << name;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.parent_path()), {}), 1);
}

TEST_F(CliTest, TheSameScenarioTwiceGivesTheSameBytes) {
  const std::string arguments =
      std::string(kDisagrees) + " --mode forward --set motion.duration_s=1";
  const fs::path csv =
      fs::path(mbverify.Out()) / "stabilizing_platform/must_fail/analytic_mass/traces.csv";
  ASSERT_EQ(mbverify(RunArguments(mbverify, arguments)).exit_code, 1);
  const std::string first = ReadAll(csv);
  ASSERT_EQ(mbverify(RunArguments(mbverify, arguments)).exit_code, 1);
  EXPECT_GT(first.size(), 10000u);
  EXPECT_TRUE(first == ReadAll(csv));
}

TEST_F(CliTest, AKilledRunLeavesTheOldResultWhole) {
  ASSERT_EQ(mbverify(RunArguments(mbverify, kGood)).exit_code, 0);
  const fs::path summary = fs::path(mbverify.Out()) / "stabilizing_platform/static/summary.json";
  const std::string before = ReadAll(summary);
  // Killed somewhere on the way; the time is meant to hit different stages.
  for (const char* limit : {"0.05", "0.1", "0.15", "0.2"}) {
    const std::string command =
        std::string("cd '" + std::string(kSourceDir) + "' && timeout -s KILL ") + limit + " '" +
        std::string(kBinaryDir) + "/mbverify' " + RunArguments(mbverify, kGood) +
        " >/dev/null 2>&1";
    const int status = std::system(command.c_str());
    (void)status;  // whole or killed, the summary must be one of a complete run
    const auto json = nlohmann::json::parse(ReadAll(summary), nullptr, false);
    ASSERT_FALSE(json.is_discarded()) << limit;
    EXPECT_EQ(json["verdict"], "agree");
  }
  ASSERT_EQ(mbverify(RunArguments(mbverify, kGood)).exit_code, 0);
  EXPECT_EQ(std::distance(fs::directory_iterator(summary.parent_path().parent_path()), {}), 1);
  EXPECT_FALSE(before.empty());
}

TEST_F(CliTest, AFolderThatCannotBeWrittenIsNamed) {
  std::ofstream(mbverify.folder() / "file") << "x";
  const ProgramResult result =
      mbverify("run --no-pictures --out " + (mbverify.folder() / "file").string() + " " + kGood);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("cannot make folder"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("hint: choose another folder with --out"), std::string::npos);
}

TEST_F(CliTest, ModeAndSetReachTheScenario) {
  const ProgramResult result = mbverify(RunArguments(
      mbverify, std::string(kGood) + " --mode forward --set simulation.step_s=0.0005 --set "
                                     "parameters.m_p=1000 --set motion.duration_s=0.1 "
                                     "--set checks.force_nrmse=1e-6"));
  EXPECT_EQ(result.exit_code, 0) << result.out;
  EXPECT_NE(result.out.find("forward simulation, step 0.5 ms"), std::string::npos) << result.out;
  const ProgramResult wrong =
      mbverify(RunArguments(mbverify, std::string(kGood) + " --set simulation.stepp_s=1"));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_NE(wrong.err.find("did you mean 'step_s'?"), std::string::npos);
}

TEST_F(CliTest, CheckPrintsEveryFindingAndEveryFileThatIsFine) {
  const ProgramResult good =
      mbverify(std::string("check models/stabilizing_platform/model.yaml ") + kGood);
  EXPECT_EQ(good.exit_code, 0);
  EXPECT_EQ(good.out,
            std::string("models/stabilizing_platform/model.yaml: ok\n") + kGood + ": ok\n");
  const ProgramResult bad =
      mbverify("check scenarios/stabilizing_platform/must_fail/unknown_names.yaml");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_EQ(std::count(bad.out.begin(), bad.out.end(), '\n') / 2, 7) << bad.out;
}

TEST_F(CliTest, ModelReportsMobilityAndWritesMjcf) {
  const ProgramResult report = mbverify("model stabilizing_platform");
  EXPECT_EQ(report.exit_code, 0);
  EXPECT_NE(report.out.find("degrees of freedom: 9"), std::string::npos) << report.out;
  EXPECT_NE(report.out.find("redundant constraints: 6"), std::string::npos) << report.out;
  const ProgramResult mjcf = mbverify("model stabilizing_platform --format mjcf --out " +
                                      (mbverify.folder() / "p.xml").string());
  EXPECT_EQ(mjcf.exit_code, 0);
  EXPECT_NE(ReadAll(mbverify.folder() / "p.xml").find("<mujoco"), std::string::npos);
  const ProgramResult near = mbverify("model stabilising_platform");
  EXPECT_NE(near.err.find("did you mean 'stabilizing_platform'?"), std::string::npos);
}

TEST_F(CliTest, AuditOfOneModelListsItsErrata) {
  const ProgramResult audit = mbverify("audit stabilizing_platform");
  EXPECT_EQ(audit.exit_code, 0) << audit.err;
  EXPECT_NE(audit.out.find("E2"), std::string::npos);
  EXPECT_NE(mbverify("audit stabilizing_platform --markdown").out.find("|"), std::string::npos);
  EXPECT_EQ(mbverify("audit nothing").exit_code, 2);
}

TEST_F(CliTest, ListNamesModelsAndScenarios) {
  const ProgramResult list = mbverify("list");
  EXPECT_EQ(list.exit_code, 0);
  for (const std::string& name : ShippedModelNames()) {
    EXPECT_NE(list.out.find(name), std::string::npos) << name;
  }
  EXPECT_NE(list.out.find(kGood), std::string::npos);
}

TEST_F(CliTest, WorkspaceTakesParameters) {
  const std::string call = "workspace spr_tripod --no-pictures --out '" + mbverify.Out() + "'";
  const ProgramResult shipped = mbverify(call);
  EXPECT_EQ(shipped.exit_code, 0) << shipped.err;
  EXPECT_NE(shipped.out.find("legs 0.5 … 0.75 m"), std::string::npos) << shipped.out;
  const ProgramResult longer = mbverify(call + " --set q_min=0.45 --set 'q_max=0.45 + 0.2'");
  EXPECT_EQ(longer.exit_code, 0) << longer.err;
  EXPECT_NE(longer.out.find("legs 0.45 … 0.65 m"), std::string::npos) << longer.out;
  EXPECT_NE(longer.out.find("AGREE: 4 ways"), std::string::npos) << longer.out;
  for (const char* bad : {"q_min", "q_min=abc", "q_mni=0.4", "q_min=0.8"}) {
    EXPECT_EQ(mbverify(call + " --set " + bad).exit_code, 2) << bad;
  }
  // Strokes beyond what can be assembled have no workspace to measure.
  EXPECT_EQ(mbverify(call + " --set q_min=0.1").exit_code, 3);
}

TEST_F(CliTest, RenderWritesPicturesAndVideos) {
  const std::string size = std::string(kGood) + " --size 64x64 ";
  const ProgramResult pictures = mbverify("render " + size + "--at 0,0.25 --out " + mbverify.Out());
  EXPECT_EQ(pictures.exit_code, 0) << pictures.err;
  EXPECT_TRUE(fs::exists(fs::path(mbverify.Out()) / "stabilizing_platform/static/t_0.250s.png"));
  const std::string video = (mbverify.folder() / "v.png").string();
  EXPECT_EQ(mbverify("render " + size + "--fps 4 --video " + video).exit_code, 0);
  EXPECT_NE(ReadAll(video).find("acTL"), std::string::npos);
}

TEST_F(CliTest, RenderTakesEachLookOfAPaper) {
  const std::string call =
      "render " + std::string(kGood) + " --size 160x120 --no-caption --at 0.25";
  const auto picture = [&](const std::string& options) {
    const std::string out = mbverify.Out();
    const ProgramResult made = mbverify(call + " " + options + " --out " + out);
    EXPECT_EQ(made.exit_code, 0) << options << made.err;
    return ReadAll((fs::path(out) / "stabilizing_platform/static/t_0.250s.png").string());
  };
  const std::string plain = picture("");
  // IHDR's colour type: 2 RGB, 6 with opacity.
  EXPECT_EQ(plain.at(25), 2);
  EXPECT_EQ(picture("--background transparent").at(25), 6);
  for (const char* options :
       {"--background white", "--background '#f4f4f4'", "--labels", "--labels=joints",
        "--scale-bar", "--orthographic", "--style line_art", "--exploded 1.5"}) {
    EXPECT_NE(picture(options), plain) << options;
  }
  for (const char* bad : {"--background whit", "--labels=jonts", "--style art", "--exploded 0",
                          "--ghosts -1", "--ghosts 0.1,99"}) {
    const ProgramResult refused = mbverify(call + " " + bad);
    EXPECT_EQ(refused.exit_code, 2) << bad;
    EXPECT_NE(refused.err.find("--set snapshots."), std::string::npos) << refused.err;
  }
}

TEST_F(CliTest, RenderShowsEarlierInstants) {
  const auto picture = [&](const std::string& options) {
    const ProgramResult made = mbverify("render four_bar/turn --size 160x120 --at 0.3 " + options +
                                        " --out " + mbverify.Out());
    EXPECT_EQ(made.exit_code, 0) << made.err;
    return ReadAll((fs::path(mbverify.Out()) / "four_bar/turn/t_0.300s.png").string());
  };
  const std::string alone = picture(""), three = picture("--ghosts 3");
  EXPECT_NE(three, alone);
  EXPECT_EQ(picture("--ghosts 0,0.1,0.2"), three);
}

TEST_F(CliTest, FfmpegWritesTheOtherVideos) {
  for (const std::string ending : {"mp4", "webm", "gif"}) {
    const std::string video = (mbverify.folder() / ("v." + ending)).string();
    // Odd sizes are what players refuse.
    const ProgramResult made =
        mbverify("render " + std::string(kGood) + " --size 65x67 --fps 20 --video " + video);
    ASSERT_EQ(made.exit_code, 0) << made.err;
    // 0.5 s at 20 frames a second, both ends included.
    const std::string count = (mbverify.folder() / "count").string();
    const std::string probe =
        "ffprobe -v error -count_frames -show_entries stream=nb_read_frames -of csv=p=0 '" + video +
        "' >'" + count + "'";
    ASSERT_EQ(std::system(probe.c_str()), 0);
    EXPECT_EQ(std::stoi(ReadAll(count)), 11) << ending;
  }
}

TEST_F(CliTest, VideosThatCannotBeWrittenAreRefusedBeforeAnyWork) {
  const std::string video = (mbverify.folder() / "v").string();
  const std::string render = "render " + std::string(kGood) + " --size 64x64 --video " + video;
  const ProgramResult unknown = mbverify(render + ".avi");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find(".mp4, .mkv, .webm, .gif"), std::string::npos) << unknown.err;
  const ProgramResult missing = mbverify.WithPath("/nowhere", render + ".mp4");
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_NE(missing.err.find("ffmpeg is needed for .mp4"), std::string::npos) << missing.err;
  EXPECT_NE(missing.err.find("--video " + video + ".png"), std::string::npos) << missing.err;
  // A program of that name that fails.
  const fs::path bin = mbverify.folder() / "bin";
  fs::create_directories(bin);
  std::ofstream(bin / "ffmpeg") << "#!/bin/sh\necho broken codec >&2\nexit 1\n";
  fs::permissions(bin / "ffmpeg", fs::perms::owner_all);
  const ProgramResult broken = mbverify.WithPath(bin.string() + ":/usr/bin:/bin", render + ".mp4");
  EXPECT_EQ(broken.exit_code, 3);
  EXPECT_NE(broken.err.find("ffmpeg failed: broken codec"), std::string::npos) << broken.err;
  EXPECT_FALSE(fs::exists(video + ".mp4"));
}

// On a terminal the running scenarios are shown below the finished ones and wiped again.
TEST_F(CliTest, RegressShowsALiveTableOnATerminal) {
  const ProgramResult regress =
      mbverify.OnTerminal("regress --no-pictures --no-history --jobs 1 --out " + mbverify.Out() +
                          " " + kGood + " " + kDisagrees);
  EXPECT_EQ(regress.exit_code, 0) << regress.out;
  for (const char* part : {"  running  stabilizing_platform/must_fail/analytic_mass ",
                           "\x1b[2A\x1b[J", "0 of 2 done, 0 not as expected",
                           "[1/2] fails as it must ", "[2/2] agree ", "2 scenarios"}) {
    EXPECT_NE(regress.out.find(part), std::string::npos) << part << "\n" << regress.out;
  }
  // The last thing on the screen is the summary, not a running scenario.
  EXPECT_GT(regress.out.rfind("2 scenarios"), regress.out.rfind("  running  "));
  const ProgramResult plain =
      mbverify("regress --no-pictures --no-history --out " + mbverify.Out() + " " + kGood);
  EXPECT_EQ(plain.err.find('\x1b'), std::string::npos) << plain.err;
  EXPECT_EQ(plain.err.find("running"), std::string::npos) << plain.err;
}

// An untrusted scenario whose program leaves a file.
class TheirProgram {
 public:
  explicit TheirProgram(const std::string& name) : mbverify_("trust_" + name) {
    const fs::path theirs = mbverify_.folder() / "theirs";
    fs::create_directories(theirs);
    fs::copy_file(std::string(kSourceDir) + "/models/slider_crank/model.yaml",
                  theirs / "model.yaml");
    std::ofstream(theirs / "case.yaml")
        << "mechanism: ./model.yaml\n"
        << "motion: {duration_s: 0.02, sample_s: 0.01, commands: {motor: [home, {ramp: {rate: "
           "3}}]}}\n"
        << "simulation: {mode: inverse}\nwitnesses: {there: {command: [python3, there.py]}}\n";
    std::ofstream(theirs / "there.py") << "open('" << Ran() << "', 'w')\n";
  }
  [[nodiscard]] std::string Ran() const { return (mbverify_.folder() / "ran").string(); }
  [[nodiscard]] std::string Folder() const { return (mbverify_.folder() / "theirs").string(); }
  // The program, with a configuration of its own; "CASE" is the scenario, "OUT" a folder.
  ProgramResult operator()(std::string words, const std::string& input = "") const {
    for (const auto& [word, path] :
         {std::pair<std::string, std::string>{"CASE", Folder() + "/case.yaml"},
          {"OUT", mbverify_.Out()}}) {
      for (size_t at = 0; (at = words.find(word, at)) != std::string::npos; at += path.size()) {
        words.replace(at, word.size(), path);
      }
    }
    fs::remove(Ran());
    const std::string set =
        "export NO_COLOR=1 XDG_CONFIG_HOME=" + (mbverify_.folder() / "config").string() +
        " mbverify; ";
    if (input.empty()) return mbverify_.Script(set + "\"$mbverify\" " + words + " </dev/null");
    return mbverify_.Script(set + "printf '" + input +
                            "' | script --quiet --return --command \"'$mbverify' " + words +
                            "\" /dev/null");
  }
  [[nodiscard]] bool ran() const { return fs::exists(Ran()); }

 private:
  Program mbverify_;
};

// Every command that runs scenarios.
const char* const kRunningCommands[] = {
    "run CASE --no-pictures --no-report --out OUT",
    "run CASE -q --no-pictures --no-report --out OUT",
    "regress CASE --no-pictures --no-reports --out OUT/regression",
    "figures CASE --formats svg --out OUT",
    "tables CASE --out OUT",
    "size CASE",
    "package CASE --no-report --no-figures -o OUT.zip"};

TEST(TrustCommand, ProgramsOfOthersDoNotRunUnasked) {
  const TheirProgram theirs("unasked");
  for (const char* command : kRunningCommands) {
    const ProgramResult refused = theirs(command);
    EXPECT_EQ(refused.exit_code, 2) << command << refused.out;
    EXPECT_FALSE(theirs.ran()) << command;
    for (const char* reported :
         {"case.yaml:4", "its programs may not run as you: there: /",
          "theirs/there.py (no folder above it is trusted)", "--trust", "mbverify trust "}) {
      EXPECT_NE(refused.err.find(reported), std::string::npos)
          << command << reported << refused.err;
    }
  }
  // Those that run no programs go on.
  for (const char* command : {"render CASE --out OUT/pictures --time 0",
                              "sensitivity CASE --no-search", "converge CASE"}) {
    const ProgramResult other = theirs(command);
    EXPECT_EQ(other.err.find("may not run as you"), std::string::npos) << command << other.err;
    EXPECT_FALSE(theirs.ran()) << command;
  }
  const ProgramResult checked = theirs("check CASE --json OUT.json");
  EXPECT_EQ(checked.exit_code, 0) << checked.out;
  EXPECT_FALSE(theirs.ran());
  EXPECT_NE(checked.out.find("theirs/there.py (not trusted: no folder above it is trusted)"),
            std::string::npos)
      << checked.out;
}

TEST(TrustCommand, TrustOfARunOrOfAFolderLetsThemRun) {
  const TheirProgram theirs("trusted");
  for (const char* command : kRunningCommands) {
    const ProgramResult trusted = theirs(std::string(command) + " --trust --force");
    if (std::string(command).starts_with("package")) {
      EXPECT_TRUE(theirs.ran()) << command << trusted.err;
    }
    const ProgramResult run = theirs(std::string(command) + " --trust");
    if (!std::string(command).starts_with("package")) {
      EXPECT_TRUE(theirs.ran()) << command << run.err;
    }
  }
  EXPECT_FALSE((theirs("run CASE --out OUT --no-report"), theirs.ran()));
  EXPECT_EQ(theirs("trust " + theirs.Folder()).exit_code, 0);
  EXPECT_EQ(theirs("trust").out, fs::canonical(theirs.Folder()).string() + "\n");
  const ProgramResult run = theirs("run CASE --out OUT --no-report");
  EXPECT_TRUE(theirs.ran()) << run.err;
  EXPECT_NE(run.err.find("case.yaml runs programs as you:"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("there.py (in a trusted folder)"), std::string::npos) << run.err;
  EXPECT_NE(run.out.find("caveat: without the witness there"), std::string::npos) << run.out;
  theirs("regress CASE --no-pictures --no-reports --out OUT/regression");
  EXPECT_TRUE(theirs.ran());
  EXPECT_EQ(theirs("trust --remove " + theirs.Folder()).exit_code, 0);
  EXPECT_EQ(theirs("trust").out, "");
  EXPECT_EQ(theirs("run CASE --out OUT --no-report").exit_code, 2);
  EXPECT_EQ(theirs("trust /nowhere/at/all").exit_code, 2);
}

TEST(TrustCommand, AtATerminalTheUserIsAsked) {
  const TheirProgram theirs("asked");
  const std::string run = "run CASE --out OUT --no-report --no-pictures";
  for (const char* no : {"\\n", "n\\n", "x\\n"}) {
    const ProgramResult refused = theirs(run, no);
    EXPECT_EQ(refused.exit_code, 2) << refused.out;
    EXPECT_NE(refused.out.find("Run them?"), std::string::npos) << refused.out;
    EXPECT_FALSE(theirs.ran()) << no;
  }
  EXPECT_TRUE((theirs(run, "y\\n"), theirs.ran()));
  EXPECT_FALSE((theirs(run), theirs.ran()));  // this time means this time
  EXPECT_TRUE((theirs(run, "f\\n"), theirs.ran()));
  EXPECT_TRUE((theirs(run), theirs.ran()));
}

// Names and values of others: nothing that a terminal obeys, nothing endless.
TEST(Terminal, GetsNoEscapesAndNoEndlessValuesOfOthers) {
  const TheirProgram theirs("escapes");
  std::ofstream(theirs.Folder() + "/there.py")
      << "import json\nrows = [line.split(',')[0] for line in open('motion.csv')][1:]\n"
      << "open('traces.csv', 'w').write('time_s,motor.force\\n' + ''.join(t + ',0\\n' for t in "
         "rows))\n"
      << "json.dump({'schema': 'mbverify/witness/1', 'units': 'SI', 'program': "
         "'a\\x1b]0;title\\x07\\u202e\\rb', 'version': '1' * 20000}, open('witness.json', 'w'))\n";
  const ProgramResult loud = theirs("run CASE --trust --out OUT --no-report --no-pictures -v");
  EXPECT_NE(loud.out.find(R"(a\x1b]0;title\x07\u202e\x0db)"), std::string::npos) << loud.out;
  EXPECT_EQ(loud.out.find(std::string(300, '1')), std::string::npos);
  const ProgramResult label = theirs(
      "regress CASE --trust --no-pictures --no-reports --out OUT/regression --label "
      "\"$(printf '=cmd|A1\\033[2J')\"");
  EXPECT_TRUE(fs::exists(theirs.Ran()) || label.exit_code < 2) << label.err;
  const std::string history = "--history OUT/regression/history.sqlite";
  const ProgramResult list = theirs("history list " + history);
  EXPECT_NE(list.out.find(R"(=cmd|A1\x1b[2J)"), std::string::npos) << list.out;
  const ProgramResult csv = theirs("history export " + history);
  EXPECT_NE(csv.out.find(",'=cmd|A1"), std::string::npos) << csv.out;
  for (const ProgramResult& result : {loud, label, list, csv}) {
    EXPECT_EQ((result.out + result.err).find_first_of("\x1b\x07"), std::string::npos);
  }
  const ProgramResult range = theirs("regress CASE --timeout -1");
  EXPECT_EQ(range.exit_code, 2);
  EXPECT_NE(range.err.find("'-1' violates > 0"), std::string::npos) << range.err;
  const std::string endless(20000, 'q');
  for (const std::string& words :
       {"run CASE --set simulation.mode=" + endless, "run CASE --set " + endless + "=1",
        "run " + endless, "run CASE --mode " + endless, "regress CASE --timeout " + endless,
        "run CASE --" + endless, endless, "regress CASE --shard " + endless,
        "sensitivity CASE --size " + endless, "package CASE -o OUT.zip --date " + endless,
        "package --check " + endless, "run CASE --set " + endless, "trust " + endless,
        "merge " + endless, "history list --history " + endless, "model " + endless}) {
    const ProgramResult refused = theirs(words);
    EXPECT_EQ(refused.exit_code, 2) << words.substr(0, 40);
    EXPECT_LT((refused.out + refused.err).size(), 6000U) << words.substr(0, 40);
  }
}

}  // namespace
}  // namespace mbv
