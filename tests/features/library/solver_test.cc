// The solver object against closed forms, against itself, and with wrong arguments.
#include "mbverify/solver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <random>

#include "analytic/closed_form.h"
#include "base/text.h"
#include "kinematics/command_rank.h"
#include "mechanism/mechanism.h"
#include "scenario/load_scenario.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/shipped.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string ModelPath(const std::string& name) {
  return SourcePath("/models/" + name + "/model.yaml");
}

// What a call complains of; "" where it does not.
template <typename Call>
std::string ComplaintOf(const Call& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

testing::AssertionResult Done(const Status& status) {
  return status.ok() ? testing::AssertionSuccess() : testing::AssertionFailure() << status.message;
}
testing::AssertionResult Done(const BatchStatus& status) {
  return status.ok() ? testing::AssertionSuccess() : Done(status.failed.front().second);
}

class Random {
 public:
  explicit Random(unsigned seed) : generator_(seed) {}
  VecX operator()(Eigen::Index n, double size) {
    std::uniform_real_distribution<double> at(-size, size);
    return VecX::NullaryExpr(n, [&] { return at(generator_); });
  }

 private:
  std::mt19937 generator_;
};

// Independent coordinates of a model: its drives as far as they are, otherwise joints.
std::vector<std::string> IndependentOf(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> all = NamedCommandCoordinates(mechanism);
  std::erase_if(all, [](const NamedCoordinate& named) {
    return named.coordinate.kind == Coordinate::Kind::kOutput;
  });
  const size_t preferred = all.size();
  for (NamedCoordinate& joint : NamedJointCoordinates(mechanism)) {
    if (!mbv::Contains(NamesOf(all), joint.name)) all.push_back(std::move(joint));
  }
  std::vector<Coordinate> candidates;
  candidates.reserve(all.size());
  for (const NamedCoordinate& named : all) candidates.push_back(named.coordinate);
  std::vector<std::string> names;
  for (const size_t k : ChooseCoordinates(mechanism, candidates, preferred).chosen) {
    if (all[k].coordinate.kind != Coordinate::Kind::kPrescribed) names.push_back(all[k].name);
  }
  return names;
}

struct PaperCase {
  const char *model, *scenario;
};

class SolverOfPaper : public testing::TestWithParam<PaperCase> {
 protected:
  SolverOfPaper()
      : loaded_(LoadScenario(
            SourcePath(std::string("/scenarios/") + GetParam().model + "/" + GetParam().scenario))),
        mechanism_(*loaded_.mechanism),
        motion_(loaded_.scenario->motion) {
    Diagnostics diagnostics;
    form_ = FindClosedForm(mechanism_.name)->factory(mechanism_, motion_, {}, &diagnostics);
    EXPECT_TRUE(form_) << diagnostics.Text();
    const std::vector<NamedCoordinate> all = NamedCommandCoordinates(mechanism_);
    for (const Command& command : motion_.commands) {
      by_command_ &= command.terms.size() == 1;
      for (const NamedCoordinate& named : all) {
        const Coordinate &a = named.coordinate, &b = command.terms.front().coordinate;
        if (a.kind == b.kind && a.index == b.index && a.component == b.component) {
          names_.push_back(named.name);
        }
      }
    }
    EXPECT_EQ(names_.size(), motion_.commands.size());
    if (by_command_) return;
    // Where commands couple coordinates: all that is driven.
    names_ = NamesOf(mechanism_.drives);
    for (const Prescribed& prescribed : mechanism_.prescribed) names_.push_back(prescribed.name);
  }

  // The same in the solver's coordinates.
  CommandSample Chosen(const CommandSample& command) {
    if (by_command_) return command;
    const DrivenSample driven = ByClosedForm(command);
    CommandSample chosen = command;
    chosen.position = driven.position;
    chosen.velocity = driven.velocity;
    chosen.acceleration = driven.acceleration;
    return chosen;
  }

  [[nodiscard]] std::vector<Wrench> Loads(const CommandSample& command) const {
    std::vector<Wrench> loads;
    for (const LoadSample& load : command.loads) {
      loads.push_back({mechanism_.bodies[static_cast<size_t>(load.body)].name, load.p_BoQ_B,
                       load.force, load.moment});
    }
    return loads;
  }

  // A pose of the scenario, where it can be with any rates and accelerations.
  CommandSample At(double share, Random* random) const {
    CommandSample command;
    EvaluateMotion(motion_, share * motion_.duration_s, &command);
    const Eigen::Index n = command.position.size();
    if (!by_command_) return command;  // what is coupled or level stays so
    command.velocity = (*random)(n, 0.5);
    command.acceleration = (*random)(n, 2.0);
    return command;
  }

  DrivenSample ByClosedForm(const CommandSample& command) {
    DrivenSample driven;
    EXPECT_TRUE(form_->Kinematics(command, &driven).ok());
    return driven;
  }

  ScenarioResult loaded_;
  const Mechanism& mechanism_;
  const Motion& motion_;
  std::unique_ptr<ClosedForm> form_;
  std::vector<std::string> names_;
  bool by_command_ = true;  ///< each command is one coordinate
};

constexpr double kAgainstClosedForm = 1e-10;  // relative, as for the rates of a run

double Worst(const VecX& a, const VecX& b) {
  return (a - b).cwiseAbs().maxCoeff() / std::max(1.0, b.cwiseAbs().maxCoeff());
}

TEST_P(SolverOfPaper, MovesItsDrivesAndNeedsItsForcesAsTheClosedForm) {
  Solver solver(Model::Load(ModelPath(GetParam().model)), names_);
  Random random(7);
  for (const double share : {0.0, 0.13, 0.37, 0.52, 0.81}) {
    const CommandSample command = At(share, &random), chosen = Chosen(command);
    ClosedFormSample expected;
    const RunSummary summary = form_->Dynamics(command, &expected);
    ASSERT_TRUE(summary.ok()) << summary.message;
    State state;
    ASSERT_TRUE(Done(solver.Move(chosen.position, chosen.velocity, chosen.acceleration, &state)));
    const auto drives = state.drives.size();
    EXPECT_LT(Worst(state.drives, expected.driven.position.head(drives)), kAgainstClosedForm);
    EXPECT_LT(Worst(state.drive_rates, expected.driven.velocity.head(drives)), kAgainstClosedForm);
    EXPECT_LT(Worst(state.drive_accelerations, expected.driven.acceleration.head(drives)),
              kAgainstClosedForm);
    // What is commanded of an output's place comes out, whatever the solver's coordinates are.
    for (size_t k = 0; k < motion_.commands.size(); ++k) {
      const Coordinate& c = motion_.commands[k].terms.front().coordinate;
      if (c.kind != Coordinate::Kind::kOutput || motion_.commands[k].terms.size() > 1) continue;
      const auto at = static_cast<Eigen::Index>(k);
      EXPECT_NEAR(state.outputs(c.index, c.component), command.position[at], kAgainstClosedForm);
      const Output& output = mechanism_.outputs[static_cast<size_t>(c.index)];
      if (c.component > 2 || output.reference_body != 0 || !output.X_BO.translation().isZero()) {
        continue;
      }
      EXPECT_NEAR(state.twists(output.body, 3 + c.component), command.velocity[at],
                  kAgainstClosedForm);
      EXPECT_NEAR(state.accelerations(output.body, 3 + c.component), command.acceleration[at],
                  10 * kAgainstClosedForm);
    }
    Forces forces;
    ASSERT_TRUE(Done(solver.InverseDynamics(chosen.position, chosen.velocity, chosen.acceleration,
                                            Loads(command), &forces)));
    EXPECT_LT(Worst(forces.drives, expected.force), kAgainstClosedForm);
  }
}

// First derivatives: drives per coordinate. Second ones: what unit rates, alone and in pairs, do to
// the drives without accelerations.
TEST_P(SolverOfPaper, HasTheClosedFormsDerivatives) {
  if (!by_command_) return;  // its coordinates are the drives
  Solver solver(Model::Load(ModelPath(GetParam().model)), names_);
  Random random(11);
  const Eigen::Index n = solver.size();
  for (const double share : {0.0, 0.29, 0.66}) {
    CommandSample command = At(share, &random);
    command.acceleration.setZero();
    MatX J;
    ASSERT_TRUE(Done(solver.DriveJacobian(command.position, &J)));
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        command.velocity = VecX::Unit(n, i);
        if (j < i) command.velocity[j] = 1.0;
        const DrivenSample expected = ByClosedForm(command);
        EXPECT_LT(Worst(J * command.velocity, expected.velocity.head(J.rows())),
                  kAgainstClosedForm);
        State state;
        ASSERT_TRUE(
            Done(solver.Move(command.position, command.velocity, command.acceleration, &state)));
        EXPECT_LT(Worst(state.drive_accelerations, expected.acceleration.head(J.rows())),
                  kAgainstClosedForm);
        // T and H give the same accelerations of all bodies.
        MatX T, H;
        ASSERT_TRUE(Done(solver.Derivatives(command.position, &T, &H)));
        VecX pairs(n * n);
        for (Eigen::Index k = 0; k < n * n; ++k) {
          pairs[k] = command.velocity[k / n] * command.velocity[k % n];
        }
        const MatX A = state.accelerations.bottomRows(state.accelerations.rows() - 1);
        const VecX stacked = Eigen::Map<const VecX>(MatX(A.transpose()).data(), A.size());
        EXPECT_LT(Worst(H * pairs, stacked), kAgainstClosedForm);
      }
    }
  }
}

