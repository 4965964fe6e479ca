#include "equations/equations.h"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <map>

#include "base/files.h"
#include "base/inputs.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string PythonProgram() {
  const char* stated = std::getenv("MBV_PYTHON");
  return stated != nullptr && *stated != '\0' ? stated : "python3";
}

// As Octave reads it between single quotes.
std::string OctaveQuoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("''") : std::string(1, c);
  return quoted + "'";
}

const EquationLanguage kLanguages[] = {
    {"Python", ".py",
     [] {
       return std::vector<std::pair<std::string, std::string>>{
           {"equations.py", EquationsPythonText()}};
     },
     [](const fs::path& folder, const std::string& file) {
       return std::vector<std::string>{PythonProgram(), "-B", (folder / "equations.py").string(),
                                       file};
     },
     [](const std::string& file) {
       return std::vector<std::string>{PythonProgram(), file};
     }},
    {"Octave", ".m", &EquationsOctaveFiles,
     [](const fs::path& folder, const std::string& file) {
       return std::vector<std::string>{
           "octave-cli",
           "--norc",
           "--quiet",
           "--no-history",
           "--no-gui",
           "--eval",
           fmt::format("addpath({}); mbverify_host({})", OctaveQuoted(folder.string()),
                       OctaveQuoted(file))};
     },
     [](const std::string& file) {
       return std::vector<std::string>{"octave-cli", file};
     }},
};

}  // namespace

std::string EquationFailure::Text() const {
  if (!findings.empty()) {
    const std::string more =
        findings.size() == 1 ? "" : fmt::format(" (and {} more)", findings.size() - 1);
    return fmt::format("{}:{}: {}{}", findings.front().file, findings.front().line,
                       findings.front().message, more);
  }
  if (file.empty()) return message;
  const std::string place = line > 0 ? fmt::format("{}:{}", file, line) : file;
  return fmt::format("{} ({}{})", message, place, function.empty() ? "" : ", in " + function);
}

std::vector<Finding> EquationFailure::Findings() const {
  if (!findings.empty()) return findings;
  Finding finding;
  finding.file = file;
  finding.line = line;
  finding.message = function.empty() ? message : fmt::format("{}: {}", function, message);
  return {finding};
}

const EquationLanguage* FindEquationLanguage(const std::string& file) {
  for (const EquationLanguage& language : kLanguages) {
    if (file.ends_with(language.extension)) return &language;
  }
  return nullptr;
}

bool IsEquationProgram(const std::string& file) { return FindEquationLanguage(file) != nullptr; }

std::vector<std::string> EquationCommand(const std::string& file) {
  const EquationLanguage* language = FindEquationLanguage(file);
  if (language == nullptr) return {};
  std::error_code error;
  return language->shown(fs::absolute(file, error).string());
}

std::shared_ptr<Equations> OpenEquations(const std::string& file, Diagnostics* diagnostics) {
  // Kept while the process lives: a study asks for the same file at each of its points.
  static std::mutex mutex;
  static std::map<std::string, std::shared_ptr<Equations>> open;
  const auto text = ReadWholeFile(file);
  if (!text) {
    diagnostics->AddError(file, "the file of equations cannot be read", "");
    return nullptr;
  }
  NoteInput(file, *text);
  const EquationLanguage* language = FindEquationLanguage(file);
  if (language == nullptr && !file.ends_with(".yaml") && !file.ends_with(".yml")) {
    diagnostics->AddError(file, "is no file of equations",
                          "they are written in Python (.py), Octave or MATLAB (.m) or as formulas "
                          "in YAML (.yaml)");
    return nullptr;
  }
  std::error_code error;
  const std::string key = fs::absolute(file, error).string() + '\n' + ContentFingerprint(*text);
  const std::lock_guard lock(mutex);
  std::shared_ptr<Equations>& known = open[key];
  if (known == nullptr) {
    known = language == nullptr ? MakeFormulaEquations(file, *text)
                                : MakeProgramEquations(file, *language);
  }
  const auto info = known->Load();
  if (info) return known;
  for (Finding finding : info.failure.Findings()) {
    if (finding.file.empty()) finding.file = file;
    diagnostics->Add(std::move(finding));
  }
  open.erase(key);
  return nullptr;
}

}  // namespace mbv
