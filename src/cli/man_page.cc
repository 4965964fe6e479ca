#include "cli/man_page.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>

#include "cli/completion.h"

namespace mbv {
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

}  // namespace mbv
