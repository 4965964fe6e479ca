// A user's equations as a closed form: right as the reference, wrong where they are wrong, refused
// with their own line.
#include "equations/equations.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/text.h"
#include "model_file/load_model.h"
#include "reference/reference.h"
#include "tests/support/crank_equations.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

Mechanism SliderCrank(const std::map<std::string, double>& overrides = {}) {
  LoadOptions options;
  options.overrides = overrides;
  LoadResult loaded =
      LoadModel(SourcePath("/examples/closed_form/models/planar_slider_crank/model.yaml"), options);
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

Motion Turning() {
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.02;
  Profile profile = Constant(0.4);
  profile.terms.emplace_back(SineTerm{2.0, 0.7, 0.3});
  motion.commands.push_back({"motor", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, profile});
  return motion;
}

const std::string kPython = test::kCrankEquations + R"(    return [torque]

@output("slider.x", "m")
def slider(p, theta):
    return points(p, theta)[2]
)";

const char* const kFormulas = R"(
equations_of: planar_slider_crank
commands: {theta: motor}
define:
  phi: -asin(r/l*sin(theta))
  x1: r/2*cos(theta)
  y1: r/2*sin(theta)
  x2: r*cos(theta) + l/2*cos(phi)
  y2: r*sin(theta) + l/2*sin(phi)
  x3: r*cos(theta) + l*cos(phi)
drives: {motor: theta}
forces:
  motor: >-
    m_crank*(x1_dd*d(x1, theta) + (y1_dd + g)*d(y1, theta)) + I_crank*theta_dd
    + m_rod*(x2_dd*d(x2, theta) + (y2_dd + g)*d(y2, theta)) + I_rod*phi_dd*d(phi, theta)
    + m_slider*x3_dd*d(x3, theta)
outputs: {slider.x: x3}
covers:
  crank.mass: m_crank
  crank.com: [r/2, 0, null]
  crank.inertia: [null, null, I_crank]
  rod.mass: m_rod
  rod.com: [l/2, 0, null]
  rod.inertia: [null, null, I_rod]
  slider.mass: m_slider
  gravity: [0, -g, null]
)";

struct Made {
  FileForm form;
  Diagnostics diagnostics;
};

Made Make(const std::string& name, const std::string& text, const Mechanism& mechanism,
          const Motion& motion) {
  const test::TestFolder folder("file_form");
  Made made;
  made.form = MakeFileForm(folder.Write(name, text), mechanism, motion, &made.diagnostics);
  return made;
}
Made Make(const std::string& name, const std::string& text) {
  return Make(name, text, SliderCrank(), Turning());
}

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

// Largest difference of the motor's torque from the reference's, over its RMS.
double ForceError(const std::string& name, const std::string& text) {
  const Mechanism mechanism = SliderCrank({{"m_rod", 1.7}, {"r", 0.12}});
  const Motion motion = Turning();
  const test::TestFolder folder("file_form");
  Diagnostics diagnostics;
  // The file must be there as long as its form.
  const FileForm made = MakeFileForm(folder.Write(name, text), mechanism, motion, &diagnostics);
  EXPECT_TRUE(made.closed_form) << diagnostics.Text();
  if (!made.closed_form) return kNan;
  const ClosedFormRun run = RunClosedForm(mechanism, motion, made.closed_form.get());
  EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  const ReferenceRun truth = RunReference(mechanism, motion);
  const int a = run.trace.Find(Quantity::kForce, "motor");
  const int b = truth.trace.Find(Quantity::kForce, "motor");
  const VecX force = truth.trace.values.col(b);
  const VecX error = run.trace.values.col(a) - force;
  return error.lpNorm<Eigen::Infinity>() / std::sqrt(force.squaredNorm() / double(force.size()));
}

TEST(FileForm, AgreesWithTheReference) {
  EXPECT_LT(ForceError("crank.py", kPython), 1e-12);
  EXPECT_LT(ForceError("crank.yaml", kFormulas), 1e-12);
}

TEST(FileForm, IsWrongWhereItsEquationsAre) {
  EXPECT_GT(ForceError("crank.py", Replaced(kPython, "p.g, rod[0]", "1.0001 * p.g, rod[0]")), 1e-6);
  EXPECT_GT(ForceError("crank.yaml", Replaced(kFormulas, "x3_dd*d", "1.0001*x3_dd*d")), 1e-6);
}

