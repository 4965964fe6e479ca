#include "render/painter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/shaders.h"
#include "render/textures.h"

namespace mbv::render {
namespace {

constexpr int kTexture_px = 1024, kShadowMap_px = 1024;
constexpr double kSun_deg = 2.5;       // width of the key light, which makes shadows soft
constexpr double kGhostOpacity = 0.3;  // opacity of an earlier instant
constexpr double kHaze = 40.0;         // radii from which the ground is all haze
constexpr int kShadowUnit = 0, kOtherUnit = 1;

const std::string kLit = kLightSource;

// Unit vector with an azimuth from x about z and a height above the horizon [deg].
Vec3 Direction(double azimuth_deg, double height_deg) {
  const double a = azimuth_deg * std::numbers::pi / 180.0;
  const double h = height_deg * std::numbers::pi / 180.0;
  return {std::cos(h) * std::cos(a), std::cos(h) * std::sin(a), std::sin(h)};
}

// From behind the viewer's left shoulder.
Vec3 KeyDirection(double azimuth_deg, const Eigen::Vector2d& turn) {
  return Direction(azimuth_deg - 50.0 + kSun_deg * turn.x(), 52.0 + kSun_deg * turn.y());
}

GLuint WaterTextureObject() {
  const std::vector<std::uint8_t> rgb = WaterTexture(kTexture_px);
  GLuint texture = 0;
  glGenTextures(1, &texture);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, kTexture_px, kTexture_px, 0, GL_RGB, GL_UNSIGNED_BYTE,
               rgb.data());
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  return texture;
}

void DrawRange(const IndexRange& range) {
  if (range.count == 0) return;
  const auto offset = sizeof(std::uint32_t) * static_cast<std::size_t>(range.first);
  glDrawElements(GL_TRIANGLES, range.count, GL_UNSIGNED_INT, reinterpret_cast<void*>(offset));
}

}  // namespace

int OutlineReach(int height_px) { return std::max(1, (height_px + 480) / 960); }

Painter::Painter(const StageOptions& options)
    : options_(options),
      meshes_(DrawnMeshesOf(options.meshes)),
      solid_(kSolidVertex, kLit + kSolidFragment),
      depth_(kSolidVertex, kDepthFragment),
      surface_(kSolidVertex, kSurfaceFragment),
      sky_(kScreenVertex, kSkyFragment),
      ground_(kGroundVertex, kLit + kGroundFragment),
      mask_(kScreenVertex, kMaskFragment),
      edge_(kScreenVertex, kEdgeFragment) {
  if (options_.ground == Ground::kSea) water_ = WaterTextureObject();
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glCullFace(GL_BACK);
}

Painter::~Painter() {
  glDeleteTextures(1, &water_);
  glDeleteTextures(1, &mask_texture_);
}

void Painter::Load(const StageContent& content, const Mat3& R_DW, const Camera& camera) {
  SolidBuffer buffer(meshes_, camera, R_DW, options_.height);
  now_ = buffer.Add(content.items);
  ghosts_.clear();
  for (const std::vector<Item>& ghost : content.ghosts) ghosts_.push_back(buffer.Add(ghost));
  buffer.Upload(&solids_);
  const Tile whole{.width = options_.width, .height = options_.height};
  const Projection view = ProjectionOf(camera, options_.width, options_.height, whole,
                                       options_.radius_m, Eigen::Vector2d::Zero());
  flats_.Load(content.flats, R_DW, view);
  azimuth_deg_ = camera.azimuth_deg;
  to_key_D_ = KeyDirection(azimuth_deg_, Eigen::Vector2d::Zero());
  const double low = camera.elevation_deg < 0.0 ? 0.7 * camera.elevation_deg : 15.0;
  to_fill_D_ = Direction(azimuth_deg_ + 50.0, low);
  // Seen from below, the ground would be a veil before everything.
  ground_seen_ = options_.ground != Ground::kNone && camera.position_D().z() >= options_.ground_m;
  const double reach = 2.0 * kHaze * options_.radius_m + camera.distance_m;
  std::vector<float> corners;
  for (const auto& [x, y] : {std::pair(-1, -1), {1, -1}, {-1, 1}, {1, 1}}) {
    corners.push_back(static_cast<float>(camera.lookat_D.x() + x * reach));
    corners.push_back(static_cast<float>(camera.lookat_D.y() + y * reach));
    corners.push_back(static_cast<float>(options_.ground_m));
  }
  plane_.Fill(corners.data(), corners.size() * sizeof(float));
  plane_.Attribute(0, 3, GL_FLOAT, 3 * sizeof(float), 0);
}

