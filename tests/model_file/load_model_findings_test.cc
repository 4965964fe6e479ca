// What is wrong with a model file is said, all of it, with place, value, rule and hint.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>

#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/mechanisms/slip.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

std::string FindingsOf(const std::string& text, const LoadOptions& options = {}) {
  const LoadResult result = LoadModelText(text, "m.yaml", options);
  EXPECT_EQ(result.mechanism.has_value(), !result.diagnostics.has_errors());
  return result.diagnostics.Text();
}

class FourBarWith : public testing::TestWithParam<Slip> {};

TEST_P(FourBarWith, ASlipIsReported) { ExpectReported(kFourBar, GetParam()); }

const Slip kSlips[] = {
    // Keys and types.
    {"UnknownKey", "mass: 2", "masss: 2",
     "m.yaml:12:5: error: bodies.crank: unknown key 'masss'\n  hint: did you mean 'mass'?"},
    {"UnknownSection", "outputs:", "output:", "m.yaml:28:1: error: the file: unknown key 'output'"},
    {"MissingName", "name: four_bar", "description: x", "the file: 'name' is missing"},
    {"MissingKind", "{kind: revolute, parent: world.A,", "{parent: world.A,",
     "joints.A: 'kind' is missing"},
    {"MissingAxis", "child: crank.foot, axis: z", "child: crank.foot",
     "joints.A: 'axis' is missing"},
    {"UnknownKind", "{kind: revolute, parent: world.A", "{kind: revolut, parent: world.A",
     "m.yaml:22:13: error: joints.A.kind = 'revolut' is not one of: fixed, revolute"},
    {"ListForNumber", "mass: 2", "mass: [2]",
     "m.yaml:12:11: error: bodies.crank.mass is a list of 1, a number or an expression is needed"},
    {"NumberForMap", "drives:\n  motor: {kind: joint, joint: A, range_deg: [0, 170]}", "drives: 3",
     "m.yaml:26:9: error: drives is '3', a map of names is needed"},
    {"ShortVector", "gravity: [0, -9.81, 0]", "gravity: [0, -9.81]",
     "gravity is a list of 2, a list of 3 is needed"},
    {"WordForFlag", "closure: true", "closure: maybe",
     "joints.C.closure = 'maybe' is neither true nor false"},
    {"DottedName", "outputs:\n  tool:", "outputs:\n  a.tool:", "outputs: 'a.tool' is not a name"},
    {"DuplicateKey", "  rocker:\n", "  crank:\n", "the key 'crank' is already given in line 11"},
    // Numbers.
    {"UnknownSymbol", "crank/2", "cranc/2",
     "m.yaml:13:11: error: bodies.crank.com[0] = 'cranc/2' has the unknown symbol 'cranc'\n"
     "  hint: did you mean 'crank'?"},
    {"UnknownFunction", "crank/2", "hypot3(crank)", "unknown function 'hypot3'"},
    {"NoExpression", "crank/2", "crank/", "bodies.crank.com[0] = 'crank/' is not an expression: "},
    {"Cycle", "crank: 0.2", "crank: 2*crank",
     "m.yaml:3:10: error: parameters.crank = '2*crank' is a cycle of parameters: crank → crank"},
    {"NotFinite", "crank: 0.2", "crank: 1/0", "parameters.crank = '1/0' gives inf"},
    {"NotANumber", "crank: 0.2", "crank: .nan", "parameters.crank = '.nan'"},
    {"BadParameterName", "crank: 0.2", "sin: 0.2", "this is the name of a function"},
    {"BadSource", "source: assumed", "source: guessed",
     "parameters.ground.source = 'guessed' is not one of: printed, assumed, corrected"},
    {"TwoUnits", "{value_mm: 500,", "{value_mm: 500, value: 1,",
     "parameters.ground.value and value_mm are both given"},
    // Masses.
    {"NegativeMass", "mass: 2", "mass: -2", "bodies.crank.mass = -2 violates mass >= 0"},
    {"NoInertia", "inertia: {xx: 0.01, yy: 0.02, zz: 0.02}", "inertia: [0, 0, 0]",
     "bodies.crank: mass = 2 without inertia"},
    {"InertiaWithoutMass", "mass: 2", "mass: 0", "bodies.crank: an inertia without mass"},
    {"TriangleInequality", "zz: 0.02", "zz: 0.2",
     "m.yaml:11:3: error: bodies.crank: principal inertias 0.01, 0.02, 0.2 kg m² violate I1 + I2 "
     ">= I3"},
    {"NotPositive", "xx: 0.01", "xx: 0.02, xy: 0.03",
     "bodies.crank: principal inertias -0.01, 0.02, 0.05 kg m² violate I > 0"},
    {"HalfAnInertia", "xx: 0.01, yy: 0.02,", "xx: 0.01,", "bodies.crank.inertia: 'yy' is missing"},
    // Names.
    {"NoSuchBody", "child: rocker.foot", "child: rocket.foot",
     "joints.D.child = 'rocket.foot': there is no body 'rocket'\n  hint: did you mean 'rocker'?"},
    {"NoSuchFrame", "child: coupler.end", "child: coupler.ent",
     "joints.C.child = 'coupler.ent': body 'coupler' has no frame 'ent'\n"
     "  hint: did you mean 'end'?"},
    {"NoSuchJoint", "joint: A", "joint: AA", "drives.motor.joint = 'AA': there is no such joint"},
    {"ShapeFrame", "from: foot", "from: food",
     "bodies.crank.shapes[0].capsule.from = 'food': body 'crank' has no such frame"},
    // Frames and shapes.
    {"TwoRotations", "{rpy_deg: [0, 0, 30]}", "{rpy_deg: [0, 0, 30], axis: z, angle: 1}",
     "bodies.coupler.frames.tool.rotation is given in several ways"},
    {"NoRotation", "{rpy_deg: [0, 0, 30]}", "{}", "rotation is given in no ways"},
    {"ParallelFrameAxes", "{rpy_deg: [0, 0, 30]}", "{axes: {x: y, z: -y}}",
     "rotation.axes: its two axes are parallel"},
    {"OneFrameAxis", "{rpy_deg: [0, 0, 30]}", "{axes: {x: y}}",
     "rotation.axes gives 1 axes, two are needed"},
    {"TwoShapes", "color: accent", "ball: {radius: 1}",
     "bodies.crank.shapes[0] has 2 kinds, one is needed"},
    {"ShapeSize", "radius_mm: 10", "radius: -1", "capsule.radius = -1 violates radius > 0"},
    {"ShapeWithoutLength", "to: end, radius", "to: foot, radius",
     "capsule: its ends are the same point"},
    {"ShapeColor", "color: accent", "color: '#12345'",
     "bodies.crank.shapes[0].color = '#12345' is not a color"},
    // Joints.
    {"ZeroAxis", "child: crank.foot, axis: z", "child: crank.foot, axis: [0, 0, 0]",
     "joints.A.axis has the length 0, an axis needs a direction"},
    {"NoAxis", "child: crank.foot, axis: z", "child: crank.foot, axis: w",
     "joints.A.axis = 'w' is not one of: x, y, z, -x, -y, -z"},
    {"AxisNotWanted", "{kind: revolute, parent: world.A", "{kind: spherical, parent: world.A",
     "joints.A: a spherical joint has no axis"},
    {"ParallelUniversal", "{kind: revolute, parent: world.A, child: crank.foot, axis: z",
     "{kind: universal, parent: world.A, child: crank.foot, axis: z, axis2: -z",
     "joints.A: axis and axis2 are parallel"},
    {"JoinedToItself", "child: rocker.foot", "child: world.A",
     "joints.D connects body 'world' with itself"},
    {"GuessCount", "child: crank.foot, axis: z, guess_deg: 60",
     "child: crank.foot, axis: z, guess_deg: [60, 1]",
     "joints.A.guess_deg is a list of 2, a list of 1 is needed"},
    {"RangeOrder", "range_deg: [0, 170]", "range_deg: [170, 0]",
     "drives.motor.range_deg = [170, 0] violates lower < upper"},
    {"RangeUnit", "range_deg: [0, 170]", "range_mm: [0, 170]",
     "drives.motor.range_mm: the drive's position is an angle"},
    {"Transmits", "axis: z, guess_deg: -60, closure: true",
     "axis: z, guess_deg: -60, closure: true, transmits: moment",
     "joints.C.transmits = 'moment' is not one of: all, force"},
    // The graph and the loops.
    {"NotConnected", "  rocker:\n", "  wheel: {}\n  rocker:\n",
     "m.yaml:19:3: error: no chain of joints connects body 'wheel' to the world\n"
     "  hint: a floating body needs a free joint"},
    {"HintsDisconnect", "child: rocker.foot, axis: z", "child: rocker.foot, axis: z, closure: true",
     "body 'rocker' is cut off from the world: every chain of joints to it has a joint with "
     "closure: true"},
    {"OpenLoop", "  rocker:\n    frames: {foot: {}, end: [crank, 0, 0]}",
     "  rocker:\n    frames: {foot: {}, end: [crank, 0, 0.1]}",
     "m.yaml:24:3: error: the loop at joint 'C' does not close: gap 0.1 m"},
    {"GuessOutsideRange", "range_deg: [0, 170]", "range_deg: [90, 170]",
     "m.yaml:27:3: warning: drive 'motor' is at 1.0472 at home, its range is 1.5708 … 2.96706"},
    // Drives and outputs.
    {"Coordinate", "joint: A,", "joint: A, coordinate: 1,",
     "drives.motor: coordinate 1 of joint 'A', which has 1 coordinates"},
    {"DriveKind", "{kind: joint, joint: A, range_deg: [0, 170]}", "{kind: rope}",
     "drives.motor.kind = 'rope' is not one of: joint, distance"},
    {"SameBodyEnds", "{kind: joint, joint: A, range_deg: [0, 170]}",
     "{kind: distance, from: crank.foot, to: crank.end}",
     "drives.motor: both ends are on body 'crank'"},
    {"SamePointAtHome", "{kind: joint, joint: A, range_deg: [0, 170]}",
     "{kind: distance, from: world.A, to: crank.foot}",
     "drive 'motor': its two ends are the same point at home"},
    {"NameTakenTwice", "outputs:\n  tool: coupler.tool", "outputs:\n  motor: coupler.tool",
     "m.yaml:29:3: error: the output 'motor' has the name of the drive in line 27"},
    {"DrivenTwice", "outputs:", "prescribed: {base: {joint: A}}\noutputs:",
     "'base' moves the same coordinate of joint 'A' as 'motor'"},
    {"DriveOrder",
     "outputs:", "drive_order: [motor, moto]\noutputs:", "drive_order = 'moto' is not one of: "},
    {"SymbolOfNoDrive",
     "outputs:", "symbols: {moto: \"_{1}\"}\noutputs:", "symbols: there is no drive 'moto'"},
    {"DriveOrderGap", "outputs:", "drive_order: []\noutputs:", "drive_order leaves out 'motor'"},
    {"Spring", "outputs:", "springs: {s: {from: world, to: crank.end, stiffness: -1}}\noutputs:",
     "springs.s.stiffness = -1 violates stiffness >= 0"},
};

