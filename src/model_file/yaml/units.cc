#include "model_file/yaml/units.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>

namespace mbv {
namespace {

constexpr UnitSuffix kUnitSuffixes[] = {kDeg, kMm};

}  // namespace

double FromDegrees(double value) {
  constexpr double kHalfTurn_deg = 180.0;
  const double product = value * std::numbers::pi;
  if (!std::isfinite(product)) return product;
  // What the product and the quotient lose in rounding, exactly.
  const double lost = std::fma(value, std::numbers::pi, -product);
  const double quotient = product / kHalfTurn_deg;
  return quotient + (std::fma(-quotient, kHalfTurn_deg, product) + lost) / kHalfTurn_deg;
}

double FromMillimetres(double value) {
  double metres = value / 1000.0;
  if (!std::isfinite(value)) return metres;
  // The shortest decimal that is this number is the one that was typed.
  const std::string typed = fmt::format("{}", value);
  const size_t e = typed.find('e');
  const int exponent = e == std::string::npos ? 0 : std::stoi(typed.substr(e + 1));
  const std::string moved = fmt::format("{}e{}", typed.substr(0, e), exponent - 3);
  // Below the smallest number this says nothing, and the quotient stays.
  std::from_chars(moved.data(), moved.data() + moved.size(), metres);
  return metres;
}

NameInUnit SplitUnit(const std::string& given,
                     const std::function<bool(const std::string&)>& is_known) {
  if (is_known(given)) return {given, kPlain};
  for (const UnitSuffix& unit : kUnitSuffixes) {
    if (!given.ends_with(unit.suffix)) continue;
    std::string name = given.substr(0, given.size() - unit.suffix.size());
    if (is_known(name)) return {std::move(name), unit};
  }
  return {given, kPlain};
}

NameInUnit SplitUnit(const std::string& given) {
  return SplitUnit(given, [&](const std::string& name) { return name.size() < given.size(); });
}

std::vector<std::string> InEveryUnit(const std::string& key) {
  std::vector<std::string> keys = {key};
  for (const UnitSuffix& unit : kUnitSuffixes) keys.push_back(key + std::string(unit.suffix));
  return keys;
}

}  // namespace mbv
