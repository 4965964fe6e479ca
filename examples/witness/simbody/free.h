// A free motion: it starts from start.csv and is integrated by Simbody's Runge–Kutta–Merson method,
// drives pushing as forces.csv says. With commanded coordinates beside it is declined.
#pragma once

#include "model.h"
#include "push.h"

namespace simbody_witness {

constexpr double kAccuracy = 1e-11;  // that the integrator is asked for, per step

class FreeMotion : Model {
 public:
  explicit FreeMotion(json mechanism) : Model(std::move(mechanism)) { AddPushes(); }

  void Run() {
    State state = Home();
    Start(&state);
    std::ofstream out("traces.csv");
    out.precision(17);
    out << "time_s,closure.position";
    for (const Push& push : pushes_) {
      out << ',' << push.name << ".position," << push.name << ".velocity," << push.name
          << ".acceleration";
    }
    NameOutputs(&out);
    SimTK::RungeKuttaMersonIntegrator integrator(system_);
    integrator.setAccuracy(kAccuracy);
    integrator.setConstraintTolerance(kClosed * 10.0);
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
      WriteOutputs(now, &out);
    }
  }

 private:
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
      ReadForce(forces, &push);
    }
    SimTK::Force::Custom(forces_, new Pushes(&pushes_));
  }

  static void ReadForce(const Table& forces, Push* push) {
    size_t column = 0;
    for (size_t k = 1; k < forces.names.size(); ++k) {
      if (forces.names[k] == push->name + ".force") column = k;
    }
    for (const std::vector<std::string>& row : forces.rows) {
      Sample at;
      if (column > 0)
        at = {std::stod(row.at(column)), std::stod(row.at(column + 1)),
              std::stod(row.at(column + 2))};
      push->force.Add(std::stod(row.at(0)), at);
    }
  }

  // Poses and velocities of start.csv, projected onto the loops.
  void Start(State* state) {
    std::map<std::string, std::vector<double>> rows;
    for (const std::vector<std::string>& row : ReadCsv("start.csv").rows) {
      for (size_t k = 1; k < row.size(); ++k) rows[row[0]].push_back(std::stod(row[k]));
    }
    const auto vector = [](const std::vector<double>& row, size_t k) {
      return Vec3(row.at(k), row.at(k + 1), row.at(k + 2));
    };
    for (SimTK::MobilizedBodyIndex i(1); i < matter_.getNumBodies(); ++i) {
      for (const auto& [name, index] : placed_) {
        if (index != i) continue;
        const std::vector<double>& row = rows.at(name);
        const MobilizedBody& body = matter_.getMobilizedBody(i);
        const MobilizedBody& parent = body.getParentMobilizedBody();
        SimTK::Mat33 R;
        for (int r = 0; r < 3; ++r) R[r] = ~vector(row, 3 + 3 * r);
        const Transform X(Rotation(R, true), vector(row, 0));
        system_.realize(*state, SimTK::Stage::Position);
        body.setQToFitTransform(
            *state, ~(parent.getBodyTransform(*state) * body.getInboardFrame(*state)) * X *
                        body.getOutboardFrame(*state));
        system_.realize(*state, SimTK::Stage::Velocity);
        const SpatialVec V(vector(row, 12), vector(row, 15));
        const SpatialVec V_P = parent.getBodyVelocity(*state);
        const Vec3 p_PM =
            X * body.getOutboardFrame(*state).p() - parent.getBodyOriginLocation(*state);
        const Vec3 p_PF = parent.getBodyRotation(*state) * body.getInboardFrame(*state).p();
        const Vec3 r_M = X.R() * body.getOutboardFrame(*state).p();
        const Rotation R_GF = parent.getBodyRotation(*state) * body.getInboardFrame(*state).R();
        // Of M in F: as F's observer sees it.
        const Vec3 w = V[0] - V_P[0];
        const Vec3 v = V[1] + V[0] % r_M - V_P[1] - V_P[0] % p_PF - V_P[0] % (p_PM - p_PF);
        body.setUToFitVelocity(*state, SpatialVec(~R_GF * w, ~R_GF * v));
      }
    }
    Project(state);
    for (Push& push : pushes_) FindTurn(*state, &push);
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
