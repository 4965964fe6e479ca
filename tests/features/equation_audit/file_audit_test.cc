// The audit of a file's equations: what is right, nearly right and wrong, and the usual slips.
#include "features/equation_audit/audit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/files.h"
#include "features/equation_audit/quantities.h"
#include "features/equation_audit/slips.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

struct Audited {
  std::optional<AuditTable> table;
  Diagnostics diagnostics;

  [[nodiscard]] const AuditRow& row(size_t k = 0) const { return table->rows.at(k); }
};

Audited Audit(const std::string& name, const std::string& text) {
  const test::TestFolder folder("file_audit");
  Audited audited;
  audited.table = AuditFile(folder.Write(name, text), {}, &audited.diagnostics);
  return audited;
}

std::string Head() {
  return fmt::format(
      "from mbverify.equations import *\n"
      "states('{}', coordinates=['motor'], ranges={{'motor': [0.2, 6.0]}}, rates={{'motor': 5}},\n"
      "       accelerations={{'motor': 20}})\n",
      SourcePath("/examples/closed_form/models/planar_slider_crank/model.yaml"));
}

// One equation in Python.
Audited One(const std::string& gives, const std::string& given, const std::string& arguments,
            const std::string& body) {
  return Audit("equations.py",
               Head() + fmt::format("@equation('(1)', gives='{}', given={{{}}})\n"
                                    "def e(p{}):\n    {}\n",
                                    gives, given, arguments.empty() ? "" : ", " + arguments, body));
}

bool Names(const AuditRow& row, const std::string& words) {
  for (const std::string& slip : row.slips) {
    if (slip.find(words) != std::string::npos) return true;
  }
  return false;
}

std::string SlipsOf(const AuditRow& row) {
  return fmt::format("{} {}: {}", ToText(row.verdict), row.residual_printed,
                     fmt::join(row.slips, "; "));
}

TEST(FileAudit, ConfirmsWhatIsRight) {
  const Audited audited =
      One("slider.velocity[1]", "", "motor, motor_d",
          "s, c = sin(motor), cos(motor); "
          "return -p.r * (s + p.r * s * c / sqrt(p.l**2 - (p.r * s)**2)) * motor_d");
  ASSERT_TRUE(audited.table) << audited.diagnostics.Text();
  EXPECT_EQ(audited.row().verdict, AuditVerdict::kOk) << SlipsOf(audited.row());
  EXPECT_TRUE(audited.row().slips.empty());
  EXPECT_LT(audited.row().residual_printed, 1e-13);
}

// A truth that is perturbed a little is seen; how much of it is right is said.
TEST(FileAudit, SeesSmallErrors) {
  for (const double error : {1e-2, 1e-4, 1e-7}) {
    const Audited audited =
        One("rod.weight[2]", "", "motor",
            fmt::format("return -p.m_rod * p.g * (1 + {} * sin(motor))", error));
    ASSERT_TRUE(audited.table) << audited.diagnostics.Text();
    const AuditRow& row = audited.row();
    EXPECT_EQ(row.verdict, error > 1e-3 ? AuditVerdict::kWrongAsGiven : AuditVerdict::kNearly);
    EXPECT_NEAR(row.digits, -std::log10(error), 0.1);
  }
}

