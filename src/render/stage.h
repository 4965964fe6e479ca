// The off-screen stage: an OSMesa context that draws solids on the ground or the sea, under a sky.
//
// A picture is the mean of several passes. Each pass shifts the camera by a part of a pixel and the
// key light within a small cone, which gives smooth edges and soft shadows. The first passes draw
// everything, the others only where those differ: along edges. A picture larger than a tile is
// drawn tile by tile.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

enum class Ground { kGrid, kSea, kShadowsAlone, kNone };

struct StageOptions {
  int width = 1280, height = 960;
  int passes = 8;
  bool shadows = true;
  bool line_art = false;         ///< black outlines on white solids
  Vec3 centre_D = Vec3::Zero();  ///< middle of what is lit [m]
  double radius_m = 1.0;         ///< shadows are cast within this radius of the centre
  Ground ground = Ground::kGrid;
  double ground_m = 0.0;  ///< height of the ground plane or the water
  double grid_m = 0.1;    ///< spacing of the ground's grid lines
  /// Red, green, blue, opacity instead of a sky.
  std::optional<std::array<float, 4>> background = {};
  std::vector<std::shared_ptr<const TriangleMesh>> meshes = {};  ///< that items show
  int tile_px = 2048;  ///< largest side of what is drawn at once
};

/// What one picture shows, in the world frame.
struct StageContent {
  std::vector<Item> items = {};
  std::vector<FlatMesh> flats = {};
  std::vector<std::vector<Item>> ghosts = {};  ///< pale, behind the items, the first ones farthest
};

class Stage {
 public:
  /// Fails with kEngineFailure when there is no off-screen context.
  [[nodiscard]] static RunSummary Open(const StageOptions& options, std::unique_ptr<Stage>* stage);
  virtual ~Stage() = default;

  /// Draws the content as seen by the camera; with opacities if the background has one.
  [[nodiscard]] virtual RunSummary Draw(const StageContent& content, const Mat3& R_DW,
                                        const Camera& camera, Picture* picture) = 0;
};

// What all pictures of one call share: orientation, sizes, camera, ground and legend.

struct Arrangement {
  Mat3 R_DW = Mat3::Identity();
  Scale scale;
  Camera camera;
  StageOptions stage;
  Vec3 forward_W = Vec3::UnitX();  ///< the camera's direction of view
};

/// Camera, ground and stage that suit all frames together.
[[nodiscard]] Arrangement Arrange(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Overlay& overlay,
                                  const PictureOptions& options);
/// What the marks in the pictures mean.
[[nodiscard]] std::vector<LegendEntry> LegendOf(const Mechanism& mechanism,
                                                const Arrangement& arrangement,
                                                const Overlay& overlay,
                                                const PictureOptions& options);

}  // namespace mbv::render
