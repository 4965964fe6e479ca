#include "cli/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "base/files.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/terminal.h"
#include "model_file/yaml/units.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool InMustFail(const fs::path& file, const fs::path& below) {
  for (const fs::path& part : file.lexically_relative(below).parent_path()) {
    if (part == "must_fail") return true;
  }
  return false;
}

std::string RefusedReason(const std::string& path, const std::vector<InputFile>& inputs) {
  const std::string input = SameFile(path, inputs);
  if (input.empty()) return "";
  return fmt::format("{} is {}, which was read for it: choose another file", path,
                     input == path ? "a file" : input);
}

// How a file's content begins: its format, and in texts the first word, which distinguishes a
// summary from a model file, or a table from notes.
std::string BeginningOf(std::string_view content) {
  for (const auto& [magic, format] : {std::pair<std::string_view, const char*>{"PK\3\4", "ZIP"},
                                      {"\x89PNG", "PNG"},
                                      {"%PDF", "PDF"},
                                      {"GIF8", "GIF"},
                                      {"SQLite format 3", "SQLite"}}) {
    if (content.starts_with(magic)) return format;
  }
  content = content.substr(0, 4096);
  if (content.find('\0') != std::string_view::npos) return "binary";
  if (content.starts_with("<?xml")) content = content.substr(content.find('>') + 1);
  const size_t at = content.find_first_not_of(" \t\r\n");
  const char first = at == std::string_view::npos ? ' ' : content[at];
  if (first == '#') return "text that begins with '#'";  // a heading, which may change
  const auto is_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  const auto from = std::ranges::find_if(content, is_word);
  const std::string word(from, std::find_if_not(from, content.end(), is_word));
  const char* format = first == '{' || first == '[' ? "JSON" : first == '<' ? "XML" : "text";
  return word.empty() ? format : fmt::format("{} that begins with '{}'", format, word);
}

}  // namespace

std::string ForeignFileReason(const std::string& path, const std::string& content) {
  const auto old = ReadWholeFile(path);  // of a regular file
  if (!old || old->empty()) return "";
  const std::string there = BeginningOf(*old), here = BeginningOf(content);
  if (there == here) return "";
  return fmt::format(
      "{} is {}, not {}: mbverify did not write it; choose another file, or remove it", path,
      Printable(there), here);
}

std::vector<std::string> ExpandYaml(const std::string& argument, std::vector<std::string>* unread) {
  std::error_code error;
  if (!fs::is_directory(argument, error)) return {argument};
  return FilesBelow(argument, ".yaml", unread);
}

std::vector<std::string> ExpandScenarios(const std::vector<std::string>& arguments,
                                         std::string* trouble) {
  std::vector<std::string> scenarios, unread;
  for (const std::string& given : arguments) {
    const std::string argument = FindScenario(given);
    std::error_code error;
    if (!fs::is_directory(argument, error)) {
      scenarios.push_back(argument);
      continue;
    }
    const size_t before = scenarios.size();
    for (const std::string& file : ExpandYaml(argument, &unread)) {
      if (InMustFail(file, argument) || !ReadScenarioHead(file).is_scenario) continue;
      scenarios.push_back(file);
    }
    if (scenarios.size() == before)
      unread.push_back(argument + ": error: no scenario in this folder");
  }
  for (const std::string& line : unread) *trouble += (trouble->empty() ? "" : "\n") + line;
  return scenarios;
}

std::optional<std::pair<std::string, std::string>> SplitSet(const std::string& text) {
  const size_t at = text.find('=');
  if (at == std::string::npos || at == 0) return {};
  return std::pair{text.substr(0, at), text.substr(at + 1)};
}

bool ReadAssignments(const std::vector<std::string>& texts, const char* option, const char* example,
                     std::vector<SetValue>* values, const std::string& section) {
  for (const std::string& text : texts) {
    const auto value = SplitSet(text);
    if (!value) {
      Say(stderr, "{} {}: error: write key=value, e.g. {}\n", option, text, example);
      return false;
    }
    values->emplace_back(section + value->first, value->second);
  }
  return true;
}

std::vector<std::string> FilesToRun(const std::vector<std::string>& arguments,
                                    const std::vector<std::string>& written, int* exit_code) {
  std::string trouble;
  std::vector<std::string> files = ExpandScenarios(arguments, &trouble);
  *exit_code = trouble.empty() ? 0 : Refuse(trouble, "");
  for (const std::string& file : files) {
    for (const std::string& path : written) {
      if (*exit_code == 0) *exit_code = RefuseInput(path, file);
    }
  }
  if (*exit_code != 0) files.clear();
  return files;
}

std::vector<InputFile> InputsOf(const std::string& scenario) {
  const InputWatch watch;
  (void)CheckFile(scenario);
  std::vector<InputFile> inputs = watch.files();
  inputs.push_back({scenario, ""});  // read or not
  return inputs;
}

