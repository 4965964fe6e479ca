// The audit of the user's own file on a terminal, on the page and in summary.json.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "report/own_file.h"
#include "report/terminal_text.h"

namespace mbv {

void WriteOwnFile(const OwnFileAudit& audit, TerminalText* out);
/// A section's content; "" without an audit.
[[nodiscard]] std::string OwnFileHtml(const OwnFileAudit* audit);
[[nodiscard]] nlohmann::ordered_json OwnFileJson(const OwnFileAudit& audit);

}  // namespace mbv
