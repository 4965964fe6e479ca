// Materials, sections, beams, servos and parameters of another file.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/mechanisms/slip.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

// A bracket of two beams on a motor, and a rod hinged to its end.
const char kBracket[] = R"(name: bracket
parameters: {E: 210e9, b: 0.02}
materials:
  steel: {youngs_modulus: E, poisson: 0.3}
  alloy: {youngs_modulus: 71e9, shear_modulus: 26.7e9}
sections:
  rod: {round: {diameter_mm: 8}}
  pipe: {tube: {outer_diameter: 0.02, inner_diameter: 0.016}}
  bar: {rectangular: {y: b/2, z: b, torsion: printed}}
  own: {general: {area: 1, I_y: 2, I_z: 3, torsion: 4}}
bodies:
  bracket:
    frames: {A: [0, 0, 0], B: [0, 1, 0], C: [0, 1, 2], middle: [0, 0.5, 0]}
    beams:
      up: {from: A, to: B, section: bar, material: steel, z: [1, 1, 0]}
      out: {from: B, to: C, section: own, material: alloy, z: y}
  rod:
    frames: {end: [0.3, 0, 0]}
    beams: {rod: {to: end, section: rod, material: steel, z: y}}
joints:
  motor: {kind: revolute, parent: world, child: bracket.A, axis: z}
  hinge: {kind: revolute, parent: bracket.C, child: rod, axis: z}
drives:
  motor: {kind: joint, joint: motor, stiffness: 5e3}
  elbow: {kind: joint, joint: hinge, compliance: b/1000}
outputs: {tip: rod.end}
)";

Mechanism Loaded(const std::string& text) {
  const LoadResult result = LoadModelText(text, "m.yaml");
  EXPECT_EQ(result.diagnostics.Text(), "");
  return result.mechanism.value_or(Mechanism{});
}

Section SectionOf(const std::string& described) {
  const Mechanism m = Loaded(Replaced(kBracket, "{round: {diameter_mm: 8}}", described));
  EXPECT_EQ(m.beams.size(), 3u);
  return m.beams.size() == 3 ? m.beams[2].section : Section{};
}

constexpr double kFewRoundings = 32 * kEps;  // of a few operations, relative

TEST(ElasticModel, BeamsHaveTheirPlacesAxesAndMaterials) {
  const Mechanism m = Loaded(kBracket);
  ASSERT_EQ(m.beams.size(), 3u);
  const Beam& up = m.beams[0];
  EXPECT_EQ(up.name, "bracket.up");
  EXPECT_EQ(m.beams[1].name, "bracket.out");
  EXPECT_EQ(m.beams[2].name, "rod") << "the only beam of a body has the body's name";
  EXPECT_EQ(m.bodies[up.body].name, "bracket");
  EXPECT_DOUBLE_EQ(up.length(), 1.0);
  // x along the beam; z as given, made perpendicular; right-handed.
  Mat3 axes;
  axes << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  EXPECT_LT((up.R_BE - axes).norm(), kFewRoundings);
  for (const Beam& beam : m.beams) {
    EXPECT_LT((beam.R_BE.transpose() * beam.R_BE - Mat3::Identity()).norm(), kFewRoundings);
    EXPECT_NEAR(beam.R_BE.determinant(), 1.0, kFewRoundings);
    EXPECT_LT((beam.p_from + beam.length() * beam.R_BE.col(0) - beam.p_to).norm(), kFewRoundings);
  }
  EXPECT_DOUBLE_EQ(up.youngs_modulus, 210e9);
  EXPECT_DOUBLE_EQ(up.shear_modulus, 210e9 / 2.6);
  EXPECT_DOUBLE_EQ(m.beams[1].shear_modulus, 26.7e9);
}