// What is compared notices a number that is wrong by a millionth.
TEST_P(SolverOfPaper, NoticesAPerturbedModel) {
  const Model shipped = Model::Load(ModelPath(GetParam().model));
  Random random(3);
  const CommandSample command = Chosen(At(0.3, &random));
  const auto forces_of = [&](Solver solver, VecX* forces) {
    Forces all;
    const Status status =
        solver.InverseDynamics(command.position, command.velocity, command.acceleration, {}, &all);
    *forces = all.drives;
    return status;
  };
  VecX exact, forces;
  ASSERT_TRUE(Done(forces_of(Solver(shipped, names_), &exact)));
  int noticed = 0;
  for (const Parameter& parameter : shipped.mechanism().parameters) {
    std::optional<Model> perturbed;
    try {
      perturbed = Model::Load(shipped.file(), {{parameter.name, parameter.value * (1 + 1e-6)}});
    } catch (const InputError&) {
      continue;  // it has to suit others
    }
    const Status status = forces_of(Solver(*perturbed, names_), &forces);
    if (status.ok() && Worst(forces, exact) > 10 * kAgainstClosedForm) ++noticed;
  }
  EXPECT_GE(noticed, 5);
}

INSTANTIATE_TEST_SUITE_P(All, SolverOfPaper,
                         testing::Values(PaperCase{"spr_tripod", "harmonic.yaml"},
                                         PaperCase{"cabin_robot", "default.yaml"},
                                         PaperCase{"scara_robot", "default.yaml"},
                                         PaperCase{"stabilizing_platform", "sea_state.yaml"}),
                         [](const auto& info) { return std::string(info.param.model); });

