#include "render/labels.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "render/ink.h"
#include "text/text_mask.h"

namespace mbv::render {
namespace {

using TextBox = Eigen::AlignedBox2d;

// Where a text's box may begin, about its place: beside it, then on wider and wider rings.
std::vector<Eigen::Vector2d> TextCorners(const Eigen::Vector2d& at, double width, double height,
                                         double h) {
  std::vector<Eigen::Vector2d> corners = {at + Eigen::Vector2d(0.6 * h, -0.5 * height),
                                          at + Eigen::Vector2d(-0.6 * h - width, -0.5 * height),
                                          at + Eigen::Vector2d(-0.5 * width, -height - 0.6 * h),
                                          at + Eigen::Vector2d(-0.5 * width, 0.6 * h)};
  constexpr int kRings = 8, kTurns = 16;
  for (int ring = 1; ring <= kRings; ++ring) {
    for (int turn = 0; turn < kTurns; ++turn) {
      const double angle = 2.0 * std::numbers::pi * (turn + 0.5 * (ring % 2)) / kTurns;
      const Eigen::Vector2d e(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d middle =
          at + e * (1.6 * h * ring) + Eigen::Vector2d(0.5 * width * e.x(), 0.5 * height * e.y());
      corners.emplace_back(middle - Eigen::Vector2d(0.5 * width, 0.5 * height));
    }
  }
  return corners;
}

// The first of the boxes that lies inside and over no other; empty if there is none.
TextBox FreeBox(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& size,
                const TextBox& inside, const std::vector<TextBox>& taken) {
  for (const Eigen::Vector2d& corner : corners) {
    const TextBox box(corner, corner + size);
    const bool over =
        std::ranges::any_of(taken, [&](const TextBox& other) { return other.intersects(box); });
    if (inside.contains(box) && !over) return box;
  }
  return {};
}

std::string LengthText(double length_m) {
  if (length_m < 1e-3) return fmt::format("{:g} µm", length_m * 1e6);
  if (length_m < 1.0) return fmt::format("{:g} mm", length_m * 1e3);
  if (length_m < 1e3) return fmt::format("{:g} m", length_m);
  return fmt::format("{:g} km", length_m * 1e-3);
}

}  // namespace

int PaintLabels(const std::vector<Label>& labels, int floor_px, Picture* picture) {
  const double h = kSmallText * TextUnit({picture->width, picture->height});
  const TextBox inside(Eigen::Vector2d::Zero(), Eigen::Vector2d(picture->width, floor_px));
  std::vector<TextBox> taken;
  std::vector<Eigen::Vector2d> places;
  for (const Label& label : labels) {
    places.emplace_back(label.x * picture->width, label.y * picture->height);
    // No name lies over another one's place.
    const Eigen::Vector2d dot = Eigen::Vector2d::Constant(2.0);
    if (inside.contains(places.back()))
      taken.emplace_back(places.back() - dot, places.back() + dot);
  }
  int left_out = 0;
  for (std::size_t k = 0; k < labels.size(); ++k) {
    const Eigen::Vector2d& at = places[k];
    if (!inside.contains(at)) continue;
    const Eigen::Vector2d size(TextWidth(labels[k].text, h) + 0.6 * h, 1.15 * h);
    const TextBox box = FreeBox(TextCorners(at, size.x(), size.y(), h), size, inside, taken);
    if (box.isEmpty()) {
      ++left_out;
      continue;
    }
    taken.push_back(box);
    const Eigen::Vector2d near = at.cwiseMax(box.min()).cwiseMin(box.max());
    if ((near - at).norm() > h) Stroke(picture, at, near, kInk);
    Fill(picture, static_cast<int>(box.min().x()), static_cast<int>(box.min().y()),
         static_cast<int>(size.x()), static_cast<int>(size.y()), kPaper, 0.72F);
    const int dot = std::max(1, picture->height / 480);
    Fill(picture, static_cast<int>(at.x()) - dot / 2, static_cast<int>(at.y()) - dot / 2, dot + 1,
         dot + 1, kInk);
    Write(labels[k].text, box.min().x() + 0.3 * h, box.min().y() + 0.05 * h, h, kInk, picture);
  }
  return left_out;
}

double RoundLength(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return (digit >= 5.0 ? 5.0 : digit >= 2.0 ? 2.0 : 1.0) * power;
}

void PaintScaleBar(double height_m, bool parallel, int floor_px, Picture* picture) {
  const double unit = TextUnit({picture->width, picture->height}), h = kSmallText * unit;
  const double px_per_m = picture->height / height_m;
  const double length_m = RoundLength(0.25 * picture->width / px_per_m);
  const int width = static_cast<int>(std::lround(length_m * px_per_m));
  const std::string text = LengthText(length_m) + (parallel ? "" : " at the point looked at");
  const double text_width = TextWidth(text, h), pad = 0.018 * unit;
  const int thick = std::max(2, static_cast<int>(std::lround(0.005 * unit)));
  const double room = std::max<double>(width, text_width);
  const double middle = picture->width - pad - 0.5 * room, top = floor_px - pad - thick - 1.2 * h;
  Fill(picture, static_cast<int>(middle - 0.5 * room - 0.4 * h), static_cast<int>(top - 0.2 * h),
       static_cast<int>(room + 0.8 * h), static_cast<int>(1.6 * h) + thick, kPaper, 0.72F);
  Write(text, middle - 0.5 * text_width, top, h, kInk, picture);
  Fill(picture, static_cast<int>(std::lround(middle - 0.5 * width)),
       static_cast<int>(top + 1.2 * h), width, thick, kInk);
}

}  // namespace mbv::render
