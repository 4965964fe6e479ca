#include "cli/cli.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <sstream>
#include <system_error>

#include "base/text.h"
#include "cli/terminal.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/yaml/yaml_reader.h"
#include "verify/version.h"

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
void Complain(const std::string& text) { std::fputs((ForTerminal(text) + "\n").c_str(), stderr); }

int SayInternalError(const std::exception& error) {
  Complain(std::string("internal error: ") + error.what());
  return 4;
}

// NaN passes every range, and infinity most.
std::string NotFiniteReason(const std::string& text) {
  // What is not a number at all has its own message.
  return std::isfinite(std::strtod(text.c_str(), nullptr)) ? "" : text + " is not a finite number";
}

void RequireFiniteNumbers(CLI::App* app) {
  for (CLI::Option* option : app->get_options()) {
    if (option->get_type_name().starts_with("FLOAT")) option->check(NotFiniteReason, "");
  }
  for (CLI::App* command : app->get_subcommands([](CLI::App*) { return true; })) {
    RequireFiniteNumbers(command);
  }
}

constexpr size_t kHelpColumns = 80;  // where there is no terminal

size_t HelpColumns() {
  if (const size_t columns = TerminalColumns(stdout); columns > 0) return columns;
  const char* text = std::getenv("COLUMNS");
  const unsigned long columns = text == nullptr ? 0 : std::strtoul(text, nullptr, 10);
  return columns >= 40 ? columns : kHelpColumns;
}

// Examples stay commands that a shell takes when their lines are broken.
std::string HelpFor(const std::string& text, size_t columns) {
  std::string help;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const bool example = line.starts_with("  mbverify ") && line.size() > columns;
    std::string fitted = Wrapped(line, example ? columns - 2 : columns);
    for (size_t at = fitted.find('\n'); example && at != std::string::npos;
         at = fitted.find('\n', at + 3)) {
      fitted.insert(at, " \\");
    }
    help += fitted + "\n";
  }
  return help;
}

std::string CommandPath(const CLI::App& command) {
  const CLI::App* parent = command.get_parent();
  if (parent == nullptr) return command.get_name();
  return CommandPath(*parent) + " " + command.get_name();
}

// The message and hint about the first word that the command has no use for; "" if all have one.
std::pair<std::string, std::string> AboutUnknownWord(const CLI::App& app) {
  const CLI::App* command = &app;
  while (!command->get_subcommands().empty()) command = command->get_subcommands().back();
  // A command that lets its parent try leaves the word there.
  std::vector<std::string> words;
  for (const CLI::App* at = command; at != nullptr && words.empty(); at = at->get_parent()) {
    words = at->remaining();
  }
  if (words.empty()) return {};
  const std::string word = words.front().substr(0, words.front().find('='));
  std::vector<std::string> names;
  if (word.starts_with("-")) {
    for (const CLI::Option* option : command->get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return {fmt::format("{} has no option '{}'", CommandPath(*command), Printable(word)),
            DidYouMean(word, names, "see " + CommandPath(*command) + " --help")};
  }
  const auto shown = [](const CLI::App* one) { return !one->get_group().empty(); };
  for (const CLI::App* known : command->get_subcommands(shown)) names.push_back(known->get_name());
  if (names.empty()) return {};
  return {fmt::format("there is no command '{} {}'", CommandPath(*command), Printable(word)),
          DidYouMean(word, names, "commands: " + Joined(names))};
}

// "mbverify run [OPTIONS] scenario...".
std::string UsageOf(const CLI::App& command, const std::string& path) {
  std::string text = path;
  if (!command.get_options([](const CLI::Option* o) { return o->nonpositional(); }).empty()) {
    text += " [OPTIONS]";
  }
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() || option->get_group().empty()) continue;
    const std::string word =
        option->get_name() + (option->get_items_expected_max() > 1 ? "..." : "");
    text += " " + (option->get_required() ? word : "[" + word + "]");
  }
  if (!command.get_subcommands([](const CLI::App*) { return true; }).empty()) text += " COMMAND";
  return text;
}

