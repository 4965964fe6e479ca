#include "render/render.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/demand.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/caption.h"
#include "render/scene.h"
#include "render/stage.h"

namespace mbv {

namespace rn = render;

namespace {

RunSummary Unsupported(std::string message) {
  RunSummary summary;
  summary.stop = Stop::kUnsupported;
  summary.message = "pictures: " + std::move(message);
  return summary;
}

// Every frame and overlay must fit the mechanism; the first offence is told.
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

// 1, 2 or 5 times a power of ten, not above `value`.
double RoundLength(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return (digit >= 5.0 ? 5.0 : digit >= 2.0 ? 2.0 : 1.0) * power;
}

std::string WithUnit(double value, const std::string& unit) {
  if (value >= 1e6) return fmt::format("{:.3g} M{}", value * 1e-6, unit);
  if (value >= 1e3) return fmt::format("{:.3g} k{}", value * 1e-3, unit);
  return fmt::format("{:.3g} {}", value, unit);
}

// Everything that is common to all pictures of one call.
struct Set {
  Mat3 R_DW = Mat3::Identity();
  rn::Scale scale;
  rn::Camera camera;
  rn::StageOptions stage;
  Vec3 forward_W = Vec3::UnitX();
};

Eigen::AlignedBox3d BoxOf(const std::vector<Vec3>& points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : points) box.extend(p);
  return box;
}

// Adds the items that lie within a quarter of the diagonal around what is framed already.
void IncludeNear(const std::vector<std::vector<Vec3>>& items, std::vector<Vec3>* framed) {
  Eigen::AlignedBox3d box = BoxOf(*framed);
  if (box.isEmpty()) return;
  const double reach = 0.25 * box.diagonal().norm();
  box.min().array() -= reach;
  box.max().array() += reach;
  for (const std::vector<Vec3>& corners : items) {
    if (std::ranges::all_of(corners, [&](const Vec3& p) { return box.contains(p); })) {
      framed->insert(framed->end(), corners.begin(), corners.end());
    }
  }
}

// Camera, ground and stage from what all frames show together.
Set Arrange(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
            const Overlay& overlay, const PictureOptions& options) {
  Set set;
  set.R_DW = rn::UprightRotation(mechanism.gravity_W);
  set.scale = rn::ScaleOf(mechanism, frames);
  std::vector<Vec3> framed, all;
  std::vector<std::vector<Vec3>> maybe;  // corners of parts of the world
  const auto include = [&](const std::vector<rn::Item>& items) {
    for (const rn::Item& item : items) {
      std::vector<Vec3> corners = rn::Corners(item);
      for (Vec3& p : corners) p = set.R_DW * p;
      all.insert(all.end(), corners.begin(), corners.end());
      if (item.framing == rn::Framing::kAlways) {
        framed.insert(framed.end(), corners.begin(), corners.end());
      } else if (item.framing == rn::Framing::kIfNear) {
        maybe.push_back(std::move(corners));
      }
    }
  };
  int bar_px = 0;
  for (const PictureFrame& frame : frames) {
    include(rn::MechanismItems(mechanism, frame, set.scale, options));
    include(rn::Annotate(mechanism, frame, set.scale, options, Vec3::UnitX()).items);
    bar_px = std::max(bar_px, rn::BarHeight(frame.caption, options.size_px));
  }
  include(rn::OverlayAnnotations(overlay, set.scale).items);
  for (const MeshOverlay& mesh : overlay.meshes) {
    for (const Vec3& p_W : mesh.vertices_W) framed.emplace_back(set.R_DW * p_W);
  }
  IncludeNear(maybe, &framed);
  if (framed.empty()) framed = {Vec3::Zero(), Vec3::Ones()};
  if (all.empty()) all = framed;

  const double aspect = static_cast<double>(options.size_px[0]) / options.size_px[1];
  const rn::Margins margins{.side = 0.05,
                            .top = 0.045,
                            .bottom = 0.045 + static_cast<double>(bar_px) / options.size_px[1]};
  set.camera = rn::FitCamera(framed, options.camera, aspect, margins, set.R_DW);
  set.forward_W = set.R_DW.transpose() * set.camera.forward_D();

  const Eigen::AlignedBox3d box = BoxOf(framed);
  const std::optional<double> sea = rn::SeaLevel(mechanism, set.R_DW);
  const double height = box.sizes().z();
  set.stage = {.width = options.size_px[0],
               .height = options.size_px[1],
               .passes = options.passes,
               .shadows = options.shadows,
               .centre_D = box.center(),
               .radius_m = std::max(0.75 * box.diagonal().norm(), 1e-6),
               .ground_m = sea.value_or(BoxOf(all).min().z() - 0.02 * height),
               .sea = sea.has_value(),
               .grid_m = RoundLength(0.14 * box.diagonal().norm())};
  return set;
}

std::vector<rn::LegendEntry> LegendOf(const Mechanism& mechanism, const Set& set,
                                      const PictureOptions& options) {
  std::vector<rn::LegendEntry> legend;
  const double force = set.scale.longest_force_N, torque = set.scale.longest_torque_Nm;
  if (options.drive_forces && (force > 0.0 || torque > 0.0)) {
    legend.push_back({"push", force > 0.0 ? "push (+)" : "torque +"});
    legend.push_back({"pull", force > 0.0 ? "pull (-)" : "torque -"});
    if (force > 0.0) {
      legend.push_back({"", "arrows linear, longest = " + WithUnit(force, "N")});
    }
    if (torque > 0.0) legend.push_back({"", "arcs linear, 300 deg = " + WithUnit(torque, "N m")});
  }
  const bool any_closure =
      std::ranges::any_of(mechanism.joints, [](const Joint& joint) { return joint.closure; });
  if (options.closures && any_closure) legend.push_back({"closure", "loop closure"});
  if (!set.stage.sea) legend.push_back({"", fmt::format("grid {:g} m", set.stage.grid_m)});
  return legend;
}

}  // namespace

