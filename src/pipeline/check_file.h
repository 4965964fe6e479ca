// Validation of files without running anything.
#pragma once

#include <string>

#include "core/diagnostics.h"

namespace mbv {

/// All findings about a model file or a scenario (a file with a `mechanism:` key), including what
/// its closed form has to say about the motion; or about a mechanism.json (a name that ends so).
[[nodiscard]] Diagnostics CheckFile(const std::string& file);

}  // namespace mbv
