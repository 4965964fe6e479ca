#include "regress/finish.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/files.h"
#include "core/in_children.h"
#include "regress/accuracy.h"
#include "regress/history.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kThumbnailTimeout_s = 20.0;
constexpr int kThumbnailPx = 144;
constexpr size_t kHeadBytes = 200;  // of a file, which tell what it is

// Pictures may be anybody's (merge): children decode them.
std::map<std::string, std::string> Thumbnails(const RunFolder& folder,
                                              const RegressReport& report) {
  std::vector<std::pair<std::string, fs::path>> pictures;  // by key
  for (const CaseResult& result : report.cases) {
    if (!result.has_folder) continue;
    if (auto picture = folder.Snapshot(result.key)) {
      pictures.emplace_back(result.key, *std::move(picture));
    }
  }
  const auto texts = InChildren(pictures.size(), kThumbnailTimeout_s, [&](size_t i) {
    return ThumbnailUri(ReadWholeFile(pictures[i].second).value_or(""), kThumbnailPx);
  });
  std::map<std::string, std::string> thumbnails;
  for (size_t i = 0; i < pictures.size(); ++i) {
    thumbnails[pictures[i].first] = texts[i].value_or("");
  }
  return thumbnails;
}

// A file that the user named; not one that a scenario was computed from. "" or what went wrong.
std::string WriteElsewhere(const std::string& path, const std::string& text,
                           const RegressReport& report) {
  std::map<std::string, InputFile> inputs;  // models are read by many
  for (const CaseResult& result : report.cases) {
    for (const InputFile& input : result.input_files) inputs.emplace(input.file, input);
  }
  for (const auto& [file, input] : inputs) {
    if (SameFile(path, {input}).empty()) continue;
    return fmt::format("{} was read for a scenario: choose another output", path);
  }
  return WriteFile(path, text);
}

}  // namespace

void AddTrouble(const std::string& text, RegressOutcome* outcome) {
  if (text.empty()) return;
  outcome->trouble += (outcome->trouble.empty() ? "" : "\n") + text;
}

std::vector<std::string> NightFiles(const RegressOptions& options,
                                    const std::vector<std::string>& keys) {
  std::vector<std::string> names = {"index.html", "regress.json", kUnfinished};
  if (options.junit.empty()) names.emplace_back("junit.xml");
  if (options.markdown.empty()) names.emplace_back("summary.md");
  for (const auto& [name, content] : options.shared_files) names.push_back(name);
  for (const std::string& key : keys) names.push_back(RunFolder::Log(key));
  return names;
}

std::string FindTaken(const RegressOptions& options, const std::vector<std::string>& keys) {
  std::vector<std::string> names = NightFiles(options, keys);
  for (const std::string& file : {options.history, options.junit, options.markdown}) {
    if (file.empty()) continue;
    names.push_back(fs::path(file).lexically_relative(options.out).generic_string());
  }
  const std::set<std::string> taken(names.begin(), names.end());
  std::string trouble;
  for (const std::string& key : keys) {
    for (size_t end = key.find('/');; end = key.find('/', end + 1)) {
      if (const std::string part = key.substr(0, end); taken.contains(part)) {
        trouble += fmt::format(
            "{}{}: error: its results would lie at {}, where the night writes a file of its own; "
            "rename the scenario or its folder",
            trouble.empty() ? "" : "\n", key, part);
      }
      if (end == std::string::npos) break;
    }
  }
  return trouble;
}

void FinishNight(const RegressOptions& options, const RunFolder& folder, RegressOutcome* outcome) {
  RegressReport& report = outcome->report;
  std::sort(report.cases.begin(), report.cases.end(),
            [](const CaseResult& a, const CaseResult& b) { return a.key < b.key; });
  std::map<std::string, std::string> thumbnails;
  if (options.pictures) thumbnails = Thumbnails(folder, report);
  if (!options.history.empty()) {
    std::map<std::string, GoldenTraces> goldens;
    for (const CaseResult& result : report.cases) {
      if (result.has_folder) goldens[result.key] = folder.Golden(result.key);
    }
    AddTrouble(AppendRun(options.history, goldens, &report), outcome);
  }
  bool whole = true;  // every file of the night is of this one
  const auto keep = [&](const fs::path& path, const std::string& trouble) {
    if (trouble.empty()) outcome->files.push_back(path);
    whole = whole && trouble.empty();
    AddTrouble(trouble, outcome);
  };
  const auto write = [&](const std::string& name, const std::string& content) {
    keep(folder.path() / name, folder.Write(name, content));
  };
  const auto write_at = [&](const std::string& given, const char* name, const std::string& text) {
    given.empty() ? write(name, text) : keep(given, WriteElsewhere(given, text, report));
  };
  for (const auto& [name, content] : options.shared_files) {
    AddTrouble(folder.Write(name, content), outcome);
  }
  write_at(options.junit, "junit.xml", ToJUnit(report));
  write_at(options.markdown, "summary.md", ToMarkdown(report));
  const auto summary = [&](const std::string& scenario) {
    return ReadWholeFile(folder.path() / scenario / "summary.json");
  };
  for (const std::string& document : options.tables) {
    const auto text = ReadWholeFile(document);
    keep(document, text ? WriteFile(document, FillAccuracyTables(*text, summary))
                        : fmt::format("{}: cannot be read", document));
  }
  // What merge reads is about whole results; the page says so as long as the rest is not.
  write("regress.json", ToJson(report));
  write("index.html", ToIndexHtml(report, thumbnails));
  if (whole) folder.Finished();
  outcome->exit_code = outcome->trouble.empty() ? ExitCodeOf(report) : 2;
}

namespace {

// A summary that an earlier night left there, or nothing yet.
bool IsOfANight(const std::string& path) {
  const std::string start = ReadWholeFile(path).value_or("").substr(0, kHeadBytes);
  return start.empty() || start.starts_with(kMarkdownTitle) ||
         start.find("\"mbverify.regress/") != std::string::npos ||
         start.find(fmt::format("<testsuites name=\"{}\"", kJUnitName)) != std::string::npos;
}

}  // namespace

std::string FindClash(const RegressOptions& options, const std::vector<CaseFile>& cases) {
  const auto clash = [](const std::string& output, const std::string& input) {
    std::error_code error;
    return fs::equivalent(output, input, error) && !error;
  };
  for (const std::string& output :
       {options.junit, options.markdown, options.json, options.history}) {
    if (output.empty()) continue;
    for (const CaseFile& file : cases) {
      if (!clash(output, file.file)) continue;
      return fmt::format("{}: error: is a scenario that is to be run; choose another output",
                         output);
    }
  }
  // Models, tables and meshes that are read, and whatever else.
  for (const std::string& output : {options.junit, options.markdown, options.json}) {
    std::error_code error;
    if (!fs::is_regular_file(output, error) || IsOfANight(output)) continue;
    return fmt::format("{}: error: mbverify did not write it; choose another output", output);
  }
  return "";
}

}  // namespace mbv
