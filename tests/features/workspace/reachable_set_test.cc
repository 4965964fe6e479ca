// Reachable sets of any model, against areas, curves and volumes by hand and by closed forms.
#include "features/workspace/reachable_set.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "analytic/scara_robot/workspace.h"
#include "analytic/spr_tripod/workspace.h"
#include "features/workspace/quality.h"
#include "features/workspace/set_report.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using std::numbers::pi;
using testing::AllOf;
using testing::HasSubstr;

Mechanism ShippedModel(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/") + name + "/model.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return *result.mechanism;
}
Mechanism FromText(const std::string& text) {
  LoadResult result = LoadModelText(text, "set.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}

struct Answer {
  std::optional<SetQuestion> question;
  ReachableSet set;
  Diagnostics diagnostics;
};
Answer Ask(const Mechanism& mechanism, const SetArguments& arguments) {
  Answer answer;
  answer.question = ReadQuestion(mechanism, arguments, &answer.diagnostics);
  if (!answer.question) return answer;
  answer.set = ComputeReachableSet(*answer.question, arguments);
  answer.diagnostics.Append(answer.set.diagnostics);
  return answer;
}
SetArguments Over(const std::vector<std::string>& over, int resolution = 60) {
  SetArguments arguments;
  arguments.over = over;
  arguments.flood.resolution = resolution;
  return arguments;
}

// Both ways have an answer, and it is this.
void ExpectMeasure(const Answer& answer, double measure, double within) {
  const ReachableSet& set = answer.set;
  ASSERT_TRUE(set.summary.ok()) << answer.diagnostics.Text() << set.verdict;
  EXPECT_TRUE(set.agree) << set.verdict;
  EXPECT_NEAR(set.traced.measure, measure, within);
  EXPECT_NEAR(set.flooded.measure, measure, set.flooded.error + within);
  EXPECT_LT(set.traced.error, 1e-6 * measure);
  EXPECT_GT(set.checked, 0u);
  EXPECT_LT(set.checked_off, 1e-9);
}

// Two links in a plane, the second elbow up.
std::string Arm(const std::string& more = "") {
  return R"(
name: arm
parameters: {a: {value: 0.5, unit: m}, b: {value: 0.2, unit: m}}
gravity: [0, 0, 0]
bodies:
  upper:
    mass: 2
    com: [a, 0, 0]
    inertia: [0.01, 0.01, 0.01]
    frames: {end: [a, 0, 0]}
  fore:
    mass: 3
    com: [b, 0, 0]
    inertia: [0.02, 0.02, 0.02]
    frames: {end: [b, 0, 0]}
joints:
  shoulder: {kind: revolute, parent: world, child: upper, axis: z, guess_deg: 20}
  elbow: {kind: revolute, parent: upper.end, child: fore, axis: z, guess_deg: 70}
drives:
  shoulder: {kind: joint, joint: shoulder}
  elbow: {kind: joint, joint: elbow}
outputs: {tip: fore.end}
)" + more;
}

TEST(ReachableSet, AnArmsTipReachesARing) {
  ExpectMeasure(Ask(FromText(Arm()), Over({"x", "y"})), pi * (0.49 - 0.09), 1e-10);
}

// Files of robots state no outputs: bodies and frames have poses, too.
TEST(ReachableSet, ABodyOrAFrameIsAnOutput) {
  Mechanism arm = FromText(Arm());
  arm.outputs.clear();
  SetArguments arguments = Over({"x", "y"});
  arguments.output = "fore.end";
  ExpectMeasure(Ask(arm, arguments), pi * (0.49 - 0.09), 1e-10);
  arguments = Over({"x"});
  arguments.output = "fore";  // its origin is the elbow, on a circle
  const Answer elbow = Ask(arm, arguments);
  ASSERT_EQ(elbow.set.traced.ends.size(), 2u) << elbow.diagnostics.Text();
  EXPECT_NEAR(elbow.set.traced.ends[1].first, 0.5, 1e-9);
  arguments.output = "end";  // of two bodies
  EXPECT_THAT(Ask(arm, arguments).diagnostics.Text(), HasSubstr("there is no such output"));
}

TEST(ReachableSet, AnArmsPathEndsWhereItIsStretched) {
  const Answer answer = Ask(FromText(Arm()), Over({"x"}));
  const double y = 0.5 * std::sin(pi / 9) + 0.2;
  ASSERT_EQ(answer.set.traced.ends.size(), 2u) << answer.diagnostics.Text();
  EXPECT_NEAR(answer.set.traced.ends[1].first, std::sqrt(0.49 - y * y), 1e-11);
  EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
}

// The drum turns a hundred times on the way.
TEST(ReachableSet, ABoxEndsALongWay) {
  const Answer answer = Ask(ShippedModel("winch"), Over({"z=-10:-0.5"}, 400));
  ExpectMeasure(answer, 9.5, 1e-9);
}

// A disc whose boundary takes 600 rad of the screws.
TEST(ReachableSet, ABoundaryAlongWhichScrewsTurnFastComesBack) {
  const Answer answer = Ask(FromText(R"(
name: screws
parameters: {lead: {value: 0.02, unit: m}}
bodies:
  bridge: {mass: 1, inertia: [1, 1, 1]}
  tool: {mass: 1, inertia: [1, 1, 1]}
  screw1: {mass: 1, inertia: [1, 1, 1]}
  screw2: {mass: 1, inertia: [1, 1, 1]}
world: {frames: {centre: [0.02, -0.01, 0.05]}}
joints:
  x: {kind: prismatic, parent: world, child: bridge, axis: x}
  y: {kind: prismatic, parent: bridge, child: tool, axis: y}
  screw1: {kind: revolute, parent: world, child: screw1, axis: x}
  screw2: {kind: revolute, parent: bridge, child: screw2, axis: y}
couplings:
  thread1: {joint: screw1, follows: x, ratio: 2*pi/lead}
  thread2: {joint: screw2, follows: y, ratio: 2*pi/lead}
drives:
  screw1: {kind: joint, joint: screw1}
  screw2: {kind: joint, joint: screw2}
  reach: {kind: distance, from: world.centre, to: tool, range: [-1, 0.25]}
outputs: {tool: tool}
)"),
                            Over({"x", "y"}, 40));
  ExpectMeasure(answer, pi * (0.25 * 0.25 - 0.05 * 0.05), 1e-9);
}

TEST(ReachableSet, OfDrivesThatAreAskedTheOthersRest) {
  Diagnostics diagnostics;
  const auto held = [&](const std::vector<std::string>& over) {
    const auto question = ReadQuestion(ShippedModel("stewart"), Over(over), &diagnostics);
    EXPECT_TRUE(question.has_value()) << diagnostics.Text();
    std::vector<std::string> names;
    for (const NamedCoordinate& named : question->settings.coordinates) names.push_back(named.name);
    names.erase(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(over.size()));
    return names;
  };
  EXPECT_THAT(held({"leg1.length", "leg2.length"}),
              testing::ElementsAre("leg3.length", "leg4.length", "leg5.length", "leg6.length"));
  EXPECT_THAT(held({"x", "leg2.length"}),
              testing::ElementsAre("platform.y", "platform.z", "platform.roll", "platform.pitch"));
}

TEST(ReachableSet, PosesThatAreReachedInTwoWaysAreNamedWhereBranchesCross) {
  ReachableSet set;
  set.over = {"tool.x", "tool.y"};
  set.over_units = {"m", "m"};
  set.traced.summary = set.flooded.summary = RunSummary::Done();
  set.flooded.conflicts = 3;
  set.flooded.conflict_at = Vec3(0.25, -0.5, 0.0);
  for (const double margin : {0.01, 0.9}) {
    set.flooded.conflict_margin = margin;
    JudgeSet(&set);
    EXPECT_FALSE(set.agree);
    EXPECT_THAT(set.verdict, HasSubstr("3 poses of the lattice are reached in two ways"));
    EXPECT_EQ(set.verdict.find("constraint singularity near tool.x = 0.25 m, tool.y = -0.5 m") !=
                  std::string::npos,
              margin < 0.1);
  }
}

// A rod between two balls turns about their line by itself, whatever its mass: nothing is held.
TEST(ReachableSet, ARodWhoseMassIsBesideItsLineIsHeldByNothing) {
  const std::string text = R"(
name: ball_rod
bodies:
  crank: {mass: 1, inertia: [1, 1, 1], frames: {pin: [0.1, 0, 0]}}
  rod: {mass: 1, com: [0.1, 0.03, 0], inertia: [0.01, 0.02, 0.02], frames: {end: [0.3, 0, 0]}}
  slider: {mass: 1, inertia: [1, 1, 1]}
world: {frames: {way: [0, 0, 0.05]}}
joints:
  shaft: {kind: revolute, parent: world, child: crank, axis: z, guess: 0.5}
  A: {kind: spherical, parent: crank.pin, child: rod}
  slide: {kind: prismatic, parent: world.way, child: slider, axis: x, guess: 0.38}
  B: {kind: spherical, parent: rod.end, child: slider, closure: true}
drives: {shaft: {kind: joint, joint: shaft}}
outputs: )";
  const Answer answer = Ask(FromText(text + "{slider: slider}"), Over({"x"}, 100));
  ASSERT_EQ(answer.set.traced.ends.size(), 2u) << answer.diagnostics.Text() << answer.set.verdict;
  EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
  EXPECT_EQ(answer.set.dofs, 1);
  EXPECT_THAT(answer.set.notes, testing::Contains(HasSubstr("by themselves: rod")));
  const double middle = std::sqrt(0.3 * 0.3 - 0.05 * 0.05);
  EXPECT_NEAR(answer.set.traced.ends[0].first, middle - 0.1, 1e-10);
  EXPECT_NEAR(answer.set.traced.ends[1].first, middle + 0.1, 1e-10);
  // A telescopic one, whose length nothing holds: the crank rests, not a ball, which turns more.
  std::string telescopic = text + "{slider: slider}";
  const auto replace = [&](const std::string& from, const std::string& to) {
    telescopic.replace(telescopic.find(from), from.size(), to);
  };
  replace("  slider: {mass", "  tube: {mass: 1, inertia: [1, 1, 1]}\n  slider: {mass");
  replace("child: rod}",
          "child: tube}\n  stroke: {kind: prismatic, parent: tube, child: rod, axis: x}");
  replace("drives: {shaft: {kind: joint, joint: shaft}}\n", "");
  Diagnostics of_telescopic;
  const auto longer = ReadQuestion(FromText(telescopic), Over({"x"}), &of_telescopic);
  ASSERT_TRUE(longer.has_value()) << of_telescopic.Text();
  ASSERT_EQ(longer->settings.coordinates.size(), 2u);
  EXPECT_THAT(longer->settings.coordinates[1].name, testing::AnyOf("shaft", "stroke"));
  // Where its own poses are asked they show the turn.
  Diagnostics diagnostics;
  const auto question =
      ReadQuestion(FromText(text + "{slider: slider, rod: rod}"), Over({"slider.x"}), &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  EXPECT_EQ(question->settings.coordinates.size(), 2u);
}

// cos θ1 cos θ2 > cos α.
TEST(ReachableSet, AConeOfAUniversalJointIsACone) {
  const Mechanism joint = FromText(R"(
name: universal
bodies:
  rod: {mass: 1, com: [0, 0, 0.1], inertia: [0.01, 0.01, 0.01]}
joints:
  u: {kind: universal, parent: world, child: rod, axis: x, axis2: y}
outputs: {rod: rod}
)");
  SetArguments arguments = Over({"u.0", "u.1"});
  arguments.cones = {"u_deg=40"};
  double area = 0.0;
  const double alpha = 40 * pi / 180;
  constexpr int n = 2000;  // θ1 = α sin φ: smooth to the ends
  for (int i = 0; i < n; ++i) {
    const double phi = pi / 2 * (i + 0.5) / n;
    const double t1 = alpha * std::sin(phi);
    area += 4 * std::acos(std::cos(alpha) / std::cos(t1)) * alpha * std::cos(phi) * pi / 2 / n;
  }
  const Answer answer = Ask(joint, arguments);
  ExpectMeasure(answer, area, 1e-6);
  ASSERT_FALSE(answer.set.shares.empty());
  EXPECT_EQ(answer.set.bounds[static_cast<size_t>(answer.set.shares[0].bound)].kind,
            SetBound::Kind::kCone);
}

// Of circles about the feet, elbows outwards; base 0.3, upper arms 0.25, forearms 0.35.
Eigen::Vector2d Elbow(const Eigen::Vector2d& tool, double foot, double side) {
  const Eigen::Vector2d d = tool - Eigen::Vector2d(foot, 0);
  const double r = d.norm(), s = (0.25 * 0.25 - 0.35 * 0.35 + r * r) / (2 * r);
  const double h = std::sqrt(std::max(0.25 * 0.25 - s * s, 0.0));
  const Eigen::Vector2d e = d / r;
  return Eigen::Vector2d(foot, 0) + s * e + side * h * Eigen::Vector2d(-e[1], e[0]);
}

TEST(ReachableSet, AFiveBarsCirclesAndSingularCurvesAreThoseOfItsClosedForm) {
  const Mechanism five_bar = ShippedModel("friction_five_bar");
  SetArguments arguments = Over({"x", "y"}, 120);
  // Beyond type 2: the lens of two circles less the two inner ones.
  arguments.cross_singularities = true;
  const double lens = 2 * 0.36 * std::acos(0.25) - 0.15 * std::sqrt(4 * 0.36 - 0.09);
  const Answer whole = Ask(five_bar, arguments);
  ExpectMeasure(whole, lens - 2 * pi * 0.01, 1e-10);
  EXPECT_EQ(whole.set.traced.sections[0].loops.size(), 3u);
  // Inside it, the forearms lie in one line on curves.
  const QualityMap map = MapQuality(*whole.question, whole.set, "tool", 1);
  size_t inside = 0;
  for (const TracedArc& arc : map.singular) {
    for (const Eigen::Vector2d& p : arc.points) {
      const double r1 = p.norm(), r2 = (p - Eigen::Vector2d(0.3, 0)).norm();
      if (std::max(r1, r2) > 0.599 || std::min(r1, r2) < 0.101) continue;
      const Eigen::Vector2d a = p - Elbow(p, 0, 1), b = p - Elbow(p, 0.3, -1);
      EXPECT_LT(std::abs(a[0] * b[1] - a[1] * b[0]) / (0.35 * 0.35), 1e-9) << p.transpose();
      ++inside;
    }
  }
  EXPECT_GT(inside, 50u);

  arguments.cross_singularities = false;
  const Answer answer = Ask(five_bar, arguments);
  ASSERT_TRUE(answer.set.agree) << answer.set.verdict;
  size_t type1 = 0, type2 = 0;
  for (const TracedLoop& loop : answer.set.traced.sections[0].loops) {
    for (const TracedArc& arc : loop.arcs) {
      for (const Eigen::Vector2d& p : arc.points) {
        const double r1 = p.norm(), r2 = (p - Eigen::Vector2d(0.3, 0)).norm();
        const SetBound::Kind kind = answer.set.bounds[static_cast<size_t>(arc.bound)].kind;
        if (kind == SetBound::Kind::kType1) {
          // Stretched or folded.
          const double off = std::min(
              {std::abs(r1 - 0.6), std::abs(r1 - 0.1), std::abs(r2 - 0.6), std::abs(r2 - 0.1)});
          EXPECT_LT(off, 1e-9) << p.transpose();
          ++type1;
        } else if (std::max(r1, r2) < 0.599 && std::min(r1, r2) > 0.101) {
          // The forearms lie in one line.
          const Eigen::Vector2d a = p - Elbow(p, 0, 1), b = p - Elbow(p, 0.3, -1);
          EXPECT_LT(std::abs(a[0] * b[1] - a[1] * b[0]) / (0.35 * 0.35), 1e-9) << p.transpose();
          ++type2;
        }
      }
    }
  }
  EXPECT_GT(type1, 50u);
  EXPECT_GT(type2, 20u);
}

// The inner circles of both limbs cross: their boundaries are branches of one singularity.
TEST(ReachableSet, HolesThatOverlapAreOne) {
  for (const auto& [base, upper] :
       {std::pair(0.17896087281166784, 0.22139718660000593), std::pair(0.15, 0.23)}) {
    LoadOptions options;
    options.overrides = {{"base", base}, {"upper", upper}};
    LoadResult loaded = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"), options);
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    SetArguments arguments = Over({"x", "y"}, 120);
    arguments.cross_singularities = true;
    const auto lens = [d = base](double r) {
      return 2 * r * r * std::acos(d / (2 * r)) - 0.5 * d * std::sqrt(4 * r * r - d * d);
    };
    const double hole = 0.35 - upper;
    const Answer answer = Ask(*loaded.mechanism, arguments);
    ExpectMeasure(answer, lens(0.35 + upper) - (2 * pi * hole * hole - lens(hole)), 1e-9);
    EXPECT_EQ(answer.set.traced.sections[0].loops.size(), 2u);
  }
}

// A hole so small that a step along its rim leaves it: it is taken off, not added.
TEST(ReachableSet, SmallHolesAreTakenOff) {
  for (const auto& [base, upper] :
       {std::pair(0.20676558345885643, 0.29936310477781203), std::pair(0.2, 0.3)}) {
    LoadOptions options;
    options.overrides = {{"base", base}, {"upper", upper}};
    LoadResult loaded = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"), options);
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    const Answer answer = Ask(*loaded.mechanism, Over({"x", "y"}, 60));
    ASSERT_TRUE(answer.set.agree) << answer.set.verdict;
    double outer = 0.0, inner = 0.0;
    for (const TracedLoop& loop : answer.set.traced.sections[0].loops) {
      (loop.area > 0.0 ? outer : inner) += loop.area;
    }
    EXPECT_GT(outer, 1.0);
    EXPECT_LT(inner, -0.01);
  }
}

// Three arms of two links hold a platform; home is turned so that nothing is symmetric.
constexpr const char* k3Rrr = R"(
name: planar_3rrr
parameters: {l: {value: 0.25, unit: m}, f: {value: 0.2, unit: m}, R: {value: 0.35, unit: m}, r: {value: 0.12, unit: m}}
gravity: [0, 0, 0]
bodies:
  platform: {mass: 1, inertia: [0.01, 0.01, 0.01]}
parts:
  arm:
    parameters: {phi: 0}
    attach:
      world: {A: {position: [R*cos(phi), R*sin(phi), 0]}}
      platform: {C: {position: [r*cos(phi), r*sin(phi), 0]}}
    bodies:
      upper: {mass: 0.2, inertia: [0.001, 0.001, 0.001], frames: {end: [l, 0, 0]}}
      fore: {mass: 0.2, inertia: [0.001, 0.001, 0.001], frames: {end: [f, 0, 0]}}
    joints:
      A: {kind: revolute, parent: world.A, child: upper, axis: z, guess: phi + 2.2}
      B: {kind: revolute, parent: upper.end, child: fore, axis: z, guess: 1.6}
      C: {kind: revolute, parent: platform.C, child: fore.end, axis: z, closure: true}
    drives:
      drive: {kind: joint, joint: A}
instances:
  a: {part: arm, phi: 0.2}
  b: {part: arm, phi: 2.3}
  c: {part: arm, phi: 4.3}
joints:
  base: {kind: planar, parent: world, child: platform, axis: z, guess: [0.01, 0.02, 0.1], closure: false}
outputs: {platform: platform}
)";

