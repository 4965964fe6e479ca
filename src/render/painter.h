// One pass over a picture: sky, ground, ghosts, solids and flat meshes, or their outlines.
#pragma once

#include <vector>

#include "render/flat_pass.h"
#include "render/gl_objects.h"
#include "render/projection.h"
#include "render/solid_buffer.h"
#include "render/stage.h"

namespace mbv::render {

/// Half the width of an outline [px].
[[nodiscard]] int OutlineReach(int height_px);

class Painter {
 public:
  /// A context must be current as long as it lives.
  explicit Painter(const StageOptions& options);
  ~Painter();
  Painter(const Painter&) = delete;
  Painter& operator=(const Painter&) = delete;

  void Load(const StageContent& content, const Mat3& R_DW, const Camera& camera);
  /// Shadows of the key light, turned by parts of its width (−0.5 … 0.5 each).
  void CastShadows(const Eigen::Vector2d& turn);
  /// Paints into the target; false if there is no buffer of this size.
  [[nodiscard]] bool Paint(const Projection& view, const Tile& tile, const GlFrame& target);
  /// Sets the target's stencil where the mask (a byte per pixel) is not 0.
  void MaskWith(const std::vector<std::uint8_t>& mask, const Tile& tile, const GlFrame& target);

 private:
  void SetLight(const GlProgram& program, const Projection& view) const;
  void PaintShaded(const Projection& view);
  void PaintSky(const Projection& view);
  void PaintGround(const Projection& view);
  void PaintGhosts(const Projection& view);
  void PaintSolids(const Projection& view, const SolidRanges& ranges, double opacity,
                   bool mirrored);
  void PaintRanges(const GlProgram& program, const SolidRanges& ranges, bool mirrored) const;
  [[nodiscard]] bool PaintOutlines(const Projection& view, const Tile& tile, const GlFrame& target);
  void FillScreen(const GlProgram& program) const;

  StageOptions options_;
  DrawnMeshes meshes_;
  GlProgram solid_, depth_, surface_, sky_, ground_, mask_, edge_;
  GlFrame shadow_map_{0, GlFrame::Depth::kShadowMap};
  GlFrame surfaces_{GL_RGBA32F, GlFrame::Depth::kBuffer};
  GlMesh solids_, plane_, screen_;
  FlatPass flats_;
  GLuint water_ = 0, mask_texture_ = 0;
  SolidRanges now_;
  std::vector<SolidRanges> ghosts_;
  Eigen::Matrix4d shadow_D_ = Eigen::Matrix4d::Identity();
  Vec3 to_key_D_ = Vec3::UnitZ(), to_fill_D_ = Vec3::UnitZ();
  double azimuth_deg_ = 0.0;
  bool ground_seen_ = true;
};

}  // namespace mbv::render
