// What is drawn to explain a picture: force arrows, closure rings, paths, translucent meshes.
#pragma once

#include <array>
#include <vector>

#include "core/types.h"
#include "mechanism/mechanism.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

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
/// closures that face a camera looking along `forward_W`. A closure that came apart by more than
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