class SolverOfModel : public testing::TestWithParam<std::string> {
 protected:
  SolverOfModel()
      : model_(Model::Load(IsRobotFile(GetParam()) ? GetParam() : ModelPath(GetParam()))),
        solver_(model_, IndependentOf(model_.mechanism())) {}

  // A pose near home that the solver reaches.
  VecX Near(Random* random) {
    const VecX home = solver_.home();
    State state;
    for (double size = 0.03; size > 1e-4; size *= 0.5) {
      VecX q = home + (*random)(home.size(), size);
      if (solver_.Close(q, &state).ok()) return q;
    }
    ADD_FAILURE() << "no pose near home closes";
    return home;
  }

  Model model_;
  Solver solver_;
};

constexpr double kRoundOff = 1e-12;  // of sums of a few hundred terms

TEST_P(SolverOfModel, MassMatrixAndBiasAreTheInverseDynamicsOfUnitAccelerations) {
  Random random(5);
  const Eigen::Index n = solver_.size();
  const VecX q = Near(&random);
  MatX M, J;
  ASSERT_TRUE(Done(solver_.MassMatrix(q, &M)));
  ASSERT_TRUE(Done(solver_.DriveJacobian(q, &J)));
  // Kinetic energy is not negative.
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(M);
  EXPECT_GE(eigen.eigenvalues().minCoeff(), -kRoundOff * M.cwiseAbs().maxCoeff());
  VecX v = random(n, 1.0), bias, gravity;
  const Status status = solver_.Bias(q, v, &bias);
  if (!status.ok()) {
    // Then at rest, where friction counts as none.
    EXPECT_EQ(status.kind, Status::Kind::kUnsupported) << status.message;
    EXPECT_THAT(status.message, HasSubstr("grows with its load"));
    return;
  }
  ASSERT_TRUE(Done(solver_.Gravity(q, &gravity)));
  Forces forces;
  if (J.fullPivLu().rank() < n) {
    const Status free = solver_.InverseDynamics(q, v, VecX::Zero(n), {}, &forces);
    EXPECT_EQ(free.kind, Status::Kind::kSingular) << "drives do not hold it";
    return;
  }
  const double size = std::max({M.cwiseAbs().maxCoeff(), bias.cwiseAbs().maxCoeff(), 1e-6});
  for (Eigen::Index i = 0; i < n; ++i) {
    ASSERT_TRUE(Done(solver_.InverseDynamics(q, v, VecX::Unit(n, i), {}, &forces)));
    EXPECT_LT((M.col(i) - (forces.coordinates - bias)).cwiseAbs().maxCoeff(), kRoundOff * size);
    EXPECT_LT((J.transpose() * forces.drives - forces.coordinates).cwiseAbs().maxCoeff(),
              1e-9 * std::max(size, forces.drives.cwiseAbs().maxCoeff()));
  }
  ASSERT_TRUE(Done(solver_.InverseDynamics(q, VecX::Zero(n), VecX::Zero(n), {}, &forces)));
  EXPECT_LT((gravity - forces.coordinates).cwiseAbs().maxCoeff(), kRoundOff * size);
}