void Painter::CastShadows(const Eigen::Vector2d& turn) {
  if (!options_.shadows || options_.line_art) return;
  const Vec3 to_light = KeyDirection(azimuth_deg_, turn);
  Eigen::Matrix4d light_D = Eigen::Matrix4d::Identity();
  light_D.block<3, 3>(0, 0) = FrameAlong(to_light).transpose() / options_.radius_m;
  light_D.block<3, 1>(0, 3) = -light_D.block<3, 3>(0, 0) * options_.centre_D;
  // From two radii before the centre to six behind it, where ground may be.
  Eigen::Matrix4d clip = Eigen::Matrix4d::Identity();
  clip(2, 2) = -0.25;
  clip(2, 3) = -0.5;
  clip = clip * light_D;
  Eigen::Matrix4d half = 0.5 * Eigen::Matrix4d::Identity();
  half.col(3) << 0.5, 0.5, 0.5, 1.0;
  shadow_D_ = half * clip;
  if (!shadow_map_.Resize(kShadowMap_px, kShadowMap_px)) return;
  shadow_map_.Bind();
  glDisable(GL_STENCIL_TEST);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glClear(GL_DEPTH_BUFFER_BIT);
  glDisable(GL_CULL_FACE);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.1F, 2.0F);
  solids_.Bind();
  depth_.Use();
  depth_.Set("clip_D", clip);
  depth_.Set("mirrored", 0.0);
  DrawRange(now_.primitives);
  DrawRange(now_.meshes);
  glDisable(GL_POLYGON_OFFSET_FILL);
}

void Painter::SetLight(const GlProgram& program, const Projection& view) const {
  program.Use();
  glActiveTexture(GL_TEXTURE0 + kShadowUnit);
  glBindTexture(GL_TEXTURE_2D, options_.shadows ? shadow_map_.depth() : 0);
  program.Set("shadow_map", kShadowUnit);
  program.Set("shadows", options_.shadows ? 1 : 0);
  program.Set("shadow_D", shadow_D_);
  program.Set("texel_m", 2.0 * options_.radius_m / kShadowMap_px);
  program.Set("clip_D", view.clip_D);
  program.Set("eye_D", view.eye_D);
  program.Set("to_viewer_D", Vec3(-view.forward_D));
  program.Set("parallel", view.parallel ? 1 : 0);
  program.Set("to_key_D", to_key_D_);
  program.Set("to_fill_D", to_fill_D_);
}

bool Painter::Paint(const Projection& view, const Tile& tile, const GlFrame& target) {
  if (options_.line_art) return PaintOutlines(view, tile, target);
  target.Bind();
  const auto background = options_.background.value_or(std::array<float, 4>{});
  glClearColor(background[0] * background[3], background[1] * background[3],
               background[2] * background[3], background[3]);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  PaintShaded(view);
  flats_.Draw(view);
  return true;
}

// The nearest first, which hides the rest; ghosts are blended over ground and sky.
void Painter::PaintShaded(const Projection& view) {
  const bool far_first = !ghosts_.empty();
  if (!far_first) PaintSolids(view, now_, 1.0, false);
  if (options_.ground == Ground::kSea && ground_seen_) PaintSolids(view, now_, 1.0, true);
  PaintGround(view);
  PaintSky(view);
  if (!far_first) return;
  PaintGhosts(view);
  PaintSolids(view, now_, 1.0, false);
}

void Painter::PaintSky(const Projection& view) {
  if (options_.background) return;
  const bool sea = options_.ground == Ground::kSea;
  sky_.Use();
  sky_.Set("rays_D", view.rays_D);
  sky_.Set("zenith", sea ? Vec3(0.50, 0.66, 0.82) : Vec3(0.70, 0.78, 0.87));
  sky_.Set("horizon", sea ? Vec3(0.80, 0.86, 0.91) : Vec3(0.93, 0.945, 0.96));
  FillScreen(sky_);
}

void Painter::PaintGround(const Projection& view) {
  if (!ground_seen_) return;
  const bool alone = options_.ground == Ground::kShadowsAlone;
  if (alone && !options_.shadows) return;
  const bool sea = options_.ground == Ground::kSea;
  SetLight(ground_, view);
  ground_.Set("kind", alone ? 2 : sea ? 1 : 0);
  ground_.Set("shift_px", view.shift_px);
  ground_.Set("grid_m", options_.grid_m);
  ground_.Set("repeat", 0.35 / options_.radius_m);
  ground_.Set("haze_m", kHaze * options_.radius_m);
  ground_.Set("haze", sea ? Vec3(0.80, 0.86, 0.91) : Vec3(0.93, 0.945, 0.96));
  glActiveTexture(GL_TEXTURE0 + kOtherUnit);
  glBindTexture(GL_TEXTURE_2D, water_);
  ground_.Set("water", kOtherUnit);
  glDisable(GL_CULL_FACE);
  if (alone || sea) glEnable(GL_BLEND);
  plane_.Bind();
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glDisable(GL_BLEND);
}

