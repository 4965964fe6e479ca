// Verification pictures: a mechanism drawn off-screen (no display needed).
//
// A picture is drawn from the mechanism's shapes and one pose per body, so it works for a
// simulated sample, for a commanded pose and for the home pose without any simulation. Up is
// against gravity, whatever axis that is. Bodies without shapes get rods between their joints.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/png.h"
#include "base/run_summary.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "simulation/engine/simulation.h"

namespace mbv {

/// Where the camera stands; what is left empty is chosen so that every frame's mechanism fits.
struct CameraView {
  // Without an azimuth, the direction from which most joints are seen, best near -60°, 16°.
  std::optional<double> azimuth_deg = {};  ///< from the look-at point to the camera, about up; 0 is
                                           ///< the world's x axis (its z axis where x is vertical)
  std::optional<double> elevation_deg = {};  ///< height of the camera above the horizon, -90 … 90
  std::optional<double> distance_m = {};     ///< to the look-at point, > 0
  std::optional<Vec3> lookat_W = {};         ///< [m]
  bool orthographic = false;                 ///< parallel rays: lengths across them are to scale
};

struct PictureOptions {
  std::array<int, 2> size_px{1280, 960};  ///< each 64 … 8192
  int passes = 8;  ///< averaged passes, 1 … 64: smoother edges and softer shadows
  CameraView camera;
  bool shadows = true;
  bool joints = true;         ///< joints as small balls and cylinders
  bool closures = true;       ///< rings around the joints that close loops
  bool drive_forces = true;   ///< arrows, where the frame has forces
  bool output_frames = true;  ///< triads at the outputs
  /// What is named, as PlacesFor() of mechanism/named_places.h takes it.
  std::vector<std::string> labels = {};
  bool scale_bar = false;
  bool line_art = false;  ///< black outlines on white, without arrows' colours and ground
  /// Factor by which bodies move away from the middle of all, >= 1.
  double exploded = 1.0;
  /// Instead of sky and ground: "transparent", "white" (both with shadows on the ground), or a
  /// colour's name or "#rrggbb" without them; "": sky and ground.
  std::string background = {};
};
[[nodiscard]] Diagnostics Check(const PictureOptions& options);

/// Text under the picture. ASCII and a few symbols (° ² · − µ); other characters become '?'.
struct Caption {
  std::string title = {};   ///< large, left: "stabilizing_platform / sea_state"
  std::string detail = {};  ///< small, left: "t = 1.500 s   NRMSE 4.2e-08 …"
  std::string status = {};  ///< large, right: "agree"
  enum class Mood { kNeutral, kGood, kBad } mood = Mood::kNeutral;  ///< grey, green or red status
};

/// What one picture shows.
struct PictureFrame {
  std::vector<Pose> X_WB;                 ///< per body of the mechanism
  std::vector<double> drive_forces = {};  ///< per drive [N or N m]; empty: no arrows; NaN: no arrow
  Caption caption = {};                   ///< all empty: no caption bar
  std::vector<std::vector<Pose>> X_WB_ghosts = {};  ///< other instants, pale, the farthest first
};

/// Additions drawn into every frame.
struct PolylineOverlay {
  std::vector<Vec3> points_W = {};  ///< [m]
  std::string color = "path";       ///< a material name or "#rrggbb[aa]"
  std::string name = {};            ///< in the legend; "": not there
  double radius_m = 0.0;            ///< 0: chosen to fit the picture
};
struct MeshOverlay {
  std::vector<Vec3> vertices_W;               ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< indices into vertices_W; winding is irrelevant
  std::string color = "#2f7ed866";            ///< translucent by its alpha
};
struct Overlay {
  std::vector<PolylineOverlay> paths = {};
  std::vector<MeshOverlay> meshes = {};
};

/// The frame of the home pose, without forces.
[[nodiscard]] PictureFrame HomeFrame(const Mechanism& mechanism);
/// The frame of one sample of a simulation, with the simulated drive forces.
[[nodiscard]] PictureFrame SampleFrame(const Mechanism& mechanism, const SimulationRun& run,
                                       int sample);

/// Receives picture `index` as soon as it is drawn; returning false stops the drawing.
using PictureSink = std::function<bool(int index, Picture picture)>;

/// Draws the frames with one common camera and one common force scale (for videos, too).
/// Fails with kEngineFailure (no off-screen context, renderer error) or kUnsupported (options or
/// frames that break a rule; the message quotes it). The same input gives the same bytes.
[[nodiscard]] RunSummary RenderPictures(const Mechanism& mechanism,
                                        const std::vector<PictureFrame>& frames,
                                        const Overlay& overlay, const PictureOptions& options,
                                        const PictureSink& sink);

}  // namespace mbv
