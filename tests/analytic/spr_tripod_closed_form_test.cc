// The 3-SPR mechanism's closed form as a witness: wiring, trajectories, refusals, cost.
#include "analytic/spr_tripod/closed_form.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "model_file/load_model.h"
#include "reference/reference.h"
#include "tests/analytic/spr_tripod_model.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/source_dir.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr double kDegree = pi / 180.0;
// Forces of some 600 N through matrices of condition 2.2 and sums of 50 terms.
constexpr double kForceRoundoff_N = 1e4 * kEps * 600;

ClosedFormRun RunTripod(const Mechanism& mechanism, const Motion& motion) {
  Diagnostics diagnostics;
  const auto closed_form = spr_tripod::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  EXPECT_NE(closed_form, nullptr) << diagnostics.Text();
  return RunClosedForm(mechanism, motion, closed_form.get());
}

VecX ColumnOf(const Trace& trace, const std::string& name) {
  const int k = trace.Find(name);
  EXPECT_GE(k, 0) << name;
  return trace.values.col(k);
}

std::string ErrorOf(const Mechanism& mechanism, const Motion& motion) {
  Diagnostics diagnostics;
  EXPECT_EQ(spr_tripod::MakeClosedForm(mechanism, motion, {}, &diagnostics), nullptr);
  return diagnostics.Text();
}

TEST(SprTripodClosedForm, IsRegisteredUnderItsName) {
  const ClosedFormRow* row = FindClosedForm("spr_tripod");
  ASSERT_NE(row, nullptr);
  EXPECT_EQ(row->models.front(), "full");
  EXPECT_EQ(row->factory, &spr_tripod::MakeClosedForm);
}

TEST(SprTripodClosedForm, DefaultPathReachesTheTabulatedExtremes) {
  const ClosedFormRun run =
      RunTripod(TripodByHand(), PathMotion(0.0, 0.12, 0.06, 0.57, 0.8000139938e-3));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto expect = [&](const std::string& channel, double low, double high, double tolerance) {
    const VecX column = ColumnOf(run.trace, channel);
    EXPECT_NEAR(column.minCoeff(), low, tolerance) << channel;
    EXPECT_NEAR(column.maxCoeff(), high, tolerance) << channel;
  };
  // A grid of 0.8 ms misses an extreme by at most (0.4 ms)²/2 times the second derivative, which
  // stays below 600 m/s³ for velocities and 3e5 N/s² for forces.
  expect("leg1.position", 0.558055, 0.699303, 1e-5);
  expect("leg3.position", 0.512935, 0.741376, 1e-5);
  expect("leg1.velocity", -0.511416, 0.586807, 5e-5);
  expect("leg3.velocity", -0.623449, 0.46967, 5e-5);
  expect("leg1.force", -372.78, 14.52, 0.03);
  expect("leg3.force", -538.79, 195.12, 0.03);
  expect("tilt", 0.0, 13.14637 * kDegree, 1e-6);
  EXPECT_NEAR(ColumnOf(run.trace, "jacobian.det").minCoeff(), 1.147, 1e-3);
  double acceleration = 0.0, spin = 0.0;
  for (const char* leg : {"leg1", "leg2", "leg3"}) {
    const std::string name = leg;
    acceleration = std::max(acceleration,
                            ColumnOf(run.trace, name + ".acceleration").lpNorm<Eigen::Infinity>());
    spin = std::max(spin, ColumnOf(run.trace, name + ".spin").lpNorm<Eigen::Infinity>());
  }
  EXPECT_NEAR(acceleration, 10.33, 0.01);
  EXPECT_NEAR(spin, 0.438, 1e-3);
}

