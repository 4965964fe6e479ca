#include "render/caption.h"

#include <algorithm>
#include <cmath>

#include "render/ink.h"
#include "render/palette.h"
#include "text/text_mask.h"

namespace mbv::render {
namespace {

constexpr Ink kRule{0.55F, 0.58F, 0.62F};

Ink MoodColor(Caption::Mood mood) {
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

// Heights of the rows as fractions of the picture's smaller side.
struct Layout {
  double pad, title, detail, legend;

  Layout(const Caption& caption, const std::array<int, 2>& size_px) {
    const double unit = TextUnit(size_px);
    pad = 0.009 * unit;
    title = 0.033 * unit;
    detail = caption.detail.empty() ? -pad : 0.0245 * unit;  // without its gap, too
    legend = kSmallText * unit;
  }
  [[nodiscard]] double bar() const { return 5.3 * pad + title + detail + 2.0 * legend; }
};

void WriteLegend(const std::vector<LegendEntry>& legend, double top, const Layout& layout,
                 Picture* picture) {
  const double h = layout.legend;
  std::array<double, 2> lefts = {2.0 * layout.pad, 2.0 * layout.pad};
  const bool any_above =
      std::ranges::any_of(legend, [](const LegendEntry& entry) { return entry.row == 0; });
  for (const LegendEntry& entry : legend) {
    const int row = any_above ? entry.row : 0;
    double& left = lefts[static_cast<size_t>(row)];
    const double y = top + row * (h + 0.7 * layout.pad);
    const double mark = entry.color.empty() ? 0.0 : 1.5 * h;
    const double width = TextWidth(entry.text, h);
    if (left + mark + width > picture->width - 2.0 * layout.pad) continue;
    if (!entry.color.empty()) {
      const auto rgba = MaterialOf(entry.color).rgba;
      Fill(picture, static_cast<int>(left), static_cast<int>(y + 0.22 * h),
           static_cast<int>(1.1 * h), static_cast<int>(0.56 * h), {rgba[0], rgba[1], rgba[2]});
    }
    Write(entry.text, left + mark, y, h, kSoftInk, picture);
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

void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend,
                  Picture* picture) {
  const std::array<int, 2> size{picture->width, picture->height};
  const int bar = BarHeight(caption, size);
  if (bar == 0) return;
  const Layout layout(caption, size);
  const int top = picture->height - bar;
  Fill(picture, 0, top, picture->width, bar, kPaper);
  Fill(picture, 0, top, picture->width, std::max(1, picture->height / 500), kRule);
  const double left = 2.0 * layout.pad, room = picture->width - 2.0 * left;
  // The verdict first: the title gets the room that is left.
  const std::string status = FittedText(caption.status, layout.title, 0.5 * room);
  const double status_width = TextWidth(status, layout.title);
  double y = top + 1.5 * layout.pad;
  Write(status, left + room - status_width, y, layout.title, MoodColor(caption.mood), picture);
  const double title_room = room - status_width - (status.empty() ? 0.0 : layout.title);
  Write(FittedText(caption.title, layout.title, title_room), left, y, layout.title, kInk, picture);
  y += layout.title + layout.pad;
  if (!caption.detail.empty()) {
    Write(FittedText(caption.detail, layout.detail, room), left, y, layout.detail, kInk, picture);
  }
  y += layout.detail + layout.pad;
  WriteLegend(legend, y, layout, picture);
}

}  // namespace mbv::render