TEST(FileForm, GivesTheSignalsOfOtherWitnesses) {
  const Made made = Make("crank.yaml", kFormulas);
  ASSERT_TRUE(made.form.closed_form) << made.diagnostics.Text();
  const std::vector<Channel> channels = made.form.closed_form->extra_channels();
  ASSERT_EQ(channels.size(), 1u);
  EXPECT_EQ(channels[0].name, "slider.x");
  EXPECT_EQ(channels[0].quantity, Quantity::kPose);
}

TEST(FileForm, SaysWhatItDoesNotState) {
  const Made unchecked = Make("crank.py", kPython);
  EXPECT_NE(unchecked.form.unchecked.find("does not state what its equations take for granted"),
            std::string::npos);
  EXPECT_NE(unchecked.form.unchecked.find("never read: theta_home"), std::string::npos)
      << unchecked.form.unchecked;
  EXPECT_EQ(Make("crank.yaml", kFormulas).form.unchecked, "");
}

TEST(FileForm, IsNotAppliedToAnotherMechanism) {
  Mechanism moved = SliderCrank();
  moved.bodies[size_t(moved.FindBody("rod"))].p_BoBcm_B.y() += 1e-6;
  const Made made = Make("crank.yaml", kFormulas, moved, Turning());
  EXPECT_FALSE(made.form.closed_form);
  ASSERT_EQ(made.form.uncovered.size(), 1u);
  EXPECT_NE(made.form.uncovered[0].message.find("body rod: centre of mass y"), std::string::npos)
      << made.form.uncovered[0].message;
  // What is of no influence may be anything.
  Mechanism beside = SliderCrank();
  beside.bodies[size_t(beside.FindBody("rod"))].p_BoBcm_B.z() += 0.01;
  EXPECT_TRUE(Make("crank.yaml", kFormulas, beside, Turning()).form.closed_form);
}

TEST(FileForm, IsNotAppliedToOtherCommandsAndLoads) {
  Motion motion = Turning();
  motion.commands[0].name = "slider.x";
  const Made made = Make("crank.py", kPython, SliderCrank(), motion);
  ASSERT_EQ(made.form.uncovered.size(), 1u) << made.diagnostics.Text();
  EXPECT_NE(made.form.uncovered[0].message.find("takes motor, and the motion commands slider.x"),
            std::string::npos);
  Motion loaded = Turning();
  Load push;
  push.name = "push";
  push.body = 1;
  loaded.loads.push_back(std::move(push));
  const Made with_load = Make("crank.py", kPython, SliderCrank(), loaded);
  ASSERT_EQ(with_load.form.uncovered.size(), 1u);
  EXPECT_NE(with_load.form.uncovered[0].message.find("take no loads, and the motion has push"),
            std::string::npos);
}

TEST(FileForm, WarnsOfRatesThatAreNotDerivatives) {
  const std::string right =
      kPython + "\n@closed_form.rates\ndef rates(p, q, qd): return [qd.theta]\n";
  EXPECT_TRUE(Make("crank.py", right).diagnostics.empty());
  const Made wrong = Make("crank.py", Replaced(right, "[qd.theta]", "[1.000001 * qd.theta]"));
  ASSERT_EQ(wrong.diagnostics.findings().size(), 1u);
  EXPECT_EQ(wrong.diagnostics.findings()[0].severity, Severity::kWarning);
  EXPECT_NE(wrong.diagnostics.findings()[0].message.find("its rates are not the derivatives"),
            std::string::npos);
  const std::string jacobian = kPython + "\n@closed_form.jacobian\ndef J(p, theta): return [[2]]\n";
  EXPECT_EQ(Make("crank.py", jacobian).diagnostics.findings().size(), 1u);
}

