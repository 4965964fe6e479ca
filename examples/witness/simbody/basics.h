// What all parts of the witness need: vectors and poses of mechanism.json, tables, time.
#pragma once

#include <Simbody.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace simbody_witness {

using nlohmann::json;
using SimTK::Constraint;
using SimTK::MobilizedBody;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

inline constexpr double kClosed = 1e-13;  // to which loops are projected closed [m, rad]

// What this program cannot compute: no fault of anyone.
struct Refused : std::runtime_error {
  using runtime_error::runtime_error;
};

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

struct Sample {
  double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

// Reports the processor time that passed while it lived.
class Stopwatch {
 public:
  explicit Stopwatch(double* seconds) : seconds_(*seconds) {}
  ~Stopwatch() { seconds_ = ProcessorTime() - start_; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  static double ProcessorTime() {
    return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
  }

  double& seconds_;
  const double start_ = ProcessorTime();
};

struct Table {
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;
};

inline Table ReadCsv(const std::string& file) {
  std::ifstream in(file);
  Table table;
  for (std::string line; std::getline(in, line);) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    if (table.names.empty()) {
      table.names = std::move(cells);
    } else {
      table.rows.push_back(std::move(cells));
    }
  }
  return table;
}

}  // namespace simbody_witness
