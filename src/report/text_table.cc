#include "report/text_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace mbv {
namespace {

std::string Padded(const std::string& text, int width) {
  return width < 0 ? fmt::format("{:<{}}", text, -width) : fmt::format("{:>{}}", text, width);
}

}  // namespace

TextTable::TextTable(std::string indent, std::vector<TextColumn> columns)
    : indent_(std::move(indent)), columns_(std::move(columns)) {}

std::string TextTable::Head() const {
  std::string line = indent_;
  for (const TextColumn& column : columns_) line += Padded(column.heading, column.width);
  return line;
}

std::string TextTable::Row(const std::vector<std::string>& cells) const {
  std::string line = indent_;
  for (size_t i = 0; i < std::min(cells.size(), columns_.size()); ++i) {
    line += Padded(cells[i], columns_[i].width);
  }
  return line;
}

}  // namespace mbv