// The six slips that are asked for, and more, each planted and named.
TEST(FileAudit, NamesPlantedSlips) {
  struct Planted {
    const char *gives, *given, *arguments, *body, *named;
  };
  const char* const kVectors =
      "'w': 'rod.angular_velocity', 'v': 'rod.velocity', 'a': 'rod.com.position from rod', "
      "'al': 'rod.angular_acceleration', 'ao': 'rod.acceleration'";
  for (const Planted& planted : {
           // A sign.
           Planted{"slider.velocity[1]", "", "motor, motor_d",
                   "s, c = sin(motor), cos(motor); return (-p.r * s + p.r**2 * s * c / "
                   "sqrt(p.l**2 - (p.r * s)**2)) * motor_d",
                   "'-' for '+' in front of 'p.r**2 * s * c"},
           // Sine for cosine.
           {"slider.position[1]", "", "motor",
            "return p.r * sin(motor) + sqrt(p.l**2 - (p.r * sin(motor))**2)", "'cos' for 'sin'"},
           // A transposed matrix.
           {"crank.rotation", "", "motor",
            "return [[cos(motor), sin(motor), 0], [-sin(motor), cos(motor), 0], [0, 0, 1]]",
            "the transposed matrix"},
           {"rod.com.velocity",
            "'R': 'rod.rotation', 'v': 'rod.velocity in rod', "
            "'w': 'rod.angular_velocity in rod'",
            "R, v, w", "return R.T @ (v + cross(w, Vec(p.l / 2, 0, 0)))", "not transposed"},
           // Exchanged indices and names.
           {"rod.inertia_moment[3]", "'al': 'rod.angular_acceleration[3]'", "al",
            "return -p.I_crank * al", "'I_rod' for 'I_crank'"},
           {"rod.com.position", "", "motor",
            "f = -asin(p.r / p.l * sin(motor)); "
            "return [p.r * sin(motor) + p.l / 2 * sin(f), p.r * cos(motor) + p.l / 2 * cos(f), 0]",
            "element 1 and element 2 exchanged"},
           // A missing factor 1/2, a missing square.
           {"crank.com.position[1]", "", "motor", "return p.r * cos(motor)", "1/2"},
           {"rod.angular_velocity[3]", "", "motor, motor_d",
            "return -p.r * cos(motor) * motor_d / (p.l * sqrt(1 - (p.r/p.l)**2 * sin(motor)))",
            "'sin(motor)' squared"},
           // Degrees.
           {"crank.com.position[1]", "", "motor", "return p.r / 2 * cos(motor * 180 / pi)",
            "'motor' in degrees"},
           {"motor", "", "motor", "return motor * 180 / pi", "π/180"},
           // The direction of an axis.
           {"rod.angular_velocity", "", "motor, motor_d",
            "return [0, 0, p.r * cos(motor) * motor_d / (p.l * sqrt(1 - (p.r/p.l)**2 * "
            "sin(motor)**2))]",
            "the opposite sign"},
           // A missing term that is a known one.
           {"rod.com.acceleration", kVectors, "ao, al, w, a", "return ao + cross(al, a)",
            "w × (w × a)"},
           {"rod.com.velocity", kVectors, "v, w, a", "return v + cross(a, w)",
            "'-' for '+' in front of 'cross(a, w)'"},
           {"rod.inertia_moment[3]", "'al': 'rod.angular_acceleration[3]'", "al",
            "return -p.I_rod * al - p.I_crank * al", "plus I_crank al"},
           // A missing dot.
           {"crank.angular_velocity[3]", "", "motor, motor_d", "return motor + 0 * motor_d",
            "'motor_d' for 'motor'"},
           // A bracket.
           {"rod.com.position[1]", "", "motor",
            "f = -asin(p.r / p.l * sin(motor)); return (p.r * cos(motor) + p.l * cos(f)) * 0.5",
            "' * 0.5' behind ' p.l * cos(f)' alone"},
           // A term too much.
           {"crank.com.position[1]", "", "motor", "return p.r / 2 * cos(motor) + p.l * sin(motor)",
            "without '+ p.l * sin(motor)'"},
       }) {
    const Audited audited = One(planted.gives, planted.given, planted.arguments, planted.body);
    ASSERT_TRUE(audited.table) << audited.diagnostics.Text() << planted.body;
    EXPECT_EQ(audited.row().verdict, AuditVerdict::kWrongAsGiven) << planted.body;
    EXPECT_TRUE(Names(audited.row(), planted.named)) << planted.body << "\n"
                                                     << SlipsOf(audited.row());
  }
}

TEST(FileAudit, FindsTwoSlipsOfSignsAndNames) {
  const Audited audited = One("rod.com.position[1]", "", "motor",
                              "f = -asin(p.r / p.l * sin(motor)); "
                              "return p.l * cos(motor) - p.l / 2 * cos(f)");
  ASSERT_TRUE(audited.table);
  EXPECT_TRUE(Names(audited.row(), "'r' for 'l'")) << SlipsOf(audited.row());
  EXPECT_TRUE(Names(audited.row(), "'+' for '-'")) << SlipsOf(audited.row());
}

// What nothing small makes right is not said to be a slip.
TEST(FileAudit, NamesNothingWhereNothingIsFound) {
  const Audited audited = One("slider.position[1]", "", "motor", "return exp(sin(motor)) * 0.31");
  ASSERT_TRUE(audited.table);
  EXPECT_EQ(audited.row().verdict, AuditVerdict::kWrongAsGiven);
  EXPECT_TRUE(audited.row().slips.empty()) << SlipsOf(audited.row());
}

