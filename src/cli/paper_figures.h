// `mbverify figures --paper`.
#pragma once

#include <string>
#include <vector>

#include "cli/json_option.h"
#include "pipeline/figures.h"

namespace mbv {

struct PaperArguments {
  std::string model;                 ///< "list": what there is; "all": every paper
  std::vector<std::string> entries;  ///< empty: all of the paper
  std::string out, page;             ///< page: "" or a file for all of it as Markdown
  FigureOptions options;
};

/// The exit code, after saying what was made.
[[nodiscard]] int PaperFigures(const PaperArguments& arguments, const JsonOption& json);

}  // namespace mbv