TEST(ReachableSet, SingularCurvesOfA3RrrAreThoseOfItsClosedForm) {
  const Mechanism robot = FromText(k3Rrr);
  SetArguments arguments = Over({"x", "y"}, 80);
  arguments.at = {"yaw=0.1"};
  const Answer answer = Ask(robot, arguments);
  ASSERT_TRUE(answer.set.summary.ok()) << answer.diagnostics.Text() << answer.set.verdict;
  EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
  // Working modes as at home.
  const std::array<double, 3> phi = {0.2, 2.3, 4.3};
  const auto foot = [&](size_t i) {
    return Eigen::Vector2d(0.35 * std::cos(phi.at(i)), 0.35 * std::sin(phi.at(i)));
  };
  const auto elbow = [&](const Eigen::Vector2d& p, size_t i, double side) {
    const Eigen::Vector2d C =
        p + 0.12 * Eigen::Vector2d(std::cos(phi.at(i) + 0.1), std::sin(phi.at(i) + 0.1));
    const Eigen::Vector2d d = C - foot(i);
    const double along = (0.0625 - 0.04 + d.squaredNorm()) / (2 * d.norm());
    const double h = std::sqrt(std::max(0.0625 - along * along, 0.0));
    return std::pair(C, Eigen::Vector2d(foot(i) + along * d.normalized() +
                                        side * h * Eigen::Vector2d(-d[1], d[0]).normalized()));
  };
  std::array<double, 3> side{};
  for (size_t i = 0; i < 3; ++i) {
    const Pose& X_WB =
        robot.X_WB_home[static_cast<size_t>(robot.FindBody(std::string(1, "abc"[i]) + ".fore"))];
    const Pose& X_WP = robot.X_WB_home[static_cast<size_t>(robot.FindBody("platform"))];
    // At home's own yaw the sign is the same.
    const Vec3 C = X_WP * Vec3(0.12 * std::cos(phi.at(i)), 0.12 * std::sin(phi.at(i)), 0);
    const Eigen::Vector2d d = C.head<2>() - foot(i), b = X_WB.translation().head<2>() - foot(i);
    side.at(i) = d[0] * b[1] - d[1] * b[0] > 0 ? 1.0 : -1.0;
  }
  size_t type1 = 0, type2 = 0;
  for (const TracedLoop& loop : answer.set.traced.sections[0].loops) {
    for (const TracedArc& arc : loop.arcs) {
      const SetBound::Kind kind = answer.set.bounds[static_cast<size_t>(arc.bound)].kind;
      for (const Eigen::Vector2d& p : arc.points) {
        Mat3 lines;
        double stretched = 1.0;
        for (size_t i = 0; i < 3; ++i) {
          const auto [C, B] = elbow(p, i, side.at(i));
          const Eigen::Vector2d u = (C - B).normalized(), c = C - p;
          lines.row(static_cast<Eigen::Index>(i)) << u[0], u[1], (c[0] * u[1] - c[1] * u[0]) / 0.12;
          const double reach = (C - foot(i)).norm();
          stretched = std::min({stretched, std::abs(reach - 0.45), std::abs(reach - 0.05)});
        }
        if (kind == SetBound::Kind::kType1) {
          EXPECT_LT(stretched, 1e-9);
          ++type1;
        } else if (kind == SetBound::Kind::kType2 && stretched > 1e-3) {
          EXPECT_LT(std::abs(lines.determinant()), 1e-9);
          ++type2;
        }
      }
    }
  }
  EXPECT_GT(type1 + type2, 50u);
  EXPECT_GT(type2, 8u);
}

