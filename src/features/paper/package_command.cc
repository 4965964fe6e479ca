// mbverify package
#include "features/paper/package.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "base/files.h"
#include "base/json_text.h"
#include "base/names.h"
#include "base/sha256.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "cli/trust.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

struct PackageArguments {
  bool check = false;
  std::vector<std::string> scenarios;
  std::string out = "paper.zip", date;
  bool no_report = false, no_figures = false, force = false, trust = false;
  JsonOption json;
};

// Before anything is computed: 0, or 2 after saying why the archive cannot be written there.
int CheckPackageOut(const PackageArguments& arguments) {
  std::error_code error;
  const fs::path out = arguments.out;
  if (!IsPlainPath(out.stem().string())) {
    return Refuse(arguments.out + " has no name for the folder in the archive",
                  "for example -o paper.zip");
  }
  const fs::path json = arguments.json.path();
  if (fs::absolute(json, error).lexically_normal() == fs::absolute(out, error).lexically_normal()) {
    return Refuse("the archive and --json are one file", "choose another for one of them");
  }
  if (fs::is_directory(out, error)) return Refuse(arguments.out + " is a folder", "");
  if (fs::exists(out, error) && !arguments.force) {
    return Refuse(arguments.out + " is there already", "choose another name, or --force");
  }
  return 0;
}

void PrintPackage(const PackageArguments& arguments, const PackageOutcome& outcome) {
  std::FILE* to = arguments.json.text();
  for (const PackedScenario& scenario : outcome.description.scenarios) {
    Say(to, "{}: {} (exit code {})\n", scenario.file, scenario.verdict, scenario.exit_code);
  }
  Say(to, "{}: {} files, {} bytes, SHA-256 {}\n", arguments.out,
      outcome.description.files.size() + 1, outcome.zip.size(), Sha256Hex(outcome.zip));
}

nlohmann::ordered_json PackageJson(const PackageArguments& arguments, const PackageOutcome& outcome,
                                   int exit_code) {
  // "package" is the schema of the manifest in it.
  nlohmann::ordered_json json = {
      {"schema", "mbverify.archive/1"}, {"archive", arguments.out}, {"exit_code", exit_code}};
  if (!outcome.zip.empty()) {
    json["bytes"] = outcome.zip.size();
    json["sha256"] = Sha256Hex(outcome.zip);
    json["manifest"] = ParseJson<nlohmann::ordered_json>(ManifestJson(outcome.description));
  }
  json["findings"] = FindingObjects(outcome.diagnostics);
  return json;
}

int Package(const PackageArguments& arguments) {
  int exit_code = CheckPackageOut(arguments);
  if (exit_code != 0) return exit_code;
  if (!arguments.date.empty() && !IsDate(arguments.date)) {
    return Refuse("--date " + arguments.date + " is not a date", "for example 2026-11-23");
  }
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.out, arguments.json.path()}, &exit_code);
  if (exit_code != 0) return exit_code;
  PackageOptions options{.folder = fs::path(arguments.out).stem().string(),
                         .date = arguments.date,
                         .page = !arguments.no_report,
                         .figures = !arguments.no_figures};
  exit_code = AskForPrograms(files, {}, arguments.trust, false, &options.programs);
  if (exit_code != 0) return exit_code;
  PackageOutcome outcome;
  {
    ProgressLine progress(true);
    options.progress = [&](const std::string& file, double fraction) {
      progress.active() ? progress.Show(file, fraction) : Say(stderr, "runs {}\n", file);
    };
    outcome = MakePackage(files, options);
  }
  FindingPrinter(stderr).Print(outcome.diagnostics);
  exit_code = outcome.exit_code;
  if (exit_code == 0) {
    // Inputs were refused before anything ran, and --force is for any other file.
    const std::string trouble = WriteFile(arguments.out, outcome.zip);
    if (!trouble.empty()) return NotWritten(trouble, "");
    PrintPackage(arguments, outcome);
    for (const PackedScenario& scenario : outcome.description.scenarios) {
      exit_code = WorseExit(exit_code, scenario.exit_code);
    }
  }
  return WorseExit(exit_code, arguments.json.Write(PackageJson(arguments, outcome, exit_code), {}));
}

}  // namespace

void AddPackageCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<PackageArguments>();
  auto archive = std::make_shared<ArchiveArguments>();
  CLI::App* package = app->add_subcommand(
      "package", "An archive beside a paper: inputs, results, figures, and how to repeat them");
  CLI::Option* check =
      package->add_flag("--check", arguments->check,
                        "repeat what an archive holds, and say which results are the same");
  package
      ->add_option("scenario", arguments->scenarios,
                   "scenario files or folders of them, and study files; with --check the archive")
      ->required();
  package->add_option("-o,--out", arguments->out, "the archive")
      ->capture_default_str()
      ->excludes(check);
  package
      ->add_option("--date", arguments->date,
                   "YYYY-MM-DD that it says it was published; else that of SOURCE_DATE_EPOCH")
      ->excludes(check);
  package->add_flag("--no-report", arguments->no_report, "without report.html")->excludes(check);
  package->add_flag("--no-figures", arguments->no_figures, "without figures")->excludes(check);
  package->add_flag("--force", arguments->force, "replace a file of this name")->excludes(check);
  package
      ->add_flag("-v,--verbose", archive->verbose,
                 "with --check: every file, and every signal of those that are not the same")
      ->needs(check);
  AddTrustOption(package, &arguments->trust);
  arguments->json.AddTo(package);
  SetFooter(package,
            {"package scenarios/stabilizing_platform/sea_state.yaml -o paper.zip",
             "package four_bar/turn scara_robot/stiffness -o paper.zip --date 2026-11-23",
             "package --check paper.zip"},
            "0 agree, or the same within limits; 1 disagree (packed all the same), or something "
            "differs; 2 bad input, 3 could not run, 4 internal error");
  package->callback([arguments, archive, exit_code] {
    if (!arguments->check) {
      *exit_code = Package(*arguments);
    } else if (arguments->scenarios.size() != 1) {
      *exit_code = Refuse("package --check takes one archive", "");
    } else {
      archive->archive = arguments->scenarios.front();
      archive->trust = arguments->trust;
      archive->json = arguments->json;
      *exit_code = CheckArchive(*archive);
    }
  });
}

}  // namespace mbv