INSTANTIATE_TEST_SUITE_P(LoadModelFindings, FourBarWith, testing::ValuesIn(kSlips),
                         [](const auto& slip) { return std::string(slip.param.name); });

TEST(LoadModelFindings, JointsThatMustNotBeCutMayNotCloseALoop) {
  std::string text = Replaced(kFourBar, "closure: true", "closure: false");
  for (const char* guess :
       {"crank.foot, axis: z", "coupler.start, axis: z", "rocker.foot, axis: z"}) {
    text = Replaced(text, guess, std::string(guess) + ", closure: false");
  }
  EXPECT_NE(FindingsOf(text).find("has closure: false, but all joints of its loop have, and one "
                                  "must be cut"),
            std::string::npos)
      << FindingsOf(text);
}

TEST(LoadModelFindings, TheIsostaticRuleMayNotChangeTheMechanism) {
  // One ball in a planar four-bar leaves its one DOF; with two, the coupler spins.
  const std::string one = Replaced(kFourBar, "closure: true", "closure: true, transmits: force");
  EXPECT_EQ(FindingsOf(one), "");
  const std::string two =
      Replaced(one, "coupler.start, axis: z", "coupler.start, axis: z, transmits: force");
  EXPECT_NE(FindingsOf(two).find(
                "transmits: force changes the mechanism: 2 degrees of freedom instead of 1"),
            std::string::npos)
      << FindingsOf(two);
}

