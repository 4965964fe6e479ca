// A free motion: it starts from start.csv and is integrated by Simbody's Runge–Kutta–Merson method,
// drives pushing as forces.csv says. With commanded coordinates in addition it is not applicable.
#pragma once

#include "model.h"
#include "push.h"

namespace simbody_witness {

constexpr double kAccuracy = 1e-11;  // that the integrator is asked for, per step

class FreeMotion : Model {
 public:
  explicit FreeMotion(json mechanism) : Model(std::move(mechanism)) { AddPushes(); }

  // Where loops cannot be kept as closed as is asked for, Simbody halves its steps until they are
  // none and ends with an exception: then they are kept a tenth as closed.
  void Run() {
    State state = Home();
    Start(&state);
    for (double closed = 10.0 * kClosed;; closed *= 10.0) {
      try {
        return Integrate(state, closed);
      } catch (const SimTK::Exception::Base&) {
        if (closed > 1e4 * kClosed) throw;
      }
    }
  }

 private:
  void Integrate(State state, double closed) {
    std::ofstream out("traces.csv");
    out.precision(17);
    out << "time_s,closure.position";
    for (const Push& push : pushes_) {
      out << ',' << push.name << ".position," << push.name << ".velocity," << push.name
          << ".acceleration";
    }
    NameOutputRates(&out);
    NameOutputs(&out);
    SimTK::RungeKuttaMersonIntegrator integrator(system_);
    integrator.setAccuracy(kAccuracy);
    integrator.setConstraintTolerance(closed);
    integrator.setProjectEveryStep(true);
    SimTK::TimeStepper stepper(system_, integrator);
    state.setTime(0.0);
    stepper.initialize(state);
    for (const std::vector<std::string>& row : ReadCsv("motion.csv").rows) {
      stepper.stepTo(std::stod(row.at(0)));
      const State& now = stepper.getState();
      system_.realize(now, SimTK::Stage::Acceleration);
      out << row.at(0) << ',' << now.getQErr().normInf();
      for (const Push& push : pushes_) {
        out << ',' << push.Position(now) << ',' << push.Velocity(now) << ','
            << push.Acceleration(now);
      }
      WriteOutputRates(now, &out);
      WriteOutputs(now, &out);
    }
  }

  void AddPushes() {
    if (ReadCsv("motion.csv").names.size() > 1) throw Refused("commands beside a free motion");
    const Table forces = ReadCsv("forces.csv"), loads = ReadCsv("loads.csv");
    if (!loads.rows.empty()) throw Refused("loads in a free motion");
    for (const json& drive : m_.at("drives")) {
      Push& push = pushes_.emplace_back();
      push.name = drive.at("name");
      push.on_leg = drive.contains("between");
      if (push.on_leg) {
        const json &from = drive.at("between").at(0), &to = drive.at("between").at(1);
        push.leg = {At(from.at("body")), At(to.at("body")), VectorOf(from.at("p")),
                    VectorOf(to.at("p"))};
      } else {
        push.coordinate = CoordinateUnder(drive);
        push.mobilizer = matter_.getMobilizedBody(MobilizerUnder(drive));
      }
      push.force = ForceInTime(forces, push.name);
    }
    SimTK::Force::Custom(forces_, new Pushes(&pushes_));
  }

  // A body's pose and velocity [ω; v of its origin] in ground.
  struct GivenState {
    Transform X;
    SpatialVec V;
  };

  static std::map<std::string, GivenState> ReadStart() {
    std::map<std::string, GivenState> start;
    for (const std::vector<std::string>& row : ReadCsv("start.csv").rows) {
      const auto vector = [&](size_t k) {
        return Vec3(std::stod(row.at(k)), std::stod(row.at(k + 1)), std::stod(row.at(k + 2)));
      };
      SimTK::Mat33 R;
      for (int r = 0; r < 3; ++r) R[r] = ~vector(4 + 3 * static_cast<size_t>(r));
      start[row.at(0)] = {Transform(Rotation(R, true), vector(1)),
                          SpatialVec(vector(13), vector(16))};
    }
    return start;
  }

  // Poses and velocities of start.csv, inner bodies first, projected onto the loops.
  void Start(State* state) {
    std::map<int, std::string> names;
    for (const auto& [name, index] : placed_) names[index] = name;
    std::map<std::string, GivenState> start = ReadStart();
    for (SimTK::MobilizedBodyIndex i(1); i < matter_.getNumBodies(); ++i) {
      PutAt(start.at(names.at(i)), matter_.getMobilizedBody(i), state);
    }
    Project(state);
    for (Push& push : pushes_) FindTurn(*state, &push);
  }

  // M's pose and velocity in F, as an observer sees them who moves with F.
  void PutAt(const GivenState& given, const MobilizedBody& body, State* state) {
    const MobilizedBody& parent = body.getParentMobilizedBody();
    const Transform X_BM = body.getOutboardFrame(*state), X_PF = body.getInboardFrame(*state);
    system_.realize(*state, SimTK::Stage::Position);
    const Transform X_GP = parent.getBodyTransform(*state), X_GF = X_GP * X_PF;
    body.setQToFitTransform(*state, ~X_GF * given.X * X_BM);
    system_.realize(*state, SimTK::Stage::Velocity);
    const SpatialVec V_GP = parent.getBodyVelocity(*state);
    const Vec3 v_M = given.V[1] + given.V[0] % (given.X.R() * X_BM.p());
    const Vec3 v_there = V_GP[1] + V_GP[0] % (given.X * X_BM.p() - X_GP.p());
    body.setUToFitVelocity(
        *state, SpatialVec(~X_GF.R() * (given.V[0] - V_GP[0]), ~X_GF.R() * (v_M - v_there)));
  }

  // Angles start in the turn that is next to home.
  void FindTurn(const State& state, Push* push) const {
    if (push->on_leg) return;
    for (const json& drive : m_.at("drives")) {
      if (drive.at("name") != push->name || drive.at("position_unit") != "rad") continue;
      const double turn = 2.0 * SimTK::Pi;
      push->turn = turn * std::round((HomeUnder(drive) - push->Position(state)) / turn);
    }
  }

  std::vector<Push> pushes_;
};

}  // namespace simbody_witness