// Whatever is wrong with a file is an error of bad input, with the file's own line.
TEST(FileForm, RefusesWrongFiles) {
  struct Wrong {
    std::string name, text, message;
    int line;
  };
  const std::string head =
      "from mbverify.equations import *\n@closed_form(\"planar_slider_crank\")\n"
      "def drives(p, motor):\n    return [motor]\n@closed_form.forces\n"
      "def forces(p, q, qd, qdd):\n";
  const std::string yaml = kFormulas;
  for (const Wrong& wrong : {
           Wrong{"a.py", "def f(:\n", "SyntaxError", 1},
           {"a.py", "\nimport no_such_module\n", "ModuleNotFoundError", 2},
           {"a.py", "1/0\n", "ZeroDivisionError", 1},
           {"a.py", "x = 1\n", "declares no closed form", 0},
           {"a.py", "import os\nos._exit(3)\n", "ended with exit code 3", 0},
           {"a.py", "raise SystemExit(3)\n", "SystemExit", 1},
           {"a.py", head + "    return [1, 2]\n", "2 values where the mechanism has 1 drives", 0},
           {"a.py", head + "    return {'motr': 1}\n", "the mechanism has no drive 'motr'", 0},
           {"a.py", head + "    return [nothing]\n", "NameError", 7},
           {"a.py", head + "    return ['a']\n", "gave a str where a number is wanted", 0},
           {"a.py", head + "    pass\n", "gave None: is there a return?", 0},
           {"a.py", head + "    return [p.m_crnk]\n", "the model has no parameter 'm_crnk'", 7},
           {"a.py", Replaced(head, "planar", "round") + "    return [0]\n",
            "declares closed forms of round_slider_crank, not of planar_slider_crank", 0},
           {"a.yaml", "a: [", "", 1},
           {"a.yaml", Replaced(yaml, "equations_of: ", "equation_of: "),
            "unknown key 'equation_of'", 2},
           {"a.yaml", Replaced(yaml, "r/2*cos(theta)", "r/2*cos(teta)"), "'teta' is not known", 6},
           {"a.yaml", Replaced(yaml, "crank.mass:", "crnk.mass:"), "is no quantity", 0},
           {"a.yaml", Replaced(yaml, "[0, -g, null]", "[0, -g]"), "has 2 numbers", 0},
           {"a.txt", "x", "is no file of equations", 0},
       }) {
    const Made made = Make(wrong.name, wrong.text);
    EXPECT_FALSE(made.form.closed_form) << wrong.text;
    ASSERT_TRUE(made.diagnostics.has_errors()) << wrong.text;
    bool found = false;
    for (const Finding& finding : made.diagnostics.findings()) {
      found = found || (finding.message.find(wrong.message) != std::string::npos &&
                        (wrong.line == 0 || finding.line == wrong.line));
    }
    EXPECT_TRUE(found) << wrong.message << " at " << wrong.line << ":\n" << made.diagnostics.Text();
  }
}

// A file's formulas are read at once, and all that is wrong with them is said.
TEST(FileForm, FindsAllErrorsOfFormulas) {
  std::string text = Replaced(kFormulas, "r/2*cos(theta)", "r/2*cos(teta)");
  text = Replaced(text, "r/2*sin(theta)", "r/2 sin(theta)");
  text = Replaced(text, "x3}", "x4}");
  EXPECT_EQ(Make("crank.yaml", text).diagnostics.findings().size(), 3u)
      << Make("crank.yaml", text).diagnostics.Text();
}

// A pose out of reach is reported by the run, with its time.
TEST(FileForm, TellsWhereItHasNoPose) {
  const Mechanism mechanism = SliderCrank({{"r", 0.1}, {"l", 0.11}});
  Mechanism longer = mechanism;
  for (Parameter& parameter : longer.parameters) {
    if (parameter.name == "r") parameter.value = 0.14;
  }
  for (const auto& [name, text] :
       {std::pair{"crank.py", kPython.c_str()}, {"crank.yaml", kFormulas}}) {
    const test::TestFolder folder("file_form");
    const std::string file =
        folder.Write(name, name == std::string("crank.yaml")
                               ? std::string(text).substr(0, std::string(text).find("covers:"))
                               : text);
    Diagnostics diagnostics;
    Motion motion = Turning();
    motion.commands[0].profile = Constant(0.0);
    motion.commands[0].profile.terms.emplace_back(SineTerm{1.5, 0.25, 0.0});
    const FileForm made = MakeFileForm(file, longer, motion, &diagnostics);
    ASSERT_TRUE(made.closed_form) << diagnostics.Text();
    const ClosedFormRun run = RunClosedForm(longer, motion, made.closed_form.get());
    EXPECT_EQ(run.summary.stop, Stop::kUnreachable) << run.summary.message;
    EXPECT_GT(run.summary.time_s, 0.0);
    EXPECT_NE(run.summary.message.find(name), std::string::npos) << run.summary.message;
  }
}

}  // namespace
}  // namespace mbv
