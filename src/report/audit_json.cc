#include "report/audit_json.h"

#include "core/json_document.h"
#include "core/json_text.h"

namespace mbv {

using AuditJson = nlohmann::ordered_json;

std::string ToJson(const HtmlAudit& audit) {
  AuditJson rows = AuditJson::array();
  for (const HtmlEquation& row : audit.rows) {
    rows.push_back({row.equation, row.erratum, row.status, row.printed, row.corrected, row.note,
                    row.residual, row.right, row.corrected_right});
  }
  const AuditJson json = {
      {"source", audit.source}, {"rows", std::move(rows)}, {"note", audit.note}};
  return DumpLine(json);
}

std::optional<HtmlAudit> AuditFromJson(const std::string& text) {
  const auto read = [](const JsonValue& json) {
    HtmlAudit audit{.source = json.at("source"), .rows = {}, .note = json.at("note")};
    for (const JsonValue& row : json.at("rows").list()) {
      audit.rows.push_back({.equation = row.at(0),
                            .erratum = row.at(1),
                            .status = row.at(2),
                            .printed = row.at(3),
                            .corrected = row.at(4),
                            .note = row.at(5),
                            .residual = row.at(6),
                            .right = row.at(7),
                            .corrected_right = row.at(8)});
    }
    return audit;
  };
  return ReadJson(text, read).value;
}

}  // namespace mbv
