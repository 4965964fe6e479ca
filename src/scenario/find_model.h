// Where models and scenarios are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace mbv {

namespace internal {
extern const char* const kInstalledData;  ///< <prefix>/share/mbverify, as it was configured
}  // namespace internal

/// Folders searched for models/<name>/model.yaml, best first: "models" beside the start folder and
/// beside each folder above it, $MBVERIFY_MODELS, ./models, and ShippedModels().
[[nodiscard]] std::vector<std::filesystem::path> ModelFolders(const std::filesystem::path& start);

/// Path of a model named as in a scenario: a path (relative to `start`) if it contains '/' or ends
/// in .yaml, .urdf, .xml or .sdf, otherwise a name looked up in ModelFolders(start). Empty when
/// there is none.
[[nodiscard]] std::optional<std::string> FindModel(const std::string& name,
                                                   const std::filesystem::path& start);

/// What to say about a name that FindModel() does not find.
[[nodiscard]] std::string ModelHint(const std::string& name, const std::filesystem::path& start);

/// A scenario or folder of them named on a command line: a path, or a name below ScenarioFolders()
/// without its ending ("four_bar/turn", "four_bar"). What is neither is returned as it could be
/// spelt, for the reader to complain about.
[[nodiscard]] std::string FindScenario(const std::string& argument);

/// Names of all models in ModelFolders(start), sorted, each once.
[[nodiscard]] std::vector<std::string> ModelNames(const std::filesystem::path& start);

/// Folders with scenarios that names lead to: ./scenarios, then the one beside ShippedModels().
[[nodiscard]] std::vector<std::filesystem::path> ScenarioFolders();

/// The models that the running program or this library came with: the installed ones, or those of
/// the source tree that it was built in; empty if there are none.
[[nodiscard]] std::optional<std::filesystem::path> ShippedModels();

/// `path` relative to the current folder if it lies below it, else as it is.
[[nodiscard]] std::string Shown(const std::filesystem::path& path);

}  // namespace mbv
