// mbverify audit
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "base/diagnostics.h"
#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/equation_audit/audit.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct AuditArguments {
  std::string model;
  bool markdown = false;
  JsonOption json;
};

std::string Word(AuditVerdict verdict, bool color) {
  const char* code = verdict == AuditVerdict::kOk                ? "32"
                     : verdict == AuditVerdict::kApproximation   ? "36"
                     : verdict == AuditVerdict::kWrong           ? "33"
                     : verdict == AuditVerdict::kWrongAndUnfixed ? "1;31"
                                                                 : "2";
  const std::string text = ToText(verdict);
  return color ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
}

std::string RowText(const AuditRow& row, bool color) {
  std::string text =
      fmt::format("  {:<28} {:<5} {}\n", row.equation, row.erratum, Word(row.verdict, color));
  if (!row.printed.empty()) text += fmt::format("      printed:   {}\n", row.printed);
  if (!row.corrected.empty()) text += fmt::format("      corrected: {}\n", row.corrected);
  if (row.verdict != AuditVerdict::kNotTestable) {
    text += "      residual: ";
    if (!row.corrected.empty()) {
      text +=
          fmt::format("printed {}, corrected ", std::isnan(row.residual_printed)
                                                    ? "not evaluated"
                                                    : fmt::format("{:.2e}", row.residual_printed));
    }
    text += fmt::format("{:.2e} (limit {:.1e}) {} of {:.3g}\n", row.residual_corrected, row.limit,
                        row.unit, row.scale);
  }
  if (!row.note.empty()) text += fmt::format("      {}\n", row.note);
  return text;
}

void PrintTable(const AuditTable& table, std::FILE* to, bool color) {
  Say(to, "{}: {}\n", table.mechanism, table.source);
  size_t ok = 0, near = 0, wrong = 0, unfixed = 0;
  for (const AuditRow& row : table.rows) {
    SayText(to, RowText(row, color));
    ok += row.verdict == AuditVerdict::kOk ? 1 : 0;
    near += row.verdict == AuditVerdict::kApproximation ? 1 : 0;
    wrong += row.verdict == AuditVerdict::kWrong ? 1 : 0;
    unfixed += row.verdict == AuditVerdict::kWrongAndUnfixed ? 1 : 0;
  }
  Say(to,
      "  {} rows: {} right as printed, {} approximations, {} wrong as printed and corrected, {} "
      "unexplained, {} without a residual\n\n",
      table.rows.size(), ok, near, wrong, unfixed, table.rows.size() - ok - near - wrong - unfixed);
}

nlohmann::ordered_json TableJson(const AuditTable& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const AuditRow& row : table.rows) {
    rows.push_back({{"equation", row.equation},
                    {"erratum", row.erratum},
                    {"verdict", ToText(row.verdict)},
                    {"printed", row.printed},
                    {"corrected", row.corrected},
                    {"residual_printed", Number(row.residual_printed)},
                    {"residual_corrected", Number(row.residual_corrected)},
                    {"limit", Number(row.limit)},
                    {"scale", Number(row.scale)},
                    {"unit", row.unit},
                    {"note", row.note}});
  }
  return {{"mechanism", table.mechanism}, {"source", table.source}, {"rows", std::move(rows)}};
}

// Exit 1 if a corrected form misses its limit: then the corrections are wrong, too.
int Audit(const AuditArguments& arguments) {
  std::vector<std::string> names;
  int exit_code = 0;
  bool found = false;
  auto audits = nlohmann::ordered_json::array();
  for (const AuditEntry& entry : Audits()) {
    names.push_back(entry.mechanism);
    if (!arguments.model.empty() && entry.mechanism != arguments.model) continue;
    found = true;
    // A model of the same name in the current folder may be another one.
    const auto models_dir = ShippedModels();
    if (!models_dir) {
      Say(stderr, "error: the models that come with the program are not found\n");
      return 2;
    }
    const AuditTable table = entry.run(models_dir->string());
    audits.push_back(TableJson(table));
    if (arguments.markdown) {
      fmt::print(arguments.json.text(), "{}", ToMarkdown(table));
    } else {
      PrintTable(table, arguments.json.text(), WantsColor(arguments.json.text()));
    }
    for (const AuditRow& row : table.rows) {
      if (row.verdict == AuditVerdict::kWrongAndUnfixed) exit_code = 1;
    }
  }
  if (found) {
    return WorseExit(exit_code, arguments.json.Write({{"audits", std::move(audits)}}, {}));
  }
  return Refuse(fmt::format("there is no equation audit of '{}'", arguments.model),
                DidYouMean(arguments.model, names, "audited: " + Joined(names)));
}

}  // namespace

void AddAuditCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<AuditArguments>();
  CLI::App* audit =
      app->add_subcommand("audit", "Each equation of a paper, as printed and as corrected");
  audit->add_option("model", arguments->model, "model name; all without it");
  audit->add_flag("--markdown", arguments->markdown, "print a Markdown table");
  arguments->json.AddTo(audit);
  SetFooter(audit, {"audit scara_robot", "audit --markdown"},
            "0 every corrected form holds, 1 one does not, 2 bad input");
  audit->callback([arguments, exit_code] { *exit_code = Audit(*arguments); });
}

}  // namespace mbv
