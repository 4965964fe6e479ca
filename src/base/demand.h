// MBV_DEMAND: a condition that only our own bug can break. Armed in every build.
#pragma once

#include <stdexcept>
#include <string>

namespace mbv {

/// Our own bug; the program ends with exit code 4.
struct InternalError : std::logic_error {
  using std::logic_error::logic_error;
};

[[noreturn]] inline void ThrowDemand(const char* condition, const char* file, int line,
                                     const std::string& value) {
  std::string path = file;
  if (const auto at = path.rfind("/src/"); at != std::string::npos) path.erase(0, at + 1);
  throw InternalError(path + ":" + std::to_string(line) + ": demand failed: " + condition +
                      " (value " + value + ")");
}

inline std::string DemandText(const std::string& v) { return v; }
inline std::string DemandText(const char* v) { return v; }
template <typename T>
std::string DemandText(const T& v) {
  return std::to_string(v);
}

}  // namespace mbv

#define MBV_DEMAND(condition, value)                                                \
  do {                                                                              \
    if (!(condition))                                                               \
      ::mbv::ThrowDemand(#condition, __FILE__, __LINE__, ::mbv::DemandText(value)); \
  } while (false)
