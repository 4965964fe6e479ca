#include "program.h"

#include <array>

#include "cli/run_cli.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness.h"
#include "features/study/study.h"
#include "verify/check_file.h"

namespace mbv {

using AddCommand = void(CLI::App* app, int* exit_code);
AddCommand AddInitCommand, AddRunCommand, AddRenderCommand, AddModelCommand, AddCheckCommand,
    AddAuditCommand, AddListCommand, AddWorkspaceCommand, AddStiffnessCommand, AddMutateCommand,
    AddConvergeCommand, AddCrosscheckCommand, AddSurveyCommand, AddInertiaCommand, AddSizeCommand,
    AddUpgradeCommand, AddFiguresCommand, AddTablesCommand, AddStudyCommand, AddPackageCommand,
    AddVerifyCommand, AddRegressCommand, AddMergeCommand, AddHistoryCommand;

namespace {

// In the order of the help.
constexpr std::array kCommands = {
    CommandRow{AddInitCommand, true},   CommandRow{AddRunCommand, true},
    CommandRow{AddRenderCommand, true}, CommandRow{AddModelCommand, true},
    CommandRow{AddCheckCommand, true},  CommandRow{AddAuditCommand},
    CommandRow{AddListCommand},         CommandRow{AddWorkspaceCommand},
    CommandRow{AddStiffnessCommand},    CommandRow{AddMutateCommand},
    CommandRow{AddConvergeCommand},     CommandRow{AddCrosscheckCommand},
    CommandRow{AddSurveyCommand, true}, CommandRow{AddInertiaCommand, true},
    CommandRow{AddSizeCommand},         CommandRow{AddUpgradeCommand},
    CommandRow{AddFiguresCommand},      CommandRow{AddTablesCommand},
    CommandRow{AddStudyCommand, true},  CommandRow{AddPackageCommand, true},
    CommandRow{AddVerifyCommand},       CommandRow{AddTrustCommand},
    CommandRow{AddRegressCommand},      CommandRow{AddMergeCommand},
    CommandRow{AddHistoryCommand},      CommandRow{AddCompletionCommand},
    CommandRow{AddManPageCommand},
};

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
bool IsStiffness(const std::string& /*file*/, const ScenarioHead& head) {
  return head.is_scenario && head.kind == "stiffness";
}
bool IsScenario(const std::string& /*file*/, const ScenarioHead& head) { return head.is_scenario; }
bool IsAny(const std::string& /*file*/, const ScenarioHead& /*head*/) { return true; }

constexpr std::array kDocuments = {
    DocumentKind{.name = "mechanism", .is = IsMechanismJson, .check = CheckMechanismFile},
    DocumentKind{.name = "study", .is = IsStudy, .check = CheckStudy, .command = "study"},
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
    DocumentKind{.name = "model", .is = IsAny, .check = CheckModel},
};

}  // namespace

void UseDocumentKinds() { UseDocumentKinds(kDocuments); }

int RunProgram(int argc, char** argv) {
  UseDocumentKinds();
  return RunCli(argc, argv, kCommands);
}

}  // namespace mbv
