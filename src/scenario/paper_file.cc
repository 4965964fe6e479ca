#include "scenario/paper_file.h"

#include <fmt/format.h>

#include "core/names.h"
#include "scenario/figures_reader.h"
#include "scenario/paper_parts.h"

namespace mbv {
namespace {

const std::vector<std::string> kEntryKeys = {
    "title",     "caption", "scenario", "section", "beside", "printed", "width_mm",
    "height_mm", "panels",  "maps",     "table",   "says",   "differs", "audit"};

class PaperReader {
 public:
  PaperReader(YamlReader* yaml, ValueReader* values) : parts_(yaml, values), yaml_(*yaml) {}

  PaperFile Read(const YamlNode& root) {
    PaperFile paper;
    paper.file = yaml_.file();
    const YamlMap map(&yaml_, &root, "", {"source", "figures", "left_out"});
    if (!map.valid()) return paper;
    paper.source = parts_.RequiredWords(map, "source");
    if (const YamlNode* figures = map.Required("figures")) {
      for (const YamlEntry& entry : yaml_.Entries(*figures, "figures")) {
        paper.entries.push_back(Entry(entry));
      }
    }
    if (const YamlNode* left = map.Find("left_out")) {
      for (const YamlEntry& entry : yaml_.Entries(*left, "left_out")) {
        paper.left_out.emplace_back(entry.key,
                                    yaml_.Text(*entry.value, "left_out." + entry.key).value_or(""));
      }
    }
    return paper;
  }

 private:
  PaperEntry Entry(const YamlEntry& at) {
    PaperEntry entry;
    const std::string path = "figures." + at.key;
    entry.name = {at.key, path, at.line, at.column};
    if (!IsName(at.key)) {
      yaml_.Error(at, fmt::format("{} is no name of files", path),
                  fmt::format("write {}", kNameRule));
    }
    const YamlMap map(&yaml_, at.value.get(), path, kEntryKeys);
    if (!map.valid()) return entry;
    entry.title = parts_.RequiredWords(map, "title");
    entry.caption = parts_.Words(map, "caption");
    entry.differs = parts_.Words(map, "differs");
    entry.scenario = parts_.Placed(map, "scenario");
    entry.section = parts_.Placed(map, "section");
    entry.width_mm = parts_.Number(map, "width_mm");
    entry.height_mm = parts_.Number(map, "height_mm");
    if (const YamlNode* audit = map.Find("audit")) {
      entry.audit = parts_.List(*audit, map.PathOf("audit"));
    }
    entry.beside = parts_.Beside(map);
    entry.printed = parts_.Printed(map);
    parts_.Drawn(map, &entry);
    parts_.Says(map, &entry.statements);
    CheckKind(entry, at);
    return entry;
  }

  // An entry is one thing: panels, maps, a section or a table.
  void CheckKind(const PaperEntry& entry, const YamlEntry& at) {
    const int kinds = (entry.panels.empty() ? 0 : 1) + (entry.maps.empty() ? 0 : 1) +
                      (entry.columns.empty() ? 0 : 1) + (entry.section.given() ? 1 : 0);
    if (kinds != 1 && !yaml_.has_errors()) {
      yaml_.Error(at, entry.name.path + " shows nothing, or several things",
                  "give one of panels, maps, section and table");
    }
    if (!entry.section.given() && !entry.scenario.given()) {
      yaml_.Error(at, entry.name.path + ".scenario is missing: there is nothing to run");
    }
  }

  PaperParts parts_;
  YamlReader& yaml_;
};

std::optional<PaperFile> ReadPaper(YamlReader* yaml, const std::string& text,
                                   Diagnostics* diagnostics) {
  std::optional<PaperFile> paper;
  Scope scope;
  ValueReader values(yaml, &scope);
  if (const YamlNodePtr root = yaml->Parse(text)) paper = PaperReader(yaml, &values).Read(*root);
  diagnostics->Append(yaml->diagnostics());
  if (yaml->has_errors()) paper.reset();
  return paper;
}

}  // namespace

const std::vector<std::string>& PaperMeasureWords() {
  static const std::vector<std::string> words = {"range",       "largest",      "difference",
                                                 "share",       "beyond",       "mirror",
                                                 "mirror_pair", "median_ratio", "workspace"};
  return words;
}

std::optional<PaperFile> LoadPaper(const std::string& file, Diagnostics* diagnostics) {
  YamlReader yaml(file);
  const auto text = yaml.ReadFile();
  if (text) return ReadPaper(&yaml, *text, diagnostics);
  diagnostics->Append(yaml.diagnostics());
  return {};
}

std::optional<PaperFile> LoadPaperText(const std::string& text, const std::string& file,
                                       Diagnostics* diagnostics) {
  YamlReader yaml(file);
  return ReadPaper(&yaml, text, diagnostics);
}

}  // namespace mbv
