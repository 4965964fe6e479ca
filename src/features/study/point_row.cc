#include "features/study/point_row.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/text.h"
#include "base/types.h"

namespace mbv {
namespace {

// In quotes where a comma or a quote would be mistaken; lines stay lines.
std::string NumberField(double value) {
  return std::isfinite(value) ? fmt::format("{:.17g}", value) : "";
}

// The next field of `line`, which is cut off; empty at the end and where quotes are not closed.
std::optional<std::string> TakeField(std::string_view* line, bool* more) {
  if (!*more) return {};
  std::string field;
  size_t at = 0;
  if (!line->empty() && line->front() == '"') {
    for (at = 1;; ++at) {
      if (at >= line->size()) return {};
      if ((*line)[at] == '"' && (at + 1 >= line->size() || (*line)[at + 1] != '"')) break;
      if ((*line)[at] == '"') ++at;
      field += (*line)[at];
    }
    ++at;
  } else {
    at = std::min(line->find(','), line->size());
    field = line->substr(0, at);
  }
  *more = at < line->size() && (*line)[at] == ',';
  if (!*more && at < line->size()) return {};
  line->remove_prefix(*more ? at + 1 : at);
  return field;
}

template <typename Number>
std::optional<Number> NumberOf(const std::optional<std::string>& field) {
  Number number{};
  if (!field) return {};
  const char* end = field->data() + field->size();
  const auto [at, error] = std::from_chars(field->data(), end, number);
  if (error != std::errc() || at != end) return {};
  return number;
}

bool TakeNumbers(std::string_view* line, bool* more, size_t count, std::vector<double>* numbers) {
  for (size_t k = 0; k < count; ++k) {
    const auto field = TakeField(line, more);
    if (!field) return false;
    const auto number = field->empty() ? kNan : NumberOf<double>(field);
    if (!number) return false;
    numbers->push_back(*number);
  }
  return true;
}

}  // namespace

std::string PointHeader(const Study& study) {
  std::string text = "point,seed,exit,reason";
  for (const Factor& factor : study.factors) text += "," + CsvCell(factor.name);
  for (const StudyQuantity& quantity : study.quantities) text += "," + CsvCell(quantity.name);
  return text + "\n";
}

std::string PointLine(const PointRow& row, const Study& study) {
  std::string text =
      fmt::format("{},{},{},{}", row.point, study.design.seed, row.exit_code, CsvCell(row.reason));
  for (const double value : row.varied) text += "," + NumberField(value);
  for (const double value : row.values) text += "," + NumberField(value);
  return text + "\n";
}

std::optional<PointRow> ReadPointLine(std::string_view line, const Study& study) {
  bool more = true;
  const auto point = NumberOf<std::uint64_t>(TakeField(&line, &more));
  const auto seed = NumberOf<std::uint64_t>(TakeField(&line, &more));
  const auto exit_code = NumberOf<int>(TakeField(&line, &more));
  const auto reason = TakeField(&line, &more);
  if (!point || seed != study.design.seed || !exit_code || !reason) return {};
  PointRow row{
      .point = *point, .exit_code = *exit_code, .reason = *reason, .varied = {}, .values = {}};
  if (!TakeNumbers(&line, &more, study.factors.size(), &row.varied)) return {};
  if (!TakeNumbers(&line, &more, study.quantities.size(), &row.values)) return {};
  if (more) return {};
  return row;
}

}  // namespace mbv
