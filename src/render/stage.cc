#include "render/stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/painter.h"

namespace mbv::render {
namespace {

constexpr int kFullPasses = 3;  // over everything
constexpr int kFirstPoint = 364;
constexpr int kApron_px = 2;  // around a tile, so that its marks are those of the whole picture

RunSummary Failure(const std::string& message) {
  RunSummary summary;
  summary.stop = Stop::kEngineFailure;
  summary.message = "pictures: " + message;
  return summary;
}

// The i-th point of a sequence that fills the square −0.5 … 0.5 evenly (generalised golden ratio).
// It starts where the first three lie far apart, so that they show what is uneven.
Eigen::Vector2d EvenPoint(int i) {
  const int k = i + kFirstPoint;
  const double a = 0.5 + 0.7548776662466927 * k, b = 0.5 + 0.5698402909980532 * k;
  return {a - std::floor(a) - 0.5, b - std::floor(b) - 0.5};
}

class OsMesaStage final : public Stage {
 public:
  explicit OsMesaStage(const StageOptions& options) : options_(options) {}
  OsMesaStage(const OsMesaStage&) = delete;
  OsMesaStage& operator=(const OsMesaStage&) = delete;

  ~OsMesaStage() override {
    if (mesa_ == nullptr) return;
    if (MakeCurrent()) {
      painter_.reset();
      frame_.reset();
    }
    OSMesaDestroyContext(mesa_);
  }

  RunSummary Make() {
    if (const std::string trouble = LoadGl(); !trouble.empty()) return Failure(trouble);
    const std::array<int, 11> wanted = {OSMESA_FORMAT,
                                        OSMESA_RGBA,
                                        OSMESA_DEPTH_BITS,
                                        24,
                                        OSMESA_PROFILE,
                                        OSMESA_CORE_PROFILE,
                                        OSMESA_CONTEXT_MAJOR_VERSION,
                                        3,
                                        OSMESA_CONTEXT_MINOR_VERSION,
                                        3,
                                        0};
    mesa_ = OSMesaCreateContextAttribs(wanted.data(), nullptr);
    if (mesa_ == nullptr || !MakeCurrent()) return Failure("OSMesa gives no off-screen context");
    painter_ = std::make_unique<Painter>(options_);
    frame_ = std::make_unique<GlFrame>(GL_RGBA8, GlFrame::Depth::kBufferAndStencil);
    return RunSummary::Done();
  }

  RunSummary Draw(const StageContent& content, const Mat3& R_DW, const Camera& camera,
                  Picture* picture) override {
    if (!MakeCurrent()) return Failure("OSMesa lost its context");
    painter_->Load(content, R_DW, camera);
    const auto pixels = static_cast<std::size_t>(options_.width) * options_.height;
    *picture = {.width = options_.width, .height = options_.height};
    picture->rgb.resize(3 * pixels);
    if (options_.background && (*options_.background)[3] < 1.0F) picture->alpha.resize(pixels);
    for (int top = 0; top < options_.height; top += options_.tile_px) {
      for (int left = 0; left < options_.width; left += options_.tile_px) {
        const Tile inner{left, top, std::min(options_.tile_px, options_.width - left),
                         std::min(options_.tile_px, options_.height - top)};
        if (!DrawTile(inner, camera, picture)) return Failure("no off-screen buffer");
      }
    }
    const GLenum trouble = glGetError();
    return trouble == GL_NO_ERROR ? RunSummary::Done()
                                  : Failure(fmt::format("OpenGL error {:#x}", trouble));
  }

 private:
  static constexpr int kWindow_px = 64;  // OSMesa wants a window; everything goes into a buffer

  [[nodiscard]] bool MakeCurrent() {
    return OSMesaMakeCurrent(mesa_, window_.data(), GL_UNSIGNED_BYTE, kWindow_px, kWindow_px) !=
           GL_FALSE;
  }

  // With its apron, as far as the picture goes.
  [[nodiscard]] Tile WithApron(const Tile& inner) const {
    const int apron = kApron_px + (options_.line_art ? OutlineReach(options_.height) : 0);
    const int left = std::max(0, inner.left - apron), top = std::max(0, inner.top - apron);
    const int right = std::min(options_.width, inner.left + inner.width + apron);
    const int bottom = std::min(options_.height, inner.top + inner.height + apron);
    return {left, top, right - left, bottom - top};
  }

  [[nodiscard]] bool DrawTile(const Tile& inner, const Camera& camera, Picture* picture) {
    const Tile tile = WithApron(inner);
    if (!frame_->Resize(tile.width, tile.height)) return false;
    Accumulation sum(tile.width, tile.height);
    std::vector<std::uint8_t> rgba(4UL * tile.width * tile.height);
    for (int pass = 0; pass < options_.passes; ++pass) {
      const bool masked = pass >= kFullPasses;
      if (pass == kFullPasses) {
        if (sum.Mark() == 0) break;
        painter_->MaskWith(sum.mask(), tile, *frame_);
      }
      const Eigen::Vector2d shift =
          options_.passes > 1 ? EvenPoint(pass) : Eigen::Vector2d(Eigen::Vector2d::Zero());
      const Projection view =
          ProjectionOf(camera, options_.width, options_.height, tile, options_.radius_m, shift);
      painter_->CastShadows(shift);
      if (masked) glEnable(GL_STENCIL_TEST);
      if (!painter_->Paint(view, tile, *frame_)) return false;
      glReadPixels(0, 0, tile.width, tile.height, GL_RGBA, GL_UNSIGNED_BYTE, rgba.data());
      sum.Add(rgba, masked);
    }
    glDisable(GL_STENCIL_TEST);
    sum.Close();
    CopyOut(sum, inner, tile, picture);
    return true;
  }

  // OpenGL's rows start at the bottom.
  static void CopyOut(const Accumulation& sum, const Tile& inner, const Tile& tile,
                      Picture* picture) {
    std::uint8_t* rgb = picture->rgb.data();
    const bool opaque = picture->alpha.empty();
    for (int y = inner.top; y < inner.top + inner.height; ++y) {
      const auto row = static_cast<std::size_t>(tile.height - 1 - (y - tile.top)) * tile.width;
      for (int x = inner.left; x < inner.left + inner.width; ++x) {
        const std::size_t from = row + (x - tile.left);
        const std::size_t to = static_cast<std::size_t>(y) * picture->width + x;
        for (int i = 0; i < 3; ++i) {
          rgb[3 * to + i] = opaque ? sum.Mean(from, i) : sum.Unmultiplied(from, i);
        }
        if (!opaque) picture->alpha[to] = sum.Mean(from, 3);
      }
    }
  }

  StageOptions options_;
  std::array<std::uint8_t, 4UL * kWindow_px * kWindow_px> window_{};
  OSMesaContext mesa_ = nullptr;
  std::unique_ptr<Painter> painter_;
  std::unique_ptr<GlFrame> frame_;
};

}  // namespace

RunSummary Stage::Open(const StageOptions& options, std::unique_ptr<Stage>* stage) {
  auto made = std::make_unique<OsMesaStage>(options);
  RunSummary summary = made->Make();
  if (summary.ok()) *stage = std::move(made);
  return summary;
}

}  // namespace mbv::render