// H against central differences of T.
TEST_P(SolverOfModel, SecondDerivativesAreThoseOfTheFirst) {
  Random random(6);
  const Eigen::Index n = solver_.size();
  const VecX q = Near(&random), v = random(n, 1.0);
  MatX T, H;
  ASSERT_TRUE(Done(solver_.Derivatives(q, &T, &H)));
  // Differences over two steps, of which the better is extrapolated: truncation ~ step⁴.
  const auto slope = [&](double step) -> MatX {
    MatX ahead, behind, unused;
    EXPECT_TRUE(Done(solver_.Derivatives(q + step * v, &ahead, &unused)));
    EXPECT_TRUE(Done(solver_.Derivatives(q - step * v, &behind, &unused)));
    return (ahead - behind) / (2 * step);
  };
  const MatX far = slope(2e-5), near = slope(1e-5);
  VecX pairs(n * n);
  for (Eigen::Index k = 0; k < n * n; ++k) pairs[k] = v[k / n] * v[k % n];
  const VecX expected = (4.0 * near - far) / 3.0 * v;
  const double size = std::max({expected.cwiseAbs().maxCoeff(), T.cwiseAbs().maxCoeff(), 1.0});
  // Rounding ~ 1e-16/step; curvature grows near singular poses.
  EXPECT_LT((H * pairs - expected).cwiseAbs().maxCoeff(), 1e-7 * size);
}

// A body's Jacobian gives its twist, an output's the rates of its pose.
TEST_P(SolverOfModel, JacobiansGiveTheTwistsOfItsBodiesAndOutputs) {
  Random random(8);
  const VecX q = Near(&random), v = random(solver_.size(), 1.0);
  State state;
  ASSERT_TRUE(Done(solver_.Move(q, v, VecX::Zero(v.size()), &state)));
  const std::vector<std::string> bodies = model_.bodies();
  MatX J;
  for (size_t b = 1; b < bodies.size(); ++b) {
    if (mbv::Contains(model_.outputs(), bodies[b])) continue;  // that is meant
    ASSERT_TRUE(Done(solver_.Jacobian(q, bodies[b], &J)));
    const VecX twist = state.twists.row(static_cast<Eigen::Index>(b)).transpose();
    EXPECT_LT((J * v - twist).cwiseAbs().maxCoeff(),
              1e-11 * std::max(1.0, twist.cwiseAbs().maxCoeff()))
        << bodies[b];
  }
  const double step = 1e-6;
  State ahead, behind;
  ASSERT_TRUE(Done(solver_.Close(q + step * v, &ahead)));
  ASSERT_TRUE(Done(solver_.Close(q - step * v, &behind)));
  for (size_t o = 0; o < model_.outputs().size(); ++o) {
    const auto row = static_cast<Eigen::Index>(o);
    ASSERT_TRUE(Done(solver_.Jacobian(q, model_.outputs()[o], &J)));
    const VecX rates = (ahead.outputs.row(row) - behind.outputs.row(row)).transpose() / (2 * step);
    const Vec3 velocity = (J * v).tail<3>();
    EXPECT_LT((velocity - rates.head<3>()).cwiseAbs().maxCoeff(),
              1e-7 * std::max(1.0, rates.cwiseAbs().maxCoeff()))
        << model_.outputs()[o];
  }
}