// Help and version, or what is wrong with the command line. Returns the exit code.
int AnswerParse(const CLI::App& app, const CLI::ParseError& error) {
  const auto [message, hint] = AboutUnknownWord(app);
  if (error.get_exit_code() != 0 && !message.empty()) return Refuse(message, hint);
  if (error.get_exit_code() != 0) {
    const CLI::App* command = &app;
    while (!command->get_subcommands().empty()) command = command->get_subcommands().back();
    const std::string path = CommandPath(*command);
    const int code = Refuse(error.what(), "");
    Say(stderr, "usage: {}\n  hint: see {} --help\n", UsageOf(*command, path), path);
    return code;
  }
  std::ostringstream out, err;
  (void)app.exit(error, out, err);
  fmt::print("{}", HelpFor(out.str(), HelpColumns()));
  return 0;
}

// --package of commands that read robots.
void AddPackages(CLI::App* command) {
  command
      ->add_option_function<std::vector<std::string>>(
          "--package",
          [](const std::vector<std::string>& texts) {
            std::vector<MeshPackage> packages;
            for (const std::string& text : texts) {
              const size_t at = text.find('=');
              std::error_code error;
              if (at == 0 || at == std::string::npos ||
                  !std::filesystem::is_directory(text.substr(at + 1), error)) {
                throw CLI::ValidationError(
                    "--package", "'" + Printable(text) + "' is not NAME=DIR with a folder DIR");
              }
              packages.push_back({text.substr(0, at), text.substr(at + 1)});
            }
            UseMeshPackages(std::move(packages));
          },
          "NAME=DIR: package://NAME/… and model://NAME/… lie in DIR, whose files a robot's file "
          "may "
          "name (repeatable)")
      ->allow_extra_args(false);
}

}  // namespace

void SetFooter(CLI::App* command, const std::vector<std::string>& examples,
               const std::string& exit_codes) {
  std::string text = examples.size() == 1 ? "Example:\n" : "Examples:\n";
  for (const std::string& example : examples) text += "  mbverify " + example + "\n";
  command->footer(text + "Exit codes: " + exit_codes);
}

CLI::Validator Positive() {
  return CLI::Validator(
      [](const std::string& text) {
        char* end = nullptr;
        const double value = std::strtod(text.c_str(), &end);
        const bool good = end != text.c_str() && *end == '\0' && value > 0.0;
        return good ? std::string() : fmt::format("'{}' violates > 0", QuotedValue(text));
      },
      "> 0");
}

CLI::Validator WholeNumber() {
  return CLI::Validator(
      [](const std::string& text) {
        std::uint64_t number = 0;
        const char* end = text.data() + text.size();
        const auto parsed = std::from_chars(text.data(), end, number);
        const bool whole = parsed.ec == std::errc() && parsed.ptr == end;
        return whole ? std::string()
                     : fmt::format("'{}': a whole number from 0 to 2^64 - 1 is needed",
                                   QuotedValue(text));
      },
      "");
}

CLI::Validator OneOf(const std::vector<std::string>& words) {
  const std::string list = Joined(words);
  return CLI::Validator(
      [words, list](const std::string& word) {
        if (Contains(words, word)) return std::string();
        const std::string hint = DidYouMean(word, words);
        return fmt::format("'{}' is not one of {}{}", Printable(word), list,
                           hint.empty() ? "" : "\n  hint: " + hint);
      },
      "one of " + list);
}

void AddHelpCommand(CLI::App* app, int* exit_code) {
  auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* help = app->add_subcommand("help", "What a command does, and its options");
  help->add_option("command", *words, "none: all commands");
  SetFooter(help, {"help run", "help history compare"}, "0 shown, 2 there is no such command");
  help->callback([app, words, exit_code] {
    CLI::App* command = app;
    std::string path;
    for (const std::string& word : *words) {
      path += (path.empty() ? "" : " ") + command->get_name();
      std::vector<std::string> names;
      CLI::App* next = nullptr;
      for (CLI::App* one : command->get_subcommands([](CLI::App*) { return true; })) {
        if (!one->get_group().empty()) names.push_back(one->get_name());
        if (one->get_name() == word) next = one;
      }
      if (next == nullptr) {
        *exit_code = Refuse(fmt::format("there is no command '{} {}'", path, Printable(word)),
                            DidYouMean(word, names, "commands: " + Joined(names)));
        return;
      }
      command = next;
    }
    // The help of an app is that of the command it has parsed, which is this one.
    fmt::print("{}", HelpFor(command->get_formatter()->make_help(
                                 command,
                                 path.empty() ? app->get_name() : path + " " + command->get_name(),
                                 CLI::AppFormatMode::Normal),
                             HelpColumns()));
    *exit_code = 0;
  });
}

