// Laws of the witnesses as programs: the same twice, never silent about trouble, one model.

#include <cmath>
#include <cstring>

#include "simulation/engine/engine.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/laws/fixture.h"

namespace mbv::laws {
namespace {

class Programs : public ::testing::TestWithParam<std::string> {
 protected:
  [[nodiscard]] const Subject& subject() const { return SubjectOf(GetParam()); }

  // The first samples of the shipped motion.
  [[nodiscard]] Motion Short() const {
    Motion motion = subject().motion;
    motion.loads = subject().scenario.motion.loads;
    motion.duration_s = 5 * motion.sample_s;
    return motion;
  }

  [[nodiscard]] Trace OfSimulation(DriveMode mode) const {
    const Motion motion = Short();
    const auto form = subject().MakeClosedForm();
    CommandSample command;
    const SimulationRun run = Simulate(subject().mechanism, motion,
                                       [&](double t_s, DrivenSample* driven) {
                                         EvaluateMotion(motion, t_s, &command);
                                         return form->Kinematics(command, driven);
                                       },
                                       {.mode = mode});
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_TRUE(run.warnings.empty()) << run.warnings.front();
    return run.trace;
  }
};

// To the last bit, NaN included.
bool Identical(const Trace& a, const Trace& b) {
  if (a.values.rows() != b.values.rows() || a.values.cols() != b.values.cols()) return false;
  return std::memcmp(a.values.data(), b.values.data(),
                     sizeof(double) * static_cast<size_t>(a.values.size())) == 0;
}

TEST_P(Programs, GiveTheSameBitsTwice) {
  const Motion motion = Short();
  const auto closed_form = [&] {
    Subject s = subject();
    s.motion = motion;
    return RunClosedForm(s.mechanism, motion, s.MakeClosedForm().get()).trace;
  };
  const auto reference = [&] { return RunReference(subject().mechanism, motion).trace; };
  const Trace form = closed_form();
  EXPECT_TRUE(form.values.allFinite());
  EXPECT_TRUE(Identical(form, closed_form()));
  EXPECT_TRUE(Identical(reference(), reference()));
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    EXPECT_TRUE(Identical(OfSimulation(mode), OfSimulation(mode)));
  }
  // One unit in the last place of one value is a difference.
  Trace perturbed = form;
  perturbed.values(1, 0) = std::nextafter(perturbed.values(1, 0), 1e300);
  EXPECT_FALSE(Identical(form, perturbed));
}

double MassOf(const Mechanism& m) {
  double mass = 0.0;
  for (const Body& body : m.bodies) mass += body.mass;
  return mass;
}

TEST_P(Programs, WriteMjcfThatLoadsSilentlyWithTheDescribedMass) {
  std::vector<std::string> warnings;
  simulation::EngineSession session(&warnings);
  const simulation::ModelHandle model =
      simulation::CompileMjcf(WriteMjcf(subject().mechanism, {.pictures = false}));
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  double mass = 0.0;
  for (int b = 1; b < model->nbody; ++b) mass += model->body_mass[b];
  const double described = MassOf(subject().mechanism);
  // One addition per body.
  const double rounding = 2 * kEps * described * static_cast<double>(model->nbody);
  EXPECT_NEAR(mass, described, rounding);
  const Mechanism heavier =
      subject().With(subject().Heavier(1 + 3 * rounding / described)).mechanism;
  EXPECT_GT(std::abs(MassOf(heavier) - mass), rounding);
}

// Finite numbers, or a reason with place and amount.
void ExpectAnswerOrReason(const char* witness, const Answer& answer) {
  if (answer.summary.ok()) {
    EXPECT_TRUE(answer.force.allFinite()) << witness;
    EXPECT_TRUE(answer.driven.position.allFinite()) << witness;
    EXPECT_TRUE(answer.driven.velocity.allFinite()) << witness;
    EXPECT_TRUE(answer.driven.acceleration.allFinite()) << witness;
    return;
  }
  EXPECT_NE(answer.summary.stop, Stop::kNotRun) << witness;
  EXPECT_NE(answer.summary.stop, Stop::kEngineFailure) << witness << answer.summary.message;
  EXPECT_FALSE(answer.summary.message.empty()) << witness;
  EXPECT_TRUE(std::isfinite(answer.summary.amount))
      << witness << ": " << answer.summary.message << " has no amount";
}

// Up to the boundary of the closed form's answers in steps that shrink tenfold, across it, and far
// beyond: no witness ever answers with NaN.
TEST_P(Programs, AnswerOrSayWhyNotAtEveryBoundary) {
  CommandSample first;
  EvaluateMotion(subject().motion, 0.0, &first);
  ASSERT_FALSE(BoundariesOf(GetParam()).empty());
  for (const Boundary& boundary : BoundariesOf(GetParam())) {
    ReferenceSolver reference(subject().mechanism, subject().motion);
    for (const double part : {0.5, 0.9, 0.99, 0.999, 1 - 1e-5, 1 - 1e-7, 1 - 1e-10, 1.0, 1 + 1e-10,
                              1 + 1e-6, 1 + 1e-3, 1.2}) {
      SCOPED_TRACE(GetParam() + ": " + subject().motion.commands[boundary.command].name + " at " +
                   std::to_string(part) + " of " + std::to_string(boundary.distance));
      CommandSample c = Displaced(first, boundary.command, part * boundary.distance);
      c.velocity[static_cast<Eigen::Index>(boundary.command)] = 0.1;
      const Answer form = ByClosedForm(subject(), c);
      ExpectAnswerOrReason("closed form", form);
      if (!form.summary.ok()) {
        EXPECT_FALSE(form.summary.where.empty()) << form.summary.message;
      }
      ExpectAnswerOrReason("reference", Ask(&reference, c));
      if (form.summary.ok() && (part == 0.999 || part == 1.0)) {
        ExpectAnswerOrReason("simulation", BySimulation(subject(), form.driven, c));
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Programs, ::testing::ValuesIn(SubjectNames()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace mbv::laws
