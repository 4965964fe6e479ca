#include "base/sha256.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/markup.h"

namespace mbv {
namespace {

// Fractional parts of the cube roots of the first 64 primes [§4.2.2].
constexpr std::array<std::uint32_t, 64> kRound = {
    0x428a2f98, 0x71374491, 0xb5c0fbcf, 0xe9b5dba5, 0x3956c25b, 0x59f111f1, 0x923f82a4, 0xab1c5ed5,
    0xd807aa98, 0x12835b01, 0x243185be, 0x550c7dc3, 0x72be5d74, 0x80deb1fe, 0x9bdc06a7, 0xc19bf174,
    0xe49b69c1, 0xefbe4786, 0x0fc19dc6, 0x240ca1cc, 0x2de92c6f, 0x4a7484aa, 0x5cb0a9dc, 0x76f988da,
    0x983e5152, 0xa831c66d, 0xb00327c8, 0xbf597fc7, 0xc6e00bf3, 0xd5a79147, 0x06ca6351, 0x14292967,
    0x27b70a85, 0x2e1b2138, 0x4d2c6dfc, 0x53380d13, 0x650a7354, 0x766a0abb, 0x81c2c92e, 0x92722c85,
    0xa2bfe8a1, 0xa81a664b, 0xc24b8b70, 0xc76c51a3, 0xd192e819, 0xd6990624, 0xf40e3585, 0x106aa070,
    0x19a4c116, 0x1e376c08, 0x2748774c, 0x34b0bcb5, 0x391c0cb3, 0x4ed8aa4a, 0x5b9cca4f, 0x682e6ff3,
    0x748f82ee, 0x78a5636f, 0x84c87814, 0x8cc70208, 0x90befffa, 0xa4506ceb, 0xbef9a3f7, 0xc67178f2};

void Compress(const unsigned char* block, std::array<std::uint32_t, 8>* state) {
  std::array<std::uint32_t, 64> w{};
  for (size_t i = 0; i < 16; ++i) {
    for (size_t k = 0; k < 4; ++k) w[i] = w[i] << 8U | block[4 * i + k];
  }
  for (size_t i = 16; i < 64; ++i) {
    const std::uint32_t a = w[i - 15], b = w[i - 2];
    w[i] = w[i - 16] + w[i - 7] + (std::rotr(a, 7) ^ std::rotr(a, 18) ^ a >> 3U) +
           (std::rotr(b, 17) ^ std::rotr(b, 19) ^ b >> 10U);
  }
  auto [a, b, c, d, e, f, g, h] = *state;
  for (size_t i = 0; i < 64; ++i) {
    const std::uint32_t t1 = h + (std::rotr(e, 6) ^ std::rotr(e, 11) ^ std::rotr(e, 25)) +
                             ((e & f) ^ (~e & g)) + kRound[i] + w[i];
    const std::uint32_t t2 =
        (std::rotr(a, 2) ^ std::rotr(a, 13) ^ std::rotr(a, 22)) + ((a & b) ^ (a & c) ^ (b & c));
    h = g, g = f, f = e, e = d + t1, d = c, c = b, b = a, a = t1 + t2;
  }
  const std::array<std::uint32_t, 8> sum = {a, b, c, d, e, f, g, h};
  for (size_t i = 0; i < 8; ++i) (*state)[i] += sum[i];
}

}  // namespace

void Sha256Sum::Add(std::string_view bytes) {
  count_ += bytes.size();
  const auto compress = [this](std::string_view block) {
    Compress(reinterpret_cast<const unsigned char*>(block.data()), &state_);
  };
  if (!rest_.empty()) {
    const size_t missing = std::min(64 - rest_.size(), bytes.size());
    rest_ += bytes.substr(0, missing);
    bytes.remove_prefix(missing);
    if (rest_.size() < 64) return;
    compress(rest_);
    rest_.clear();
  }
  for (; bytes.size() >= 64; bytes.remove_prefix(64)) compress(bytes);
  rest_ = bytes;
}

std::array<std::uint8_t, 32> Sha256Sum::Digest() const {
  // The rest, a one bit, zeros, and the length in bits.
  std::string tail = rest_ + '\x80';
  while (tail.size() % 64 != 56) tail += '\0';
  const std::uint64_t bits = 8 * count_;
  for (int shift = 56; shift >= 0; shift -= 8) tail += static_cast<char>(bits >> shift & 255U);
  std::array<std::uint32_t, 8> state = state_;
  for (size_t at = 0; at < tail.size(); at += 64) {
    Compress(reinterpret_cast<const unsigned char*>(tail.data()) + at, &state);
  }
  std::array<std::uint8_t, 32> digest{};
  for (size_t i = 0; i < 32; ++i) {
    digest[i] = static_cast<std::uint8_t>(state[i / 4] >> (24 - 8 * (i % 4)));
  }
  return digest;
}

std::string Sha256Sum::Hex() const {
  std::string text;
  for (const std::uint8_t byte : Digest()) text += fmt::format("{:02x}", byte);
  return text;
}

std::array<std::uint8_t, 32> Sha256(std::string_view bytes) {
  Sha256Sum sum;
  sum.Add(bytes);
  return sum.Digest();
}

std::string Sha256Hex(std::string_view bytes) {
  Sha256Sum sum;
  sum.Add(bytes);
  return sum.Hex();
}

std::string CspHash(std::string_view text) {
  const auto digest = Sha256(text);
  return fmt::format("'sha256-{}'",
                     EncodeBase64({reinterpret_cast<const char*>(digest.data()), digest.size()}));
}

}  // namespace mbv
