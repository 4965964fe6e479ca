// Scripts by which shells complete mbverify's commands, options and names.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "cli/cli.h"
#include "verify/version.h"

namespace mbv {

/// An option as it is typed.
struct OptionWords {
  std::vector<std::string> names;  ///< "--quiet", "-q"
  std::string description;
  bool takes_value = false;
  std::vector<std::string> values;  ///< the words that it takes; empty: any, or files
};
/// A command, "" for the program itself, with what may follow it.
struct CommandWords {
  std::string path;  ///< "history list"
  std::string description;
  std::vector<OptionWords> options;
  std::vector<std::string> names;  ///< kinds of names it takes: "models", "scenarios"; files, too
};

/// All commands and options that help shows, the program itself first.
[[nodiscard]] std::vector<CommandWords> WordsOf(const CLI::App& app);

namespace {

std::string PathOf(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr) return "";
  const std::string above = PathOf(*parent);
  return above.empty() ? command.get_name() : above + " " + command.get_name();
}

// The words of a check made by OneOf().
std::vector<std::string> ValuesOf(const CLI::Option& option) {
  const std::string type = option.get_type_name(), mark = ":one of ";
  const size_t at = type.find(mark);
  if (at == std::string::npos) return {};
  return CLI::detail::split(type.substr(at + mark.size()), ',');
}

OptionWords WordsOf(const CLI::Option& option) {
  OptionWords words;
  for (const std::string& name : option.get_lnames()) words.names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) words.names.push_back("-" + name);
  words.description = option.get_description();
  words.takes_value = option.get_items_expected_max() != 0;  // flags take none
  for (std::string value : ValuesOf(option)) words.values.push_back(CLI::detail::trim(value));
  return words;
}

void AddWords(const CLI::App& app, std::vector<CommandWords>* commands) {
  CommandWords words;
  words.path = PathOf(app);
  words.description = app.get_description();
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;
    if (!option->get_positional()) {
      words.options.push_back(WordsOf(*option));
    } else if (option->get_name() == "model" || option->get_name() == "scenario") {
      words.names.push_back(option->get_name() + "s");
    }
  }
  commands->push_back(std::move(words));
  for (const CLI::App* command :
       app.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); })) {
    AddWords(*command, commands);
  }
}

// The words that follow a command.
std::vector<std::string> CommandsBelow(const std::string& path,
                                       const std::vector<CommandWords>& commands) {
  std::vector<std::string> below;
  const std::string start = path.empty() ? "" : path + " ";
  for (const CommandWords& command : commands) {
    if (command.path.empty() || !command.path.starts_with(start)) continue;
    const std::string word = command.path.substr(start.size());
    if (word.find(' ') == std::string::npos) below.push_back(word);
  }
  return below;
}

std::vector<std::string> OptionNames(const CommandWords& command) {
  std::vector<std::string> names;
  for (const OptionWords& option : command.options) {
    names.insert(names.end(), option.names.begin(), option.names.end());
  }
  return names;
}

// In single quotes.
std::string Quoted(std::string text) {
  for (size_t at = text.find('\''); at != std::string::npos; at = text.find('\'', at + 4)) {
    text.replace(at, 1, "'\\''");
  }
  return "'" + text + "'";
}