// Each ghost evenly pale: its nearest faces alone, found before.
void Painter::PaintGhosts(const Projection& view) {
  for (const SolidRanges& ghost : ghosts_) {
    glClear(GL_DEPTH_BUFFER_BIT);
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    PaintSolids(view, ghost, 1.0, false);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glEnable(GL_BLEND);
    PaintSolids(view, ghost, kGhostOpacity, false);
    glDisable(GL_BLEND);
  }
  if (!ghosts_.empty()) glClear(GL_DEPTH_BUFFER_BIT);
}

void Painter::PaintSolids(const Projection& view, const SolidRanges& ranges, double opacity,
                          bool mirrored) {
  SetLight(solid_, view);
  solid_.Set("opacity", opacity);
  solid_.Set("in_shadows", opacity < 1.0 ? 0 : 1);
  solid_.Set("mirror_m", options_.ground_m);
  PaintRanges(solid_, ranges, mirrored);
}

void Painter::PaintRanges(const GlProgram& program, const SolidRanges& ranges,
                          bool mirrored) const {
  solids_.Bind();
  program.Set("mirrored", mirrored ? 1.0 : 0.0);
  glFrontFace(mirrored ? GL_CW : GL_CCW);
  if (mirrored) glEnable(GL_CLIP_DISTANCE0);
  glEnable(GL_CULL_FACE);
  program.Set("two_sided", 0);
  DrawRange(ranges.primitives);
  // Files may turn their triangles inside out.
  glDisable(GL_CULL_FACE);
  program.Set("two_sided", 1);
  DrawRange(ranges.meshes);
  glEnable(GL_CULL_FACE);
  program.Set("two_sided", 0);
  program.Set("in_shadows", 0);
  DrawRange(ranges.marks);
  glFrontFace(GL_CCW);
  glDisable(GL_CLIP_DISTANCE0);
}

bool Painter::PaintOutlines(const Projection& view, const Tile& tile, const GlFrame& target) {
  if (!surfaces_.Resize(tile.width, tile.height)) return false;
  const GLboolean masked = glIsEnabled(GL_STENCIL_TEST);
  surfaces_.Bind();
  glDisable(GL_STENCIL_TEST);
  glClearColor(0.0F, 0.0F, 0.0F, 0.0F);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  surface_.Use();
  surface_.Set("clip_D", view.clip_D);
  surface_.Set("eye_D", view.eye_D);
  surface_.Set("forward_D", view.forward_D);
  PaintRanges(surface_, now_, false);
  for (const SolidRanges& ghost : ghosts_) PaintRanges(surface_, ghost, false);
  target.Bind();
  if (masked == GL_TRUE) glEnable(GL_STENCIL_TEST);
  const auto paper = options_.background.value_or(std::array<float, 4>{1.0F, 1.0F, 1.0F, 1.0F});
  edge_.Use();
  glActiveTexture(GL_TEXTURE0 + kOtherUnit);
  glBindTexture(GL_TEXTURE_2D, surfaces_.color());
  edge_.Set("surface", kOtherUnit);
  edge_.Set("reach", OutlineReach(options_.height));
  edge_.Set("gap_m", 0.02 * options_.radius_m);
  edge_.Set("paper", Eigen::Vector4d(paper[0] * paper[3], paper[1] * paper[3], paper[2] * paper[3],
                                     paper[3]));
  glDisable(GL_DEPTH_TEST);
  FillScreen(edge_);
  return true;
}

void Painter::FillScreen(const GlProgram& program) const {
  program.Use();
  glDisable(GL_CULL_FACE);
  screen_.Bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void Painter::MaskWith(const std::vector<std::uint8_t>& mask, const Tile& tile,
                       const GlFrame& target) {
  if (mask_texture_ == 0) glGenTextures(1, &mask_texture_);
  glActiveTexture(GL_TEXTURE0 + kOtherUnit);
  glBindTexture(GL_TEXTURE_2D, mask_texture_);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, tile.width, tile.height, 0, GL_RED, GL_UNSIGNED_BYTE,
               mask.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  target.Bind();
  glDisable(GL_DEPTH_TEST);
  glClearStencil(0);
  glClear(GL_STENCIL_BUFFER_BIT);
  glEnable(GL_STENCIL_TEST);
  glStencilFunc(GL_ALWAYS, 1, 255);
  glStencilOp(GL_KEEP, GL_KEEP, GL_REPLACE);
  mask_.Use();
  mask_.Set("mask", kOtherUnit);
  FillScreen(mask_);
  glStencilFunc(GL_EQUAL, 1, 255);
  glStencilOp(GL_KEEP, GL_KEEP, GL_KEEP);
}

}  // namespace mbv::render
