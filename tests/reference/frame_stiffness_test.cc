// Stiffness of frames against textbook formulas and the direct stiffness method.
#include "reference/frame_stiffness.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "math/spatial.h"
#include "model_file/load_model.h"
#include "tests/reference/direct_stiffness.h"

namespace mbv {
namespace {

// Relative, of a few solutions with condition numbers around 1e3.
constexpr double kAlgebra = 1e4 * kEps;

Mechanism Loaded(const std::string& text) {
  const LoadResult result = LoadModelText(text, "m.yaml");
  EXPECT_EQ(result.diagnostics.Text(), "");
  return result.mechanism.value_or(Mechanism{});
}

StiffnessResult AtHome(const Mechanism& m, int output = 0) {
  return FrameStiffness(m, m.X_WB_home, output);
}

void ExpectNear(const MatX& got, const MatX& wanted, const char* what = "") {
  EXPECT_LT((got - wanted).cwiseAbs().maxCoeff(), kAlgebra * wanted.cwiseAbs().maxCoeff())
      << what << "\n"
      << got << "\n\n"
      << wanted;
}

// E A = 2, E I_y = 3, E I_z = 5, G J = 7; x along the beam.
const char kHeader[] = R"(
materials: {m: {youngs_modulus: 1, shear_modulus: 1}}
sections:
  s: {general: {area: 2, I_y: 3, I_z: 5, torsion: 7}}
  thin: {general: {area: 1e9, I_y: 1, I_z: 1, torsion: 1}}
)";
constexpr double kEA = 2, kEIy = 3, kEIz = 5, kGJ = 7;

std::string Cantilever(const std::string& mount) {
  return std::string("name: cantilever") + kHeader + R"(
parameters: {L: 1.5}
bodies: {beam: {frames: {tip: [L, 0, 0]}, beams: {b: {to: tip, section: s, material: m, z: z}}}}
joints: {mount: {kind: fixed, parent: world, child: beam}}
outputs: {tip: beam.tip}
)" + mount;
}

Mat6 CantileverByHand(double L) {
  Mat6 C = Mat6::Zero();
  C.diagonal() << L / kGJ, L / kEIy, L / kEIz, L / kEA, L * L * L / (3 * kEIz),
      L * L * L / (3 * kEIy);
  C(1, 5) = C(5, 1) = -L * L / (2 * kEIy);  // a force along z tips the end about −y
  C(2, 4) = C(4, 2) = L * L / (2 * kEIz);
  return C;
}

TEST(FrameStiffness, OfACantileverIsTheTextbooks) {
  const StiffnessResult result = AtHome(Loaded(Cantilever("")));
  ASSERT_TRUE(result.summary.ok()) << result.summary.message;
  EXPECT_EQ(result.rank, 6);
  ExpectNear(result.C, CantileverByHand(1.5));
  ExpectNear(result.K * result.C, Mat6::Identity());
  ASSERT_EQ(result.shares.size(), 1u);
  EXPECT_EQ(result.shares[0].element, "beam");
  ExpectNear(result.shares[0].C, result.C);
}

TEST(FrameStiffness, TurnsAndMovesWithTheFrameOfTheOutput) {
  // The same beam at an angle, the output beside its tip on a rigid plate.
  const std::string text = std::string("name: turned") + kHeader + R"(
parameters: {L: 1.5}
world: {frames: {wall: {position: [1, 2, 3], rotation: {rpy: [0.3, -0.5, 0.8]}}}}
bodies:
  beam: {frames: {tip: [L, 0, 0]}, beams: {b: {to: tip, section: s, material: m, z: z}}}
  plate: {frames: {O: {position: [0.2, 0.1, -0.4], rotation: {rpy: [1, 1, 1]}}}}
joints:
  mount: {kind: fixed, parent: world.wall, child: beam}
  weld: {kind: fixed, parent: beam.tip, child: plate}
outputs: {O: plate.O}
)";
  const Mat3 R = RotRpy({0.3, -0.5, 0.8});
  // D = A Δ: turned into world axes, then the displacement of O instead of the tip.
  Mat6 turn = Mat6::Zero(), shift = Mat6::Identity();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R;
  shift.bottomLeftCorner<3, 3>() = -Skew(R * Vec3(0.2, 0.1, -0.4));
  const Mat6 A = shift * turn;
  ExpectNear(AtHome(Loaded(text)).C, A * CantileverByHand(1.5) * A.transpose());
}

