// Bushings and carried rotors in MuJoCo: against the exact model, and against energy.
#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/carried_rotor.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

Mechanism Loaded(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism{});
}

// Sines on three drives, the third with a ramp.
RunSummary TurnThree(double t, DrivenSample* driven) {
  const Vec3 size(0.8, 0.6, 1.1), w(4.4, 6.9, 5.6), phase(0.3, 1.0, 0.2);
  const Vec3 angle = w * t + phase;
  driven->position = size.cwiseProduct(Vec3(angle.array().sin())) + Vec3(0, 0, -2 * t);
  driven->velocity = size.cwiseProduct(w).cwiseProduct(Vec3(angle.array().cos())) + Vec3(0, 0, -2);
  driven->acceleration =
      -size.cwiseProduct(w).cwiseProduct(w).cwiseProduct(Vec3(angle.array().sin()));
  return RunSummary::Done();
}

Motion TwoSeconds() { return {.duration_s = 2.0, .sample_s = 0.05, .commands = {}, .loads = {}}; }

VecX SignalOf(const SimulationRun& run, const char* channel) {
  return run.trace.values.col(run.trace.Find(channel));
}

double Difference(const SimulationRun& a, const SimulationRun& b, const char* channel) {
  const VecX truth = SignalOf(b, channel);
  return (SignalOf(a, channel) - truth).cwiseAbs().maxCoeff() / truth.cwiseAbs().maxCoeff();
}

TEST(SimulatedRotors, AreTheBodyOnItsBearing) {
  const fixtures::CarriedRotor rotor;
  const Mechanism law = Loaded(rotor.AsLaw()), body = Loaded(rotor.AsBody());
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const double tolerance = mode == DriveMode::kPrescribedMotion ? 1e-6 : 1e-12;
    const SimulationRun a = Simulate(law, TwoSeconds(), TurnThree, {.mode = mode});
    const SimulationRun b = Simulate(body, TwoSeconds(), TurnThree, {.mode = DriveMode::kInverse});
    ASSERT_TRUE(a.summary.ok()) << a.summary.message;
    ASSERT_TRUE(b.summary.ok()) << b.summary.message;
    for (const char* channel :
         {"m1.force", "m2.force", "m3.force", "energy.kinetic", "yaw.reaction.mx"}) {
      EXPECT_LT(Difference(a, b, channel), tolerance) << channel;
    }
    const VecX in = SignalOf(a, "power.input");
    EXPECT_LT((in - SignalOf(a, "power.energy_rate")).cwiseAbs().maxCoeff(),
              tolerance * in.cwiseAbs().maxCoeff());
  }
}

// Turned by torques: the law against the body on its bearing, and against energy.
TEST(SimulatedRotors, TurnTheirCarrierInFreeMotion) {
  const fixtures::CarriedRotor rotor;
  const auto turn = [](const Mechanism& m, Engine engine = Engine::kCorrected) {
    Motion motion = {.duration_s = 1.0, .sample_s = 0.05, .commands = {}, .loads = {}};
    for (int d = 0; d < 3; ++d) {
      motion.forces.push_back({.drive = d, .force = {{SineTerm{0.4, 0.7, 0.3 * d}}}});
      motion.initial.push_back({.name = m.drives[static_cast<size_t>(d)].name,
                                .coordinate = {Coordinate::Kind::kDrive, d, 0},
                                .position = 0.1 + 0.25 * d,  // the rotor: 8.4 rad, a turn and more
                                .rate = d == 2 ? 6.0 : 1.0});
    }
    SimulationOptions options{.engine = engine};
    EXPECT_TRUE(InitialStates(m, motion, &options.start).ok());
    const auto nothing = [](double, DrivenSample* at) {
      at->position = at->velocity = at->acceleration = VecX::Zero(3);
      return RunSummary::Done();
    };
    return Simulate(m, motion, nothing, options);
  };
  const SimulationRun law = turn(Loaded(rotor.AsLaw())), body = turn(Loaded(rotor.AsBody()));
  ASSERT_TRUE(law.summary.ok()) << law.summary.message;
  ASSERT_TRUE(body.summary.ok()) << body.summary.message;
  for (const char* channel : {"m1.position", "m2.position", "m3.position", "energy.kinetic"}) {
    EXPECT_LT(Difference(law, body, channel), 1e-8) << channel;
  }
  EXPECT_LT(Difference(law, body, "yaw.reaction.mx"), 1e-6);
  const VecX in = SignalOf(law, "power.input");
  EXPECT_LT((in - SignalOf(law, "power.energy_rate")).cwiseAbs().maxCoeff(),
            1e-9 * in.cwiseAbs().maxCoeff());
  fixtures::CarriedRotor perturbed = rotor;
  perturbed.ratio *= 1.0 + 1e-5;
  EXPECT_GT(Difference(turn(Loaded(perturbed.AsLaw())), body, "m2.position"), 1e-7);
  // By itself MuJoCo has no inertia between a joint and a body that turns.
  const RunSummary stock = turn(Loaded(rotor.AsLaw()), Engine::kStock).summary;
  EXPECT_EQ(stock.stop, Stop::kUnsupported);
  EXPECT_EQ(stock.where, "fly");
  EXPECT_NE(stock.message.find("gyroscopic rotor of joint 'roll'"), std::string::npos);
}

