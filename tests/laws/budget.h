// A tolerance as a named sum, printed when a law fails.
#pragma once

#include <gtest/gtest.h>

#include <ostream>

namespace mbv::laws {

/// All relative to the size of what is compared.
struct Budget {
  double rounding = 0.0;    ///< of the arithmetic, amplified by the pose's condition
  double closure = 0.0;     ///< loops and forward solutions are iterated to a residual, not to zero
  double truncation = 0.0;  ///< of difference quotients

  [[nodiscard]] double Total() const { return rounding + closure + truncation; }
};

inline std::ostream& operator<<(std::ostream& out, const Budget& b) {
  return out << "budget " << b.Total() << " = rounding " << b.rounding << " + closure " << b.closure
             << " + truncation " << b.truncation;
}

/// What a law measured at one state.
struct Residual {
  double error = 0.0;  ///< relative
  Budget budget;
  std::string trouble;  ///< a witness that did not answer

  [[nodiscard]] bool Holds() const { return trouble.empty() && error <= budget.Total(); }
};

inline std::ostream& operator<<(std::ostream& out, const Residual& r) {
  out << "error " << r.error << ", " << r.budget;
  return r.trouble.empty() ? out : out << ", " << r.trouble;
}

}  // namespace mbv::laws
