#include "cli/cli.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>
#include <system_error>

#include "pipeline/version.h"

namespace mbv {
namespace {

std::string VersionText() {
  std::string text;
  for (const auto& [name, version] : Versions()) {
    text += fmt::format("{}{} {}", text.empty() ? "" : "\n", name, version);
  }
  return text;
}

// Does not throw: standard error may be full, too.
void Complain(const std::string& text) { std::fputs((text + "\n").c_str(), stderr); }

int InternalError(const std::exception& error) {
  Complain(std::string("internal error: ") + error.what());
  return 4;
}

// NaN passes every range, and infinity most.
std::string WhyNotFinite(const std::string& text) {
  // What is no number at all has its own message.
  return std::isfinite(std::strtod(text.c_str(), nullptr)) ? "" : text + " is not a finite number";
}

void RequireFiniteNumbers(CLI::App* app) {
  for (CLI::Option* option : app->get_options()) {
    if (option->get_type_name().starts_with("FLOAT")) option->check(WhyNotFinite, "");
  }
  for (CLI::App* command : app->get_subcommands([](CLI::App*) { return true; })) {
    RequireFiniteNumbers(command);
  }
}

}  // namespace

int WorseExit(int a, int b) {
  static constexpr std::array<int, 5> kBadness = {0, 1, 3, 2, 4};  // of exit codes 0 … 4
  return kBadness[static_cast<size_t>(a)] >= kBadness[static_cast<size_t>(b)] ? a : b;
}

int RunCli(int argc, char** argv) {
  CLI::App app(
      "Verifies the dynamics of closed-loop mechanisms: closed-form equations, a generic "
      "reference solver and MuJoCo against each other.");
  app.name("mbverify");
  app.set_version_flag("--version", VersionText());
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  mbverify init my_linkage\n"
      "  mbverify run scenarios/stabilizing_platform/sea_state.yaml\n"
      "  mbverify check my_model.yaml my_scenario.yaml\n"
      "  mbverify model spr_tripod --format mjcf\n"
      "  mbverify audit scara_robot\n"
      "Exit codes: 0 agree, 1 disagree, 2 bad input, 3 could not run, 4 internal error");
  int exit_code = 4;
  AddInitCommand(&app, &exit_code);
  AddRunCommand(&app, &exit_code);
  AddRenderCommand(&app, &exit_code);
  AddModelCommand(&app, &exit_code);
  AddCheckCommand(&app, &exit_code);
  AddAuditCommand(&app, &exit_code);
  AddListCommand(&app, &exit_code);
  AddWorkspaceCommand(&app, &exit_code);
  AddStiffnessCommand(&app, &exit_code);
  AddMutateCommand(&app, &exit_code);
  AddConvergeCommand(&app, &exit_code);
  AddSurveyCommand(&app, &exit_code);
  AddRegressCommand(&app, &exit_code);
  AddMergeCommand(&app, &exit_code);
  AddHistoryCommand(&app, &exit_code);
  RequireFiniteNumbers(&app);
  std::string lost;  // why output was lost
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    exit_code = app.exit(error) == 0 ? 0 : 2;
  } catch (const std::system_error& error) {
    // This is how printing reports that it failed.
    if (std::ferror(stdout) == 0 && std::ferror(stderr) == 0) return InternalError(error);
    lost = error.code().message();
  } catch (const std::bad_alloc&) {
    Complain("error: could not run: out of memory");
    exit_code = 3;
  } catch (const std::exception& error) {
    return InternalError(error);
  }
  if (std::fflush(stdout) != 0) lost = std::strerror(errno);
  if (lost.empty() && std::ferror(stdout) == 0) return exit_code;
  // Results that nobody can read are not delivered.
  Complain("error: cannot write to standard output" + (lost.empty() ? "" : ": " + lost));
  return 2;
}

}  // namespace mbv
