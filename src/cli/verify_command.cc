// mbverify verify
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "cli/trust.h"
#include "core/json_text.h"
#include "pipeline/verify_package.h"

namespace mbv {
namespace {

struct VerifyArguments {
  std::string archive;
  bool trust = false, verbose = false;
  JsonOption json;
};

int Verify(const VerifyArguments& arguments) {
  VerifyOptions options{.trust = arguments.trust};
  VerifyOutcome outcome;
  {
    ProgressLine progress(true);
    options.progress = [&](const std::string& file, double fraction) {
      progress.active() ? progress.Show(file, fraction) : Say(stderr, "repeats {}\n", file);
    };
    options.ask = [&](const std::string& file, const std::vector<std::string>& programs) {
      progress.Clear();
      return AskForPrograms(file, programs);
    };
    options.show = [&](const std::string& file, const std::vector<std::string>& programs) {
      progress.Clear();
      ListPrograms(file, programs);
    };
    outcome = VerifyPackage(arguments.archive, options);
  }
  FindingPrinter(stderr).Print(outcome.diagnostics);
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report, arguments.verbose));
  }
  RerunReport none;
  none.archive = arguments.archive;
  auto json =
      ParseJson<nlohmann::ordered_json>(ToJson(outcome.report.value_or(none), outcome.exit_code));
  json["findings"] = FindingObjects(outcome.diagnostics);
  return WorseExit(outcome.exit_code, arguments.json.Write(json, {{arguments.archive, ""}}));
}

}  // namespace

void AddVerifyCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<VerifyArguments>();
  CLI::App* verify = app->add_subcommand(
      "verify", "Repeat what an archive of package holds, and say which results are the same");
  verify->add_option("archive", arguments->archive, "the archive")->required();
  AddTrustOption(verify, &arguments->trust);
  verify->add_flag("-v,--verbose", arguments->verbose,
                   "every file, and every signal of those that are not the same");
  arguments->json.AddTo(verify);
  SetFooter(verify, {"verify paper.zip", "verify paper.zip --json -"},
            "0 the same or within limits, 1 something differs, 2 bad input, 3 could not run, 4 "
            "internal error");
  verify->callback([arguments, exit_code] { *exit_code = Verify(*arguments); });
}

}  // namespace mbv