TEST(FrameStiffness, OfAProppedCantileverIsThreeQuartersSofter) {
  // Clamped at the left, hinged at the right: θ = M L/(4 EI) for a moment at the hinge.
  const Mechanism m = Loaded(
      Cantilever("").replace(
          Cantilever("").find("joints: {"), 9,
          "joints: {prop: {kind: revolute, parent: world.prop, child: beam.tip, axis: z}, ") +
      "world: {frames: {prop: [L, 0, 0]}}\n");
  const StiffnessResult result = AtHome(m);
  EXPECT_NEAR(result.C(2, 2), 1.5 / (4 * kEIz), kAlgebra);
  Mat6 others = result.C;
  others(2, 2) = 0;
  EXPECT_LT(others.cwiseAbs().maxCoeff(), kAlgebra) << "the hinge holds everything else";
}

std::string Portal(const std::string& beam_section) {
  return std::string("name: portal") + kHeader + "  girder: " + beam_section + R"(
parameters: {h: 2, l: 3}
bodies:
  frame:
    frames: {A: [0, 0, 0], B: [0, h, 0], M: [l/2, h, 0], C: [l, h, 0], D: [l, 0, 0]}
    beams:
      AB: {from: A, to: B, section: thin, material: m}
      BM: {from: B, to: M, section: girder, material: m, z: z}
      MC: {from: M, to: C, section: girder, material: m, z: z}
      CD: {from: C, to: D, section: thin, material: m}
joints:
  A: {kind: fixed, parent: world, child: frame.A}
  D: {kind: fixed, parent: world.D, child: frame.D}
world: {frames: {D: [l, 0, 0]}}
outputs: {M: frame.M}
)";
}

TEST(FrameStiffness, OfAPortalFrameInSwayIsTheTextbooks) {
  // Columns clamped, inextensible: Δ = P h³/(24 EI) · (6k + 4)/(6k + 1), k = (I_g/l)/(I_c/h).
  const double h = 2, l = 3;
  for (const double I : {0.1, 1.0, 20.0}) {
    const Mechanism m =
        Loaded(Portal(fmt::format("{{general: {{area: 1e9, I_y: 1, I_z: {}, torsion: 1}}}}", I)));
    const double k = (I / l) / (1 / h);
    const double sway = h * h * h / 24 * (6 * k + 4) / (6 * k + 1);
    // The areas of 1e9 leave an elongation of that order.
    EXPECT_NEAR(AtHome(m).C(3, 3), sway, 1e-7 * sway) << I;
  }
}

TEST(FrameStiffness, OfATrussBarIsItsElongationWhateverItsSpin) {
  // A block on a slide at 60° to the bar; the bar between two balls may spin.
  const std::string text = std::string("name: bar") + kHeader + R"(
parameters: {L: 1.5}
world: {frames: {foot: {position: [0, 0, 0], rotation: {rpy: [0, 0, -pi/3]}}}}
bodies:
  block: {}
  bar: {frames: {end: [L, 0, 0]}, beams: {b: {to: end, section: s, material: m, z: z}}}
joints:
  slide: {kind: prismatic, parent: world, child: block, axis: x, guess: L/2}
  foot: {kind: spherical, parent: world.foot, child: bar}
  head: {kind: spherical, parent: bar.end, child: block}
world2: {}
)";
  // The block's slide starts above the bar's foot.
  std::string placed = text.substr(0, text.find("world2"));
  placed.replace(placed.find("parent: world, child: block"), 27,
                 "parent: world.slide, child: block");
  placed.replace(placed.find("world: {frames: {"), 17,
                 "world: {frames: {slide: [0, -L*sin(pi/3), 0], ");
  const StiffnessResult result = AtHome(Loaded(placed + "outputs: {block: block}\n"));
  // u cos 60° = N L/EA, N cos 60° = F.
  EXPECT_NEAR(result.C(3, 3), 4 * 1.5 / kEA, kAlgebra * 3);
  EXPECT_EQ(result.summary.stop, Stop::kSingular) << "the slide holds five directions rigidly";
  EXPECT_NE(result.summary.message.find("5 of the six loads"), std::string::npos)
      << result.summary.message;
  EXPECT_TRUE(std::isnan(result.K(3, 3)));
  ASSERT_EQ(result.shares.size(), 1u);
  ExpectNear(result.shares[0].C, result.C);
}

const char kParallelogram[] = R"(
parameters: {L: 1.5, d: 0.4}
bodies:
  rod_a: {frames: {D: [L, 0, 0]}, beams: {b: {to: D, section: s, material: m, z: z}}}
  rod_b: {frames: {D: [L, 0, 0]}, beams: {b: {to: D, section: s, material: m, z: z}}}
  bar: {frames: {a: [0, d/2, 0], b: [0, -d/2, 0]}}
