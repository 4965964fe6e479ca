// Code of mechanisms: compiled, run and held against the reference; with slips, it has to differ.
#include "features/code/code.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <random>

#include "base/files.h"
#include "base/worker_pool.h"
#include "model_file/load_model.h"
#include "tests/support/run_program.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180.0;

Mechanism Loaded(const std::string& file) {
  LoadResult loaded = LoadRobot(SourcePath(file), {});
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}
Mechanism Ankle() { return Loaded("/tests/mechanisms/parallel_ankle.yaml"); }

CodeTask TaskOf(const Mechanism& mechanism, const std::vector<std::string>& coordinates = {}) {
  Diagnostics found;
  std::optional<CodeTask> task = ChooseCodeTask(mechanism, coordinates, &found);
  EXPECT_TRUE(task.has_value()) << found.Text();
  return task.value_or(CodeTask());
}

const std::vector<std::string> kAnkle = {"ankle.0", "ankle.1"};
std::vector<CodeRange> AnkleRanges(double share = 1.0) {
  return {{"ankle.0", -50 * share * kDeg, 30 * share * kDeg},
          {"ankle.1", -15 * share * kDeg, 15 * share * kDeg}};
}

std::string FileOf(const CodeResult& result, const std::string& name) {
  for (const auto& [file, content] : result.files) {
    if (file == name) return content;
  }
  ADD_FAILURE() << name;
  return "";
}

std::string Described(const CodeResult& result) {
  return result.diagnostics.Text() + ToText(result);
}

class CodeOfShipped : public testing::TestWithParam<std::string> {};

// In C without a warning, and in Python.
TEST_P(CodeOfShipped, AgreesWithTheReference) {
  const Mechanism mechanism = Loaded("/models/" + GetParam() + "/model.yaml");
  const CodeResult result = MakeCode(mechanism, TaskOf(mechanism), {.states = 60});
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  ASSERT_EQ(result.judgements.size(), 2U);
  EXPECT_TRUE(result.agrees());
  for (const CodeJudgement& judgement : result.judgements) {
    EXPECT_EQ(judgement.not_judged, "");
    EXPECT_TRUE(judgement.agrees()) << Described(result);
    EXPECT_TRUE(judgement.warnings.empty()) << Described(result);
    EXPECT_GT(judgement.states, 30U);
    EXPECT_LT(judgement.position, 1e-12) << Described(result);
  }
}
INSTANTIATE_TEST_SUITE_P(Models, CodeOfShipped, testing::ValuesIn(ShippedModelNames()),
                         [](const auto& at) { return at.param; });

class CodeOfAnkle : public testing::Test {
 protected:
  CodeResult Make(CodeSettings settings) const {
    return MakeCode(mechanism_, TaskOf(mechanism_, kAnkle), settings);
  }
  // A header with more text before its end, judged.
  CodeJudgement Judged(const std::string& header, const std::string& more) {
    const size_t end = header.rfind("#endif");
    const std::filesystem::path file = place_.folder() / "edited.h";
    EXPECT_EQ(WriteFile(file, header.substr(0, end) + more + header.substr(end)), "");
    const CodeResult result = Make({.states = 100, .check = file.string()});
    EXPECT_EQ(result.judgements.size(), 1U) << result.diagnostics.Text();
    EXPECT_FALSE(result.agrees());
    return result.judgements.empty() ? CodeJudgement() : result.judgements[0];
  }
  // `name` is called as `body` says; the original is NAME_.
  static std::string Instead(const std::string& name, const std::string& arguments,
                             const std::string& body) {
    return fmt::format(
        "static inline int slip_{0}({1}) {{\n{2}\n}}\n#define parallel_ankle_{0} slip_{0}\n", name,
        arguments, body);
  }

