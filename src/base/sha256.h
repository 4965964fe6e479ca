// SHA-256 [FIPS 180-4], for a Content-Security-Policy and the checksums of archives.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace mbv {

[[nodiscard]] std::array<std::uint8_t, 32> Sha256(std::string_view bytes);

/// The same of bytes that come piece by piece.
class Sha256Sum {
 public:
  void Add(std::string_view bytes);
  [[nodiscard]] std::array<std::uint8_t, 32> Digest() const;
  [[nodiscard]] std::string Hex() const;  ///< 64 hexadecimal digits

 private:
  std::array<std::uint32_t, 8> state_ = {0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                         0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::uint64_t count_ = 0;
  std::string rest_;  // fewer than 64 bytes
};

/// 64 hexadecimal digits.
[[nodiscard]] std::string Sha256Hex(std::string_view bytes);

/// "'sha256-…'": a policy's source for an inline script or style of this text.
[[nodiscard]] std::string CspHash(std::string_view text);

}  // namespace mbv
