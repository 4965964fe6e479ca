#include "regress/utc_time.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "core/types.h"

namespace mbv {

std::string UtcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

double UtcHours(const std::string& utc) {
  std::tm time = {};
  const char* end = strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  return end == nullptr ? kNan : static_cast<double>(timegm(&time)) / 3600.0;
}

}  // namespace mbv