world: {frames: {a: [0, d/2, 0], b: [0, -d/2, 0]}}
joints:
  C_a: {kind: revolute, parent: world.a, child: rod_a, axis: z}
  C_b: {kind: revolute, parent: world.b, child: rod_b, axis: z}
  D_a: {kind: revolute, parent: rod_a.D, child: bar.a, axis: z}
  D_b: {kind: revolute, parent: rod_b.D, child: bar.b, axis: z}
outputs: {bar: bar}
)";

TEST(FrameStiffness, OfAHingedParallelogramIsThatOfItsTwoRods) {
  const Mechanism m = Loaded(std::string("name: parallelogram") + kHeader + kParallelogram);
  const StiffnessResult result = AtHome(m);
  const double L = 1.5, d = 0.4;
  Mat6 K = Mat6::Zero();
  const double bending = 12 * kEIy / (L * L * L);
  K.diagonal() << 2 * kGJ / L + 2 * bending * d * d / 4, 2 * 4 * kEIy / L, 2 * kEA / L * d * d / 4,
      2 * kEA / L, 0, 2 * bending;
  K(1, 5) = K(5, 1) = 2 * 6 * kEIy / (L * L);
  ExpectNear(result.K, K);
  // Its own motion, across the rods, is free.
  EXPECT_EQ(result.rank, 5);
  EXPECT_EQ(result.summary.stop, Stop::kSingular);
  EXPECT_NE(result.summary.message.find("free to move in 1 direction"), std::string::npos)
      << result.summary.message;
  EXPECT_TRUE(result.summary.where == "C_a" || result.summary.where == "D_a" ||
              result.summary.where == "C_b" || result.summary.where == "D_b")
      << result.summary.where;
  EXPECT_TRUE(std::isnan(result.C(0, 0)));
  EXPECT_TRUE(result.shares.empty());
}

TEST(FrameStiffness, OfAHeldParallelogramAddsTheServo) {
  const std::string text = std::string("name: parallelogram") + kHeader + kParallelogram;
  const Mechanism free = Loaded(text);
  const Mechanism held =
      Loaded(text + "drives: {crank: {kind: joint, joint: C_a, stiffness: 11}}\n");
  const StiffnessResult result = AtHome(held);
  ASSERT_TRUE(result.summary.ok()) << result.summary.message;
  ASSERT_EQ(result.shares.back().element, "crank (servo)");
  // The crank's moment alone carries a force across the rods, and deflects rod a as a cantilever.
  const double L = 1.5;
  EXPECT_NEAR(result.shares.back().C(4, 4), L * L / 11, kAlgebra);
  EXPECT_NEAR(result.C(4, 4), L * L / 11 + L * L * L / (3 * kEIz), kAlgebra);
  Mat6 sum = Mat6::Zero();
  for (const ComplianceShare& share : result.shares) sum += share.C;
  ExpectNear(sum, result.C);
  // Locked, the rod's bending remains.
  EXPECT_NEAR(AtHome(Loaded(text + "drives: {crank: {kind: joint, joint: C_a}}\n")).C(4, 4),
              L * L * L / (3 * kEIz), kAlgebra);
}

TEST(FrameStiffness, OfALegOrASpringIsAlongItsLine) {
  const std::string text = R"(name: leg
bodies: {block: {}}
world: {frames: {foot: [-3, -4, 0]}}
joints: {slide: {kind: prismatic, parent: world, child: block, axis: x}}
outputs: {block: block}
)";
  // The leg leans by cos = 3/5.
  const double c = 1 / (100 * 0.36);
  const auto C_xx = [&](const std::string& line) { return AtHome(Loaded(text + line)).C(3, 3); };
  EXPECT_NEAR(C_xx("drives: {leg: {kind: distance, from: world.foot, to: block, stiffness: 100}}"),
              c, kAlgebra);
  EXPECT_NEAR(C_xx("springs: {coil: {from: world.foot, to: block, stiffness: 100}}"), c, kAlgebra);
}