TEST_P(SolverOfModel, ForwardDynamicsUndoesTheInverse) {
  Random random(9);
  const Eigen::Index n = solver_.size();
  const VecX q = Near(&random), v = random(n, 1.0), a = random(n, 3.0);
  Forces forces;
  MatX M, J;
  ASSERT_TRUE(Done(solver_.MassMatrix(q, &M)));
  ASSERT_TRUE(Done(solver_.DriveJacobian(q, &J)));
  if (J.fullPivLu().rank() < n) return;  // no forces give any motion
  ASSERT_TRUE(Done(solver_.InverseDynamics(q, v, a, {}, &forces)));
  VecX found;
  const Status status = solver_.ForwardDynamics(q, v, forces.drives, {}, &found);
  if (!status.ok()) {
    EXPECT_TRUE(status.kind == Status::Kind::kUnsupported || status.kind == Status::Kind::kSingular)
        << status.message;
    EXPECT_THAT(status.message,
                testing::AnyOf(HasSubstr("grows with its load"), HasSubstr("moves no mass")));
    return;
  }
  EXPECT_LT((M * (found - a)).cwiseAbs().maxCoeff(),
            1e-9 * (J.transpose() * forces.drives).cwiseAbs().maxCoeff());
}

// Without drives for all of them, too: energy and work of a motion without forces.
TEST_P(SolverOfModel, FreeAccelerationsBalanceTheBias) {
  Random random(13);
  const Eigen::Index n = solver_.size();
  const VecX q = Near(&random), v = random(n, 1.0);
  MatX M;
  VecX bias, a;
  ASSERT_TRUE(Done(solver_.MassMatrix(q, &M)));
  if (!solver_.Bias(q, v, &bias).ok()) return;  // friction by load: as above
  const VecX none = VecX::Zero(static_cast<Eigen::Index>(model_.drives().size()));
  if (!solver_.ForwardDynamics(q, v, none, {}, &a).ok()) return;
  EXPECT_LT((M * a + bias).cwiseAbs().maxCoeff(),
            1e-9 * std::max(1e-9, bias.cwiseAbs().maxCoeff()));
}

// Calls in any order leave no trace in each other's results.
TEST_P(SolverOfModel, AStateDoesNotDependOnWhatWasAskedBefore) {
  Random random(10);
  const Eigen::Index n = solver_.size();
  const VecX q = Near(&random), v = random(n, 1.0), a = random(n, 1.0);
  State before, after;
  ASSERT_TRUE(Done(solver_.Move(q, v, a, &before)));
  MatX T, H, M;
  ASSERT_TRUE(Done(solver_.Derivatives(q, &T, &H)));
  ASSERT_TRUE(Done(solver_.MassMatrix(q, &M)));
  ASSERT_TRUE(Done(solver_.Move(q, v, a, &after)));
  EXPECT_LT((before.accelerations - after.accelerations).cwiseAbs().maxCoeff(),
            1e-9 * std::max(1.0, before.accelerations.cwiseAbs().maxCoeff()));
  EXPECT_LT((before.drives - after.drives).norm(), 1e-12 * std::max(1.0, before.drives.norm()));
}

INSTANTIATE_TEST_SUITE_P(All, SolverOfModel, testing::ValuesIn(ShippedModelNames()),
                         [](const auto& info) { return info.param; });

// The same of public robots, of which the project has none: URDF and MJCF files below the
// folder $MBVERIFY_ROBOTS that can be loaded.
std::vector<std::string> OtherRobots() {
  const char* folder = std::getenv("MBVERIFY_ROBOTS");
  std::vector<std::string> robots;
  if (folder == nullptr) return robots;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (!IsRobotFile(entry.path())) continue;
    const LoadResult loaded = LoadRobot(entry.path());
    if (loaded.mechanism && !IndependentOf(*loaded.mechanism).empty()) {
      robots.push_back(entry.path());
    }
  }
  std::ranges::sort(robots);
  return robots;
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(SolverOfModel);
INSTANTIATE_TEST_SUITE_P(Others, SolverOfModel, testing::ValuesIn(OtherRobots()));

