#include "pipeline/run_page.h"

#include <fmt/format.h>

#include <filesystem>

#include "audit/audit.h"
#include "render/palette.h"
#include "report/html_report.h"

namespace mbv {
namespace {

constexpr size_t kPictureBytes = 900000;  // all embedded pictures together

std::string ResidualText(const AuditRow& row) {
  if (row.verdict == AuditVerdict::kNotTestable) return "";
  std::string text = fmt::format("{:.1e}", row.residual_corrected);
  if (!row.corrected.empty()) {
    text = fmt::format("printed {:.1e}, corrected {}", row.residual_printed, text);
  }
  return fmt::format("{} {} of {:.3g} (limit {:.1e})", text, row.unit, row.scale, row.limit);
}

// The audit of the mechanism's paper; none for mechanisms of one's own.
std::optional<HtmlAudit> AuditOf(const Report& report) {
  const auto models_dir = std::filesystem::path(report.model_file).parent_path().parent_path();
  for (const AuditEntry& entry : Audits()) {
    if (entry.mechanism != report.mechanism) continue;
    if (!std::filesystem::exists(models_dir / entry.mechanism / "model.yaml")) break;
    const AuditTable table = entry.run(models_dir.string());
    HtmlAudit audit{.source = table.source, .rows = {}};
    for (const AuditRow& row : table.rows) {
      audit.rows.push_back({.equation = row.equation,
                            .erratum = row.erratum,
                            .status = ToText(row.verdict),
                            .printed = row.printed,
                            .corrected = row.corrected,
                            .note = row.note,
                            .residual = ResidualText(row),
                            .right = row.verdict == AuditVerdict::kOk,
                            .corrected_right = row.verdict == AuditVerdict::kWrong});
    }
    return audit;
  }
  return {};
}

std::map<std::string, HtmlPaint> PaintsOf(const Mechanism& mechanism) {
  std::map<std::string, HtmlPaint> paints;
  const auto add = [&](const std::string& color) {
    paints[color] = {.rgba = render::MaterialOf(color).rgba, .scenery = render::IsScenery(color)};
  };
  for (const Body& body : mechanism.bodies) {
    for (const Shape& shape : body.shapes) add(shape.color);
  }
  for (const char* mark : {"grey", "dark_steel", "light_grey", "push", "pull", "closure"}) {
    add(mark);
  }
  return paints;
}

}  // namespace

std::string RunPage(const Report& report, const Mechanism& mechanism,
                    const SimulationRun* simulation, const std::vector<PictureFile>& pictures,
                    const ScenarioOptions& options, const std::string& script_link) {
  HtmlInput input{.report = &report,
                  .mechanism = &mechanism,
                  .X_WB = simulation == nullptr ? nullptr : &simulation->X_WB,
                  .paints = PaintsOf(mechanism),
                  .pictures = {},
                  .audit = AuditOf(report),
                  .arguments = {},
                  .script_link = script_link};
  size_t bytes = 0;
  for (const PictureFile& picture : pictures) {
    bytes += picture.preview.size();
    if (bytes > kPictureBytes) break;
    input.pictures.push_back({picture.name, picture.preview});
  }
  for (const auto& [key, value] : options.set) {
    input.arguments.push_back(fmt::format("--set '{}={}'", key, value));
  }
  return ToHtml(input);
}

}  // namespace mbv