TEST(FrameStiffness, IsRelativeToTheOutputsReferenceBody) {
  // Two beams on top of each other: seen from the first one's tip, only the second deflects.
  const std::string text = std::string("name: two") + kHeader + R"(
bodies:
  one: {frames: {tip: [2, 0, 0]}, beams: {b: {to: tip, section: s, material: m, z: z}}}
  two: {frames: {tip: [1.5, 0, 0]}, beams: {b: {to: tip, section: s, material: m, z: z}}}
joints:
  mount: {kind: fixed, parent: world, child: one}
  weld: {kind: fixed, parent: one.tip, child: two}
outputs: {tip: {frame: two.tip, in: one.tip}}
)";
  ExpectNear(AtHome(Loaded(text)).C, CantileverByHand(1.5));
}

TEST(FrameStiffness, OfVeryStiffBeamsKeepsTheAccuracyOfTheSoftOnes) {
  const std::string text = std::string("name: stiff") + kHeader + R"(
  rigid: {general: {area: 2e15, I_y: 2e15, I_z: 2e15, torsion: 2e15}}
bodies:
  beam:
    frames: {middle: [2, 0, 0], tip: [3.5, 0, 0]}
    beams:
      stiff: {to: middle, section: rigid, material: m, z: z}
      soft: {from: middle, to: tip, section: s, material: m, z: z}
joints: {mount: {kind: fixed, parent: world, child: beam}}
outputs: {tip: beam.tip}
)";
  ExpectNear(AtHome(Loaded(text)).C, CantileverByHand(1.5));
}

// A tetrahedral frame of six random beams, clamped at one corner and hinged at another.
TEST(FrameStiffness, AgreesWithTheDirectStiffnessMethodOnRandomFrames) {
  std::mt19937_64 random(20260101);
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  for (int trial = 0; trial < 10; ++trial) {
    std::string text = "name: random\nmaterials: {m: {youngs_modulus: 3, shear_modulus: 1.2}}\n";
    std::string sections = "sections:\n", beams;
    const char corners[] = "ABCD";
    for (int i = 0, n = 0; i < 4; ++i) {
      for (int j = i + 1; j < 4; ++j, ++n) {
        sections +=
            fmt::format("  s{}: {{general: {{area: {}, I_y: {}, I_z: {}, torsion: {}}}}}\n", n,
                        30 * uniform(random), uniform(random), uniform(random), uniform(random));
        beams += fmt::format(
            "      {0}{1}: {{from: {0}, to: {1}, section: s{2}, material: m, z: [{3}, {4}, 9]}}\n",
            corners[i], corners[j], n, uniform(random), uniform(random));
      }
    }
    const auto u = [&] { return uniform(random) - 1.0; };
    text += sections + "bodies:\n  frame:\n    frames:\n";
    for (int i = 0; i < 4; ++i) {
      text += fmt::format("      {}: {{position: [{}, {}, {}]}}\n", corners[i],
                          (i == 1 ? 3 : 0) + u(), (i == 2 ? 3 : 0) + u(), (i == 3 ? 1 : 0) + u());
    }
    const std::string all = text + "    beams:\n" + beams +
                            "  plate: {frames: {O: [0.3, 0.2, 0.1]}}\n"
                            "joints:\n"
                            "  A: {kind: fixed, parent: world, child: frame.A}\n"
                            "  D: {kind: universal, parent: frame.D, child: plate, axis: y, "
                            "axis2: z}\n"
                            "drives: {one: {kind: joint, joint: D, coordinate: 0, stiffness: 2}, "
                            "two: {kind: joint, joint: D, coordinate: 1}}\n"
                            "outputs: {O: plate.O}\n";
    const Mechanism m = Loaded(all);
    const StiffnessResult result = AtHome(m);
    ASSERT_TRUE(result.summary.ok()) << result.summary.message << " trial " << trial;
    ExpectNear(result.C, fixtures::DirectStiffness(m, m.X_WB_home).Compliance(0), all.c_str());
  }
}

TEST(FrameStiffness, NamesWhatItCannotDo) {
  const std::string rigid =
      "name: rigid\nbodies: {b: {}}\n"
      "joints: {j: {kind: revolute, parent: world, child: b, axis: z}}\noutputs: {b: b}\n";
  EXPECT_EQ(AtHome(Loaded(rigid)).summary.stop, Stop::kUnsupported);
  Mechanism m = Loaded(Cantilever(""));
  m.outputs[0].X_BO.translation().x() -= 0.1;
  const StiffnessResult beside = AtHome(m);
  EXPECT_EQ(beside.summary.stop, Stop::kUnsupported);
  EXPECT_NE(beside.summary.message.find("output 'tip' sits on the elastic body 'beam'"),
            std::string::npos)
      << beside.summary.message;
}

}  // namespace
}  // namespace mbv
