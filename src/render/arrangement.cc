#include "render/stage.h"

#include <fmt/format.h>

#include <algorithm>

#include "render/annotations.h"
#include "render/camera.h"

namespace mbv::render {
namespace {

std::string WithUnit(double value, const std::string& unit) {
  if (value >= 1e6) return fmt::format("{:.3g} M{}", value * 1e-6, unit);
  if (value >= 1e3) return fmt::format("{:.3g} k{}", value * 1e-3, unit);
  return fmt::format("{:.3g} {}", value, unit);
}

constexpr double kNear = 0.15;  // share of the mechanism's diagonal

// Collects what the pictures show, in the drawing frame.
class Extent {
 public:
  Extent(const Mat3& R_DW, CameraFit* fit) : R_DW_(R_DW), fit_(fit) {}

  void Include(const std::vector<Item>& items, bool first_frame) {
    for (const Item& item : items) {
      const bool near = item.framing == Framing::kIfNear;
      if (near && first_frame) near_.push_back(item);  // parts of the world do not move
      for (const Vec3& p_W : Corners(item)) {
        const Vec3 p_D = R_DW_ * p_W;
        all_.extend(p_D);
        if (item.framing == Framing::kAlways) IncludePoint(p_D);
      }
    }
  }

  void IncludePoint(const Vec3& p_D) {
    framed_.extend(p_D);
    fit_->Include(p_D);
  }

  // Parts of the world count if they lie close around the rest: what is shown is the mechanism.
  void Close() {
    Eigen::AlignedBox3d reach = framed_;
    if (!reach.isEmpty()) {
      reach.min().array() -= kNear * framed_.diagonal().norm();
      reach.max().array() += kNear * framed_.diagonal().norm();
    }
    for (const Item& item : near_) {
      std::vector<Vec3> corners = Corners(item);
      for (Vec3& p : corners) p = R_DW_ * p;
      const bool inside =
          std::ranges::all_of(corners, [&](const Vec3& p) { return reach.contains(p); });
      if (inside || framed_.isEmpty())
        std::ranges::for_each(corners, [this](const Vec3& p) { IncludePoint(p); });
    }
    if (framed_.isEmpty()) {
      IncludePoint(Vec3::Zero());
      IncludePoint(Vec3::Ones());
    }
    all_.extend(framed_);
  }

  [[nodiscard]] const Eigen::AlignedBox3d& framed() const { return framed_; }
  [[nodiscard]] double lowest() const { return all_.min().z(); }