spr_tripod::Geometry TripodGeometry(const Mechanism& tripod) {
  Diagnostics diagnostics;
  spr_tripod::Geometry geometry = spr_tripod::ReadGeometry(tripod, &diagnostics);
  EXPECT_FALSE(diagnostics.has_errors()) << diagnostics.Text();
  return geometry;
}

// A section of the tripod, whose closed form knows its rim.
double TripodSection(const Mechanism& tripod, double z) {
  const spr_tripod::Geometry geometry = TripodGeometry(tripod);
  // Corners lie where two legs are at their ends; their azimuths are found by the second
  // differences, so the integral is by many azimuths instead and Richardson.
  const auto area = [&](int n) {
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      const double rho = spr_tripod::ReachAt(geometry, z, 2 * pi * (i + 0.5) / n);
      sum += pi / n * rho * rho;
    }
    return sum;
  };
  return area(24000);
}

TEST(ReachableSet, ASectionOfTheTripodIsThatOfItsClosedForm) {
  const Mechanism tripod = ShippedModel("spr_tripod");
  SetArguments arguments = Over({"x", "y"}, 120);
  arguments.at = {"z=0.6"};
  const Answer answer = Ask(tripod, arguments);
  ExpectMeasure(answer, TripodSection(tripod, 0.6), 2e-8);
  EXPECT_LT(answer.set.traced.error, 1e-9);
  // Strokes that are longer by 1e-4 m show.
  Mechanism longer = tripod;
  for (Drive& drive : longer.drives) drive.range.upper += 1e-4;
  for (Joint& joint : longer.joints) {
    if (joint.kind == JointKind::kPrismatic) joint.range[0].upper += 1e-4;
  }
  const Answer other = Ask(longer, arguments);
  EXPECT_GT(other.set.traced.measure - answer.set.traced.measure,
            100 * (answer.set.traced.error + other.set.traced.error));
  EXPECT_NEAR(other.set.traced.measure, TripodSection(longer, 0.6), 1.0);
}

