// The programs of the graphics pipeline (GLSL 3.30). Colours leave multiplied by their opacity.
#pragma once

namespace mbv::render {

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

}  // namespace mbv::render
