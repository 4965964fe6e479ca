#include "render/caption.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mbv::render {
namespace {

using Rgb = std::array<float, 3>;
constexpr Rgb kInk{0.10F, 0.11F, 0.13F}, kSoftInk{0.33F, 0.35F, 0.38F};
constexpr Rgb kPaper{1.0F, 1.0F, 1.0F}, kRule{0.55F, 0.58F, 0.62F};

Rgb MoodColor(Caption::Mood mood) {
  switch (mood) {
    case Caption::Mood::kNeutral:
      return kSoftInk;
    case Caption::Mood::kGood:
      return {0.07F, 0.50F, 0.20F};
    case Caption::Mood::kBad:
      return {0.78F, 0.09F, 0.08F};
  }
  return kInk;
}

void Blend(Picture* picture, int x, int y, const Rgb& color, float share) {
  if (x < 0 || y < 0 || x >= picture->width || y >= picture->height) return;
  std::uint8_t* pixel =
      picture->rgb.data() + 3UL * (static_cast<std::size_t>(y) * picture->width + x);
  for (int i = 0; i < 3; ++i) {
    const float value = share * color[i] * 255.0F + (1.0F - share) * pixel[i];
    pixel[i] = static_cast<std::uint8_t>(std::lround(value));
  }
}

void Fill(Picture* picture, int left, int top, int width, int height, const Rgb& color) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) Blend(picture, x, y, color, 1.0F);
  }
}

// Writes text of a given height; the glyphs are much larger and are averaged down.
class Writer {
 public:
  Writer(const std::vector<Glyph>& font, Picture* picture) : font_(font), picture_(picture) {}

  [[nodiscard]] double Width(const std::string& text, double height_px) const {
    double width = 0.0;
    for (const char c : text) width += At(c).width;
    return width * height_px / At('x').height;
  }

  // Shortens the text until it fits.
  [[nodiscard]] std::string Fit(std::string text, double height_px, double room_px) const {
    if (Width(text, height_px) <= room_px) return text;
    while (!text.empty() && Width(text + "...", height_px) > room_px) text.pop_back();
    return text.empty() ? text : text + "...";
  }

  void Write(const std::string& text, double left, double top, double height_px,
             const Rgb& color) const {
    const double scale = height_px / At('x').height;
    for (const char c : text) {
      const Glyph& glyph = At(c);
      WriteGlyph(glyph, left, top, scale, color);
      left += glyph.width * scale;
    }
  }

 private:
  [[nodiscard]] const Glyph& At(char c) const { return font_[static_cast<unsigned char>(c)]; }

  // Coverage of a picture pixel = mean of the glyph over the pixel's square.
  void WriteGlyph(const Glyph& glyph, double left, double top, double scale,
                  const Rgb& color) const {
    const int x1 = static_cast<int>(std::floor(left)), y1 = static_cast<int>(std::floor(top));
    const int x2 = static_cast<int>(std::ceil(left + glyph.width * scale));
    const int y2 = static_cast<int>(std::ceil(top + glyph.height * scale));
    for (int y = y1; y < y2; ++y) {
      for (int x = x1; x < x2; ++x) {
        const double share = Mean(glyph, (x - left) / scale, (y - top) / scale, 1.0 / scale);
        if (share > 0.0) Blend(picture_, x, y, color, static_cast<float>(share));
      }
    }
  }

  // Mean coverage 0 … 1 over the square [x, x + side] × [y, y + side] of glyph pixels.
  static double Mean(const Glyph& glyph, double x, double y, double side) {
    double sum = 0.0;
    for (int j = std::max(0, static_cast<int>(std::floor(y)));
         j < std::min<double>(glyph.height, std::ceil(y + side)); ++j) {
      const double dy = std::min(j + 1.0, y + side) - std::max<double>(j, y);
      for (int i = std::max(0, static_cast<int>(std::floor(x)));
           i < std::min<double>(glyph.width, std::ceil(x + side)); ++i) {
        const double dx = std::min(i + 1.0, x + side) - std::max<double>(i, x);
        sum += dx * dy * glyph.coverage[static_cast<std::size_t>(j) * glyph.width + i] / 255.0;
      }
    }
    return sum / (side * side);
  }

  const std::vector<Glyph>& font_;
  Picture* picture_;
};

// Heights of the rows as fractions of the picture's smaller side.
struct Layout {
  double pad, title, detail, legend;

  Layout(const Caption& caption, const std::array<int, 2>& size_px) {
    const double unit = std::min(size_px[0] * 0.75, static_cast<double>(size_px[1]));
    pad = 0.009 * unit;
    title = 0.033 * unit;
    detail = caption.detail.empty() ? -pad : 0.0245 * unit;  // without its gap, too
    legend = 0.0215 * unit;
  }
  [[nodiscard]] double bar() const { return 5.3 * pad + title + detail + 2.0 * legend; }
};

void WriteLegend(const std::vector<LegendEntry>& legend, const Writer& writer, double top,
                 const Layout& layout, Picture* picture) {
  const double h = layout.legend;
  std::array<double, 2> lefts = {2.0 * layout.pad, 2.0 * layout.pad};
  const bool any_above =
      std::ranges::any_of(legend, [](const LegendEntry& entry) { return entry.row == 0; });
  for (const LegendEntry& entry : legend) {
    const int row = any_above ? entry.row : 0;
    double& left = lefts[static_cast<size_t>(row)];
    const double y = top + row * (h + 0.7 * layout.pad);
    const double mark = entry.color.empty() ? 0.0 : 1.5 * h;
    const std::string text = PlainText(entry.text);
    const double width = writer.Width(text, h);
    if (left + mark + width > picture->width - 2.0 * layout.pad) continue;
    if (!entry.color.empty()) {
      const auto rgba = MaterialOf(entry.color).rgba;
      Fill(picture, static_cast<int>(left), static_cast<int>(y + 0.22 * h),
           static_cast<int>(1.1 * h), static_cast<int>(0.56 * h), {rgba[0], rgba[1], rgba[2]});
    }
    writer.Write(text, left + mark, y, h, kSoftInk);
    left += mark + width + 1.6 * h;
  }
}

}  // namespace