TEST(ReachableSet, TheTripodsVolumeIsThatOfItsClosedForm) {
  const Mechanism tripod = ShippedModel("spr_tripod");
  Diagnostics diagnostics;
  const auto question = ReadQuestion(tripod, Over({"x", "y", "z"}), &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  PoseSpace space(question->mechanism, question->settings);
  PlacedPose home;
  ASSERT_TRUE(space.Home(&home));
  space.CountFrom(&home);
  const TracedSet set = TraceSet(space, home, {}, 1e-6);
  ASSERT_TRUE(set.summary.ok()) << set.summary.message;
  EXPECT_NEAR(set.measure, 0.01243676143457, 1e-6 * 0.0124);
  EXPECT_LT(set.closings, 200000);
  EXPECT_NEAR(set.low, 0.435861216, 1e-6);
  EXPECT_NEAR(set.high, 0.708854710, 1e-6);
}

// The hexapod's platform without turning: six shells about B_i − A_i, by lines along x; its area at
// a height.
double HexapodSection(double z, double longest, int lines) {
  constexpr double R = 0.48, r = 0.3, shortest = 0.36;
  const double half = 0.5 * (pi / 3 - std::acos(0.8));
  const std::array<double, 6> base = {
      half, 2 * pi / 3 - half, 2 * pi / 3 + half, 4 * pi / 3 - half, 4 * pi / 3 + half, -half};
  const std::array<double, 6> platform = {pi / 3 - half, pi / 3 + half,     pi - half,
                                          pi + half,     5 * pi / 3 - half, -pi / 3 + half};
  double sum = 0.0;
  for (int line = 0; line < lines; ++line) {
    const double y = -0.6 + 1.2 * (line + 0.5) / lines;
    double low = -1.0, high = 1.0;
    std::vector<std::pair<double, double>> gone;
    for (size_t i = 0; i < 6; ++i) {
      const double x_i = R * std::cos(base.at(i)) - r * std::cos(platform.at(i));
      const double y_i = R * std::sin(base.at(i)) - r * std::sin(platform.at(i));
      const double off = z * z + (y - y_i) * (y - y_i);
      const double out = std::sqrt(std::max(longest * longest - off, 0.0));
      const double in = std::sqrt(std::max(shortest * shortest - off, 0.0));
      low = std::max(low, x_i - out);
      high = std::min(high, x_i + out);
      if (in > 0.0) gone.emplace_back(x_i - in, x_i + in);
    }
    std::ranges::sort(gone);
    for (const auto& [a, b] : gone) {
      if (a > low) sum += std::max(0.0, std::min(a, high) - low);
      low = std::max(low, b);
    }
    sum += std::max(0.0, high - low);
  }
  return sum * 1.2 / lines;
}

// At this height two legs' shortest lengths leave a neck between two corners of a third's longest:
// a curve crosses another one twice between two nodes.
TEST(ReachableSet, ASectionWithANeckIsThatByHand) {
  const Mechanism hexapod = ShippedModel("stewart_legs");
  SetArguments arguments = Over({"x", "y"}, 60);
  arguments.at = {"z=0.33637312"};
  const double area = HexapodSection(0.33637312, 0.64, 40000);
  ExpectMeasure(Ask(hexapod, arguments), area, 2e-6 * area);
  const double other = HexapodSection(0.33637312, 0.64001, 40000);
  EXPECT_GT(std::abs(other - area), 1e-5 * area);
}

// Sections of this volume change their corners at several heights: rules between these end soon.
TEST(ReachableSet, TheHexapodsVolumeIsThatByHand) {
  const Mechanism hexapod = ShippedModel("stewart_legs");
  Diagnostics diagnostics;
  const auto question = ReadQuestion(hexapod, Over({"x", "y", "z"}), &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  PoseSpace space(question->mechanism, question->settings);
  PlacedPose home;
  ASSERT_TRUE(space.Home(&home));
  space.CountFrom(&home);
  const TracedSet set = TraceSet(space, home, {}, 2e-3, 2);
  ASSERT_TRUE(set.summary.ok()) << set.summary.message;
  const auto by_hand = [&](double longest) {
    constexpr int n = 2000;
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      const double z = set.low + (set.high - set.low) * (i + 0.5) / n;
      sum += HexapodSection(z, longest, n) * (set.high - set.low) / n;
    }
    return sum;
  };
  const double volume = by_hand(0.64);
  EXPECT_NEAR(set.measure, volume, set.error + 1e-6 * volume);
  EXPECT_LT(set.error, 2e-3 * volume);
  EXPECT_GT(std::abs(by_hand(0.641) - volume), 2 * set.error);
  EXPECT_LT(set.closings, 150000);
}

// A box of 0.6 × 0.2 × 0.4 m less a ball of 0.25 m about the middle of its floor: below, sections
// have two parts, which meet above, and near the ball's top a hole.
TEST(ReachableSet, AVolumeWithSectionsOfTwoPartsIsThatByHand) {
  const auto gantry = [](double radius) {
    return FromText(fmt::format(R"(
name: gantry
bodies:
  bridge: {{mass: 1, inertia: [1, 1, 1]}}
  trolley: {{mass: 1, inertia: [1, 1, 1]}}
  tool: {{mass: 1, inertia: [1, 1, 1]}}
world: {{frames: {{floor: [0, 0, -0.2]}}}}
joints:
  x: {{kind: prismatic, parent: world, child: bridge, axis: x, guess: 0.02, range: [-0.3, 0.3]}}
  y: {{kind: prismatic, parent: bridge, child: trolley, axis: y, guess: 0.01, range: [-0.1, 0.1]}}
  z: {{kind: prismatic, parent: trolley, child: tool, axis: z, guess: 0.15, range: [-0.2, 0.2]}}
drives:
  x: {{kind: joint, joint: x}}
  y: {{kind: joint, joint: y}}
  z: {{kind: joint, joint: z}}
  strut: {{kind: distance, from: world.floor, to: tool, range: [{}, 2]}}
outputs: {{tool: tool}}
)",
                                radius));
  };
  const auto volume = [](double r) { return 0.048 - pi / 2 * (0.2 * r * r - 0.002 / 3); };
  SetArguments arguments = Over({"x", "y", "z"}, 32);
  arguments.flood.threads = 2;
  const Answer answer = Ask(gantry(0.25), arguments);
  ExpectMeasure(answer, volume(0.25), 1e-9);
  EXPECT_NEAR(answer.set.traced.low, -0.2, 1e-9);
  // A ball of 1e-4 m more shows.
  EXPECT_GT(volume(0.25) - volume(0.2501), 1e3 * answer.set.traced.error);
  PoseSpace space(answer.question->mechanism, answer.question->settings);
  PlacedPose home;
  ASSERT_TRUE(space.Home(&home));
  space.CountFrom(&home);
  const TracedSet one = TraceSet(space, home, {}, 1e-5, 1);
  const TracedSet many = TraceSet(space, home, {}, 1e-5, 3);
  EXPECT_EQ(one.measure, many.measure);
  EXPECT_EQ(one.closings, many.closings);
}