TEST(LoadModelFindings, ABallAndASlideCannotBeMistakenForEachOther) {
  const std::string text =
      "name: t\nbodies: {a: {}, b: {}}\njoints:\n"
      "  ball: {kind: spherical, parent: world, child: a}\n"
      "  slide: {kind: prismatic, parent: a, child: b, axis: z, "
      "transmits: force}\n"
      "drives: {turn: {kind: joint, joint: ball, coordinate: 0}}\n"
      "prescribed: {lean: {joint: ball}}\n";
  EXPECT_EQ(FindingsOf(text),
            "m.yaml:5:69: error: joints.slide: a prismatic joint cannot transmit a force only\n"
            "  hint: only revolute, universal and spherical joints can\n"
            "m.yaml:6:37: error: drives.turn: a rotation of joint 'ball' has no axis to drive\n"
            "  hint: write the joint as universal and revolute joints with a body between\n"
            "m.yaml:7:28: error: prescribed.lean: joint 'ball' has 3 coordinates, one is needed\n"
            "  hint: split the joint by massless bodies\n");
}

TEST(LoadModelFindings, OverridesMustNameAParameterAndBeFinite) {
  LoadOptions options;
  options.overrides["cranc"] = 1.0;
  options.override_places["cranc"] = {
      .file = "case.yaml", .line = 7, .column = 3, .message = "", .hint = ""};
  EXPECT_EQ(FindingsOf(kFourBar, options),
            "case.yaml:7:3: error: m.yaml has no parameter 'cranc'\n"
            "  hint: did you mean 'crank'?\n");
  LoadOptions nan;
  nan.overrides["crank"] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(FindingsOf(kFourBar, nan).find("parameter crank = nan is not a finite number"),
            std::string::npos);
}