int Refuse(const std::string& message, const std::string& hint) {
  Say(stderr, "error: {}\n", Shortened(message));
  if (!hint.empty()) Say(stderr, "  hint: {}\n", Shortened(hint));
  return 2;
}

int NotWritten(const std::string& message, const std::string& hint) {
  (void)Refuse(message, hint);
  return 3;
}

int WorseExit(int a, int b) {
  static constexpr std::array<int, 5> kBadness = {0, 1, 3, 2, 4};  // of exit codes 0 … 4
  return kBadness[static_cast<size_t>(a)] >= kBadness[static_cast<size_t>(b)] ? a : b;
}

namespace {

// From the last word to the first, without the program's name, as CLI11 takes them.
std::vector<std::string> WordsOf(int argc, char** argv, std::span<const FormerName> former) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  for (const FormerName& name : former) {
    if (words.empty() || words.front() != name.name) continue;
    words.erase(words.begin());
    words.insert(words.begin(), name.now.begin(), std::ranges::find(name.now, nullptr));
    break;
  }
  std::ranges::reverse(words);
  return words;
}

}  // namespace

int RunCli(int argc, char** argv, std::span<const CommandRow> commands,
           std::span<const FormerName> former) {
  // A reader that went away (`| head`) and a limit of file sizes (`ulimit -f`) are failed writes,
  // which are reported; they do not end this process in silence with half of a result.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app(
      "Verifies the dynamics of closed-loop mechanisms: closed-form equations, a generic "
      "reference solver and MuJoCo against each other.");
  app.name("mbverify");
  app.set_version_flag("-V,--version", VersionText());
  app.require_subcommand(1);
  app.get_formatter()->column_width(std::min<size_t>(30, HelpColumns() / 3));
  SetFooter(&app,
            {"init my_linkage", "run scenarios/stabilizing_platform/sea_state.yaml",
             "check my_model.yaml my_scenario.yaml", "model spr_tripod --format mjcf",
             "audit scara_robot"},
            "0 agree, 1 disagree, 2 bad input, 3 could not run, 4 internal error");
  int exit_code = 4;
  for (const CommandRow& command : commands) {
    const size_t before = app.get_subcommands([](CLI::App*) { return true; }).size();
    command.add(&app, &exit_code);
    const auto added = app.get_subcommands([](CLI::App*) { return true; });
    for (size_t k = before; k < added.size(); ++k) {
      added[k]->group(command.heading);
      if (command.reads_robots) AddPackages(added[k]);
    }
  }
  RequireFiniteNumbers(&app);
  std::string lost;  // why output was lost
  const ParsedDocuments documents;
  try {
    if (argc <= 1) {  // what there is, but nothing was verified
      fmt::print("{}", HelpFor(app.help(), HelpColumns()));
      exit_code = 2;
    } else {
      app.parse(WordsOf(argc, argv, former));
    }
  } catch (const CLI::ParseError& error) {
    exit_code = AnswerParse(app, error);
  } catch (const std::system_error& error) {
    // This is how printing reports that it failed.
    if (std::ferror(stdout) == 0 && std::ferror(stderr) == 0) return SayInternalError(error);
    lost = error.code().message();
  } catch (const std::bad_alloc&) {
    Complain("error: could not run: out of memory");
    exit_code = 3;
  } catch (const std::exception& error) {
    return SayInternalError(error);
  }
  if (std::fflush(stdout) != 0) lost = std::strerror(errno);
  if (lost.empty() && std::ferror(stdout) == 0) return exit_code;
  // Results that no reader takes are not delivered.
  Complain("error: cannot write to standard output" + (lost.empty() ? "" : ": " + lost));
  return 3;
}

}  // namespace mbv