bool IsEmpty(const Caption& caption) {
  return caption.title.empty() && caption.detail.empty() && caption.status.empty();
}

int BarHeight(const Caption& caption, const std::array<int, 2>& size_px) {
  return IsEmpty(caption) ? 0 : static_cast<int>(std::ceil(Layout(caption, size_px).bar()));
}

std::string PlainText(const std::string& utf8) {
  static const std::pair<const char*, const char*> kSubstitutes[] = {
      {"°", " deg"}, {"²", "^2"}, {"³", "^3"},  {"·", "."},  {"−", "-"},  {"–", "-"},  {"µ", "u"},
      {"μ", "u"},    {"×", "x"},  {"…", "..."}, {"±", "+-"}, {"≤", "<="}, {"≥", ">="}, {"→", "->"}};
  std::string plain;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto byte = static_cast<unsigned char>(utf8[i]);
    if (byte >= 32 && byte < 127) {
      plain += utf8[i++];
      continue;
    }
    std::string replacement = "?";
    std::size_t length = 1;
    while (i + length < utf8.size() && (static_cast<unsigned char>(utf8[i + length]) >> 6) == 2) {
      ++length;
    }
    for (const auto& [from, to] : kSubstitutes) {
      if (utf8.compare(i, length, from) == 0) replacement = to;
    }
    plain += replacement;
    i += length;
  }
  return plain;
}

void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend,
                  const std::vector<Glyph>& font, Picture* picture) {
  const std::array<int, 2> size{picture->width, picture->height};
  const int bar = BarHeight(caption, size);
  if (bar == 0) return;
  const Layout layout(caption, size);
  const int top = picture->height - bar;
  Fill(picture, 0, top, picture->width, bar, kPaper);
  Fill(picture, 0, top, picture->width, std::max(1, picture->height / 500), kRule);
  const Writer writer(font, picture);
  const double left = 2.0 * layout.pad, room = picture->width - 2.0 * left;
  // The verdict first: the title gets the room that is left.
  const std::string status = writer.Fit(PlainText(caption.status), layout.title, 0.5 * room);
  const double status_width = writer.Width(status, layout.title);
  double y = top + 1.5 * layout.pad;
  writer.Write(status, left + room - status_width, y, layout.title, MoodColor(caption.mood));
  const double title_room = room - status_width - (status.empty() ? 0.0 : layout.title);
  writer.Write(writer.Fit(PlainText(caption.title), layout.title, title_room), left, y,
               layout.title, kInk);
  y += layout.title + layout.pad;
  if (!caption.detail.empty()) {
    writer.Write(writer.Fit(PlainText(caption.detail), layout.detail, room), left, y, layout.detail,
                 kInk);
  }
  y += layout.detail + layout.pad;
  WriteLegend(legend, writer, y, layout, picture);
}

void PaintLabels(const std::vector<Label>& labels, const Caption& caption,
                 const std::vector<Glyph>& font, Picture* picture) {
  const std::array<int, 2> size{picture->width, picture->height};
  const Layout layout(Caption{}, size);
  const Writer writer(font, picture);
  const double h = layout.legend, floor = picture->height - BarHeight(caption, size);
  std::vector<Eigen::AlignedBox2d> taken;
  for (const Label& label : labels) {
    const std::string text = PlainText(label.text);
    const double x = label.x * picture->width, y = label.y * picture->height;
    const double width = writer.Width(text, h) + 0.6 * h, height = 1.1 * h;
    // Right of the place, or left, above and below of it.
    const std::array<Eigen::Vector2d, 4> shifts = {
        Eigen::Vector2d(0.6 * h, -0.5 * height), Eigen::Vector2d(-0.6 * h - width, -0.5 * height),
        Eigen::Vector2d(-0.5 * width, -height - 0.6 * h), Eigen::Vector2d(-0.5 * width, 0.6 * h)};
    for (const Eigen::Vector2d& shift : shifts) {
      const Eigen::Vector2d corner = Eigen::Vector2d(x, y) + shift;
      const Eigen::AlignedBox2d box(corner, corner + Eigen::Vector2d(width, height));
      const bool outside = box.min().x() < 0.0 || box.min().y() < 0.0 ||
                           box.max().x() > picture->width || box.max().y() > floor;
      const bool over = std::ranges::any_of(
          taken, [&](const Eigen::AlignedBox2d& other) { return other.intersects(box); });
      if (outside || over) continue;
      taken.push_back(box);
      for (int row = static_cast<int>(box.min().y()); row < box.max().y(); ++row) {
        for (int column = static_cast<int>(box.min().x()); column < box.max().x(); ++column) {
          Blend(picture, column, row, kPaper, 0.72F);
        }
      }
      Fill(picture, static_cast<int>(x) - 1, static_cast<int>(y) - 1, 3, 3, kInk);
      writer.Write(text, corner.x() + 0.3 * h, corner.y() + 0.05 * h, h, kInk);
      break;
    }
  }
}

}  // namespace mbv::render