TEST(FileAudit, SaysTheSameOfFormulas) {
  const Audited audited =
      Audit("equations.yaml",
            fmt::format(R"(
states: {{model: {}, coordinates: [motor], ranges: {{motor: [0.2, 6]}}, rates: {{motor: 5}}}}
audit:
  - {{equation: (1), gives: "slider.position[1]",
     printed: r*cos(motor) + sqrt(l^2 - (r*cos(motor))^2)}}
  - {{equation: (2), gives: "slider.velocity[1]", define: {{s: sin(motor), c: cos(motor)}},
     printed: "-(r*s + r^2*s*c/sqrt(l^2-(r*s)^2))*motor_dd",
     corrected: "-(r*s + r^2*s*c/sqrt(l^2-(r*s)^2))*motor_d"}}
  - {{equation: (3), gives: "crank.com.position[2]", printed: r/2*sin(motor)}}
)",
                        SourcePath("/examples/closed_form/models/planar_slider_crank/model.yaml")));
  ASSERT_TRUE(audited.table) << audited.diagnostics.Text();
  EXPECT_EQ(audited.row(0).verdict, AuditVerdict::kWrongAsGiven);
  EXPECT_TRUE(Names(audited.row(0), "'sin' for 'cos'")) << SlipsOf(audited.row(0));
  EXPECT_EQ(audited.row(1).verdict, AuditVerdict::kWrong);
  EXPECT_TRUE(Names(audited.row(1), "'motor_d' for 'motor_dd'")) << SlipsOf(audited.row(1));
  EXPECT_EQ(audited.row(2).verdict, AuditVerdict::kOk);
}

TEST(FileAudit, JudgesIdentities) {
  const auto verdict = [](const std::string& body) {
    const Audited audited = One("0", "", "motor", body);
    return audited.table ? std::optional(audited.row().verdict) : std::nullopt;
  };
  EXPECT_EQ(verdict("return sin(motor)**2 + cos(motor)**2 - 1"), AuditVerdict::kOk);
  EXPECT_EQ(verdict("return 1e-6 * motor + sin(motor)**2 + cos(motor)**2 - 1"),
            AuditVerdict::kNearly);
  EXPECT_EQ(verdict("return sin(motor)**2 + cos(motor) - 1"), AuditVerdict::kWrongAsGiven);
  // Nothing vanishes that could not be anything else.
  EXPECT_EQ(verdict("return 0"), AuditVerdict::kNotTestable);
  EXPECT_EQ(verdict("return 0 * motor"), AuditVerdict::kNotTestable);
}

TEST(FileAudit, JudgesCorrectedForms) {
  const std::string text = Head() +
                           "@equation('(1)', gives='crank.com.position[1]', corrected='r/2 cos')\n"
                           "def e(p, motor): return p.r * cos(motor)\n"
                           "@e.corrected\ndef _(p, motor): return p.r * cos(motor) / 2\n";
  EXPECT_EQ(Audit("e.py", text).row().verdict, AuditVerdict::kWrong);
  std::string worse = text;
  worse.replace(worse.find("/ 2"), 3, "/ 2.0001");
  EXPECT_EQ(Audit("e.py", worse).row().verdict, AuditVerdict::kWrongAndUnfixed);
  // A print that cannot be evaluated is wrong, and says so.
  std::string broken = text;
  broken.replace(broken.find("return p.r"), 10, "return p.q");
  const Audited audited = Audit("e.py", broken);
  EXPECT_EQ(audited.row().verdict, AuditVerdict::kWrong);
  EXPECT_NE(audited.row().note.find("no parameter 'q'"), std::string::npos) << audited.row().note;
}

