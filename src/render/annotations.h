// What is drawn to explain a picture: force arrows, closure rings, paths, translucent meshes.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/png.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "render/render.h"
#include "render/scene.h"

// Painting over finished pixels: surfaces, lines and texts. Internal to render/.

namespace mbv::render {

/// Display values 0 … 1.
using Ink = std::array<float, 3>;
inline constexpr Ink kInk{0.10F, 0.11F, 0.13F}, kSoftInk{0.33F, 0.35F, 0.38F};
inline constexpr Ink kPaper{1.0F, 1.0F, 1.0F};

/// What heights of texts are fractions of [px].
[[nodiscard]] double TextUnit(const std::array<int, 2>& size_px);
inline constexpr double kSmallText = 0.0215;  ///< height of a legend's line

// What lies beyond the picture is left out. Over a transparent pixel the colour's share counts as
// opacity.
void Blend(Picture* picture, int x, int y, const Ink& color, float share);
void Fill(Picture* picture, int left, int top, int width, int height, const Ink& color,
          float share = 1.0F);
void Stroke(Picture* picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            const Ink& color);
/// One line of text of this height.
void Write(const std::string& text, double left, double top, double height_px, const Ink& color,
           Picture* picture);

// Names and a scale, painted over finished pixels.

/// A name to be written at a place in the picture.
struct Label {
  double x = 0.0, y = 0.0;  ///< of what is named, fractions of width and height
  std::string text = {};
};

/// Writes names beside their places on a pale ground, the first ones first; where the room is taken
/// farther away, with a line to the place. Places outside of the picture are not named. `floor_px`
/// is where a caption begins. Returns how many found no room.
int PaintLabels(const std::vector<Label>& labels, int floor_px, Picture* picture);

/// 1, 2 or 5 times a power of ten, not above `value`.
[[nodiscard]] double RoundLength(double value);

/// A bar of a round length, at most a quarter as long as the picture is wide, in its lower right
/// corner above `floor_px`. `height_m` is what the picture's height shows in the plane through the
/// look-at point, which the text names where the rays are not parallel.
void PaintScaleBar(double height_m, bool parallel, int floor_px, Picture* picture);

// The caption bar under a picture: text, verdict and a legend, painted over finished pixels.

/// One entry of the legend: a coloured mark and its meaning.
struct LegendEntry {
  std::string color = {};  ///< material name; empty: text alone
  std::string text = {};
  int row = 0;  ///< 0 or 1
};

/// True when there is nothing to write.
[[nodiscard]] bool IsEmpty(const Caption& caption);
/// Height of the bar for a picture of this height [px]; 0 for an empty caption.
[[nodiscard]] int BarHeight(const Caption& caption, const std::array<int, 2>& size_px);
/// Paints bar, texts and legend onto the picture's lower edge. Text too long for its place is
/// shortened with "…".
void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend, Picture* picture);

/// Plain-coloured triangles, drawn after the lit solids without casting shadows.
struct FlatMesh {
  enum class Depth {
    kVisible,  ///< hidden by solids before it
    kHidden,   ///< only where solids hide it
  };
  std::vector<Vec3> vertices_W = {};               ///< [m]
  std::vector<std::array<int, 3>> triangles = {};  ///< indices into vertices_W
  std::array<float, 4> rgba{};
  Depth depth = Depth::kVisible;
  bool shaded = false;  ///< darker where it is seen at a flat angle
};

struct Annotations {
  std::vector<Item> items;
  std::vector<FlatMesh> flats;
};

/// Arrows of one frame's drive forces with ghosts where bodies hide them, and rings around the
/// closures that face a camera looking along `forward_W`. A closure with an error of more than
/// half its ball gets a red bar across the gap.
[[nodiscard]] Annotations Annotate(const Mechanism& mechanism, const PictureFrame& frame,
                                   const Scale& scale, const PictureOptions& options,
                                   const Vec3& forward_W);
/// A translucent solid as flat faces, to be blended.
[[nodiscard]] FlatMesh GlassMesh(const Item& item);
/// The overlay's paths as rods and its meshes, with ghosts where bodies hide them from a camera
/// looking along `forward_W`.
[[nodiscard]] Annotations OverlayAnnotations(const Overlay& overlay, const Scale& scale,
                                             const Vec3& forward_W);

}  // namespace mbv::render
