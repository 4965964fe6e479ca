// mbverify completion
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/completion.h"
#include "cli/man_page.h"
#include "pipeline/version.h"

namespace mbv {

void AddCompletionCommand(CLI::App* app, int* exit_code) {
  auto shell = std::make_shared<std::string>();
  CLI::App* completion = app->add_subcommand(
      "completion", "The script by which a shell completes commands, options and names");
  completion->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(OneOf({"bash", "zsh", "fish"}));
  SetFooter(completion,
            {"completion bash >~/.local/share/bash-completion/completions/mbverify",
             "completion zsh >\"${fpath[1]}/_mbverify\"",
             "completion fish >~/.config/fish/completions/mbverify.fish"},
            "0 done, 2 bad input");
  completion->callback([app, shell, exit_code] {
    fmt::print("{}", CompletionScript(*shell, WordsOf(*app)));
    *exit_code = 0;
  });
}

// For the build, which installs the page; help does not show it.
void AddManPageCommand(CLI::App* app, int* exit_code) {
  CLI::App* page = app->add_subcommand("man-page", "The manual page, as source for man");
  page->group("");
  page->callback([app, exit_code] {
    fmt::print("{}", ManPage(*app, std::string("mbverify ") + kVersion));
    *exit_code = 0;
  });
}

}  // namespace mbv
