// What witnesses in C++ share: the files that mbverify hands over (docs/how-to/external_solvers.md)
// and the time that they take. No mechanics.
#pragma once

#include <algorithm>
#include <ctime>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace witness {

// What a program cannot compute: no fault of anyone.
struct Refused : std::runtime_error {
  using runtime_error::runtime_error;
};

// Reports the processor time that passed while it lived.
class Stopwatch {
 public:
  explicit Stopwatch(double* seconds) : seconds_(*seconds) {}
  ~Stopwatch() { seconds_ += ProcessorTime() - start_; }
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

struct Sample {
  double position = 0.0, velocity = 0.0, acceleration = 0.0;
};

// A force over time: quintic polynomials through values, rates and second derivatives at samples.
class ForceInTime {
 public:
  ForceInTime() = default;
  // Of a drive, from forces.csv; zero where it is not named.
  ForceInTime(const Table& forces, const std::string& drive) {
    size_t column = 0;
    for (size_t k = 1; k < forces.names.size(); ++k) {
      if (forces.names[k] == drive + ".force") column = k;
    }
    for (const std::vector<std::string>& row : forces.rows) {
      Sample at;
      if (column > 0)
        at = {std::stod(row.at(column)), std::stod(row.at(column + 1)),
              std::stod(row.at(column + 2))};
      samples_.emplace_back(std::stod(row.at(0)), at);
    }
  }

  [[nodiscard]] double At(double t) const {
    if (samples_.empty()) return 0.0;
    size_t i = 0;
    while (i + 2 < samples_.size() && samples_[i + 1].first <= t) ++i;
    const auto& [t0, a] = samples_[i];
    const auto& [t1, b] = samples_[std::min(i + 1, samples_.size() - 1)];
    const double h = t1 - t0;
    if (!(h > 0.0)) return a.position;
    const double s = (t - t0) / h, v0 = a.velocity * h, v1 = b.velocity * h;
    const double a0 = a.acceleration * h * h, a1 = b.acceleration * h * h;
    const double d = b.position - a.position - v0 - a0 / 2, e = v1 - v0 - a0, f = a1 - a0;
    const double c3 = 10 * d - 4 * e + f / 2, c4 = -15 * d + 7 * e - f, c5 = 6 * d - 3 * e + f / 2;
    return a.position + s * (v0 + s * (a0 / 2 + s * (c3 + s * (c4 + s * c5))));
  }

 private:
  std::vector<std::pair<double, Sample>> samples_;
};

}  // namespace witness