std::string Bash(const std::vector<CommandWords>& commands) {
  std::string paths, values, options, below, names;
  for (const CommandWords& command : commands) {
    const std::string path = Quoted(command.path);
    if (!command.path.empty()) {
      const size_t space = command.path.find(' ');
      const std::string typed = space == std::string::npos ? " " + command.path : command.path;
      paths += fmt::format("      {}) command={} ;;\n", Quoted(typed), path);
    }
    for (const OptionWords& option : command.options) {
      if (!option.takes_value) continue;
      std::vector<std::string> typed;
      for (const std::string& name : option.names) typed.push_back(command.path + " " + name);
      for (std::string& pattern : typed) pattern = Quoted(pattern);
      values += fmt::format("    {}) words={} value=1 ;;\n", fmt::join(typed, "|"),
                            Quoted(fmt::format("{}", fmt::join(option.values, " "))));
    }
    options += fmt::format("      {}) words={} ;;\n", path,
                           Quoted(fmt::format("{}", fmt::join(OptionNames(command), " "))));
    const auto words = CommandsBelow(command.path, commands);
    if (!words.empty()) {
      below += fmt::format("      {}) words={} ;;\n", path,
                           Quoted(fmt::format("{}", fmt::join(words, " "))));
    }
    for (const std::string& kind : command.names) {
      names +=
          fmt::format("      {}) words=$(mbverify list --names {} 2>/dev/null) ;;\n", path, kind);
    }
  }
  return fmt::format(R"(# bash completion for mbverify
_mbverify() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD-1]}}
  local command= words= value= word
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$command $word" in
{}    esac
  done
  case "$command $prev" in
{}  esac
  if [ -z "$value" ] && [[ $cur == -* ]]; then
    case "$command" in
{}    esac
    COMPREPLY=($(compgen -W "$words" -- "$cur"))
    return
  fi
  if [ -z "$value" ]; then
    case "$command" in
{}{}    esac
  fi
  COMPREPLY=($(compgen -W "$words" -- "$cur"))
  [ -n "$value" ] && [ -n "$words" ] || COMPREPLY+=($(compgen -f -- "$cur"))
}}
complete -o filenames -F _mbverify mbverify
)",
                     paths, values, options, below, names);
}

std::string Fish(const std::vector<CommandWords>& commands) {
  std::string text = "# fish completion for mbverify\n";
  for (const CommandWords& command : commands) {
    const size_t space = command.path.rfind(' ');
    const std::string above = space == std::string::npos ? "" : command.path.substr(0, space);
    const std::string last =
        space == std::string::npos ? command.path : command.path.substr(space + 1);
    std::string seen = "__fish_use_subcommand";
    if (!above.empty()) {
      seen = fmt::format("__fish_seen_subcommand_from {}; and not __fish_seen_subcommand_from {}",
                         above, fmt::join(CommandsBelow(above, commands), " "));
    }
    if (!command.path.empty()) {
      text += fmt::format("complete -c mbverify -n {} -f -a {} -d {}\n", Quoted(seen), last,
                          Quoted(command.description));
    }
    const std::string here =
        command.path.empty() ? "__fish_use_subcommand" : "__fish_seen_subcommand_from " + last;
    for (const OptionWords& option : command.options) {
      std::string line = fmt::format("complete -c mbverify -n {}", Quoted(here));
      for (const std::string& name : option.names) {
        line += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
      }
      if (option.takes_value) line += " -r";
      if (!option.values.empty()) {
        line += " -f -a " + Quoted(fmt::format("{}", fmt::join(option.values, " ")));
      }
      text += line + " -d " + Quoted(option.description) + "\n";
    }
    for (const std::string& kind : command.names) {
      text += fmt::format("complete -c mbverify -n {} -a {}\n", Quoted(here),
                          Quoted("(mbverify list --names " + kind + " 2>/dev/null)"));
    }
  }
  return text;
}

// zsh gives brackets and colons in descriptions a meaning.
std::string ForZsh(const std::string& text) {
  std::string plain;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') plain += '\\';
    plain += c;
  }
  return plain;
}

std::string ZshArguments(const CommandWords& command) {
  std::string text = "_arguments";
  for (const OptionWords& option : command.options) {
    const std::string value = !option.takes_value ? ""
                              : option.values.empty()
                                  ? ":value:_files"
                                  : fmt::format(":value:({})", fmt::join(option.values, " "));
    for (const std::string& name : option.names) {
      text += " \\\n        " + Quoted(name + "[" + ForZsh(option.description) + "]" + value);
    }
  }
  for (const std::string& kind : command.names) {
    text += " \\\n        " + Quoted("*:" + kind + ":{ compadd $(mbverify list --names " + kind +
                                     " 2>/dev/null); _files }");
  }
  return command.names.empty() ? text + " \\\n        '*:file:_files'" : text;
}

