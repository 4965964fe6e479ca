#include "model_file/load_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/spatial.h"
#include "model_file/write_model.h"
#include "tests/mechanisms/four_bar.h"

namespace mbv {
namespace {

using std::numbers::pi;

constexpr double kRoundoff = 64 * kEps;

Mechanism MustLoad(const std::string& text, const LoadOptions& options = {}) {
  const LoadResult result = LoadModelText(text, "m.yaml", options);
  EXPECT_EQ(result.diagnostics.Text(), "");
  EXPECT_TRUE(result.mechanism);
  return result.mechanism.value_or(Mechanism{});
}

TEST(LoadModel, AFourBarIsReadAsWrittenAndClosedAsDrawn) {
  const Mechanism m = MustLoad(kFourBar);
  EXPECT_EQ(m.name, "four_bar");
  EXPECT_EQ(m.file, "m.yaml");
  EXPECT_EQ(m.gravity_W, Vec3(0, -9.81, 0));
  ASSERT_EQ(m.bodies.size(), 4u);
  EXPECT_EQ(m.bodies[0].name, "world");
  const Body& crank = m.bodies[m.FindBody("crank")];
  EXPECT_EQ(crank.mass, 2.0);
  EXPECT_EQ(crank.p_BoBcm_B, Vec3(0.1, 0, 0));
  EXPECT_EQ(crank.I_Bcm_B, Mat3(Vec3(0.01, 0.02, 0.02).asDiagonal()));
  ASSERT_EQ(crank.shapes.size(), 1u);
  EXPECT_EQ(std::get<Capsule>(crank.shapes[0].geometry).p_to, Vec3(0.2, 0, 0));
  EXPECT_EQ(std::get<Capsule>(crank.shapes[0].geometry).radius, 0.01);
  EXPECT_EQ(crank.shapes[0].color, "accent");

  const Parameter& ground = m.parameters[1];
  EXPECT_EQ(ground.name, "ground");
  EXPECT_EQ(ground.value, 0.5);
  EXPECT_EQ(ground.unit, "m");
  EXPECT_EQ(ground.source, Source::kAssumed);
  EXPECT_EQ(ground.note, "between the pivots");

  // A parallelogram: the coupler stays parallel to the ground.
  const Pose X_WB = m.X_WB_home[m.FindBody("coupler")];
  EXPECT_LT((X_WB.translation() - 0.2 * Vec3(std::cos(pi / 3), std::sin(pi / 3), 0)).norm(),
            kRoundoff);
  EXPECT_LT((X_WB.linear() - Mat3::Identity()).norm(), kRoundoff);
  EXPECT_EQ(m.tree_joints.size(), 3u);
  EXPECT_TRUE(m.joints[m.FindJoint("C")].closure);
  EXPECT_NEAR(m.joints[m.FindJoint("C")].home[0], -pi / 3, kRoundoff);

  ASSERT_EQ(m.drives.size(), 1u);
  EXPECT_EQ(std::get<JointDrive>(m.drives[0].kind).joint, m.FindJoint("A"));
  EXPECT_NEAR(m.drives[0].range.upper, 170 * pi / 180, kRoundoff);
  ASSERT_EQ(m.outputs.size(), 1u);
  EXPECT_EQ(m.outputs[0].body, m.FindBody("coupler"));
  EXPECT_LT((m.outputs[0].X_BO.linear() - RotZ(pi / 6)).norm(), kRoundoff);
}

TEST(LoadModel, ProductsOfInertiaAreTheEntriesOfTheMatrix) {
  const Mechanism m = MustLoad(R"(
name: one
bodies:
  a: {mass: 1, inertia: {xx: 1, yy: 2, zz: 2.5, xy: 0.1, xz: -0.2, yz: 0.05}}
joints: {hinge: {kind: revolute, parent: world, child: a, axis: z}}
)");
  Mat3 expected;
  expected << 1, 0.1, -0.2, 0.1, 2, 0.05, -0.2, 0.05, 2.5;
  EXPECT_EQ(m.bodies[1].I_Bcm_B, expected);
}

TEST(LoadModel, NumbersWrittenInPlaceAreListedAndMayBeReplaced) {
  const std::string text = R"(
name: two
parameters: {m: 1.5}
parts:
  link:
    parameters: {length: 0.5}
    attach: {world: {foot: [0, length, 0.25]}}
    bodies: {rod: {mass: 2*pi, com_mm: [10, 0, 0], inertia: [1, m, 1]}}
    joints: {hinge: {kind: revolute, parent: world.foot, child: rod, axis: z, guess_deg: 90}}
instances: {a: {part: link}, b: {part: link, length: 0.75}}
)";
  const LoadResult as_is = LoadModelText(text, "m.yaml");
  ASSERT_TRUE(as_is.mechanism) << as_is.diagnostics.Text();
  std::map<std::string, double> literals;
  for (const Literal& literal : as_is.literals) literals[literal.place] = literal.value;
  EXPECT_EQ(literals.size(), as_is.literals.size());  // each once, though there are two rods
  EXPECT_NEAR(literals.at("parts.link.bodies.rod.mass"), 2 * pi, kRoundoff);
  EXPECT_NEAR(literals.at("parts.link.bodies.rod.com_mm[0]"), 0.01, kRoundoff);
  EXPECT_EQ(literals.at("parts.link.attach.world.foot[2]"), 0.25);
  EXPECT_EQ(literals.at("instances.b.length"), 0.75);
  EXPECT_EQ(literals.count("parts.link.bodies.rod.inertia[1]"), 0u);  // a parameter
  EXPECT_EQ(literals.count("parts.link.attach.world.foot[1]"), 0u);
  LoadOptions options;
  options.literals = {{"parts.link.bodies.rod.com_mm[0]", 0.02}};
  const LoadResult perturbed = LoadModelText(text, "m.yaml", options);
  ASSERT_TRUE(perturbed.mechanism);
  for (const char* rod : {"a.rod", "b.rod"}) {
    const Body& body = perturbed.mechanism->bodies[perturbed.mechanism->FindBody(rod)];
    EXPECT_EQ(body.p_BoBcm_B, Vec3(0.02, 0, 0));
  }
}

TEST(LoadModel, OverridesReplaceParametersBeforeAnythingIsComputed) {
  LoadOptions options;
  options.overrides["crank"] = 0.3;
  const Mechanism m = MustLoad(kFourBar, options);
  EXPECT_EQ(m.ParameterValue("crank"), 0.3);
  EXPECT_EQ(m.bodies[m.FindBody("crank")].p_BoBcm_B.x(), 0.15);
  EXPECT_NEAR(m.X_WB_home[m.FindBody("coupler")].translation().norm(), 0.3, kRoundoff);
}

TEST(LoadModel, UpIsStatedOrAgainstGravity) {
  const auto load = [](const std::string& head, std::optional<Vec3> gravity_W = {}) {
    LoadOptions options;
    options.gravity_W = gravity_W;
    return MustLoad("name: t\n" + head +
                        "bodies: {b: {}}\njoints: {j: {kind: free, parent: world, child: b}}\n",
                    options);
  };
  EXPECT_EQ(load("").up_W, Vec3::UnitZ());
  EXPECT_EQ(load("").gravity_W, Vec3(0, 0, -9.81));
  EXPECT_EQ(load("gravity: [0, -2, 0]\n").up_W, Vec3::UnitY());
  EXPECT_EQ(load("gravity: [0, 0, 0]\n").up_W, Vec3::UnitZ());
  EXPECT_EQ(load("gravity: [0, -2, 0]\nup: [4, 0, 0]\n").up_W, Vec3::UnitX());
  // A scenario replaces gravity; pictures stay as they are.
  const Mechanism replaced = load("gravity: [0, -2, 0]\n", Vec3(0, 0, 3));
  EXPECT_EQ(replaced.gravity_W, Vec3(0, 0, 3));
  EXPECT_EQ(replaced.up_W, Vec3::UnitY());
}

TEST(LoadModel, NumbersInUnitsAreThoseThatAreMeant) {
  const std::string text = R"(
name: t
parameters: {bar: {value_mm: 9}, l: 1, phi: 1, third: {value_deg: 180/3}}
bodies: {b: {com_mm: [9, 4.1, -201.574], shapes: [{ball: {radius_mm: 9}}]}}
joints: {j: {kind: free, parent: world, child: b, guess_deg: [0, 0, 0, 30, -90, 180]}}
)";
  LoadOptions options;
  options.overrides = {{"l_mm", 4.1}, {"phi_deg", 45.0}};
  const Mechanism m = MustLoad(text, options);
  EXPECT_EQ(m.ParameterValue("bar"), 0.009);
  EXPECT_EQ(m.ParameterValue("l"), 0.0041);
  EXPECT_EQ(m.ParameterValue("phi"), pi / 4);
  EXPECT_EQ(m.ParameterValue("third"), pi / 3);
  EXPECT_EQ(m.bodies[1].p_BoBcm_B, Vec3(0.009, 0.0041, -0.201574));
  EXPECT_EQ(m.joints[0].guess, (std::array<double, 6>{0, 0, 0, pi / 6, -pi / 2, pi}));
  EXPECT_NE(WriteModel(m).find("ball: {at: [0, 0, 0], radius: 0.009}"), std::string::npos)
      << WriteModel(m);
}

