// The mean of several passes over a picture: the first ones everywhere, the others where those
// differ.
#pragma once

#include <cstdint>
#include <vector>

namespace mbv::render {

class Accumulation {
 public:
  Accumulation(int width, int height);

  /// Adds a pass, RGBA of the whole picture; in masked passes only what the mask shows.
  void Add(const std::vector<std::uint8_t>& rgba, bool masked);
  /// Closes the passes over everything: marks what differed between them by more than the smallest
  /// steps, and its neighbours. Returns how many pixels are marked.
  std::size_t Mark();
  /// Ends the passes; then there are means.
  void Close();
  /// 255 where a pixel is marked, 0 elsewhere.
  [[nodiscard]] const std::vector<std::uint8_t>& mask() const { return mask_; }
  /// The mean of a pixel's passes, rounded.
  [[nodiscard]] std::uint8_t Mean(std::size_t pixel, int channel) const;
  /// The mean colour, divided by the opacity by which the passes' colours are multiplied.
  [[nodiscard]] std::uint8_t Unmultiplied(std::size_t pixel, int channel) const;

 private:
  int width_, height_;
  std::uint32_t full_ = 0, masked_ = 0;  // passes
  std::vector<std::uint16_t> sum_;
  std::vector<std::uint8_t> low_, high_;  // over the passes over everything
  std::vector<std::uint8_t> mask_;
  std::vector<std::uint8_t> full_means_, all_means_;  // of sums
};

}  // namespace mbv::render