std::string Zsh(const std::vector<CommandWords>& commands) {
  std::string listed, cases;
  for (const CommandWords& command : commands) {
    if (command.path.empty() || command.path.find(' ') != std::string::npos) continue;
    listed += "    " + Quoted(command.path + ":" + ForZsh(command.description)) + "\n";
    cases += fmt::format("    {})\n", command.path);
    const auto below = CommandsBelow(command.path, commands);
    if (!below.empty()) {
      cases += fmt::format("      if (( CURRENT == 3 )); then compadd {}; return; fi\n",
                           fmt::join(below, " "));
    }
    cases += "      " + ZshArguments(command) + " ;;\n";
  }
  return fmt::format(R"(#compdef mbverify
# zsh completion for mbverify
_mbverify() {{
  local -a commands=(
{}  )
  if (( CURRENT == 2 )); then
    _describe command commands
    return
  fi
  local command=$words[2]
  case $command in
{}  esac
}}
if [ "$funcstack[1]" = _mbverify ]; then _mbverify "$@"; else compdef _mbverify mbverify; fi
)",
                     listed, cases);
}

}  // namespace

std::vector<CommandWords> WordsOf(const CLI::App& app) {
  std::vector<CommandWords> commands;
  AddWords(app, &commands);
  return commands;
}

// The script of a shell: bash, zsh or fish.
std::string CompletionScript(const std::string& shell, const std::vector<CommandWords>& commands) {
  return shell == "bash" ? Bash(commands) : shell == "zsh" ? Zsh(commands) : Fish(commands);
}

// The manual page of the program, of what its commands say of themselves.

namespace {

// Text as it is: no request, no escape of troff's.
std::string Troff(const std::string& text) {
  std::string out = text.starts_with('.') || text.starts_with('\'') ? "\\&" : "";
  for (const char c : text) {
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c == '\n' ? ' ' : c;
    }
  }
  return out;
}

std::string OptionText(const OptionWords& option) {
  std::string names;
  for (const std::string& name : option.names) {
    names += (names.empty() ? "\\fB" : ", \\fB") + Troff(name) + "\\fR";
  }
  std::string text = ".TP\n" + names + (option.takes_value ? " \\fIVALUE\\fR" : "") + "\n";
  text += option.description.empty() ? "\\&\n" : Troff(option.description) + "\n";
  if (!option.values.empty()) {
    text += fmt::format("(one of {})\n", Troff(fmt::format("{}", fmt::join(option.values, ", "))));
  }
  return text;
}

// "Examples:" and "Exit codes:" of a command, a line each.
std::string FooterText(const CLI::App& app) {
  std::istringstream lines(app.get_footer());
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    const bool example = line.starts_with("  ");
    text += (example ? ".br\n" : ".PP\n") + Troff(CLI::detail::trim_copy(line)) + "\n";
  }
  return text;
}

std::string PositionalText(const CLI::App& app) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_positional() || option->get_group().empty()) continue;
    text += fmt::format(".TP\n\\fI{}\\fR\n{}\n", Troff(option->get_name()),
                        Troff(option->get_description()));
  }
  return text;
}

// Commands in the order of WordsOf(), which is that of `app`.
const CLI::App* FindCommand(const CLI::App& app, const std::string& path) {
  const CLI::App* found = &app;
  std::istringstream words(path);
  for (std::string word; found != nullptr && words >> word;) {
    const auto below =
        found->get_subcommands([&](const CLI::App* one) { return one->get_name() == word; });
    found = below.empty() ? nullptr : below.front();
  }
  return found;
}

}  // namespace

// man(7) source, section 1: every command and option that help shows, with examples and exit
// codes. `version` stands at its foot.
std::string ManPage(const CLI::App& app, const std::string& version) {
  std::string text = fmt::format(
      ".TH MBVERIFY 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\nmbverify \\- {}\n"
      ".SH SYNOPSIS\n\\fBmbverify\\fR \\fICOMMAND\\fR [\\fIARGUMENT\\fR ...]\n",
      Troff(version), Troff(app.get_description()));
  for (const CommandWords& command : WordsOf(app)) {
    const CLI::App* of = FindCommand(app, command.path);
    if (of == nullptr) continue;
    text += command.path.empty() ? ".SH OPTIONS\n"
                                 : fmt::format(".SS mbverify {}\n{}\n", Troff(command.path),
                                               Troff(command.description));
    text += PositionalText(*of);
    for (const OptionWords& option : command.options) text += OptionText(option);
    text += FooterText(*of);
    if (command.path.empty()) text += ".SH COMMANDS\n";
  }
  return text;
}

// mbverify completion

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