TEST(Solver, TakesAPassiveJointOrAnOutputAsCoordinate) {
  const Model model = Model::Load(ModelPath("four_bar"));
  ASSERT_EQ(model.degrees_of_freedom(), 1);
  // Of each in its own: the mass that a coordinate moves is that of the crank by the ratio squared.
  Solver by_drive(model);
  State state;
  MatX M;
  ASSERT_TRUE(Done(by_drive.MassMatrix(by_drive.home(), &M)));
  int chosen = 0;
  for (const std::string& name : model.coordinates()) {
    std::optional<Solver> solver;
    try {
      solver.emplace(model, std::vector<std::string>{name});
    } catch (const std::invalid_argument&) {
      continue;  // it does not move
    }
    ++chosen;
    MatX other, J;
    ASSERT_TRUE(Done(solver->MassMatrix(solver->home(), &other)));
    ASSERT_TRUE(Done(solver->DriveJacobian(solver->home(), &J)));
    EXPECT_NEAR(other(0, 0), M(0, 0) * J(0, 0) * J(0, 0), 1e-10 * other(0, 0)) << name;
  }
  EXPECT_GE(chosen, 4);
}

TEST(Solver, NamesCoordinatesThatDependOnEachOther) {
  const Model model = Model::Load(ModelPath("stewart"));
  const auto complaint = [&](const std::vector<std::string>& names) {
    return ComplaintOf([&] { const Solver solver(model, names); });
  };
  std::vector<std::string> names = model.drives();
  ASSERT_EQ(names.size(), 6U);
  EXPECT_EQ(complaint(names), "");
  std::vector<std::string> more = names;
  more.emplace_back("platform.z");
  EXPECT_THAT(complaint(more), HasSubstr("platform.z"));
  EXPECT_THAT(complaint(more), HasSubstr("too many"));
  names.pop_back();
  EXPECT_THAT(complaint(names), HasSubstr("6 degrees of freedom, of which 5"));
  EXPECT_THAT(complaint(names), HasSubstr("a set that does"));
  names.push_back(names.front());
  EXPECT_THAT(complaint(names), HasSubstr("chosen twice"));
  names.back() = "platform.zz";
  EXPECT_THAT(complaint(names), HasSubstr("did you mean 'platform.z'"));
}

TEST(Solver, RefusesWrongArguments) {
  const Model model = Model::Load(ModelPath("stewart"));
  Solver solver(model);
  State state;
  Forces forces;
  VecX q = solver.home(), a;
  const VecX zero = VecX::Zero(6);
  EXPECT_THAT(ComplaintOf([&] { (void)solver.Close(VecX::Zero(5), &state); }),
              HasSubstr("q has 5 values, not 6"));
  q[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ComplaintOf([&] { (void)solver.Close(q, &state); }),
              HasSubstr("q[2] is not a finite number"));
  q = solver.home();
  EXPECT_THAT(ComplaintOf([&] { (void)solver.Move(q, VecX(), zero, &state); }),
              HasSubstr("v has 0 values"));
  Wrench wrench;
  wrench.body = "platfrom";
  EXPECT_THAT(ComplaintOf([&] { (void)solver.InverseDynamics(q, zero, zero, {wrench}, &forces); }),
              HasSubstr("has no body 'platfrom'"));
  wrench.body = model.bodies().back();
  wrench.force[1] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(ComplaintOf([&] { (void)solver.InverseDynamics(q, zero, zero, {wrench}, &forces); }),
              HasSubstr("not finite"));
  MatX J;
  EXPECT_THAT(ComplaintOf([&] { (void)solver.Jacobian(q, "plattform", &J); }),
              HasSubstr("has no output, body or frame"));
  EXPECT_THAT(ComplaintOf([&] { (void)solver.ForwardDynamics(q, zero, VecX::Zero(2), {}, &a); }),
              HasSubstr("drive_forces has 2 values, not 6"));
  // What a message leaves behind is usable.
  EXPECT_TRUE(Done(solver.Close(q, &state)));
}

TEST(Solver, SaysWhatItCannotReachAndGoesOnFromHome) {
  const Model model = Model::Load(ModelPath("four_bar"));
  Solver solver(model, {model.outputs().front() + ".x"});
  State state, again;
  const VecX home = solver.home();
  ASSERT_TRUE(Done(solver.Close(home, &state)));
  const Status status = solver.Close(home.array() + 100.0, &again);
  EXPECT_EQ(status.kind, Status::Kind::kUnreachable) << status.message;
  EXPECT_FALSE(status.message.empty());
  ASSERT_TRUE(Done(solver.Close(home, &again)));
  EXPECT_EQ(state.drives, again.drives);
}

