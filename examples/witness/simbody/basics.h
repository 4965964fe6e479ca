// What all parts of the witness need: vectors and poses of mechanism.json.
#pragma once

#include <Simbody.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "../handover.h"

namespace simbody_witness {

using namespace witness;
using nlohmann::json;
using SimTK::Constraint;
using SimTK::MobilizedBody;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

inline constexpr double kClosed = 1e-13;  // to which loops are projected closed [m, rad]

inline Vec3 VectorOf(const json& v) { return {v.at(0), v.at(1), v.at(2)}; }

inline Transform PoseOf(const json& pose) {
  const json& R = pose.at("R");
  SimTK::Mat33 m;
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) m(i, k) = R.at(i).at(k);
  }
  return {Rotation(m, true), VectorOf(pose.at("p"))};
}

// Axes with the first along `a` (SimTK::XAxis, …), and if given another one along b.
inline Rotation Along(const Vec3& a, SimTK::CoordinateAxis axis) {
  return Rotation(SimTK::UnitVec3(a), axis);
}

}  // namespace simbody_witness