TEST(FileAudit, RefusesWhatItCannotUnderstand) {
  struct Wrong {
    std::string text, message;
  };
  const std::string good = "@equation('(1)', gives='motor')\ndef e(p, motor): return motor\n";
  for (const Wrong& wrong : {
           Wrong{Head(), "lists no numbered equations and no closed form"},
           {"from mbverify.equations import *\n" + good, "does not say at which states"},
           {Head() + "@equation('(1)', gives='motr')\ndef e(p, motor): return motor\n",
            "has no quantity 'motr'"},
           {Head() + "@equation('(1)', gives='crank.position[4]')\ndef e(p, motor): return 1\n",
            "has no such element"},
           {Head() + "@equation('(1)', gives='crank.position in absent')\ndef e(p): return 1\n",
            "has no body 'absent'"},
           {Head() + "@equation('(1)', gives='motor')\ndef e(p, x): return x\n",
            "nothing says what its argument 'x' is"},
           {Head() + "@equation('(1)', gives='crank.position')\ndef e(p, motor): return motor\n",
            "gives 1 numbers, and crank.position has 3"},
           {Head() + "@equation('(1)', gives='motor')\ndef e(p, motor): return nothing\n",
            "NameError"},
           {"from mbverify.equations import *\nstates('no_such_model', coordinates=[])\n" + good,
            "there is no model 'no_such_model'"},
           {"from mbverify.equations import *\nstates('four_bar', coordinates=[])\n" + good,
            "has 1 degrees of freedom, and 0 independent coordinates"},
           {"from mbverify.equations import *\nstates('four_bar', coordinates=['motr'])\n" + good,
            "has no coordinate 'motr'"},
           {"from mbverify.equations import *\nstates('four_bar', coordinates=['motor'], "
            "ranges={'x': [1, 2]})\n" +
                good,
            "'x' is not one of the coordinates"},
       }) {
    const Audited audited = Audit("e.py", wrong.text);
    EXPECT_FALSE(audited.table) << wrong.text;
    EXPECT_NE(audited.diagnostics.Text().find(wrong.message), std::string::npos)
        << wrong.message << "\n"
        << audited.diagnostics.Text();
  }
}

// A closed form needs no list of equations: its positions and forces are audited, slips in what
// they call are named, too.
TEST(FileAudit, AuditsClosedForms) {
  const std::string text = ReadWholeFile(SourcePath("/examples/equations/delta.py")).value();
  const auto audit = [&](const std::string& what, const std::string& with) {
    std::string edited = text;
    const size_t at = edited.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    edited.replace(at, what.size(), with);
    const test::TestFolder folder("file_audit");
    Audited audited;
    audited.table = AuditFile(
        folder.Write("delta.py", edited),
        {.samples = 6, .model = SourcePath("/examples/equations/models/delta/model.yaml")},
        &audited.diagnostics);
    EXPECT_TRUE(audited.table) << audited.diagnostics.Text();
    return audited;
  };
  const Audited right = audit("pi / 3", "pi / 3");
  ASSERT_EQ(right.table->rows.size(), 2u);
  for (const AuditRow& row : right.table->rows) {
    EXPECT_EQ(row.verdict, AuditVerdict::kOk) << SlipsOf(row);
  }
  struct Planted {
    const char *what, *with;
    size_t row;
    const char* named;
  };
  for (const Planted& planted :
       {Planted{"p.l**2) /", "p.L**2) /", 0, "'l' for 'L'"},
        {"- p.l**2", "+ p.l**2", 0, "'-' for '+'"},
        {"atan2(-d[2], d[0])", "atan2(d[2], d[0])", 0, "other sign"},
        {"(elbow + wrist) / 2", "(elbow + wrist)", 1, "times 1/2"},
        {"p.c_arm * arm", "p.L * arm", 1, "'c_arm' for 'L'"},
        {" + p.I_arm * turning", "", 1, "plus I_arm times each drive's acceleration"},
        {"along.T", "along", 1, "'along' transposed"}}) {
    const Audited audited = audit(planted.what, planted.with);
    const AuditRow& row = audited.row(planted.row);
    EXPECT_EQ(row.verdict, AuditVerdict::kWrongAsGiven) << planted.what;
    EXPECT_TRUE(Names(row, planted.named)) << planted.what << "\n" << SlipsOf(row);
  }
}

