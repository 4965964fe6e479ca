// Stabilizing platform against the generic reference solver on the shipped model: drives, platform
// poses and every joint reaction, in both drive modes, with loads and other parameters.
#include "reference/reference.h"

#include <gtest/gtest.h>

#include <cmath>

#include "model_file/load_model.h"
#include "tests/analytic/stabilizing_platform_fixture.h"
#include "tests/support/source_dir.h"

namespace mbv::stabilizing_platform {
namespace {

Mechanism LoadWith(const std::map<std::string, double>& overrides = {}) {
  LoadOptions options;
  options.overrides = overrides;
  LoadResult loaded = LoadModel(SourcePath("/models/stabilizing_platform/model.yaml"), options);
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  return std::move(*loaded.mechanism);
}

// Largest difference of the channels that both traces have, per unit.
struct Differences {
  std::map<std::string, double> by_unit;
  std::map<std::string, std::string> worst;
  int compared = 0;
};

Differences Compare(const Mechanism& mechanism, const Motion& motion,
                    const std::string& model = "") {
  Diagnostics diagnostics;
  const auto closed_form =
      MakeClosedForm(mechanism, motion, {.model = model, .as_printed = {}}, &diagnostics);
  EXPECT_NE(closed_form, nullptr) << diagnostics.Text();
  const ClosedFormRun closed = RunClosedForm(mechanism, motion, closed_form.get());
  EXPECT_TRUE(closed.summary.ok()) << closed.summary.message;
  const ReferenceRun reference = RunReference(mechanism, motion);
  EXPECT_TRUE(reference.summary.ok()) << reference.summary.message;
  Differences out;
  for (size_t k = 0; k < closed.trace.channels.size(); ++k) {
    const Channel& channel = closed.trace.channels[k];
    const int other = reference.trace.Find(channel.name);
    if (other < 0) continue;
    ++out.compared;
    const double difference =
        (closed.trace.values.col(static_cast<Eigen::Index>(k)) - reference.trace.values.col(other))
            .cwiseAbs()
            .maxCoeff();
    double& largest = out.by_unit[channel.unit];
    if (difference > largest || std::isnan(difference)) {
      largest = difference;
      out.worst[channel.unit] = channel.name;
    }
  }
  return out;
}

// Roundoff of forces of 1.3 MN, moments of 10 kN m at arms of 5 m, lengths of 10 m, in systems of
// condition up to a few hundred; rates up to 3 units.
const std::map<std::string, double> kLimits = {{"N", 5e-7},    {"N m", 5e-7},  {"m", 1e-12},
                                               {"rad", 1e-12}, {"m/s", 2e-12}, {"m/s^2", 1e-11}};

void ExpectAgreement(const Differences& differences, int channels) {
  EXPECT_EQ(differences.compared, channels);
  for (const auto& [unit, difference] : differences.by_unit) {
    ASSERT_TRUE(kLimits.count(unit)) << unit;
    EXPECT_LE(difference, kLimits.at(unit)) << unit << ", worst: " << differences.worst.at(unit);
  }
}

// 6 drives × 4 signals, 2 outputs × 6, and per limb 2 × 5 + 2 × 5 + 3 + 3 reaction components.
constexpr int kChannels = 24 + 12 + 3 * 26;

Motion Coarse(const Mechanism& mechanism, bool hold_still) {
  Motion motion = SeaStateMotion(mechanism, hold_still);
  motion.sample_s = 0.1;
  return motion;
}

TEST(StabilizingPlatformAgainstReference, AgreesOnDrivesPosesAndReactions) {
  const Mechanism mechanism = LoadWith();
  ExpectAgreement(Compare(mechanism, Coarse(mechanism, false)), kChannels);
}

TEST(StabilizingPlatformAgainstReference, AgreesWithSixIndependentDrives) {
  const Mechanism mechanism = LoadWith();
  ExpectAgreement(Compare(mechanism, Coarse(mechanism, true)), kChannels);
}

TEST(StabilizingPlatformAgainstReference, AgreesWithMasslessLinks) {
  const Mechanism mechanism = LoadWith({{"link_mass_scale", 0}});
  ExpectAgreement(Compare(mechanism, Coarse(mechanism, false), "massless"), kChannels);
}

TEST(StabilizingPlatformAgainstReference, AgreesWithOtherParameters) {
  const Mechanism mechanism = LoadWith({{"theta_1", 110 * kDegree},
                                        {"theta_2", 235 * kDegree},
                                        {"r_a", 7.6},
                                        {"L3", 2.3},
                                        {"c_1", 0.4},
                                        {"c_2", 0.6},
                                        {"link1_inertia_scale", 0.1},
                                        {"s_r_so", 0.3}});
  ExpectAgreement(Compare(mechanism, Coarse(mechanism, false)), kChannels);
}

TEST(StabilizingPlatformAgainstReference, AgreesWithCentresOfMassOffTheAxes) {
  const Mechanism mechanism = LoadWith({{"c_p_x", 0.4},
                                        {"c_p_y", -0.3},
                                        {"c_p_z", 1.2},
                                        {"c_1_x", 0.15},
                                        {"c_1_z", -0.2},
                                        {"c_1p_x", -0.05},
                                        {"c_1p_z", 0.1},
                                        {"c_2_x", 0.1},
                                        {"c_2_z", 0.08},
                                        {"c_2p_x", 0.12},
                                        {"c_2p_z", -0.06}});
  for (bool hold_still : {false, true}) {
    ExpectAgreement(Compare(mechanism, Coarse(mechanism, hold_still)), kChannels);
  }
}

TEST(StabilizingPlatformAgainstReference, AgreesWithLoadsOnPlatformAndLinks) {
  const Mechanism mechanism = LoadWith();
  for (bool hold_still : {false, true}) {
    Motion motion = Coarse(mechanism, hold_still);
    auto add = [&](const char* body, const Vec3& point, bool in_body_axes) {
      mbv::Load load;
      load.name = body;
      load.body = mechanism.FindBody(body);
      load.p_BoQ_B = point;
      load.in_body_axes = in_body_axes;
      for (int c = 0; c < 3; ++c) {
        load.force[c].terms = {SineTerm{3e4, 0.3, 1.0 * c}, ConstantTerm{-1e4}};
        load.moment[c].terms = {SineTerm{2e4, 0.2, 0.5 * c}};
      }
      motion.loads.push_back(load);
    };
    add("platform", {2, -1, 0.5}, false);
    add("platform", {-1, 0, 2}, true);
    add("limb2.link1", {0.1, 2, 0.3}, false);
    add("limb3.link2_p", {0, 1, 0}, true);
    add("ship", {1, 1, 1}, false);
    ExpectAgreement(Compare(mechanism, motion), kChannels);
  }
}

TEST(StabilizingPlatformAgainstReference, NoticesAPlatformHeavierByAMilligram) {
  // 1 mg is 1e-5 N of weight, a fifth of it on a drive: 6 limits.
  const Mechanism mechanism = LoadWith();
  Mechanism perturbed = mechanism;
  for (Parameter& parameter : perturbed.parameters) {
    if (parameter.name == "m_p") parameter.value += 1e-6;
  }
  const Motion motion = Coarse(mechanism, false);
  const Differences differences = Compare(perturbed, motion);  // bodies keep their mass
  EXPECT_GT(differences.by_unit.at("N"), kLimits.at("N"));
}

TEST(StabilizingPlatformAgainstReference, DisagreesWithThePaperText) {
  const Mechanism mechanism = LoadWith();
  const Motion motion = Coarse(mechanism, false);
  EXPECT_NEAR(Compare(mechanism, motion, "paper_text").by_unit.at("N"), 9.7e3, 50);
}

}  // namespace
}  // namespace mbv::stabilizing_platform
