// mbverify inertia
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "pipeline/inertia.h"
#include "report/inertia_text.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct InertiaArguments {
  std::string model;
  JsonOption json;
};

int Inertia(const InertiaArguments& arguments) {
  const auto file = FindModel(arguments.model, ".");
  if (!file) {
    return Refuse(fmt::format("there is no model '{}'", arguments.model),
                  ModelHint(arguments.model, "."));
  }
  const InputWatch inputs;
  const InertiaCheck check = CheckInertia(*file);
  SayText(stderr, check.diagnostics.Text());
  if (check.diagnostics.has_errors()) return 2;
  SayText(arguments.json.text(), InertiaTable(check.bodies));
  return WorseExit(check.sound() ? 0 : 1,
                   arguments.json.Write(InertiaJson(check.bodies, *file), inputs.files()));
}

}  // namespace

void AddInertiaCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<InertiaArguments>();
  CLI::App* inertia = app->add_subcommand(
      "inertia", "Stated masses, centres and tensors against meshes: names the usual mistakes");
  inertia
      ->add_option("model", arguments->model, "model name, model.yaml, .urdf or MJCF (.xml) file")
      ->required();
  arguments->json.AddTo(inertia);
  SetFooter(inertia, {"inertia my_robot.urdf", "inertia my_robot.urdf --package arm=../arm_ws/arm"},
            "0 sound, 1 findings, 2 bad input");
  inertia->callback([arguments, exit_code] { *exit_code = Inertia(*arguments); });
}

}  // namespace mbv
