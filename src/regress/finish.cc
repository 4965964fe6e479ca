#include "regress/finish.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "core/files.h"
#include "regress/accuracy.h"
#include "regress/history.h"
#include "regress/in_children.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kThumbnailTimeout_s = 20.0;
constexpr int kThumbnailPx = 144;

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
  std::vector<std::string> names = {"index.html", "regress.json"};
  if (options.junit.empty()) names.emplace_back("junit.xml");
  if (options.markdown.empty()) names.emplace_back("summary.md");
  for (const auto& [name, content] : options.shared_files) names.push_back(name);
  for (const std::string& key : keys) names.push_back(RunFolder::Log(key));
  return names;
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
  const auto keep = [&](const fs::path& path, const std::string& trouble) {
    if (trouble.empty()) outcome->files.push_back(path);
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
  write("index.html", ToIndexHtml(report, thumbnails));
  write("regress.json", ToJson(report));  // last: what merge reads is about whole results
  outcome->exit_code = outcome->trouble.empty() ? ExitCodeOf(report) : 2;
}

std::string FindClash(const RegressOptions& options, const std::vector<CaseFile>& cases) {
  for (const std::string& output : {options.junit, options.markdown, options.history}) {
    if (output.empty()) continue;
    for (const CaseFile& file : cases) {
      std::error_code error;
      if (fs::equivalent(output, file.file, error) && !error) {
        return fmt::format("{}: error: is a scenario that is to be run; choose another output",
                           output);
      }
    }
  }
  return "";
}

}  // namespace mbv
