// models/NAME/paper.yaml: the figures and tables that a paper prints of its mechanism, what they
// are computed from here, the numbers that are printed, and what the paper says of them
// (docs/results/paper_figures.md).
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "model_file/yaml/value_reader.h"
#include "plot/figure.h"

namespace mbv {

/// A witness of another run, shown and compared beside those of the entry's own.
struct BesideRun {
  std::string name;  ///< what it is called here
  PlacedText scenario, witness;
};

/// Printed numbers of some signals, as a witness of their own.
struct PrintedNumbers {
  std::string name;             ///< what they are called: "theory as printed"
  std::string from;             ///< where they are printed: "Table 2"
  std::vector<double> at = {};  ///< times [s], or numbers of the loads
  PlacedText unit;              ///< of all values
  std::vector<std::pair<PlacedText, std::vector<double>>> signals = {};
};

/// How a statement is measured.
enum class PaperMeasure {
  kRange,        ///< smallest and largest value of `signals` by `of`
  kLargest,      ///< largest magnitude of them; with `at_s` of those times
  kDifference,   ///< largest |of − to|
  kShare,        ///< the same over the largest |to| of all signals [%]
  kBeyond,       ///< share of values with |of − to| > `beyond` · |to| [%]
  kMirror,       ///< of map `map`: largest |κ(x, y) − κ(y, x)| over the largest κ [%]
  kMirrorPair,   ///< largest |κ(x, y) of `map` − κ(y, x) of `other`| over the largest κ [%]
  kMedianRatio,  ///< median of `map` over that of `other`
  kWorkspace,    ///< a measure of the workspace, by its name
  kCount_,
};
/// "range", "largest", …, in the order of PaperMeasure.
[[nodiscard]] const std::vector<std::string>& PaperMeasureWords();

/// What a paper says of a figure, and how much of it is true of what is computed.
struct PaperStatement {
  std::string says, where;  ///< "agree to 0.1 kN", "section 4"
  PaperMeasure measure = PaperMeasure::kRange;
  std::vector<PlacedText> signals = {};
  PlacedText of = {}, to = {}, unit = {};
  std::vector<double> at_s = {};
  double beyond = kNan;
  size_t map = 0, other = 0;         ///< counted from 0
  PlacedText name = {};              ///< of a workspace's measure
  double printed = kNan;             ///< in `unit`; NaN: no number is printed
  std::optional<size_t> panel = {};  ///< in which a line stands at the printed number
};

struct PaperColumn {
  std::string title;
  PlacedText of, signal, unit;
  int digits = 3;  ///< behind the point
};

struct PaperMap {
  PlacedText map, index;  ///< as `mbverify stiffness --map` and `--index` take them
  std::string label;      ///< markup; behind the index, beside the colours
};

/// One figure or table.
struct PaperEntry {
  PlacedText name;             ///< "fig11"
  std::string title, caption;  ///< what it shows; more of it for the paper's text
  PlacedText scenario;         ///< below scenarios/NAME; "" of a workspace
  PlacedText section;          ///< a file of the workspace; "": none
  std::vector<BesideRun> beside = {};
  std::vector<PrintedNumbers> printed = {};
  double width_mm = kNan, height_mm = kNan;  ///< NaN: the style's
  std::vector<PanelSpec> panels = {};
  std::vector<PaperMap> maps = {};
  std::string head;  ///< of a table's first column: `at` of the printed numbers
  std::vector<PaperColumn> columns = {};
  std::vector<PaperStatement> statements = {};
  std::string differs;                 ///< why the printed one does; "" if it does not
  std::vector<PlacedText> audit = {};  ///< rows of the equation audit that say so
};

struct PaperFile {
  std::string file;
  std::string source;  ///< authors, title, journal, year
  std::vector<PaperEntry> entries;
  /// What is printed and not computed: its name, and why.
  std::vector<std::pair<std::string, std::string>> left_out;
};

/// All findings go to `diagnostics`; empty after an error. Scenarios, signals and units are checked
/// where they are known (features/paper/paper_figures.h).
[[nodiscard]] std::optional<PaperFile> LoadPaper(const std::string& file, Diagnostics* diagnostics);
[[nodiscard]] std::optional<PaperFile> LoadPaperText(const std::string& text,
                                                     const std::string& file,
                                                     Diagnostics* diagnostics);

// Reads the parts of an entry of paper.yaml.

class PaperParts {
 public:
  PaperParts(YamlReader* yaml, ValueReader* values) : yaml_(*yaml), values_(values) {}

  std::string Words(const YamlMap& map, const char* key);
  std::string RequiredWords(const YamlMap& map, const char* key);
  PlacedText Placed(const YamlMap& map, const char* key);
  double Number(const YamlMap& map, const char* key);
  /// One text or a list of them.
  std::vector<PlacedText> List(const YamlNode& node, const std::string& path);

  std::vector<BesideRun> Beside(const YamlMap& map);
  std::vector<PrintedNumbers> Printed(const YamlMap& map);
  /// `panels:`, `maps:` and `table:`.
  void Drawn(const YamlMap& map, PaperEntry* entry);
  void Says(const YamlMap& map, std::vector<PaperStatement>* statements);

 private:
  std::vector<double> Numbers(const YamlMap& map, const char* key);
  PrintedNumbers PrintedOf(const YamlEntry& at, const std::string& path);
  PaperMap MapOf(const YamlMap& map);
  void Table(const YamlMap& map, PaperEntry* entry);
  PaperStatement Statement(const YamlMap& map);
  void CheckStatement(const YamlMap& map, const PaperStatement& statement);
  size_t Index(const YamlMap& map, const char* key, size_t otherwise);

  YamlReader& yaml_;
  ValueReader* values_;
};

}  // namespace mbv