int RefuseInput(const std::string& path, const std::string& scenario) {
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) return 0;  // nothing that could be lost
  const std::string trouble = RefusedReason(path, InputsOf(scenario));
  if (trouble.empty()) return 0;
  Say(stderr, "error: {}\n", trouble);
  return 2;
}

int WriteWholeFile(const std::string& path, const std::string& content,
                   const std::vector<InputFile>& inputs) {
  std::string why = RefusedReason(path, inputs);
  if (why.empty()) why = ForeignFileReason(path, content);
  if (!why.empty()) return Refuse(why, "");
  const std::string trouble = WriteFile(path, content);
  return trouble.empty() ? 0 : NotWritten(trouble, "");
}

namespace {

// NAME=LOW:HIGH, or `single` NAME=VALUE, which is both.
std::optional<NamedRange> ReadNamedRange(
    const std::string& option, bool single, const std::string& text,
    const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of) {
  const auto refuse = [](const std::string& message, const std::string& hint) {
    (void)Refuse(message, hint);
    return std::nullopt;
  };
  const char* instance = single ? "for instance pitch_deg=-20" : "for instance pitch_deg=-50:30";
  const auto assigned = SplitSet(text);
  const size_t colon = assigned ? assigned->second.find(':') : std::string::npos;
  if (!assigned || (!single && colon == std::string::npos)) {
    return refuse(option + " " + text + " is not NAME=" + (single ? "VALUE" : "LOW:HIGH"),
                  instance);
  }
  const NameInUnit named =
      SplitUnit(assigned->first, [&](const std::string& name) { return Contains(names, name); });
  const auto number = [&](const std::string& word) {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    return word.empty() || *end != '\0' || !std::isfinite(value) ? kNan : named.unit.to_si(value);
  };
  NamedRange range{.name = named.name, .low = kNan, .high = kNan};
  if (single) {
    range.low = range.high = number(assigned->second);
  } else {
    range.low = number(assigned->second.substr(0, colon));
    range.high = number(assigned->second.substr(colon + 1));
  }
  if (std::isnan(range.low) || std::isnan(range.high)) {
    return refuse(
        option + " " + text + (single ? ": a number is" : ": two numbers are") + " needed",
        instance);
  }
  const std::string unit = Contains(names, range.name) ? unit_of(range.name) : "";
  if (!unit.empty() && !named.unit.Suits(unit)) {
    return refuse(option + " " + text + ": the coordinate is in " + unit,
                  unit == "rad" ? "NAME=… in rad or NAME_deg=…" : "NAME=… in m or NAME_mm=…");
  }
  return range;
}

}  // namespace

namespace {

std::optional<std::vector<NamedRange>> ReadNamed(
    const std::string& option, bool single, const std::vector<std::string>& texts,
    const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of) {
  std::vector<NamedRange> ranges;
  for (const std::string& text : texts) {
    const auto range = ReadNamedRange(option, single, text, names, unit_of);
    if (!range) return std::nullopt;
    if (std::ranges::find(ranges, range->name, &NamedRange::name) != ranges.end()) {
      (void)Refuse(option + " of '" + range->name + "' is stated twice", "each coordinate once");
      return std::nullopt;
    }
    ranges.push_back(*range);
  }
  return ranges;
}

}  // namespace

std::optional<std::vector<NamedRange>> ReadNamedRanges(
    const std::vector<std::string>& texts, const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of) {
  return ReadNamed("--range", false, texts, names, unit_of);
}

std::optional<std::map<std::string, double>> ReadNamedValues(
    const std::string& option, const std::vector<std::string>& texts,
    const std::vector<std::string>& names,
    const std::function<std::string(const std::string&)>& unit_of) {
  const auto ranges = ReadNamed(option, true, texts, names, unit_of);
  if (!ranges) return std::nullopt;
  std::map<std::string, double> values;
  for (const NamedRange& range : *ranges) {
    if (!Contains(names, range.name)) {
      (void)Refuse(option + ": there is no '" + range.name + "'",
                   DidYouMean(range.name, names, "there are: " + Joined(names, 8)));
      return std::nullopt;
    }
    values[range.name] = range.low;
  }
  return values;
}

bool ReadParameters(const std::vector<std::string>& texts, LoadOptions* options) {
  std::vector<SetValue> values;
  if (!ReadAssignments(texts, "--set", "m_p=45000", &values)) return false;
  const Diagnostics findings = ReadParameterOptions(values, options);
  SayText(stderr, findings.Text());
  return !findings.has_errors();
}

std::optional<std::string> FindModelOrRefuse(const std::string& model) {
  auto file = FindModel(model, ".");
  if (!file) (void)Refuse(fmt::format("there is no model '{}'", model), ModelHint(model, "."));
  return file;
}

}  // namespace mbv
