#include "table/settings.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

namespace mbv {
namespace {

std::vector<std::string> WithSourceKeys(std::vector<std::string> keys) {
  keys.insert(keys.end(), kTableSourceKeys.begin(), kTableSourceKeys.end());
  return keys;
}

TableTolerance ReadTolerance(ValueReader* values, const YamlMap& map) {
  TableTolerance tolerance;
  const auto read = [&](const char* key, double* target) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return;
    const auto number = values->Number(*node, map.PathOf(key));
    if (number && *number < 0.0) {
      values->yaml().Error(*node, fmt::format("{} = {} violates >= 0", map.PathOf(key), *number));
    } else if (number) {
      *target = *number;
    }
  };
  read("absolute", &tolerance.absolute);
  read("relative", &tolerance.relative);
  return tolerance;
}

bool StatesTolerance(const YamlMap& map) { return map.Has("absolute") || map.Has("relative"); }

// A heading, or a number counted from 1.
void ReadColumnName(ValueReader* values, const YamlNode& node, const std::string& path,
                    TableColumnSettings* column) {
  const auto text = values->yaml().Text(node, path);
  if (!text) return;
  const auto number = node.quoted ? std::nullopt : PlainNumber(*text);
  if (!number) {
    column->column = *text;
    return;
  }
  if (*number < 1 || *number > double{kMaxTableColumns} || *number != std::floor(*number)) {
    values->yaml().Error(node, fmt::format("{} = {} is no column number", path, *text),
                         "columns are counted from 1; put a heading that is a number in quotes");
    return;
  }
  column->number = static_cast<int>(*number);
}

TableColumnSettings ReadColumn(ValueReader* values, const YamlEntry& entry) {
  TableColumnSettings column;
  column.place = entry;
  column.path = JoinPath("reference.columns", entry.key);
  column.signal = entry.key;
  const YamlNode& node = *entry.value;
  if (node.is_null() ||
      (node.is_scalar() && !node.quoted && (node.text == "off" || node.text == "none"))) {
    column.off = true;
  } else {
    ReadTableColumn(values, node, &column);
  }
  return column;
}

void ReadFormat(ValueReader* values, const YamlMap& map, TableFormat* format) {
  YamlReader& yaml = values->yaml();
  if (const YamlNode* node = map.Find("delimiter")) {
    const auto choice =
        yaml.Choice(*node, map.PathOf("delimiter"), {"tab", "comma", "semicolon", "space"});
    if (choice) format->delimiter = "\t,; "[*choice];
  }
  if (const YamlNode* node = map.Find("decimal")) {
    const auto choice = yaml.Choice(*node, map.PathOf("decimal"), {"point", "comma"});
    if (choice) format->decimal_comma = *choice == 1;
    if (choice == 1 && format->delimiter == ',') {
      yaml.Error(*node,
                 map.PathOf("decimal") + ": a comma cannot be both decimal sign and delimiter");
    }
  }
  if (const YamlNode* node = map.Find("heading_rows")) {
    const auto rows = yaml.Integer(*node, map.PathOf("heading_rows"));
    if (rows && *rows < 0) {
      yaml.Error(*node, fmt::format("{} = {} violates >= 0", map.PathOf("heading_rows"), *rows));
    } else {
      format->heading_rows = rows;
    }
  }
}

void ReadTolerances(ValueReader* values, const YamlMap& map, TableSettings* settings) {
  const YamlNode* node = map.Find("tolerance");
  if (node == nullptr) return;
  const YamlMap tolerance(&values->yaml(), node, "reference.tolerance",
                          {"absolute", "relative", "coverage", "coarsest"});
  if (StatesTolerance(tolerance)) settings->tolerance = ReadTolerance(values, tolerance);
  if (const YamlNode* coverage = tolerance.Find("coverage")) {
    settings->coverage =
        values->Positive(*coverage, "reference.tolerance.coverage").value_or(settings->coverage);
  }
  if (const YamlNode* coarsest = tolerance.Find("coarsest")) {
    settings->coarsest =
        values->Positive(*coarsest, "reference.tolerance.coarsest").value_or(settings->coarsest);
  }
}

}  // namespace

