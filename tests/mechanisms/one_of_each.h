// Shipped models with one of each force element and load, at random states, whose forces have
// derivatives.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "kinematics/command_rank.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "tests/support/shipped.h"
#include "tests/support/source_dir.h"

namespace mbv::fixtures {

inline Mechanism ModelAt(const std::string& path) {
  LoadResult loaded = LoadModel(SourcePath(path));
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// Elements that act on whatever a model has, as far as it has it, with loads of every kind.
inline void AddOneOfEach(Mechanism* m) {
  int count = 0;
  for (size_t j = 0; j < m->joints.size(); ++j) {
    for (int c = 0; c < DofsOf(m->joints[j].kind); ++c) {
      ForceElement element{.name = "e" + std::to_string(count),
                           .joint = static_cast<int>(j),
                           .coordinate = c,
                           .law = DampingLaw{.damping = 0.3}};
      switch (count++ % 7) {
        case 1:
          element.law = SpringLaw{.polynomial = {9.0, 5.0, 40.0}, .free = 0.1, .preload = 0.7};
          break;
        case 2:
          element.law = RotorLaw{.inertia = 2e-3, .ratio = 6.0};
          break;
        case 3:
          element.law = RotorLaw{.inertia = 1e-3,
                                 .ratio = 20.0,
                                 .carrier = RotorAxis{m->joints[j].parent, Vec3(0.6, 0.0, 0.8)}};
          break;
        case 4:
          element.law = FrictionLaw{
              .coulomb = 0.7, .breakaway = 0.9, .stribeck_rate = 0.2, .resists = count > 7 ? 1 : 0};
          break;
        case 5:  // in touch at home
          element.law = StopLaw{.lower = m->joints[j].home[static_cast<size_t>(c)] + 0.3,
                                .stiffness = 20.0,
                                .exponent = 1.5,
                                .dissipation = 0.1};
          break;
        case 6:
          element.law = CurveLaw{
              .of_rate = c > 0,
              .knots = {{-4.0, 3.0, 0.0, -0.4}, {0.3, 0.5, -1.0, -1.0}, {5.0, -2.0, -0.5, 0.0}}};
          break;
        default:
          break;
      }
      const bool ball = IsOfBall(m->joints[j].kind, c);
      // A ball's position is none, and a rotor on it has no carrier.
      const auto* rotor = std::get_if<RotorLaw>(&element.law);
      if (ball &&
          (std::holds_alternative<SpringLaw>(element.law) ||
           std::holds_alternative<StopLaw>(element.law) ||
           std::holds_alternative<CurveLaw>(element.law) || (rotor != nullptr && rotor->carrier))) {
        element.law = DampingLaw{.damping = 0.2};
      }
      if (rotor != nullptr && rotor->carrier && rotor->carrier->body == 0) {
        element.law = RotorLaw{.inertia = 1e-3, .ratio = 20.0};
      }
      m->elements.push_back(element);
    }
  }
  const auto last = static_cast<int>(m->bodies.size()) - 1;
  SpringDamper line;
  line.name = "line";
  line.p_from = Vec3(3.1, -2.2, 1.7);
  line.body_to = last;
  line.p_to = Vec3(0.01, 0.02, 0.03);
  line.stiffness = 50.0, line.free_length_m = 0.4, line.damping = 3.0;
  m->springs.push_back(line);
  m->elements.push_back({.name = "buffer",
                         .spring = static_cast<int>(m->springs.size()) - 1,
                         .law = StopLaw{.upper = 0.5, .stiffness = 30.0, .damping = 0.4}});
  if (m->bodies.size() > 2) {
    Bushing bushing;
    bushing.name = "bush", bushing.parent = 1, bushing.child = last;
    bushing.X_PF = Pose(Eigen::AngleAxisd(0.4, Vec3(1, 2, 3).normalized()));
    m->bushings.push_back(bushing);
    for (int c = 0; c < 6; ++c) {
      m->elements.push_back({.name = "bush" + std::to_string(c),
                             .coordinate = c,
                             .bushing = static_cast<int>(m->bushings.size()) - 1,
                             .law = SpringLaw{.polynomial = {3.0 + c}, .free = 0.0}});
      m->elements.push_back({.name = "oil" + std::to_string(c),
                             .coordinate = c,
                             .bushing = static_cast<int>(m->bushings.size()) - 1,
                             .law = DampingLaw{.damping = 0.1 + 0.02 * c}});
    }
  }
  for (size_t b = 1; b < m->bodies.size(); ++b) {
    m->bodies[b].gravity_compensation = 0.05 * static_cast<double>(b % 7);
  }
  for (Drive& drive : m->drives) {
    const auto* on = std::get_if<JointDrive>(&drive.kind);
    if (on == nullptr) continue;
    const JointKind kind = m->joints[static_cast<size_t>(on->joint)].kind;
    drive.compensates_gravity = kind == JointKind::kRevolute || kind == JointKind::kPrismatic;
  }
}

// A coordinate of each degree of freedom, with the reduced model's state.
struct Differentiated {
  explicit Differentiated(const Mechanism& of) : mechanism(of) {
    std::vector<Coordinate> candidates;
    for (size_t p = 0; p < of.prescribed.size(); ++p) {
      candidates.push_back({Coordinate::Kind::kPrescribed, static_cast<int>(p), 0});
    }
    for (size_t d = 0; d < of.drives.size(); ++d) {
      candidates.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
    }
    for (size_t j = 0; j < of.joints.size(); ++j) {
      for (int c = 0; c < DofsOf(of.joints[j].kind); ++c) {
        candidates.push_back({Coordinate::Kind::kJoint, static_cast<int>(j), c});
      }
    }
    for (const size_t k :
         ChooseCoordinates(of, candidates, of.prescribed.size() + of.drives.size()).chosen) {
      coordinates.push_back(candidates[k]);
    }
    reduced = std::make_unique<ReducedModel>(mechanism, coordinates);
  }
  // A little away from home, where poses are regular: as far as the loops let it. Every model has
  // states of its own, whatever other models there are. Rates are so large that differences of a
  // tenth of them have their digits.
  void Choose() {
    const auto n = static_cast<Eigen::Index>(coordinates.size());
    const double length = CharacteristicLength(mechanism);
    std::seed_seq seed(mechanism.name.begin(), mechanism.name.end());
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const auto rate = [&] {
      const double x = any(random);
      return std::copysign(0.3, x) + 0.7 * x;
    };
    unit.resize(n), v.resize(n), a.resize(n);
    VecX step(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      unit[k] = IsLength(mechanism, coordinates[static_cast<size_t>(k)]) ? length : 1.0;
      v[k] = unit[k] * rate(), a[k] = unit[k] * any(random), step[k] = unit[k] * any(random);
    }
    for (share = 0.02; share > 1e-6; share *= 0.1) {
      q = reduced->home() + share * step;
      if (Forces(q, v, a).allFinite()) break;
    }
    ASSERT_GT(share, 1e-6) << mechanism.name;
  }
  // f at another state; NaN where it is not reached.
  VecX Forces(const VecX& q, const VecX& v, const VecX& a) {
    MatX T;
    if (!reduced->Move(q, v, a).ok() || !reduced->Motions(&T).ok()) {
      return VecX::Constant(q.size(), kNan);
    }
    return reduced->Forces(T, loads);
  }

  const Mechanism& mechanism;
  std::vector<Coordinate> coordinates;
  std::unique_ptr<ReducedModel> reduced;
  std::vector<LoadSample> loads;
  VecX q, v, a, unit;  ///< a state; what lengths and angles are measured in
  double share = 0.0;  ///< of `unit`, that q is away from home
};

// A force and a moment in the world, the same in body axes, and one that follows the state.
inline void AddAllLoads(Differentiated* subject, Load* following) {
  following->following.push_back({.component = 1,
                                  .function = {.inputs = {{subject->coordinates[0], false, 0.0},
                                                          {subject->coordinates[0], true, 0.0}},
                                               .value = [](double, std::span<const double> x) {
                                                 return 2.0 * std::sin(x[0]) -
                                                        0.3 * x[1] * x[1] * x[1];
                                               }}});
  for (const bool in_body_axes : {false, true}) {
    LoadSample load;
    load.body = static_cast<int>(subject->mechanism.bodies.size()) - 1;
    load.p_BoQ_B = Vec3(0.1, 0.2, -0.1);
    load.in_body_axes = in_body_axes;
    load.force = Vec3(3, -2, 1), load.moment = Vec3(-0.4, 0.5, 0.6);
    if (in_body_axes) load.load = following;
    subject->loads.push_back(load);
  }
}

// All of them, and one with every joint kind; their own friction by load or at rest has no
// derivatives and is taken away.
inline std::vector<Mechanism> MechanismsWithDerivatives() {
  std::vector<Mechanism> all;
  const auto add = [&](const std::string& path) {
    Mechanism mechanism = ModelAt(path);
    std::erase_if(mechanism.elements, HasFriction);
    AddOneOfEach(&mechanism);
    // Its slot never turns.
    if (mechanism.name == "slotted_screw") std::erase_if(mechanism.elements, HasFriction);
    all.push_back(std::move(mechanism));
  };
  for (const std::string& name : ShippedModelNames()) add("/models/" + name + "/model.yaml");
  add("/tests/mechanisms/all_joint_kinds.yaml");
  return all;
}

}  // namespace mbv::fixtures
