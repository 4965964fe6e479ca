#include "plot/layout.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/markup.h"

namespace mbv {
namespace {

// How one way of writing renders the pieces.
struct MarkupWords {
  std::function<std::string(std::string_view)> plain;
  const char *symbol, *below, *above;  // "{}" is the rendered content
};

// Up to `end`, from behind the opening; moves `at` behind the end. A backslash takes the next
// character as it is.
std::string Piece(std::string_view markup, char end, const MarkupWords& words, size_t* at);

std::string Enclosed(const char* format, std::string_view markup, char end,
                     const MarkupWords& words, size_t* at) {
  return fmt::format(fmt::runtime(format), Piece(markup, end, words, at));
}

std::string Piece(std::string_view markup, char end, const MarkupWords& words, size_t* at) {
  std::string out, plain;
  const auto flush = [&] {
    if (!plain.empty()) out += words.plain(plain);
    plain.clear();
  };
  while (*at < markup.size()) {
    const char c = markup[(*at)++];
    const bool opens = *at < markup.size() && markup[*at] == '{';
    if (c == '\\' && *at < markup.size()) {
      plain += markup[(*at)++];
    } else if (c == end && end != '\0') {
      break;
    } else if (c == '*') {
      flush();
      out += Enclosed(words.symbol, markup, '*', words, at);
    } else if ((c == '_' || c == '^') && opens) {
      flush();
      ++*at;
      out += Enclosed(c == '_' ? words.below : words.above, markup, '}', words, at);
    } else {
      plain += c;
    }
  }
  flush();
  return out;
}

}  // namespace

std::string ToPango(std::string_view markup, double font_pt) {
  constexpr double kPangoUnits = 1024, kSmall = 0.72, kUp = 0.36, kDown = -0.2;
  const auto span = [&](double rise) {
    return fmt::format("<span size=\"{:.0f}\" rise=\"{:.0f}\">{{}}</span>",
                       kPangoUnits * kSmall * font_pt, kPangoUnits * rise * font_pt);
  };
  const std::string below = span(kDown), above = span(kUp);
  size_t at = 0;
  const MarkupWords words = {[](std::string_view text) { return EscapeMarkup(text); }, "<i>{}</i>",
                             below.c_str(), above.c_str()};
  return Piece(markup, '\0', words, &at);
}

std::string ToTex(std::string_view markup) {
  size_t at = 0;
  const MarkupWords words = {TexText, "\\textit{{{}}}", "\\textsubscript{{{}}}",
                             "\\textsuperscript{{{}}}"};
  return Piece(markup, '\0', words, &at);
}

std::string AsPlainText(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '*' || c == '_' || c == '^' || c == '\\' || c == '}') out += '\\';
    out += c;
  }
  return out;
}

namespace {

constexpr double kUsualHeight = 0.46;  // of a panel's axes, against the figure's width
constexpr double kLeastHeight = 0.25, kMostHeight = 1.3;
constexpr double kEdge = 1.0;      // around the figure [pt]
constexpr double kBarWidth = 8.0;  // of a map's colours [pt]
constexpr double kBarGap = 6.0;    // between it and the axes [pt]

std::string WithMinus(const std::string& number) {
  return number.starts_with('-') ? "−" + number.substr(1) : number;
}

// "10^{−6}", "5·10^{−6}".
std::string PowerText(double value) {
  const int power = static_cast<int>(std::floor(std::log10(value) + 1e-9));
  const long factor = std::lround(value / std::pow(10.0, power));
  const std::string ten = fmt::format("10^{{{}}}", WithMinus(std::to_string(power)));
  return factor == 1 ? ten : fmt::format("{}·{}", factor, ten);
}

// All with as many decimals as their steps need.
std::vector<FigureTick> TicksOf(const PlotAxis& axis, int wanted) {
  std::vector<FigureTick> ticks;
  const std::vector<double> values = axis.Ticks(wanted);
  const double step = values.size() > 1 ? values[1] - values[0] : 1.0;
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 12);
  const double largest = values.empty() ? 0 : std::max(std::abs(values.front()), values.back());
  for (const double value : values) {
    std::string text = axis.log ? PowerText(value)
                       : decimals > 5 || largest >= 1e6
                           ? fmt::format("{:g}", value)
                           : fmt::format("{:.{}f}", value + 0.0, decimals);
    if (!axis.log && std::abs(value) < 1e-6 * step) text = "0";
    ticks.push_back({value, WithMinus(text)});
  }
  return ticks;
}

bool Ascends(const FigureCurve& curve) {
  double last = -std::numeric_limits<double>::infinity();
  for (const auto& [x, y] : curve.points) {
    if (x < last) return false;
    if (std::isfinite(x)) last = x;
  }
  return true;
}

