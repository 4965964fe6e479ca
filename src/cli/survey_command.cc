// mbverify survey
#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "core/bytes.h"
#include "core/files.h"
#include "core/in_children.h"
#include "core/scratch_folder.h"
#include "pipeline/survey.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

struct SurveyArguments {
  std::string folder, out;
  double timeout_s = 300.0;
  JsonOption json;
};

SurveyRow RowOf(const std::string& file, const std::string& scratch, double timeout_s) {
  const auto texts =
      InChildren(1, timeout_s, [&](size_t) { return ToBytes(SurveyFile(file, scratch)); });
  SurveyRow lost{.file = file};
  if (!texts[0]) {
    lost.message = fmt::format("ended by a crash, or not finished after {:g} s", timeout_s);
    return lost;
  }
  lost.message = "gave no readable result";
  return FromBytes<SurveyRow>(*texts[0]).value_or(lost);
}

int WriteSurvey(const SurveyArguments& arguments, const std::vector<SurveyRow>& rows) {
  const fs::path out(arguments.out);
  int exit_code = WriteWholeFile((out / "survey.csv").string(), SurveyCsv(rows), {});
  exit_code = WorseExit(exit_code, WriteWholeFile((out / "survey.html").string(),
                                                  SurveyHtml(rows, arguments.folder), {}));
  if (exit_code == 0) {
    Say(stderr, "wrote {0}/survey.csv and {0}/survey.html\n", out.string());
  }
  return exit_code;
}

// Not all XML is MJCF; parts of models that others include are no robots either.
bool IsModel(const std::string& file) {
  if (!file.ends_with(".xml")) return true;
  const auto text = ReadWholeFile(file);
  return text && text->find("<mujoco") != std::string::npos &&
         text->find("<worldbody") != std::string::npos;
}

std::vector<InputFile> RobotFiles(const std::vector<std::string>& files) {
  std::vector<InputFile> inputs;
  for (const std::string& file : files) inputs.push_back({file, ""});
  return inputs;
}

int Survey(const SurveyArguments& arguments) {
  std::vector<std::string> unread;
  std::vector<std::string> files;
  for (const char* ending : {".urdf", ".xml"}) {
    for (const std::string& file : FilesBelow(arguments.folder, ending, &unread)) {
      if (IsModel(file)) files.push_back(file);
    }
  }
  for (const std::string& line : unread) Say(stderr, "{}\n", line);
  if (files.empty()) {
    Say(stderr, "{}: error: no *.urdf and no MJCF file in this folder\n", arguments.folder);
    return 2;
  }
  const ScratchFolder scratch("survey");
  if (!scratch.trouble().empty()) {
    Say(stderr, "error: {}\n", scratch.trouble());
    return 3;
  }
  std::vector<SurveyRow> rows;
  for (size_t i = 0; i < files.size(); ++i) {
    rows.push_back(
        RowOf(files[i], (scratch.path() / fmt::format("{}", i)).string(), arguments.timeout_s));
    rows.back().file = fs::path(files[i]).lexically_relative(arguments.folder).string();
    Say(stderr, "{} of {}: {} {}\n", i + 1, files.size(), rows.back().file, rows.back().status);
  }
  SayText(arguments.json.text(), SurveyTable(rows));
  const int exit_code =
      WorseExit(SurveyExit(rows), arguments.json.Write(SurveyJson(rows), RobotFiles(files)));
  return arguments.out.empty() ? exit_code : WorseExit(exit_code, WriteSurvey(arguments, rows));
}

}  // namespace

void AddSurveyCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SurveyArguments>();
  CLI::App* survey = app->add_subcommand(
      "survey", "All robots below a folder: do they load, close and agree in a first motion?");
  survey->add_option("folder", arguments->folder, "folder with .urdf and MJCF files")->required();
  survey->add_option("--out", arguments->out, "folder for survey.csv and survey.html");
  survey->add_option("--timeout", arguments->timeout_s, "wall time limit of a robot [s]")
      ->check(Positive())
      ->capture_default_str();
  arguments->json.AddTo(survey);
  SetFooter(survey, {"survey my_robots --out out"},
            "0 all ok (caveats are listed), or refused for a fault of the file itself; 1 some "
            "disagree or do "
            "not close; 2 bad input; 3 some failed");
  survey->callback([arguments, exit_code] { *exit_code = Survey(*arguments); });
}

}  // namespace mbv
