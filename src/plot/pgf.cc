#include "plot/draw.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "base/png.h"
#include "plot/layout.h"

namespace mbv {
namespace {

constexpr std::array<const char*, kMarkerShapes> kMarks = {"o",       "square", "triangle",
                                                           "diamond", "x",      "+"};

constexpr int kCellPixels = 4;  // of a map: sharp edges where readers smooth pictures
constexpr int kWhite = 255;

// PostScript points, which TeX calls bp.
std::string Bp(double points) { return fmt::format("{:.4g}bp", points); }

std::string HexOf(const std::string& color) {
  std::string hex = color.substr(1);
  std::ranges::transform(hex, hex.begin(), [](unsigned char c) { return std::toupper(c); });
  return hex;
}

class PgfWriter {
 public:
  PgfWriter(const Figure& figure, const FigureStyle& style)
      : figure_(figure), style_(style), layout_(LayOut(figure, style)) {}

  std::vector<std::pair<std::string, std::string>> Write() {
    Head();
    for (size_t k = 0; k < figure_.panels.size(); ++k) Panel(figure_.panels[k], layout_.panels[k]);
    tex_ += "\\end{tikzpicture}\n";
    std::vector<std::pair<std::string, std::string>> files = {{figure_.name + ".tex", tex_}};
    if (!curves_.empty()) files.emplace_back(figure_.name + ".dat", CurveTable());
    for (size_t k = 0; k < maps_.size(); ++k) files.emplace_back(MapFile(k), maps_[k]);
    return files;
  }

 private:
  template <typename... T>
  void Add(fmt::format_string<T...> format, T&&... values) {
    fmt::format_to(std::back_inserter(tex_), format, std::forward<T>(values)...);
  }

  // Everything stands where the other formats have it: pgfplots' own places depend on what it has
  // measured, so that figures would be wider than their column, and names of an axis meet legends.
  void Head() {
    Add("% {}: needs \\usepackage{{pgfplots}} and \\pgfplotsset{{compat=1.16}}; Chinese texts "
        "need\n"
        "% ctex with XeLaTeX or LuaLaTeX. {:.4g} mm wide and {:.4g} mm high.\n",
        figure_.name, layout_.width / PointsOf(1.0), layout_.height / PointsOf(1.0));
    for (size_t k = 0; k < style_.colors.size(); ++k) {
      Add("\\definecolor{{mbv{}}}{{HTML}}{{{}}}%\n", k, HexOf(style_.colors[k]));
    }
    font_ =
        fmt::format("\\fontsize{{{:g}}}{{{:g}}}\\selectfont", style_.font_pt, 1.2 * style_.font_pt);
    Add("\\begin{{tikzpicture}}\n\\useasboundingbox (0,0) rectangle ({},{});\n"
        "\\pgfplotsset{{every axis/.append style={{\n"
        "  anchor=north west, scale only axis, width={}, unbounded coords=jump,\n"
        "  tick align=inside, scaled ticks=false, minor tick num=0,\n"
        "  axis line style={{line width={:g}pt}}, tick style={{black, line width={:g}pt}},\n"
        "  major tick length={}, tick label style={{font={}}},\n"
        "  xticklabel style={{anchor=north, inner sep=0pt, yshift=-{}}},\n"
        "  yticklabel style={{anchor=east, inner sep=0pt, xshift=-{}}},\n"
        "  xlabel style={{font={}, at={{(axis description cs:0.5,0)}}, anchor=north,\n"
        "    inner sep=0pt, yshift=-{}}},\n"
        "  ylabel style={{font={}, at={{(axis description cs:0,0.5)}}, anchor=south,\n"
        "    inner sep=0pt, yshift={}}}}}}}\n",
        Bp(layout_.width), Bp(-layout_.height), Bp(layout_.panels[0].width), style_.axis_pt,
        style_.axis_pt, Bp(kTickLength), font_, Bp(kTextGap), Bp(kTextGap), font_,
        Bp(2 * kTextGap + layout_.row), font_, Bp(2 * kTextGap + layout_.tick_room));
  }

  static double End(const PlotAxis& axis, double inner) {
    return axis.log ? std::pow(10.0, inner) : inner;
  }