TEST(Solver, AModelMayGoOutOfScope) {
  std::optional<Solver> solver;
  {
    const Model model = Model::Load(ModelPath("slider_crank"));
    solver.emplace(model);
  }
  State state;
  EXPECT_TRUE(Done(solver->Close(solver->home(), &state)));
  EXPECT_EQ(solver->model().name(), "slider_crank");
}

TEST(Solver, LoadsAreWhatHoldsThem) {
  const Model model = Model::Load(ModelPath("stewart"));
  Solver solver(model);
  const VecX q = solver.home(), zero = VecX::Zero(6);
  Forces without, with;
  Wrench weight;
  weight.body =
      model.mechanism().bodies[static_cast<size_t>(model.mechanism().outputs.front().body)].name;
  weight.force = Eigen::Vector3d(3, -2, -100);
  ASSERT_TRUE(Done(solver.InverseDynamics(q, zero, zero, {}, &without)));
  ASSERT_TRUE(Done(solver.InverseDynamics(q, zero, zero, {weight}, &with)));
  MatX J;
  ASSERT_TRUE(Done(solver.Jacobian(q, weight.body, &J)));
  Vec6 wrench;
  wrench << 0, 0, 0, weight.force;
  const VecX expected = -J.transpose() * wrench;
  EXPECT_LT(((with.drives - without.drives) - expected).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Model, ThatIsNoneIsExplained) {
  try {
    (void)Model::Load("stewrat");
    FAIL();
  } catch (const InputError& error) {
    ASSERT_EQ(error.notes().size(), 1U);
    EXPECT_THAT(error.notes().front().hint, HasSubstr("stewart"));
    EXPECT_THAT(error.what(), HasSubstr("no such model"));
  }
  const test::TestFolder folder("library_model");
  const std::string file = folder.Write("model.yaml", "name: x\nbodies: 3\njoints: {}\n");
  try {
    (void)Model::Load(file);
    FAIL();
  } catch (const InputError& error) {
    ASSERT_GE(error.notes().size(), 1U);
    EXPECT_EQ(error.notes().front().line, 2);
    EXPECT_TRUE(error.notes().front().is_error);
  }
}

class SolverRows : public testing::Test {
 protected:
  SolverRows() : model_(Model::Load(ModelPath("stewart"))), solver_(model_) {
    const Eigen::Index rows = 2 * Solver::kBlock + 31;
    Random random(12);
    q_.resize(rows, 6), v_.resize(rows, 6), a_.resize(rows, 6);
    for (Eigen::Index i = 0; i < rows; ++i) {
      q_.row(i) = (solver_.home() + random(6, 0.05)).transpose();
      v_.row(i) = random(6, 0.5).transpose();
      a_.row(i) = random(6, 2.0).transpose();
    }
  }
  Model model_;
  Solver solver_;
  MatX q_, v_, a_;
};

TEST_F(SolverRows, DoNotDependOnThreads) {
  MatX one, three, drives;
  ASSERT_TRUE(Done(solver_.InverseDynamicsRows(q_, v_, a_, &one, 1)));
  ASSERT_TRUE(Done(solver_.InverseDynamicsRows(q_, v_, a_, &three, 3)));
  EXPECT_EQ(one, three);
  ASSERT_TRUE(Done(solver_.CloseRows(q_, &drives)));
  EXPECT_LT((drives - q_).cwiseAbs().maxCoeff(), 1e-10);
  // And are what single calls give.
  for (const Eigen::Index i : {0L, 300L, q_.rows() - 1}) {
    Forces forces;
    ASSERT_TRUE(Done(solver_.InverseDynamics(q_.row(i).transpose(), v_.row(i).transpose(),
                                             a_.row(i).transpose(), {}, &forces)));
    EXPECT_LT(Worst(one.row(i).transpose(), forces.drives), 1e-9);
  }
}

// Weights that the drives' own forces carry.
constexpr const char* kLifted = R"(name: lifted
bodies:
  cart: {mass: 3, com: [0.1, 0, 0], inertia: [0.1, 0.1, 0.1], gravity_compensation: 0.5}
  arm: {mass: 2, com: [0.2, 0, 0], inertia: [0.1, 0.1, 0.1], gravity_compensation: 1}
joints:
  slide: {kind: prismatic, parent: world, child: cart, axis: z}
  hinge: {kind: revolute, parent: cart, child: arm, axis: y}
drives:
  lift: {kind: joint, joint: slide, gravity_compensation: true}
  turn: {kind: joint, joint: hinge, gravity_compensation: true}
)";

