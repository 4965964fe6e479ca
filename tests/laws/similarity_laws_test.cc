// Neither the place of a mechanism, nor the direction of its world's axes, nor its size changes
// what is found out about it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>

#include "base/demand.h"
#include "comparison/comparison.h"
#include "kinematics/mobility.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "reference/forward.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "tests/laws/similar.h"
#include "tests/support/source_dir.h"
#include "verify/drive_by.h"
#include "verify/run_witnesses.h"

namespace mbv::laws {
namespace {

// One motion of every shipped model.
const char* const kScenarios[] = {"andrews_squeezer/benchmark",
                                  "bricard/turn_inverse",
                                  "bricard/fall",
                                  "cabin_robot/wrench",
                                  "floating_loop/tumble",
                                  "floating_loop/steered",
                                  "four_bar/turn_inverse",
                                  "n_four_bar/rock",
                                  "redundant_five_bar/circle_inverse",
                                  "scara_robot/tool_load",
                                  "slider_crank/press",
                                  "spr_tripod/tool_load_inverse",
                                  "spring_cart/swing",
                                  "stewart/wave",
                                  "stewart_friction/dance",
                                  "winch/hoist",
                                  "winch/brake",
                                  "stabilizing_platform/sea_state",
                                  "vehicle_linkage/drive",
                                  "geared_press/inverse",
                                  "friction_five_bar/draw_inverse",
                                  "bushed_linkage/turn_inverse",
                                  "slider_crank/buffer",
                                  "stewart_legs/dance_inverse",
                                  "stewart_balls/dance_inverse",
                                  "journal_crank/press_inverse",
                                  "journal_crank/falls",
                                  "slotted_screw/turn_inverse",
                                  "machine_five_bar/draw_inverse",
                                  "belt_block/stick_slip",
                                  "pendulum/fall",
                                  "stopped_five_bar/falls",
                                  "cam_valve/lifts_off",
                                  "clearance_crank/runs",
                                  "flyball_governor/spin"};

struct Case {
  Scenario scenario;
  Mechanism mechanism;

