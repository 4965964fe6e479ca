// A commanded motion: per sample positions and velocities are projected onto loops and drives; the
// multipliers of the accelerations' equations are the forces,
//   M u̇ + Gᵀλ = f,   G u̇ = b:   a drive's force is −λ of its constraint.
#pragma once

#include "driven.h"
#include "model.h"

namespace simbody_witness {

constexpr int kWalk = 40;  // steps from home to the first sample

class CommandedMotion : Model {
 public:
  explicit CommandedMotion(json mechanism) : Model(std::move(mechanism)) {
    for (const json& drive : m_.at("drives")) AddDriven(drive);
    for (const json& base : m_.at("prescribed")) AddDriven(base);
  }

  void Run() {
    State state = Home();
    const Table motion = ReadCsv("motion.csv"), loads = ReadCsv("loads.csv");
    std::ofstream out("traces.csv");
    out.precision(17);
    out << "time_s,closure.position";
    for (const Drive& drive : drives_) {
      out << ',' << drive.name << ".force";
      if (!drive.base) {
        out << ',' << drive.name << ".position," << drive.name << ".velocity," << drive.name
            << ".acceleration";
      }
    }
    NameOutputs(&out);
    size_t load = 0;
    for (size_t i = 0; i < motion.rows.size(); ++i) {
      const std::vector<std::string>& row = motion.rows[i];
      if (i == 0) Walk(row, &state);
      SetDriven(row, 1.0);
      Reach(&state);
      loads_.clearAllForces(state);
      for (; load < loads.rows.size() && std::stod(loads.rows[load][0]) <= std::stod(row[0]);
           ++load) {
        AddLoad(loads.rows[load], &state);
      }
      system_.realize(state, SimTK::Stage::Acceleration);
      Write(row[0], state, &out);
    }
  }

 private:
  struct Drive {
    std::string name;
    bool base = false;  // a prescribed joint
    std::shared_ptr<Sample> now = std::make_shared<Sample>();
    double home = 0.0;
    SimTK::ConstraintIndex constraint;
  };

  void AddDriven(const json& row) {
    Drive drive;
    drive.name = row.at("name");
    drive.base = !row.contains("position_unit");
    if (row.contains("between")) {
      const json &from = row.at("between").at(0), &to = row.at("between").at(1);
      drive.home = ((PoseOf(bodies_.at(to.at("body"))->at("home")) * VectorOf(to.at("p"))) -
                    (PoseOf(bodies_.at(from.at("body"))->at("home")) * VectorOf(from.at("p"))))
                       .norm();
      drive.constraint =
          Constraint::Custom(new Distance(matter_, At(from.at("body")), VectorOf(from.at("p")),
                                          At(to.at("body")), VectorOf(to.at("p")), drive.now))
              .getConstraintIndex();
    } else {
      drive.home = HomeUnder(row);
      drive.constraint =
          Constraint::PrescribedMotion(matter_, new Driven(drive.now), MobilizerUnder(row),
                                       SimTK::MobilizerQIndex(CoordinateUnder(row)))
              .getConstraintIndex();
    }
    drives_.push_back(std::move(drive));
  }

  void SetDriven(const std::vector<std::string>& row, double share) {
    for (size_t k = 0; k < drives_.size(); ++k) {
      Sample& now = *drives_[k].now;
      now.position = drives_[k].home + share * (std::stod(row.at(1 + 3 * k)) - drives_[k].home);
      now.velocity = std::stod(row.at(2 + 3 * k));
      now.acceleration = std::stod(row.at(3 + 3 * k));
    }
  }

  void Walk(const std::vector<std::string>& row, State* state) {
    for (int i = 0; i <= kWalk; ++i) {
      SetDriven(row, static_cast<double>(i) / kWalk);
      Reach(state);
    }
  }

  // Positions and velocities onto the loops and drives. The motion is no function of time that
  // Simbody knows: another time makes it ask again.
  void Reach(State* state) {
    state->setTime(state->getTime() + 1.0);
    Project(state);
  }

  void AddLoad(const std::vector<std::string>& row, State* state) {
    const MobilizedBody& body = At(row.at(2));
    const auto vector = [&](size_t at) {
      return Vec3(std::stod(row.at(at)), std::stod(row.at(at + 1)), std::stod(row.at(at + 2)));
    };
    Vec3 f = vector(7), m = vector(10);
    system_.realize(*state, SimTK::Stage::Position);
    if (row.at(6) == "body") {
      f = body.getBodyRotation(*state) * f;
      m = body.getBodyRotation(*state) * m;
    }
    loads_.addForceToBodyPoint(*state, body, vector(3), f);
    const SpatialVec sum = loads_.getOneBodyForce(*state, body);
    loads_.setOneBodyForce(*state, body, sum + SpatialVec(m, Vec3(0)));
  }

  void Write(const std::string& time, const State& state, std::ofstream* out) {
    *out << time << ',' << state.getQErr().normInf();
    for (const Drive& drive : drives_) {
      const double force =
          -matter_.getConstraint(drive.constraint).getMultipliersAsVector(state)[0];
      if (!std::isfinite(force)) throw Refused("its equations are singular at t = " + time + " s");
      *out << ',' << force;
      if (drive.base) continue;
      *out << ',' << drive.now->position << ',' << drive.now->velocity << ','
           << drive.now->acceleration;
    }
    WriteOutputs(state, out);
  }

  std::vector<Drive> drives_;
};

}  // namespace simbody_witness
