#include "pipeline/animation.h"

#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <string_view>

#include "core/demand.h"

namespace mbv {
namespace {

constexpr size_t kSignature = 8;

std::uint32_t ReadU32(std::string_view bytes, size_t at) {
  std::uint32_t value = 0;
  for (size_t k = 0; k < 4; ++k) value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

std::string U32(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16),
          static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string U16(std::uint32_t value) {
  return {static_cast<char>(value >> 8), static_cast<char>(value)};
}

std::string Chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const uLong crc =
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
  return U32(static_cast<std::uint32_t>(data.size())) + checked +
         U32(static_cast<std::uint32_t>(crc));
}

// The data of all chunks of one type.
std::vector<std::string> ChunksOf(std::string_view png, std::string_view type) {
  std::vector<std::string> chunks;
  for (size_t at = kSignature; at + 12 <= png.size();) {
    const size_t length = ReadU32(png, at);
    MBV_DEMAND(at + 12 + length <= png.size(), length);
    if (png.substr(at + 4, 4) == type) chunks.emplace_back(png.substr(at + 8, length));
    at += 12 + length;
  }
  return chunks;
}

}  // namespace

std::string AnimatedPng(const std::vector<PictureFile>& pictures, double frames_per_s) {
  MBV_DEMAND(!pictures.empty(), pictures.size());
  const std::string& first = pictures.front().content;
  const std::string header = ChunksOf(first, "IHDR").at(0);
  std::string text = first.substr(0, kSignature) + Chunk("IHDR", header);
  const auto frames = static_cast<std::uint32_t>(pictures.size());
  text += Chunk("acTL", U32(frames) + U32(0));
  const std::string delay =
      U16(1000) + U16(static_cast<std::uint32_t>(std::lround(1000 * frames_per_s)));
  std::uint32_t sequence = 0;
  for (const PictureFile& picture : pictures) {
    // Whole frame at (0, 0), no disposal, no blending.
    text += Chunk("fcTL", U32(sequence++) + header.substr(0, 8) + U32(0) + U32(0) + delay +
                              std::string(2, '\0'));
    for (const std::string& data : ChunksOf(picture.content, "IDAT")) {
      text += &picture == &pictures.front() ? Chunk("IDAT", data)
                                            : Chunk("fdAT", U32(sequence++) + data);
    }
  }
  return text + Chunk("IEND", "");
}

}  // namespace mbv