 private:
  Mat3 R_DW_;
  CameraFit* fit_;
  std::vector<Item> near_;
  Eigen::AlignedBox3d framed_, all_;
};

void SetBackground(const PictureOptions& options, StageOptions* stage) {
  const std::string& name = options.background;
  if (name == "transparent") {
    stage->background = std::array<float, 4>{0.0F, 0.0F, 0.0F, 0.0F};
  } else if (name == "white" || (name.empty() && options.line_art)) {
    stage->background = std::array<float, 4>{1.0F, 1.0F, 1.0F, 1.0F};
  } else if (!name.empty()) {
    stage->background = MaterialOf(name).rgba;
    (*stage->background)[3] = 1.0F;
  }
  const bool shadows_alone = name == "transparent" || name == "white";
  if (stage->background) stage->ground = shadows_alone ? Ground::kShadowsAlone : Ground::kNone;
}

}  // namespace

Arrangement Arrange(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                    const Overlay& overlay, const PictureOptions& options) {
  Arrangement set;
  set.R_DW = UprightRotation(-mechanism.up_W);
  set.scale = ScaleOf(mechanism, frames);
  int bar_px = 0;
  for (const PictureFrame& frame : frames) {
    bar_px = std::max(bar_px, BarHeight(frame.caption, options.size_px));
  }
  const double width = options.size_px[0], height = options.size_px[1];
  CameraFit fit(BestView(mechanism, frames, set.scale, options, set.R_DW), width / height,
                {.side = 0.05, .top = 0.045, .bottom = 0.045 + bar_px / height}, set.R_DW);

  Extent extent(set.R_DW, &fit);
  std::vector<std::shared_ptr<const TriangleMesh>> meshes;
  for (const PictureFrame& frame : frames) {
    const std::vector<Item> items = MechanismItems(mechanism, frame, set.scale, options);
    // The rings' direction is not known yet; they are small and no items.
    const Annotations marks = Annotate(mechanism, frame, set.scale, options, Vec3::UnitX());
    extent.Include(items, &frame == frames.data());
    extent.Include(marks.items, false);
    for (const Item& item : items) {
      if (item.mesh != nullptr && std::ranges::find(meshes, item.mesh) == meshes.end()) {
        meshes.push_back(item.mesh);
      }
    }
  }
  const Annotations overlaid = OverlayAnnotations(overlay, set.scale, Vec3::UnitX());
  extent.Include(overlaid.items, false);
  for (const MeshOverlay& mesh : overlay.meshes) {
    for (const Vec3& p_W : mesh.vertices_W) extent.IncludePoint(set.R_DW * p_W);
  }
  extent.Close();

  set.camera = fit.Fit();
  set.forward_W = set.R_DW.transpose() * set.camera.forward_D();
  const std::optional<double> sea = SeaLevel(mechanism, set.R_DW);
  const double size = std::max(extent.framed().diagonal().norm(), 1e-6);
  set.stage = {.width = options.size_px[0],
               .height = options.size_px[1],
               .passes = options.passes,
               .shadows = options.shadows,
               .line_art = options.line_art,
               .centre_D = extent.framed().center(),
               .radius_m = 0.75 * size,
               .ground = sea ? Ground::kSea : Ground::kGrid,
               .ground_m = sea.value_or(extent.lowest() - 0.01 * size),
               .grid_m = RoundLength(0.14 * size),
               .meshes = std::move(meshes)};
  SetBackground(options, &set.stage);
  return set;
}

std::vector<LegendEntry> LegendOf(const Mechanism& mechanism, const Arrangement& arrangement,
                                  const Overlay& overlay, const PictureOptions& options) {
  std::vector<LegendEntry> legend;
  const double force = arrangement.scale.longest_force_N;
  const double torque = arrangement.scale.longest_torque_Nm;
  if (options.drive_forces && (force > 0.0 || torque > 0.0)) {
    legend.push_back({"push", force > 0.0 ? "push (+)" : "torque +"});
    legend.push_back({"pull", force > 0.0 ? "pull (-)" : "torque -"});
    if (force > 0.0) legend.push_back({"", "arrows linear, longest = " + WithUnit(force, "N")});
    if (torque > 0.0) legend.push_back({"", "arcs linear, 300 deg = " + WithUnit(torque, "N m")});
  }
  const size_t second_row = legend.size();
  const bool any_closure =
      std::ranges::any_of(mechanism.joints, [](const Joint& joint) { return joint.closure; });
  if (options.closures && any_closure) legend.push_back({"closure", "loop closure"});
  const bool ground_seen = arrangement.camera.position_D().z() >= arrangement.stage.ground_m;
  if (options.output_frames && !mechanism.outputs.empty()) {
    legend.push_back({"", mechanism.outputs.size() == 1
                              ? "axes of " + mechanism.outputs[0].name + ":"
                              : "axes of the outputs:"});
    legend.push_back({"x_axis", "x"});
    legend.push_back({"y_axis", "y"});
    legend.push_back({"z_axis", "z"});
  }
  for (const PolylineOverlay& path : overlay.paths) {
    if (!path.name.empty()) legend.push_back({path.color, path.name});
  }
  if (arrangement.stage.ground == Ground::kGrid && ground_seen) {
    legend.push_back({"", fmt::format("grid {:g} m", arrangement.stage.grid_m)});
  }
  for (size_t i = second_row; i < legend.size(); ++i) legend[i].row = 1;
  if (options.line_art) {
    std::erase_if(legend, [](const LegendEntry& entry) { return !entry.color.empty(); });
  }
  return legend;
}

}  // namespace mbv::render