TEST(LoadModelFindings, AModelThatIsTooLargeToComputeIsRefused) {
  std::string text = "name: t\nbodies:\n";
  for (int i = 0; i < 2001; ++i) text += "  b" + std::to_string(i) + ": {}\n";
  EXPECT_NE(FindingsOf(text).find("m.yaml:2003:"), std::string::npos);
  EXPECT_NE(FindingsOf(text).find("the model has more than 2001 bodies"), std::string::npos)
      << FindingsOf(text);
}

TEST(LoadModelFindings, PartsThatMultiplyWithoutEndAreRefused) {
  std::string text = "name: t\nparts:\n";
  for (int i = 0; i < 20; ++i) {
    const std::string next = "p" + std::to_string(i + 1);
    text += "  p" + std::to_string(i) + ": {instances: {a: {part: " + next +
            "}, b: {part: " + next + "}}}\n";
  }
  text += "  p20: {bodies: {x: {}}}\ninstances: {top: {part: p0}}\n";
  EXPECT_NE(FindingsOf(text).find("more than 4000 instances"), std::string::npos);
}

// Each file in data/malformed has its findings beside it.
TEST(LoadModelFindings, MalformedFilesSayWhatTheirGoldenTextsSay) {
  const std::filesystem::path folder =
      std::filesystem::path(kSourceDir) / "tests/model_file/data/malformed";
  const auto read = [](const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    const std::string name = entry.path().filename().string();
    const std::string said = LoadModelText(read(entry.path()), name).diagnostics.Text();
    EXPECT_EQ(said, read(std::filesystem::path(entry.path()).replace_extension(".txt"))) << name;
  }
  EXPECT_GE(files, 14);
}

// Cuts, doubles and exchanges pieces of good files; whatever comes of it must not throw.
TEST(LoadModelFindings, DamagedFilesNeverThrow) {
  std::mt19937_64 random(20121103);
  const std::string good = kFourBar;
  for (int i = 0; i < 400; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) {
      const size_t at = random() % text.size(), length = random() % 20;
      switch (random() % 3) {
        case 0:
          text.erase(at, length);
          break;
        case 1:
          text.insert(at, good.substr(random() % good.size(), length));
          break;
        default:
          text[at] = static_cast<char>(32 + random() % 95);
          break;
      }
    }
    const LoadResult result = LoadModelText(text, "m.yaml");
    EXPECT_EQ(result.mechanism.has_value(), !result.diagnostics.has_errors()) << text;
  }
}

}  // namespace
}  // namespace mbv
