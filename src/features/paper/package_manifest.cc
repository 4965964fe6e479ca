#include "features/paper/package_manifest.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>

#include "base/files.h"
#include "base/json_document.h"
#include "base/json_text.h"
#include "base/markup.h"
#include "base/text.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kProgram = "#mbverify";

struct MediaType {
  const char* ending;
  const char* type;
};
constexpr MediaType kMediaTypes[] = {
    {".yaml", "application/yaml"}, {".json", "application/json"},
    {".csv", "text/csv"},          {".html", "text/html"},
    {".md", "text/markdown"},      {".xml", "application/xml"},
    {".urdf", "application/xml"},  {".sdf", "application/xml"},
    {".pdf", "application/pdf"},   {".svg", "image/svg+xml"},
    {".png", "image/png"},         {".stl", "model/stl"},
    {".obj", "model/obj"},         {".dae", "model/vnd.collada+xml"},
    {".py", "text/x-python"},      {".tex", "text/x-tex"}};

const char* MediaTypeOf(const std::string& path) {
  const auto found = std::ranges::find_if(
      kMediaTypes, [&](const MediaType& row) { return path.ends_with(row.ending); });
  return found == std::end(kMediaTypes) ? "application/octet-stream" : found->type;
}

// A path as a relative URI [RFC 3986].
std::string Uri(const std::string& path) {
  std::string uri;
  for (const char c : path) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("-._~/+,@").find(c) != std::string_view::npos;
    uri += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

Json Id(const std::string& id) { return {{"@id", id}}; }

const std::string& VersionOf(const PackageDescription& package, const std::string& program) {
  static const std::string none;
  for (const auto& [name, version] : package.versions) {
    if (name == program) return version;
  }
  return none;
}

bool LiesIn(const PackedFile& file, const std::string& folder) {
  return !folder.empty() && file.path.starts_with(folder + "/");
}

std::string NameOf(const PackageDescription& package) {
  std::string name = "Inputs and results of mbverify for ";
  for (const PackedScenario& scenario : package.scenarios) {
    if (&scenario != &package.scenarios.front()) name += ", ";
    name += std::filesystem::path(scenario.results).lexically_relative("results").string();
  }
  return name;
}

Json RootOf(const PackageDescription& package, const std::vector<PackedFile>& files) {
  Json root = {{"@id", "./"},
               {"@type", "Dataset"},
               {"name", NameOf(package)},
               {"description",
                "Models and scenarios of mechanisms, what computing them by independent witnesses "
                "gave, and how to repeat it: mbverify package --check compares."},
               {"datePublished", package.date}};
  if (package.license.starts_with("http")) {
    root["license"] = Id(package.license);
  } else {
    root["license"] = package.license.empty() ? "not stated by the models" : package.license;
  }
  root["hasPart"] = Json::array();
  for (const PackedFile& file : files) root["hasPart"].push_back(Id(Uri(file.path)));
  root["mentions"] = Json::array();
  for (size_t k = 0; k < package.scenarios.size(); ++k) {
    root["mentions"].push_back(Id(fmt::format("#run-{}", k + 1)));
  }
  return root;
}

Json ActionOf(const PackageDescription& package, size_t k) {
  const PackedScenario& scenario = package.scenarios[k];
  Json action = {{"@id", fmt::format("#run-{}", k + 1)},
                 {"@type", "CreateAction"},
                 {"name", RerunCommand(package, scenario)},
                 {"description", scenario.verdict + ": " + scenario.reason},
                 {"instrument", Id(kProgram)}};
  action["object"] = Json::array();
  action["object"].push_back(Id(Uri(scenario.file)));
  action["result"] = Json::array();
  for (const PackedFile& file : package.files) {
    if (!LiesIn(file, scenario.results) && !LiesIn(file, scenario.figures)) continue;
    action["result"].push_back(Id(Uri(file.path)));
  }
  return action;
}

}  // namespace

std::string RerunCommand(const PackageDescription& package, const PackedScenario& scenario) {
  std::string command = scenario.kind == "study"       ? "mbverify study"
                        : scenario.kind == "benchmark" ? "mbverify benchmark"
                                                       : "mbverify run";
  for (const PackedMeshes& meshes : package.meshes) {
    command += " --package " + ShellWord(meshes.name + "=" + meshes.folder);
  }
  return command + " " + ShellWord(scenario.file);
}

