// Designs: which points of the varied numbers a study computes.
//
// A point is a pure function of the design and its number: no point depends on one before it, so
// that any process can compute any of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "study/distribution.h"

namespace mbv {

enum class DesignKind {
  kSobol,           ///< `count` points of Sobol's sequence, shifted digitally by the seed
  kSaltelli,        ///< `count` blocks of k + 2 points: A, B, and A with each column of B in turn
  kLatinHypercube,  ///< `count` points, one in each of as many layers of every number
  kGrid,            ///< all combinations of levels; the last number runs fastest
  kOneAtATime,      ///< nominal, then each number's excursions with the others nominal
  kList,            ///< as written down
};

/// Two normal numbers whose deviations go together.
struct Correlation {
  size_t first = 0, second = 0;  ///< axes
  double coefficient = 0.0;      ///< -1 < coefficient < 1
};

struct Design {
  DesignKind kind = DesignKind::kSobol;
  std::uint64_t count = 0;  ///< of the first three kinds; Sobol's a power of two
  std::uint64_t seed = 1;
  std::vector<std::vector<double>> list = {};  ///< kList: points × numbers
  /// Of kSobol and kLatinHypercube, between normal numbers; their matrix is positive definite.
  std::vector<Correlation> correlations = {};

  /// Points are drawn from the distributions, so that shares of them estimate probabilities.
  [[nodiscard]] bool draws() const {
    return kind == DesignKind::kSobol || kind == DesignKind::kSaltelli ||
           kind == DesignKind::kLatinHypercube;
  }
};

/// One varied number as a design sees it.
struct Axis {
  double nominal = 0.0;
  Distribution distribution;
};

/// The matrix of all correlations: numbers × numbers, ones on its diagonal.
[[nodiscard]] Eigen::MatrixXd CorrelationMatrix(const Design& design, size_t axes);
/// Its smallest eigenvalue; above 0 where such numbers can exist.
[[nodiscard]] double SmallestEigenvalue(const Eigen::MatrixXd& correlation);

inline constexpr size_t kMostAxes = 1000;  ///< Sobol's sequence has 3667 dimensions

class DesignPoints {
 public:
  /// At most kMostAxes; grids have Levels only.
  DesignPoints(std::vector<Axis> axes, Design design);
  ~DesignPoints();
  DesignPoints(DesignPoints&&) noexcept;

  /// Saturates at the largest number that 64 bits hold.
  [[nodiscard]] std::uint64_t count() const;
  /// The values of point `number` < count(), one per axis.
  [[nodiscard]] std::vector<double> At(std::uint64_t number) const;

 private:
  struct Sequence;
  [[nodiscard]] std::vector<double> Shares(std::uint64_t number) const;
  void Correlate(const std::vector<double>& shares, std::vector<double>* values) const;
  [[nodiscard]] std::vector<double> GridPoint(std::uint64_t number) const;
  [[nodiscard]] std::vector<double> Excursion(std::uint64_t number) const;

  std::vector<Axis> axes_;
  Design design_;
  std::unique_ptr<Sequence> sequence_;
  Eigen::MatrixXd root_;  // L with L L^T = the correlations' matrix; empty without any
};

}  // namespace mbv
