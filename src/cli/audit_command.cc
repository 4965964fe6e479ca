// mbverify audit
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "audit/audit.h"
#include "cli/cli.h"
#include "cli/terminal.h"
#include "core/diagnostics.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct AuditArguments {
  std::string model;
  bool markdown = false;
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

void PrintTable(const AuditTable& table, bool color) {
  Say(stdout, "{}: {}\n", table.mechanism, table.source);
  size_t ok = 0, near = 0, wrong = 0, unfixed = 0;
  for (const AuditRow& row : table.rows) {
    SayText(stdout, RowText(row, color));
    ok += row.verdict == AuditVerdict::kOk ? 1 : 0;
    near += row.verdict == AuditVerdict::kApproximation ? 1 : 0;
    wrong += row.verdict == AuditVerdict::kWrong ? 1 : 0;
    unfixed += row.verdict == AuditVerdict::kWrongAndUnfixed ? 1 : 0;
  }
  Say(stdout,
      "  {} rows: {} right as printed, {} approximations, {} wrong as printed and corrected, {} "
      "unexplained, {} without a residual\n\n",
      table.rows.size(), ok, near, wrong, unfixed, table.rows.size() - ok - near - wrong - unfixed);
}

// Exit 1 if a corrected form misses its limit: then the corrections are wrong, too.
int Audit(const AuditArguments& arguments) {
  std::vector<std::string> names;
  int exit_code = 0;
  bool found = false;
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
    if (arguments.markdown) {
      fmt::print("{}", ToMarkdown(table));
    } else {
      PrintTable(table, WantsColor());
    }
    for (const AuditRow& row : table.rows) {
      if (row.verdict == AuditVerdict::kWrongAndUnfixed) exit_code = 1;
    }
  }
  if (found) return exit_code;
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
  SetFooter(audit, {"audit scara_robot", "audit --markdown"},
            "0 every corrected form holds, 1 one does not, 2 bad input");
  audit->callback([arguments, exit_code] { *exit_code = Audit(*arguments); });
}

}  // namespace mbv
