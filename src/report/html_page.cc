// report.html of a motion: what its page has beyond those of other kinds, data and script behind
// it.
#include <fmt/format.h>

#include <algorithm>

#include <cmath>

#include "core/inputs.h"
#include "core/markup.h"
#include "core/sha256.h"
#include "report/html_assets.h"
#include "report/html_plots.h"
#include "report/html_report.h"
#include "report/html_tables.h"
#include "report/html_text.h"
#include "report/motion_tables.h"
#include "report/own_file_text.h"
#include "report/pair_matrix.h"
#include "report/reference_table.h"
#include "report/result_html.h"
#include "report/sizing.h"

namespace mbv {
namespace {

constexpr const char* kHowToReadChecks =
    "The margin is the limit over the value; a full bar is ten decimal digits. Held: a drive "
    "motion compared with itself, which verifies nothing.";

class PageWriter {
 public:
  explicit PageWriter(const HtmlInput& input)
      : input_(input), report_(*input.report), view_(ViewOf(report_)) {}

  std::string Write() {
    page_.Add("Verdict", "Verdict", VerdictHtml(view_, Cards(), About()));
    Interactive();
    Pictures();
    page_.Add("Checks", "Checks",
              PairMatrixHtml(report_.comparison) + ChecksHtml(view_, kHowToReadChecks));
    page_.Add("The table in the reference's place", "Table", ReferenceTableHtml(report_));
    page_.Add("Tables that command the motion", "Tables", MotionTableHtml(report_));
    page_.Add("Drives", "Drives", DrivesHtml(report_));
    page_.Add("What drives and joints bear", "Loads", LoadsHtml(report_));
    page_.Add("Motors", "Motors", SizingHtml(report_));
    page_.Add("The simulator's own error", "Engine", EngineHtml(report_));
    page_.Add("Your own file, run as it is", "File", OwnFileHtml(report_.own_file.get()));
    page_.Add("Energy", "Energy", EnergyHtml(report_));
    page_.Add("What could not be compared", "Gaps", GapsHtml(view_));
    page_.Add("The paper's equations", "Equations", AuditHtml(input_.audit));
    page_.Add("How to read the force signals", "Signals", SignalsHtml(report_));
    page_.Add("Parameters", "Parameters", ParametersHtml(input_.mechanism->parameters, true));
    page_.Add("Reproduce this run", "Reproduce", Reproduce());
    return page_.Write(Head());
  }

 private:
  // How it was simulated, and what drives it.
  std::string About() const {
    std::string html = Escape(Sentence(report_.simulation));
    if (!report_.comparison.driving.empty()) {
      html += " " + Escape(Sentence(report_.comparison.driving));
    }
    if (report_.start_window_s > 0.0) {
      html += fmt::format(" Start-up window: forces before {:g} s are not judged.",
                          report_.start_window_s);
    }
    return html;
  }

  std::string Cards() const {
    std::string html;
    if (const PairComparison* pair = MainPair(report_.comparison)) {
      html += ForceCards(*pair);
    }
    for (const WitnessMetrics& witness : report_.comparison.witnesses) {
      if (!IsEngine(witness.witness)) continue;
      const auto add = [&](Metric metric, const char* title, const char* unit) {
        const auto found = witness.metrics.find(metric);
        if (found == witness.metrics.end()) return;
        html += Card(title, fmt::format("{:.1e}{}", found->second.value, unit),
                     fmt::format("simulated, worst at {:.4g} s", found->second.time_s));
      };
      add(Metric::kClosureM, "Largest loop gap", " m");
      add(Metric::kPower, "Power balance", "");
    }
    return html + CountCards();
  }

