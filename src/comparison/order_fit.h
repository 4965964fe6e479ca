// Orders of convergence from errors at several steps, and Richardson's extrapolation.
//
// An error C h^p is a straight line of slope p in logarithmic axes. Coarse steps that are not yet
// in the asymptotic range bend it at one end, round-off at the other; the fit takes what lies
// between.
#pragma once

#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

/// Relative errors below this are round-off whatever they do [1].
inline constexpr double kRoundoffError = 1e-12;
/// Relative errors that stop falling below this are a round-off plateau [1]: constraint forces are
/// differences of large numbers, which costs up to five digits.
inline constexpr double kLargestPlateau = 1e-10;
/// An order is as expected when it is nearer than this; neighbouring whole orders are told apart.
inline constexpr double kOrderTolerance = 0.5;

struct OrderFit {
  double order = kNan;           ///< least squares over the asymptotic range; NaN: none can be told
  double order_error = kNan;     ///< its standard error; NaN with two points
  std::vector<double> pairwise;  ///< entry i: order between points i − 1 and i; NaN at the first
  std::vector<bool> fitted;      ///< in the asymptotic range
  std::vector<bool> floor;       ///< round-off, or another cause that the caller named

  [[nodiscard]] int first_fitted() const;  ///< index or -1
  [[nodiscard]] int last_fitted() const;   ///< index or -1
};

/// Fits error = C step^order.
/// \param step       descending, > 0
/// \param error      relative errors >= 0, one per step; NaN where there is none
/// \param ignorable  levels below which an error has another cause than the step, one per step
/// \param plateau    level below which errors that stop falling are round-off
[[nodiscard]] OrderFit FitOrder(const std::vector<double>& step, const std::vector<double>& error,
                                const std::vector<double>& ignorable,
                                double plateau = kLargestPlateau);

/// Orders that a scheme promises, [lowest, highest].
struct ExpectedOrder {
  double lowest = kNan, highest = kNan;
};
[[nodiscard]] std::string ToText(const ExpectedOrder& expected);

struct OrderVerdict {
  bool judged = false;   ///< false: nothing to judge, `text` says why
  bool finding = false;  ///< the order is not the expected one
  std::string text = "not judged";
};
/// A finding: the fitted order is not as expected, or the error falls more slowly between finer
/// points above the floor.
[[nodiscard]] OrderVerdict JudgeOrder(const OrderFit& fit, const ExpectedOrder& expected);

/// Richardson's extrapolation from two steps: value = fine + factor (fine − coarse), with the grid
/// convergence index safety · factor · |fine − coarse| as uncertainty
/// [Roache 1997, Annu. Rev. Fluid Mech. 29, 123–160, §§ 4.2, 5.2].
struct Richardson {
  double order = kNan;
  double factor = kNan;  ///< 1/(ratio^order − 1)
  double safety = kNan;  ///< 1.25 with an order observed on three steps or more, 3 otherwise
};
/// The order is that of `fit`, at most the lowest one of `expected`, which also serves where `fit`
/// has none (at least 1).
[[nodiscard]] Richardson MakeRichardson(double coarse_step, double fine_step, const OrderFit& fit,
                                        const ExpectedOrder& expected);

}  // namespace mbv
