// The files that describe an archive beside a paper: manifest.json, ro-crate-metadata.json
// (RO-Crate 1.1, https://w3id.org/ro/crate/1.1) and README.md.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"

namespace mbv {

inline constexpr const char* kManifestFile = "manifest.json";
inline constexpr const char* kCrateFile = "ro-crate-metadata.json";
inline constexpr const char* kReadmeFile = "README.md";

/// A file of an archive; paths are relative to the archive's folder.
struct PackedFile {
  std::string path;
  std::string role;  ///< "scenario", "study", "model", "mesh", "table", "input", "result", "figure"
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// What was run for an archive.
struct PackedScenario {
  std::string file;     ///< "inputs/scenarios/four_bar/turn.yaml"
  std::string kind;     ///< "motion", "stiffness" or "study"
  std::string results;  ///< folder: "results/four_bar/turn"
  std::string figures;  ///< folder; "" without figures
  int exit_code = 4;
  std::string verdict;  ///< "agree"; of studies "limits kept", "limits broken"
  std::string description, reason;
};

/// Where the meshes package://NAME/… of an archive lie.
struct PackedMeshes {
  std::string name, folder;
};

struct PackageDescription {
  std::string date;     ///< YYYY-MM-DD
  std::string license;  ///< of the models, as they say it; "" if they say none
  bool page = true;     ///< results have their report.html
  std::vector<std::pair<std::string, std::string>> versions;
  std::vector<PackedScenario> scenarios;
  std::vector<PackedMeshes> meshes;
  std::vector<PackedFile> files;  ///< by path; all but manifest.json
};

/// The command that repeats a scenario, in the archive's folder.
[[nodiscard]] std::string RerunCommand(const PackageDescription& package,
                                       const PackedScenario& scenario);

/// manifest.json, schema "mbverify.package/1".
[[nodiscard]] std::string ManifestJson(const PackageDescription& package);
/// Empty after findings, with `file` as their place; paths are checked to be plain.
[[nodiscard]] std::optional<PackageDescription> ReadManifest(const std::string& json,
                                                             const std::string& file,
                                                             Diagnostics* diagnostics);

/// Of all files, manifest.json among them.
[[nodiscard]] std::string CrateJson(const PackageDescription& package);
[[nodiscard]] std::string PackageReadme(const PackageDescription& package);

}  // namespace mbv
