// mbverify init
#include <fmt/format.h>

#include <memory>

#include "cli/assembly_option.h"
#include "cli/cli.h"
#include "cli/terminal.h"
#include "pipeline/init_model.h"

namespace mbv {
namespace {

struct InitArguments {
  InitOptions options;
  std::vector<std::string> assembly;
};

int Init(InitArguments arguments) {
  if (!ReadAssembly(arguments.assembly, &arguments.options.assembly)) return 2;
  const InitResult result = InitModel(arguments.options);
  SayText(stderr, result.diagnostics.Text());
  if (result.files.empty()) return result.exit_code;
  for (const std::string& file : result.files) fmt::print("wrote {}\n", file);
  Say(stdout, "next: mbverify run {}\n", result.files.back());
  return 0;
}

}  // namespace

void AddInitCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<InitArguments>();
  InitOptions* const options = &arguments->options;
  std::string names;
  for (const Starter& starter : Starters()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", starter.name);
  }
  CLI::App* init = app->add_subcommand("init", "Write a model and a scenario to start from");
  init->add_option("name", options->name, "name of your mechanism")->required();
  init->add_option("--from", options->from,
                   "mechanism to start from: " + names + "; or a robot: FILE.urdf, FILE.xml")
      ->capture_default_str();
  init->add_option("--into", options->into, "folder that gets models/ and scenarios/")
      ->capture_default_str();
  AddAssemblyOption(init, &arguments->assembly);
  SetFooter(init,
            {"init my_linkage && mbverify run scenarios/my_linkage/first.yaml",
             "init my_crank --from slider_crank", "init my_robot --from my_robot.urdf"},
            "0 written, 2 bad input. Nothing that exists is overwritten.");
  init->callback([arguments, exit_code] { *exit_code = Init(*arguments); });
}

}  // namespace mbv