std::string CrateJson(const PackageDescription& package) {
  std::vector<PackedFile> files = package.files;
  files.push_back({.path = kManifestFile, .role = "manifest", .bytes = 0, .sha256 = ""});
  Json graph = Json::array();
  graph.push_back({{"@id", kCrateFile},
                   {"@type", "CreativeWork"},
                   {"conformsTo", Id("https://w3id.org/ro/crate/1.1")},
                   {"about", Id("./")}});
  graph.push_back(RootOf(package, files));
  graph.push_back({{"@id", kProgram},
                   {"@type", "SoftwareApplication"},
                   {"name", "mbverify"},
                   {"version", VersionOf(package, "mbverify")}});
  for (size_t k = 0; k < package.scenarios.size(); ++k) graph.push_back(ActionOf(package, k));
  for (const PackedFile& file : files) {
    Json entry = {{"@id", Uri(file.path)},
                  {"@type", "File"},
                  {"name", std::filesystem::path(file.path).filename().string()},
                  {"description", file.role},
                  {"encodingFormat", MediaTypeOf(file.path)}};
    if (file.bytes > 0) entry["contentSize"] = std::to_string(file.bytes);
    if (!file.sha256.empty()) entry["sha256"] = file.sha256;
    graph.push_back(std::move(entry));
  }
  return Dump({{"@context", "https://w3id.org/ro/crate/1.1/context"}, {"@graph", graph}});
}

std::string PackageReadme(const PackageDescription& package) {
  std::string text = "# " + MarkdownText(NameOf(package)) + "\n\n";
  text += fmt::format(
      "Written by mbverify {}. `mbverify package --check` with the archive runs everything again "
      "and "
      "compares;"
      " in this folder a single result is repeated by its command.\n\n",
      MarkdownText(VersionOf(package, "mbverify")));
  text += "| scenario | verdict | command | results |\n|---|---|---|---|\n";
  for (const PackedScenario& scenario : package.scenarios) {
    text += fmt::format("| {} | {} (exit code {}) | {} | {} |\n", MarkdownCode(scenario.file),
                        MarkdownText(scenario.verdict), scenario.exit_code,
                        MarkdownCode(RerunCommand(package, scenario)),
                        MarkdownCode(scenario.results + "/"));
  }
  text += "\n";
  for (const PackedScenario& scenario : package.scenarios) {
    text += fmt::format("* {}: {}{}{}\n", MarkdownCode(scenario.file),
                        MarkdownText(scenario.description),
                        scenario.description.empty() ? "" : ". ", MarkdownText(scenario.reason));
  }
  text +=
      "\n| folder or file | holds |\n|---|---|\n| `inputs/` | scenarios, models and what they "
      "read, as they lay beside each other |\n| `results/` | traces (17 digits, SI), summaries, "
      "pages |\n";
  if (std::ranges::any_of(package.scenarios,
                          [](const PackedScenario& s) { return !s.figures.empty(); })) {
    text += "| `figures/` | figures of the results |\n";
  }
  text +=
      "| `manifest.json` | what was run, and the SHA-256 of every file |\n"
      "| `ro-crate-metadata.json` | the same as RO-Crate 1.1 |\n\n";
  text += package.license.empty()
              ? "The models state no licence.\n"
              : fmt::format("Licence of the models: {}.\n", MarkdownText(package.license));
  text += "\nVersions:";
  for (const auto& [name, version] : package.versions) {
    text += fmt::format("{} {} {}", &name == &package.versions.front().first ? "" : ",",
                        MarkdownText(name), MarkdownText(version));
  }
  return text + ".\n";
}

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kManifestSchema = "mbverify.package/1";

// Reads untrusted input; each value that is missing or of another type is reported.
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
    if (!Contains({"motion", "stiffness", "study", "benchmark"}, scenario.kind)) {
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
        fmt::format("names '{}' as a {}, which is not a path in an archive", Printable(path), key));
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
