// What results of all kinds have in common. A kind (motion, stiffness, …) brings measurements and
// one function
//
//   ResultView ViewOf(const KindReport&)
//
// From it the page (page.h, result_html.h), the text for a terminal (terminal_text.h) and
// summary.json (result_json.h) take what every kind reports: title, verdict, findings, checks, what
// was not compared, inputs and versions. Its own sections, tables and fields it adds there.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "comparison/comparison.h"
#include "mechanism/mechanism.h"
#include "report/page.h"

namespace mbv {

struct Timing {
  double analytic_s = 0.0, reference_s = 0.0, simulation_s = 0.0, stock_s = 0.0, render_s = 0.0;
  double foreign_s = 0.0;  ///< programs outside
  double total_s = 0.0;
  double loop_s = 0.0;  ///< inside the step loop of the judged simulation
  long steps = 0;
  /// false: files do not state it, and are the same whenever and wherever the run is repeated.
  bool stated = true;
};

/// What was run, of what, and with what.
struct ResultFrame {
  std::string scenario, scenario_file, mechanism, model_file, description;
  int exit_code = 3;
  Diagnostics findings;  ///< warnings, range violations
  Timing timing;
  std::vector<std::pair<std::string, std::string>> versions;

  [[nodiscard]] std::string title() const { return mechanism + " / " + scenario; }
};

/// A check as it is shown.
struct ShownCheck {
  std::string name, subject;  ///< "simulated_vs_analytic.force_nrmse" and its first part
  std::string title;          ///< shown, with unit
  double value = kNan;
  std::optional<double> limit;  ///< empty: switched off
  bool pass = false;
  std::string where = {};             ///< channel or entry that is worst
  double time_s = kNan;               ///< of that; NaN: not a matter of time
  bool key = true;                    ///< a reader wants it even if it passes
  std::optional<bool> verifies = {};  ///< false: it passes by itself; empty: all of the kind do
  std::string insensitive = {};       ///< why passing verifies nothing; "" if it does
  bool floored = false;               ///< relative to a floor above the quantity
  std::optional<double> stated_limit = {};  ///< the scenario's, where another one was taken
  std::string limit_by = {};                ///< from where then
};

/// How a check ended.
enum class CheckEnd { kOff, kFail, kInsensitive, kByConstruction, kOk };
[[nodiscard]] CheckEnd EndOf(const ShownCheck& check);
/// Its word, the same wherever it is shown.
[[nodiscard]] Cell EndCell(const ShownCheck& check);
/// "d1.force, 0.25 s"; "" without a place.
[[nodiscard]] std::string WhereOf(const ShownCheck& check);

/// "printed", "assumed", "corrected"; "" where no source is stated.
[[nodiscard]] const char* SourceWord(Source source);

/// A result of any kind, as it is shown.
struct ResultView {
  const ResultFrame* frame = nullptr;
  const char* kind = "";  ///< in summary.json; "" for motions, which came first
  bool in_time = true;    ///< what is simulated takes steps: they and other engines are timed
  Verdict verdict = Verdict::kNotRun;
  std::string reason = {};
  std::vector<Caveat> caveats = {};
  Attribution attribution = {};
  std::vector<ShownCheck> checks = {};  ///< off ones included
  std::vector<NotCompared> not_compared = {};
  std::vector<std::pair<std::string, RunSummary>> witnesses = {};  ///< all, run or not
  size_t pairs = 0, pairs_compared = 0, verified = 0;
  /// How many checks passed and verify nothing, and why; in summary.json.
  std::vector<std::pair<const char*, size_t>> empty_counts = {};
  /// The pair that a reader looks at first, and the name of its first check; "" without one.
  std::string main_pair = {}, main_check = {};