// Over time curves reach from edge to edge; a cloud keeps its distance.
void RangeOfCurves(const FigurePanel& panel, PanelPlace* place) {
  bool ascend = !panel.equal_scale;
  for (const FigureCurve& curve : panel.curves) {
    ascend = ascend && Ascends(curve);
    for (const auto& [x, y] : curve.points) {
      if (!place->x.Shows(x) || !place->y.Shows(y)) continue;
      place->x.Add(x);
      place->y.Add(y);
    }
  }
  if (!ascend || !(place->x.low < place->x.high)) place->x.Pad();
  place->y.Pad();
}

void RangeOfMap(const MapPlot& map, PanelPlace* place) {
  place->x.low = map.x_min, place->x.high = map.x_max;
  place->y.low = map.y_min, place->y.high = map.y_max;
  place->value.log = map.log_scale;
  for (const double v : map.values) place->value.Add(v);
  if (!(place->value.low < place->value.high)) place->value.Pad();
}

PanelPlace RangesOf(const FigurePanel& panel) {
  PanelPlace place;
  place.x.log = panel.x.log;
  place.y.log = panel.y.log;
  if (panel.map) {
    RangeOfMap(*panel.map, &place);
  } else {
    RangeOfCurves(panel, &place);
  }
  return place;
}

double WidestOf(const Canvas& canvas, const std::vector<FigureTick>& ticks) {
  double widest = 0;
  for (const FigureTick& tick : ticks) widest = std::max(widest, canvas.Measure(tick.text).width);
  return widest;
}

class LayoutMaker {
 public:
  LayoutMaker(const Figure& figure, const FigureStyle& style)
      : figure_(figure), style_(style), canvas_(style) {
    const double mm = std::isfinite(figure.width_mm) ? figure.width_mm : style.width_mm;
    layout_.width = PointsOf(mm);
    layout_.row = HighestText();
  }

  FigureLayout Make() {
    for (const FigurePanel& panel : figure_.panels) layout_.panels.push_back(RangesOf(panel));
    if (figure_.common_x) ShareX();
    ChooseHeights();
    for (PanelPlace& panel : layout_.panels) panel.y_ticks = TicksOf(panel.y, WantedTicks(panel));
    PlaceAcross();
    PlaceDown();
    return std::move(layout_);
  }

 private:
  // Chinese is higher than Latin.
  [[nodiscard]] double HighestText() const {
    double row = canvas_.Measure("Ag").height;
    for (const FigurePanel& panel : figure_.panels) {
      for (const std::string& text : {panel.x.label, panel.y.label}) {
        row = std::max(row, canvas_.Measure(text).height);
      }
      for (const FigureCurve& curve : panel.curves) {
        row = std::max(row, canvas_.Measure(curve.label).height);
      }
    }
    return row;
  }

  [[nodiscard]] size_t size() const { return figure_.panels.size(); }

  [[nodiscard]] int WantedTicks(const PanelPlace& panel) const {
    return std::clamp(static_cast<int>(panel.height / (2.6 * style_.font_pt)), 2, 6);
  }

  void ShareX() {
    PlotAxis all = layout_.panels.front().x;
    for (const PanelPlace& panel : layout_.panels) {
      all.low = std::min(all.low, panel.x.low);
      all.high = std::max(all.high, panel.x.high);
    }
    for (PanelPlace& panel : layout_.panels) panel.x = all;
  }

  // Heights before the widths of texts are known; those of equal scales are corrected later.
  void ChooseHeights() {
    for (size_t k = 0; k < size(); ++k) {
      layout_.panels[k].height = kUsualHeight * figure_.panels[k].share * layout_.width;
    }
  }

  void PlaceAcross() {
    double bar_texts = 0;
    bool map = false;
    for (size_t k = 0; k < size(); ++k) {
      PanelPlace& panel = layout_.panels[k];
      layout_.tick_room = std::max(layout_.tick_room, WidestOf(canvas_, panel.y_ticks));
      if (!figure_.panels[k].map) continue;
      map = true;
      panel.value_ticks = TicksOf(panel.value, 5);
      bar_texts = std::max(bar_texts, WidestOf(canvas_, panel.value_ticks));
    }
    layout_.bar_text_room = bar_texts;
    const double left = kEdge + layout_.row + kTextGap + layout_.tick_room + kTextGap;
    const double bar = map ? kBarGap + kBarWidth + kTextGap + bar_texts + kTextGap + layout_.row
                           : 0.5 * style_.font_pt;
    const double width = layout_.width - left - bar - kEdge;
    layout_.bar_left = left + width + kBarGap;
    layout_.bar_width = kBarWidth;
    for (PanelPlace& panel : layout_.panels) {
      panel.left = left;
      panel.width = width;
      panel.x.from_px = left;
      panel.x.to_px = left + width;
      ChooseXTicks(&panel);
    }
  }

