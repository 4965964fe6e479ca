// What goes wrong outside the program: numbers beyond all bounds, huge files, files that cannot be
// read, folders that cannot be written, a full disk. (Killed runs: cli_test.cc, tests/regress.)
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>

#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSoundScenario = "scenarios/slider_crank/turn.yaml";

class RobustnessTest : public testing::Test {
 protected:
  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};

  std::string Write(const std::string& name, const std::string& content) const {
    const fs::path path = mbverify.folder() / name;
    std::ofstream(path, std::ios::binary) << content;
    return path.string();
  }
  /// A shell script that calls "$mbverify" itself.
  [[nodiscard]] ProgramResult Shell(const std::string& script) const {
    const std::string out = (mbverify.folder() / "shell_out").string();
    const std::string err = (mbverify.folder() / "shell_err").string();
    const int status = std::system(("cd '" + std::string(kSourceDir) + "' && mbverify='" +
                                    std::string(kBinaryDir) + "/mbverify' && (" + script + ") >'" +
                                    out + "' 2>'" + err + "'")
                                       .c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, ReadAll(out), ReadAll(err)};
  }
  [[nodiscard]] std::string Run(const std::string& arguments) const {
    return "run --no-pictures -q --out '" + mbverify.Out() + "' " + arguments;
  }
};

// Files below a folder, hidden ones included.
std::vector<std::string> FilesBelow(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST_F(RobustnessTest, NumbersBeyondAllBoundsAreRefusedWithTheirKey) {
  for (const auto& [set, message] : std::vector<std::pair<std::string, std::string>>{
           {"parameters.crank=.nan", "parameters.crank = '.nan' is not a finite number"},
           {"parameters.crank=-.inf", "parameters.crank = '-.inf' is not a finite number"},
           {"parameters.crank=1e300", "parameters.crank = '1e300' violates |number| <= 1e+30"},
           {"parameters.offset=-1e31", "parameters.offset = '-1e31' violates |number| <= 1e+30"},
           {"parameters.m_crank=1e300", "parameters.m_crank = '1e300' violates |number| <= 1e+30"},
           {"parameters.m_crank=1e16", "bodies.crank: mass = 1e+16 violates mass <= 1e+15 kg"},
           {"parameters.crank=1e13", "bodies.crank: its frame 'end' is too far away"},
           {"parameters.rod=1e-310", "violate I > 0"},
           {"motion.duration_s=.inf", "motion.duration_s = '.inf' is not a finite number"},
           {"motion.duration_s=1e12", "violate 1 <= duration_s/sample_s <= 1e+06"},
           {"motion.sample_s=1e-310", "violate 1 <= duration_s/sample_s <= 1e+06"},
           {"simulation.step_s=1e-12", "violates motion.duration_s / step_s <= 1e+07"},
           {"simulation.step_s=1e-310", "violates motion.duration_s / step_s <= 1e+07"},
           {"simulation.step_s=1e12", "n · step_s"},
       }) {
    const ProgramResult result = mbverify(Run(std::string(kSoundScenario) + " --set " + set));
    EXPECT_EQ(result.exit_code, 2) << set << "\n" << result.err;
    EXPECT_NE(result.err.find(message), std::string::npos) << set << "\n" << result.err;
  }
  EXPECT_FALSE(fs::exists(mbverify.Out()));
  const ProgramResult steps =
      mbverify(std::string("converge --steps 4e-9,2e-9,1e-9 ") + kSoundScenario);
  EXPECT_EQ(steps.exit_code, 2);
  EXPECT_NE(steps.err.find("1e-09 s violates motion.duration_s / step"), std::string::npos)
      << steps.err;
}

TEST_F(RobustnessTest, AMassTooSmallForTheEngineIsNamedAndNothingIsCompared) {
  const ProgramResult result = mbverify("run --no-pictures --out '" + mbverify.Out() + "' " +
                                        kSoundScenario + " --set parameters.m_crank=1e-310");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.out.find("mass and inertia of moving bodies must be larger"), std::string::npos)
      << result.out;
}

