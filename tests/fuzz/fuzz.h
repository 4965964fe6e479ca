// What the fuzz targets share.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace mbv {

inline std::string Text(const unsigned char* data, size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// A broken promise is a crash for the fuzzer.
inline void Require(bool holds) {
  if (!holds) std::abort();
}

/// A file in a folder of this process, in memory.
inline std::string WriteFile(const std::string& name, const std::string& content) {
  static const std::filesystem::path folder = [] {
    const auto path = std::filesystem::path("/dev/shm") / ("mbv_fuzz_" + std::to_string(getpid()));
    std::filesystem::create_directories(path);
    std::atexit(
        [] { std::filesystem::remove_all("/dev/shm/mbv_fuzz_" + std::to_string(getpid())); });
    return path;
  }();
  std::ofstream(folder / name, std::ios::binary) << content;
  return (folder / name).string();
}

}  // namespace mbv
