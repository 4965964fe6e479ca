// Files of the regression: whole or not at all, fingerprints, text tails.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace mbv {

/// Writes a file and makes it durable before it takes its name; folders are made. "" or what went
/// wrong. A kill at any moment leaves the old file or the new one.
[[nodiscard]] std::string WriteDurably(const std::filesystem::path& path,
                                       const std::string& content);

[[nodiscard]] std::optional<std::string> ReadWholeFile(const std::filesystem::path& path);

/// 64-bit FNV-1a, for telling versions of files apart (no protection against forgery).
class Fingerprint {
 public:
  void Add(const std::string& bytes);  ///< the length counts, so "ab"+"c" is not "a"+"bc"
  void AddFile(const std::filesystem::path& path);
  [[nodiscard]] std::string Text() const;  ///< 16 hexadecimal digits

 private:
  void Mix(const char* bytes, size_t count);
  std::uint64_t hash_ = 14695981039346656037ULL;
};

/// The last `count` lines of a text, without control characters (escape sequences go, too).
[[nodiscard]] std::string LastLines(const std::string& text, int count);
[[nodiscard]] std::string WithoutControls(const std::string& text);

/// "2026-01-31T02:00:00Z" now.
[[nodiscard]] std::string UtcNow();

}  // namespace mbv