// Loads one free body with this frame and returns the frame.
Pose FrameOf(const std::string& frame) {
  const Mechanism m = MustLoad("name: t\nbodies: {b: {frames: {f: " + frame +
                               "}}}\njoints: {j: {kind: free, parent: world, child: b}}\n");
  const NamedFrame* found = m.FindFrame(1, "f");
  return found == nullptr ? Pose::Identity() : found->X_BF;
}

TEST(LoadModel, FramesTakeRotationsInThreeForms) {
  EXPECT_EQ(FrameOf("[1, 2, 3]").translation(), Vec3(1, 2, 3));
  EXPECT_EQ(FrameOf("{position_mm: [1, 2, 3]}").translation(), Vec3(0.001, 0.002, 0.003));
  const Mat3 R = FrameOf("{rotation: {rpy_deg: [10, 20, 30]}}").linear();
  EXPECT_LT((R - RotZ(pi / 6) * RotY(pi / 9) * RotX(pi / 18)).norm(), kRoundoff);
  const Mat3 Q = FrameOf("{rotation: {axis: [0, 3, 4], angle: pi/2}}").linear();
  EXPECT_LT((Q - ExpRotation(pi / 2 * Vec3(0, 0.6, 0.8))).norm(), kRoundoff);
}

TEST(LoadModel, TwoAxesMakeAFrameWithTheFirstKept) {
  // The first axis in the text is kept, the other one made perpendicular to it.
  const Mat3 R = FrameOf("{rotation: {axes: {z: [0, 0, 2], x: [1, 0, 5]}}}").linear();
  EXPECT_LT((R - Mat3::Identity()).norm(), kRoundoff);
  const Mat3 Q = FrameOf("{rotation: {axes: {x: [1, 0, 1], z: [0, 0, 1]}}}").linear();
  EXPECT_LT((Q.col(0) - Vec3(1, 0, 1).normalized()).norm(), kRoundoff);
  EXPECT_LT((Q.col(2) - Vec3(-1, 0, 1).normalized()).norm(), kRoundoff);
  const Mat3 S = FrameOf("{rotation: {axes: {y: x, z: -y}}}").linear();
  EXPECT_LT((S.col(0) - Vec3::UnitX().cross(-Vec3::UnitY())).norm(), kRoundoff);
  EXPECT_NEAR(S.determinant(), 1.0, kRoundoff);
}