  // ", xtick={0,0.5}, xticklabels={{0.0},{0.5}}"; without texts where another panel names the axis.
  static std::string Ticks(char axis, const std::vector<FigureTick>& ticks, bool texts) {
    std::vector<std::string> values, labels;
    for (const FigureTick& tick : ticks) {
      values.push_back(fmt::format("{:.8g}", tick.value));
      if (texts) labels.push_back("{" + ToTex(tick.text) + "}");
    }
    return fmt::format(", {}tick={{{}}}, {}ticklabels={{{}}}", axis, fmt::join(values, ","), axis,
                       fmt::join(labels, ","));
  }

  void Panel(const FigurePanel& panel, const PanelPlace& place) {
    Add("\\begin{{axis}}[at={{({},{})}}, height={},\n"
        "  xmin={:.8g}, xmax={:.8g}, ymin={:.8g}, ymax={:.8g}{}{},\n  {},\n  {},\n"
        "  xlabel={{{}}}, ylabel={{{}}}{}]\n",
        Bp(place.left), Bp(-place.top), Bp(place.height), End(place.x, place.x.low),
        End(place.x, place.x.high), End(place.y, place.y.low), End(place.y, place.y.high),
        place.x.log ? ", xmode=log" : "", place.y.log ? ", ymode=log" : "",
        Ticks('x', place.x_ticks, place.names_x).substr(2),
        Ticks('y', place.y_ticks, true).substr(2), place.names_x ? ToTex(panel.x.label) : "",
        ToTex(panel.y.label), panel.map ? ", axis on top" : "");
    if (panel.map) Map(*panel.map, place.value);
    for (const FigureCurve& curve : panel.curves) Curve(curve);
    tex_ += "\\end{axis}\n";
    if (panel.map) ColorBar(*panel.map, place);
    Legend(panel, place);
  }

  // "(32.4bp,-5.2bp)" of a place from the upper left corner.
  static std::string At(double x, double y) { return fmt::format("({},{})", Bp(x), Bp(-y)); }

  // A text beside a point, as high as small letters are.
  void Label(double x, double y, const std::string& markup) {
    Add("\\node[anchor=base west, inner sep=0pt, font={}] at {} {{{}}};\n", font_,
        At(x, y + 0.35 * style_.font_pt), ToTex(markup));
  }

  void Legend(const FigurePanel& panel, const PanelPlace& place) {
    for (const auto& [curve, x, y] : LegendPlaces(layout_, panel, place)) {
      if (curve->line) {
        Add("\\draw[{}] {} -- {};\n", LineLook(*curve), At(x, y), At(x + kSampleWidth, y));
      }
      if (curve->marker >= 0) {
        Add("\\draw[{}{}] plot coordinates {{{}}};\n", LineLook(*curve), MarkLook(*curve),
            At(x + 0.5 * kSampleWidth, y));
      }
      Label(x + kSampleWidth + kSampleGap, y, curve->label);
    }
  }

  void ColorBar(const MapPlot& map, const PanelPlace& place) {
    constexpr int kSteps = 64;
    const double left = layout_.bar_left, right = left + layout_.bar_width;
    const double step = place.height / kSteps;
    for (int i = 0; i < kSteps; ++i) {
      const Rgb rgb = MapColor((i + 0.5) / kSteps);
      // Down to the box's lower edge: readers show the ground between neighbours.
      Add("\\fill[color={{rgb,255:red,{};green,{};blue,{}}}] {} rectangle {};\n", rgb[0], rgb[1],
          rgb[2], At(left, place.top + place.height - i * step), At(right, place.top));
    }
    Add("\\draw[line width={:g}pt] {} rectangle {};\n", style_.axis_pt, At(left, place.top),
        At(right, place.top + place.height));
    for (const FigureTick& tick : place.value_ticks) {
      const double y = place.value.Px(tick.value);
      Add("\\draw[line width={:g}pt] {} -- {};\n", style_.axis_pt, At(right, y),
          At(right - kTickLength, y));
      Label(right + kTextGap, y, tick.text);
    }
    Add("\\node[rotate=90, anchor=north, inner sep=0pt, font={}] at {} {{{}}};\n", font_,
        At(right + 2 * kTextGap + layout_.bar_text_room, place.top + 0.5 * place.height),
        ToTex(map.value_label));
  }

