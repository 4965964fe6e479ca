// The page of a stiffness run's report.html.
#include <fmt/format.h>

#include <cmath>

#include "report/result_html.h"
#include "report/stiffness_report.h"

namespace mbv {
namespace {

constexpr const char* kUnitsOfChecks =
    "Entries are compared in units of √(K<sub>ii</sub> K<sub>jj</sub>), which does not depend on "
    "the units of length and angle; displacements in units of the largest one along the axis, "
    "vectors in units of their length.";

class StiffnessPageWriter {
 public:
  explicit StiffnessPageWriter(const StiffnessReport& report)
      : report_(report), view_(ViewOf(report)) {}

  std::string Write() {
    page_.Add("Verdict", "Verdict", VerdictHtml(view_, Cards(), PoseText()));
    page_.Add("Stiffness", "Stiffness", StiffnessMatricesHtml(report_));
    page_.Add("Where it is weak", "Weakness", WeaknessHtml(report_));
    page_.Add("What causes the compliance", "Elements", ContributionsHtml(report_));
    page_.Add("Displacements under loads", "Loads", LoadsHtml(report_));
    page_.Add("Checks", "Checks", ChecksHtml(view_, kUnitsOfChecks));
    page_.Add("What could not be compared", "Gaps", GapsHtml(view_));
    page_.Add("Parameters", "Parameters", ParametersHtml(report_.parameters, false));
    page_.Add("Reproduce this run", "Reproduce", Reproduce());
    PageHead head = HeadOf(view_);
    head.kicker = "mbverify stiffness report";
    head.footer =
        "Written by mbverify; all digits are in stiffness.csv, loads.csv and summary.json.";
    return page_.Write(head);
  }

 private:
  std::string PoseText() const {
    std::string text = "Stiffness of " + Escape(report_.output) + " with all drives held, at ";
    for (const PoseEntry& entry : report_.pose) {
      text += fmt::format("{} = {:.6g} {}, ", Escape(entry.name), entry.value, entry.unit);
    }
    text.resize(text.size() - 2);
    text += ".";
    if (!report_.pose_note.empty()) text += " " + Escape(report_.pose_note) + ".";
    return text;
  }

  std::string Cards() const {
    std::string html;
    const auto entry = [&](const std::string& pair, const char* title) {
      const StiffnessCheck* check = report_.comparison.FindCheck(pair + ".stiffness_entry");
      if (check == nullptr) return;
      html += Card(title, fmt::format("{:.1e}", check->value),
                   Spaced(pair) + ", worst at " + check->where +
                       (check->limit ? fmt::format(", limit {:.0e}", *check->limit) : ""));
    };
    entry(PairName(role::kSimulated, role::kAnalytic), "Stiffness difference");
    entry(PairName(role::kReference, role::kAnalytic), "Stiffness difference");
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

  std::string Reproduce() const {
    const Timing& timing = report_.timing;
    const std::string times =
        timing.told ? fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                                  timing.analytic_s, timing.reference_s, timing.simulation_s)
                    : "";
    return ReproduceHtml(view_, report_.command, times,
                         "Files beside this page: summary.json (every number), stiffness.csv, "
                         "loads.csv and contributions.csv (17 digits), model.xml (the compliant "
                         "MJCF as simulated).");
  }

  const StiffnessReport& report_;
  const ResultView view_;
  Page page_;
};

}  // namespace

std::string ToHtml(const StiffnessReport& report) { return StiffnessPageWriter(report).Write(); }

}  // namespace mbv