  explicit Case(const std::string& name) {
    ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/" + name + ".yaml"));
    MBV_DEMAND(loaded.scenario && loaded.mechanism, loaded.diagnostics.Text());
    scenario = *std::move(loaded.scenario);
    mechanism = *std::move(loaded.mechanism);
    // Enough to move; the whole motions are run elsewhere.
    const double steps = scenario.motion.free() ? 10.0 : 30.0;
    Motion& motion = scenario.motion;
    motion.duration_s = std::min(motion.duration_s, steps * motion.sample_s);
    scenario.simulation.mode = motion.free() ? DriveMode::kPrescribedMotion : DriveMode::kInverse;
  }
};

struct ScaledAnswer {
  Comparison comparison;
  Trace reference;
};

// Pose errors come back larger in forces, the more the nearer to a singular pose.
constexpr double kAmplified = 1e3;

// Far away coordinates round at 2e-12 m, which no limit may undercut.
void AddRounding(const Mechanism& m, CheckLimits* limits) {
  const double gap_m = GapRounding(Reach(LongestLever(m), m.X_WB_home));
  for (const MetricRow& row : MetricRows()) {
    const bool length = std::string(row.unit) == "m";
    // Moments of reactions are judged at an arm of a millimetre.
    const double arm_m = row.metric == Metric::kReaction ? 1e-3 : CharacteristicLength(m);
    const double more = length ? gap_m : kAmplified * gap_m / arm_m;
    MetricLimits& of = (*limits)[row.metric];
    for (std::optional<double>* limit : {&of.forward, &of.inverse, &of.reference}) {
      if (*limit) **limit += more;
    }
  }
}

// One side with more gravity and a heavier body.
Mechanism Wrong(Mechanism m) {
  m.gravity_W *= 1.01;
  size_t heaviest = 1;
  for (size_t b = 1; b < m.bodies.size(); ++b) {
    const bool carried =
        std::none_of(m.prescribed.begin(), m.prescribed.end(), [&](const Prescribed& p) {
          return m.joints[static_cast<size_t>(p.joint)].child == static_cast<int>(b);
        });
    if (carried && m.bodies[b].mass > m.bodies[heaviest].mass) heaviest = b;
  }
  m.bodies[heaviest].mass *= 1.05;
  m.bodies[heaviest].I_Bcm_B *= 1.05;
  return m;
}

// Reference and simulation, judged by the scenario's limits; lengths of `scale` times the size.
ScaledAnswer Judge(const Case& c, const Similarity& similarity, bool wrong = false) {
  Scenario scenario = c.scenario;
  const Mechanism m = Similar(c.mechanism, similarity);
  scenario.motion = Similar(c.mechanism, c.scenario.motion, similarity);
  const Motion& motion = scenario.motion;
  for (const MetricRow& row : MetricRows()) {
    if (std::string(row.unit) != "m") continue;
    MetricLimits& limits = scenario.checks[row.metric];
    for (std::optional<double>* limit : {&limits.forward, &limits.inverse, &limits.reference}) {
      if (*limit) **limit *= similarity.scale;
    }
  }
  if (!similarity.X_NW.translation().isZero(0.0)) AddRounding(m, &scenario.checks);
  ScaledAnswer answer;
  ReferenceRun reference;
  if (motion.free()) {
    ForwardRun run = RunForwardReference(m, motion, {.measure_trust = false});
    reference.trace = std::move(run.trace);
    reference.summary = std::move(run.summary);
  } else {
    reference = RunReference(m, motion);
  }
  const DrivenMotion driven =
      motion.free() ? DriveByCommands(m, motion) : DriveByReference(m, motion);
  const SimulatedWitness simulated =
      RunSimulation(scenario, wrong ? Wrong(m) : m, driven, Engine::kCorrected, {});
  const ComparisonInput input{
      .mechanism = &m,
      .motion = &motion,
      .limits = scenario.checks,
      .simulation_limits = motion.free() ? LimitColumn::kForward : LimitColumn::kInverse,
      .witnesses = {{"reference", &reference.trace, reference.summary},
                    {"simulated", &simulated.run.trace, simulated.run.summary}},
      .driven_by = "reference",
      .reactions_not_unique = ReactionsNotUnique(m, simulated.run.X_WB)};
  answer.comparison = Compare(input);
  answer.reference = std::move(reference.trace);
  return answer;
}

std::string Failures(const Comparison& comparison) {
  std::string text = comparison.reason;
  for (const CheckResult& check : comparison.checks) {
    if (check.pass || !check.limit) continue;
    text += "\n  " + check.name + " = " + std::to_string(check.value) + " of " +
            std::to_string(*check.limit) + " at " + check.channel;
  }
  return text;
}

// Largest difference of the drive forces, each relative to its largest, after scaling back.
double ForceChange(const Mechanism& m, const Trace& base, const Trace& other, double scale) {
  double worst = 0.0, size = 0.0;
  for (const Drive& drive : m.drives) {
    const double factor = ForceUnit(m, drive) == "N m" ? scale * scale : scale;
    const int column = base.Find(drive.name + ".force");
    const VecX x = base.values.col(column), y = other.values.col(column) / factor;
    size = std::max(size, x.lpNorm<Eigen::Infinity>());
    worst = std::max(worst, (x - y).lpNorm<Eigen::Infinity>());
  }
  return size > 0.0 ? worst / size : worst;
}

// Where MuJoCo cannot follow: inertias of 1e-12 kg m², a thousandth of this model's, are lost
// beside its own bound of 1e-15; ten kilometres away, a crank of 7 mm has too few digits for six
// revolutions in 10 ms.
bool ReferenceOnly(const std::string& scenario, const Similarity& similarity) {
  return scenario == "andrews_squeezer/benchmark" &&
         (similarity.scale < 1.0 || !similarity.X_NW.translation().isZero(0.0));
}

// Ten kilometres away coordinates round by 2e-12 m, which a contact of 1e6 N/m makes a force of
// 1e-6 N that changes from step to step.
bool IsContact(const std::string& scenario) {
  return scenario.starts_with("cam_valve") || scenario.starts_with("clearance_crank");
}

class Similarities : public ::testing::TestWithParam<const char*> {
 protected:
  // `force`: allowed change of the reference's drive forces.
  void ExpectSame(const Similarity& similarity, double force) const {
    const Case c(GetParam());
    const ScaledAnswer base = Judge(c, {}), other = Judge(c, similarity);
    ASSERT_EQ(base.comparison.verdict, Verdict::kAgree) << Failures(base.comparison);
    EXPECT_TRUE(other.reference.values.allFinite());
    if (ReferenceOnly(GetParam(), similarity)) return;
    EXPECT_EQ(other.comparison.verdict, Verdict::kAgree) << Failures(other.comparison);
    EXPECT_LT(ForceChange(c.mechanism, base.reference, other.reference, similarity.scale), force);
    // And what is wrong stays so.
    EXPECT_EQ(Judge(c, similarity, true).comparison.verdict, Verdict::kDisagree);
  }
};

Similarity Moved(const Vec3& p) {
  Similarity similarity;
  similarity.X_NW.translation() = p;
  return similarity;
}

// Coordinates of 1e4 m have a rounding of 2e-12 m, which poses near singular ones amplify.
constexpr double kFar = 1e-7;
constexpr double kSimilar = 1e-9;

TEST_P(Similarities, TenKilometresAwayTheVerdictIsTheSame) {
  if (IsContact(GetParam())) return;
  ExpectSame(Moved(1e4 * Vec3(0.6, -0.7, 0.4).normalized()), kFar);
}
TEST_P(Similarities, AThousandTimesSmallerTheVerdictIsTheSame) {
  ExpectSame({.scale = 1e-3}, kSimilar);
}
TEST_P(Similarities, AThousandTimesLargerTheVerdictIsTheSame) {
  ExpectSame({.scale = 1e3}, kSimilar);
}
TEST_P(Similarities, InATurnedWorldTheVerdictIsTheSame) {
  Similarity similarity;
  similarity.X_NW.linear() = RotRpy({0.4, -1.1, 2.3});
  ExpectSame(similarity, kSimilar);
}

TEST(SimilarScenarios, AreOfEveryShippedModel) {
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const std::string name = entry.path().filename();
    if (!std::filesystem::exists(entry.path() / "model.yaml")) continue;
    EXPECT_TRUE(
        std::any_of(std::begin(kScenarios), std::end(kScenarios),
                    [&](const std::string& scenario) { return scenario.starts_with(name + "/"); }))
        << name;
  }
}

INSTANTIATE_TEST_SUITE_P(Shipped, Similarities, ::testing::ValuesIn(kScenarios),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '/', '_');
                           return name;
                         });

}  // namespace
}  // namespace mbv::laws
