#include "program.h"

#include <array>

#include "cli/run_cli.h"
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

// The first that recognises a file checks it.
constexpr std::array kDocuments = {
    DocumentKind{IsMechanismJson, CheckMechanismFile},
    DocumentKind{[](const std::string&, const ScenarioHead& head) { return head.is_study; },
                 CheckStudy},
    DocumentKind{[](const std::string&, const ScenarioHead& head) {
                   return head.is_scenario && head.is_stiffness();
                 },
                 CheckStiffness},
    DocumentKind{[](const std::string&, const ScenarioHead& head) { return head.is_scenario; },
                 CheckScenario},
    DocumentKind{[](const std::string&, const ScenarioHead&) { return true; }, CheckModel},
};

}  // namespace

void UseDocumentKinds() { UseDocumentKinds(kDocuments); }

int RunProgram(int argc, char** argv) {
  UseDocumentKinds();
  return RunCli(argc, argv, kCommands);
}

}  // namespace mbv
