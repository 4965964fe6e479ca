// Which files an archive beside a paper takes along, and where they lie in it.
//
// Below inputs/ files lie beside each other as they do at home, relative to the deepest folder that
// holds all of them: what names another file by a relative path finds it. Two kinds lie elsewhere
// at home: models found by name (MBVERIFY_MODELS, those that the program came with) go to
// inputs/models/, where scenarios look first; meshes of packages (--package) to
// inputs/packages/NAME/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "report/package_files.h"

namespace mbv {

inline constexpr const char* kInputsFolder = "inputs";

struct PackedInput {
  std::string file;  ///< as it was opened
  std::string path;  ///< in the archive: "inputs/…"
  std::string role;  ///< as in PackedFile
  std::string content;
  bool executable = false;
};

struct PackageInputs {
  std::vector<PackedInput> files;      ///< by path
  std::vector<std::string> scenarios;  ///< their paths in the archive, as given, each once
  std::vector<PackedMeshes> meshes;    ///< packages that are taken along
};

/// Loads scenarios of any kind and studies, and collects what they read. Empty after findings: bad
/// input, files without a folder in common, two files for one place, files that name the home
/// folder of whoever packs them.
[[nodiscard]] std::optional<PackageInputs> GatherInputs(const std::vector<std::string>& scenarios,
                                                        Diagnostics* diagnostics);

/// The licences (`license:`) that model files state, each once: "CC-BY-4.0, MIT"; "" without.
[[nodiscard]] std::string LicensesOf(const PackageInputs& inputs);

}  // namespace mbv