const std::vector<std::string> kTableSourceKeys = {"csv",          "delimiter", "decimal",
                                                   "heading_rows", "time_unit", "time_offset_s"};

void ReadTableColumnKeys(ValueReader* values, const YamlMap& map, TableColumnSettings* column) {
  if (const YamlNode* name = map.Find("column")) {
    ReadColumnName(values, *name, map.PathOf("column"), column);
  }
  if (const YamlNode* unit = map.Find("unit")) {
    column->unit = values->yaml().Text(*unit, map.PathOf("unit")).value_or("");
    column->unit_line = unit->line;
    column->unit_character = unit->column;
  }
  if (const YamlNode* sign = map.Find("sign")) {
    column->sign = values->Number(*sign, map.PathOf("sign")).value_or(1.0);
    if (column->sign != 1.0 && column->sign != -1.0) {
      values->yaml().Error(
          *sign, fmt::format("{} = {} is neither 1 nor -1", map.PathOf("sign"), column->sign),
          "a factor is given by scale");
    }
  }
  if (const YamlNode* scale = map.Find("scale")) {
    column->scale = values->Number(*scale, map.PathOf("scale")).value_or(1.0);
    if (column->scale == 0.0) {
      values->yaml().Error(*scale, map.PathOf("scale") + " = 0 would make the column zero");
    }
  }
  if (const YamlNode* offset = map.Find("offset")) {
    column->offset = values->Number(*offset, map.PathOf("offset")).value_or(0.0);
  }
}

void ReadTableColumn(ValueReader* values, const YamlNode& node, TableColumnSettings* column) {
  if (!node.is_map()) {
    ReadColumnName(values, node, column->path, column);
    return;
  }
  YamlMap map(&values->yaml(), &node, column->path,
              {"column", "unit", "sign", "scale", "offset", "tolerance"});
  ReadTableColumnKeys(values, map, column);
  if (const YamlNode* tolerance = map.Find("tolerance")) {
    const YamlMap limits(&values->yaml(), tolerance, map.PathOf("tolerance"),
                         {"absolute", "relative"});
    column->tolerance = ReadTolerance(values, limits);
  }
}

void ReadTableSource(ValueReader* values, const YamlMap& map, TableSettings* settings) {
  YamlReader& yaml = values->yaml();
  const YamlNode* csv = map.Required("csv");
  if (csv == nullptr) return;
  settings->csv = yaml.Text(*csv, map.PathOf("csv")).value_or("");
  settings->place = {"csv", csv->line, csv->column, nullptr};
  const std::filesystem::path folder = std::filesystem::path(yaml.file()).parent_path();
  settings->file = (folder / settings->csv).lexically_normal().string();
  ReadFormat(values, map, &settings->format);
  if (const YamlNode* unit = map.Find("time_unit")) {
    settings->time_unit = yaml.Text(*unit, map.PathOf("time_unit")).value_or("");
    settings->time_unit_line = unit->line;
    settings->time_unit_character = unit->column;
  }
  if (const YamlNode* offset = map.Find("time_offset_s")) {
    settings->time_offset_s = values->Number(*offset, map.PathOf("time_offset_s")).value_or(0.0);
  }
}

TableSettings ReadTableSettings(ValueReader* values, const YamlNode* node) {
  TableSettings settings;
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, node, settings.path, WithSourceKeys({"columns", "tolerance", "witness"}));
  ReadTableSource(values, map, &settings);
  if (settings.file.empty()) return settings;
  ReadTolerances(values, map, &settings);
  if (const YamlNode* witness = map.Find("witness")) {
    std::vector<std::string> words = {role::kReference.name};
    for (const Role* role : kRoles) {
      if (role == &role::kReference || !role->judged_alone() || !IsCompared(*role)) continue;
      words.emplace_back(role->name);
    }
    const auto choice = yaml.Choice(*witness, "reference.witness", words);
    if (choice) settings.witness = words[static_cast<size_t>(*choice)];
  }
  if (const YamlNode* columns = map.Find("columns")) {
    for (const YamlEntry& entry : yaml.Entries(*columns, "reference.columns")) {
      settings.columns.push_back(ReadColumn(values, entry));
    }
  }
  return settings;
}

}  // namespace mbv
