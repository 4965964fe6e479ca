// One pass over a picture: sky, ground, ghosts, solids and flat meshes, or their outlines.
#pragma once

#include <cstdint>
#include <vector>

#include "base/types.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/gl_objects.h"
#include "render/stage.h"

// The sea as a square tile that joins seamlessly.

namespace mbv::render {

/// size × size RGB: a sea with small waves.
[[nodiscard]] std::vector<std::uint8_t> WaterTexture(int size);

// The mean of several passes over a picture: the first ones everywhere, the others where those
// differ.

class Accumulation {
 public:
  Accumulation(int width, int height);

  /// Adds a pass, RGBA of the whole picture; in masked passes only what the mask shows.
  void Add(const std::vector<std::uint8_t>& rgba, bool masked);
  /// Closes the passes over everything: marks what differed between them by more than the smallest
  /// steps, and its neighbours. Returns how many pixels are marked.
  std::size_t Mark();
  /// Ends the passes; then there are means.
  void Close();
  /// 255 where a pixel is marked, 0 elsewhere.
  [[nodiscard]] const std::vector<std::uint8_t>& mask() const { return mask_; }
  /// The mean of a pixel's passes, rounded.
  [[nodiscard]] std::uint8_t Mean(std::size_t pixel, int channel) const;
  /// The mean colour, divided by the opacity by which the passes' colours are multiplied.
  [[nodiscard]] std::uint8_t Unmultiplied(std::size_t pixel, int channel) const;

 private:
  int width_, height_;
  std::uint32_t full_ = 0, masked_ = 0;  // passes
  std::vector<std::uint16_t> sum_;
  std::vector<std::uint8_t> low_, high_;  // over the passes over everything
  std::vector<std::uint8_t> mask_;
  std::vector<std::uint8_t> full_means_, all_means_;  // of sums
};

// Flat meshes, drawn over the solids into the same buffer.

class FlatPass {
 public:
  FlatPass();
  /// Sorts the meshes' triangles for this view, the farthest first.
  void Load(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const Projection& view);
  /// Draws them against what is already in the depth buffer.
  void Draw(const Projection& view) const;

 private:
  GlMesh mesh_;
  GlProgram program_;
  int hidden_ = 0, visible_ = 0;  // vertices: those that show through solids come first
};

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