TEST_F(RobustnessTest, FilesOf10000LinesAreReadInSeconds) {
  // A chain of bodies would be refused by number; parameters may be many.
  std::string model = "name: long\nparameters:\n";
  for (int i = 0; i < 10000; ++i) model += "  p" + std::to_string(i) + ": 0.5\n";
  model +=
      "bodies: {bar: {mass: p9999, inertia: [1, 1, 1]}}\n"
      "joints: {pivot: {kind: revolute, parent: world, child: bar, axis: y}}\n"
      "drives: {motor: {kind: joint, joint: pivot}}\n";
  std::string broken = "name: long\nbodies:\n";
  for (int i = 0; i < 10000; ++i) broken += "  b" + std::to_string(i) + ": {mas: 1}\n";
  std::string scenario =
      "mechanism: slider_crank\nmotion:\n  duration_s: 1\n  sample_s: 0.01\n"
      "  commands:\n    motor:\n      - home\n";
  for (int i = 0; i < 10000; ++i)
    scenario += "      - {sine: {amplitude: 1e-5, frequency_hz: 1}}\n";
  scenario += "analytic: none\n";
  const auto start = std::chrono::steady_clock::now();
  const ProgramResult good = mbverify("check " + Write("model.yaml", model));
  EXPECT_EQ(good.exit_code, 0) << good.err.substr(0, 2000);
  const ProgramResult bad = mbverify("check " + Write("broken.yaml", broken));
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_NE((bad.out + bad.err).find("more findings are left out"), std::string::npos);
  (void)mbverify("check " + Write("scenario.yaml", scenario));
  // 1 s each on an idle machine; the limit only reports seconds from minutes.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST_F(RobustnessTest, WhatCannotBeReadIsBadInput) {
  fs::create_directories(mbverify.folder() / "folder.yaml");
  // /proc/self/mem can be opened, but reading it fails.
  const std::string folder = (mbverify.folder() / "folder.yaml").string();
  std::vector<std::string> calls = {Run("'" + folder + "'"), "converge '" + folder + "'"};
  for (const std::string& file :
       {std::string("/proc/self/mem"), (mbverify.folder() / "missing.yaml").string(),
        Write("empty.yaml", ""), Write("zeros.yaml", std::string(4096, '\0'))}) {
    calls.insert(calls.end(), {"check '" + file + "'", Run("'" + file + "'")});
  }
  for (const std::string& call : calls) {
    const ProgramResult result = mbverify(call);
    EXPECT_EQ(result.exit_code, 2) << call << "\n" << result.err;
    EXPECT_NE((result.out + result.err).find("error"), std::string::npos) << call;
  }
}

TEST_F(RobustnessTest, EveryCommandNamesAFolderThatCannotBeMade) {
  const std::string file = Write("file", "x");
  for (const std::string& command :
       {"run --no-pictures --out '" + file + "/out' " + kSoundScenario,
        "converge --steps 0.004,0.002,0.001 --out '" + file + "/out' " + kSoundScenario,
        "render --at 0 --size 64x64 --out '" + file + "/out' " + kSoundScenario,
        "regress --no-pictures --out '" + file + "/out' " + kSoundScenario,
        "model slider_crank --format mjcf --out '" + file + "/model.xml'"}) {
    const ProgramResult result = mbverify(command);
    EXPECT_EQ(result.exit_code, command.starts_with("regress") ? 2 : 3) << command << result.err;
    EXPECT_NE(result.err.find("Not a directory"), std::string::npos) << command << result.err;
  }
  EXPECT_EQ(ReadAll(file), "x");
}

// A file-size limit stands in for a full disk: writes end short in the same way, with another
// reason. The shell ignores the signal that would come with it.
TEST_F(RobustnessTest, AFullDiskIsNamedAndTheOldResultStays) {
  const std::string run = "\"$mbverify\" " + Run(kSoundScenario);
  ASSERT_EQ(Shell(run).exit_code, 0);
  const std::vector<std::string> before = FilesBelow(mbverify.Out());
  const fs::path summary = fs::path(mbverify.Out()) / "slider_crank" / "turn" / "summary.json";
  const std::string old = ReadAll(summary);
  ASSERT_GT(fs::file_size(summary.parent_path() / "traces.csv"), 8u * 1024u);
  const ProgramResult full = Shell("ulimit -f 8; " + run);
  EXPECT_EQ(full.exit_code, 3);
  EXPECT_NE(full.err.find("cannot write"), std::string::npos) << full.err;
  EXPECT_NE(full.err.find("File too large"), std::string::npos) << full.err;
  EXPECT_EQ(FilesBelow(mbverify.Out()), before);
  EXPECT_EQ(ReadAll(summary), old);
  // Nothing of a first result either.
  fs::remove_all(mbverify.Out());
  EXPECT_EQ(Shell("ulimit -f 8; " + run).exit_code, 3);
  EXPECT_TRUE(FilesBelow(mbverify.Out()).empty());
  EXPECT_EQ(Shell(run).exit_code, 0);
}

TEST_F(RobustnessTest, AFullDiskLeavesNoHalfOfASingleFile) {
  const fs::path file = mbverify.folder() / "model.xml";
  const ProgramResult full = Shell(
      "ulimit -f 2; \"$mbverify\" model scara_robot --format mjcf --out '" + file.string() + "'");
  EXPECT_EQ(full.exit_code, 3);
  EXPECT_NE(full.err.find("File too large"), std::string::npos) << full.err;
  for (const std::string& left : FilesBelow(mbverify.folder())) {
    EXPECT_EQ(left.find("model.xml"), std::string::npos) << left;
  }
}

