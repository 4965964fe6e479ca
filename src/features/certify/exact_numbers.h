// The number types of exact_model.h: intervals of 113 and of 240 bits that hold every real result
// (MPFI, on MPFR), and dual numbers.
#pragma once

#include <gmp.h>
#include <cmath>

#include <boost/multiprecision/mpfi.hpp>

namespace mbv::exact {

namespace mp = boost::multiprecision;
template <unsigned kDigits>
using Enclosure = mp::number<mp::mpfi_float_backend<kDigits>, mp::et_off>;
using Fine = Enclosure<34>;
using Finest = Enclosure<73>;

/// Products with it need not be formed.
template <unsigned kDigits>
bool IsZero(const Enclosure<kDigits>& x) {
  return mpfi_is_zero(x.backend().data()) != 0;
}
/// Whether all that it holds is no larger.
template <unsigned kDigits>
bool AtMost(const Enclosure<kDigits>& x, double bound) {
  return mpfi_cmp_d(x.backend().data(), bound) <= 0;
}
/// [−radius, radius]
template <typename T>
T Symmetric(double radius) {
  return mp::hull(T(-radius), T(radius));
}

/// x + ε d, ε² = 0: a double with its derivative along one direction [Clifford 1873].
struct Dual {
  double x = 0.0, d = 0.0;
  Dual() = default;
  Dual(double value, double slope = 0.0) : x(value), d(slope) {}  // NOLINT(google-explicit-*)

  friend Dual operator+(const Dual& a, const Dual& b) { return {a.x + b.x, a.d + b.d}; }
  friend Dual operator-(const Dual& a, const Dual& b) { return {a.x - b.x, a.d - b.d}; }
  friend Dual operator-(const Dual& a) { return {-a.x, -a.d}; }
  friend Dual operator*(const Dual& a, const Dual& b) { return {a.x * b.x, a.d * b.x + a.x * b.d}; }
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double q = a.x / b.x;
    return {q, (a.d - q * b.d) / b.x};
  }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
};
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.x);
  return {root, a.d / (2.0 * root)};
}
inline Dual sin(const Dual& a) { return {std::sin(a.x), std::cos(a.x) * a.d}; }
inline Dual cos(const Dual& a) { return {std::cos(a.x), -std::sin(a.x) * a.d}; }
inline Dual atan(const Dual& a) { return {std::atan(a.x), a.d / (1.0 + a.x * a.x)}; }
inline Dual acos(const Dual& a) { return {std::acos(a.x), -a.d / std::sqrt(1.0 - a.x * a.x)}; }
inline Dual exp(const Dual& a) { return {std::exp(a.x), std::exp(a.x) * a.d}; }
inline Dual log(const Dual& a) { return {std::log(a.x), a.d / a.x}; }
inline Dual abs(const Dual& a) { return a.x < 0.0 ? -a : a; }
inline bool IsZero(const Dual& a) { return a.x == 0.0 && a.d == 0.0; }
inline bool AtMost(const Dual& a, double bound) { return a.x <= bound; }
template <>
inline Dual Symmetric<Dual>(double /*radius*/) {
  return {};
}

/// While it lives, GMP keeps freed blocks of numbers for the next ones of this thread: half of the
/// time would go into the heap. Blocks are malloc's, and may outlive it.
class NumberPool {
 public:
  NumberPool();
  ~NumberPool();
  NumberPool(const NumberPool&) = delete;
  NumberPool& operator=(const NumberPool&) = delete;

 private:
  void* (*allocate_)(size_t) = nullptr;
  void* (*reallocate_)(void*, size_t, size_t) = nullptr;
  void (*free_)(void*, size_t) = nullptr;
};

}  // namespace mbv::exact
