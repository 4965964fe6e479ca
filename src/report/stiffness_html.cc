// The page of a stiffness run's report.html.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "report/html_assets.h"
#include "report/html_text.h"
#include "report/stiffness_report.h"

namespace mbv {
namespace {

class StiffnessPageWriter {
 public:
  explicit StiffnessPageWriter(const StiffnessReport& report) : report_(report) {}

  std::string Write() {
    Add("Verdict", "Verdict", VerdictHtml());
    Add("Stiffness", "Stiffness", StiffnessMatricesHtml(report_));
    Add("Where it is weak", "Weakness", WeaknessHtml(report_));
    Add("What causes the compliance", "Elements", ContributionsHtml(report_));
    Add("Displacements under loads", "Loads", LoadsHtml(report_));
    Add("Checks", "Checks", ChecksHtml());
    Add("What could not be compared", "Gaps", GapsHtml());
    Add("Parameters", "Parameters", ParametersHtml());
    Add("Reproduce this run", "Reproduce", ReproduceHtml());
    return Assemble();
  }

 private:
  std::string Title() const { return report_.mechanism + " / " + report_.scenario; }

  std::string Word() const {
    switch (report_.comparison.verdict) {
      case Verdict::kAgree:
        return "Agree";
      case Verdict::kDisagree:
        return "Disagree";
      case Verdict::kNotRun:
        return "Not run";
    }
    return "?";
  }

  void Add(const std::string& title, const std::string& link, const std::string& content) {
    if (content.empty()) return;
    std::string id = link;
    id[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(id[0])));
    nav_ += fmt::format("<a href=\"#{}\">{}</a>\n", id, link);
    main_ +=
        fmt::format("<section id=\"{}\"><h2>{}</h2>\n{}</section>\n", id, Escape(title), content);
  }

  std::string VerdictHtml() const {
    const StiffnessComparison& comparison = report_.comparison;
    std::string html = "<p class=\"reason\">" + Escape(comparison.reason) + ".</p>\n";
    if (const Attribution& attribution = comparison.attribution; !attribution.text.empty()) {
      html += fmt::format("<p class=\"attribution{}\">{}.</p>\n",
                          attribution.odd_one_out.empty() ? "" : " odd", Escape(attribution.text));
    }
    html += "<dl class=\"cards\">\n" + Cards() + "</dl>\n<p class=\"faint\">" + PoseText();
    if (!report_.findings.empty()) {
      html += "<ul class=\"findings\">\n";
      for (const Finding& finding : report_.findings.findings()) {
        html += "<li>" + Escape(ToText(finding)) + "</li>\n";
      }
      html += "</ul>\n";
    }
    return html;
  }

  std::string PoseText() const {
    std::string text = "Stiffness of " + Escape(report_.output) + " with all drives held, at ";
    for (const PoseEntry& entry : report_.pose) {
      text += fmt::format("{} = {:.6g} {}, ", Escape(entry.name), entry.value, entry.unit);
    }
    text.resize(text.size() - 2);
    text += ".";
    if (!report_.pose_note.empty()) text += " " + Escape(report_.pose_note) + ".";
    return text + "</p>\n";
  }

  std::string Cards() const {
    std::string html;
    const auto entry = [&](const char* pair, const char* title) {
      const StiffnessCheck* check =
          report_.comparison.FindCheck(std::string(pair) + ".stiffness_entry");
      if (check == nullptr) return;
      html += Card(title, fmt::format("{:.1e}", check->value),
                   Spaced(pair) + ", worst at " + check->where +
                       (check->limit ? fmt::format(", limit {:.0e}", *check->limit) : ""));
    };
    entry("simulated_vs_analytic", "Stiffness difference");
    entry("reference_vs_analytic", "Stiffness difference");
    if (const StiffnessWitness* shown = report_.Shown()) {
      html += Card("Rank", std::to_string(shown->result.rank), "of K, 6 if the output is held");
      if (shown->result.C.allFinite()) {
        const WeakDirection weak = WeakestTranslation(shown->result.C);
        html += Card("Weakest against a force", fmt::format("{:.4g} N/m", weak.stiffness),
                     fmt::format("along ({:.2f}, {:.2f}, {:.2f})", weak.direction.x(),
                                 weak.direction.y(), weak.direction.z()));
      }
    }
    if (const StiffnessWitness* shared = report_.WithShares()) {
      const Contribution first = Contributions(shared->result).front();
      html += Card("Largest contributor", fmt::format("{:.1f} %", 100 * first.translation),
                   first.element + ", in the weakest direction");
    }
    return html;
  }

