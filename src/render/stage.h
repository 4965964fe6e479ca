// The off-screen stage: an OSMesa context with MuJoCo's renderer, ground or sea, sky and lights.
//
// A picture is the mean of several passes. Each pass shifts the camera by a part of a pixel, the
// key light within a small cone and the sky light over the hemisphere, which gives smooth edges,
// soft shadows and darkened corners with a renderer that knows only hard ones.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/run_summary.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

struct StageOptions {
  int width = 1280, height = 960;
  int passes = 8;
  bool shadows = true;
  Vec3 centre_D = Vec3::Zero();  ///< middle of what is lit [m]
  double radius_m = 1.0;         ///< shadows are cast within this radius of the centre
  double ground_m = 0.0;         ///< height of the ground plane or the water
  bool sea = false;
  int most_items = 1000;                                ///< room for so many solids in one picture
  double grid_m = 0.1;                                  ///< spacing of the ground's grid lines
  std::optional<std::array<float, 3>> background = {};  ///< instead of sky and ground
  std::vector<std::shared_ptr<const TriangleMesh>> meshes = {};  ///< that items show
};

/// One character of the renderer's font as coverage 0 … 255.
struct Glyph {
  int width = 0, height = 0;
  std::vector<std::uint8_t> coverage;
};

class Stage {
 public:
  /// Fails with kEngineFailure when there is no off-screen context or MuJoCo reports an error.
  [[nodiscard]] static RunSummary Open(const StageOptions& options, std::unique_ptr<Stage>* stage);
  virtual ~Stage() = default;

  /// Draws the items and flat meshes (world frame) as seen by the camera.
  [[nodiscard]] virtual RunSummary Draw(const std::vector<Item>& items,
                                        const std::vector<FlatMesh>& flats, const Mat3& R_DW,
                                        const Camera& camera, Picture* picture) = 0;
  /// Glyphs of the characters 32 … 126.
  [[nodiscard]] virtual RunSummary Font(std::vector<Glyph>* glyphs) = 0;
};

}  // namespace mbv::render