  // Colour, width and dashes.
  [[nodiscard]] std::string LineLook(const FigureCurve& curve) const {
    const auto index = static_cast<size_t>(std::max(0, curve.look)) % style_.colors.size();
    std::string look = curve.look < 0 ? "black" : fmt::format("mbv{}", index);
    look += fmt::format(", line width={:g}pt", curve.extent ? style_.axis_pt : style_.line_pt);
    std::string pattern;
    const std::vector<double>& dashes = DashesOf(style_, curve.look);
    for (size_t k = 0; k < dashes.size(); ++k) {
      pattern += fmt::format("{}{} {:g}pt", k == 0 ? "" : " ", k % 2 == 0 ? "on" : "off",
                             dashes[k] * style_.line_pt);
    }
    if (curve.line && !curve.extent && !pattern.empty()) look += ", dash pattern=" + pattern;
    return look;
  }

  [[nodiscard]] std::string MarkLook(const FigureCurve& curve) const {
    return fmt::format(", mark={}, mark size={:g}pt, mark options={{solid, fill=white}}",
                       kMarks.at(static_cast<size_t>(curve.marker % kMarkerShapes)),
                       0.5 * style_.marker_pt);
  }

  void Curve(const FigureCurve& curve) {
    if (curve.points.empty()) return;  // of the legend alone
    Add("\\addplot[{}{}{}] table[x=x{}, y=y{}] {{{}.dat}};\n", LineLook(curve),
        curve.line ? "" : ", only marks", curve.marker < 0 ? ", no markers" : MarkLook(curve),
        curves_.size(), curves_.size(), figure_.name);
    curves_.push_back(&curve);
  }

  // A picture: as cells a map of usual size exceeds TeX's memory.
  void Map(const MapPlot& map, const PlotAxis& value) {
    Add("\\addplot graphics[xmin={:.8g}, xmax={:.8g}, ymin={:.8g}, ymax={:.8g}] {{{}}};\n",
        map.x_min, map.x_max, map.y_min, map.y_max, MapFile(maps_.size()));
    Picture picture{.width = kCellPixels * map.columns, .height = kCellPixels * map.rows};
    picture.rgb.reserve(static_cast<size_t>(picture.width) * static_cast<size_t>(picture.height) *
                        3);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const auto row = static_cast<size_t>(map.rows - 1 - y / kCellPixels);
        const auto column = static_cast<size_t>(x / kCellPixels);
        const double v = map.values[row * static_cast<size_t>(map.columns) + column];
        for (const int part : CellColor(value, v)) {
          picture.rgb.push_back(static_cast<std::uint8_t>(part < 0 ? kWhite : part));
        }
      }
    }
    maps_.push_back(EncodePng(picture));
  }

  // "NAME_map.png"; of further maps "NAME_map2.png" …
  [[nodiscard]] std::string MapFile(size_t k) const {
    return figure_.name + "_map" + (k == 0 ? "" : std::to_string(k + 1)) + ".png";
  }

  static std::string NumberText(double value) {
    return std::isfinite(value) ? fmt::format("{:.10g}", value) : "nan";
  }

  [[nodiscard]] std::string CurveTable() const {
    std::string table;
    size_t rows = 0;
    for (size_t k = 0; k < curves_.size(); ++k) {
      table += fmt::format("{}x{} y{}", k == 0 ? "" : " ", k, k);
      rows = std::max(rows, curves_[k]->points.size());
    }
    table += "\n";
    for (size_t i = 0; i < rows; ++i) {
      for (size_t k = 0; k < curves_.size(); ++k) {
        const FigurePoints& points = curves_[k]->points;
        const auto [x, y] = i < points.size() ? points[i] : std::pair{kNan, kNan};
        table += (k == 0 ? "" : " ") + NumberText(x) + " " + NumberText(y);
      }
      table += "\n";
    }
    return table;
  }

  const Figure& figure_;
  const FigureStyle& style_;
  const FigureLayout layout_;
  std::string tex_, font_;
  std::vector<std::string> maps_;
  std::vector<const FigureCurve*> curves_;
};

}  // namespace

std::vector<std::pair<std::string, std::string>> PgfFiles(const Figure& figure,
                                                          const FigureStyle& style) {
  return PgfWriter(figure, style).Write();
}

}  // namespace mbv
