// Where the sources and the build lie. Known to one generated file alone, so that no test's object
// code depends on the folder it was built in.
#pragma once

#include <string>

namespace mbv {

extern const char* const kSourceDir;
extern const char* const kBinaryDir;

/// A path in the source tree, `relative` beginning with a slash.
[[nodiscard]] inline std::string SourcePath(const std::string& relative) {
  return kSourceDir + relative;
}

}  // namespace mbv
