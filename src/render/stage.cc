#include "render/stage.h"

#include <GL/osmesa.h>
#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/flat_pass.h"
#include "render/stage_meshes.h"
#include "render/textures.h"
#include "simulation/engine.h"

namespace mbv::render {
namespace {

constexpr int kTexture_px = 1024;
// Light that falls on a surface facing each source; a level white floor gets about 1.
constexpr double kKey = 0.52, kSky = 0.14, kFill = 0.27, kAmbient = 0.35;
constexpr double kSun_deg = 2.5;  // width of the key light, which makes shadows soft

RunSummary Failure(const std::string& message) {
  RunSummary summary;
  summary.stop = Stop::kEngineFailure;
  summary.message = "pictures: " + message;
  return summary;
}

// The i-th point of a sequence that fills the unit square evenly (generalised golden ratio).
Eigen::Vector2d EvenPoint(int i) {
  const double a = 0.5 + 0.7548776662466927 * (i + 1), b = 0.5 + 0.5698402909980532 * (i + 1);
  return {a - std::floor(a), b - std::floor(b)};
}

// Sky, ground and lights as MJCF; the ground's texture is painted afterwards.
std::string StageMjcf(const StageOptions& o) {
  const double repeat = o.sea ? 0.35 / o.radius_m : 1.0 / (5.0 * o.grid_m);
  const std::string haze = o.sea ? "0.80 0.86 0.91 1" : "0.93 0.945 0.96 1";
  std::string zenith = o.sea ? "0.50 0.66 0.82" : "0.70 0.78 0.87";
  std::string horizon = o.sea ? "0.80 0.86 0.91" : "0.93 0.945 0.96";
  if (o.background) {
    const auto& rgb = *o.background;
    zenith = horizon = fmt::format("{:.9g} {:.9g} {:.9g}", rgb[0], rgb[1], rgb[2]);
  }
  const auto [assets, geoms] = MeshMjcf(o.meshes);
  return fmt::format(
      "<mujoco><compiler inertiafromgeom='false'/><statistic extent='{0:.9g}' center='0 0 0'/>"
      "<visual><global offwidth='{1}' offheight='{2}' fovy='{3}'/>"
      "<quality offsamples='0' shadowsize='2048' numslices='32' numstacks='16' numquads='2'/>"
      "<map znear='0.05' zfar='40' shadowclip='1.0' haze='0.35'/><rgba haze='{4}'/>"
      "<headlight active='0'/></visual>"
      "<asset><texture name='sky' type='skybox' builtin='gradient' rgb1='{5}' rgb2='{6}' "
      "width='256' height='1536'/>"
      "<texture name='ground' type='2d' builtin='flat' width='{7}' height='{7}'/>"
      "<material name='ground' texture='ground' texuniform='true' texrepeat='{8:.9g} {8:.9g}' "
      "reflectance='{9}' specular='{10}' shininess='0.7'/>{12}</asset>"
      "<worldbody>{13}<geom type='plane' size='0 0 1' pos='0 0 {11:.9g}' material='ground'/>"
      "</worldbody></mujoco>",
      o.radius_m, o.width, o.height, kFieldOfView_deg, haze, zenith, horizon, kTexture_px, repeat,
      o.sea ? 0.2 : 0.0, o.sea ? 0.5 : 0.1, o.ground_m, assets, geoms);
}

// Unit vector with an azimuth from x about z and a height above the horizon [deg].
Vec3 Direction(double azimuth_deg, double height_deg) {
  const double a = azimuth_deg * std::numbers::pi / 180.0;
  const double h = height_deg * std::numbers::pi / 180.0;
  return {std::cos(h) * std::cos(a), std::cos(h) * std::sin(a), std::sin(h)};
}

mjtGeom TypeOf(Solid solid) {
  switch (solid) {
    case Solid::kBall:
      return mjGEOM_SPHERE;
    case Solid::kCapsule:
      return mjGEOM_CAPSULE;
    case Solid::kCylinder:
      return mjGEOM_CYLINDER;
    case Solid::kBox:
      return mjGEOM_BOX;
    case Solid::kArrow:
      return mjGEOM_ARROW;
    case Solid::kMesh:
      return mjGEOM_MESH;
  }
  return mjGEOM_SPHERE;
}

class OsMesaStage final : public Stage {
 public:
  explicit OsMesaStage(const StageOptions& options) : options_(options) {}
  OsMesaStage(const OsMesaStage&) = delete;
  OsMesaStage& operator=(const OsMesaStage&) = delete;

