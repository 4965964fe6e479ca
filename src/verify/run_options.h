// What a run of a scenario is asked for, and what it gives, whatever the kind of scenario.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "plot/figure.h"
#include "report/report.h"
#include "scenario/load_scenario.h"
#include "verify/program_consent.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct RunOptions {
  ScenarioOptions scenario;
  ProgramConsent programs;  ///< that it names
  std::string out_dir;      ///< results go to out_dir/<mechanism>/<scenario>/; "" writes nothing
  bool pictures = true;     ///< needs out_dir
  bool page = true;         ///< report.html; needs out_dir
  bool timed = true;        ///< files state how long it took: then no two runs write the same bytes
  std::vector<std::string>
      data;                 ///< words of report/data/data_file.h: traces in these formats, too
  std::string script_link;  ///< the page's script, relative to the result's folder; "": in the page
  /// Folder that the runs of one regression share: each paper's equations are audited once for all
  /// their pages; "": by every run.
  std::string kept_audits;
  /// The user's MJCF that the scenario was made of: it is run as it is, in addition; "": none.
  std::string source_model;
  std::string source_base;  ///< LoadOptions::base with which it was made
  /// Files of a product that stand in the result's folder, too: names and contents made of what the
  /// run of a motion gave; null: none.
  std::function<std::vector<std::pair<std::string, std::string>>(const Report&)> more_files;
  /// What a product does with a run of a motion that was judged, before anything is written; null:
  /// nothing.
  std::function<void(const Prepared&, Report*)> after_judgement;
  ProgressFunction progress;
};

struct RunOutcome {
  int exit_code = 4;                         ///< 0 agree, 1 disagree, 2 bad input, 3 could not run
  Diagnostics diagnostics;                   ///< bad input and warnings
  std::optional<Report> report;              ///< of a motion; empty after bad input
  std::shared_ptr<const OtherResult> other;  ///< of another kind; null after bad input
  std::vector<FigureSpec> figures;           ///< that the scenario of a motion composes
  std::string folder;                        ///< what was written; "" if nothing

  /// Empty after bad input.
  [[nodiscard]] std::optional<ResultView> View() const {
    if (report) return ViewOf(*report);
    return other == nullptr ? std::nullopt : std::optional(other->View());
  }
};

}  // namespace mbv
