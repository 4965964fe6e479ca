// The languages of equations, one row each.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "equations/equations.h"

namespace mbv {

/// A language whose files run as a program.
struct EquationLanguage {
  const char* name;       ///< "Python"
  const char* extension;  ///< ".py"
  /// The interpreter's side: names and texts of files, which are put into a folder.
  std::vector<std::pair<std::string, std::string>> (*files)();
  /// Program and arguments that answer calls about `file`.
  std::vector<std::string> (*command)(const std::filesystem::path& folder, const std::string& file);
  /// What a user reads of it: program and file.
  std::vector<std::string> (*shown)(const std::string& file);
};

/// Of a file by its name; null: none.
[[nodiscard]] const EquationLanguage* FindEquationLanguage(const std::string& file);

[[nodiscard]] std::shared_ptr<Equations> MakeProgramEquations(const std::string& file,
                                                              const EquationLanguage& language);
/// Formulas of a YAML file.
[[nodiscard]] std::shared_ptr<Equations> MakeFormulaEquations(const std::string& file,
                                                              const std::string& text);

}  // namespace mbv