std::string Bushed(const std::string& bushing) {
  std::string text = fixtures::CarriedRotor().AsLaw();
  text = text.substr(0, text.find("elements:"));
  return text + "elements:\n  rubber: {kind: bushing, parent: base, child: hand, " + bushing +
         "}\n";
}

// Work into springs is their energy; what dampers take is negative.
TEST(SimulatedBushings, KeepTheBalanceOfPower) {
  const Mechanism m =
      Loaded(Bushed("stiffness: [900, 500, 300, 8, 5, 3], damping: [3, 2, 1, 0.1, 0.2, 0.3]"));
  const SimulationRun run = Simulate(m, TwoSeconds(), TurnThree, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX in = SignalOf(run, "power.input");
  EXPECT_LT((in - SignalOf(run, "power.energy_rate")).cwiseAbs().maxCoeff(),
            1e-12 * in.cwiseAbs().maxCoeff());
  EXPECT_LT(SignalOf(run, "power.dampers").maxCoeff(), 0.0);
  EXPECT_GT(SignalOf(run, "energy.springs").minCoeff(), 1.0);
}

TEST(SimulatedBushings, AreNamedInTheFile) {
  const std::string xml = WriteMjcf(Loaded(Bushed("stiffness: [0, 500, 0, 8, 0, 0]")));
  EXPECT_NE(xml.find("rubber.ky: ky of bushing 'rubber'"), std::string::npos) << xml;
  EXPECT_NE(xml.find("rubber.krx: krx of bushing 'rubber'"), std::string::npos);
  EXPECT_EQ(xml.find("rubber.kz"), std::string::npos);
  const std::string rotor = WriteMjcf(Loaded(fixtures::CarriedRotor().AsLaw()));
  EXPECT_NE(rotor.find("fly: gyroscopic rotor of joint 'roll'"), std::string::npos);
  EXPECT_EQ(rotor.find("armature"), std::string::npos);
}

// Where frames differ by one turn about x and one way along it, six numbers do what a joint's
// spring and damper do.
TEST(SimulatedBushings, AboutAJointsAxisAreAJointsSpring) {
  const std::string elements =
      "elements:\n  k: {kind: spring, joint: roll, stiffness: 8}\n"
      "  c: {kind: damping, joint: roll, damping: 0.4}\n";
  std::string text = fixtures::CarriedRotor().AsLaw();
  text = text.substr(0, text.find("elements:"));
  const Mechanism joint = Loaded(text + elements);
  const Mechanism bushing =
      Loaded(text +
             "elements:\n  b: {kind: bushing, parent: arm.end, child: hand,"
             " stiffness: [0, 0, 0, 8, 3, 3], damping: [0, 0, 0, 0.4, 0, 0]}\n");
  const auto small = [](double t, DrivenSample* driven) {
    RunSummary summary = TurnThree(t, driven);
    driven->position[2] += 2 * t;  // within half a turn
    driven->velocity[2] += 2;
    return summary;
  };
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const double tolerance = mode == DriveMode::kPrescribedMotion ? 1e-9 : 1e-12;
    const SimulationRun a = Simulate(bushing, TwoSeconds(), small, {.mode = mode});
    const SimulationRun b = Simulate(joint, TwoSeconds(), small, {.mode = mode});
    ASSERT_TRUE(a.summary.ok()) << a.summary.message;
    for (const char* channel : {"m1.force", "m2.force", "m3.force", "energy.springs",
                                "power.dampers", "pitch.reaction.mz"}) {
      EXPECT_LT(Difference(a, b, channel), tolerance) << channel;
    }
  }
}

}  // namespace
}  // namespace mbv
