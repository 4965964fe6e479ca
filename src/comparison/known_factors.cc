#include "comparison/known_factors.h"

#include <cmath>
#include <numbers>

namespace mbv {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr KnownFactor kFactors[] = {
    {1e3, "1000: is the unit kN, mm or ms mistaken?"},
    {1e-3, "1/1000: is the unit kN, mm or ms mistaken?"},
    {1e6, "1000000: is the unit mistaken?"},
    {1e-6, "1/1000000: is the unit mistaken?"},
    {180.0 / kPi, "180/pi: degrees taken for radians?"},
    {kPi / 180.0, "pi/180: radians taken for degrees?"},
    {9.80665, "9.81: N taken for kgf, or a mass for a weight?"},
    {1.0 / 9.80665, "1/9.81: kgf taken for N, or a weight for a mass?"},
    {4.4482216152605, "4.448: N taken for lbf?"},
    {1.0 / 4.4482216152605, "1/4.448: lbf taken for N?"},
    {0.0254, "0.0254: inches taken for metres?"},
    {1.0 / 0.0254, "1/0.0254: metres taken for inches?"},
    {2.0 * kPi, "2 pi: revolutions taken for radians?"},
    {0.5 / kPi, "1/(2 pi): radians taken for revolutions?"},
    {2.0, "2: is something counted twice?"},
    {0.5, "1/2: is it shared between two?"},
};

}  // namespace

const KnownFactor* FindFactor(double factor) {
  for (const KnownFactor& known : kFactors) {
    if (std::abs(factor / known.factor - 1.0) < kSameFactor) return &known;
  }
  return nullptr;
}

}  // namespace mbv
