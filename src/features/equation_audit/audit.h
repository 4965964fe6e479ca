// Equation audit: every numbered equation of a paper as printed and as corrected, each measured
// against an independent computation over seeded states.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "report/html_report.h"

namespace mbv {

enum class AuditVerdict {
  kOk,               ///< as printed: right
  kWrong,            ///< as printed: wrong; the corrected form is right
  kApproximation,    ///< as printed: as near to the exact form as an approximation is said to be
  kWrongAndUnfixed,  ///< the corrected form misses its limit too: a defect of ours
  kNearly,           ///< of a file: right to a few digits, and not said to be an approximation
  kWrongAsGiven,     ///< of a file: wrong, and no correction is given
  kNotTestable,      ///< a label, a choice or a claim that no residual measures; the note says why
};

/// One row of the audit table.
struct AuditRow {
  std::string equation{};   ///< "(6) M", "(17)", "section 4 data"
  std::string erratum{};    ///< "E2" or ""
  std::string printed{};    ///< the form as printed, in plain text
  std::string corrected{};  ///< the corrected form; "" when the print is right
  double residual_printed =
      0.0;  ///< largest |difference| of the print; NaN if it cannot be evaluated
  double residual_corrected = 0.0;  ///< largest |difference| of the corrected form (of the print
                                    ///< when it is right)
  double scale = 1.0;               ///< largest |value| of the quantity, same unit
  double approximation = 0.0;  ///< how far an approximation may be off, same unit; 0: it is none
  double limit = 0.0;  ///< residual_corrected must stay at or below this (derived, see note)
  std::string unit{};
  AuditVerdict verdict = AuditVerdict::kWrongAndUnfixed;
  std::string note{};                ///< what it was compared with, and what the difference means
  double digits = 0.0;               ///< right digits of the print
  std::vector<std::string> slips{};  ///< what would make it right, the simplest first
};

/// The verdict that the numbers of a row give: kOk or kWrong when the corrected form is within its
/// limit and the print is or is not, kApproximation where the print keeps `approximation`;
/// kWrongAndUnfixed otherwise.
[[nodiscard]] AuditVerdict VerdictOf(const AuditRow& row);

struct AuditTable {
  std::string mechanism;
  std::string source;  ///< the paper
  std::vector<AuditRow> rows{};
  bool of_file = false;  ///< of a user's file of equations
};

/// Computes a mechanism's table. `models_dir` holds <mechanism>/model.yaml.
using AuditFunction = AuditTable (*)(const std::string& models_dir);

struct AuditEntry {
  std::string mechanism;
  AuditFunction run = nullptr;
};
[[nodiscard]] std::span<const AuditEntry> Audits();

[[nodiscard]] const char* ToText(AuditVerdict verdict);

/// How residuals are written: as measured, or stable across machines (a residual within its limit
/// is roundoff and shows as "≤ limit"; one above it is a fact and shows with two digits).
enum class AuditNumbers { kStable, kMeasured };

/// Markdown of a table, one line per row.
[[nodiscard]] std::string ToMarkdown(const AuditTable& table,
                                     AuditNumbers numbers = AuditNumbers::kStable);

/// The text of docs/results/equation_audit.md: every registered mechanism's table, stable numbers.
[[nodiscard]] std::string AuditDocument(const std::string& models_dir);

// The audit of a page as JSON, so that the runs of one regression compute it once.

[[nodiscard]] std::string ToJson(const HtmlAudit& audit);
/// Empty when the text is not what ToJson() wrote.
[[nodiscard]] std::optional<HtmlAudit> AuditFromJson(const std::string& text);

// The audit of the equations of a file: each numbered equation against the reference at random
// states, and the usual slips of those that are wrong.

struct FileAuditOptions {
  bool search = true;      ///< for slips
  int samples = 0;         ///< states; 0: as many as the file says
  std::string model = {};  ///< in the place of the file's own; "": that one
  std::function<void(const std::string& equation, double fraction)> progress = {};
};

/// Empty after a finding that leaves nothing to say. A print that cannot be evaluated is a row;
/// functions that are missing, names and quantities that are unknown, are errors.
[[nodiscard]] std::optional<AuditTable> AuditFile(const std::string& file,
                                                  const FileAuditOptions& options,
                                                  Diagnostics* diagnostics);

// RowMeter: collects the residuals of one equation over many states into an AuditRow.

/// A row's texts and limit, before anything is measured.
inline AuditRow TextRow(std::string equation, std::string printed, std::string corrected,
                        std::string unit, double limit, std::string note) {
  AuditRow row;
  row.equation = std::move(equation);
  row.printed = std::move(printed);
  row.corrected = std::move(corrected);
  row.unit = std::move(unit);
  row.limit = limit;
  row.note = std::move(note);
  return row;
}

class RowMeter {
 public:
  /// `row` carries the texts, unit and limit; its residuals and scale are measured here.
  explicit RowMeter(AuditRow row) : row_(std::move(row)) {
    row_.residual_printed = row_.residual_corrected = row_.scale = 0.0;
  }

  /// One state of an equation that is right as printed.
  void Add(double truth, double printed) { Add(truth, printed, printed); }
  /// One state of an equation that needs a correction.
  void Add(double truth, double printed, double corrected) {
    Raise(std::abs(printed - truth), &row_.residual_printed);
    Raise(std::abs(corrected - truth), &row_.residual_corrected);
    Raise(std::abs(truth), &row_.scale);
  }

  [[nodiscard]] AuditRow Finish() {
    row_.verdict = VerdictOf(row_);
    return row_;
  }

 private:
  // A NaN sticks, so that it can never look like agreement.
  static void Raise(double value, double* largest) {
    if (!(value <= *largest) && !std::isnan(*largest)) *largest = value;
  }

  AuditRow row_;
};

}  // namespace mbv
