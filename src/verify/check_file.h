// Validation of files without running anything, by the kind of document that each file is.
#pragma once

#include <span>
#include <string>

#include "base/diagnostics.h"
#include "scenario/load_scenario.h"

namespace mbv {

/// A kind of file that people write: how it is recognised, and how it is checked.
struct DocumentKind {
  bool (*is)(const std::string& file, const ScenarioHead& head);
  Diagnostics (*check)(const std::string& file);
};

/// The kinds that CheckFile knows from now on, asked in this order; they must outlive every call.
void UseDocumentKinds(std::span<const DocumentKind> kinds);

/// All findings about a file, by the first kind that recognises it.
[[nodiscard]] Diagnostics CheckFile(const std::string& file);

/// mechanism.json as external witnesses get it: a name that ends in .json.
[[nodiscard]] bool IsMechanismJson(const std::string& file, const ScenarioHead& head);
[[nodiscard]] Diagnostics CheckMechanismFile(const std::string& file);
/// A model, and whether the closed form of its name covers it.
[[nodiscard]] Diagnostics CheckModel(const std::string& file);
/// A scenario of motion, including what its closed form has to say about the motion.
[[nodiscard]] Diagnostics CheckScenario(const std::string& file);

}  // namespace mbv