Mechanism ShippedModel() {
  LoadResult loaded = LoadModel(SourcePath("/models/spr_tripod/model.yaml"));
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

TEST(SprTripodClosedForm, ShippedModelGivesTheDriveForcesOfTheOneMadeByHand) {
  const Motion motion = PathMotion(50 * kDegree, 0.12, 0.06, 0.57, 0.01);
  const Trace shipped = RunTripod(ShippedModel(), motion).trace;
  const Trace by_hand = RunTripod(TripodByHand(), motion).trace;
  for (const Channel& channel : by_hand.channels) {
    if (channel.name.find("reaction") != std::string::npos) continue;  // other joint axes
    const VecX difference = ColumnOf(shipped, channel.name) - ColumnOf(by_hand, channel.name);
    EXPECT_LT(difference.lpNorm<Eigen::Infinity>(), kForceRoundoff_N) << channel.name;
  }
}

TEST(SprTripodClosedForm, ReferenceAgreesOnEveryChannelTheyShare) {
  const Mechanism mechanism = ShippedModel();
  const Motion motion = PathMotion(50 * kDegree, 0.12, 0.06, 0.57, 0.02);
  const Trace analytic = RunTripod(mechanism, motion).trace;
  const ReferenceRun reference = RunReference(mechanism, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  int shared = 0;
  for (const Channel& channel : analytic.channels) {
    if (reference.trace.Find(channel.name) < 0) continue;
    ++shared;
    const VecX a = ColumnOf(analytic, channel.name), r = ColumnOf(reference.trace, channel.name);
    // Loops close to 1e-13 m; forces follow from a system of condition 1e4.
    EXPECT_LT((a - r).lpNorm<Eigen::Infinity>(), 1e-9 * std::max(1.0, a.lpNorm<Eigen::Infinity>()))
        << channel.name;
  }
  EXPECT_EQ(shared, 12 + 6 + 9);  // drives, platform, forces of the ball joints
}

TEST(SprTripodClosedForm, PathOfTheSymmetryPlaneDrivesTwoLegsAlike) {
  const ClosedFormRun run = RunTripod(TripodByHand(), PathMotion(0.0));
  for (const char* signal : {".position", ".velocity", ".acceleration", ".force"}) {
    const VecX difference = ColumnOf(run.trace, std::string("leg1") + signal) -
                            ColumnOf(run.trace, std::string("leg2") + signal);
    EXPECT_LT(difference.lpNorm<Eigen::Infinity>(), kForceRoundoff_N) << signal;
  }
}

TEST(SprTripodClosedForm, PathsAtMirrorAzimuthsRunBackwardsWithLegsExchanged) {
  const auto lengths = [](double gamma_deg) {
    Motion motion = PathMotion(gamma_deg * kDegree);
    motion.sample_s = motion.duration_s / 500;
    return RunTripod(TripodByHand(), motion).trace;
  };
  const Trace at90 = lengths(90), at150 = lengths(150), at30 = lengths(30);
  const auto reversed = [](const Trace& trace, const char* leg) {
    return VecX(ColumnOf(trace, std::string(leg) + ".position").reverse());
  };
  constexpr double kTolerance_m = 1e-13;  // times differ by rounding, speeds are below 1 m/s
  const auto near = [&](const VecX& a, const VecX& b) {
    return (a - b).lpNorm<Eigen::Infinity>() < kTolerance_m;
  };
  EXPECT_TRUE(near(ColumnOf(at90, "leg1.position"), reversed(at90, "leg2")));
  EXPECT_TRUE(near(ColumnOf(at90, "leg3.position"), reversed(at90, "leg3")));
  EXPECT_TRUE(near(ColumnOf(at150, "leg1.position"), reversed(at150, "leg3")));
  EXPECT_TRUE(near(ColumnOf(at150, "leg2.position"), reversed(at150, "leg2")));
  // Turning the path by 120 deg permutes the legs: B3 → B1 → B2.
  EXPECT_TRUE(near(ColumnOf(at150, "leg1.position"), ColumnOf(at30, "leg3.position")));
  EXPECT_TRUE(near(ColumnOf(at150, "leg2.position"), ColumnOf(at30, "leg1.position")));
  EXPECT_FALSE(near(ColumnOf(at150, "leg1.position"), ColumnOf(at30, "leg1.position")));
}

TEST(SprTripodClosedForm, WorkOverARestToRestPathIsThePotentialDifference) {
  Motion motion = PathMotion(0.0);
  // Simpson on each of the three segments: the power is smooth inside them.
  const Mechanism mechanism = TripodByHand();
  Diagnostics diagnostics;
  const auto closed_form = spr_tripod::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  CommandSample command;
  ClosedFormSample sample;
  const auto power = [&](double t) {
    EvaluateMotion(motion, t, &command);
    EXPECT_TRUE(closed_form->Dynamics(command, &sample).ok());
    return sample.force.dot(sample.driven.velocity);
  };
  const double T_short = 0.186120972, T_long = motion.duration_s - 2 * T_short;
  const double ramp = 0.5 * 0.230940108;
  const double knots[] = {
      0.0, T_short, T_short + ramp, T_short + T_long - ramp, T_short + T_long, motion.duration_s};
  double work = 0.0;
  for (int k = 0; k < 5; ++k) {
    constexpr int n = 200;
    const double h = (knots[k + 1] - knots[k]) / n;
    for (int i = 0; i <= n; ++i) {
      work += h / 3 * (i == 0 || i == n ? 1 : i % 2 ? 4 : 2) * power(knots[k] + i * h);
    }
  }
  EXPECT_NEAR(work, -0.071395042, 1e-8);  // Simpson: (h/0.1 s)⁴ · 300 W · 0.1 s / 180
}

TEST(SprTripodClosedForm, ForcesNearlyVanishInFreeFall) {
  Motion motion = PathMotion(0.0);
  const Mechanism mechanism = TripodByHand();
  Diagnostics diagnostics;
  const auto closed_form = spr_tripod::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  CommandSample command;
  ClosedFormSample sample;
  // Peak of the first 3-4-5 segment: 10 m/s² along gravity's 9.81.
  EvaluateMotion(motion, 0.186120972 * (3 - std::sqrt(3.0)) / 6, &command);
  ASSERT_TRUE(closed_form->Dynamics(command, &sample).ok());
  EXPECT_NEAR(command.acceleration[2], 10.0, 1e-6);
  EXPECT_LT(sample.force.lpNorm<Eigen::Infinity>(), 6.5);
}

TEST(SprTripodClosedForm, LegCommandsAndTaskCommandsGiveTheSameForces) {
  const Mechanism mechanism = TripodByHand();
  const Motion task =
      TaskMotion({Profile{{SineTerm{0.08, 0.8, 0.3}}}, Profile{{SineTerm{0.06, 1.1, 0.0}}},
                  Profile{{ConstantTerm{0.57}, SineTerm{0.04, 0.6, 1.0}}}},
                 1.0, 0.05);
  Motion legs = task;
  for (int k = 0; k < 3; ++k) {
    legs.commands[k].name = mechanism.drives[k].name;
    legs.commands[k].terms[0].coordinate = {Coordinate::Kind::kDrive, k, 0};
  }
  Diagnostics diagnostics;
  const auto by_task = spr_tripod::MakeClosedForm(mechanism, task, {}, &diagnostics);
  const auto by_legs = spr_tripod::MakeClosedForm(mechanism, legs, {}, &diagnostics);
  ASSERT_NE(by_legs, nullptr) << diagnostics.Text();
  CommandSample command;
  ClosedFormSample a, b;
  for (double t : {0.0, 0.3, 0.85}) {
    EvaluateMotion(task, t, &command);
    ASSERT_TRUE(by_task->Dynamics(command, &a).ok());
    command.position = a.driven.position;
    command.velocity = a.driven.velocity;
    command.acceleration = a.driven.acceleration;
    ASSERT_TRUE(by_legs->Dynamics(command, &b).ok());
    EXPECT_LT((a.force - b.force).lpNorm<Eigen::Infinity>(), 10 * kForceRoundoff_N);
    EXPECT_LT((a.extra - b.extra).lpNorm<Eigen::Infinity>(), 10 * kForceRoundoff_N);
    command.acceleration[0] += 1e-6;
    ASSERT_TRUE(by_legs->Dynamics(command, &b).ok());
    EXPECT_GT((a.force - b.force).lpNorm<Eigen::Infinity>(), 10 * kForceRoundoff_N);
  }
}

TEST(SprTripodClosedForm, ReactionsCarryWeightAndToolLoadInTheBallJointsAxes) {
  Mechanism mechanism = TripodByHand();
  // Ball joints whose frames are turned by -90 deg about x: world z is their y... and back.
  for (int leg = 0; leg < 3; ++leg) {
    mechanism.joints[3 * leg].X_PF.linear() =
        Eigen::AngleAxisd(-pi / 2, Vec3::UnitX()).toRotationMatrix();
  }
  Motion motion = TaskMotion({Constant(0.05), Constant(-0.04), Constant(0.6)}, 0.01, 0.01);
  Load load;
  load.name = "tool";
  load.body = 1;
  load.p_BoQ_B = {0, 0, 0.2};
  for (int k = 0; k < 3; ++k) {
    load.force[k] = Constant(Vec3(120, -80, -400)[k]);
    load.moment[k] = Constant(Vec3(3, -5, 8)[k]);
  }
  motion.loads = {load};
  const ClosedFormRun run = RunTripod(mechanism, motion);
  Vec3 sum_F = Vec3::Zero();
  for (const char* leg : {"leg1", "leg2", "leg3"}) {
    for (int k = 0; k < 3; ++k) {
      sum_F[k] +=
          ColumnOf(run.trace, std::string(leg) + ".S.reaction.f" + std::string(1, "xyz"[k]))[0];
    }
  }
  const Vec3 sum_W = mechanism.joints[0].X_PF.linear() * sum_F;
  EXPECT_LT((sum_W - Vec3(-120, 80, 400 - 588.6)).norm(), kForceRoundoff_N);
  // The same load turned with the platform acts differently.
  motion.loads[0].in_body_axes = true;
  const ClosedFormRun turned = RunTripod(mechanism, motion);
  EXPECT_GT(
      std::abs(ColumnOf(turned.trace, "leg1.force")[0] - ColumnOf(run.trace, "leg1.force")[0]),
      1.0);
}

TEST(SprTripodClosedForm, ForcesFollowMassesAndGravityOfTheDescription) {
  Mechanism mechanism = TripodByHand();
  const Motion motion = TaskMotion({Constant(0.05), Constant(0.02), Constant(0.6)}, 0.01, 0.01);
  const VecX before = ColumnOf(RunTripod(mechanism, motion).trace, "leg1.force");
  for (Parameter& p : mechanism.parameters) p.value *= p.name.starts_with("m_") ? 1.001 : 1.0;
  const VecX heavier = ColumnOf(RunTripod(mechanism, motion).trace, "leg1.force");
  EXPECT_NEAR(heavier[0], 1.001 * before[0], kForceRoundoff_N);  // at rest, all weight
  mechanism.gravity_W *= 1.001;
  EXPECT_NEAR(ColumnOf(RunTripod(mechanism, motion).trace, "leg1.force")[0], 1.001 * heavier[0],
              kForceRoundoff_N);
}

TEST(SprTripodClosedForm, UnreachablePoseStopsTheRunWithTimeAndPlace) {
  const ClosedFormRun run = RunTripod(
      TripodByHand(),
      TaskMotion({Constant(0.0), Constant(0.0), Profile{{ConstantTerm{0.5}, RampTerm{-1.0}}}}, 0.4,
                 0.1));
  EXPECT_EQ(run.summary.stop, Stop::kUnreachable);
  EXPECT_NEAR(run.summary.time_s, 0.3, 1e-12);  // first sample below b/2 = 0.2275 m
  EXPECT_NEAR(run.summary.amount, 0.0275, 1e-12);
  EXPECT_NE(run.summary.message.find("0.2275"), std::string::npos);
}

TEST(SprTripodClosedForm, MotionsItDoesNotCoverAreRefusedWithAHint) {
  const Mechanism mechanism = TripodByHand();
  Motion motion = TaskMotion({Constant(0), Constant(0), Constant(0.6)}, 1, 0.1);
  Motion tilted = motion;
  tilted.commands[0].terms[0].coordinate.component = 3;
  tilted.commands[0].name = "platform.roll";
  EXPECT_NE(ErrorOf(mechanism, tilted).find("platform.roll"), std::string::npos);
  Motion incomplete = motion;
  incomplete.commands.pop_back();
  EXPECT_NE(ErrorOf(mechanism, incomplete).find("three degrees of freedom"), std::string::npos);
  Motion mixed = motion;
  mixed.commands[0].terms[0].coordinate = {Coordinate::Kind::kDrive, 0, 0};
  EXPECT_NE(ErrorOf(mechanism, mixed).find("three degrees of freedom"), std::string::npos);
  Motion loaded = motion;
  loaded.loads.emplace_back().name = "on the base";
  EXPECT_NE(ErrorOf(mechanism, loaded).find("on the base"), std::string::npos);
}

TEST(SprTripodClosedForm, DimensionsItDoesNotCoverAreAllReported) {
  Mechanism mechanism = TripodByHand();
  const Motion motion = TaskMotion({Constant(0), Constant(0), Constant(0.6)}, 1, 0.1);
  for (Parameter& p : mechanism.parameters) {
    if (p.name == "phi_1") p.value += 0.01;
    if (p.name == "theta_2") p.value += 0.02;
    if (p.name == "a") p.value = -0.1;
  }
  const std::string text = ErrorOf(mechanism, motion);
  for (const char* word : {"phi_1", "theta_2", "a = -0.1"}) {
    EXPECT_NE(text.find(word), std::string::npos) << text;
  }
  mechanism = TripodByHand();
  std::erase_if(mechanism.parameters, [](const Parameter& p) { return p.name == "m_cyl"; });
  EXPECT_NE(ErrorOf(mechanism, motion).find("m_cyl"), std::string::npos);
  mechanism = TripodByHand();
  mechanism.joints[4].name = "leg2.slide";
  EXPECT_NE(ErrorOf(mechanism, motion).find("leg2.P"), std::string::npos);
}

TEST(SprTripodClosedForm, HingeSenseDoesNotMatterForSymmetricLegs) {
  Mechanism mechanism = TripodByHand();
  const Motion motion = PathMotion(50 * kDegree, 0.12, 0.06, 0.57, 0.01);
  const Trace printed = RunTripod(mechanism, motion).trace;
  for (Parameter& p : mechanism.parameters) p.value += p.name == "theta_3" ? pi : 0.0;
  const Trace symmetric = RunTripod(mechanism, motion).trace;
  EXPECT_LT((printed.values - symmetric.values).cwiseAbs().maxCoeff(), kForceRoundoff_N);
}

TEST(SprTripodClosedForm, SamplesCostNoAllocation) {
  const Mechanism mechanism = TripodByHand();
  Motion motion = PathMotion(0.0);
  Load load;
  load.body = 1;
  load.force[2] = Constant(-400);
  motion.loads = {load};
  Diagnostics diagnostics;
  const auto closed_form = spr_tripod::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  CommandSample command;
  ClosedFormSample sample;
  EvaluateMotion(motion, 0.0, &command);
  ASSERT_TRUE(closed_form->Dynamics(command, &sample).ok());
  const double* data[] = {sample.force.data(), sample.extra.data(), sample.driven.position.data(),
                          sample.driven.velocity.data(), sample.driven.acceleration.data()};
  const std::size_t before = AllocationCount();
  constexpr int kSamples = 20000;
  double sum = 0.0;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < kSamples; ++i) {
    command.position[0] = -0.12 + 0.24 * i / kSamples;
    if (!closed_form->Dynamics(command, &sample).ok()) FAIL() << i;
    sum += sample.force[0];
  }
  const double each_us =
      1e6 / kSamples *
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::size_t allocated = AllocationCount() - before;
  EXPECT_EQ(allocated, 0u) << sum;
  RecordProperty("microseconds_per_sample", std::to_string(each_us));
  // Vectors keep their storage, too (Eigen allocates past operator new).
  const double* after[] = {sample.force.data(), sample.extra.data(), sample.driven.position.data(),
                           sample.driven.velocity.data(), sample.driven.acceleration.data()};
  for (int k = 0; k < 5; ++k) EXPECT_EQ(after[k], data[k]);
  EXPECT_LT(each_us, 50.0);  // measured 0.5 µs; generous for a loaded machine and sanitizers
}

}  // namespace
}  // namespace mbv::spr_tripod