// Formulas are audited alike.
TEST(FileAudit, AuditsClosedFormsOfFormulas) {
  std::string text =
      ReadWholeFile(SourcePath("/examples/equations/planar_slider_crank.formulas.yaml")).value();
  const FileAuditOptions options{
      .samples = 6,
      .model = SourcePath("/examples/closed_form/models/planar_slider_crank/model.yaml")};
  const test::TestFolder folder("file_audit");
  Diagnostics diagnostics;
  auto table = AuditFile(folder.Write("crank.yaml", text), options, &diagnostics);
  ASSERT_TRUE(table) << diagnostics.Text();
  EXPECT_EQ(table->rows.at(1).verdict, AuditVerdict::kOk) << SlipsOf(table->rows.at(1));
  text.replace(text.find("l/2*sin(phi)"), 12, "l/2*cos(phi)");
  table = AuditFile(folder.Write("crank.yaml", text), options, &diagnostics);
  ASSERT_TRUE(table) << diagnostics.Text();
  EXPECT_TRUE(Names(table->rows.at(1), "'sin' for 'cos'")) << SlipsOf(table->rows.at(1));
}

// The four papers' equations as files say what the built-in audits say: what is wrong as printed
// has a right correction. The numbers are those of equations; some are several functions.
TEST(FileAudit, ConfirmsThePapers) {
  struct Paper {
    const char* mechanism;
    size_t rows, wrong;
  };
  for (const Paper& paper : {Paper{"spr_tripod", 38, 12},
                             {"cabin_robot", 63, 28},
                             {"scara_robot", 56, 28},
                             {"stabilizing_platform", 49, 16}}) {
    Diagnostics diagnostics;
    const auto table =
        AuditFile(SourcePath(std::string("/models/") + paper.mechanism + "/equations.py"),
                  {.search = false, .samples = 6}, &diagnostics);
    ASSERT_TRUE(table) << diagnostics.Text();
    EXPECT_EQ(table->rows.size(), paper.rows) << paper.mechanism;
    size_t wrong = 0;
    for (const AuditRow& row : table->rows) {
      EXPECT_TRUE(row.verdict == AuditVerdict::kOk || row.verdict == AuditVerdict::kWrong)
          << paper.mechanism << " " << row.equation << " " << SlipsOf(row);
      wrong += row.verdict == AuditVerdict::kWrong ? 1 : 0;
    }
    EXPECT_EQ(wrong, paper.wrong) << paper.mechanism;
  }
}

// A stiffness entry of an elastic model: K and C are each other's inverse.
TEST(FileAudit, JudgesStiffnesses) {
  const auto audit = [](const std::string& factor) {
    return Audit("e.py",
                 fmt::format("from mbverify.equations import *\n"
                             "states('{}', coordinates=['platform.x', 'platform.y', 'platform.z', "
                             "'platform.yaw'], samples=4)\n"
                             "@equation('K', gives='platform.stiffness[6,6]', "
                             "given={{'C': 'platform.compliance'}})\n"
                             "def e(p, C):\n"
                             "    return linear_solve(C, Vec(0, 0, 0, 0, 0, 1))[5] * {}\n",
                             SourcePath("/models/scara_robot/elastic.yaml"), factor));
  };
  const Audited right = audit("1");
  ASSERT_TRUE(right.table) << right.diagnostics.Text();
  EXPECT_EQ(right.row().verdict, AuditVerdict::kOk) << SlipsOf(right.row());
  EXPECT_GT(right.row().scale, 1e3);
  EXPECT_EQ(audit("1.00001").row().verdict, AuditVerdict::kNearly);
  // A model without beams has none.
  const Audited rigid = One("slider.stiffness", "", "motor", "return motor");
  EXPECT_FALSE(rigid.table);
}

