// Designs: which points of the varied numbers a study computes.
//
// A point is a pure function of the design and its number: no point depends on one before it, so
// that any process can compute any of them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

// What a varied number may be: a distribution, or levels.

namespace mbv {

struct Normal {
  double mean = 0.0, sigma = 1.0;  ///< sigma > 0
};
struct Uniform {
  double lower = 0.0, upper = 1.0;  ///< lower < upper
};
/// Each is as likely as the others.
struct Levels {
  std::vector<double> values;  ///< not empty
};
using Distribution = std::variant<Normal, Uniform, Levels>;

/// The value below which a share `u` of all lies, 0 < u < 1.
[[nodiscard]] double Quantile(const Distribution& distribution, double u);

/// What a number is set to when it alone is varied: mean ∓ sigma, both ends, or each level.
[[nodiscard]] std::vector<double> Excursions(const Distribution& distribution);

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

  /// The first points of a larger number are the same ones.
  [[nodiscard]] bool grows() const {
    return kind == DesignKind::kSobol || kind == DesignKind::kSaltelli;
  }
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

/// Blocks of kSaltelli are those of this many designs in turn, randomised independently of each
/// other: how far their estimates lie apart is how far off they are. One design alone does not show
/// how much less than independent points its even spread errs [L'Ecuyer, Nakayama, Owen, Tuffin
/// 2023, "Confidence intervals for randomized quasi-Monte Carlo estimators"].
inline constexpr std::uint64_t kReplicates = 8;

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

// A study as data: which numbers of a scenario are varied, by which design, and what is asked of
// each point. Read by features/study/study_file.h, then only read.

/// A varied number.
struct Factor {
  std::string name;  ///< as in the study: "m_p", "motion.duration_s"
  std::string key;   ///< what `--set` sets: "parameters.m_p"; its value is in the key's unit
  Axis axis;         ///< nominal: NaN where the scenario does not state the number
  int line = 0, column = 0;
};

/// What a signal over time is reduced to.
enum class Statistic { kMax, kMin, kPeak, kRms, kMean, kEnd };
struct StatisticWord {
  Statistic statistic;
  const char* word;
};
inline constexpr StatisticWord kStatisticWords[] = {
    {Statistic::kMax, "max"}, {Statistic::kMin, "min"},   {Statistic::kPeak, "peak"},
    {Statistic::kRms, "rms"}, {Statistic::kMean, "mean"}, {Statistic::kEnd, "end"}};

/// What is computed at each point: a statistic of a channel, or a check's value.
struct StudyQuantity {
  std::string name;     ///< as in the study: "limb1.drive.force.max", "closure_m"
  std::string channel;  ///< "" of a check
  Statistic statistic = Statistic::kMax;
  bool of_pair = false;  ///< a check that compares two witnesses
  int line = 0, column = 0;

  [[nodiscard]] bool is_check() const { return channel.empty(); }
};

/// What a quantity must not do in more than a share of all points.
struct StudyLimit {
  size_t quantity = 0;  ///< index into Study::quantities
  std::optional<double> below, above;
  double share = 0.0;  ///< 0 … 1

  /// A value that is not a number keeps no limit.
  [[nodiscard]] bool Keeps(double value) const {
    return value == value && !(below && value >= *below) && !(above && value <= *above);
  }
};

/// A table in the reference's place is judged against the band of all points (pipeline/validate.h).
struct StudyValidation {
  double coverage = 2.0;             ///< k: |E| ≤ k u_val is asked of a sample
  double share = 0.05;               ///< of a drive's samples that may be beyond that
  std::optional<double> u_num = {};  ///< of the drive forces [N or N m]; left out: estimated
  int line = 0, column = 0;
};

struct Study {
  std::string name;
  std::string description;
  std::string file;      ///< as given
  std::string scenario;  ///< file
  std::vector<Factor> factors;
  Design design;
  std::vector<std::string> witnesses;  ///< words of kStudyWitnesses
  std::vector<StudyQuantity> quantities;
  std::vector<StudyLimit> limits;
  std::optional<StudyValidation> validation;
  /// The share of points that may have no result; limits are about the others then. Left out:
  /// points without a result violate every limit.
  std::optional<double> missing;
  int expected_exit = 0;  ///< for tests of shipped studies
  std::string mentions;   ///< must occur in what is printed

  [[nodiscard]] DesignPoints Points() const {
    std::vector<Axis> axes;
    for (const Factor& factor : factors) axes.push_back(factor.axis);
    return {std::move(axes), design};
  }
};

/// Who may compute a point; `inverse` and `forward` are the simulation in that mode, `simulation`
/// in the scenario's own.
inline constexpr const char* kStudyWitnesses[] = {"analytic", "reference", "inverse", "forward",
                                                  "simulation"};

// Random bits as a function of what they are for: no state, no order, the same on every machine.

/// The output function of SplitMix64 [Steele, Lea, Flood 2014, "Fast splittable pseudorandom number
/// generators"].
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t a, std::uint64_t b) {
  return MixBits(MixBits(a) ^ b);
}
[[nodiscard]] constexpr std::uint64_t MixBits(std::uint64_t a, std::uint64_t b, std::uint64_t c) {
  return MixBits(MixBits(a, b) ^ c);
}

/// The middle of one of 2^52 cells of (0, 1): never an end, where quantiles are infinite.
[[nodiscard]] constexpr double ShareOf(std::uint64_t bits) {
  return (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
}

// A random permutation of 0 … n − 1 that is evaluated where it is asked for, without a table.

/// Where `index` < `count` goes: a Feistel network on the next larger even number of bits, walked
/// until it is below `count` [Black, Rogaway 2002, "Ciphers with arbitrary finite domains"].
[[nodiscard]] std::uint64_t Permuted(std::uint64_t index, std::uint64_t count, std::uint64_t key);

}  // namespace mbv
