#include "table/numbers.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace mbv {
namespace {

constexpr size_t kLongestNumber = 60;
constexpr int kDoubleDigits = 17;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// "NaN", "-inf", "#N/A", "1.#QNAN", "-nan(ind)".
bool IsNotFinite(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  if (text.empty() || text.size() > 12) return false;
  if (text[0] == '#' || text.find('#') != std::string_view::npos) return true;
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower == "nan" || lower == "inf" || lower == "infinity" || lower == "na" ||
         lower == "n/a" || lower == "null" || lower.starts_with("nan(");
}

// Digits of a number that is known to be well-formed.
void CountDigits(std::string_view text, CellNumber* cell) {
  bool behind = false, started = false;
  int behind_count = 0, exponent = 0;
  char last = '1';
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '.') {
      behind = true;
    } else if (c == 'e') {
      const size_t skip = text[i + 1] == '+' ? 2 : 1;
      std::from_chars(text.data() + i + skip, text.data() + text.size(), exponent);
      break;
    } else if (IsDigit(c)) {
      started = started || c != '0';
      cell->significant += started ? 1 : 0;
      behind_count += behind ? 1 : 0;
      last = c;
    }
  }
  cell->decimals = behind_count - exponent;
  cell->trailing_zero = behind && last == '0';
}

}  // namespace

CellNumber ReadCell(std::string_view text, bool decimal_comma) {
  CellNumber cell;
  if (text.empty()) {
    cell.kind = CellNumber::Kind::kEmpty;
    return cell;
  }
  const bool plus = text[0] == '+' && text.size() > 1 && text[1] != '-';
  const std::string_view digits = plus ? text.substr(1) : text;
  std::array<char, kLongestNumber> buffer{};
  if (digits.size() > buffer.size()) return cell;
  for (size_t i = 0; i < digits.size(); ++i) {
    char c = digits[i];
    if (decimal_comma && c == '.') return cell;  // a thousands point
    if (decimal_comma && c == ',') c = '.';
    if (c == 'E' || c == 'D' || c == 'd') c = 'e';
    buffer[i] = c;
  }
  const std::string_view plain(buffer.data(), digits.size());
  const auto [end, error] = std::from_chars(plain.data(), plain.data() + plain.size(), cell.value);
  if (end != plain.data() + plain.size() || error == std::errc::invalid_argument) {
    cell.kind = IsNotFinite(text) ? CellNumber::Kind::kNotFinite : CellNumber::Kind::kText;
    return cell;
  }
  if (error != std::errc() || !std::isfinite(cell.value)) {
    cell.kind = CellNumber::Kind::kNotFinite;
    return cell;
  }
  cell.kind = CellNumber::Kind::kNumber;
  CountDigits(plain, &cell);
  return cell;
}

void DigitStatistics::Add(const CellNumber& cell) {
  // Digits beyond a double's are none; a step of zero stays possible for them.
  decimals_ = count_ == 0 ? cell.decimals : std::max(decimals_, cell.decimals);
  significant_ = std::max(significant_, std::min(cell.significant, kDoubleDigits));
  if (count_ == 1) step_ = cell.value - last_;
  if (count_ >= 2) {
    const double tolerance = 1e-9 * std::abs(step_) + 4e-16 * std::abs(cell.value);
    equal_steps_ = equal_steps_ && std::abs(cell.value - last_ - step_) <= tolerance;
  }
  last_ = cell.value;
  ++count_;
  if (distinct_.size() < kTelling &&
      std::find(distinct_.begin(), distinct_.end(), cell.value) == distinct_.end()) {
    distinct_.push_back(cell.value);
  }
}

std::vector<double> PrintedSteps(std::span<const double> values, const DigitStatistics& digits,
                                 int table_significant) {
  const bool borrow = digits.says_little() && table_significant > digits.significant();
  const int significant = borrow ? table_significant : digits.significant();
  const double fixed = borrow ? 0.0 : std::pow(10.0, -digits.decimals());
  std::vector<double> steps;
  steps.reserve(values.size());
  for (const double value : values) {
    double step = fixed;
    if (value != 0.0 && significant > 0) {
      const double power = std::floor(std::log10(std::abs(value)));
      step = std::max(step, std::pow(10.0, power - significant + 1));
    }
    steps.push_back(step);
  }
  return steps;
}

}  // namespace mbv