TEST_F(RobustnessTest, ResultsThatCannotBePrintedAreAnError) {
  for (const std::string& command : {std::string("list"), Run(kSoundScenario),
                                     std::string("model slider_crank --format mjcf")}) {
    const ProgramResult result = Shell("\"$mbverify\" " + command + " >/dev/full");
    EXPECT_EQ(result.exit_code, 3) << command << "\n" << result.err;
    EXPECT_NE(result.err.find("cannot write to standard output"), std::string::npos)
        << command << "\n"
        << result.err;
  }
  // No stderr to report to either.
  EXPECT_EQ(Shell("\"$mbverify\" " + Run(kSoundScenario) + " >/dev/full 2>/dev/full").exit_code, 3);
}

// Commands that write, with where they write to and a lower bound of how many bytes one file has.
struct Writer {
  const char* name;
  const char* arguments;  // OUT: a folder
  int kib;
};
class DiskTrouble : public RobustnessTest, public testing::WithParamInterface<Writer> {
 protected:
  [[nodiscard]] std::string Call(const std::string& out) const {
    std::string arguments = GetParam().arguments;
    arguments.replace(arguments.find("OUT"), 3, out);
    return "\"$mbverify\" " + arguments;
  }
};

// No half of a result stays, neither where it should go nor in the folder of temporary files.
TEST_P(DiskTrouble, IsNamedAndLeavesNothing) {
  const fs::path out = mbverify.folder() / "disk", scratch = mbverify.folder() / "scratch";
  fs::create_directories(out);
  fs::create_directories(scratch);
  // What it prints goes into a pipe, which has no limit.
  const ProgramResult full = Shell("( export TMPDIR='" + scratch.string() + "'; ulimit -f " +
                                   std::to_string(GetParam().kib) + "; " + Call(out.string()) +
                                   " 2>&1 >/dev/null; echo \"code $?\" ) | cat");
  EXPECT_NE(full.out.find("code 3"), std::string::npos) << full.out;
  EXPECT_NE(full.out.find("File too large"), std::string::npos) << full.out;
  EXPECT_TRUE(FilesBelow(out).empty()) << FilesBelow(out).front();
  EXPECT_TRUE(fs::is_empty(scratch));
  // A file system that takes no file, whoever asks.
  const ProgramResult refused = Shell(Call("/proc/self/fd"));
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_NE(refused.err.find("/proc/self/fd"), std::string::npos) << refused.err;
}

INSTANTIATE_TEST_SUITE_P(
    AllWriters, DiskTrouble,
    testing::ValuesIn(std::vector<Writer>{
        {"run", "run -q --no-pictures --out OUT scenarios/slider_crank/turn.yaml", 4},
        {"run_json", "audit spr_tripod --json OUT/a.json", 2},
        {"stiffness", "stiffness scara_robot --no-simulation --out OUT", 2},
        {"workspace", "workspace spr_tripod --out OUT", 4},
        {"figures", "figures scenarios/slider_crank/turn.yaml --out OUT", 4},
        {"tables", "tables scenarios/slider_crank/turn.yaml --out OUT", 0},
        {"converge", "converge scenarios/slider_crank/turn.yaml --steps 4e-3,2e-3,1e-3 --out OUT",
         1},
        {"model", "model slider_crank --format mjcf --out OUT/m.xml", 1},
        {"check", "check scenarios/slider_crank/turn.yaml --json OUT/c.json", 0},
        {"list", "list --json OUT/l.json", 1},
        {"init", "init mine --into OUT", 0},
        {"mutate", "sensitivity four_bar/turn_inverse --json OUT/m.json", 2},
        {"size", "size scenarios/slider_crank/motor.yaml --json OUT/s.json", 0},
        {"package", "package scenarios/slider_crank/turn.yaml -o OUT/p.zip", 4}}),
    [](const auto& info) { return std::string(info.param.name); });

// `mbverify … | head`: a reader that goes away is reported like any other lost output.
TEST_F(RobustnessTest, AReaderThatGoesAwayIsReportedAndIsNotASilentDeath) {
  for (const std::string& command :
       {std::string("list"), std::string("audit spr_tripod"), Run(kSoundScenario),
        std::string("model scara_robot --format mjcf")}) {
    const ProgramResult result =
        Shell("{ sleep 0.3; \"$mbverify\" " + command + "; echo \"code $?\" >&2; } | true");
    EXPECT_NE(result.err.find("cannot write to standard output"), std::string::npos)
        << command << result.err;
    EXPECT_NE(result.err.find("code 3"), std::string::npos) << command << result.err;
  }
}

