// Reads the parts of an entry of paper.yaml.
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "scenario/paper_file.h"

namespace mbv {

class PaperParts {
 public:
  PaperParts(YamlReader* yaml, ValueReader* values) : yaml_(*yaml), values_(values) {}

  std::string Words(const YamlMap& map, const char* key);
  std::string RequiredWords(const YamlMap& map, const char* key);
  PlacedText Placed(const YamlMap& map, const char* key);
  double Number(const YamlMap& map, const char* key);
  /// One text or a list of them.
  std::vector<PlacedText> List(const YamlNode& node, const std::string& path);

  std::vector<BesideRun> Beside(const YamlMap& map);
  std::vector<PrintedNumbers> Printed(const YamlMap& map);
  /// `panels:`, `maps:` and `table:`.
  void Drawn(const YamlMap& map, PaperEntry* entry);
  void Says(const YamlMap& map, std::vector<PaperStatement>* statements);

 private:
  std::vector<double> Numbers(const YamlMap& map, const char* key);
  PrintedNumbers PrintedOf(const YamlEntry& at, const std::string& path);
  PaperMap MapOf(const YamlMap& map);
  void Table(const YamlMap& map, PaperEntry* entry);
  PaperStatement Statement(const YamlMap& map);
  void CheckStatement(const YamlMap& map, const PaperStatement& statement);
  size_t Index(const YamlMap& map, const char* key, size_t otherwise);

  YamlReader& yaml_;
  ValueReader* values_;
};

}  // namespace mbv