  ~OsMesaStage() override {
    const simulation::EngineSession session(nullptr);
    if (context_made_) mjr_freeContext(&context_);
    if (scene_made_) mjv_freeScene(&scene_);
    if (mesa_ != nullptr) OSMesaDestroyContext(mesa_);
  }

  RunSummary Make() {
    mesa_ = OSMesaCreateContextExt(OSMESA_RGBA, 24, 8, 0, nullptr);
    if (mesa_ == nullptr ||
        OSMesaMakeCurrent(mesa_, window_.data(), GL_UNSIGNED_BYTE, kWindow_px, kWindow_px) == 0) {
      return Failure("OSMesa gives no off-screen context");
    }
    return Guarded([this] { return MakeInMujoco(); });
  }

  RunSummary Draw(const std::vector<Item>& items, const std::vector<FlatMesh>& flats,
                  const Mat3& R_DW, const Camera& camera, Picture* picture) override {
    return Guarded([&] { return DrawInMujoco(items, flats, R_DW, camera, picture); });
  }

  RunSummary Font(std::vector<Glyph>* glyphs) override {
    return Guarded([&] { return FontInMujoco(glyphs); });
  }

 private:
  static constexpr int kWindow_px = 64;  // OSMesa wants a window; everything goes into a buffer

  template <typename Work>
  static RunSummary Guarded(const Work& work) {
    const simulation::EngineSession session(nullptr);
    try {
      return work();
    } catch (const simulation::EngineError& error) {
      return Failure(std::string("MuJoCo: ") + error.what());
    }
  }

  RunSummary MakeInMujoco() {
    model_ = simulation::CompileMjcf(StageMjcf(options_));
    PaintGround();
    X_GM_ = MeshFrames(*model_, options_.meshes.size());
    data_ = simulation::MakeData(*model_);
    mj_forward(model_.get(), data_.get());
    mjv_defaultScene(&scene_);
    mjv_makeScene(model_.get(), &scene_, options_.most_items + kGroundGeoms);
    scene_made_ = true;
    mjr_defaultContext(&context_);
    context_made_ = true;
    mjr_makeContext(model_.get(), &context_, mjFONTSCALE_300);
    mjr_setBuffer(mjFB_OFFSCREEN, &context_);
    if (context_.currentBuffer != mjFB_OFFSCREEN) return Failure("no off-screen buffer");
    return RunSummary::Done();
  }

  void PaintGround() {
    const int texture = simulation::IdOf(*model_, mjOBJ_TEXTURE, "ground");
    const std::vector<std::uint8_t> rgb =
        options_.sea ? WaterTexture(kTexture_px) : GridTexture(kTexture_px);
    std::ranges::copy(rgb, model_->tex_rgb + model_->tex_adr[texture]);
  }

  // The ground comes from the model, everything else is appended.
  RunSummary FillScene(const std::vector<Item>& items, const Mat3& R_DW, const Camera& camera) {
    mjvOption show;
    mjv_defaultOption(&show);
    mjvCamera from;
    mjv_defaultCamera(&from);
    from.type = mjCAMERA_FREE;
    from.azimuth = camera.azimuth_deg + 180.0;
    from.elevation = -camera.elevation_deg;
    from.distance = camera.distance_m;
    std::copy_n(camera.lookat_D.data(), 3, from.lookat);
    // Twice: an endless plane is centred under the camera of the call before.
    for (int i = 0; i < 2; ++i) {
      mjv_updateScene(model_.get(), data_.get(), &show, nullptr, &from, mjCAT_ALL, &scene_);
    }
    // Seen from below, the ground would be a veil before everything.
    const bool plain = options_.background.has_value();
    if (plain || camera.position_D().z() < options_.ground_m) scene_.ngeom = 0;
    if (scene_.ngeom + static_cast<int>(items.size()) > scene_.maxgeom) {
      return Failure(
          fmt::format("{} solids are more than the {} that fit", items.size(), scene_.maxgeom));
    }
    for (const Item& item : items) {
      if (item.casts_shadow) AppendGeom(item, R_DW);
    }
    std::ranges::fill(scene_.flags, 0);
    scene_.flags[mjRND_SHADOW] = options_.shadows;
    scene_.flags[mjRND_REFLECTION] = options_.sea && !plain;
    scene_.flags[mjRND_SKYBOX] = 1;
    scene_.flags[mjRND_HAZE] = !plain;
    scene_.flags[mjRND_CULL_FACE] = 1;
    return RunSummary::Done();
  }