  const Mechanism mechanism_ = Ankle();
  Program place_{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(CodeOfAnkle, NamesPlantedSlips) {
  const std::string header = FileOf(Make({.states = 20, .compile = false}), "parallel_ankle.h");
  const auto closing = [](const std::string& change) {
    return Instead("close", "parallel_ankle_pose* p, const double to[]",
                   "double q[2];\n" + change + "\nreturn parallel_ankle_close(p, q);");
  };
  const auto forces = [](const std::string& change) {
    return Instead("inverse_dynamics",
                   "const parallel_ankle_pose* p, const double v[], const double a[], const double "
                   "more[], double tau[]",
                   "const int s = parallel_ankle_inverse_dynamics(p, v, a, more, tau);\n" + change +
                       "\nreturn s;");
  };
  const auto positions = [](const std::string& change) {
    return "static inline void slip_actuators(const parallel_ankle_pose* p, double d[]) {\n"
           "  parallel_ankle_actuators(p, d);\n" +
           change + "\n}\n#define parallel_ankle_actuators slip_actuators\n";
  };
  const std::vector<std::pair<std::string, testing::Matcher<std::string>>> slips = {
      {closing("q[0] = to[1]; q[1] = to[0];"), HasSubstr("'ankle.0' and 'ankle.1' are exchanged")},
      {closing("q[0] = to[0]; q[1] = -to[1];"), AllOf(HasSubstr("'ankle.1'"), HasSubstr("sign"))},
      {closing("q[0] = to[0] * 0.017453292519943295; q[1] = to[1] * 0.017453292519943295;"),
       HasSubstr("degrees")},
      {positions("const double t = d[0]; d[0] = d[1]; d[1] = t;"),
       AllOf(HasSubstr("'left' is that of 'right'"), HasSubstr("'right' is that of 'left'"))},
      {positions("d[1] = -d[1];"), HasSubstr("the position of 'right' has the other sign")},
      {positions("d[0] *= 57.29577951308232;"), HasSubstr("the position of 'left' is in degrees")},
      {forces("{ const double t = tau[0]; tau[0] = tau[1]; tau[1] = t; }"),
       HasSubstr("the force of 'left' is that of 'right'")},
      {forces("tau[0] = -tau[0];"), HasSubstr("the force of 'left' has the other sign")}};
  for (const auto& [more, named] : slips) {
    const CodeJudgement judgement = Judged(header, more);
    EXPECT_EQ(judgement.not_judged, "") << more;
    EXPECT_THAT(judgement.slip, named) << more;
  }
}

// The left crank turned over: another way to close the loop with the same ankle.
TEST_F(CodeOfAnkle, NamesAnotherBranch) {
  const std::string header = FileOf(Make({.states = 20, .compile = false}), "parallel_ankle.h");
  const std::string flipped = Instead("close", "parallel_ankle_pose* p, const double to[]",
                                      "const int s = parallel_ankle_close(p, to);\n"
                                      "p->x[2] += 3.1;\np->x[4] -= 3.1;\n"
                                      "return s != 0 ? s : parallel_ankle_reach(p->x, to) == 0 && "
                                      "parallel_ankle_prepare(p) ? 0 : 2;");
  const CodeJudgement judgement = Judged(header, flipped);
  EXPECT_EQ(judgement.not_judged, "");
  EXPECT_THAT(judgement.slip, HasSubstr("another branch"));
}

TEST_F(CodeOfAnkle, DiffersFromAModelThatIsSlightlyAnother) {
  const std::string header = FileOf(Make({.states = 20, .compile = false}), "parallel_ankle.h");
  LoadOptions longer;
  longer.overrides = {{"crank", 0.05 * (1.0 + 1e-7)}};
  LoadResult loaded = LoadRobot(SourcePath("/tests/mechanisms/parallel_ankle.yaml"), longer);
  ASSERT_TRUE(loaded.mechanism.has_value());
  const std::filesystem::path file = place_.folder() / "parallel_ankle.h";
  ASSERT_EQ(WriteFile(file, header), "");
  const CodeResult result = MakeCode(*loaded.mechanism, TaskOf(*loaded.mechanism, kAnkle),
                                     {.states = 100, .check = file.string()});
  ASSERT_EQ(result.judgements.size(), 1U);
  EXPECT_FALSE(result.agrees());
  EXPECT_GT(result.judgements[0].position, 1e-9);
}

TEST_F(CodeOfAnkle, ThatDoesNotCompileDiffers) {
  const std::string header = FileOf(Make({.states = 20, .compile = false}), "parallel_ankle.h");
  EXPECT_THAT(Judged(header, "this is no C\n").not_judged, HasSubstr("does not compile"));
}

// The table: all of the range is proved, the same poses as by the way from home, and fewer steps
// than proved leave more.
TEST_F(CodeOfAnkle, StartsFromAProvedTable) {
  const CodeResult result = Make({.ranges = AnkleRanges(), .cells = 32, .states = 300});
  ASSERT_EQ(result.judgements.size(), 3U) << Described(result);
  EXPECT_TRUE(result.agrees()) << Described(result);
  EXPECT_EQ(result.table_share, 1.0);
  EXPECT_LE(result.table_bound, 1e-12);
  EXPECT_EQ(result.judgements[1].language, "C, from the table");
  EXPECT_EQ(result.judgements[1].states, 300U);
  std::string fewer = FileOf(result, "parallel_ankle.h");
  for (size_t at = fewer.find("i < 3; ++i) {\n      if (!parallel_ankle_step_");
       at != std::string::npos;
       at = fewer.find("i < 3; ++i) {\n      if (!parallel_ankle_step_", at)) {
    fewer[at + 4] = '1';
  }
  const std::filesystem::path file = place_.folder() / "fewer.h";
  ASSERT_EQ(WriteFile(file, fewer), "");
  const CodeResult worse = Make({.ranges = AnkleRanges(),
                                 .cells = 32,
                                 .table = &*result.table,
                                 .states = 100,
                                 .check = file.string()});
  ASSERT_EQ(worse.judgements.size(), 2U) << Described(worse);
  EXPECT_TRUE(worse.judgements[0].agrees());
  EXPECT_FALSE(worse.judgements[1].agrees()) << Described(worse);
}

// Ends before the loops do not close any more: nothing out of reach is served.
TEST_F(CodeOfAnkle, TableEndsWhereTheRodsDo) {
  const std::vector<CodeRange> wide = {{"ankle.0", -1.5, 1.2}, {"ankle.1", -0.5, 0.5}};
  const CodeResult result = Make({.ranges = wide, .cells = 32, .states = 1000});
  ASSERT_EQ(result.judgements.size(), 3U) << Described(result);
  EXPECT_GT(result.table_share, 0.3);
  EXPECT_LT(result.table_share, 0.95);
  EXPECT_TRUE(result.judgements[1].agrees()) << Described(result);
  EXPECT_EQ(result.judgements[1].only_one, 0U) << Described(result);
  // With all cells marked as proved it serves what nothing reaches.
  std::string all = FileOf(result, "parallel_ankle.h");
  const size_t from = all.find("{", all.find("proved[] = ")), to = all.find("}", from);
  std::string bytes;
  for (int k = 0; k < 32 * 32 / 8; ++k) bytes += (k > 0 ? ", " : "") + std::string("255");
  all.replace(from + 1, to - from - 1, bytes);
  const std::filesystem::path file = place_.folder() / "all.h";
  ASSERT_EQ(WriteFile(file, all), "");
  const CodeResult wrong = Make({.ranges = wide,
                                 .cells = 32,
                                 .table = &*result.table,
                                 .states = 1000,
                                 .check = file.string()});
  ASSERT_EQ(wrong.judgements.size(), 2U) << Described(wrong);
  EXPECT_TRUE(wrong.judgements[0].agrees()) << Described(wrong);
  EXPECT_FALSE(wrong.judgements[1].agrees()) << Described(wrong);
}

TEST_F(CodeOfAnkle, LooksUpWithinTheBound) {
  CodeResult result = Make({.ranges = AnkleRanges(0.5), .cells = 16, .states = 1000});
  ASSERT_TRUE(result.lookup.has_value()) << Described(result);
  EXPECT_EQ(result.lookup_share, 1.0);
  for (Eigen::Index k = 0; k < 2; ++k) {
    EXPECT_GT(result.lookup_error[k], 0.0);
    EXPECT_LE(result.lookup_error[k], result.lookup->bound[k]);
    EXPECT_LT(result.lookup->bound[k], 100.0 * result.lookup_error[k]);
  }
  // Slopes against differences.
  VecX m, up, down;
  MatX slopes, none;
  std::mt19937_64 random(3);  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<double> one(-0.1, 0.1);
  for (int i = 0; i < 50; ++i) {
    const VecX q = Eigen::Vector2d(one(random), one(random));
    const VecX h = Eigen::Vector2d(1e-9, 0.0);
    ASSERT_TRUE(result.lookup->At(q, &m, &slopes));
    ASSERT_TRUE(result.lookup->At(q + h, &up, &none) && result.lookup->At(q - h, &down, &none));
    EXPECT_NEAR(slopes(0, 0), (up[0] - down[0]) / 2e-9, 1e-5);
  }
  EXPECT_FALSE(result.lookup->At(Eigen::Vector2d(1.0, 0.0), &m, &slopes));
  // A wrong node is beyond the bound.
  result.lookup_error[0] = result.lookup->bound[0] * 1.001;
  EXPECT_FALSE(result.agrees());
}

// The bound follows the spacing's square, as of interpolation.
TEST_F(CodeOfAnkle, LookupBoundFallsWithTheSquareOfTheSpacing) {
  const CodeResult wide =
      Make({.ranges = AnkleRanges(0.5), .cells = 16, .states = 20, .compile = false});
  const CodeResult narrow =
      Make({.ranges = AnkleRanges(0.25), .cells = 16, .states = 20, .compile = false});
  ASSERT_TRUE(wide.lookup && narrow.lookup);
  const double ratio = wide.lookup->bound[0] / narrow.lookup->bound[0];
  EXPECT_GT(ratio, 3.5);
  EXPECT_LT(ratio, 40.0);
}

// Of what a controller calls in each cycle.
TEST_F(CodeOfAnkle, NeedsLittleStackAndNoLibrary) {
  const CodeResult result =
      Make({.ranges = AnkleRanges(0.2), .cells = 16, .states = 20, .compile = false});
  const std::filesystem::path folder = place_.folder();
  for (const auto& [name, content] : result.files) ASSERT_EQ(WriteFile(folder / name, content), "");
  ASSERT_EQ(WriteFile(folder / "cycle.c", R"(#include "parallel_ankle.h"
#include "parallel_ankle_lookup.h"
int cycle(parallel_ankle_pose* p, const double q[], const double v[], const double a[], double d[],
          double tau[]);
int cycle(parallel_ankle_pose* p, const double q[], const double v[], const double a[], double d[],
          double tau[]) {
  const int s = parallel_ankle_at(p, q);
  if (s != parallel_ankle_OK) return s;
  if (!parallel_ankle_lookup(q, d, tau)) return parallel_ankle_OUTSIDE;
  parallel_ankle_actuators(p, d);
  return parallel_ankle_inverse_dynamics(p, v, a, 0, tau);
}
)"),
            "");
  const auto call = [&](const std::string& command) {
    return place_.Script("cd '" + folder.string() + "' && " + command);
  };
  const ProgramResult built =
      call("cc -std=c99 -O2 -Wall -Wextra -Wconversion -pedantic -Werror -fstack-usage -c cycle.c");
  ASSERT_EQ(built.exit_code, 0) << built.err;
  std::ifstream usage(folder / "cycle.su");
  std::string where, kind;
  int bytes = 0, sum = 0;
  while (usage >> where >> bytes >> kind) {
    EXPECT_EQ(kind, "static") << where;
    sum += bytes;
  }
  EXPECT_GT(sum, 0);
  EXPECT_LE(sum, 2048);
  const ProgramResult names = call("nm -u cycle.o");
  for (const char* name : {"malloc", "free", "mem", "printf"}) {
    EXPECT_THAT(names.out, testing::Not(HasSubstr(name)));
  }
}

class CodeByCompiler : public CodeOfAnkle, public testing::WithParamInterface<std::string> {};

// The self-test of the files, as their users build it.
TEST_P(CodeByCompiler, PassesItsSelfTest) {
  const std::string& command = GetParam();
  const std::string compiler = command.substr(0, command.find(' '));
  const CodeResult result =
      Make({.ranges = AnkleRanges(0.2), .cells = 16, .states = 20, .compile = false});
  const std::filesystem::path folder = place_.folder();
  for (const auto& [name, content] : result.files) ASSERT_EQ(WriteFile(folder / name, content), "");
  const bool arm = compiler.starts_with("arm");
  const ProgramResult done =
      place_.Script("cd '" + folder.string() + "' && " + command +
                    " parallel_ankle_test.c -o self -lm && " + (arm ? "qemu-arm " : "") + "./self");
  ASSERT_EQ(done.exit_code, 0) << done.out << done.err;
  EXPECT_EQ(done.err, "");
  EXPECT_LT(std::strtod(done.out.c_str(), nullptr), 1e-12);
  // A wrong number in it is seen.
  std::string wrong = FileOf(result, "parallel_ankle.h");
  const size_t row = wrong.find("tests[][");
  const size_t digit =
      wrong.find_first_of("123456789", wrong.find('\n', wrong.find('{', wrong.find('\n', row))));
  wrong[digit] = wrong[digit] == '1' ? '2' : '1';
  ASSERT_EQ(WriteFile(folder / "parallel_ankle.h", wrong), "");
  EXPECT_NE(
      place_
          .Script("cd '" + folder.string() + "' && " + command +
                  " parallel_ankle_test.c -o self -lm && " + (arm ? "qemu-arm " : "") + "./self")
          .exit_code,
      0);
}
// Those that are installed; that for ARM runs in qemu-arm.
std::vector<std::string> Compilers() {
  std::vector<std::string> commands = {
      "cc -std=c99 -O2 -Wall -Wextra -Wconversion -pedantic -Werror"};
  if (FindProgram("clang")) {
    commands.emplace_back("clang -std=c99 -O1 -Wall -Wextra -Wconversion -pedantic -Werror");
  }
  if (FindProgram("arm-none-eabi-gcc") && FindProgram("qemu-arm")) {
    commands.emplace_back(
        "arm-none-eabi-gcc -std=c99 -O2 -Wall -Wextra -Werror --specs=rdimon.specs");
  }
  return commands;
}
INSTANTIATE_TEST_SUITE_P(Compilers, CodeByCompiler, testing::ValuesIn(Compilers()),
                         [](const auto& at) {
                           std::string name = at.param;
                           name = name.substr(0, name.find(' '));
                           std::erase_if(name, [](char c) {
                             return std::isalnum(static_cast<unsigned char>(c)) == 0;
                           });
                           return name;
                         });

// J̇ against differences of J along the motion.
TEST_F(CodeOfAnkle, JacobianRateIsTheJacobiansDerivative) {
  const CodeResult result = Make({.states = 20, .compile = false});
  ASSERT_EQ(WriteFile(place_.folder() / "parallel_ankle.py", FileOf(result, "parallel_ankle.py")),
            "");
  ASSERT_EQ(WriteFile(place_.folder() / "rate.py", R"(import parallel_ankle as code
q, v, h = [0.1, -0.12], [0.7, -1.1], 1e-5
def jacobian(t):
    p = code.Pose()
    assert code.close(p, [x + t * y for x, y in zip(q, v)]) == code.OK
    return code.jacobian(p)
p = code.Pose()
assert code.close(p, q) == code.OK
worst = max(abs(r - (a - b) / (2 * h)) for rates, up, down in
            zip(code.jacobian_rate(p, v), jacobian(h), jacobian(-h)) for r, a, b in zip(rates, up, down))
largest = max(abs(r) for row in code.jacobian_rate(p, v) for r in row)
assert largest > 0.1
print(worst)
)"),
            "");
  const ProgramResult done =
      place_.Script("cd '" + place_.folder().string() + "' && python3 rate.py");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_LT(std::strtod(done.out.c_str(), nullptr), 1e-8);
}

// A plate on a ball that three legs turn: the ball damps, has an armature and dry friction.
std::string Plate(double damping) {
  return R"(<mujoco model="plate"><worldbody>
<body name="table"><joint name="turn" axis="0 0.6 0.8"/>
<inertial pos="0 0.1 0" mass="2" diaginertia="0.1 0.1 0.1"/>
<site name="a0" pos="0.4 0 0.1"/><site name="a1" pos="-0.2 0.35 0.1"/>
<site name="a2" pos="-0.2 -0.35 0.1"/>
<body name="plate" pos="0.05 0 0.5" euler="6 -11 17">
<joint type="ball" pos="0.02 0.01 -0.1" armature="0.05" frictionloss="0.2" damping=")" +
         fmt::format("{}", damping) + R"("/>
<inertial pos="0.02 -0.03 0.05" mass="1.5" diaginertia="0.03 0.02 0.04"/>
<site name="b0" pos="0.1 0.28 0"/><site name="b1" pos="-0.3 -0.05 0"/>
<site name="b2" pos="0.19 -0.23 0"/></body></body></worldbody><tendon>
<spatial name="leg0"><site site="a0"/><site site="b0"/></spatial>
<spatial name="leg1"><site site="a1"/><site site="b1"/></spatial>
<spatial name="leg2"><site site="a2"/><site site="b2"/></spatial></tendon>
<actuator><motor name="turn" joint="turn"/><motor name="leg0" tendon="leg0"/>
<motor name="leg1" tendon="leg1"/><motor name="leg2" tendon="leg2"/></actuator></mujoco>
)";
}

TEST(Code, TakesWhatActsOnBalls) {
  const Program place("balls");
  const auto loaded = [&](double damping) {
    const std::filesystem::path file = place.folder() / "plate.xml";
    EXPECT_EQ(WriteFile(file, Plate(damping)), "");
    LoadResult result = LoadRobot(file.string(), {});
    EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
    return result.mechanism.value_or(Mechanism());
  };
  const Mechanism mechanism = loaded(0.3);
  ASSERT_GE(mechanism.elements.size(), 9U);
  const CodeResult result = MakeCode(mechanism, TaskOf(mechanism), {.states = 100});
  ASSERT_EQ(result.judgements.size(), 2U) << Described(result);
  EXPECT_TRUE(result.agrees()) << Described(result);
  for (const CodeJudgement& judgement : result.judgements) {
    EXPECT_LT(judgement.force, 1e-10) << Described(result);
  }
  const std::filesystem::path header = place.folder() / "plate.h";
  ASSERT_EQ(WriteFile(header, FileOf(result, result.name + ".h")), "");
  const Mechanism other = loaded(0.3 * (1.0 + 1e-6));
  const CodeResult differs =
      MakeCode(other, TaskOf(other), {.states = 100, .check = header.string()});
  ASSERT_EQ(differs.judgements.size(), 1U) << Described(differs);
  EXPECT_LT(differs.judgements[0].position, 1e-10);
  EXPECT_GT(differs.judgements[0].force, CodeJudgement::kLimit);
  EXPECT_FALSE(differs.agrees());
}

// What formulas cannot say is refused or said.
TEST(Code, SaysWhatItHasNot) {
  const Mechanism redundant = Loaded("/models/redundant_five_bar/model.yaml");
  EXPECT_THAT(MakeCode(redundant, TaskOf(redundant), {.states = 20, .compile = false}).notes,
              testing::Contains(HasSubstr("no forces of actuators: 3 for 2 coordinates")));
  const Mechanism bushed = Loaded("/models/bushed_linkage/model.yaml");
  EXPECT_THAT(MakeCode(bushed, TaskOf(bushed), {.states = 20, .compile = false}).notes,
              testing::Contains(HasSubstr("no forces: there is a bushing")));
  const Mechanism journal = Loaded("/models/journal_crank/model.yaml");
  EXPECT_THAT(MakeCode(journal, TaskOf(journal), {.states = 20, .compile = false}).notes,
              testing::Contains(HasSubstr("grows with its load")));
}

TEST(Code, RefusesCoordinatesThatDoNotDo) {
  const Mechanism ankle = Ankle();
  const std::vector<std::pair<std::vector<std::string>, std::string>> wrong = {
      {{"ankle.0"}, "2 degrees of freedom"},
      {{"ankle.0", "ankle.1", "left"}, "depend on those before: left"},
      {{"ankle.0", "ankle.3"}, "no coordinate 'ankle.3'"},
      {{"ankle.0", "ankle.0"}, "chosen twice"}};
  for (const auto& [coordinates, why] : wrong) {
    Diagnostics found;
    EXPECT_FALSE(ChooseCodeTask(ankle, coordinates, &found).has_value());
    EXPECT_THAT(found.Text(), HasSubstr(why));
  }
}

// Names of a model become such as C and Python have, and nothing in them ends a comment.
TEST(Code, TakesAnyNames) {
  Mechanism mechanism = Loaded("/models/four_bar/model.yaml");
  ASSERT_FALSE(mechanism.outputs.empty());
  mechanism.outputs[0].name = "a */ this is no C /* \"\"\" b";
  mechanism.drives[0].name = "*/ nor this \"\"\"";
  mechanism.name = "4-bar */";
  const CodeResult result =
      MakeCode(mechanism, TaskOf(mechanism), {.states = 20, .origin = "a */ b \"\"\" \\ c"});
  EXPECT_TRUE(result.agrees()) << Described(result);
  EXPECT_EQ(result.name, "m_4_bar___");
}

}  // namespace
}  // namespace mbv