// After the first samples of a block, whatever the joints, force elements, couplings and
// compensations are; "" is kLifted.
class SolverAllocations : public testing::TestWithParam<std::string> {};

TEST_P(SolverAllocations, OfRowsDoNotGrowWithTheirNumber) {
  const test::TestFolder folder("solver_allocations");
  const std::string& name = GetParam();
  const Model model =
      Model::Load(name.empty() ? folder.Write("lifted.yaml", kLifted) : ModelPath(name));
  const Solver solver(model, IndependentOf(model.mechanism()));
  const Eigen::Index n = solver.size(), rows = Solver::kBlock;
  Random random(5);
  MatX q(rows, n), v(rows, n), a(rows, n);
  for (Eigen::Index i = 0; i < rows; ++i) {
    q.row(i) = (solver.home() + random(n, 1e-3)).transpose();
    v.row(i) = random(n, 0.5).transpose();
    a.row(i) = random(n, 2.0).transpose();
  }
  const auto count = [&](Eigen::Index some) {
    MatX forces;
    const MatX q_some = q.topRows(some), v_some = v.topRows(some), a_some = a.topRows(some);
    const size_t before = AllocationCount();
    EXPECT_TRUE(Done(solver.InverseDynamicsRows(q_some, v_some, a_some, &forces, 1)));
    return AllocationCount() - before;
  };
  (void)count(rows);
  EXPECT_EQ(count(rows), count(rows / 8));
}

INSTANTIATE_TEST_SUITE_P(Each, SolverAllocations,
                         testing::Values("stewart", "stabilizing_platform", "spr_tripod",
                                         "scara_robot", "cabin_robot", "redundant_five_bar",
                                         "geared_press", "friction_five_bar", "bushed_linkage",
                                         ""));

TEST_F(SolverRows, NameTheOnesThatFail) {
  MatX expected, forces;
  ASSERT_TRUE(Done(solver_.InverseDynamicsRows(q_, v_, a_, &expected, 2)));
  q_(5, 0) += 50.0;
  q_(400, 3) += 50.0;
  const BatchStatus status = solver_.InverseDynamicsRows(q_, v_, a_, &forces, 2);
  ASSERT_EQ(status.failed.size(), 2U);
  EXPECT_EQ(status.failed[0].first, 5);
  EXPECT_EQ(status.failed[1].first, 400);
  EXPECT_FALSE(status.failed[1].second.message.empty());
  EXPECT_TRUE(forces.row(5).array().isNaN().all());
  EXPECT_LT(Worst(forces.row(6).transpose(), expected.row(6).transpose()), 1e-9);
}

TEST_F(SolverRows, EndOnRequest) {
  MatX drives;
  Eigen::Index reported = 0;
  const BatchStatus status = solver_.CloseRows(q_, &drives, 1, [&](Eigen::Index done) {
    reported = done;
    return false;
  });
  EXPECT_EQ(reported, q_.rows());
  ASSERT_EQ(status.failed.size(), static_cast<size_t>(q_.rows() - Solver::kBlock));
  EXPECT_THAT(status.failed.front().second.message, HasSubstr("interrupted"));
  EXPECT_TRUE(std::isfinite(drives(0, 0)));
  EXPECT_TRUE(std::isnan(drives(Solver::kBlock, 0)));
}

TEST_F(SolverRows, OfAWrongShapeAreRefused) {
  MatX drives;
  EXPECT_THAT(ComplaintOf([&] { (void)solver_.CloseRows(q_.leftCols(4), &drives); }),
              HasSubstr("× 4 values, not"));
  EXPECT_THAT(
      ComplaintOf([&] { (void)solver_.InverseDynamicsRows(q_, v_.topRows(3), a_, &drives); }),
      HasSubstr("v has 3 × 6"));
  q_(7, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(ComplaintOf([&] { (void)solver_.CloseRows(q_, &drives); }),
              HasSubstr("q[7] is not finite"));
}

}  // namespace
}  // namespace mbv