TEST_F(RobustnessTest, ATerminatedCommandLeavesNothingInTheFolderOfTemporaryFiles) {
  const fs::path scratch = mbverify.folder() / "scratch";
  fs::create_directories(scratch);
  // It ends when its scratch folder is there; then one that is killed, and one that finds it.
  const auto end = [&](const char* signal) {
    return Shell(
        "export TMPDIR='" + scratch.string() + "'; \"$mbverify\" package -o '" +
        (mbverify.folder() / "p.zip").string() +
        "' scenarios/stabilizing_platform/sea_state.yaml & pid=$!; for i in $(seq 200); do "
        "test -n \"$(ls -A '" +
        scratch.string() + "'/*/inputs 2>/dev/null)\" && break; sleep 0.05; done; kill -" + signal +
        " $pid; wait $pid");
  };
  EXPECT_EQ(end("TERM").exit_code, 128 + SIGTERM);
  EXPECT_TRUE(fs::is_empty(scratch));
  EXPECT_EQ(end("KILL").exit_code, 128 + SIGKILL);
  EXPECT_FALSE(fs::is_empty(scratch));
  const ProgramResult next =
      Shell("export TMPDIR='" + scratch.string() + "'; \"$mbverify\" package -o '" +
            (mbverify.folder() / "q.zip").string() +
            "' --no-report --no-figures scenarios/four_bar/turn_inverse.yaml");
  EXPECT_EQ(next.exit_code, 0) << next.err;
  EXPECT_TRUE(fs::is_empty(scratch));
}

// A slip that names a model where a summary should go.
TEST_F(RobustnessTest, NoSummaryReplacesWhatMbverifyDidNotWrite) {
  const std::string model = "name: mine\nbodies: {}\n";
  for (const std::string& command :
       {std::string("regress --no-pictures --out '") + mbverify.Out() +
            "' scenarios/slider_crank/turn.yaml --json ",
        std::string("regress --no-pictures --out '") + mbverify.Out() +
            "' scenarios/slider_crank/turn.yaml --junit ",
        std::string("audit spr_tripod --json "), std::string("list --json "),
        std::string("model slider_crank --format mjcf --out "),
        std::string("check scenarios/slider_crank/turn.yaml --json ")}) {
    const std::string file = Write("model.yaml", model);
    const ProgramResult result = mbverify(command + "'" + file + "'");
    EXPECT_EQ(result.exit_code, 2) << command << result.err;
    EXPECT_NE(result.err.find("mbverify did not write it"), std::string::npos) << result.err;
    EXPECT_EQ(ReadAll(file), model) << command;
  }
  EXPECT_FALSE(fs::exists(mbverify.Out())) << "refused before anything ran";
  // Other JSON than its own; what it wrote is replaced.
  const std::string json = Write("package.json", "{\"name\": \"mine\"}");
  EXPECT_EQ(mbverify("list --json '" + json + "'").exit_code, 2);
  const std::string own = (mbverify.folder() / "own.json").string();
  EXPECT_EQ(mbverify("list --json '" + own + "'").exit_code, 0);
  EXPECT_EQ(mbverify("list --json '" + own + "'").exit_code, 0);
}

TEST_F(RobustnessTest, ARegressionOnAFullDiskReportsWhyEachScenarioFailed) {
  const ProgramResult full = Shell("ulimit -f 40; \"$mbverify\" regress --no-pictures --out '" +
                                   mbverify.Out() + "' " + kSoundScenario);
  EXPECT_EQ(full.exit_code, 2) << "its own files do not fit, either";
  EXPECT_NE(full.out.find("exit code 3, expected 0: "), std::string::npos) << full.out;
  EXPECT_NE(full.out.find("File too large"), std::string::npos) << full.out;
}

TEST_F(RobustnessTest, AFolderWithoutFilesIsNotFoundInOrder) {
  const fs::path folder = mbverify.folder() / "empty";
  fs::create_directories(folder);
  for (const std::string& call :
       {"check '" + folder.string() + "'", Run("'" + folder.string() + "'"),
        "regress --no-pictures --out '" + mbverify.Out() + "' '" + folder.string() + "'"}) {
    const ProgramResult result = mbverify(call);
    EXPECT_EQ(result.exit_code, 2) << call;
    EXPECT_NE((result.out + result.err).find("in this folder"), std::string::npos) << call;
  }
}

TEST_F(RobustnessTest, PictureSizesAreWholeNumbersWithinBounds) {
  for (const std::string& size : {std::string("640.5x480"), std::string("10x480"),
                                  std::string("1e9x480"), std::string("480x9000")}) {
    const ProgramResult result = mbverify("render --at 0 --out '" + mbverify.Out() + "' --size " +
                                          size + " " + kSoundScenario);
    EXPECT_EQ(result.exit_code, 2) << size;
    EXPECT_NE(result.err.find("is not a whole number from 64 to 8192"), std::string::npos)
        << size << result.err;
  }
}

}  // namespace
}  // namespace mbv
