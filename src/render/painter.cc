#include "render/painter.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "base/demand.h"

namespace mbv::render {
namespace {

// The programs of the graphics pipeline (GLSL 3.30). Colours leave multiplied by their opacity.

// Light on solids and ground: a key light with shadows, a sky light from the upper hemisphere and
// a fill light. A level white floor gets about 1.
inline constexpr const char* kLightSource = R"(
uniform vec3 eye_D, to_viewer_D;  // the latter for parallel rays
uniform bool parallel;
uniform vec3 to_key_D, to_fill_D;
uniform mat4 shadow_D;            // D -> the shadow map's cube, 0 to 1
uniform sampler2DShadow shadow_map;
uniform bool shadows;
uniform float texel_m;
const float kKey = 0.52, kSky = 0.14, kFill = 0.27, kAmbient = 0.35;

float KeyLight(vec3 p_D, vec3 n) {  // 0 in the shadow, 1 in the light
  if (!shadows) return 1.0;
  vec4 q = shadow_D * vec4(p_D + 1.5 * texel_m * n, 1.0);
  return texture(shadow_map, q.xyz);
}

float SkyLight(vec3 n) {  // of the hemisphere around up, none from below 48 degrees
  float above = max(0.0, (n.z + 0.67) / 1.67);
  return 0.88 * above * above;
}

vec3 Lit(vec3 color, vec3 finish, vec3 p_D, vec3 n, bool in_shadows) {
  vec3 v = parallel ? to_viewer_D : normalize(eye_D - p_D);
  float key = max(dot(n, to_key_D), 0.0), fill = max(dot(n, to_fill_D), 0.0);
  float lit = in_shadows ? KeyLight(p_D, n) : 1.0;
  float gleam = max(dot(n, normalize(to_key_D + v)), 0.0);
  float shine = 0.35 * lit * step(0.0001, key) * pow(gleam, 128.0 * finish.y);
  float light = finish.z + kAmbient + kKey * lit * key + kSky * SkyLight(n) + kFill * fill;
  return clamp(color * light + finish.x * shine, 0.0, 1.0);
}
)";

inline constexpr const char* kSolidVertex = R"(
layout(location = 0) in vec3 position_D;
layout(location = 1) in vec3 normal_D;
layout(location = 2) in vec4 color;
layout(location = 3) in vec4 finish;  // specular, shininess, emission, number of the face
uniform mat4 clip_D;
uniform float mirror_m, mirrored;  // reflected at this height
out vec3 p, n;
out vec3 rgb;
flat out vec4 look;
void main() {
  p = position_D;
  n = normal_D;
  gl_ClipDistance[0] = mirrored > 0.0 ? position_D.z - mirror_m : 1.0;
  vec3 at = position_D;
  at.z += mirrored * 2.0 * (mirror_m - at.z);
  rgb = color.rgb;
  look = finish;
  gl_Position = clip_D * vec4(at, 1.0);
}
)";

inline constexpr const char* kSolidFragment = R"(
in vec3 p, n;
in vec3 rgb;
flat in vec4 look;
uniform bool two_sided, in_shadows;
uniform float opacity;
out vec4 pixel;
void main() {
  vec3 m = normalize(n);
  if (two_sided && dot(m, parallel ? to_viewer_D : eye_D - p) < 0.0) m = -m;
  pixel = opacity * vec4(Lit(rgb, look.xyz, p, m, in_shadows), 1.0);
}
)";

// For line art: the normal, the distance along the view and the number of the face.
inline constexpr const char* kSurfaceFragment = R"(
in vec3 p, n;
in vec3 rgb;
flat in vec4 look;
uniform vec3 eye_D, forward_D;
out vec4 pixel;
void main() {
  vec3 m = normalize(n);
  if (dot(m, eye_D - p) < 0.0) m = -m;
  pixel = vec4(m.xy + vec2(4.0) * step(m.z, 0.0), dot(p - eye_D, forward_D), look.w);
}
)";

inline constexpr const char* kDepthFragment = R"(
void main() {}
)";

// The whole picture: ray_D is the direction of view.
inline constexpr const char* kScreenVertex = R"(
uniform mat3 rays_D;
out vec3 ray_D;
void main() {
  vec2 at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  ray_D = rays_D * vec3(at, 1.0);
  gl_Position = vec4(at, 1.0, 1.0);
}
)";

inline constexpr const char* kSkyFragment = R"(
in vec3 ray_D;
uniform vec3 zenith, horizon;
out vec4 pixel;
void main() {
  float up = abs(normalize(ray_D).z);
  pixel = vec4(mix(horizon, zenith, up), 1.0);
}
)";

inline constexpr const char* kMaskFragment = R"(
uniform sampler2D mask;
out vec4 pixel;
void main() {
  if (texelFetch(mask, ivec2(gl_FragCoord.xy), 0).r < 0.5) discard;
  pixel = vec4(0.0);
}
)";

