#include "render/render.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "base/demand.h"
#include "mechanism/mechanism.h"
#include "mechanism/named_places.h"
#include "render/annotations.h"
#include "render/scene.h"
#include "render/stage.h"

namespace mbv::render {
namespace {

void MoveApart(const Mechanism& mechanism, double factor, std::vector<Pose>* X_WB) {
  const std::size_t count = mechanism.bodies.size();
  if (count < 2) return;
  Vec3 middle = Vec3::Zero();
  const auto centre = [&](std::size_t b) {
    return Vec3((*X_WB)[b] * mechanism.bodies[b].p_BoBcm_B);
  };
  for (std::size_t b = 1; b < count; ++b) middle += centre(b) / static_cast<double>(count - 1);
  for (std::size_t b = 1; b < count; ++b) {
    const Vec3 away = (factor - 1.0) * (centre(b) - middle);
    (*X_WB)[b].translation() += away;
  }
}

bool SamePlace(const Item& a, const Item& b) {
  return a.solid == b.solid && a.size.isApprox(b.size, 1e-9) && a.mesh == b.mesh &&
         (a.X_WG.matrix() - b.X_WG.matrix()).norm() <= 1e-9 * (1.0 + a.size.norm());
}

}  // namespace

// The frame with its bodies and those of its ghosts moved away from the mean of their centres of
// mass by this factor (>= 1); the world stays.
PictureFrame Exploded(const Mechanism& mechanism, const PictureFrame& frame, double factor) {
  PictureFrame apart = frame;
  MoveApart(mechanism, factor, &apart.X_WB);
  for (std::vector<Pose>& ghost : apart.X_WB_ghosts) MoveApart(mechanism, factor, &ghost);
  return apart;
}

// All frames, each followed by its ghosts as frames without forces and captions.
std::vector<PictureFrame> WithGhosts(const std::vector<PictureFrame>& frames) {
  std::vector<PictureFrame> all;
  for (const PictureFrame& frame : frames) {
    all.push_back(frame);
    for (const std::vector<Pose>& X_WB : frame.X_WB_ghosts) all.push_back({.X_WB = X_WB});
  }
  return all;
}

// Per ghost of a frame: its solids but for those that stand where one of `now` stands.
std::vector<std::vector<Item>> GhostItems(const Mechanism& mechanism, const PictureFrame& frame,
                                          const std::vector<Item>& now, const Scale& scale,
                                          const PictureOptions& options) {
  PictureOptions plain = options;
  plain.output_frames = false;
  std::vector<std::vector<Item>> ghosts;
  for (const std::vector<Pose>& X_WB : frame.X_WB_ghosts) {
    std::vector<Item> items = MechanismItems(mechanism, {.X_WB = X_WB}, scale, plain);
    std::erase_if(items, [&](const Item& item) {
      return std::ranges::any_of(now, [&](const Item& other) { return SamePlace(item, other); });
    });
    ghosts.push_back(std::move(items));
  }
  return ghosts;
}

}  // namespace mbv::render

namespace mbv {

namespace rn = render;

namespace {

RunSummary Unsupported(std::string message) {
  RunSummary summary;
  summary.stop = Stop::kUnsupported;
  summary.message = "pictures: " + std::move(message);
  return summary;
}

// Every frame and overlay must fit the mechanism; the first that does not is reported.
RunSummary CheckInput(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                      const Overlay& overlay) {
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const PictureFrame& frame = frames[f];
    if (frame.X_WB.size() != mechanism.bodies.size()) {
      return Unsupported(fmt::format("frame {} has {} poses for {} bodies", f, frame.X_WB.size(),
                                     mechanism.bodies.size()));
    }
    if (!frame.drive_forces.empty() && frame.drive_forces.size() != mechanism.drives.size()) {
      return Unsupported(fmt::format("frame {} has {} forces for {} drives", f,
                                     frame.drive_forces.size(), mechanism.drives.size()));
    }
    for (std::size_t b = 0; b < frame.X_WB.size(); ++b) {
      if (!frame.X_WB[b].matrix().allFinite()) {
        return Unsupported(fmt::format("frame {}: the pose of body '{}' is not finite", f,
                                       mechanism.bodies[b].name));
      }
    }
  }
  for (const MeshOverlay& mesh : overlay.meshes) {
    const int n = static_cast<int>(mesh.vertices_W.size());
    for (const auto& triangle : mesh.triangles) {
      for (const int i : triangle) {
        if (i < 0 || i >= n) {
          return Unsupported(fmt::format("a mesh triangle refers to vertex {} of {}", i, n));
        }
      }
    }
  }
  return RunSummary::Done();
}

std::vector<rn::Label> LabelsOf(const Mechanism& mechanism, const PictureFrame& frame,
                                const rn::Arrangement& set, const PictureOptions& options) {
  std::vector<rn::Label> labels;
  const double aspect = static_cast<double>(options.size_px[0]) / options.size_px[1];
  for (const NamedPlace& place : PlacesFor(mechanism, options.labels)) {
    const Vec3 p_W =
        0.5 * (frame.X_WB[place.body_a] * place.p_a + frame.X_WB[place.body_b] * place.p_b);
    const Eigen::Vector2d at = rn::Project(set.camera, aspect, set.R_DW * p_W);
    labels.push_back({.x = at.x(), .y = at.y(), .text = place.name});
  }
  return labels;
}

// Glass becomes flat meshes, which are blended and cast no shadows.
void MakeGlassFlat(std::vector<rn::Item>* items, std::vector<rn::FlatMesh>* flats) {
  std::erase_if(*items, [&](const rn::Item& item) {
    const bool glass = item.material.rgba[3] < 0.5F;
    if (glass) flats->push_back(rn::GlassMesh(item));
    return glass;
  });
}

rn::StageContent ContentOf(const Mechanism& mechanism, const PictureFrame& frame,
                           const rn::Arrangement& set, const rn::Annotations& overlaid,
                           const PictureOptions& options) {
  rn::StageContent content{.items = rn::MechanismItems(mechanism, frame, set.scale, options)};
  content.ghosts = rn::GhostItems(mechanism, frame, content.items, set.scale, options);
  const rn::Annotations marks = rn::Annotate(mechanism, frame, set.scale, options, set.forward_W);
  for (const rn::Annotations* more : {&marks, &overlaid}) {
    content.items.insert(content.items.end(), more->items.begin(), more->items.end());
    content.flats.insert(content.flats.end(), more->flats.begin(), more->flats.end());
  }
  MakeGlassFlat(&content.items, &content.flats);
  return content;
}

// Labels, scale and caption.
void PaintTexts(const Mechanism& mechanism, const PictureFrame& frame, const rn::Arrangement& set,
                const std::vector<rn::LegendEntry>& legend, const PictureOptions& options,
                Picture* picture) {
  const int floor_px = picture->height - rn::BarHeight(frame.caption, options.size_px);
  if (!options.labels.empty()) {
    (void)rn::PaintLabels(LabelsOf(mechanism, frame, set, options), floor_px, picture);
  }
  if (options.scale_bar) {
    rn::PaintScaleBar(rn::HeightAtLookat(set.camera), set.camera.parallel, floor_px, picture);
  }
  rn::PaintCaption(frame.caption, legend, picture);
}

}  // namespace

