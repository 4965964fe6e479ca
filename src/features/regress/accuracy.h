// The accuracy tables of the documents, filled from results.
//
// A table between the lines
//   <!-- accuracy: written by mbverify regress --tables -->
//   <!-- accuracy: end -->
// has scenarios (`model/case`) in its first column; what stands in the others follows from their
// headings. Which scenarios and which headings is the document's choice, the numbers are not.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

/// summary.json of a scenario ("spr_tripod/default"), or nothing.
using SummaryOf = std::function<std::optional<std::string>(const std::string& scenario)>;

/// One number of a table.
struct AccuracyCell {
  std::string scenario, heading;
  std::string text;  ///< as it stands in the document
};
/// All cells of all tables of a document.
[[nodiscard]] std::vector<AccuracyCell> AccuracyCells(const std::string& document);

/// What stands in a cell: "1.6e-13", "2.1e-06 m", "1 ms", "inverse"; "–" where it was not measured.
/// Empty for a heading that is not known or text that is not a summary.
[[nodiscard]] std::optional<std::string> AccuracyText(const std::string& heading,
                                                      const std::string& summary);

/// The document with its tables filled. Rows without a summary stay as they are.
[[nodiscard]] std::string FillAccuracyTables(const std::string& document, const SummaryOf& summary);

/// True if two texts say the same on another machine: words are equal, numbers agree to a factor of
/// two or are both round-off.
[[nodiscard]] bool SameAccuracy(const std::string& a, const std::string& b);

}  // namespace mbv
