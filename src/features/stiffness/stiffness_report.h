// StiffnessReport: everything a stiffness run gave, and its writers (value → text).
#pragma once

#include <string>
#include <vector>

#include "comparison/compare_stiffness.h"
#include "mechanism/mechanism.h"
#include "report/result.h"

namespace mbv {

/// An index of the paper or a general one, as each witness gives it.
struct IndexRow {
  std::string name, unit, meaning;
  std::vector<double> values;  ///< per witness of the report; NaN if it did not run
};

struct PoseEntry {
  std::string name;
  double value = kNan;
  std::string unit;  ///< "m" or "rad"
};

struct StiffnessReport : ResultFrame {
  std::string output;
  std::vector<PoseEntry> pose;
  std::string pose_note;                    ///< where the pose comes from, if not from the scenario
  std::string model;                        ///< the closed form's formulation; "" without one
  Vec3 p_WO = Vec3::Constant(kNan);         ///< the output's origin in the world [m]
  std::vector<StiffnessWitness> witnesses;  ///< in the order in which they are shown
  std::vector<StiffnessWitness> printed;    ///< the paper's own model, or none
  std::vector<PairComparison> printed_pairs;  ///< it against the corrected one
  std::vector<IndexRow> indices;
  std::vector<Vec6> loads;
  std::string loads_text;
  Comparison comparison;
  std::vector<Parameter> parameters;
  std::string command;  ///< "mbverify run FILE …"

  /// The witness whose numbers are shown: the closed form, else the first that ran; null if none.
  [[nodiscard]] const StiffnessWitness* Shown() const;
  /// The first witness with elements' shares; null if none.
  [[nodiscard]] const StiffnessWitness* WithShares() const;
};

/// As what runs scenarios hands it on.
class ShownStiffness final : public OtherResult {
 public:
  explicit ShownStiffness(StiffnessReport report) : report_(std::move(report)) {}
  [[nodiscard]] const StiffnessReport& report() const { return report_; }
  [[nodiscard]] ResultView View() const override;
  [[nodiscard]] std::string Table(const TableOptions& options) const override;
  [[nodiscard]] std::string Json() const override;

 private:
  StiffnessReport report_;
};

/// summary.json; the common fields are those of a motion's.
[[nodiscard]] std::string ToJson(const StiffnessReport& report);

/// stiffness.csv: witness, matrix (K or C), row, column, unit, value; 17 significant digits.
[[nodiscard]] std::string StiffnessCsv(const StiffnessReport& report);
/// loads.csv: per load the wrench and each witness' displacement; 17 significant digits.
[[nodiscard]] std::string LoadsCsv(const StiffnessReport& report);
/// contributions.csv: what each element causes, in parts of one.
[[nodiscard]] std::string ContributionsCsv(const StiffnessReport& report);

/// For a terminal.
[[nodiscard]] std::string ToTable(const StiffnessReport& report, const TableOptions& options);

[[nodiscard]] ResultView ViewOf(const StiffnessReport& report);

/// report.html: one page that needs no other file and no script.
[[nodiscard]] std::string ToHtml(const StiffnessReport& report);

}  // namespace mbv