// Black where a neighbour is another face or another depth; white elsewhere.
inline constexpr const char* kEdgeFragment = R"(
uniform sampler2D surface;
uniform int reach;
uniform float gap_m;
uniform vec4 paper;
out vec4 pixel;
vec3 Normal(vec4 s) {
  float down = step(2.5, s.x);
  vec2 m = s.xy - vec2(4.0) * down;
  return vec3(m, (1.0 - 2.0 * down) * sqrt(max(0.0, 1.0 - dot(m, m))));
}
bool Differs(vec4 a, vec4 b) {  // the faces of a mesh have no numbers of their own
  return a.w != b.w || (a.w < 0.0 && dot(Normal(a), Normal(b)) < 0.75);
}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(surface, 0) - 1;
  vec4 here = texelFetch(surface, at, 0);
  bool edge = false;
  for (int k = 0; k < 4; ++k) {
    ivec2 step_px = (k == 0 ? ivec2(1, 0) : k == 1 ? ivec2(0, 1) : k == 2 ? ivec2(1, 1) : ivec2(1, -1));
    if (k > 1) step_px *= max(1, (2 * reach + 1) / 3); else step_px *= reach;
    vec4 a = texelFetch(surface, clamp(at + step_px, ivec2(0), last), 0);
    vec4 b = texelFetch(surface, clamp(at - step_px, ivec2(0), last), 0);
    edge = edge || Differs(here, a) || Differs(here, b) ||
           (here.w != 0.0 && abs(a.z + b.z - 2.0 * here.z) > gap_m);
  }
  pixel = edge ? vec4(0.0, 0.0, 0.0, 1.0) : here.w != 0.0 ? vec4(1.0) : paper;
}
)";

inline constexpr const char* kGroundVertex = R"(
layout(location = 0) in vec3 position_D;
uniform mat4 clip_D;
out vec3 p;
void main() {
  p = position_D;
  gl_Position = clip_D * vec4(position_D, 1.0);
}
)";

inline constexpr const char* kGroundFragment = R"(
in vec3 p;
uniform int kind;  // 0 grid, 1 water, 2 nothing but shadows
uniform float grid_m, repeat, haze_m;
uniform vec3 haze;
uniform vec2 shift_px;  // of the picture in this pass
uniform sampler2D water;
out vec4 pixel;

// Share of lines about whole numbers in [at - 0.5 wide, at + 0.5 wide].
float Lines(float at, float half_line, float wide) {
  float off = abs(at - floor(at + 0.5));
  float part = clamp(half_line + 0.5 * wide - off, 0.0, min(2.0 * half_line, wide));
  return wide < 1.0 ? part / wide : 2.0 * half_line;
}
float Dark(float at, float wide) {
  return max(0.09 * Lines(at, 0.01, wide), 0.16 * Lines(0.2 * at, 0.004, 0.2 * wide));
}

void main() {
  float key = kKey * to_key_D.z, others = kAmbient + 0.88 * kSky + kFill * max(to_fill_D.z, 0.0);
  // The pattern is smooth at this size already: that of the pixel's middle, in every pass.
  vec3 dx = dFdx(p), dy = dFdy(p), q = p + shift_px.x * dx + shift_px.y * dy;
  float lit = KeyLight(q, vec3(0.0, 0.0, 1.0));
  if (kind == 2) {
    pixel = vec4(0.0, 0.0, 0.0, key * (1.0 - lit) / (key + others));
    return;
  }
  vec3 color;
  if (kind == 1) {
    color = texture(water, repeat * q.xy).rgb;
  } else {
    vec2 at = q.xy / grid_m, wide = max((abs(dx.xy) + abs(dy.xy)) / grid_m, 1e-4);
    float dark = max(Dark(at.x, wide.x), Dark(at.y, wide.y));
    color = vec3(0.90, 0.91, 0.92) - dark * vec3(1.0, 1.0, 0.9);
  }
  color = min(color * (others + key * lit), 1.0);
  float far = smoothstep(0.65 * haze_m, haze_m, length(q - eye_D));
  float solid = kind == 1 ? 0.8 : 1.0;  // water mirrors the rest
  pixel = vec4(mix(color, haze, far), 1.0) * mix(solid, 1.0, far);
}
)";

inline constexpr const char* kFlatVertex = R"(
layout(location = 0) in vec3 position_D;
layout(location = 1) in vec4 color;
uniform mat4 clip_D;
flat out vec4 rgba;
void main() {
  rgba = vec4(color.rgb * color.a, color.a);
  gl_Position = clip_D * vec4(position_D, 1.0);
}
)";

