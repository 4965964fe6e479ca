// What drives of a free motion are to Simbody: forces on a coordinate or along a leg.
#pragma once

#include <utility>

#include "basics.h"

namespace simbody_witness {

// Two points of bodies, and the line from one to the other.
struct Leg {
  MobilizedBody from, to;
  Vec3 a, b;

  struct Line {
    Vec3 r_a, r_b;  // from the bodies' origins, in ground
    Vec3 u;
    double length, rate;
  };
  [[nodiscard]] Line At(const State& state) const {
    Line line{from.getBodyRotation(state) * a, to.getBodyRotation(state) * b, Vec3(0), 0.0, 0.0};
    const Vec3 d =
        to.getBodyOriginLocation(state) + line.r_b - from.getBodyOriginLocation(state) - line.r_a;
    line.length = d.norm();
    line.u = d / line.length;
    if (state.getSystemStage() >= SimTK::Stage::Velocity) {
      line.rate = SimTK::dot(line.u, to.findStationVelocityInGround(state, b) -
                                         from.findStationVelocityInGround(state, a));
    }
    return line;
  }
  [[nodiscard]] double Acceleration(const State& state) const {
    const Line line = At(state);
    const Vec3 v =
        to.findStationVelocityInGround(state, b) - from.findStationVelocityInGround(state, a);
    const Vec3 w = to.findStationAccelerationInGround(state, b) -
                   from.findStationAccelerationInGround(state, a);
    return SimTK::dot(line.u, w) + (v.normSqr() - line.rate * line.rate) / line.length;
  }
};

// A drive that pushes in a free motion: along a leg, or on a mobilizer's coordinate.
struct Push {
  std::string name;
  bool on_leg = false;
  Leg leg;
  MobilizedBody mobilizer;
  int coordinate = 0;
  double turn = 0.0;  // what its position is beyond Simbody's coordinate
  ForceInTime force;

  [[nodiscard]] double Position(const State& s) const {
    return on_leg ? leg.At(s).length : mobilizer.getOneQ(s, coordinate) + turn;
  }
  [[nodiscard]] double Velocity(const State& s) const {
    return on_leg ? leg.At(s).rate : mobilizer.getOneU(s, coordinate);
  }
  [[nodiscard]] double Acceleration(const State& s) const {
    return on_leg ? leg.Acceleration(s) : mobilizer.getOneUDot(s, coordinate);
  }
};

class Pushes : public SimTK::Force::Custom::Implementation {
 public:
  explicit Pushes(const std::vector<Push>* pushes) : pushes_(*pushes) {}
  void calcForce(const State& state, SimTK::Vector_<SpatialVec>& bodies, SimTK::Vector_<Vec3>&,
                 SimTK::Vector& mobilities) const override {
    for (const Push& push : pushes_) {
      const double f = push.force.At(state.getTime());
      if (push.on_leg) {
        const Leg::Line line = push.leg.At(state);
        push.leg.to.applyBodyForce(state, {line.r_b % (f * line.u), f * line.u}, bodies);
        push.leg.from.applyBodyForce(state, {-(line.r_a % (f * line.u)), -f * line.u}, bodies);
      } else {
        push.mobilizer.applyOneMobilityForce(state, push.coordinate, f, mobilities);
      }
    }
  }
  SimTK::Real calcPotentialEnergy(const State&) const override { return 0.0; }
  bool dependsOnlyOnPositions() const override { return false; }

 private:
  const std::vector<Push>& pushes_;
};

}  // namespace simbody_witness
