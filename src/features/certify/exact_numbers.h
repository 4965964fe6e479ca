// Intervals of 113 and of 240 bits that hold every real result (MPFI, on MPFR).
#pragma once

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

}  // namespace mbv::exact
