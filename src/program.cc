#include "program.h"

#include <array>

#include "cli/cli.h"
#include "equations/equations.h"
#include "features/benchmark/benchmark.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness.h"
#include "features/study/study.h"
#include "model_file/catalogue.h"
#include "verify/check_file.h"

namespace mbv {

using AddCommand = void(CLI::App* app, int* exit_code);
AddCommand AddInitCommand, AddRunCommand, AddRenderCommand, AddModelCommand, AddCheckCommand,
    AddAuditCommand, AddListCommand, AddWorkspaceCommand, AddStiffnessCommand, AddConvergeCommand,
    AddCrosscheckCommand, AddSurveyCommand, AddInertiaCommand, AddSizeCommand, AddFiguresCommand,
    AddTablesCommand, AddStudyCommand, AddPackageCommand, AddSensitivityCommand, AddRegressCommand,
    AddMergeCommand, AddHistoryCommand, AddLogCommand, AddStandinCommand, AddCodeCommand,
    AddLineariseCommand, AddSheetCommand, AddBenchmarkCommand;

namespace {

// Headings of the help.
constexpr const char *kStart = "Start", *kVerify = "Verify", *kUnderstand = "Understand",
                     *kRobots = "Robots and motors", *kEngines = "Engines", *kPublish = "Publish",
                     *kShell = "Shell";

// In the order of the help.
constexpr std::array kCommands = {
    CommandRow{AddInitCommand, kStart, true},
    CommandRow{AddListCommand, kStart},
    CommandRow{AddCheckCommand, kStart, true},
    CommandRow{AddModelCommand, kStart, true},
    CommandRow{AddRunCommand, kVerify, true},
    CommandRow{AddRegressCommand, kVerify},
    CommandRow{AddMergeCommand, kVerify},
    CommandRow{AddHistoryCommand, kVerify},
    CommandRow{AddTrustCommand, kVerify},
    CommandRow{AddSensitivityCommand, kUnderstand},
    CommandRow{AddConvergeCommand, kUnderstand},
    CommandRow{AddStudyCommand, kUnderstand, true},
    CommandRow{AddAuditCommand, kUnderstand},
    CommandRow{AddStiffnessCommand, kUnderstand},
    CommandRow{AddWorkspaceCommand, kUnderstand},
    CommandRow{AddLineariseCommand, kUnderstand},
    CommandRow{AddSurveyCommand, kRobots, true},
    CommandRow{AddInertiaCommand, kRobots, true},
    CommandRow{AddSizeCommand, kRobots},
    CommandRow{AddLogCommand, kRobots, true},
    CommandRow{AddStandinCommand, kRobots, true},
    CommandRow{AddCodeCommand, kRobots},
    CommandRow{AddCrosscheckCommand, kEngines},
    CommandRow{AddBenchmarkCommand, kEngines},
    CommandRow{AddRenderCommand, kPublish, true},
    CommandRow{AddFiguresCommand, kPublish},
    CommandRow{AddTablesCommand, kPublish},
    CommandRow{AddPackageCommand, kPublish, true},
    CommandRow{AddSheetCommand, kPublish},
    CommandRow{AddCompletionCommand, kShell},
    CommandRow{AddHelpCommand, kShell},
    CommandRow{AddManPageCommand},  // the build asks for it
};

constexpr std::array kFormerNames = {FormerName{"mutate", {"sensitivity"}},
                                     FormerName{"upgrade", {"crosscheck", "--newest"}},
                                     FormerName{"verify", {"package", "--check"}}};

Diagnostics CheckStiffness(const std::string& file) {
  Diagnostics diagnostics;
  (void)PrepareStiffnessFile(file, {}, &diagnostics);
  return diagnostics;
}

std::optional<Mechanism> StiffnessMechanism(const std::string& file, const ScenarioOptions& options,
                                            Diagnostics* diagnostics) {
  auto prepared = PrepareStiffnessFile(file, options, diagnostics);
  return prepared ? std::optional(std::move(prepared->base)) : std::nullopt;
}

bool IsStudy(const std::string& /*file*/, const ScenarioHead& head) {
  return !head.is_scenario && head.HasKey("study");
}
bool IsBenchmark(const std::string& /*file*/, const ScenarioHead& head) {
  return !head.is_scenario && head.HasKey("benchmark");
}
bool IsCatalogue(const std::string& /*file*/, const ScenarioHead& head) {
  return !head.is_scenario && head.HasKey("catalogue");
}
bool IsStiffness(const std::string& /*file*/, const ScenarioHead& head) {
  return head.is_scenario && head.kind == "stiffness";
}
bool IsEquations(const std::string& /*file*/, const ScenarioHead& head) {
  return !head.is_scenario && (head.HasKey("equations_of") || head.HasKey("audit"));
}
// Its formulas are compiled where the parameters are known.
Diagnostics CheckEquations(const std::string& file) {
  Diagnostics diagnostics;
  (void)OpenEquations(file, &diagnostics);
  return diagnostics;
}
bool IsScenario(const std::string& /*file*/, const ScenarioHead& head) { return head.is_scenario; }
bool IsModel(const std::string& /*file*/, const ScenarioHead& head) {
  return !head.is_scenario && head.HasKey("name") &&
         (head.HasKey("bodies") || head.HasKey("parts") || head.HasKey("legs") ||
          head.HasKey("urdf"));
}
bool IsAny(const std::string& /*file*/, const ScenarioHead& /*head*/) { return true; }

constexpr std::array kDocuments = {
    DocumentKind{.name = "mechanism", .is = IsMechanismJson, .check = CheckMechanismFile},
    DocumentKind{.name = "study", .is = IsStudy, .check = CheckStudy, .command = "study"},
    DocumentKind{.name = "benchmark", .is = IsBenchmark, .check = CheckBenchmarkCase},
    DocumentKind{.name = "catalogue", .is = IsCatalogue, .check = CheckCatalogue},
    DocumentKind{.name = "stiffness",
                 .is = IsStiffness,
                 .check = CheckStiffness,
                 .command = "run",
                 .run = RunStiffnessScenario,
                 .mechanism = StiffnessMechanism},
    DocumentKind{.name = "motion",
                 .is = IsScenario,
                 .check = CheckScenario,
                 .command = "run",
                 .in_time = true,
                 .run = RunMotion,
                 .mechanism = MotionMechanism},
    DocumentKind{.name = "equations", .is = IsEquations, .check = CheckEquations},
    DocumentKind{.name = "model", .is = IsModel, .check = CheckModel, .set_up = true},
    DocumentKind{.name = "model", .is = IsAny, .check = CheckModel},
};

}  // namespace

void UseDocumentKinds() { UseDocumentKinds(kDocuments); }

int RunProgram(int argc, char** argv) {
  UseDocumentKinds();
  return RunCli(argc, argv, kCommands, kFormerNames);
}

}  // namespace mbv