inline constexpr const char* kFlatFragment = R"(
flat in vec4 rgba;
out vec4 pixel;
void main() { pixel = rgba; }
)";

}  // namespace
namespace {

void Put(std::vector<std::uint8_t>* rgb, std::size_t pixel, double r, double g, double b) {
  const double values[] = {r, g, b};
  for (int i = 0; i < 3; ++i) {
    (*rgb)[3 * pixel + i] = static_cast<std::uint8_t>(std::clamp(values[i], 0.0, 1.0) * 255.0);
  }
}

}  // namespace

std::vector<std::uint8_t> WaterTexture(int size) {
  // Waves of whole numbers of periods per tile, so that tiles join.
  struct Wave {
    int kx, ky;
    double phase, height;
  };
  const Wave waves[] = {{3, 1, 0.3, 0.9},   {-2, 4, 1.9, 0.8},   {6, -3, 4.0, 0.6},
                        {5, 7, 0.8, 0.5},   {-9, 4, 2.7, 0.45},  {11, 9, 5.1, 0.35},
                        {-7, 15, 3.3, 0.3}, {19, -8, 1.2, 0.25}, {-16, -21, 0.1, 0.2},
                        {27, 18, 2.2, 0.16}};
  std::vector<std::uint8_t> rgb(3UL * size * size);
  // Whole periods: a wave takes `size` values only.
  const double unit = 2.0 * std::numbers::pi / size;
  std::vector<std::vector<double>> heights;
  for (const Wave& wave : waves) {
    heights.emplace_back();
    for (int i = 0; i < size; ++i) {
      heights.back().push_back(wave.height * std::sin(unit * i + wave.phase));
    }
  }
  const auto place = [size](int at) { return static_cast<std::size_t>((at % size + size) % size); };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      double height = 0.0;
      for (std::size_t k = 0; k < heights.size(); ++k) {
        height += heights[k][place(waves[k].kx * x + waves[k].ky * y)];
      }
      // Crests are narrow and light, troughs broad and dark.
      const double crest = std::exp(0.75 * height - 1.2);
      const double light = std::min(0.035 * height + 0.10 * crest, 0.30);
      Put(&rgb, static_cast<std::size_t>(y) * size + x, 0.15 + light, 0.33 + light,
          0.44 + 0.95 * light);
    }
  }
  return rgb;
}

namespace {

constexpr int kEven = 8;  // steps of 255 by which passes may differ and the pixel be even
constexpr std::uint32_t kMostPasses = 65535 / 255;

}  // namespace

Accumulation::Accumulation(int width, int height)
    : width_(width),
      height_(height),
      sum_(4UL * width * height, 0),
      low_(sum_.size(), 255),
      high_(sum_.size(), 0) {}

void Accumulation::Add(const std::vector<std::uint8_t>& rgba, bool masked) {
  MBV_DEMAND(rgba.size() == sum_.size(), rgba.size());
  ++(masked ? masked_ : full_);
  MBV_DEMAND(full_ + masked_ <= kMostPasses, full_ + masked_);
  if (masked) {
    for (std::size_t pixel = 0; pixel < mask_.size(); ++pixel) {
      if (mask_[pixel] == 0) continue;
      for (std::size_t i = 4 * pixel; i < 4 * pixel + 4; ++i) sum_[i] += rgba[i];
    }
    return;
  }
  // Apart from each other, which the compiler cannot see.
  const std::uint8_t* __restrict from = rgba.data();
  std::uint16_t* __restrict sum = sum_.data();
  std::uint8_t* __restrict low = low_.data(), * __restrict high = high_.data();
  for (std::size_t i = 0, count = rgba.size(); i < count; ++i) {
    sum[i] = static_cast<std::uint16_t>(sum[i] + from[i]);
    low[i] = std::min(low[i], from[i]);
    high[i] = std::max(high[i], from[i]);
  }
}

std::size_t Accumulation::Mark() {
  mask_.assign(sum_.size() / 4, 0);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const std::size_t pixel = static_cast<std::size_t>(y) * width_ + x;
      int most = 0;
      for (std::size_t i = 4 * pixel; i < 4 * pixel + 4; ++i)
        most = std::max(most, high_[i] - low_[i]);
      if (most <= kEven) continue;
      for (int v = std::max(0, y - 1); v <= std::min(height_ - 1, y + 1); ++v) {
        for (int u = std::max(0, x - 1); u <= std::min(width_ - 1, x + 1); ++u) {
          mask_[static_cast<std::size_t>(v) * width_ + u] = 255;
        }
      }
    }
  }
  return static_cast<std::size_t>(std::ranges::count(mask_, 255));
}