TEST(ElasticModel, SectionsHaveTheirTextbookValues) {
  const Section rod = SectionOf("{round: {diameter: 2}}");
  EXPECT_NEAR(rod.area, std::numbers::pi, kFewRoundings * 4);
  EXPECT_NEAR(rod.I_y, std::numbers::pi / 4, kFewRoundings);
  EXPECT_NEAR(rod.I_z, std::numbers::pi / 4, kFewRoundings);
  EXPECT_NEAR(rod.torsion, std::numbers::pi / 2, kFewRoundings);
  const Section pipe = SectionOf("{tube: {outer_diameter: 4, inner_diameter: 2}}");
  EXPECT_NEAR(pipe.area, 3 * std::numbers::pi, kFewRoundings * 10);
  EXPECT_NEAR(pipe.I_y, 15 * std::numbers::pi / 4, kFewRoundings * 12);
  const Section own = Loaded(kBracket).beams[1].section;
  EXPECT_EQ(own.area + 10 * own.I_y + 100 * own.I_z + 1000 * own.torsion, 4321);
}

TEST(ElasticModel, ARectangleIsSofterAcrossItsShortEdge) {
  const Section bar = Loaded(kBracket).beams[0].section;
  EXPECT_NEAR(bar.area, 2e-4, 1e-4 * kFewRoundings);
  EXPECT_NEAR(bar.I_y, 0.01 * std::pow(0.02, 3) / 12, 1e-8 * kFewRoundings);
  EXPECT_NEAR(bar.I_z, 0.02 * std::pow(0.01, 3) / 12, 1e-8 * kFewRoundings);
  EXPECT_NEAR(bar.torsion, 0.02 * 1e-6 * (1.0 / 3 - 0.105), 1e-8 * kFewRoundings);
}

TEST(ElasticModel, TorsionOfARectangleIsThatOfTheTables) {
  // [Timoshenko, Goodier, §109, table]: k1 of J = k1 a b³ with four digits.
  const struct {
    double ratio, k1;
  } table[] = {{1.0, 0.1406}, {1.2, 0.166}, {1.5, 0.196},
               {2.0, 0.229},  {3.0, 0.263}, {10.0, 0.312}};
  for (const auto& [ratio, k1] : table) {
    const double J =
        SectionOf("{rectangular: {y: 1, z: " + std::to_string(ratio) + "}}").torsion / ratio;
    EXPECT_NEAR(J, k1, 6e-4) << "a table with three digits, a/b = " << ratio;
  }
  // Which edge is y does not matter; words and numbers choose the formula.
  EXPECT_DOUBLE_EQ(SectionOf("{rectangular: {y: 1, z: 2}}").torsion,
                   SectionOf("{rectangular: {y: 2, z: 1, torsion: series}}").torsion);
  EXPECT_DOUBLE_EQ(SectionOf("{rectangular: {y: 1, z: 2, torsion: 1}}").torsion,
                   SectionOf("{rectangular: {y: 1, z: 2, torsion: printed}}").torsion);
}

TEST(ElasticModel, ServosAreStiffCompliantOrLocked) {
  const Mechanism m = Loaded(kBracket);
  EXPECT_DOUBLE_EQ(m.drives[0].stiffness, 5e3);
  EXPECT_DOUBLE_EQ(m.drives[1].stiffness, 5e4);
  for (const char* locked : {", compliance: 0}", "}"}) {
    const std::string text = Replaced(kBracket, ", stiffness: 5e3}", locked);
    EXPECT_TRUE(std::isinf(Loaded(text).drives[0].stiffness));
  }
}

