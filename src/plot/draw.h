// Figures as PDF, SVG and PNG: one drawing for all three.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "plot/figure.h"
#include "plot/style.h"

// Vector drawing: lines and texts in points (1/72 in), y downwards, as PDF, SVG or PNG through the
// same calls.

namespace mbv {

/// Where a text's box lies about its point: 0 the left or upper edge, 0.5 the middle, 1 the other.
struct TextPlace {
  double x = 0, y = 0;
  double across = 0, down = 0;
  bool upwards = false;  ///< turned by 90° to the left; `across` then runs along the text
};

/// What a text takes [pt].
struct TextSize {
  double width = 0, height = 0;
};

class Canvas {
 public:
  /// Only measures.
  explicit Canvas(const FigureStyle& style);
  /// Draws on a cairo_t, which it does not own.
  Canvas(const FigureStyle& style, void* cairo);
  ~Canvas();
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;

  /// Texts are in the markup of plot/figure.h, in the style's font.
  [[nodiscard]] TextSize Measure(const std::string& text, double scale = 1.0) const;
  void Text(const std::string& text, const TextPlace& place, double scale = 1.0) const;
  /// Characters for which no font was found are reported here, each once.
  [[nodiscard]] bool lacks_glyphs() const;

  /// Between the points that are numbers.
  void Line(const FigurePoints& points, const std::string& color, double width_pt,
            const std::vector<double>& dashes = {}) const;
  void Mark(Marker shape, double x, double y, const std::string& color) const;
  void Box(double x, double y, double width, double height, double width_pt) const;
  /// Cells of one colour each (red, green, blue; negative: none), first row on top.
  void Cells(double x, double y, double width, double height, int columns,
             const std::vector<Rgb>& cells) const;
  /// A PDF goes on with another page.
  void NextPage() const;
  /// What `draw` draws, inside a rectangle only.
  void Clipped(double x, double y, double width, double height,
               const std::function<void()>& draw) const;

 private:
  struct Pen;
  std::unique_ptr<Pen> pen_;
  const FigureStyle& style_;
};

enum class PictureFormat { kPdf, kSvg, kPng };

/// A picture of this size [pt]; the same drawing gives the same bytes. `title` goes into PDF's
/// metadata.
[[nodiscard]] std::string DrawPicture(PictureFormat format, const FigureStyle& style, double width,
                                      double height, const std::string& title,
                                      const std::function<void(const Canvas&)>& draw);

/// The file's content. The same figure in the same style gives the same bytes where the same fonts
/// are installed.
[[nodiscard]] std::string DrawFigure(const Figure& figure, const FigureStyle& style,
                                     PictureFormat format);

/// Whether the fonts on this machine lack characters of its texts (Chinese without fonts-noto-cjk).
[[nodiscard]] bool LacksGlyphs(const Figure& figure, const FigureStyle& style);

// Figures as source for TeX (pgfplots): the same places, ranges, colours and dashes as drawn, and
// all numbers in files beside it, so that an author may change what they like.

/// Names and contents: NAME.tex; NAME.dat with two columns x0 y0, x1 y1, … for each curve, "nan"
/// where it has a gap or no more points; NAME_map.dat with x, y and c (its logarithm to base 10 on
/// a logarithmic scale) for each cell of a map.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> PgfFiles(const Figure& figure,
                                                                        const FigureStyle& style);

// Plots that other parts of the program describe (math/plot.h) as figures: maps, sections.

[[nodiscard]] Figure FromPlot(const std::string& name, const LinePlot& plot);
/// Both axes have one scale where they have one unit.
[[nodiscard]] Figure FromPlot(const std::string& name, const MapPlot& plot);
/// "Drive force *F* (kN)": name, symbol in markup, unit as shown ("" and "1" have none).
[[nodiscard]] std::string AxisLabel(const std::string& name, const std::string& symbol,
                                    const std::string& unit);
/// "x [mm]" → "*x* (mm)", "k_min [N/m]" → "*k*_{min} (N/m)"; words as they are.
[[nodiscard]] std::string FigureLabel(const std::string& label);

}  // namespace mbv
