// Validation against measured forces: sums by hand, and errors that must be seen.
#include "features/study/validation.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

// Two samples: computed 10 and 12, measured 9 and 12.5.
ForceComparison TwoSamples() {
  ForceComparison forces;
  forces.drive = "x";
  forces.unit = "N";
  forces.time_s = {0.0, 1.0};
  forces.computed = {10.0, 12.0};
  forces.measured = {9.0, 12.5};
  forces.u_input = {0.3, 0.4};
  forces.u_data = {0.4, 0.3};
  forces.u_num = 1.2;
  return forces;
}

TEST(Validation, PartsAddAsSquares) {
  const DriveValidation v = Validate(TwoSamples(), {.coverage = 2.0, .share = 0.0});
  EXPECT_NEAR(v.u_val[0], 1.3, 1e-15);
  EXPECT_NEAR(v.u_val[1], 1.3, 1e-15);
  EXPECT_NEAR(v.level, 1.3, 1e-15);
  EXPECT_NEAR(v.error_mean, 0.25, 1e-15);
  EXPECT_NEAR(v.error_rms, std::sqrt(0.625), 1e-15);
  EXPECT_NEAR(v.measured_rms, std::sqrt((81.0 + 156.25) / 2.0), 1e-14);
  EXPECT_STREQ(v.largest, "u_num");
  EXPECT_TRUE(v.pass());
}

TEST(Validation, NamesThePartThatDominates) {
  ForceComparison forces = TwoSamples();
  forces.u_num = 0.0;
  forces.u_data = {0.1, 0.1};
  EXPECT_STREQ(Validate(forces, {}).largest, "u_input");
  forces.u_data = {1.0, 1.0};
  EXPECT_STREQ(Validate(forces, {}).largest, "u_D");
}

TEST(Validation, AnErrorBeyondTheCoverageIsSeen) {
  ForceComparison forces = TwoSamples();
  forces.measured[0] = 10.0 - 2.0 * 1.3 * (1.0 - 1e-9);
  EXPECT_EQ(Validate(forces, {.coverage = 2.0, .share = 0.0}).outside, 0u);
  forces.measured[0] = 10.0 - 2.0 * 1.3 * (1.0 + 1e-9);
  const DriveValidation v = Validate(forces, {.coverage = 2.0, .share = 0.0});
  EXPECT_EQ(v.outside, 1u);
  EXPECT_FALSE(v.pass());
  EXPECT_FALSE(Validate(forces, {.coverage = 2.0, .share = 0.49}).pass());
  EXPECT_TRUE(Validate(forces, {.coverage = 2.0, .share = 0.5}).pass());
}

TEST(Validation, WhatIsNotANumberIsNotInside) {
  ForceComparison forces = TwoSamples();
  forces.u_input[1] = kNan;
  EXPECT_EQ(Validate(forces, {.coverage = 2.0, .share = 0.0}).outside, 1u);
  forces = TwoSamples();
  forces.computed[0] = kNan;
  EXPECT_EQ(Validate(forces, {.coverage = 2.0, .share = 0.0}).outside, 1u);
}

TEST(Validation, NothingMeasuredValidatesNothing) {
  EXPECT_FALSE(StudyValidationResult{}.pass());
  EXPECT_FALSE(DriveValidation{}.pass());
  StudyValidationResult result;
  result.drives = {Validate(TwoSamples(), {})};
  EXPECT_TRUE(result.pass());
  result.trouble = "no u_num";
  EXPECT_FALSE(result.pass());
}

TEST(Validation, DeviationsAreThoseOfASample) {
  const auto deviations = DeviationsOverPoints({{1.0F, 5.0F}, {3.0F, 5.0F}, {5.0F, 5.0F}}, 2);
  EXPECT_NEAR(deviations[0], 2.0, 1e-15);
  EXPECT_EQ(deviations[1], 0.0);
  EXPECT_TRUE(std::isnan(DeviationsOverPoints({{1.0F}}, 1)[0]));
}

}  // namespace
}  // namespace mbv