Diagnostics Check(const PictureOptions& options) {
  Diagnostics found;
  const auto demand = [&found](bool ok, std::string message) {
    if (!ok) found.Add({.message = std::move(message)});
  };
  for (const int size : options.size_px) {
    demand(size >= 64 && size <= 8192,
           fmt::format("size_px: {} violates 64 <= size <= 8192", size));
  }
  demand(options.passes >= 1 && options.passes <= 64,
         fmt::format("passes = {} violates 1 <= passes <= 64", options.passes));
  demand(
      options.background.empty() || options.background == "transparent" ||
          IsShapeColor(options.background),
      fmt::format("background = '{}' is neither a colour's name nor #rrggbb", options.background));
  demand(options.exploded >= 1.0 && options.exploded <= 10.0,
         fmt::format("exploded = {} violates 1 <= exploded <= 10", options.exploded));
  const CameraView& view = options.camera;
  demand(!view.azimuth_deg || std::isfinite(*view.azimuth_deg),
         "camera.azimuth_deg is not a finite number");
  demand(!view.elevation_deg || std::abs(*view.elevation_deg) <= 90.0,
         fmt::format("camera.elevation_deg = {} violates -90 <= elevation <= 90",
                     view.elevation_deg.value_or(kNan)));
  demand(!view.distance_m || (*view.distance_m > 0.0 && std::isfinite(*view.distance_m)),
         fmt::format("camera.distance = {} violates distance > 0", view.distance_m.value_or(kNan)));
  demand(!view.lookat_W || view.lookat_W->allFinite(), "camera.lookat is not finite");
  return found;
}

PictureFrame HomeFrame(const Mechanism& mechanism) {
  return {.X_WB = mechanism.X_WB_home, .drive_forces = {}};
}

PictureFrame SampleFrame(const Mechanism& mechanism, const SimulationRun& run, int sample) {
  MBV_DEMAND(sample >= 0 && sample < static_cast<int>(run.X_WB.size()), sample);
  PictureFrame frame{.X_WB = run.X_WB[sample], .drive_forces = {}};
  for (const Drive& drive : mechanism.drives) {
    const int column = run.trace.Find(Quantity::kForce, drive.name);
    frame.drive_forces.push_back(column < 0 ? kNan : run.trace.values(sample, column));
  }
  return frame;
}

RunSummary RenderPictures(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                          const Overlay& overlay, const PictureOptions& asked,
                          const PictureSink& sink) {
  const auto start = std::chrono::steady_clock::now();
  if (const Diagnostics found = Check(asked); found.has_errors()) {
    return Unsupported(found.findings()[0].message);
  }
  if (RunSummary input = CheckInput(mechanism, rn::WithGhosts(frames), overlay); !input.ok()) {
    return input;
  }
  if (frames.empty()) return RunSummary::Done();
  PictureOptions options = asked;
  std::vector<PictureFrame> shown = frames;
  if (options.exploded > 1.0) {
    options.closures = false;  // all of them are open
    for (PictureFrame& frame : shown) frame = rn::Exploded(mechanism, frame, options.exploded);
  }
  const rn::Arrangement set = rn::Arrange(mechanism, rn::WithGhosts(shown), overlay, options);
  std::unique_ptr<rn::Stage> stage;
  if (RunSummary opened = rn::Stage::Open(set.stage, &stage); !opened.ok()) return opened;
  const std::vector<rn::LegendEntry> legend = rn::LegendOf(mechanism, set, overlay, options);
  const rn::Annotations overlaid = rn::OverlayAnnotations(overlay, set.scale, set.forward_W);
  for (std::size_t f = 0; f < shown.size(); ++f) {
    Picture picture;
    RunSummary drawn = stage->Draw(ContentOf(mechanism, shown[f], set, overlaid, options), set.R_DW,
                                   set.camera, &picture);
    if (!drawn.ok()) return drawn;
    PaintTexts(mechanism, shown[f], set, legend, options, &picture);
    if (!sink(static_cast<int>(f), std::move(picture))) break;
  }
  RunSummary summary = RunSummary::Done();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace mbv