// Two arms in a row, each with a link made of two sides: parts within parts.
const char kParts[] = R"(name: nested
parameters: {length: 0.5, width: 0.1}
bodies: {table: {}}
joints: {table: {kind: fixed, parent: world, child: table}}
parts:
  side:
    parameters: {offset: 0}
    attach: {bar: {seat: [0, offset, 0]}}
    bodies: {plate: {frames: {c: [0, 0, offset]}}}
    joints: {glue: {kind: fixed, parent: bar.seat, child: plate}}
  arm:
    parameters: {at: 0, angle_zero: 0, width: 2*length}
    attach: {table: {foot: [at, 0, 0]}}
    bodies: {bar: {frames: {end: [length, 0, 0]}}}
    joints:
      pivot: {kind: revolute, parent: table.foot, child: bar, axis: z, guess: angle_zero}
    drives: {motor: {kind: joint, joint: pivot}}
    outputs: {end: bar.end}
    instances: {left: {part: side, offset: width/2}, right: {part: side, offset: -width/2}}
instances:
  one: {part: arm, at: 1, angle_zero: 0.3}
  two: {part: arm, at: length + 1, width: width}
)";

TEST(LoadModel, PartsAreInstancedWithTheirOwnParametersAndNames) {
  const Mechanism m = MustLoad(kParts);
  std::string names;
  for (const Body& body : m.bodies) names += body.name + " ";
  EXPECT_EQ(names,
            "world table one.bar one.left.plate one.right.plate two.bar two.left.plate "
            "two.right.plate ");
  // Attached frames carry the instance's name; inside the part they are seen without it.
  const int table = m.FindBody("table");
  EXPECT_EQ(m.FindFrame(table, "one.foot")->X_BF.translation().x(), 1.0);
  EXPECT_EQ(m.FindFrame(table, "two.foot")->X_BF.translation().x(), 1.5);
  EXPECT_EQ(m.FindFrame(m.FindBody("one.bar"), "one.left.seat")->X_BF.translation().y(), 0.5);
  // `width: width` takes the model's parameter where the instance is written.
  EXPECT_EQ(m.FindFrame(m.FindBody("two.bar"), "two.right.seat")->X_BF.translation().y(), -0.05);
  EXPECT_EQ(m.ParameterValue("two.width"), 0.1);
  ASSERT_EQ(m.drives.size(), 2u);
  EXPECT_EQ(m.drives[0].name, "one.motor");
  EXPECT_EQ(m.drives[1].name, "two.motor");
  EXPECT_GE(m.FindOutput("two.end"), 0);
  const Vec3 end = m.X_WB_home[m.FindBody("one.bar")] * Vec3(0.5, 0, 0);
  EXPECT_LT((end - Vec3(1 + 0.5 * std::cos(0.3), 0.5 * std::sin(0.3), 0)).norm(), kRoundoff);
}