  // Index of an item's mesh in the model; -1: it has none.
  [[nodiscard]] int MeshOf(const Item& item) const {
    const auto at = std::ranges::find(options_.meshes, item.mesh);
    const bool known = item.mesh != nullptr && at != options_.meshes.end();
    return known ? static_cast<int>(at - options_.meshes.begin()) : -1;
  }

  void AppendGeom(const Item& item, const Mat3& R_DW) {
    mjvGeom& geom = scene_.geoms[scene_.ngeom++];
    const int mesh = MeshOf(item);
    const Pose X_WG = mesh < 0 ? item.X_WG : item.X_WG * X_GM_[mesh];
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> R = R_DW * X_WG.linear();
    const Vec3 p = R_DW * X_WG.translation();
    mjv_initGeom(&geom, TypeOf(item.solid), item.size.data(), p.data(), R.data(),
                 item.material.rgba.data());
    // mjv_initGeom changes the sizes of some types; ours are meant as they are.
    const Vec3& s = item.size;
    geom.size[0] = static_cast<float>(s.x());
    geom.size[1] = static_cast<float>(item.solid == Solid::kBall ? s.x() : s.y());
    geom.size[2] = static_cast<float>(item.solid == Solid::kBall ? s.x() : s.z());
    if (item.solid == Solid::kArrow) geom.size[2] *= 2.0F;  // arrows are drawn half as long
    if (mesh >= 0) {
      std::ranges::fill(geom.size, 1.0F);
      geom.dataid = 2 * mesh;  // the odd ones are convex hulls
    }
    geom.category = mjCAT_DYNAMIC;
    geom.specular = item.material.specular;
    geom.shininess = item.material.shininess;
    geom.emission = item.material.emission;
    geom.reflectance = 0.0F;
  }

  // Key light from behind the viewer's left shoulder, sky light from somewhere above, and a weak
  // fill light from the right that casts no shadow.
  void SetLights(const Camera& camera, int pass) {
    const Eigen::Vector2d u = EvenPoint(pass), w = EvenPoint(pass + 1000);
    const double spread = options_.passes > 1 ? 1.0 : 0.0;
    const Vec3 key = Direction(camera.azimuth_deg - 50.0 + spread * kSun_deg * (u.x() - 0.5),
                               52.0 + spread * kSun_deg * (u.y() - 0.5));
    // Cosine-weighted over the upper hemisphere, none below 48°.
    const double r = spread * std::sqrt(0.45 * w.x()), angle = 2.0 * std::numbers::pi * w.y();
    const Vec3 sky(r * std::cos(angle), r * std::sin(angle), std::sqrt(1.0 - r * r));
    const double fill_height = camera.elevation_deg < 0.0 ? 0.7 * camera.elevation_deg : 15.0;
    const Vec3 fill = Direction(camera.azimuth_deg + 50.0, fill_height);
    scene_.nlight = 3;
    SetLight(&scene_.lights[0], key, kKey, 0.35, 0.0, true);
    // Its shadows would be as many faint copies as there are passes.
    SetLight(&scene_.lights[1], sky, kSky, 0.0, 0.0, false);
    SetLight(&scene_.lights[2], fill, kFill, 0.1, kAmbient,
             false);  // a light with shadows has its ambient part shadowed, too
  }

  void SetLight(mjvLight* light, const Vec3& to_light_D, double diffuse, double specular,
                double ambient, bool shadow) const {
    *light = mjvLight{};
    const Vec3 p = options_.centre_D + 3.0 * options_.radius_m * to_light_D;
    for (int i = 0; i < 3; ++i) {
      light->pos[i] = static_cast<float>(p(i));
      light->dir[i] = static_cast<float>(-to_light_D(i));
      light->ambient[i] = static_cast<float>(ambient);
      light->diffuse[i] = static_cast<float>(diffuse);
      light->specular[i] = static_cast<float>(specular);
    }
    light->attenuation[0] = 1.0F;
    light->cutoff = 45.0F;
    light->directional = 1;
    light->castshadow = shadow;
  }

