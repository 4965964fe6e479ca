// report.html: one page with everything a run gave. It needs no network, and no other file unless
// its script is shared with other pages; without JavaScript it still shows the verdict, the tables
// and the pictures.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "report/page.h"
#include "report/report.h"

namespace mbv {

/// How shapes of one `color` are drawn.
struct HtmlPaint {
  std::array<float, 4> rgba{0.6F, 0.6F, 0.6F, 1.0F};
  bool scenery = false;  ///< surroundings that the camera does not have to fit
};

struct HtmlPicture {
  std::string name;  ///< file name below snapshots/
  std::string png;   ///< small copy of it
};

/// One numbered equation of the mechanism's paper.
struct HtmlEquation {
  std::string equation, erratum, status, printed, corrected, note;
  std::string residual;          ///< shown, with unit
  bool right = false;            ///< as printed
  bool corrected_right = false;  ///< the corrected form is
};
struct HtmlAudit {
  std::string source;  ///< the paper
  std::vector<HtmlEquation> rows = {};
  std::string note = {};  ///< why there are no rows
};

struct HtmlInput {
  const Report* report = nullptr;
  const Mechanism* mechanism = nullptr;                  ///< as simulated
  const std::vector<std::vector<Pose>>* X_WB = nullptr;  ///< per sample of the simulation, per
                                                         ///< body; null: the home pose is shown
  std::map<std::string, HtmlPaint> paints;               ///< by a shape's `color`
  std::vector<HtmlPicture> pictures = {};                ///< a few hundred kB in total
  std::optional<HtmlAudit> audit;
  std::vector<std::string> arguments = {};  ///< of the command line, after the scenario file
  std::string script_link;                  ///< where the page's script is; "": in the page
};

/// Name of a file with the script that pages may share: its content decides it.
[[nodiscard]] std::string SharedScriptName();

/// The whole page.
[[nodiscard]] std::string ToHtml(const HtmlInput& input);

/// A section in which a mechanism moves through `X_WB` (per frame, per body; at `time_s`), with the
/// script that it needs. One on a page.
void AddReplay(const Mechanism& mechanism, const std::vector<std::vector<Pose>>& X_WB,
               const std::vector<double>& time_s, std::map<std::string, HtmlPaint> paints,
               const std::string& title, const std::string& remark, Page* page, PageHead* head);

/// The data that the page's script reads: signals, errors and the replay (JSON; arrays of
/// little-endian 32-bit floats in base64). No '<' occurs in it.
[[nodiscard]] std::string PageData(const HtmlInput& input);

// The sections of a motion; without blocks, or "", when there is nothing to show.

/// Errors of each pair's drive forces; a terminal shows the main pair's.
[[nodiscard]] ReportSection DriveSection(const Report& report);
/// What MuJoCo's own friction and other engines are off by.
[[nodiscard]] ReportSection EngineSection(const Report& report);
/// What drives and joints bear: force, power, stroke and speed; magnitudes of reactions.
[[nodiscard]] std::string LoadsHtml(const Report& report);
[[nodiscard]] std::string EnergyHtml(const Report& report);
[[nodiscard]] std::string AuditHtml(const std::optional<HtmlAudit>& audit);
[[nodiscard]] std::string SignalsHtml(const Report& report);

/// How long each witness took: text, not HTML.
[[nodiscard]] std::string TimesText(const Report& report);

// Plots of a run for viewers without JavaScript.

/// Drive forces of the main pair's measured witness over time, one plot per unit, and the errors
/// against the other witness on a logarithmic scale, as inline SVG; "" if no forces were compared.
[[nodiscard]] std::string StaticPlotsHtml(const Report& report);

}  // namespace mbv
