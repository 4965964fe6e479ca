#include "features/logs/log_settings.h"

#include <fmt/format.h>

#include "model_file/yaml/value_reader.h"

namespace mbv {
namespace {

class MapReader {
 public:
  MapReader(const std::string& file, LogSettings* settings)
      : yaml_(file), values_(&yaml_, &scope_), settings_(*settings) {}

  Diagnostics Read() {
    const auto text = yaml_.ReadFile();
    const YamlNodePtr root = text ? yaml_.Parse(*text) : nullptr;
    if (root == nullptr) return yaml_.diagnostics();
    const YamlMap map(&yaml_, root.get(), "",
                      {"columns", "time", "time_unit", "joints", "ignore", "hold", "angles",
                       "velocities", "rate_hz", "from_s", "to_s", "delimiter", "decimal"});
    if (!map.valid()) return yaml_.diagnostics();
    if (const YamlNode* node = map.Find("columns")) ReadColumns(*node);
    ReadText(map, "time", &settings_.time);
    ReadText(map, "time_unit", &settings_.time_unit);
    ReadWords(map, "joints", &settings_.joints);
    ReadWords(map, "ignore", &settings_.ignore);
    ReadWords(map, "hold", &settings_.hold);
    if (const YamlNode* node = map.Find("angles")) {
      settings_.degrees = yaml_.Choice(*node, "angles", {"rad", "deg"}) == 1;
    }
    if (const YamlNode* node = map.Find("velocities")) {
      settings_.positions_only = yaml_.Choice(*node, "velocities", {"use", "compare"}) == 1;
    }
    if (const YamlNode* node = map.Find("rate_hz")) {
      settings_.rate_hz = values_.Positive(*node, "rate_hz").value_or(0.0);
    }
    if (const YamlNode* node = map.Find("from_s")) {
      settings_.from_s = values_.Number(*node, "from_s").value_or(kNan);
    }
    if (const YamlNode* node = map.Find("to_s")) {
      settings_.to_s = values_.Number(*node, "to_s").value_or(kNan);
    }
    if (const YamlNode* node = map.Find("delimiter")) {
      const auto choice = yaml_.Choice(*node, "delimiter", {"tab", "comma", "semicolon", "space"});
      if (choice) settings_.format.delimiter = "\t,; "[*choice];
    }
    if (const YamlNode* node = map.Find("decimal")) {
      const auto choice = yaml_.Choice(*node, "decimal", {"point", "comma"});
      if (choice) settings_.format.decimal_comma = *choice == 1;
    }
    return yaml_.diagnostics();
  }

 private:
  void ReadColumns(const YamlNode& node) {
    for (const YamlEntry& entry : yaml_.Entries(node, "columns")) {
      LogRequest request;
      request.column.signal = entry.key;
      request.column.path = JoinPath("columns", entry.key);
      ReadTableColumn(&values_, *entry.value, &request.column);
      request.place.file = yaml_.file();
      request.place.line = entry.line;
      request.place.column = entry.column;
      settings_.columns.push_back(std::move(request));
    }
  }

  void ReadText(const YamlMap& map, const char* key, std::string* text) {
    if (const YamlNode* node = map.Find(key)) *text = yaml_.Text(*node, key).value_or("");
  }

  void ReadWords(const YamlMap& map, const char* key, std::vector<std::string>* words) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return;
    const auto items = yaml_.Items(*node, key);
    if (!items) return;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto word = yaml_.Text(*(*items)[i], fmt::format("{}[{}]", key, i));
      if (word) words->push_back(*word);
    }
  }

  YamlReader yaml_;
  Scope scope_;
  ValueReader values_;
  LogSettings& settings_;
};

}  // namespace

void ReadLogMap(const std::string& file, LogSettings* settings, Diagnostics* diagnostics) {
  diagnostics->Append(MapReader(file, settings).Read());
}

bool AddLogColumn(const std::string& text, LogSettings* settings) {
  const size_t at = text.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == text.size()) return false;
  LogRequest request;
  request.column.signal = text.substr(0, at);
  request.column.column = text.substr(at + 1);
  request.column.path = request.column.signal;
  request.place.file = "--column " + text;
  settings->columns.push_back(std::move(request));
  return true;
}

}  // namespace mbv
