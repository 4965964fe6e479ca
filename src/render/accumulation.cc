#include "render/accumulation.h"

#include <algorithm>

#include "core/demand.h"

namespace mbv::render {
namespace {

constexpr int kEven = 8;  // steps of 255 by which passes may differ and the pixel be even
constexpr std::uint32_t kMostPasses = 65535 / 255;

}  // namespace

Accumulation::Accumulation(int width, int height)
    : width_(width),
      height_(height),
      sum_(4UL * width * height, 0),
      low_(sum_.size(), 255),
      high_(sum_.size(), 0) {}

void Accumulation::Add(const std::vector<std::uint8_t>& rgba, bool masked) {
  MBV_DEMAND(rgba.size() == sum_.size(), rgba.size());
  ++(masked ? masked_ : full_);
  MBV_DEMAND(full_ + masked_ <= kMostPasses, full_ + masked_);
  if (masked) {
    for (std::size_t pixel = 0; pixel < mask_.size(); ++pixel) {
      if (mask_[pixel] == 0) continue;
      for (std::size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) sum_[i] += rgba[i];
    }
    return;
  }
  // Apart from each other, which the compiler cannot see.
  const std::uint8_t* __restrict from = rgba.data();
  std::uint16_t* __restrict sum = sum_.data();
  std::uint8_t* __restrict low = low_.data(), * __restrict high = high_.data();
  for (std::size_t i = 0, count = rgba.size(); i < count; ++i) {
    sum[i] = static_cast<std::uint16_t>(sum[i] + from[i]);
    low[i] = std::min(low[i], from[i]);
    high[i] = std::max(high[i], from[i]);
  }
}

std::size_t Accumulation::Mark() {
  mask_.assign(sum_.size() / 4, 0);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width_ + x;
      int most = 0;
      for (std::size_t i = 4 * pixel; i < 4 * pixel + 4; ++i)
        most = std::max(most, high_[i] - low_[i]);
      if (most <= kEven) continue;
      for (int v = std::max(0, y - 1); v <= std::min(height_ - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(width_ - 1, x + 1); ++u) {
          mask_[static_cast<std::size_t>(v) * width_ + u] = 255;
        }
      }
    }
  }
  return static_cast<std::size_t>(std::ranges::count(mask_, 255));
}

void Accumulation::Close() {
  const auto means = [](std::uint32_t n) {
    std::vector<std::uint8_t> out(255 * n + 1);
    for (std::uint32_t sum = 0; sum < out.size(); ++sum) {
      out[sum] = static_cast<std::uint8_t>((sum + n / 2) / n);
    }
    return out;
  };
  full_means_ = means(full_);
  all_means_ = means(full_ + masked_);
}

std::uint8_t Accumulation::Mean(std::size_t pixel, int channel) const {
  const bool marked = !mask_.empty() && mask_.data()[pixel] != 0;
  return (marked ? all_means_ : full_means_).data()[sum_.data()[4 * pixel + channel]];
}

std::uint8_t Accumulation::Unmultiplied(std::size_t pixel, int channel) const {
  const std::uint32_t alpha = sum_[4 * pixel + 3];
  if (alpha == 0) return 0;
  const std::uint32_t color = (255U * sum_[4 * pixel + channel] + alpha / 2) / alpha;
  return static_cast<std::uint8_t>(std::min(color, 255U));
}

}  // namespace mbv::render
