// `mbverify package`: the archive beside a paper, with inputs, results, figures and what describes
// them (docs/how-to/archives.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "cli/options.h"
#include "features/paper/package_manifest.h"
#include "verify/program_consent.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct PackageOptions {
  std::string folder = "paper";  ///< the one folder in the archive
  std::string date;              ///< YYYY-MM-DD; "": that of SOURCE_DATE_EPOCH, else 1980-01-01
  bool page = true, figures = true;
  ProgramConsent programs = {};  ///< that scenarios name
  ProgressFunction progress = {};
};

struct PackageOutcome {
  int exit_code = 4;  ///< 0: there is an archive, whatever its scenarios came to; 2 bad input
  Diagnostics diagnostics;
  PackageDescription description;
  std::string zip;  ///< its bytes; "" without
};

/// Copies inputs to a folder of its own and runs the scenarios there, as whoever unpacks the
/// archive will. The same inputs give the same bytes.
[[nodiscard]] PackageOutcome MakePackage(const std::vector<std::string>& scenarios,
                                         const PackageOptions& options);

/// What `mbverify package --check` is asked.
struct ArchiveArguments {
  std::string archive;
  bool trust = false, verbose = false;
  JsonOption json;
};
/// Repeats what the archive holds, and says which results are the same. Its exit code.
[[nodiscard]] int CheckArchive(const ArchiveArguments& arguments);

/// Whether a date is one of the calendar, written YYYY-MM-DD.
[[nodiscard]] bool IsDate(const std::string& text);

// Which files an archive beside a paper takes along, and where they lie in it.
//
// Below inputs/ files lie beside each other as they do at home, relative to the deepest folder that
// holds all of them: what names another file by a relative path finds it. Two kinds lie elsewhere
// at home: models found by name (MBVERIFY_MODELS, those that the program came with) go to
// inputs/models/, where scenarios look first; meshes of packages (--package) to
// inputs/packages/NAME/.

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

// Whether a text identifies the user or machine that wrote it.

/// The line (1-based) of the first mention of `path` as a path in `text`; 0 without one.
[[nodiscard]] int LineNaming(const std::string& text, const std::string& path);
/// $HOME where its path identifies its owner; "" else.
[[nodiscard]] std::string HomeFolder();

}  // namespace mbv
