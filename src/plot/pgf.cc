#include "plot/pgf.h"

#include <fmt/format.h>

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
    tex_ += "\\end{groupplot}\n\\end{tikzpicture}\n";
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

  void Head() {
    Add("% {}: needs \\usepackage{{pgfplots}}, \\usepgfplotslibrary{{groupplots}} and\n"
        "% \\pgfplotsset{{compat=1.16}}; Chinese texts need ctex with XeLaTeX or LuaLaTeX.\n",
        figure_.name);
    for (size_t k = 0; k < style_.colors.size(); ++k) {
      Add("\\definecolor{{mbv{}}}{{HTML}}{{{}}}\n", k, HexOf(style_.colors[k]));
    }
    const std::string font =
        fmt::format("\\fontsize{{{:g}}}{{{:g}}}\\selectfont", style_.font_pt, 1.2 * style_.font_pt);
    Add("\\begin{{tikzpicture}}\n\\begin{{groupplot}}[\n"
        "  group style={{group size=1 by {}, vertical sep={}{}}},\n"
        "  scale only axis, width={}, unbounded coords=jump, tick align=inside,\n"
        "  axis line style={{line width={:g}pt}}, tick style={{black, line width={:g}pt}},\n"
        "  label style={{font={}}}, tick label style={{font={}}},\n"
        "  legend style={{font={}, draw=none, fill=none, at={{(0,1.02)}}, anchor=south west,\n"
        "    cells={{anchor=west}}, /tikz/every even column/.append style={{column sep=6pt}}}}]\n",
        figure_.panels.size(), Bp(Separation()),
        figure_.common_x ? ", xlabels at=edge bottom, xticklabels at=edge bottom" : "",
        Bp(layout_.panels[0].width), style_.axis_pt, style_.axis_pt, font, font, font);
  }

  // From the axes of one panel to those of the next; with one panel of no use.
  [[nodiscard]] double Separation() const {
    if (layout_.panels.size() < 2) return layout_.row;
    const PanelPlace &a = layout_.panels[0], &b = layout_.panels[1];
    return b.top - a.top - a.height;
  }

  static double End(const PlotAxis& axis, double inner) {
    return axis.log ? std::pow(10.0, inner) : inner;
  }

  void Panel(const FigurePanel& panel, const PanelPlace& place) {
    Add("\\nextgroupplot[height={}, xmin={:.8g}, xmax={:.8g}, ymin={:.8g}, ymax={:.8g}{}{},\n"
        "  xlabel={{{}}}, ylabel={{{}}}, legend columns={}{}]\n",
        Bp(place.height), End(place.x, place.x.low), End(place.x, place.x.high),
        End(place.y, place.y.low), End(place.y, place.y.high), place.x.log ? ", xmode=log" : "",
        place.y.log ? ", ymode=log" : "", ToTex(panel.x.label), ToTex(panel.y.label),
        place.legend_columns, panel.map ? MapOptions(*panel.map, place.value) : "");
    if (panel.map) Map(*panel.map, place.value);
    for (const FigureCurve& curve : panel.curves) Curve(curve);
  }

  [[nodiscard]] std::string LookOf(const FigureCurve& curve) const {
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
    if (curve.marker < 0) return look + ", no markers";
    return look + fmt::format("{}, mark={}, mark size={:g}pt, mark options={{solid, fill=white}}",
                              curve.line ? "" : ", only marks",
                              kMarks.at(static_cast<size_t>(curve.marker % kMarkerShapes)),
                              0.5 * style_.marker_pt);
  }

  void Curve(const FigureCurve& curve) {
    const std::string look = LookOf(curve);
    if (curve.points.empty()) {
      Add("\\addlegendimage{{{}}}\n", look);
    } else {
      Add("\\addplot[{}{}] table[x=x{}, y=y{}] {{{}.dat}};\n", look,
          curve.label.empty() ? ", forget plot" : "", curves_.size(), curves_.size(), figure_.name);
      curves_.push_back(&curve);
    }
    if (!curve.label.empty()) Add("\\addlegendentry{{{}}}\n", ToTex(curve.label));
  }

  static std::string MapOptions(const MapPlot& map, const PlotAxis& value) {
    std::string colors;
    for (int k = 0; k <= 4; ++k) {
      const Rgb rgb = MapColor(0.25 * k);
      colors += fmt::format(" rgb255=({},{},{})", rgb[0], rgb[1], rgb[2]);
    }
    return fmt::format(
        ",\n  axis on top, colormap={{mbv}}{{{}}}, colorbar, point meta min={:.8g}, point meta "
        "max={:.8g},\n"
        "  colorbar style={{ylabel={{{}}}{}}}",
        colors.substr(1), value.low, value.high, ToTex(map.value_label),
        value.log ? ", yticklabel={$10^{\\pgfmathprintnumber{\\tick}}$}" : "");
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
  std::string tex_;
  std::vector<std::string> maps_;
  std::vector<const FigureCurve*> curves_;
};

}  // namespace

std::vector<std::pair<std::string, std::string>> PgfFiles(const Figure& figure,
                                                          const FigureStyle& style) {
  return PgfWriter(figure, style).Write();
}

}  // namespace mbv
