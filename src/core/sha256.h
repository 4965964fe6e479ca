// SHA-256 [FIPS 180-4], for a Content-Security-Policy and the checksums of archives.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace mbv {

[[nodiscard]] std::array<std::uint8_t, 32> Sha256(std::string_view bytes);

/// 64 hexadecimal digits.
[[nodiscard]] std::string Sha256Hex(std::string_view bytes);

/// "'sha256-…'": a policy's source for an inline script or style of this text.
[[nodiscard]] std::string CspHash(std::string_view text);

}  // namespace mbv