TEST(LoadModel, AnOverrideMayNameAnInstancesParameter) {
  LoadOptions options;
  options.overrides["two.at"] = 7;
  const Mechanism m = MustLoad(kParts, options);
  EXPECT_EQ(m.FindFrame(m.FindBody("table"), "two.foot")->X_BF.translation().x(), 7.0);
}

TEST(LoadModel, DriveOrderMayBeFixed) {
  const Mechanism m = MustLoad(std::string(kParts) +
                               "drive_order: [two.motor, one.motor]\n"
                               "symbols: {one.motor: \"_{1}\"}\n");
  EXPECT_EQ(m.drives[1].symbol, "_{1}");
  EXPECT_EQ(m.drives[0].symbol, "");
  EXPECT_EQ(m.drives[0].name, "two.motor");
}

TEST(LoadModel, EveryJointKindReadsItsCoordinates) {
  const Mechanism m = MustLoad(R"(name: chain
bodies: {a: {}, b: {}, c: {}, d: {}, e: {}, f: {}}
joints:
  slide: {kind: prismatic, parent: world, child: a, axis: -y, guess_mm: 250, range: [null, 1]}
  pipe: {kind: cylindrical, parent: a, child: b, axis: x, guess_deg: [0.5, 90], range_deg: [[0, 1], [-180, 180]]}
  cross: {kind: universal, parent: b, child: c, axis: y, axis2: x, guess: [0.1, 0.2]}
  ball: {kind: spherical, parent: c, child: d, guess_deg: [0, 0, 90]}
  table: {kind: planar, parent: d, child: e, axis: z, guess: [1, 2, 0]}
  float: {kind: free, parent: world, child: f, guess_deg: [1, 2, 3, 0, 0, 180]}
drives:
  turn: {kind: joint, joint: pipe, coordinate: 1}
  strut: {kind: distance, from: world, to: f, radius_mm: 20}
prescribed: {push: {joint: slide}}
springs: {s: {from: world, to: f, stiffness: 10, damping: 1, free_length_mm: 100}}
outputs: {seen: {frame: e, in: b}}
)");
  ASSERT_EQ(m.joints.size(), 6u);
  EXPECT_EQ(m.X_WB_home[1].translation(), Vec3(0, -0.25, 0));
  EXPECT_EQ(m.joints[0].range[0].upper, 1.0);
  EXPECT_EQ(m.joints[0].range[0].lower, -std::numeric_limits<double>::infinity());
  // _deg scales the angle of a cylindrical joint, not its length.
  EXPECT_EQ(m.joints[1].guess[0], 0.5);
  EXPECT_NEAR(m.joints[1].guess[1], pi / 2, kRoundoff);
  EXPECT_EQ(m.joints[1].range[0].upper, 1.0);
  EXPECT_NEAR(m.joints[1].range[1].upper, pi, kRoundoff);
  EXPECT_EQ(m.joints[2].axis2, Vec3::UnitX());
  EXPECT_LT((m.X_WB_home[6].translation() - Vec3(1, 2, 3)).norm(), kRoundoff);
  EXPECT_EQ(m.drives[1].radius, 0.02);
  EXPECT_EQ(m.springs[0].free_length_m, 0.1);
  EXPECT_EQ(m.prescribed[0].joint, 0);
  EXPECT_EQ(m.outputs[0].reference_body, 2);
}

}  // namespace
}  // namespace mbv
