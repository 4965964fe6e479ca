#include "pipeline/run_page.h"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "audit/audit.h"
#include "core/files.h"
#include "render/palette.h"
#include "report/audit_json.h"
#include "report/html_report.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr size_t kPictureBytes = 900000;  // all embedded pictures together

std::string ResidualText(const AuditRow& row) {
  if (row.verdict == AuditVerdict::kNotTestable) return "";
  std::string text = fmt::format("{:.1e}", row.residual_corrected);
  if (!row.corrected.empty()) {
    text = fmt::format("printed {:.1e}, corrected {}", row.residual_printed, text);
  }
  return fmt::format("{} {} of {:.3g} (limit {:.1e})", text, row.unit, row.scale, row.limit);
}

bool SameText(const fs::path& a, const fs::path& b) {
  const auto read = [](const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  std::error_code error;
  return fs::is_regular_file(a, error) && fs::is_regular_file(b, error) && read(a) == read(b);
}

HtmlAudit ToHtmlAudit(const AuditTable& table) {
  HtmlAudit audit{.source = table.source, .rows = {}, .note = {}};
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

// Computed by the first run that asks, and kept for the others of its night: it is the same for
// all. A file that is damaged or cannot be written costs time only.
HtmlAudit RunAudit(const AuditEntry& entry, const fs::path& models, const std::string& kept) {
  const fs::path file = fs::path(kept) / (entry.mechanism + ".json");
  if (!kept.empty()) {
    const auto text = ReadWholeFile(file);
    if (auto audit = text ? AuditFromJson(*text) : std::nullopt) return *std::move(audit);
  }
  HtmlAudit audit = ToHtmlAudit(entry.run(models.string()));
  if (!kept.empty()) (void)WriteFile(file, ToJson(audit), false);
  return audit;
}

// The audit of the mechanism's paper; none for mechanisms of one's own. It is about the models that
// the program came with, so a run of a model that was changed only says where it is. A run that is
// compared does not end because its page lacks a section.
std::optional<HtmlAudit> AuditOf(const Report& report, const std::string& kept) {
  for (const AuditEntry& entry : Audits()) {
    if (entry.mechanism != report.mechanism) continue;
    const auto note = [&](const std::string& why) {
      return HtmlAudit{.source = {},
                       .rows = {},
                       .note = why + fmt::format("; the paper's equations are audited with the "
                                                 "shipped model: mbverify audit {}",
                                                 entry.mechanism)};
    };
    const std::optional<fs::path> shipped = ShippedModels();
    if (!shipped) return note("The shipped models were not found");
    const fs::path model = report.model_file;
    if (!SameText(model, *shipped / entry.mechanism / model.filename())) {
      return note(model.string() + " is not the shipped model");
    }
    try {
      return RunAudit(entry, *shipped, kept);
    } catch (const std::exception& error) {
      return note(std::string("The audit failed: ") + error.what());
    }
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
                    const ScenarioOptions& options, const PageOptions& page) {
  HtmlInput input{.report = &report,
                  .mechanism = &mechanism,
                  .X_WB = simulation == nullptr ? nullptr : &simulation->X_WB,
                  .paints = PaintsOf(mechanism),
                  .pictures = {},
                  .audit = AuditOf(report, page.kept_audits),
                  .arguments = {},
                  .script_link = page.script_link};
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
