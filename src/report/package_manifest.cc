#include <fmt/format.h>

#include "core/json_document.h"
#include "core/json_text.h"
#include "core/names.h"
#include "core/text.h"
#include "report/package_files.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kManifestSchema = "mbverify.package/1";

// Reads what a stranger may have written; each value that is missing or of another type is told.
class ManifestReader {
 public:
  ManifestReader(const std::string& file, Diagnostics* diagnostics)
      : file_(file), diagnostics_(diagnostics) {}

  std::optional<PackageDescription> Read(const std::string& text) {
    const auto root = [](const JsonValue& value) { return Json(value.json()); };
    const auto document = ReadJson(text, root, kManifestSchema);
    if (!document) return Refused(document.refusal.Text());
    const Json& json = *document.value;
    PackageDescription package;
    package.date = TextAt(json, "date", "");
    package.license = TextAt(json, "license", "");
    package.page = json.contains("page") && json["page"].is_boolean() && json["page"].get<bool>();
    const Json versions = json.value("versions", Json::object());
    for (const auto& [name, version] : versions.items()) {
      package.versions.emplace_back(name, version.is_string() ? version.get<std::string>() : "");
    }
    for (const Json& item : List(json, "meshes")) {
      package.meshes.push_back({TextAt(item, "package", ""), PathAt(item, "folder")});
    }
    for (const Json& item : List(json, "scenarios")) package.scenarios.push_back(ScenarioOf(item));
    for (const Json& item : List(json, "files")) package.files.push_back(FileOf(item));
    if (package.scenarios.empty()) Complain("names no scenario");
    return good_ ? std::optional(std::move(package)) : std::nullopt;
  }

 private:
  std::optional<PackageDescription> Refused(const std::string& why) {
    Complain(why);
    return {};
  }
  void Complain(const std::string& why) {
    good_ = false;
    diagnostics_->AddError(file_, fmt::format("{}: {}", kManifestFile, why),
                           "mbverify package writes it");
  }

  PackedScenario ScenarioOf(const Json& item) {
    PackedScenario scenario;
    scenario.file = PathAt(item, "file");
    scenario.kind = TextAt(item, "kind", "");
    scenario.results = PathAt(item, "results");
    if (!TextAt(item, "figures", "").empty()) scenario.figures = PathAt(item, "figures");
    scenario.verdict = TextAt(item, "verdict", "");
    scenario.description = TextAt(item, "description", "");
    scenario.reason = TextAt(item, "reason", "");
    const auto code = item.is_object() ? item.find("exit_code") : item.end();
    if (item.is_object() && code != item.end() && code->is_number_integer()) {
      scenario.exit_code = code->get<int>();
    } else {
      Complain("has a scenario without exit_code");
    }
    if (scenario.kind != "motion" && scenario.kind != "stiffness" && scenario.kind != "study") {
      Complain(fmt::format("has a scenario of the kind '{}'", Printable(scenario.kind)));
    }
    return scenario;
  }

  PackedFile FileOf(const Json& item) {
    PackedFile file{.path = PathAt(item, "path"),
                    .role = TextAt(item, "role", ""),
                    .bytes = 0,
                    .sha256 = TextAt(item, "sha256", "")};
    const auto bytes = item.is_object() ? item.find("bytes") : item.end();
    if (item.is_object() && bytes != item.end() && bytes->is_number_unsigned()) {
      file.bytes = bytes->get<std::uint64_t>();
    } else {
      Complain("gives no size of " + Printable(file.path));
    }
    return file;
  }

  std::vector<Json> List(const Json& json, const char* key) {
    const auto found = json.find(key);
    if (found != json.end() && found->is_array()) return found->get<std::vector<Json>>();
    Complain(fmt::format("has no list '{}'", key));
    return {};
  }

  static std::string TextAt(const Json& json, const char* key, const std::string& otherwise) {
    if (!json.is_object()) return otherwise;
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? found->get<std::string>() : otherwise;
  }

  std::string PathAt(const Json& json, const char* key) {
    const std::string path = TextAt(json, key, "");
    if (IsPlainPath(path)) return path;
    Complain(
        fmt::format("names '{}' as a {}, which is no path in an archive", Printable(path), key));
    return "";
  }

  const std::string& file_;
  Diagnostics* diagnostics_;
  bool good_ = true;
};

}  // namespace

std::string ManifestJson(const PackageDescription& package) {
  Json json = {{"schema", kManifestSchema},
               {"date", package.date},
               {"license", package.license},
               {"page", package.page}};
  json["versions"] = Json::object();
  for (const auto& [name, version] : package.versions) json["versions"][name] = version;
  json["scenarios"] = Json::array();
  for (const PackedScenario& scenario : package.scenarios) {
    json["scenarios"].push_back({{"file", scenario.file},
                                 {"kind", scenario.kind},
                                 {"command", RerunCommand(package, scenario)},
                                 {"results", scenario.results},
                                 {"figures", scenario.figures},
                                 {"exit_code", scenario.exit_code},
                                 {"verdict", scenario.verdict},
                                 {"description", scenario.description},
                                 {"reason", scenario.reason}});
  }
  json["meshes"] = Json::array();
  for (const PackedMeshes& meshes : package.meshes) {
    json["meshes"].push_back({{"package", meshes.name}, {"folder", meshes.folder}});
  }
  json["files"] = Json::array();
  for (const PackedFile& file : package.files) {
    json["files"].push_back(
        {{"path", file.path}, {"role", file.role}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  }
  return Dump(json);
}

std::optional<PackageDescription> ReadManifest(const std::string& json, const std::string& file,
                                               Diagnostics* diagnostics) {
  return ManifestReader(file, diagnostics).Read(json);
}

}  // namespace mbv
