// Figures as another program reads them.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <regex>
#include <string>
#include <vector>

#include "plot/draw.h"
#include "tests/support/reports.h"
#include "tests/support/test_folder.h"

namespace mbv::test {

/// What a command prints.
inline std::string OutputOf(const std::string& command) {
  std::string text;
  std::FILE* pipe = popen(command.c_str(), "r");
  std::array<char, 4096> part{};
  for (size_t n = 1; pipe != nullptr && n > 0;) {
    n = std::fread(part.data(), 1, part.size(), pipe);
    text.append(part.data(), n);
  }
  if (pipe != nullptr) pclose(pipe);
  return text;
}

/// The texts of a PDF file, by poppler.
inline std::string TextsOf(const std::string& pdf) {
  const TestFolder folder("pdf");
  return OutputOf("pdftotext -layout '" + folder.Write("a.pdf", pdf) + "' -");
}

/// A stroked path of an SVG file: its colour, dashes and points [pt].
struct SvgPath {
  std::string color, dashes;
  FigurePoints points;
};
inline std::vector<SvgPath> PathsOf(const std::string& svg) {
  std::vector<SvgPath> paths;
  static const std::regex path("<path style=\"fill:none;([^\"]*)\" d=\"([^\"]*)\"");
  for (std::sregex_iterator at(svg.begin(), svg.end(), path), end; at != end; ++at) {
    SvgPath found;
    const std::string style = (*at)[1];
    std::smatch word;
    if (std::regex_search(style, word, std::regex("stroke:([^;]*)"))) found.color = word[1];
    if (std::regex_search(style, word, std::regex("stroke-dasharray:([^;]*)"))) {
      found.dashes = word[1];
    }
    std::istringstream numbers((*at)[2]);
    std::string letter;
    for (double x = 0, y = 0; numbers >> letter;) {
      if (letter == "Z") continue;
      numbers >> x >> y;
      found.points.emplace_back(x, y);
    }
    paths.push_back(std::move(found));
  }
  return paths;
}

/// Three agreeing witnesses with all their samples.
inline Report SampledReport(const synthetic::Case& c = {}) {
  Report report = MakeReport(c);
  report.witnesses = {{"analytic", c.analytic_summary, c.analytic},
                      {"reference", c.reference_summary, c.reference},
                      {"simulated", c.simulated_summary, c.simulated}};
  return report;
}

}  // namespace mbv::test