// Quantities along a motion: rates are the derivatives of positions, whatever they are of.
TEST(AuditQuantity, RatesAreDerivatives) {
  for (const char* name : {"spr_tripod", "stewart", "cabin_robot"}) {
    const LoadResult loaded = LoadModel(SourcePath(std::string("/models/") + name + "/model.yaml"));
    ASSERT_TRUE(loaded.mechanism);
    const Mechanism& mechanism = *loaded.mechanism;
    std::vector<Coordinate> drives;
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      drives.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
    }
    for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
      drives.push_back({Coordinate::Kind::kPrescribed, static_cast<int>(p), 0});
    }
    ReducedModel model(mechanism, drives);
    const auto n = model.size();
    VecX v = VecX::LinSpaced(n, 0.05, -0.04), a = VecX::LinSpaced(n, -0.3, 0.2);
    const auto at = [&](double t) {
      AuditState state;
      state.mechanism = &mechanism;
      EXPECT_TRUE(
          model.Move(model.home() + 0.01 * VecX::Ones(n) + v * t + 0.5 * a * t * t, v + a * t, a)
              .ok());
      EXPECT_TRUE(model.Motions(&state.T).ok());
      state.states = model.states();
      return state;
    };
    constexpr double h = 1e-4;
    const AuditState before = at(-h), now = at(0), after = at(h);
    size_t checked = 0;
    const auto check = [&](const std::string& of, const std::string& rate) {
      std::string reason, hint;
      const auto value = AuditQuantity::Parse(of, mechanism, &reason, &hint);
      const auto its_rate = AuditQuantity::Parse(rate, mechanism, &reason, &hint);
      ASSERT_TRUE(value && its_rate) << reason;
      const Argument x = value->At(before), y = value->At(after), z = its_rate->At(now);
      ASSERT_EQ(x.values.size(), z.values.size()) << of;
      for (size_t k = 0; k < z.values.size(); ++k) {
        EXPECT_NEAR((y.values[k] - x.values[k]) / (2 * h), z.values[k], 1e-6)
            << name << " " << rate;
      }
      ++checked;
    };
    for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
      const Body& body = mechanism.bodies[b];
      std::vector<std::string> points = {"", "com."};
      for (const NamedFrame& frame : body.frames) points.push_back(frame.name + ".");
      for (const std::string& point : points) {
        const std::string stem = body.name + "." + point;
        check(stem + "position", stem + "velocity");
        check(stem + "velocity", stem + "acceleration");
      }
      check(body.name + ".angular_velocity", body.name + ".angular_acceleration");
    }
    for (const Drive& drive : mechanism.drives) {
      check(drive.name, drive.name + ".velocity");
      check(drive.name + ".velocity", drive.name + ".acceleration");
    }
    for (const NamedCoordinate& joint : NamedJointCoordinates(mechanism)) {
      check(joint.name, joint.name + ".velocity");
      check(joint.name + ".velocity", joint.name + ".acceleration");
    }
    EXPECT_GT(checked, 20u);
  }
}

TEST(AuditQuantity, HasFramesElementsAndOrigins) {
  const LoadResult loaded = LoadModel(SourcePath("/models/spr_tripod/model.yaml"));
  const Mechanism& mechanism = *loaded.mechanism;
  ReducedModel model(mechanism, {{Coordinate::Kind::kDrive, 0, 0},
                                 {Coordinate::Kind::kDrive, 1, 0},
                                 {Coordinate::Kind::kDrive, 2, 0}});
  const VecX q = model.home() + Vec3(0.02, -0.01, 0.03);
  ASSERT_TRUE(model.Move(q, Vec3(1, 2, 3), Vec3(0, 1, 2)).ok());
  AuditState state;
  state.mechanism = &mechanism;
  ASSERT_TRUE(model.Motions(&state.T).ok());
  state.states = model.states();
  const auto at = [&](const std::string& text) {
    std::string reason, hint;
    const auto quantity = AuditQuantity::Parse(text, mechanism, &reason, &hint);
    EXPECT_TRUE(quantity) << reason;
    return quantity ? quantity->At(state).values : std::vector<double>{};
  };
  const size_t platform = size_t(mechanism.FindBody("platform"));
  const Pose& X = state.states.X_WB[platform];
  const Vec3 w = state.states.V_WB[platform].head<3>();
  const std::vector<double> in = at("platform.angular_velocity in platform");
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(in[size_t(k)], (X.linear().transpose() * w)[k], 1e-15);
  }
  EXPECT_EQ(at("platform.angular_velocity[2]")[0], w[1]);
  EXPECT_EQ(at("platform.rotation[2,3]")[0], X.linear()(1, 2));
  EXPECT_EQ(at("platform.angular_velocity in platform[3]")[0], in[2]);
  const std::vector<double> from = at("leg1.rod.position from platform in platform");
  const Vec3 p = state.states.X_WB[size_t(mechanism.FindBody("leg1.rod"))].translation();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(from[size_t(k)], (X.inverse() * p)[k], 1e-15);
  }
  // The Jacobian takes the coordinates' rates to the twist.
  const std::vector<double> J = at("platform.jacobian");
  ASSERT_EQ(J.size(), 18u);
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(J[size_t(3 * k)] + 2 * J[size_t(3 * k + 1)] + 3 * J[size_t(3 * k + 2)], w[k],
                1e-13);
  }
}

}  // namespace
}  // namespace mbv