  [[nodiscard]] const ShownCheck* FindCheck(const std::string& name) const;
  [[nodiscard]] size_t ran() const;     ///< witnesses
  [[nodiscard]] size_t limits() const;  ///< checks that are not off
};

/// What a comparison says, with its checks; the kind adds its witnesses. `main_metric` stands for
/// the pair that a reader looks at first.
[[nodiscard]] ResultView ViewOfComparison(const ResultFrame& frame, const Comparison& comparison,
                                          Metric main_metric);

/// What several runs came to.
struct RunCounts {
  size_t scenarios = 0, ran = 0, compared = 0, verified = 0;
  size_t bad_input = 0;  ///< not even loaded

  RunCounts& operator+=(const RunCounts& other);
};
[[nodiscard]] RunCounts CountOf(const ResultView& view);

/// The last line over several runs: "5 scenarios: 5 ran, 4 compared, 4 verified".
[[nodiscard]] std::string CountLine(const RunCounts& counts);

struct TableOptions {
  bool color = false;
  bool verbose = false;  ///< also how to read each signal, and what could not be compared
  bool sizing = false;   ///< all figures of the motors, not their margins only
  size_t columns = 0;    ///< of the terminal; 0: no limit
};
/// A result of a kind that a product brings, as it is shown.
class OtherResult {
 public:
  virtual ~OtherResult() = default;
  [[nodiscard]] virtual ResultView View() const = 0;
  [[nodiscard]] virtual std::string Table(const TableOptions& options) const = 0;
  [[nodiscard]] virtual std::string Json() const = 0;  ///< summary.json
};
/// "stabilizing_platform / sea_state: AGREE  simulated vs analytic 4.2e-08 (limit 1.0e-07)".
[[nodiscard]] std::string VerdictLine(const ResultView& view, const TableOptions& options);

// summary.json: what results of every kind write alike.

/// The beginning of summary.json: schema, kind, names and files, verdict with reason, exit code and
/// attribution, checks, checks_off.
[[nodiscard]] nlohmann::ordered_json SummaryHead(const ResultView& view);
/// Its end: timing and versions.
void AddSummaryEnd(const ResultView& view, nlohmann::ordered_json* json);

/// [{what, why}]
[[nodiscard]] nlohmann::ordered_json NotComparedJson(const ResultView& view);
/// How many witnesses ran, pairs were compared, checks passed.
[[nodiscard]] nlohmann::ordered_json CountsJson(const ResultView& view);
[[nodiscard]] nlohmann::ordered_json FindingsJson(const Diagnostics& findings);

/// {name, ran, stop, message}
[[nodiscard]] nlohmann::ordered_json WitnessHead(const std::string& name,
                                                 const RunSummary& summary);
/// Where (and if it runs in time, when) a witness broke down and by how much, if it did.
void AddBreakdown(const ResultView& view, const RunSummary& summary, nlohmann::ordered_json* json);

// The sections that pages of every kind of result have. Each is HTML, or "" when there is nothing
// to show.

/// Title, description and verdict of a result; the kind adds kicker, footer and scripts.
[[nodiscard]] PageHead HeadOf(const ResultView& view);

/// Reason, caveats, attribution, `cards` (HTML of Card()), `about` (HTML), findings.
[[nodiscard]] std::string VerdictHtml(const ResultView& view, const std::string& cards,
                                      const std::string& about);
/// Every check, failed ones first; `note` (HTML) says how to read them.
[[nodiscard]] std::string ChecksHtml(const ResultView& view, const std::string& note);
/// Witnesses that did not run, and what was not compared. Where the verdict's reason states the
/// first failure, it is not said again.
[[nodiscard]] std::string GapsHtml(const ResultView& view, bool reason_tells_failure = false);
/// `sources`: also where values come from.
[[nodiscard]] std::string ParametersHtml(const std::vector<Parameter>& parameters, bool sources);
/// `command` gives the same result again; `times` and `files` say how long it took and what stands
/// beside the page.
[[nodiscard]] std::string ReproduceHtml(const ResultView& view, const std::string& command,
                                        const std::string& times, const std::string& files);

}  // namespace mbv
