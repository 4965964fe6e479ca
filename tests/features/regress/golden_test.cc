// Golden traces: kept exactly enough, and distinguished by witness.
#include "features/regress/golden.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

constexpr const char* kCsv =
    "time_s,leg1.position.analytic,leg1.force.analytic,leg1.force.simulated,leg2.force.analytic,"
    "leg2.force.simulated,power.input.simulated\n"
    "0,1,10,11,20,21,99\n"
    "0.01,1,12,13,nan,23,99\n";

ForceTrace Sine(double factor) {
  ForceTrace trace{{"leg1", "leg2"}, MatX(500, 2)};
  for (int i = 0; i < 500; ++i) {
    trace.force(i, 0) = factor * 1000.0 * std::sin(0.01 * i);
    trace.force(i, 1) = 700.0 * std::cos(0.02 * i);
  }
  return trace;
}

GoldenTraces Witnesses(double analytic, double simulated, double reference) {
  return {
      {"analytic", Sine(analytic)}, {"simulated", Sine(simulated)}, {"reference", Sine(reference)}};
}

TEST(Golden, ReadsTheForceColumnsOfEachWitness) {
  const GoldenTraces traces = ReadForces(kCsv);
  ASSERT_EQ(traces.size(), 2U);
  const ForceTrace& analytic = traces.at("analytic");
  EXPECT_EQ(analytic.drives, (std::vector<std::string>{"leg1", "leg2"}));
  ASSERT_EQ(analytic.force.rows(), 2);
  EXPECT_EQ(analytic.force(1, 0), 12.0);
  EXPECT_TRUE(std::isnan(analytic.force(1, 1)));
  EXPECT_EQ(traces.at("simulated").force(1, 1), 23.0);
}

TEST(Golden, ThinsLongTracesEvenly) {
  std::string csv = "time_s,leg.force.analytic\n";
  for (int i = 0; i < 1000; ++i) csv += std::to_string(i) + "," + std::to_string(i) + "\n";
  const ForceTrace trace = ReadForces(csv, 300).at("analytic");
  ASSERT_EQ(trace.force.rows(), 250);
  EXPECT_EQ(trace.force(1, 0), 4.0);
  EXPECT_EQ(trace.force(249, 0), 996.0);
}

TEST(Golden, CsvWithoutForcesGivesNothing) {
  EXPECT_TRUE(ReadForces("time_s,a\n0,1\n").empty());
  EXPECT_TRUE(ReadForces("").empty());
}

// 36 kept bits of the mantissa: half of the last kept one is 2^-37 = 7.3e-12 of the value.
TEST(Golden, ComesBackToElevenDigitsAndMuchSmaller) {
  const ForceTrace trace = Sine(1.0);
  const std::string bytes = Encode(trace);
  const auto back = DecodeForces(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->drives, trace.drives);
  const double worst = ((back->force - trace.force).array() / trace.force.array().abs().max(1e-300))
                           .abs()
                           .maxCoeff();
  EXPECT_LE(worst, std::ldexp(1.0, -37));
  EXPECT_LT(bytes.size(), 8U * 1000U * 3U / 4U);
}

TEST(Golden, RoundoffMovesNothing) {
  const auto kept = DecodeForces(Encode(Sine(1.0)));
  EXPECT_FALSE(Compare(*kept, Sine(1.0 + 1e-13)).moved());
}

TEST(Golden, DamagedBytesAreRefused) {
  std::string bytes = Encode(Sine(1.0));
  EXPECT_FALSE(DecodeForces("something else"));
  EXPECT_FALSE(DecodeForces(bytes.substr(0, bytes.size() / 2)));
  bytes[bytes.size() - 3] = static_cast<char>(bytes[bytes.size() - 3] ^ 0x55);
  EXPECT_FALSE(DecodeForces(bytes));
}

TEST(Golden, MovementIsTheRelativeRmsChangeAndNamesTheDrive) {
  const Movement movement = Compare(Sine(1.0), Sine(1.01));
  double before2 = 0.0, change2 = 0.0;
  const MatX f = Sine(1.0).force;
  before2 = f.squaredNorm();
  change2 = (0.01 * f.col(0)).squaredNorm();
  // Both traces are kept to 36 bits: 2^-37 relative to the forces, 1e-2 of which moved.
  EXPECT_NEAR(movement.relative, std::sqrt(change2 / before2), 1e-9);
  EXPECT_EQ(movement.worst, "leg1");
}

TEST(Golden, OtherDrivesOrSamplesHaveMoved) {
  ForceTrace other = Sine(1.0);
  other.drives[1] = "leg3";
  EXPECT_TRUE(Compare(Sine(1.0), other).moved());
  EXPECT_TRUE(Compare(Sine(1.0), ForceTrace{{"leg1", "leg2"}, MatX::Zero(400, 2)}).moved());
}

TEST(Golden, SaysWhichWitnessMoved) {
  const GoldenTraces before = Witnesses(1, 1, 1);
  EXPECT_EQ(AttributeMovement(before, Witnesses(1, 1, 1)), "");
  EXPECT_TRUE(AttributeMovement(before, Witnesses(1.001, 1, 1)).starts_with("analytic moved ("));
  EXPECT_TRUE(AttributeMovement(before, Witnesses(1, 1.001, 1)).starts_with("simulation moved ("));
  EXPECT_TRUE(AttributeMovement(before, Witnesses(1, 1, 1.001)).starts_with("reference moved ("));
  EXPECT_TRUE(AttributeMovement(before, Witnesses(1.001, 1.001, 1)).starts_with("both moved ("));
  EXPECT_TRUE(
      AttributeMovement(before, Witnesses(1.001, 1.001, 1.001)).starts_with("both moved ("));
}

TEST(Golden, AWitnessThatOneSideLacksIsLeftOut) {
  GoldenTraces before = Witnesses(1, 1, 1);
  before.erase("simulated");
  EXPECT_EQ(AttributeMovement(before, Witnesses(1, 2, 1)), "");
}

}  // namespace
}  // namespace mbv