TEST(ElasticModel, PartsSeeTheirOwnMaterialsThenTheModels) {
  const std::string text = R"(name: two
parameters: {E: 1}
materials: {steel: {youngs_modulus: E, poisson: 0}}
sections: {rod: {round: {diameter: 1}}}
parts:
  limb:
    parameters: {E: 2, x: 1}
    materials: {steel: {youngs_modulus: 10*E, poisson: 0}}
    bodies: {link: {frames: {end: [x, 0, 0]}, beams: {b: {to: end, section: rod, material: steel}}}}
    joints: {mount: {kind: fixed, parent: world, child: link}}
instances: {one: {part: limb}, two: {part: limb, E: 3, x: 2}}
bodies: {base: {frames: {end: [1, 0, 0]}, beams: {b: {to: end, section: rod, material: steel}}}}
joints: {mount: {kind: fixed, parent: world, child: base}}
)";
  const Mechanism m = Loaded(text);
  ASSERT_EQ(m.beams.size(), 3u);
  EXPECT_EQ(m.beams[0].youngs_modulus, 1);
  EXPECT_EQ(m.beams[1].youngs_modulus, 20);
  EXPECT_EQ(m.beams[2].youngs_modulus, 30);
  EXPECT_EQ(m.beams[2].name, "two.link");
  EXPECT_EQ(m.beams[2].length(), 2);
}

class BracketWith : public testing::TestWithParam<Slip> {};

TEST_P(BracketWith, ASlipIsReported) { ExpectReported(kBracket, GetParam()); }

const Slip kElasticSlips[] = {
    {"NoSuchSection", "section: bar", "section: bra",
     "m.yaml:15:37: error: bodies.bracket.beams.up.section = 'bra': there is no such section\n"
     "  hint: did you mean 'bar'?"},
    {"NoSuchMaterial", "section: rod, material: steel", "section: rod, material: stele",
     "bodies.rod.beams.rod.material = 'stele': there is no such material\n"
     "  hint: did you mean 'steel'?"},
    {"NoMaterial", "section: rod, material: steel", "section: rod",
     "bodies.rod.beams.rod: 'material' is missing"},
    {"YoungsModulus", "youngs_modulus: E", "youngs_modulus: -E",
     "materials.steel.youngs_modulus = -210000000000 violates youngs_modulus > 0"},
    {"NoYoungsModulus", "youngs_modulus: E, ", "", "materials.steel: 'youngs_modulus' is missing"},
    {"ShearModulus", "shear_modulus: 26.7e9", "shear_modulus: 0",
     "materials.alloy.shear_modulus = 0 violates shear_modulus > 0"},
    {"NeitherShearNorPoisson", ", poisson: 0.3", "", "materials.steel: 'shear_modulus' is missing"},
    {"Poisson", "poisson: 0.3", "poisson: 0.6",
     "materials.steel.poisson = 0.6 violates -1 < poisson <= 0.5"},
    {"Both", "poisson: 0.3", "poisson: 0.3, shear_modulus: 8e10",
     "materials.steel has both poisson and shear_modulus"},
    {"OddModuli", "shear_modulus: 26.7e9", "shear_modulus: 10e9",
     "m.yaml:5:10: warning: materials.alloy: these moduli make Poisson's ratio 2.55"},
    {"UnknownKind", "round:", "circular:", "sections.rod: unknown key 'circular'"},
    {"TwoKinds", "{round: {diameter_mm: 8}}", "{round: {diameter_mm: 8}, tube: {}}",
     "sections.rod has 2 kinds, one is needed"},
    {"Diameter", "diameter_mm: 8", "diameter_mm: 0",
     "sections.rod.round.diameter_mm = 0 violates diameter > 0"},
    {"Wall", "inner_diameter: 0.016", "inner_diameter: 0.03",
     "sections.pipe.tube: 0.03 and 0.02 violate inner_diameter < outer_diameter"},
    {"Torsion", "torsion: printed", "torsion: 2",
     "sections.bar.rectangular.torsion = 2 is neither series (0) nor printed (1)"},
    {"Edge", "y: b/2", "y: -b/2", "sections.bar.rectangular.y = -0.01 violates y > 0"},
    {"GeneralKey", "I_y: 2, ", "", "sections.own.general: 'I_y' is missing"},
    {"NoLength", "from: B, to: C", "from: B, to: B",
     "bodies.bracket.beams.out: its ends are the same point"},
    {"NoSuchFrame", "from: B, to: C", "from: B, to: D",
     "bodies.bracket.beams.out.to = 'D': body 'bracket' has no such frame"},
    {"ParallelAxis", "z: [1, 1, 0]", "z: [0, -2, 0]",
     "bodies.bracket.beams.up.z is parallel to the beam"},
    {"AxisNeeded", ", z: [1, 1, 0]", "", "bodies.bracket.beams.up: 'z' is missing"},
    {"NotConnected", "from: B, to: C", "from: [0.1, 1, 0], to: C",
     "m.yaml:16:7: error: beam 'bracket.out' is not connected with the other beams of body "
     "'bracket'"},
    {"WithinABeam", "from: B, to: C", "from: [0, 0.5, 0], to: C",
     "beam 'bracket.out' ends at [0, 0.5, 0] within beam 'bracket.up'\n"
     "  hint: cut 'bracket.up' there"},
    {"JointWithinABeam", "  hinge: {kind",
     "  brace: {kind: spherical, parent: bracket.middle, child: rod}\n"
     "  hinge: {kind",
     "m.yaml:22:3: error: joint 'brace' sits at [0, 0.5, 0] of body 'bracket', where no beam ends"},
    {"Stiffness", "stiffness: 5e3", "stiffness: -1",
     "drives.motor.stiffness = -1 violates stiffness > 0"},
    {"Compliance", "compliance: b/1000", "compliance: -b",
     "drives.elbow.compliance = -0.02 violates compliance >= 0"},
    {"StiffnessAndCompliance", "stiffness: 5e3", "stiffness: 5e3, compliance: 0",
     "drives.motor has both stiffness and compliance"},
    {"BeamName", "up: {from", "u.p: {from", "bodies.bracket.beams: 'u.p' is not a name"},
    {"BeamKey", "to: C, section", "to: C, color: red, section",
     "bodies.bracket.beams.out: unknown key 'color'"},
    {"MaterialName", "alloy: {youngs", "al loy: {youngs", "materials: 'al loy' is not a name"},
};