void Accumulation::Close() {
  const auto means = [](std::uint32_t n) {
    std::vector<std::uint8_t> out(255 * n + 1);
    for (std::uint32_t sum = 0; sum < out.size(); ++sum) {
      out[sum] = static_cast<std::uint8_t>((sum + n / 2) / n);
    }
    return out;
  };
  full_means_ = means(full_);
  all_means_ = means(full_ + masked_);
}

std::uint8_t Accumulation::Mean(std::size_t pixel, int channel) const {
  const bool marked = !mask_.empty() && mask_.data()[pixel] != 0;
  return (marked ? all_means_ : full_means_).data()[sum_.data()[4 * pixel + channel]];
}

std::uint8_t Accumulation::Unmultiplied(std::size_t pixel, int channel) const {
  const std::uint32_t alpha = sum_[4 * pixel + 3];
  if (alpha == 0) return 0;
  const std::uint32_t color = (255U * sum_[4 * pixel + channel] + alpha / 2) / alpha;
  return static_cast<std::uint8_t>(std::min(color, 255U));
}

namespace {

struct Triangle {
  std::array<Vec3, 3> p_D;
  double depth = 0.0;
  std::array<float, 4> rgba{};
};

// Light on a surface that is lit from the viewer and from above, either side alike.
float LightOn(const Vec3& normal, const Vec3& to_surface) {
  const Vec3 n = normal.norm() > 0.0 ? Vec3(normal.normalized()) : Vec3::UnitZ();
  return static_cast<float>(0.45 + 0.35 * std::abs(n.dot(to_surface.normalized())) +
                            0.25 * std::abs(n.z()));
}

std::vector<Triangle> SortedTriangles(const std::vector<FlatMesh>& meshes, FlatMesh::Depth depth,
                                      const Mat3& R_DW, const Projection& view) {
  std::vector<Triangle> triangles;
  for (const FlatMesh& mesh : meshes) {
    if (mesh.depth != depth) continue;
    for (const auto& corner : mesh.triangles) {
      Triangle triangle{.p_D = {}, .depth = 0.0, .rgba = mesh.rgba};
      for (int i = 0; i < 3; ++i) triangle.p_D[i] = R_DW * mesh.vertices_W[corner[i]];
      const Vec3 centre = (triangle.p_D[0] + triangle.p_D[1] + triangle.p_D[2]) / 3.0;
      triangle.depth = (centre - view.eye_D).dot(view.forward_D);
      if (mesh.shaded) {
        const Vec3 normal =
            (triangle.p_D[1] - triangle.p_D[0]).cross(triangle.p_D[2] - triangle.p_D[0]);
        const float light =
            LightOn(normal, view.parallel ? view.forward_D : Vec3(centre - view.eye_D));
        for (int i = 0; i < 3; ++i) triangle.rgba[i] = std::min(1.0F, triangle.rgba[i] * light);
      }
      triangles.push_back(triangle);
    }
  }
  std::ranges::stable_sort(triangles, std::ranges::greater{}, &Triangle::depth);
  return triangles;
}

struct FlatVertex {
  std::array<float, 3> position;
  std::array<float, 4> rgba;
};

int Append(const std::vector<Triangle>& triangles, std::vector<FlatVertex>* vertices) {
  for (const Triangle& triangle : triangles) {
    for (const Vec3& p : triangle.p_D) {
      vertices->push_back(
          {{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())},
           triangle.rgba});
    }
  }
  return static_cast<int>(3 * triangles.size());
}

}  // namespace

FlatPass::FlatPass() : program_(kFlatVertex, kFlatFragment) {}

void FlatPass::Load(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const Projection& view) {
  std::vector<FlatVertex> vertices;
  hidden_ = Append(SortedTriangles(meshes, FlatMesh::Depth::kHidden, R_DW, view), &vertices);
  visible_ = Append(SortedTriangles(meshes, FlatMesh::Depth::kVisible, R_DW, view), &vertices);
  mesh_.Fill(vertices.data(), vertices.size() * sizeof(FlatVertex));
  mesh_.Attribute(0, 3, GL_FLOAT, sizeof(FlatVertex), offsetof(FlatVertex, position));
  mesh_.Attribute(1, 4, GL_FLOAT, sizeof(FlatVertex), offsetof(FlatVertex, rgba));
}

void FlatPass::Draw(const Projection& view) const {
  if (hidden_ + visible_ == 0) return;
  mesh_.Bind();
  program_.Use();
  program_.Set("clip_D", view.clip_D);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glDepthFunc(GL_GREATER);
  glDrawArrays(GL_TRIANGLES, 0, hidden_);
  glDepthFunc(GL_LEQUAL);
  glDrawArrays(GL_TRIANGLES, hidden_, visible_);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

namespace {

constexpr int kTexture_px = 1024, kShadowMap_px = 1024;
constexpr double kSun_deg = 1.2;       // width of the key light, which makes shadows soft: so much
                                       // that those of thin rods do not part into lines
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