  RunSummary DrawInMujoco(const std::vector<Item>& items, const std::vector<FlatMesh>& flats,
                          const Mat3& R_DW, const Camera& camera, Picture* picture) {
    if (RunSummary filled = FillScene(items, R_DW, camera); !filled.ok()) return filled;
    std::vector<FlatMesh> meshes = flats;
    for (const Item& item : items) {
      if (!item.casts_shadow) meshes.push_back(MarkMesh(item));
    }
    const mjrRect view{0, 0, options_.width, options_.height};
    // Both eyes of the stereo pair alike.
    const mjvGLCamera centred = mjv_averageCamera(&scene_.camera[0], &scene_.camera[1]);
    const std::size_t bytes = 3UL * options_.width * options_.height;
    std::vector<std::uint8_t> pass_rgb(bytes);
    std::vector<std::uint32_t> sum(bytes, 0);
    for (int pass = 0; pass < options_.passes; ++pass) {
      // Shift by a part of a pixel.
      const double pixel = (centred.frustum_top - centred.frustum_bottom) / options_.height;
      const Eigen::Vector2d shift = options_.passes > 1
                                        ? Eigen::Vector2d(pixel * (EvenPoint(pass).array() - 0.5))
                                        : Eigen::Vector2d::Zero();
      mjvGLCamera shifted = centred;
      shifted.frustum_center += static_cast<float>(shift.x());
      shifted.frustum_bottom += static_cast<float>(shift.y());
      shifted.frustum_top += static_cast<float>(shift.y());
      scene_.camera[0] = scene_.camera[1] = shifted;
      SetLights(camera, pass);
      mjr_render(view, &scene_, &context_);
      DrawFlats(meshes, R_DW, {shifted, options_.width, options_.height});
      mjr_readPixels(pass_rgb.data(), nullptr, view, &context_);
      for (std::size_t i = 0; i < bytes; ++i) sum[i] += pass_rgb[i];
    }
    // Mean; OpenGL's rows start at the bottom.
    *picture = {.width = options_.width,
                .height = options_.height,
                .rgb = std::vector<std::uint8_t>(bytes)};
    const std::size_t row = 3UL * options_.width;
    const auto n = static_cast<std::uint32_t>(options_.passes);
    for (int y = 0; y < options_.height; ++y) {
      const std::uint32_t* from = sum.data() + row * (options_.height - 1 - y);
      std::uint8_t* to = picture->rgb.data() + row * y;
      for (std::size_t i = 0; i < row; ++i)
        to[i] = static_cast<std::uint8_t>((from[i] + n / 2) / n);
    }
    return RunSummary::Done();
  }

  // Writes each character alone into the lower left corner and reads it back.
  RunSummary FontInMujoco(std::vector<Glyph>* glyphs) {
    glyphs->assign(127, {});
    const int height = context_.charHeight;
    for (int c = 32; c < 127; ++c) {
      Glyph& glyph = (*glyphs)[c];
      glyph = {.width = context_.charWidth[c], .height = height, .coverage = {}};
      if (glyph.width > options_.width || height > options_.height) {
        return Failure("the picture is smaller than a character");
      }
      mjr_rectangle({0, 0, glyph.width, height}, 0, 0, 0, 1);
      const std::array<char, 2> text{static_cast<char>(c), '\0'};
      mjr_text(mjFONT_NORMAL, text.data(), &context_, 0, 0, 1, 1, 1);
      std::vector<std::uint8_t> rgb(3UL * glyph.width * height);
      mjr_readPixels(rgb.data(), nullptr, {0, 0, glyph.width, height}, &context_);
      glyph.coverage.resize(1UL * glyph.width * height);
      for (int y = 0; y < height; ++y) {
        for (int x = 0; x < glyph.width; ++x) {
          glyph.coverage[y * glyph.width + x] = rgb[3UL * ((height - 1 - y) * glyph.width + x)];
        }
      }
    }
    return RunSummary::Done();
  }

  static constexpr int kGroundGeoms = 8;  // what the stage itself puts into the scene

  StageOptions options_;
  std::array<std::uint8_t, 4UL * kWindow_px * kWindow_px> window_{};
  OSMesaContext mesa_ = nullptr;
  simulation::ModelHandle model_;
  simulation::DataHandle data_;
  std::vector<Pose> X_GM_;  // per mesh: MuJoCo's frame in ours
  mjvScene scene_{};
  mjrContext context_{};
  bool scene_made_ = false, context_made_ = false;
};

}  // namespace

RunSummary Stage::Open(const StageOptions& options, std::unique_ptr<Stage>* stage) {
  auto made = std::make_unique<OsMesaStage>(options);
  RunSummary summary = made->Make();
  if (summary.ok()) *stage = std::move(made);
  return summary;
}

}  // namespace mbv::render
