// Who follows whom, and what is therefore no evidence.
#include "comparison/driven.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/comparison/synthetic.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using synthetic::Case;
using synthetic::Perturb;

bool Follows(const Comparison& comparison, const std::string& check) {
  const CheckResult* found = comparison.FindCheck(check);
  EXPECT_NE(found, nullptr) << check;
  return found != nullptr && found->follows;
}

TEST(DriveMotion, InTaskSpaceOnlyTheSimulationFollows) {
  Case c;
  c.CommandPlate();
  const Comparison comparison = c.Run();
  for (const char* metric : {".position_m", ".velocity_nrmse", ".acceleration_nrmse"}) {
    EXPECT_TRUE(Follows(comparison, std::string("simulated_vs_analytic") + metric));
    EXPECT_TRUE(Follows(comparison, std::string("simulated_vs_reference") + metric));
    EXPECT_FALSE(Follows(comparison, std::string("reference_vs_analytic") + metric));
  }
  for (const char* check :
       {"simulated.command_m", "simulated.command_rad", "simulated.command_velocity",
        "simulated.command_acceleration", "analytic.derivatives",
        "simulated_vs_analytic.force_nrmse", "simulated_vs_analytic.pose_m"}) {
    EXPECT_FALSE(Follows(comparison, check)) << check;
  }
  EXPECT_EQ(comparison.followed(), 6u);
  EXPECT_EQ(comparison.verified() + comparison.followed(), comparison.checks.size());
  EXPECT_NE(comparison.reason.find("6 of them compare a drive motion with itself"),
            std::string::npos)
      << comparison.reason;
}

TEST(DriveMotion, CommandedDrivesAreTheSameInEveryWitness) {
  const Comparison comparison = Case().Run();
  for (const char* check : {"reference_vs_analytic.position_m", "analytic.command_m",
                            "simulated.command_m", "reference.derivatives"}) {
    EXPECT_TRUE(Follows(comparison, check)) << check;
  }
  EXPECT_EQ(comparison.FindCheck("simulated.command_velocity"), nullptr);
}

TEST(DriveMotion, CouplingsOfDrivesCountAsCommandedOnlyTogetherWithOneOfThem) {
  Case c;
  const auto drive = [](int k) { return Coordinate{Coordinate::Kind::kDrive, k, 0}; };
  c.motion.commands = {{"d1 - d2", {{drive(0), 1.0}, {drive(1), -1.0}}, Constant(0.0)}};
  EXPECT_FALSE(Follows(c.Run(), "reference_vs_analytic.position_m"));
  c.motion.commands.push_back({"d2", {{drive(1), 1.0}}, Constant(0.0)});
  EXPECT_TRUE(Follows(c.Run(), "reference_vs_analytic.position_m"));
}

TEST(DriveMotion, AFollowedMotionThatDiffersStillFails) {
  Case c;
  Perturb(&c.simulated, "d1.position", 2e-10);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_GT(comparison.failed(), 0u);
}

// Rates of the output: exact ones pass, those perturbed by twice the limit fail, whoever follows
// whom.
TEST(DriveMotion, OutputRatesAreHeldAgainstTheCommand) {
  struct Perturbed {
    const char *channel, *check;
    double twice_the_limit;
  };
  // Inverse limits 1e-9 and 1e-8. Velocity: RMS 0.3 m/s and 0.5 rad/s. Acceleration: none is
  // commanded, so 0.1 % of the fastest drive's RMS counts, 0.5 (2π)²/√2 m/s², angles at the
  // characteristic length.
  Case c;
  c.CommandPlate();
  const double w = 2.0 * std::numbers::pi;
  for (const Perturbed& perturbed :
       {Perturbed{"plate.x.velocity", "simulated.command_velocity", 2e-9 * 0.3},
        Perturbed{"plate.yaw.velocity", "simulated.command_velocity", 2e-9 * 0.5},
        Perturbed{"plate.x.acceleration", "simulated.command_acceleration",
                  2e-8 * 1e-3 * 0.5 * w * w / std::numbers::sqrt2}}) {
    Case exact = c;
    EXPECT_EQ(exact.Run().verdict, Verdict::kAgree) << exact.Run().reason;
    Case wrong = c;
    Perturb(&wrong.simulated, perturbed.channel, perturbed.twice_the_limit);
    const Comparison comparison = wrong.Run();
    const CheckResult* check = comparison.FindCheck(perturbed.check);
    ASSERT_NE(check, nullptr) << perturbed.check;
    EXPECT_FALSE(check->pass) << perturbed.channel << " " << check->value;
    EXPECT_NEAR(check->value, 2.0 * *check->limit, 0.05 * *check->limit) << perturbed.channel;
    EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
    Case slight = c;
    Perturb(&slight.simulated, perturbed.channel, 0.25 * perturbed.twice_the_limit);
    EXPECT_EQ(slight.Run().verdict, Verdict::kAgree) << perturbed.channel;
  }
}

TEST(DriveMotion, RatesThatAreNoNumbersNeverPass) {
  Case c;
  c.CommandPlate();
  c.simulated.values(7, c.simulated.Find("plate.x.acceleration")) = kNan;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

TEST(DriveMotion, TheVerdictSaysWhoseMotionIsFollowed) {
  Case c;
  EXPECT_EQ(c.Run().driving,
            "commanded in joint space, every computation is given the same drive motion");
  c.CommandPlate();
  EXPECT_EQ(c.Run().driving,
            "commanded in task space, the simulation follows the drive positions, rates and "
            "accelerations that the closed form computes");
  ComparisonInput input = c.Input();
  input.driven_by = "reference";
  EXPECT_TRUE(Compare(input).driving.ends_with("that the reference computes"));
  input.witnesses.pop_back();
  EXPECT_EQ(Compare(input).driving, "");
}

// README and documents deny nothing: the same sentence stands in each.
TEST(DriveMotion, TheDocumentsSayTheSame) {
  const std::string sentence =
      "ommanded in task space or by passive joints, the simulation follows the drive positions, "
      "rates and accelerations that the closed form (else the reference) computes";
  for (const char* file :
       {"README.md", "docs/development/architecture.md", "docs/explanation/simulation.md"}) {
    std::ifstream stream(SourcePath(std::string("/") + file));
    std::string text;  // in one line, whatever its wrapping
    for (std::string word; stream >> word;) text += (text.empty() ? "" : " ") + word;
    EXPECT_NE(text.find(sentence), std::string::npos) << file;
  }
}

}  // namespace
}  // namespace mbv