// What the closed form takes for reachable ends where the traced boundary lies, to 1e-8 m.
TEST(ReachableSet, ASectionOfTheScaraRobotIsThatOfItsClosedForm) {
  const Mechanism robot = ShippedModel("scara_robot");
  SetArguments arguments = Over({"x", "y"}, 40);
  arguments.at = {"yaw_deg=45", "z=-0.165"};
  arguments.cross_singularities = true;
  // The model states the shear's range of two limbs, the closed form of all.
  const double most = 0.05 * std::sin(50 * pi / 180);
  for (const char* limb : {"limb1", "limb2"}) {
    arguments.ranges.push_back(fmt::format("{}.cross_bar.0={:.17g}:{:.17g}", limb, -most, most));
  }
  const Answer answer = Ask(robot, arguments);
  ASSERT_TRUE(answer.set.agree) << answer.diagnostics.Text() << answer.set.verdict;
  const scara_robot::Parameters parameters = scara_robot::ParametersOf(robot);
  const scara_robot::Limits limits = scara_robot::LimitsOf(robot);
  const auto reached = [&](const Eigen::Vector2d& p) {
    return scara_robot::CheckPose(parameters, limits, {p[0], p[1], -0.165, pi / 4}).reach ==
           scara_robot::Reach::kReachable;
  };
  size_t checked = 0;
  for (const TracedLoop& loop : answer.set.traced.sections[0].loops) {
    for (const TracedArc& arc : loop.arcs) {
      for (size_t k = 1; k + 1 < arc.points.size(); ++k) {
        const Eigen::Vector2d along = (arc.points[k + 1] - arc.points[k - 1]).normalized();
        const Eigen::Vector2d across = 1e-8 * Eigen::Vector2d(-along[1], along[0]);
        EXPECT_NE(reached(arc.points[k] + across), reached(arc.points[k] - across))
            << arc.points[k].transpose();
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 100u);
}

// On the axes of symmetry of this platform two branches of type 2 cross at any height, and near
// home many are close: margins are a thousand times as large as at home, the set a hundredth of the
// mechanism. Parts touch where branches cross; at z = 0.905 a neck of 1e-4 m joins two.
TEST(ReachableSet, SectionsWithManyTypeTwoCurvesAreFollowed) {
  struct Section {
    const char* height;
    int resolution;
    double area;  // within the zeros of the closed form's determinant about home
  };
  const Mechanism platform = ShippedModel("stabilizing_platform");
  for (const Section& section :
       {Section{"z=0.905", 240, kNan}, Section{"z=0.9075", 120, kNan},
        Section{"z=0.911688", 60, 0.00058414831}, Section{"z=0.93", 60, 0.00246316556}}) {
    SCOPED_TRACE(section.height);
    SetArguments arguments = Over({"x", "y"}, section.resolution);
    arguments.at = {section.height};
    const Answer answer = Ask(platform, arguments);
    ASSERT_TRUE(answer.set.summary.ok()) << answer.set.verdict;
    EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
    EXPECT_LT(answer.set.traced.error, 1e-8 * answer.set.traced.measure);
    if (std::isfinite(section.area)) {
      EXPECT_NEAR(answer.set.traced.measure, section.area, 3e-8 * section.area);
    }
  }
}

// Both feet of a limb reach 20° at once while the platform is level: its sections are bounded by
// lines at p and q from the axis in turn, and each line by two joints. Beside them parts would be
// followed for ever, or several times.
TEST(ReachableSet, BoundsThatAreTheSameEndASetOnce) {
  const Mechanism platform = ShippedModel("stabilizing_platform");
  // Of p, q = u ± d with u = tan 20° times the height over the feet: √3 (4pq − p² − q²).
  const double tan20 = std::tan(20 * pi / 180), feet = 0.225, d = 7.5 - 7.38;
  const auto area = [&](double z) {
    return std::sqrt(3.0) * (2 * std::pow(tan20 * (z - feet), 2) - 6 * d * d);
  };
  SetArguments arguments = Over({"x", "y"}, 30);
  arguments.at = {"z=3.15"};
  const Answer section = Ask(platform, arguments);
  ExpectMeasure(section, area(3.15), 1e-8);
  EXPECT_GT(area(3.15 + 1e-6) - area(3.15), 1e-6);  // a thousandth of a millimetre would be noticed
  ASSERT_EQ(section.set.traced.sections.size(), 1u);
  for (const TracedLoop& loop : section.set.traced.sections[0].loops) {
    std::set<int> bounds;
    for (const TracedArc& arc : loop.arcs) bounds.insert(arc.bound);
    EXPECT_EQ(bounds.size(), 6u);
  }
  // In a solid they are no change of its sections: one rule is enough.
  const SetArguments solid = Over({"x", "y", "z=2.7:4.5"}, 12);
  Diagnostics diagnostics;
  const auto question = ReadQuestion(platform, solid, &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  const TracedSet traced =
      ComputeReachableSet(*question, solid, {}, nullptr, {.lattice = false}).traced;
  const auto integral = [&](double z) {
    return std::sqrt(3.0) * (2 * tan20 * tan20 * std::pow(z - feet, 3) / 3 - 6 * d * d * z);
  };
  ASSERT_TRUE(traced.summary.ok()) << traced.summary.message;
  EXPECT_NEAR(traced.measure, integral(4.5) - integral(2.7), 1e-7);
  EXPECT_LT(traced.error, 1e-6);
  EXPECT_LT(traced.closings, 200000);
}

// This robot's drives lose their hold twice where its links lie flat, so that the determinant keeps
// its sign: the set ends there all the same, and what lies below is its image.
TEST(ReachableSet, ASetEndsWhereTheDeterminantVanishesTwice) {
  const Mechanism robot = ShippedModel("cabin_robot");
  const Answer half = Ask(robot, Over({"x", "y"}, 60));
  SetArguments across = Over({"x", "y"}, 60);
  across.cross_singularities = true;
  const Answer whole = Ask(robot, across);
  ASSERT_TRUE(whole.set.summary.ok()) << whole.set.verdict;
  ExpectMeasure(half, 0.5 * whole.set.traced.measure, 1e-9);
}

// Two drives on lengths lose their hold where they stand across: on the lines u = 0 and v = 0,
// which cross. Beyond, the determinant has the sign of home again, but no way leads there.
Mechanism CrossingGantry(const Vec3& axis_u, const Vec3& axis_v, double u, double v) {
  return FromText(fmt::format(R"(
name: crossing
bodies:
  bridge: {{mass: 1, inertia: [1, 1, 1], frames: {{foot: [0, 0, -0.2]}}}}
  tool: {{mass: 1, inertia: [1, 1, 1]}}
world: {{frames: {{floor: [0, 0, -0.2]}}}}
joints:
  u: {{kind: prismatic, parent: world, child: bridge, axis: [{}, {}, 0], guess: {}, range: [-0.3, 0.2]}}
  v: {{kind: prismatic, parent: bridge, child: tool, axis: [{}, {}, 0], guess: {}, range: [-0.1, 0.15]}}
drives:
  one: {{kind: distance, from: world.floor, to: bridge}}
  two: {{kind: distance, from: bridge.foot, to: tool}}
outputs: {{tool: tool}}
)",
                              axis_u.x(), axis_u.y(), u, axis_v.x(), axis_v.y(), v));
}

TEST(ReachableSet, PartsThatTouchInASingularPoseAreApart) {
  struct Start {
    double u, v, area;
  };
  for (const Start& start :
       {Start{0.1, 0.1, 0.2 * 0.15}, Start{-0.1, -0.05, 0.3 * 0.1}, Start{0.1, -0.05, 0.2 * 0.1},
        Start{-0.15, 0.075, 0.3 * 0.15}, Start{1e-3, 1e-3, 0.2 * 0.15}}) {
    const Mechanism mechanism = CrossingGantry({1, 0, 0}, {0.6, 0.8, 0}, start.u, start.v);
    for (const int resolution : {23, 60}) {
      SCOPED_TRACE(fmt::format("{} {} {}", start.u, start.v, resolution));
      const Answer answer = Ask(mechanism, Over({"x", "y"}, resolution));
      ExpectMeasure(answer, 0.8 * start.area, 1e-10);
    }
    SetArguments across = Over({"x", "y"}, 23);
    across.cross_singularities = true;
    ExpectMeasure(Ask(mechanism, across), 0.8 * 0.5 * 0.25, 1e-10);
  }
  // A path through the very pose.
  const double half = std::sqrt(0.5);
  const Answer path =
      Ask(CrossingGantry({half, half, 0}, {half, -half, 0}, 0.08, 0.08), Over({"x"}, 60));
  ASSERT_EQ(path.set.traced.ends.size(), 2u) << path.diagnostics.Text();
  EXPECT_TRUE(path.set.agree) << path.set.verdict;
  EXPECT_NEAR(path.set.traced.ends[0].first, 0.0, 1e-8);
  EXPECT_NEAR(path.set.traced.ends[1].first, 0.3 * half, 1e-10);
}

// The line where branches cross leans: sections' parts touch elsewhere at each height.
TEST(ReachableSet, AVolumeWhosePartsTouchAlongALineIsThatByHand) {
  const Mechanism mechanism = FromText(R"(
name: leaning
bodies:
  bridge: {mass: 1, inertia: [1, 1, 1], frames: {foot: [0, -0.15, 0.2]}}
  lift: {mass: 1, inertia: [1, 1, 1]}
  tool: {mass: 1, inertia: [1, 1, 1]}
world: {frames: {floor: [0, 0, -0.2]}}
joints:
  u: {kind: prismatic, parent: world, child: bridge, axis: x, guess: 0.05, range: [-0.3, 0.2]}
  w: {kind: prismatic, parent: bridge, child: lift, axis: z, guess: 0.02, range: [-0.1, 0.1]}
  v: {kind: prismatic, parent: lift, child: tool, axis: [0, 0.8, 0.6], guess: 0.1, range: [-0.15, 0.15]}
drives:
  one: {kind: distance, from: world.floor, to: bridge}
  lift: {kind: joint, joint: w}
  two: {kind: distance, from: bridge.foot, to: tool}
outputs: {tool: tool}
)");
  // u > 0 and v + 0.6 w > 0: half of the ranges of v and w, each by 0.8.
  const Answer answer = Ask(mechanism, Over({"x", "y", "z"}, 24));
  ExpectMeasure(answer, 0.2 * 0.8 * 0.5 * 0.3 * 0.2, 1e-9);
}

// A flood that takes one stroke to be longer disagrees with the boundary.
TEST(ReachableSet, AFloodWithAWrongBoundDisagrees) {
  const Mechanism tripod = ShippedModel("spr_tripod");
  SetArguments arguments = Over({"x", "y"}, 120);
  arguments.at = {"z=0.6"};
  Answer answer = Ask(tripod, arguments);
  ASSERT_TRUE(answer.set.agree) << answer.set.verdict;
  SetArguments wrong = arguments;
  wrong.ranges = {"leg1=0.5:0.752"};
  const Answer other = Ask(tripod, wrong);
  answer.set.flooded = other.set.flooded;
  JudgeSet(&answer.set);
  EXPECT_FALSE(answer.set.agree) << answer.set.verdict;
}

// When the boundary is lost, the lattice has no use.
TEST(ReachableSet, AFloodInVainEndsWithoutAnAnswer) {
  Diagnostics diagnostics;
  const auto question =
      ReadQuestion(ShippedModel("spr_tripod"), Over({"x", "y", "z"}), &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  PoseSpace space(question->mechanism, question->settings);
  PlacedPose home;
  ASSERT_TRUE(space.Home(&home));
  space.CountFrom(&home);
  std::atomic<bool> in_vain = false;
  const FloodSettings settings{.resolution = 12, .in_vain = &in_vain};
  const FloodPlan plan = PlanFlood(space, home, settings);
  const FloodedSet whole = FloodSet(space, home, settings, plan);
  EXPECT_TRUE(whole.summary.ok()) << whole.summary.message;
  in_vain = true;
  const FloodedSet none = FloodSet(space, home, settings, plan);
  EXPECT_FALSE(none.summary.ok());
  EXPECT_LT(none.closings, whole.closings);
}

TEST(ReachableSet, ItsNumbersDoNotDependOnTheNumberOfThreads) {
  const Mechanism five_bar = ShippedModel("friction_five_bar");
  SetArguments arguments = Over({"x", "y"}, 40);
  const Answer one = Ask(five_bar, arguments);
  arguments.flood.threads = 3;
  const Answer many = Ask(five_bar, arguments);
  EXPECT_EQ(one.set.traced.measure, many.set.traced.measure);
  EXPECT_EQ(one.set.flooded.measure, many.set.flooded.measure);
  EXPECT_EQ(one.set.flooded.closings, many.set.flooded.closings);
}

// Coarse, over all coordinates that are free without options; drives without ranges get some.
TEST(ReachableSet, EveryShippedModelHasOne) {
  size_t models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const Mechanism model = ShippedModel(entry.path().filename().string());
    if (model.outputs.empty()) continue;
    ++models;
    SetArguments arguments = Over({}, 24);
    for (const Drive& drive : model.drives) {
      if (std::isfinite(drive.range.lower) || std::isfinite(drive.range.upper)) continue;
      const double home = HomeValue(
          model, {Coordinate::Kind::kDrive, static_cast<int>(&drive - model.drives.data()), 0});
      const bool slides = PositionUnit(model, drive) == "m";
      arguments.ranges.push_back(fmt::format("{}={:.17g}:{:.17g}", drive.name,
                                             slides ? 0.8 * home - 0.05 : home - 0.6,
                                             slides ? 1.2 * home + 0.05 : home + 0.6));
    }
    Diagnostics diagnostics;
    auto question = ReadQuestion(model, arguments, &diagnostics);
    ASSERT_TRUE(question.has_value()) << model.name << ": " << diagnostics.Text();
    if (question->settings.over == 3) {
      arguments.over = {"x", "y"};
      question = ReadQuestion(model, arguments, &diagnostics);
      ASSERT_TRUE(question.has_value()) << model.name << ": " << diagnostics.Text();
    }
    ReachableSet set = ComputeReachableSet(*question, arguments);
    if (set.summary.stop == Stop::kUnreachable) {  // nothing bounds it: a box does
      arguments.over.clear();
      for (int k = 0; k < question->settings.over; ++k) {
        const std::string& name = question->settings.coordinates[static_cast<size_t>(k)].name;
        arguments.over.push_back(fmt::format("{}={:.17g}:{:.17g}", name, question->start[k] - 0.1,
                                             question->start[k] + 0.1));
      }
      question = ReadQuestion(model, arguments, &diagnostics);
      ASSERT_TRUE(question.has_value()) << model.name << ": " << diagnostics.Text();
      set = ComputeReachableSet(*question, arguments);
    }
    EXPECT_FALSE(set.diagnostics.has_errors()) << model.name << ": " << set.diagnostics.Text();
    EXPECT_TRUE(set.agree) << model.name << ": " << set.verdict;
    EXPECT_GT(set.traced.measure, 0.0) << model.name;
  }
  EXPECT_GT(models, 15u);
}

std::string Refusal(const Mechanism& mechanism, const SetArguments& arguments) {
  const Answer answer = Ask(mechanism, arguments);
  return answer.diagnostics.Text() + (answer.set.summary.ok() ? "" : answer.set.verdict);
}

TEST(ReachableSet, WhatCannotBeAnsweredIsRefusedWithAReason) {
  const Mechanism tripod = ShippedModel("spr_tripod");
  SetArguments arguments = Over({"x", "yy"});
  arguments.at = {"z_deg=4", "z"};
  arguments.cones = {"leg9=1"};
  EXPECT_THAT(Refusal(tripod, arguments),
              AllOf(HasSubstr("there is no coordinate 'yy'"), HasSubstr("the coordinate is in m"),
                    HasSubstr("a value is needed"), HasSubstr("there is no joint 'leg9'")));
  EXPECT_THAT(Refusal(tripod, Over({"x", "y", "z", "roll"})), HasSubstr("one to three"));
  EXPECT_THAT(Refusal(tripod, Over({"x", "y", "yaw"})), HasSubstr("'platform.yaw'"));
  EXPECT_THAT(Refusal(tripod, Over({"x=2:3", "y"})),
              HasSubstr("the pose to begin with is beyond leg1 at 0.75 m by 2.0"));
  EXPECT_THAT(Refusal(ShippedModel("friction_five_bar"), Over({"x=2:3", "y"})),
              HasSubstr("cannot be reached from home: tool.x = 2.5"));
  EXPECT_THAT(Refusal(tripod, Over({"x=3:2", "y"})), HasSubstr("LOW is not below HIGH"));
  EXPECT_THAT(Refusal(tripod, Over({"x", "y", "z"}, 4000)), HasSubstr("takes about"));
  arguments = Over({"x", "y"});
  arguments.at = {"z=0.7088"};
  arguments.from = {"x=0.1"};
  EXPECT_THAT(Refusal(tripod, arguments), HasSubstr("beyond leg"));
  Mechanism none = tripod;
  none.outputs.clear();
  EXPECT_THAT(Refusal(none, Over({})), HasSubstr("no output"));
  EXPECT_THAT(Refusal(FromText(R"(
name: slide
bodies: {cart: {mass: 1, inertia: [1, 1, 1]}}
joints: {rail: {kind: prismatic, parent: world, child: cart, axis: x}}
drives: {rail: {kind: joint, joint: rail}}
outputs: {cart: cart}
)"),
                      Over({"x"})),
              HasSubstr("has no end"));
}

// Of an arm all is known: K = J, M, gravity.
TEST(Quality, AnArmsIndicesAreThoseByHand) {
  const Mechanism arm = FromText(Arm(R"(
motors:
  shoulder: {continuous: 40, max_speed: 3}
  elbow: {continuous: 10, max_speed: 5}
)"));
  Mechanism heavy = arm;
  heavy.gravity_W = Vec3(0, -9.81, 0);
  SetArguments arguments = Over({"x", "y"}, 60);
  const Answer answer = Ask(heavy, arguments);
  ASSERT_TRUE(answer.set.agree) << answer.set.verdict;
  const QualityMap map = MapQuality(*answer.question, answer.set, "tip", 1);
  ASSERT_EQ(map.why_none, "");
  ASSERT_GT(map.points.size(), 100u);
  const auto index = [&](const std::string& name) {
    for (size_t i = 0; i < map.indices.size(); ++i) {
      if (map.indices[i].name == name) return static_cast<Eigen::Index>(i);
    }
    ADD_FAILURE() << name;
    return Eigen::Index{0};
  };
  const double a = 0.5, b = 0.2;
  for (size_t k = 0; k < map.points.size(); k += 7) {
    const Vec3& p = answer.set.flooded.lattice[map.points[k]].at;
    const double c2 = (p.squaredNorm() - a * a - b * b) / (2 * a * b), s2 = std::sqrt(1 - c2 * c2);
    const double q1 = std::atan2(p[1], p[0]) - std::atan2(b * s2, a + b * c2);
    Eigen::Matrix2d J;
    J << -p[1], -b * std::sin(q1 + std::acos(c2)), p[0], b * std::cos(q1 + std::acos(c2));
    const auto expect = [&](const std::string& name, double value) {
      EXPECT_NEAR(map.values[k][index(name)], value, 1e-8 * (1 + std::abs(value))) << name;
    };
    // V² = q̇ᵀ G q̇: the upper link by its middle, the other by the elbow, and both turns by L.
    const double L2 = answer.set.length * answer.set.length;
    Eigen::Matrix2d G;
    G << a * a / 4 + a * a + 2 * L2, L2, L2, L2;
    const auto least = [](const Eigen::Matrix2d& S) {
      const double half = 0.5 * S.trace();
      return std::sqrt(half - std::sqrt(half * half - S.determinant()));
    };
    const Eigen::Matrix2d per_speed = (0.5 * G).inverse();
    expect("type1_distance", least(per_speed * J.transpose() * J));
    expect("type2_distance", answer.set.length * least(per_speed));
    const Eigen::Matrix2d V = J * Eigen::Vector2d(3, 5).asDiagonal();
    expect("speed_most", std::max((V.col(0) + V.col(1)).norm(), (V.col(0) - V.col(1)).norm()));
    const double det = std::abs(V.determinant());
    expect("speed_least", det / std::max(V.col(0).norm(), V.col(1).norm()));
    const Eigen::Matrix2d F = (J.transpose().inverse()) * Eigen::Vector2d(40, 10).asDiagonal();
    expect("force_most", std::max((F.col(0) + F.col(1)).norm(), (F.col(0) - F.col(1)).norm()));
    expect("force_least", std::abs(F.determinant()) / std::max(F.col(0).norm(), F.col(1).norm()));
    // Masses in the links' ends.
    expect("mass_elbow", 0.02 + 3 * b * b);
    expect("mass_shoulder", 0.01 + 2 * a * a + 0.02 + 3 * p.head<2>().squaredNorm());
    const double held2 = 3 * 9.81 * b * std::cos(q1 + std::acos(c2));
    const double held1 = 2 * 9.81 * a * std::cos(q1) + 3 * 9.81 * p[0];
    const double g1 = 9.81 * p[0], g2 = 9.81 * b * std::cos(q1 + std::acos(c2));
    double payload = std::min(((g1 > 0 ? 40 - held1 : 40 + held1) / std::abs(g1)),
                              ((g2 > 0 ? 10 - held2 : 10 + held2) / std::abs(g2)));
    if (std::abs(held1) > 40 || std::abs(held2) > 10) payload = 0.0;
    expect("payload", payload);
    // Perturbed by a thousandth, it would show.
    EXPECT_GT(std::abs(1.001 * map.values[k][index("mass_elbow")] - (0.02 + 3 * b * b)), 1e-5);
  }
}

// det(K − ω² M) = 0 with servos of 900 and 400 N m/rad, without weight.
TEST(Quality, AnArmsLowestFrequencyIsThatByHand) {
  Mechanism arm = FromText(Arm());
  arm.drives[0].stiffness = 900;
  arm.drives[1].stiffness = 400;
  const Answer answer = Ask(arm, Over({"x", "y"}, 40));
  ASSERT_TRUE(answer.set.agree) << answer.set.verdict;
  const QualityMap map = MapQuality(*answer.question, answer.set, "tip", 1);
  const auto at = std::ranges::find(map.indices, "frequency", &QualityIndex::name);
  ASSERT_NE(at, map.indices.end());
  for (size_t k = 0; k < map.points.size(); k += 11) {
    const double r2 = answer.set.flooded.lattice[map.points[k]].at.squaredNorm();
    const double c2 = (r2 - 0.25 - 0.04) / 0.2;
    Eigen::Matrix2d M;
    M << 0.01 + 0.5 + 0.02 + 3 * r2, 0.02 + 3 * (0.04 + 0.1 * c2), 0.02 + 3 * (0.04 + 0.1 * c2),
        0.02 + 3 * 0.04;
    const Eigen::Matrix2d A = M.inverse() * Eigen::Vector2d(900, 400).asDiagonal();
    const double half = 0.5 * A.trace();
    const double lowest = half - std::sqrt(half * half - A.determinant());
    EXPECT_NEAR(map.values[k][at - map.indices.begin()], std::sqrt(lowest) / (2 * pi), 1e-6);
  }
}

// W K⁻¹ Wᵀ of the same arm.
TEST(Quality, AnArmsStiffnessIsThatByHand) {
  Mechanism arm = FromText(Arm());
  arm.drives[0].stiffness = 900;
  arm.drives[1].stiffness = 400;
  const Answer answer = Ask(arm, Over({"x", "y"}, 40));
  const QualityMap map = MapQuality(*answer.question, answer.set, "tip", 1);
  const auto at = std::ranges::find(map.indices, "stiffness_least", &QualityIndex::name);
  ASSERT_NE(at, map.indices.end());
  for (size_t k = 0; k < map.points.size(); k += 11) {
    const Vec3& p = answer.set.flooded.lattice[map.points[k]].at;
    const double c2 = (p.squaredNorm() - 0.29) / 0.2;
    const double q1 =
        std::atan2(p[1], p[0]) - std::atan2(0.2 * std::sqrt(1 - c2 * c2), 0.5 + 0.2 * c2);
    Eigen::Matrix2d J;
    J << -p[1], -0.2 * std::sin(q1 + std::acos(c2)), p[0], 0.2 * std::cos(q1 + std::acos(c2));
    const Eigen::Matrix2d C =
        J * Eigen::Vector2d(1.0 / 900, 1.0 / 400).asDiagonal() * J.transpose();
    const double half = 0.5 * C.trace();
    const double soft = half + std::sqrt(half * half - C.determinant());
    EXPECT_NEAR(map.values[k][at - map.indices.begin()] * soft, 1.0, 1e-6);
    EXPECT_NEAR(map.values[k][1 + at - map.indices.begin()] * (C.determinant() / soft), 1.0, 1e-5);
  }
}

// Between coupler and rocker, by the law of cosines at their joint.
TEST(Quality, AFourBarsTransmissionAngleIsThatByHand) {
  const Mechanism four_bar = ShippedModel("four_bar");
  SetArguments arguments = Over({"A=1:2.2"}, 100);
  arguments.output = "rocker";
  const Answer answer = Ask(four_bar, arguments);
  ASSERT_TRUE(answer.set.agree) << answer.diagnostics.Text() << answer.set.verdict;
  const QualityMap map = MapQuality(*answer.question, answer.set, "rocker", 1);
  EXPECT_TRUE(map.no_limb.empty());
  const auto at = std::ranges::find(map.indices, "transmission_motor", &QualityIndex::name);
  ASSERT_NE(at, map.indices.end());
  for (size_t k = 0; k < map.points.size(); k += 3) {
    const double theta = answer.set.flooded.lattice[map.points[k]].at[0];
    const double x = 0.4 - 0.15 * std::cos(theta), y = 0.15 * std::sin(theta);
    const double c = (0.35 * 0.35 + 0.3 * 0.3 - x * x - y * y) / (2 * 0.35 * 0.3);
    EXPECT_NEAR(map.values[k][at - map.indices.begin()], std::acos(std::abs(c)) * 180 / pi, 1e-9);
  }
  // The coupler itself is no limb's end: crank and rocker both hold it by one joint alone.
  const QualityMap coupler = MapQuality(*answer.question, answer.set, "coupler", 1);
  const auto of_crank =
      std::ranges::find(coupler.indices, "transmission_motor", &QualityIndex::name);
  ASSERT_NE(of_crank, coupler.indices.end());
  // The crank pushes its end across itself, along which that moves.
  EXPECT_NEAR(coupler.values[0][of_crank - coupler.indices.begin()], 90.0, 1e-6);
}

// From the output around the loop and back to it: no limb.
TEST(Quality, ALoopThatFloatsHasNoLimbs) {
  SetArguments arguments = Over({"x=-0.05:0.05"}, 16);
  arguments.output = "coupler";
  const Answer answer = Ask(ShippedModel("floating_loop"), arguments);
  ASSERT_TRUE(answer.set.agree) << answer.diagnostics.Text() << answer.set.verdict;
  const QualityMap map = MapQuality(*answer.question, answer.set, "coupler", 1);
  EXPECT_FALSE(map.why_none.empty() && map.no_limb.empty());
}

// Legs along lines: the angle of each by the point's velocity while it alone moves.
TEST(Quality, LegsTransmissionAnglesAreThoseOfTheirLines) {
  for (const char* name : {"stewart_legs", "spr_tripod"}) {
    const Mechanism robot = ShippedModel(name);
    const Answer answer = Ask(robot, Over({"z"}, 40));
    ASSERT_TRUE(answer.set.agree) << name << answer.diagnostics.Text() << answer.set.verdict;
    const QualityMap map = MapQuality(*answer.question, answer.set, robot.outputs[0].name, 1);
    EXPECT_TRUE(map.no_limb.empty()) << name;
    PoseSpace space = PoseSpace(robot, answer.question->settings)
                          .Section(static_cast<int>(answer.question->settings.coordinates.size()));
    PlacedPose at;
    ASSERT_TRUE(space.Home(&at));
    ASSERT_FALSE(map.points.empty());
    ASSERT_TRUE(space.Place(answer.set.flooded.lattice[map.points[0]].pose, &at));
    const BodyStates states = space.States(at.pose);
    const MatX T = space.Twists(at, states);
    const int body = robot.outputs[0].body;
    for (size_t d = 0; d < robot.drives.size(); ++d) {
      const auto index = std::ranges::find(map.indices, "transmission_" + robot.drives[d].name,
                                           &QualityIndex::name);
      ASSERT_NE(index, map.indices.end()) << name;
      // The stroke's rate is the point's speed along the leg, 1 here: sin μ = 1 / |v|.
      const Joint* ball = nullptr;
      for (const Joint& joint : robot.joints) {
        const bool holds = joint.parent == body || joint.child == body;
        if (holds && joint.name.starts_with(robot.drives[d].name)) ball = &joint;
      }
      if (ball == nullptr) continue;
      const Vec3 p = (ball->parent == body ? ball->X_PF : ball->X_CM).translation();
      MatX D(static_cast<Eigen::Index>(robot.drives.size()), T.cols());
      for (Eigen::Index k = 0; k < D.rows(); ++k) {
        const ScalarRow row =
            CoordinateRow(robot, {Coordinate::Kind::kDrive, static_cast<int>(k), 0}, states);
        D.row(k) = Eigen::RowVectorXd::Zero(T.cols());
        if (row.parent > 0)
          D.row(k) += row.J_parent.transpose() * T.middleRows(6 * (row.parent - 1), 6);
        if (row.child > 0)
          D.row(k) += row.J_child.transpose() * T.middleRows(6 * (row.child - 1), 6);
      }
      const Vec6 V =
          T.middleRows(6 * (body - 1), 6) * D.inverse().col(static_cast<Eigen::Index>(d));
      const Vec3 arm = states.X_WB[static_cast<size_t>(body)].linear() * p;
      const double speed = (V.tail<3>() + Vec3(V.head<3>()).cross(arm)).norm();
      EXPECT_NEAR(map.values[0][index - map.indices.begin()], std::asin(1 / speed) * 180 / pi, 1e-7)
          << name << " " << robot.drives[d].name;
    }
  }
}

// A beam on a servo that turns: 1/k = l³/3EI + l²/k_servo across, l/EA along.
TEST(Quality, AnElasticArmsStiffnessIsThatOfBeamAndServo) {
  const Mechanism arm = FromText(R"(
name: elastic
gravity: [0, 0, 0]
sections:
  s: {general: {area: 3.141592653589793e-4, I_y: 7.853981633974483e-9, I_z: 7.853981633974483e-9, torsion: 1.6e-8}}
materials:
  m: {youngs_modulus: 2.0e11, shear_modulus: 8.0e10}
bodies:
  arm: {mass: 1, com: [0.2, 0, 0], inertia: [0.01, 0.01, 0.01], frames: {tip: [0.4, 0, 0]}, beams: {b: {to: tip, section: s, material: m, z: z}}}
joints:
  q: {kind: revolute, parent: world, child: arm, axis: z, range: [-1, 1]}
drives:
  q: {kind: joint, joint: q, stiffness: 5000}
outputs: {tip: arm.tip}
)");
  const Answer answer = Ask(arm, Over({"q"}, 40));
  const QualityMap map = MapQuality(*answer.question, answer.set, "tip", 1);
  const double EI = 2e11 * pi * std::pow(0.02, 4) / 64, EA = 2e11 * pi * 1e-4, l = 0.4;
  const auto value = [&](const char* name) {
    const auto at = std::ranges::find(map.indices, name, &QualityIndex::name);
    return map.values[0][at - map.indices.begin()];
  };
  const double soft = 1 / (l * l * l / (3 * EI) + l * l / 5000);
  EXPECT_NEAR(value("stiffness_least"), soft, 1e-6 * soft);
  EXPECT_NEAR(value("stiffness_most"), EA / l, 1e-6 * EA / l);
  EXPECT_GT(std::abs(5000 / (l * l) - soft), 1e-2 * soft);  // the servo alone would show
}

// A table on two slides, with a strut from its corner as a third drive: all is known by the strut's
// direction u. Rates D = (1, 0), (0, 1), u; the table's twist is the slides'.
TEST(Quality, RedundantDrivesIndicesAreThoseByHand) {
  Mechanism table = FromText(R"(
name: table
gravity: [0, -9.81, 0]
bodies:
  bridge: {mass: 3, inertia: [0.01, 0.01, 0.01]}
  table: {mass: 2, inertia: [0.01, 0.01, 0.01]}
world: {frames: {corner: [-0.5, -0.4, 0]}}
joints:
  x: {kind: prismatic, parent: world, child: bridge, axis: x, range: [-0.2, 0.2]}
  y: {kind: prismatic, parent: bridge, child: table, axis: y, range: [-0.2, 0.2]}
drives:
  x: {kind: joint, joint: x}
  y: {kind: joint, joint: y}
  strut: {kind: distance, from: world.corner, to: table}
motors:
  x: {continuous: 40, max_speed: 3}
  y: {continuous: 30, max_speed: 2}
  strut: {continuous: 25, max_speed: 1.5}
outputs: {table: table}
)");
  const std::array<double, 3> servo = {9000, 4000, 6000};
  for (size_t d = 0; d < 3; ++d) table.drives[d].stiffness = servo.at(d);
  const Answer answer = Ask(table, Over({"x", "y"}, 40));
  ASSERT_TRUE(answer.set.agree) << answer.diagnostics.Text() << answer.set.verdict;
  EXPECT_NEAR(answer.set.traced.measure, 0.16, 1e-9);
  const QualityMap map = MapQuality(*answer.question, answer.set, "table", 1);
  ASSERT_EQ(map.why_none, "");
  ASSERT_GT(map.points.size(), 50u);
  const Eigen::Vector3d force(40, 30, 25), speed(3, 2, 1.5);
  for (size_t k = 0; k < map.points.size(); k += 5) {
    const Vec3& p = answer.set.flooded.lattice[map.points[k]].at;
    const Eigen::Vector2d arm(p[0] + 0.5, p[1] + 0.4), u = arm.normalized();
    Eigen::Matrix<double, 3, 2> D;
    D << 1, 0, 0, 1, u[0], u[1];
    const auto value = [&](const std::string& name) {
      const auto at = std::ranges::find(map.indices, name, &QualityIndex::name);
      EXPECT_NE(at, map.indices.end()) << name;
      return map.values[k][at - map.indices.begin()];
    };
    // DᵀD = 1 + u uᵀ: its eigenvalues are 2 and 1.
    EXPECT_NEAR(value("condition"), std::sqrt(2.0), 1e-9);
    EXPECT_NEAR(value("manipulability"), 1 / std::sqrt(2.0), 1e-9);
    // V² = x² + ½ y².
    const Eigen::Matrix2d rates =
        Eigen::Vector2d(1, 2).asDiagonal() * (Eigen::Matrix2d::Identity() + u * u.transpose());
    const double half = 0.5 * rates.trace();
    EXPECT_NEAR(value("type2_distance"),
                std::sqrt(half - std::sqrt(half * half - rates.determinant())), 1e-9);
    EXPECT_NEAR(value("type1_distance"), 1.0, 1e-9);
    // 1 / (D M⁻¹ Dᵀ): bridge and table along x, the table alone along y.
    EXPECT_NEAR(value("mass_x"), 5.0, 1e-9);
    EXPECT_NEAR(value("mass_y"), 2.0, 1e-9);
    EXPECT_NEAR(value("mass_strut"), 1 / (u[0] * u[0] / 5 + u[1] * u[1] / 2), 1e-9);
    // All directions by brute force: what the drives allow, and what they hold.
    double slow = 1e9, fast = 0.0, weak = 1e9, strong = 0.0;
    constexpr int n = 3600;
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d d(std::cos(2 * pi * i / n), std::sin(2 * pi * i / n));
      const double v = (speed.array() / (D * d).array().abs()).minCoeff();
      slow = std::min(slow, v);
      fast = std::max(fast, v);
      // f d = τ_1 e_1 + τ_2 e_2 + τ_3 u: the most of f over τ_3 by halving its slope.
      const auto most = [&](double strut) {
        double f = 1e9, low = -1e9;
        for (int c = 0; c < 2; ++c) {
          if (std::abs(d[c]) < 1e-12) continue;
          const double a = (strut * u[c] - force[c]) / d[c], b = (strut * u[c] + force[c]) / d[c];
          f = std::min(f, std::max(a, b));
          low = std::max(low, std::min(a, b));
        }
        return f >= low ? f : -1.0;
      };
      double f = 0.0;
      for (int s = 0; s <= 200; ++s) f = std::max(f, most(25.0 * (s / 100.0 - 1.0)));
      weak = std::min(weak, f);
      strong = std::max(strong, f);
    }
    EXPECT_NEAR(value("speed_least"), slow, 1e-5);
    EXPECT_NEAR(value("speed_most"), fast, 5e-3);
    EXPECT_NEAR(value("force_least"), weak, 5e-3 * weak);
    EXPECT_NEAR(value("force_most"), strong, 5e-3 * strong);
    // Payload: (0, 9.81 (2 + m)) = (τ_1, τ_2) + τ_3 u; the strut's sign is that of lifting.
    double payload = 0.0;
    for (int s = 0; s <= 2000; ++s) {
      const double strut = 25.0 * s / 2000;
      if (strut * u[0] > 40) continue;
      payload = std::max(payload, (30 + strut * u[1]) / 9.81 - 2);
    }
    EXPECT_NEAR(value("payload"), payload, 1e-3);
    // Servos, and what the held strut (least norm) adds across u.
    const Eigen::Vector2d weight(0, 9.81 * 2);
    const double strut = (D * (D.transpose() * D).inverse() * weight)[2];
    Eigen::Matrix2d K = Eigen::Vector2d(9000, 4000).asDiagonal();
    K += 6000 * u * u.transpose() -
         strut / arm.norm() * (Eigen::Matrix2d::Identity() - u * u.transpose());
    const Eigen::Vector2d root = Eigen::Vector2d(5, 2).cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> modes(
        Eigen::Matrix2d(root.asDiagonal() * K * root.asDiagonal())),
        stiff(K);
    EXPECT_NEAR(value("frequency"), std::sqrt(modes.eigenvalues()[0]) / (2 * pi), 1e-6);
    EXPECT_NEAR(value("stiffness_least"), stiff.eigenvalues()[0], 1e-2);
    EXPECT_NEAR(value("stiffness_most"), stiff.eigenvalues()[1], 1e-2);
    // A servo of 1 % more would show.
    EXPECT_GT(std::abs(1.01 * value("stiffness_least") - stiff.eigenvalues()[0]), 1.0);
  }
}

}  // namespace
}  // namespace mbv