  // As many as have room between their texts.
  void ChooseXTicks(PanelPlace* panel) {
    for (int wanted = 7; wanted >= 2; --wanted) {
      panel->x_ticks = TicksOf(panel->x, wanted);
      const double taken = (WidestOf(canvas_, panel->x_ticks) + 1.2 * style_.font_pt) *
                           static_cast<double>(panel->x_ticks.size());
      if (taken <= panel->width) return;
    }
  }

  // The legend of a panel in columns of equal width, as even as they can be.
  double LegendHeight(size_t k) {
    const std::vector<const FigureCurve*> rows = LegendOf(figure_.panels[k]);
    if (rows.empty()) return 0;
    double widest = 0;
    for (const FigureCurve* curve : rows) {
      widest = std::max(widest, canvas_.Measure(curve->label).width);
    }
    const double between = 0.6 * style_.font_pt;
    const double column = kSampleWidth + kSampleGap + widest + between;
    const double room = layout_.width - layout_.panels[k].left - kEdge + between;
    const auto most = static_cast<size_t>(std::max(1.0, std::floor(room / column)));
    const size_t lines = (rows.size() + most - 1) / most;
    layout_.panels[k].legend_columns = (rows.size() + lines - 1) / lines;
    return static_cast<double>(lines) * layout_.row + kTextGap;
  }

  [[nodiscard]] double EqualHeight(const PanelPlace& panel) const {
    const double wanted = panel.width * (panel.y.high - panel.y.low) / (panel.x.high - panel.x.low);
    return std::clamp(wanted, kLeastHeight * layout_.width, kMostHeight * layout_.width);
  }

  // What is left of a stated height is shared by the panels.
  void FitHeights(double fixed) {
    double shares = 0, usual = 0;
    for (size_t k = 0; k < size(); ++k) {
      PanelPlace& panel = layout_.panels[k];
      if (figure_.panels[k].equal_scale) panel.height = EqualHeight(panel);
      shares += figure_.panels[k].share;
      usual += panel.height;
    }
    const double stated = PointsOf(figure_.height_mm);
    if (std::isfinite(stated)) {
      const double left = std::max(stated - fixed, 0.1 * layout_.width);
      for (size_t k = 0; k < size(); ++k) {
        layout_.panels[k].height = left * figure_.panels[k].share / shares;
      }
      usual = left;
    }
    layout_.height = fixed + usual;
  }

  void PlaceDown() {
    const double x_texts = kTextGap + layout_.row + kTextGap + layout_.row;
    std::vector<double> legends(size()), below(size());
    // Without a legend, half of the uppermost tick's text stands above the axes.
    const double above = LegendOf(figure_.panels.front()).empty() ? 0.5 * layout_.row : 0;
    double fixed = 2 * kEdge + above;
    for (size_t k = 0; k < size(); ++k) {
      PanelPlace& panel = layout_.panels[k];
      panel.names_x = !figure_.common_x || k + 1 == size();
      legends[k] = LegendHeight(k);
      below[k] = panel.names_x ? x_texts + (k + 1 == size() ? 0 : 2 * kTextGap) : layout_.row;
      fixed += legends[k] + below[k];
    }
    FitHeights(fixed);
    double y = kEdge + above;
    for (size_t k = 0; k < size(); ++k) {
      PanelPlace& panel = layout_.panels[k];
      panel.legend_top = y;
      y += legends[k];
      panel.top = y;
      panel.y.from_px = y + panel.height;
      panel.y.to_px = y;
      y += panel.height + below[k];
      Finish(figure_.panels[k], &panel);
    }
  }

  void Finish(const FigurePanel& panel, PanelPlace* place) {
    place->value.from_px = place->y.from_px;
    place->value.to_px = place->y.to_px;
    if (panel.equal_scale) EqualScale(&place->x, &place->y);
    place->y_ticks = TicksOf(place->y, WantedTicks(*place));
    ChooseXTicks(place);
  }

  const Figure& figure_;
  const FigureStyle& style_;
  const Canvas canvas_;
  FigureLayout layout_;
};

}  // namespace

std::vector<const FigureCurve*> LegendOf(const FigurePanel& panel) {
  std::vector<const FigureCurve*> rows;
  for (const FigureCurve& curve : panel.curves) {
    if (!curve.label.empty()) rows.push_back(&curve);
  }
  return rows;
}

std::vector<LegendPlace> LegendPlaces(const FigureLayout& layout, const FigurePanel& panel,
                                      const PanelPlace& place) {
  const double column = (layout.width - place.left) / static_cast<double>(place.legend_columns);
  std::vector<LegendPlace> rows;
  for (const FigureCurve* curve : LegendOf(panel)) {
    const size_t line = rows.size() / place.legend_columns;
    rows.push_back({curve,
                    place.left + column * static_cast<double>(rows.size() % place.legend_columns),
                    place.legend_top + layout.row * (0.5 + static_cast<double>(line))});
  }
  return rows;
}

FigureLayout LayOut(const Figure& figure, const FigureStyle& style) {
  return LayoutMaker(figure, style).Make();
}

}  // namespace mbv