Diagnostics Check(const PictureOptions& options) {
  Diagnostics found;
  const auto demand = [&found](bool ok, std::string message) {
    if (!ok) found.Add({.file = {}, .message = std::move(message), .hint = {}});
  };
  for (const int size : options.size_px) {
    demand(size >= 64 && size <= 8192,
           fmt::format("size_px: {} violates 64 <= size <= 8192", size));
  }
  demand(options.passes >= 1 && options.passes <= 64,
         fmt::format("passes = {} violates 1 <= passes <= 64", options.passes));
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
  return {.X_WB = mechanism.X_WB_home, .drive_forces = {}, .caption = {}};
}

PictureFrame SampleFrame(const Mechanism& mechanism, const SimulationRun& run, int sample) {
  MBV_DEMAND(sample >= 0 && sample < static_cast<int>(run.X_WB.size()), sample);
  PictureFrame frame{.X_WB = run.X_WB[sample], .drive_forces = {}, .caption = {}};
  for (const Drive& drive : mechanism.drives) {
    const int column = run.trace.Find(drive.name + ".force");
    frame.drive_forces.push_back(column < 0 ? kNan : run.trace.values(sample, column));
  }
  return frame;
}

RunSummary RenderPictures(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                          const Overlay& overlay, const PictureOptions& options,
                          const PictureSink& sink) {
  const auto start = std::chrono::steady_clock::now();
  if (const Diagnostics found = Check(options); found.has_errors()) {
    return Unsupported(found.findings()[0].message);
  }
  if (RunSummary input = CheckInput(mechanism, frames, overlay); !input.ok()) return input;
  if (frames.empty()) return RunSummary::Done();
  const Set set = Arrange(mechanism, frames, overlay, options);
  std::unique_ptr<rn::Stage> stage;
  if (RunSummary opened = rn::Stage::Open(set.stage, &stage); !opened.ok()) return opened;
  std::vector<rn::Glyph> font;
  const bool any_caption = std::ranges::any_of(
      frames, [](const PictureFrame& frame) { return !rn::IsEmpty(frame.caption); });
  if (any_caption) {
    if (RunSummary got = stage->Font(&font); !got.ok()) return got;
  }
  const std::vector<rn::LegendEntry> legend = LegendOf(mechanism, set, options);
  const rn::Annotations overlaid = rn::OverlayAnnotations(overlay, set.scale);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    std::vector<rn::Item> items = rn::MechanismItems(mechanism, frames[f], set.scale, options);
    rn::Annotations marks = rn::Annotate(mechanism, frames[f], set.scale, options, set.forward_W);
    items.insert(items.end(), marks.items.begin(), marks.items.end());
    items.insert(items.end(), overlaid.items.begin(), overlaid.items.end());
    marks.flats.insert(marks.flats.end(), overlaid.flats.begin(), overlaid.flats.end());
    Picture picture;
    RunSummary drawn = stage->Draw(items, marks.flats, set.R_DW, set.camera, &picture);
    if (!drawn.ok()) return drawn;
    rn::PaintCaption(frames[f].caption, legend, font, &picture);
    if (!sink(static_cast<int>(f), std::move(picture))) break;
  }
  RunSummary summary = RunSummary::Done();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace mbv