  std::string ChecksHtml() const {
    Table table{.caption = "Checks, failed ones first",
                .head = {Text("of"), Text("quantity"), Digits("value"), Digits("limit"), Text(""),
                         Text("worst at")},
                .rows = {}};
    for (const bool failed : {true, false}) {
      for (const StiffnessCheck& check : report_.comparison.checks) {
        if ((check.limit && !check.pass) != failed) continue;
        table.rows.push_back({Text(Spaced(check.subject)), Text(RowOf(check.metric).title),
                              Digits(fmt::format("{:.2e}", check.value)),
                              Digits(check.limit ? fmt::format("{:.1e}", *check.limit) : "off"),
                              Markup(!check.limit ? Pill("off", "off")
                                     : check.pass ? Pill("ok", "ok")
                                                  : Pill("fail", "fail")),
                              Text(check.where)});
      }
    }
    if (table.rows.empty()) return "";
    return ToHtml(table) +
           "<p class=\"faint\">Entries are compared in units of √(K<sub>ii</sub> K<sub>jj</sub>), "
           "which does not depend on the units of length and angle; displacements in units of the "
           "largest one along the axis, vectors in units of their length.</p>\n";
  }

  std::string GapsHtml() const {
    std::string html;
    for (const StiffnessWitness& witness : report_.witnesses) {
      if (witness.result.summary.ok()) continue;
      html += "<li><b>" + Escape(witness.name) +
              "</b>: " + Escape(ToText(witness.result.summary.stop)) + ". " +
              Escape(witness.result.summary.message) + "</li>\n";
    }
    for (const NotCompared& item : report_.comparison.not_compared) {
      html += "<li><b>" + Escape(item.what) + "</b>: " + Escape(item.why) + "</li>\n";
    }
    return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
  }

  std::string ParametersHtml() const {
    Table table{.caption = "Parameters with the scenario's overrides",
                .head = {Text("name"), Digits("value"), Text("unit"), Text("note")},
                .rows = {}};
    for (const Parameter& p : report_.parameters) {
      table.rows.push_back(
          {Text(p.name), Digits(fmt::format("{:.10g}", p.value)), Text(p.unit), Text(p.note)});
    }
    if (table.rows.empty()) return "";
    return fmt::format("<details><summary>{} parameters</summary>", table.rows.size()) +
           ToHtml(table) + "</details>\n";
  }

  std::string ReproduceHtml() const {
    Table table{.caption = "Inputs and versions", .head = {Text("what"), Text("is")}, .rows = {}};
    if (!report_.scenario_file.empty()) {
      table.rows.push_back({Text("scenario"), Text(report_.scenario_file)});
    }
    table.rows.push_back({Text("model"), Text(report_.model_file)});
    for (const auto& [name, version] : report_.versions) {
      table.rows.push_back({Text(name), Text(version)});
    }
    const Timing& timing = report_.timing;
    table.rows.push_back(
        {Text("time taken"),
         Text(fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                          timing.analytic_s, timing.reference_s, timing.simulation_s))});
    return "<pre tabindex=\"0\"><code>" + Escape(report_.command) + "</code></pre>\n" +
           ToHtml(table) +
           "<p class=\"faint\">Files beside this page: summary.json (every number), stiffness.csv, "
           "loads.csv and contributions.csv (17 digits), model.xml (the compliant MJCF as "
           "simulated).</p>\n";
  }

  // The policy forbids every request: what is shown is in this file.
  std::string Assemble() const {
    return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
           "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src "
           "data:; style-src 'unsafe-inline'\">\n"
           "<meta name=\"color-scheme\" content=\"light dark\">\n"
           "<link rel=\"icon\" href=\"data:,\">\n<title>" +
           Escape(Title() + ": " + Word()) + " – mbverify</title>\n<style>" +
           std::string(PageStyle()) + "</style>\n</head>\n<body>\n" +
           "<a class=\"skip\" href=\"#main\">Skip to the verdict</a>\n" +
           fmt::format(
               "<header class=\"top\"><div><p class=\"kicker\">mbverify stiffness report</p>"
               "<h1>{}</h1><p class=\"lead\">{}</p></div><div class=\"badges\">"
               "<span class=\"verdict {}\">{}</span></div></header>\n",
               Escape(Title()), Escape(report_.description), ToText(report_.comparison.verdict),
               Word()) +
           "<nav aria-label=\"Sections\">\n" + nav_ + "</nav>\n<main id=\"main\">\n" + main_ +
           "</main>\n<footer>Written by mbverify; all digits are in stiffness.csv, loads.csv and "
           "summary.json.</footer>\n</body>\n</html>\n";
  }

  const StiffnessReport& report_;
  std::string nav_, main_;
};

}  // namespace

std::string ToHtml(const StiffnessReport& report) { return StiffnessPageWriter(report).Write(); }

}  // namespace mbv