INSTANTIATE_TEST_SUITE_P(Slips, BracketWith, testing::ValuesIn(kElasticSlips),
                         [](const auto& info) { return std::string(info.param.name); });

class OtherFiles : public testing::Test {
 protected:
  [[nodiscard]] std::string Write(const std::string& name, const std::string& text) const {
    return folder_.Write(name, text);
  }
  static constexpr const char* kRest =
      "bodies: {b: {}}\njoints: {j: {kind: fixed, parent: world, child: b}}\n";

 private:
  test::TestFolder folder_{std::string("parameters_") +
                           testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(OtherFiles, GiveTheirParametersAndTheOwnWin) {
  (void)Write("base.yaml", "name: x\nparameters: {a: 1, b: 2*a, d: {value: 5, unit: m}}\n");
  (void)Write("middle.yaml", "name: x\nparameters_from: base.yaml\nparameters: {c: a + b}\n");
  const std::string file = Write("own.yaml", std::string("name: x\nparameters_from: middle.yaml\n"
                                                         "parameters: {a: 10, e: c}\n") +
                                                 kRest);
  LoadOptions options;
  options.overrides["d"] = 7;
  const LoadResult result = LoadModel(file, options);
  ASSERT_TRUE(result.mechanism) << result.diagnostics.Text();
  const Mechanism& m = *result.mechanism;
  ASSERT_EQ(m.parameters.size(), 5u) << "each name once";
  EXPECT_EQ(m.ParameterValue("a"), 10);
  EXPECT_EQ(m.ParameterValue("b"), 20) << "expressions of the other file see the own values";
  EXPECT_EQ(m.ParameterValue("e"), 30);
  EXPECT_EQ(m.ParameterValue("d"), 7) << "overrides win over all";
}

TEST_F(OtherFiles, FindingsNameTheFileTheyAreIn) {
  (void)Write("base.yaml", "name: x\nparameters: {a: 1/nothing}\n");
  const std::string file =
      Write("own.yaml", std::string("name: x\nparameters_from: base.yaml\n") + kRest);
  const std::string text = LoadModel(file).diagnostics.Text();
  EXPECT_NE(text.find("base.yaml:2:17: error: parameters.a = '1/nothing' has the unknown symbol"),
            std::string::npos)
      << text;
}

TEST_F(OtherFiles, InACircleAreRefused) {
  (void)Write("base.yaml", "name: x\nparameters_from: own.yaml\n");
  const std::string file =
      Write("own.yaml", std::string("name: x\nparameters_from: base.yaml\n") + kRest);
  const std::string text = LoadModel(file).diagnostics.Text();
  EXPECT_NE(text.find("base.yaml:2:18: error: parameters_from = 'own.yaml' leads back to a file"),
            std::string::npos)
      << text;
}

TEST_F(OtherFiles, ThatCannotBeReadAreReported) {
  const std::string file =
      Write("own.yaml", std::string("name: x\nparameters_from: nowhere.yaml\n") + kRest);
  const std::string text = LoadModel(file).diagnostics.Text();
  EXPECT_NE(text.find("own.yaml:2:18: error: parameters_from = 'nowhere.yaml' cannot be read"),
            std::string::npos)
      << text;
}

TEST_F(OtherFiles, ThatAreNoModelsAreReported) {
  const std::string base = Write("base.yaml", "- a\n");
  const std::string file =
      Write("own.yaml", std::string("name: x\nparameters_from: base.yaml\n") + kRest);
  EXPECT_EQ(LoadModel(file).diagnostics.Text(),
            file + ":2:18: error: parameters_from = 'base.yaml' is not a model file\n");
}

Mechanism LoadElastic(const std::string& name) {
  const LoadResult result = LoadModel(std::string(kSourceDir) + "/models/" + name);
  EXPECT_EQ(result.diagnostics.Text(), "");
  return result.mechanism.value_or(Mechanism{});
}

TEST(ElasticScara, IsOverconstrainedByItsParallelogramsOnly) {
  const Mechanism m = LoadElastic("scara_robot/elastic.yaml");
  EXPECT_EQ(m.name, "scara_robot");
  EXPECT_EQ(m.beams.size(), 12u);
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.dofs, 4);
  EXPECT_EQ(mobility.undriven, 0);
  // A planar four-bar of hinges has three redundant constraints; the main loops have none.
  EXPECT_EQ(mobility.redundant, 2 * 3);
  const Pose X_WP = m.X_WB_home[m.FindBody("platform")];
  EXPECT_LT((X_WP.translation() - Vec3(-0.05, -0.05, -0.15)).norm(), 1e-12);
  // E/(2(1 + nu)); table of the paper: ø8 mm.
  EXPECT_NEAR(m.beams[0].shear_modulus, 80.77e9, 0.005e9);
  for (const Drive& drive : m.drives) EXPECT_EQ(drive.stiffness, 5000.0);
}

TEST(ElasticCabin, CarriesItsPlatformOnTwoLinkages) {
  const Mechanism m = LoadElastic("cabin_robot/elastic.yaml");
  EXPECT_EQ(m.name, "cabin_robot");
  EXPECT_EQ(m.beams.size(), 12u);
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.dofs, 7) << "the wrist's slide is a parameter";
  EXPECT_EQ(mobility.undriven, 0);
  // Each loop in a plane is three times redundant: two per linkage. The second linkage closes two
  // more loops through the first: over A-B and C-D.
  EXPECT_EQ(mobility.redundant, 18);
  // Tool at th3 = 90 deg, th4 = 0: arm along -z, rail up, tool out.
  const Pose X_WT = m.X_WB_home[m.FindBody("slewing")];
  const Vec3 expected(0, 0.36 + 0.261 + 0.2, 0.5 - 0.485 - 0.06);
  EXPECT_LT((X_WT.translation() - expected).norm(), 1e-12);
  EXPECT_LT((X_WT.linear().col(2) - Vec3(0, 0, -1)).norm(), 1e-12);
}

}  // namespace
}  // namespace mbv
