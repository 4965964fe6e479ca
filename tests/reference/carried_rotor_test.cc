// A rotor that its carrier turns against the exact model, in which it is a body.
#include "tests/mechanisms/carried_rotor.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

Mechanism Loaded(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism{});
}

ReferenceRun Wheeling(const Mechanism& m) {
  return RunReference(m, DriveMotion(m,
                                     {{{SineTerm{0.8, 0.7, 0.3}, RampTerm{1.1}}},
                                      {{SineTerm{0.6, 1.1, 1.0}}},
                                      {{SineTerm{2.0, 0.9, 0.2}, RampTerm{-2.0}}}},
                                     2.0, 0.05));
}

// Largest difference of a channel, over the largest value of the truth.
double ErrorOf(const Trace& law, const Trace& body, const std::string& channel) {
  const VecX truth = ColumnOf(body, channel);
  return (ColumnOf(law, channel) - truth).cwiseAbs().maxCoeff() / truth.cwiseAbs().maxCoeff();
}

constexpr std::array kFelt = {"m1.force",       "m2.force",        "m3.force",
                              "energy.kinetic", "yaw.reaction.mx", "pitch.reaction.mz"};

TEST(CarriedRotor, IsTheBodyOnItsBearing) {
  const CarriedRotor rotor;
  const ReferenceRun law = Wheeling(Loaded(rotor.AsLaw())), body = Wheeling(Loaded(rotor.AsBody()));
  ASSERT_TRUE(law.summary.ok()) << law.summary.message;
  ASSERT_TRUE(body.summary.ok()) << body.summary.message;
  for (const char* channel : kFelt) EXPECT_LT(ErrorOf(law.trace, body.trace, channel), 1e-13);
  const VecX in = ColumnOf(law.trace, "power.input");
  EXPECT_LT((in - ColumnOf(law.trace, "power.energy_rate")).cwiseAbs().maxCoeff(),
            1e-13 * in.cwiseAbs().maxCoeff());
}

TEST(CarriedRotor, EachNumberCounts) {
  const ReferenceRun truth = Wheeling(Loaded(CarriedRotor().AsBody()));
  CarriedRotor slower, lighter, tilted, backwards;
  slower.ratio *= 0.999;
  lighter.rotor_inertia = "0.003996";
  tilted.axis = "[0.601, 0, 0.8]";
  backwards.ratio *= -1.0;
  for (const CarriedRotor& perturbed : {slower, lighter, tilted, backwards}) {
    const ReferenceRun run = Wheeling(Loaded(perturbed.AsLaw()));
    EXPECT_GT(ErrorOf(run.trace, truth.trace, "m2.force"), 1e-5);
  }
}

// Forces give accelerations through the mixed inertia J n (u aᵀ + a uᵀ).
TEST(CarriedRotor, FallsAsTheBodyOnItsBearing) {
  const CarriedRotor rotor;
  const auto fall = [](const Mechanism& m) {
    Motion motion = DriveMotion(m, {}, 0.5, 0.05);
    for (int d = 0; d < 3; ++d) {
      motion.forces.push_back({.drive = d, .force = Constant(0.3)});
      motion.initial.push_back({.name = m.drives[static_cast<size_t>(d)].name,
                                .coordinate = {Coordinate::Kind::kDrive, d, 0},
                                .position = 0.1 * d,
                                .rate = 2.0 - d});
    }
    return RunForwardReference(m, motion);
  };
  const ForwardRun law = fall(Loaded(rotor.AsLaw())), body = fall(Loaded(rotor.AsBody()));
  ASSERT_TRUE(law.summary.ok()) << law.summary.message;
  ASSERT_TRUE(body.summary.ok()) << body.summary.message;
  for (const char* channel : {"m1.position", "m2.position", "m3.position"}) {
    EXPECT_LT(ErrorOf(law.trace, body.trace, channel), 1e-8) << channel;
  }
}

}  // namespace
}  // namespace mbv::fixtures