  std::string ForceCards(const PairComparison& pair) const {
    std::string html;
    const auto nrmse = pair.metrics.find(Metric::kForceNrmse);
    const bool is_floored = nrmse != pair.metrics.end() && nrmse->second.floored;
    const std::string floored = is_floored ? ", floored" : "";
    if (nrmse != pair.metrics.end()) {
      const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_nrmse");
      html +=
          Card("Drive force error, RMS", fmt::format("{:.1e}", nrmse->second.value),
               pair.measured + " against " + pair.truth +
                   (check != nullptr && check->limit ? fmt::format(", limit {:.0e}", *check->limit)
                                                     : "") +
                   floored);
    }
    if (std::isfinite(pair.digits)) {
      html += Card("Matching digits", fmt::format("{:.1f}", pair.digits),
                   "of all drive forces" + floored);
    }
    const auto worst = pair.metrics.find(Metric::kForceMax);
    if (worst != pair.metrics.end()) {
      html += Card("Worst sample", fmt::format("{:.1e}", worst->second.value),
                   fmt::format("{} at {:.4g} s", worst->second.channel, worst->second.time_s));
    }
    return html;
  }

  std::string CountCards() const {
    return Card("Ran · compared · verified",
                fmt::format("{} · {} · {}", view_.ran(), view_.pairs_compared, view_.verified),
                fmt::format("witnesses of {} · pairs of {} · checks of {}",
                            std::max<size_t>(3, view_.witnesses.size()),
                            std::max<size_t>(3, view_.pairs), view_.limits()));
  }

  // Filled by the script; without it, plots that do not move.
  void Interactive() {
    page_.Add(
        "Replay", "Replay",
        "<noscript><p class=\"faint\">The replay needs JavaScript; the pictures below do not.</p>"
        "</noscript>\n<div id=\"replay-view\"></div>\n");
    page_.Add("Signals over time", "Plots",
              "<noscript><p class=\"faint\">Without JavaScript the plots do not zoom.</p>\n" +
                  StaticPlotsHtml(report_) + "</noscript>\n<div id=\"plot-view\"></div>\n");
  }

  void Pictures() {
    std::string html;
    for (const HtmlPicture& picture : input_.pictures) {
      const std::string name = Escape(picture.name);
      html += fmt::format(
          "<a href=\"snapshots/{2}\"><img loading=\"lazy\" alt=\"The mechanism in the simulation, "
          "{0}\" src=\"data:image/png;base64,{1}\"></a>\n",
          name, Base64(std::string_view(picture.png)), EncodeLink(picture.name));
    }
    if (html.empty()) return;
    page_.Add("Snapshots", "Snapshots",
              "<div class=\"pictures\">\n" + html +
                  "</div>\n<p class=\"faint\">Small copies; the originals are in snapshots/ beside "
                  "this page.</p>\n");
  }

  // Only our own script runs: the one in the page by its hash, a shared one by its origin.
  [[nodiscard]] std::string ScriptSource() const {
    static const std::string hash = CspHash(PageScript());
    return input_.script_link.empty() ? hash : "'self'";
  }

  [[nodiscard]] std::string ScriptElement() const {
    if (input_.script_link.empty()) {
      return fmt::format("<script>{}</script>", PageScript());
    }
    return fmt::format("<script src=\"{}\"></script>", EncodeLink(input_.script_link));
  }

  [[nodiscard]] PageHead Head() const {
    PageHead head = HeadOf(view_);
    head.kicker = "mbverify report";
    head.footer =
        "Written by mbverify. Forces, errors and poses are embedded; all digits are in traces.csv "
        "and summary.json.";
    head.script_source = ScriptSource();
    head.scripts = "<script type=\"application/json\" id=\"page-data\">" + PageData(input_) +
                   "</script>\n" + ScriptElement() + "\n";
    return head;
  }

  [[nodiscard]] std::string Reproduce() const {
    std::string command = "mbverify run " + report_.scenario_file;
    for (const std::string& argument : input_.arguments) command += " " + argument;
    return ReproduceHtml(view_, command, TimesText(report_),
                         "Files beside this page: summary.json (every number), traces.csv (17 "
                         "digits), model.xml (the MJCF as simulated).");
  }

  const HtmlInput& input_;
  const Report& report_;
  const ResultView view_;
  Page page_;
};

}  // namespace

std::string SharedScriptName() {
  return fmt::format("report-{}.js", ContentFingerprint(std::string(PageScript())));
}

std::string ToHtml(const HtmlInput& input) { return PageWriter(input).Write(); }

}  // namespace mbv
