// Version of the MuJoCo library in use.
#pragma once

#include <string>

namespace mbv {

/// "2.2.2": of the library that is loaded, not of the header.
[[nodiscard]] std::string EngineVersion();

}  // namespace mbv
