// A table of plain text: its columns are told once, for the headings and for every row.
#pragma once

#include <string>
#include <vector>

namespace mbv {

struct TextColumn {
  std::string heading;
  int width = 0;  ///< characters: above 0 to the right, below 0 to the left; 0: as long as it is
};

class TextTable {
 public:
  /// `indent` stands before every line.
  TextTable(std::string indent, std::vector<TextColumn> columns);

  /// The headings as one line, without its end.
  [[nodiscard]] std::string Head() const;
  /// Cells of the first columns as one line, without its end.
  [[nodiscard]] std::string Row(const std::vector<std::string>& cells) const;

 private:
  std::string indent_;
  std::vector<TextColumn> columns_;
};

}  // namespace mbv
