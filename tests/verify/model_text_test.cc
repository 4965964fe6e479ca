// The generated MJCF as a person steps it, in each form.
#include "verify/model_text.h"

#include <gtest/gtest.h>
#include <limits>

#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "simulation/engine/engine.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using simulation::EngineSession;

Mechanism ModelNamed(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return *std::move(result.mechanism);
}

// Largest change of a drive's position in a second from the key "home", as a share of the model's
// size for lengths and in radians; kNan if MuJoCo warns.
double LargestDrift(const Mechanism& mechanism, const std::string& text) {
  std::vector<std::string> warnings;
  const EngineSession session(&warnings);
  const simulation::ModelHandle m = simulation::CompileMjcf(text);
  const simulation::DataHandle d = simulation::MakeData(*m);
  mj_resetDataKeyframe(m.get(), d.get(), mj_name2id(m.get(), mjOBJ_KEY, "home"));
  mj_forward(m.get(), d.get());
  std::vector<double> home;
  double largest = 0.0;
  const auto position = [&](const Drive& drive) {
    return d
        ->sensordata[m->sensor_adr[simulation::IdOf(*m, mjOBJ_SENSOR, drive.name + ".position")]];
  };
  for (const Drive& drive : mechanism.drives) home.push_back(position(drive));
  // What diverges starts anew, again and again.
  for (int k = 0; k < 100000 && d->time < 1.0; ++k) mj_step(m.get(), d.get());
  if (d->time < 1.0) return std::numeric_limits<double>::infinity();
  mj_forward(m.get(), d.get());
  for (size_t k = 0; k < home.size(); ++k) {
    const bool angle = ForceUnit(mechanism, mechanism.drives[k]) != "N";
    largest = std::max(largest, std::abs(position(mechanism.drives[k]) - home[k]) /
                                    (angle ? 1.0 : m->stat.extent));
  }
  return warnings.empty() ? largest : kNan;
}

// All that have weight and whose drives determine the motion, each by itself.
TEST(MjcfFor, HeldAndServoHoldThePoseAndFreeFalls) {
  size_t fallen = 0;
  for (const std::string& name : ShippedModelNames()) {
    const Mechanism mechanism = ModelNamed(name);
    const Mobility mobility = AnalyseMobility(mechanism);
    if (mobility.undriven != 0 || !mobility.drives_not_unique.empty()) continue;
    if (mechanism.gravity_W.isZero()) continue;
    // Its dampers of 4e4 N s/m are too stiff for MuJoCo's step of 1 ms.
    if (name == "flyball_governor") continue;
    const MjcfText held = MjcfFor(mechanism, ModelDrives::kHeld);
    const MjcfText servo = MjcfFor(mechanism, ModelDrives::kServo);
    const MjcfText free = MjcfFor(mechanism, ModelDrives::kFree);
    ASSERT_EQ(servo.trouble, "") << name;
    // MuJoCo's constraints are soft: a drive gives way by a little under its load.
    EXPECT_LT(LargestDrift(mechanism, held.text), 1e-5) << name;
    EXPECT_LT(LargestDrift(mechanism, servo.text), 1e-5) << name;
    const double fall = LargestDrift(mechanism, free.text);
    if (fall < 1e-12) continue;  // its plane is level
    EXPECT_GT(fall, 1e-3) << name;
    ++fallen;
  }
  EXPECT_GE(fallen, 7U);
}

// The servos and not the motors' forces alone: a blow dies away.
TEST(MjcfFor, ServosBringAPushedMechanismBack) {
  for (const char* name : {"four_bar", "stewart"}) {
    const Mechanism mechanism = ModelNamed(name);
    const MjcfText servo = MjcfFor(mechanism, ModelDrives::kServo);
    std::vector<std::string> warnings;
    const EngineSession session(&warnings);
    const simulation::ModelHandle m = simulation::CompileMjcf(servo.text);
    const simulation::DataHandle d = simulation::MakeData(*m);
    mj_resetDataKeyframe(m.get(), d.get(), 0);
    const double load = 0.2 * std::abs(d->ctrl[0]);
    double pushed = 0.0, after = 0.0;
    while (d->time < 2.0) {
      d->ctrl[0] = m->key_ctrl[0] + (d->time < 0.3 ? load : 0.0);
      mj_step(m.get(), d.get());
      const double off = std::abs(d->sensordata[0] - m->key_ctrl[mechanism.drives.size()]);
      (d->time < 0.3 ? pushed : after) = d->time < 0.3 ? std::max(pushed, off) : off;
    }
    EXPECT_GT(pushed, 1e-4) << name;
    EXPECT_LT(after, 0.02 * pushed) << name;
    EXPECT_TRUE(warnings.empty()) << name;
  }
}

TEST(MjcfFor, EveryModelThatIsShippedCompilesInEachFormOrSaysWhyNot) {
  for (const std::string& name : ShippedModelNames()) {
    const Mechanism mechanism = ModelNamed(name);
    for (const ModelDrives drives : {ModelDrives::kFree, ModelDrives::kHeld, ModelDrives::kServo}) {
      const MjcfText mjcf = MjcfFor(mechanism, drives);
      EXPECT_TRUE(drives == ModelDrives::kServo || mjcf.trouble.empty()) << mjcf.trouble;
      if (!mjcf.trouble.empty()) continue;
      std::vector<std::string> warnings;
      const EngineSession session(&warnings);
      EXPECT_NE(simulation::CompileMjcf(mjcf.text), nullptr);
      EXPECT_TRUE(warnings.empty()) << mechanism.name;
    }
  }
}

TEST(MjcfFor, SaysThatDrivesCannotHoldWhatTheyDoNotDrive) {
  Mechanism mechanism = ModelNamed("four_bar");
  mechanism.drives.clear();
  const MjcfText servo = MjcfFor(mechanism, ModelDrives::kServo);
  EXPECT_EQ(servo.text, "");
  EXPECT_NE(servo.trouble.find("cannot hold the home pose"), std::string::npos) << servo.trouble;
}

}  // namespace
}  // namespace mbv
