#include "table/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mbv {
namespace {

constexpr double kMedianOfNormal = 0.6744897501960817;  // median |x| of a normal distribution
constexpr size_t kMostLooked = 4000;                    // rows; enough for a median
constexpr int kMostNeighbours = 10;

double Median(std::vector<double>* values) {
  const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

// Lagrange weights that predict row i from `count` neighbours, half of them on each side.
void Weights(std::span<const double> time_s, size_t i, int count,
             std::array<double, kMostNeighbours>* weights) {
  const auto row = [&](int k) {
    const int half = count / 2;
    return i + static_cast<size_t>(k < half ? k : k + 1) - static_cast<size_t>(half);
  };
  for (int a = 0; a < count; ++a) {
    double weight = 1.0;
    for (int b = 0; b < count; ++b) {
      if (a == b) continue;
      weight *= (time_s[i] - time_s[row(b)]) / (time_s[row(a)] - time_s[row(b)]);
    }
    (*weights)[static_cast<size_t>(a)] = weight;
  }
}

}  // namespace

std::vector<double> EstimateNoise(std::span<const double> time_s, const MatX& values) {
  const size_t rows = time_s.size();
  const auto columns = static_cast<size_t>(values.cols());
  if (rows < kFewestForNoise) return std::vector<double>(columns, 0.0);
  std::vector<double> noise(columns, std::numeric_limits<double>::infinity());
  std::array<double, kMostNeighbours> weights{};
  for (int count = 2; count <= kMostNeighbours; count += 2) {
    const auto half = static_cast<size_t>(count / 2);
    const size_t stride = rows / kMostLooked + 1;
    std::vector<std::vector<double>> errors(columns);
    for (size_t i = half; i + half < rows; i += stride) {
      Weights(time_s, i, count, &weights);
      double sum2 = 1.0;
      for (int k = 0; k < count; ++k) sum2 += weights[k] * weights[k];
      for (size_t c = 0; c < columns; ++c) {
        const auto column = static_cast<Eigen::Index>(c);
        double error = values(static_cast<Eigen::Index>(i), column);
        for (size_t k = 0; k < static_cast<size_t>(count); ++k) {
          const size_t row = i - half + k + (k < half ? 0 : 1);
          error -= weights[k] * values(static_cast<Eigen::Index>(row), column);
        }
        errors[c].push_back(std::abs(error) / std::sqrt(sum2));
      }
    }
    for (size_t c = 0; c < columns; ++c) {
      noise[c] = std::min(noise[c], Median(&errors[c]) / kMedianOfNormal);
    }
  }
  return noise;
}

}  // namespace mbv
