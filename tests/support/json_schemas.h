// The JSON Schemas of docs/reference/schemas/, and whether a document fits its own.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv::test {

class JsonSchemas {
 public:
  JsonSchemas() {
    const std::filesystem::path folder = SourcePath("/docs/reference/schemas");
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      Schema& schema = by_id_[(texts_[name] = nlohmann::json::parse(ReadAll(entry.path())))["$id"]];
      schema.file = name;
      schema.rules = std::make_unique<valijson::Schema>();
      valijson::SchemaParser(valijson::SchemaParser::kDraft7)
          .populateSchema(valijson::adapters::NlohmannJsonAdapter(texts_[name]), *schema.rules);
    }
  }

  /// By file name.
  [[nodiscard]] const std::map<std::string, nlohmann::json>& texts() const { return texts_; }
  [[nodiscard]] bool Has(const std::string& id) const { return by_id_.contains(id); }

  /// "" where the document fits the schema that it names; else what does not.
  [[nodiscard]] std::string Misfit(const nlohmann::json& document) const {
    const auto stated = document.find("schema");
    if (stated == document.end() || !stated->is_string()) return "names no schema";
    const std::string id = *stated;
    const auto found = by_id_.find(id);
    if (found == by_id_.end()) return "there is no file of " + id;
    valijson::ValidationResults results;
    if (valijson::Validator(valijson::Validator::kStrongTypes)
            .validate(*found->second.rules, valijson::adapters::NlohmannJsonAdapter(document),
                      &results)) {
      return "";
    }
    std::string text = found->second.file + ":";
    valijson::ValidationResults::Error error;
    for (int k = 0; k < 12 && results.popError(error); ++k) {
      text += "\n  ";
      for (const std::string& part : error.context) text += part;
      text += ": " + error.description;
    }
    return text;
  }

 private:
  struct Schema {
    std::string file;
    std::unique_ptr<valijson::Schema> rules;
  };
  std::map<std::string, nlohmann::json> texts_;
  std::map<std::string, Schema> by_id_;
};

}  // namespace mbv::test
