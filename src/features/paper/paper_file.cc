#include "features/paper/paper_file.h"

#include <fmt/format.h>

#include "base/files.h"
#include "scenario/section_readers.h"

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
      yaml_.Error(at, fmt::format("{} is not a name of files", path),
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

namespace {

constexpr int kMostDigits = 12;
constexpr size_t kMostMaps = 99;

}  // namespace

std::string PaperParts::Words(const YamlMap& map, const char* key) { return Placed(map, key).text; }

std::string PaperParts::RequiredWords(const YamlMap& map, const char* key) {
  return map.Required(key) == nullptr ? "" : Words(map, key);
}

PlacedText PaperParts::Placed(const YamlMap& map, const char* key) {
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return {};
  return {yaml_.Text(*node, map.PathOf(key)).value_or(""), map.PathOf(key), node->line,
          node->column};
}

double PaperParts::Number(const YamlMap& map, const char* key) {
  const YamlNode* node = map.Find(key);
  return node == nullptr ? kNan : values_->Number(*node, map.PathOf(key)).value_or(kNan);
}

std::vector<double> PaperParts::Numbers(const YamlMap& map, const char* key) {
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return {};
  return values_->Numbers(*node, map.PathOf(key)).value_or(std::vector<double>{});
}

std::vector<PlacedText> PaperParts::List(const YamlNode& node, const std::string& path) {
  std::vector<PlacedText> texts;
  const auto add = [&](const YamlNode& item, const std::string& where) {
    texts.push_back({yaml_.Text(item, where).value_or(""), where, item.line, item.column});
  };
  if (node.is_scalar()) {
    add(node, path);
    return texts;
  }
  const auto items = yaml_.Items(node, path);
  for (size_t k = 0; items && k < items->size(); ++k) {
    add(*(*items)[k], fmt::format("{}[{}]", path, k));
  }
  return texts;
}

std::vector<BesideRun> PaperParts::Beside(const YamlMap& map) {
  std::vector<BesideRun> runs;
  const YamlNode* node = map.Find("beside");
  if (node == nullptr) return runs;
  for (const YamlEntry& entry : yaml_.Entries(*node, map.PathOf("beside"))) {
    const YamlMap run(&yaml_, entry.value.get(), map.PathOf("beside") + "." + entry.key,
                      {"scenario", "witness"});
    if (!run.valid()) continue;
    (void)run.Required("scenario");
    (void)run.Required("witness");
    runs.push_back({entry.key, Placed(run, "scenario"), Placed(run, "witness")});
  }
  return runs;
}

std::vector<PrintedNumbers> PaperParts::Printed(const YamlMap& map) {
  std::vector<PrintedNumbers> all;
  const YamlNode* node = map.Find("printed");
  if (node == nullptr) return all;
  for (const YamlEntry& entry : yaml_.Entries(*node, map.PathOf("printed"))) {
    all.push_back(PrintedOf(entry, map.PathOf("printed") + "." + entry.key));
  }
  return all;
}

PrintedNumbers PaperParts::PrintedOf(const YamlEntry& at, const std::string& path) {
  PrintedNumbers numbers{.name = at.key, .from = {}, .unit = {}};
  const YamlMap map(&yaml_, at.value.get(), path, {"from", "at", "unit", "signals"});
  if (!map.valid()) return numbers;
  numbers.from = RequiredWords(map, "from");
  (void)map.Required("at");
  numbers.at = Numbers(map, "at");
  for (size_t k = 1; k < numbers.at.size(); ++k) {
    if (numbers.at[k] > numbers.at[k - 1]) continue;
    yaml_.Error(at, path + ".at does not grow from number to number");
    break;
  }
  (void)map.Required("unit");
  numbers.unit = Placed(map, "unit");
  const YamlNode* signals = map.Required("signals");
  if (signals == nullptr) return numbers;
  for (const YamlEntry& signal : yaml_.Entries(*signals, map.PathOf("signals"))) {
    const std::string where = map.PathOf("signals") + "." + signal.key;
    const auto values = values_->Numbers(*signal.value, where, static_cast<int>(numbers.at.size()));
    if (!values) continue;
    numbers.signals.emplace_back(PlacedText{signal.key, where, signal.line, signal.column},
                                 *values);
  }
  return numbers;
}

void PaperParts::Drawn(const YamlMap& map, PaperEntry* entry) {
  if (const YamlNode* panels = map.Find("panels")) {
    entry->panels = ReadPanels(values_, *panels, map.PathOf("panels"));
  }
  if (const YamlNode* maps = map.Find("maps")) {
    const auto items = yaml_.Items(*maps, map.PathOf("maps"));
    for (size_t k = 0; items && k < items->size(); ++k) {
      const YamlMap one(&yaml_, (*items)[k], fmt::format("{}[{}]", map.PathOf("maps"), k),
                        {"map", "index", "label"});
      if (one.valid()) entry->maps.push_back(MapOf(one));
    }
  }
  if (map.Has("table")) Table(map, entry);
}

PaperMap PaperParts::MapOf(const YamlMap& map) {
  (void)map.Required("map");
  (void)map.Required("index");
  return {Placed(map, "map"), Placed(map, "index"), Words(map, "label")};
}

void PaperParts::Table(const YamlMap& map, PaperEntry* entry) {
  const YamlMap table(&yaml_, map.Find("table"), map.PathOf("table"), {"head", "columns"});
  if (!table.valid()) return;
  entry->head = RequiredWords(table, "head");
  const YamlNode* columns = table.Required("columns");
  if (columns == nullptr) return;
  const auto items = yaml_.Items(*columns, table.PathOf("columns"));
  for (size_t k = 0; items && k < items->size(); ++k) {
    const YamlMap column(&yaml_, (*items)[k], fmt::format("{}[{}]", table.PathOf("columns"), k),
                         {"title", "of", "signal", "unit", "digits"});
    if (!column.valid()) continue;
    for (const char* key : {"title", "of", "signal", "unit"}) (void)column.Required(key);
    PaperColumn read{Words(column, "title"), Placed(column, "of"), Placed(column, "signal"),
                     Placed(column, "unit")};
    if (const YamlNode* digits = column.Find("digits")) {
      read.digits = yaml_.Integer(*digits, column.PathOf("digits")).value_or(read.digits);
      if (read.digits < 0 || read.digits > kMostDigits) {
        yaml_.Error(*digits, fmt::format("{} = {} violates 0 <= digits <= {}",
                                         column.PathOf("digits"), read.digits, kMostDigits));
      }
    }
    entry->columns.push_back(std::move(read));
  }
}

void PaperParts::Says(const YamlMap& map, std::vector<PaperStatement>* statements) {
  const YamlNode* says = map.Find("says");
  if (says == nullptr) return;
  const auto items = yaml_.Items(*says, map.PathOf("says"));
  for (size_t k = 0; items && k < items->size(); ++k) {
    const YamlMap one(&yaml_, (*items)[k], fmt::format("{}[{}]", map.PathOf("says"), k),
                      {"text", "where", "measure", "signals", "of", "to", "unit", "at_s", "beyond",
                       "map", "other", "name", "printed", "panel"});
    if (one.valid()) statements->push_back(Statement(one));
  }
}

PaperStatement PaperParts::Statement(const YamlMap& map) {
  PaperStatement statement{RequiredWords(map, "text"), RequiredWords(map, "where")};
  if (const YamlNode* measure = map.Required("measure")) {
    const auto chosen = yaml_.Choice(*measure, map.PathOf("measure"), PaperMeasureWords());
    statement.measure = static_cast<PaperMeasure>(chosen.value_or(0));
  }
  if (const YamlNode* signals = map.Find("signals")) {
    statement.signals = List(*signals, map.PathOf("signals"));
  }
  statement.of = Placed(map, "of");
  statement.to = Placed(map, "to");
  statement.unit = Placed(map, "unit");
  statement.at_s = Numbers(map, "at_s");
  statement.beyond = Number(map, "beyond");
  statement.map = Index(map, "map", 0);
  statement.other = Index(map, "other", 1);
  statement.name = Placed(map, "name");
  statement.printed = Number(map, "printed");
  if (map.Has("panel")) statement.panel = Index(map, "panel", 0);
  CheckStatement(map, statement);
  return statement;
}

// What a measure needs.
void PaperParts::CheckStatement(const YamlMap& map, const PaperStatement& statement) {
  const PaperMeasure measure = statement.measure;
  const auto need = [&](bool given, const char* key) {
    if (given || map.node() == nullptr) return;
    yaml_.Error(*map.node(), fmt::format("{} is missing: measure = '{}' needs it", map.PathOf(key),
                                         PaperMeasureWords()[static_cast<size_t>(measure)]));
  };
  if (measure <= PaperMeasure::kBeyond) {
    need(!statement.signals.empty(), "signals");
    need(statement.of.given(), "of");
  }
  if (measure >= PaperMeasure::kDifference && measure <= PaperMeasure::kBeyond) {
    need(statement.to.given(), "to");
  }
  if (measure == PaperMeasure::kBeyond) need(statement.beyond > 0, "beyond");
  if (measure == PaperMeasure::kWorkspace) need(statement.name.given(), "name");
}

size_t PaperParts::Index(const YamlMap& map, const char* key, size_t otherwise) {
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return otherwise;
  const auto index = yaml_.Integer(*node, map.PathOf(key));
  if (index && *index >= 0 && static_cast<size_t>(*index) <= kMostMaps) {
    return static_cast<size_t>(*index);
  }
  if (index) {
    yaml_.Error(*node, fmt::format("{} = {} violates 0 <= {} <= {}", map.PathOf(key), *index, key,
                                   kMostMaps));
  }
  return otherwise;
}

}  // namespace mbv
