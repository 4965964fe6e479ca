// RowMeter: collects the residuals of one equation over many states into an AuditRow.
#pragma once

#include <cmath>
#include <string>
#include <utility>

#include "features/equation_audit/audit.h"

namespace mbv {

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
