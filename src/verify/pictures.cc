#include "verify/pictures.h"
#include "render/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <set>

namespace mbv {
namespace {

constexpr size_t kFewPictures = 24;  // more are a video: drawn faster, a little less smooth
constexpr int kVideoPasses = 2;
constexpr double kDegPerRad = 180.0 / std::numbers::pi;

std::optional<double> Degrees(std::optional<double> angle_rad) {
  if (angle_rad) *angle_rad *= kDegPerRad;
  return angle_rad;
}

PictureOptions OptionsOf(const SnapshotSettings& settings) {
  PictureOptions options;
  options.size_px = settings.size_px;
  options.camera = {.azimuth_deg = Degrees(settings.camera.azimuth_rad),
                    .elevation_deg = Degrees(settings.camera.elevation_rad),
                    .distance_m = settings.camera.distance_m,
                    .lookat_W = settings.camera.lookat_W,
                    .orthographic = settings.camera.orthographic};
  options.background = settings.background;
  options.labels = settings.labels;
  options.scale_bar = settings.scale_bar;
  options.line_art = settings.line_art;
  options.exploded = settings.exploded;
  return options;
}

// Averages squares of pixels so that the width is at most 640.
Picture Shrunk(const Picture& original) {
  const Picture picture = OnWhite(original);
  const int n = std::max(1, (picture.width + 639) / 640);
  Picture small{.width = picture.width / n, .height = picture.height / n};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < 3 * small.width; ++x) {
      int sum = 0;
      for (int k = 0; k < n * n; ++k) {
        const int row = n * y + k / n, column = n * (x / 3) + k % n;
        sum += picture.rgb[static_cast<size_t>(3 * (row * picture.width + column) + x % 3)];
      }
      small.rgb.push_back(static_cast<std::uint8_t>(sum / (n * n)));
    }
  }
  return small;
}

// A run that broke off has no poses from there on.
bool HasPoses(const Mechanism& mechanism, const SimulationRun& run, size_t sample) {
  return sample < run.X_WB.size() && run.X_WB[sample].size() == mechanism.bodies.size();
}

// The path of an output's origin through the run, as far as it came, in the world.
PolylineOverlay PathOf(const Mechanism& mechanism, const SimulationRun& run, int output_index) {
  const Output& output = mechanism.outputs[static_cast<size_t>(output_index)];
  PolylineOverlay path;
  path.name = "path of " + output.name;
  for (size_t i = 0; HasPoses(mechanism, run, i); ++i) {
    path.points_W.push_back(run.X_WB[i][static_cast<size_t>(output.body)] *
                            output.X_BO.translation());
  }
  return path;
}

// Instants that a picture at t_s shows beside its own, the first ones first.
std::vector<double> GhostTimes(const SnapshotSettings& settings, double t_s) {
  std::vector<double> times_s = settings.ghost_times_s;
  for (int k = 0; k < settings.ghost_count; ++k) {
    times_s.push_back(t_s * k / settings.ghost_count);
  }
  std::ranges::sort(times_s);
  return times_s;
}

void AddGhosts(const SnapshotSettings& settings, const Mechanism& mechanism,
               const SimulationRun& run, double t_s, PictureFrame* frame) {
  const int own = NearestSample(run.trace.time_s, t_s);
  for (const double ghost_s : GhostTimes(settings, t_s)) {
    const int sample = NearestSample(run.trace.time_s, ghost_s);
    if (sample == own || !HasPoses(mechanism, run, static_cast<size_t>(sample))) continue;
    frame->X_WB_ghosts.push_back(run.X_WB[static_cast<size_t>(sample)]);
  }
}

std::string SnapshotName(double t_s) { return fmt::format("t_{:.3f}s", t_s); }

}  // namespace

std::map<std::string, HtmlPaint> PaintsOf(const Mechanism& mechanism) {
  std::map<std::string, HtmlPaint> paints;
  const auto add = [&](const std::string& color) {
    paints[color] = {.rgba = render::MaterialOf(color).rgba, .scenery = render::IsScenery(color)};
  };
  for (const Body& body : mechanism.bodies) {
    for (const Shape& shape : body.shapes) add(shape.color);
  }
  for (const char* mark : {"grey", "dark_steel", "light_grey", "push", "pull", "closure"}) {
    add(mark);
  }
  return paints;
}

int NearestSample(const std::vector<double>& times_s, double t_s) {
  const auto nearer = [&](double a, double b) { return std::abs(a - t_s) < std::abs(b - t_s); };
  return static_cast<int>(std::min_element(times_s.begin(), times_s.end(), nearer) -
                          times_s.begin());
}

std::vector<MjcfKey> SnapshotKeys(const Scenario& scenario, const Mechanism& mechanism,
                                  const SimulationRun& run) {
  std::vector<MjcfKey> keys;
  std::set<int> written;
  for (const double t_s : scenario.snapshots.times_s) {
    if (run.trace.time_s.empty()) break;
    const int sample = NearestSample(run.trace.time_s, t_s);
    if (sample >= run.qpos.rows() || !run.qpos.row(sample).allFinite()) continue;
    if (!written.insert(sample).second) continue;
    MjcfKey key;
    key.time_s = run.trace.time_s[static_cast<size_t>(sample)];
    key.name = SnapshotName(key.time_s);
    for (const double x : run.qpos.row(sample)) key.qpos.push_back(x);
    const auto position = [&](const Drive& drive) {
      const int column = run.trace.Find(Quantity::kPosition, drive.name);
      const double x = column < 0 ? 0.0 : run.trace.values(sample, column);
      return std::isfinite(x) ? x : 0.0;
    };
    for (const Drive& drive : mechanism.drives) {
      key.drive_position.push_back(position(drive));
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

Caption CaptionOf(const Report& report) {
  Caption caption{.title = report.mechanism + " / " + report.scenario,
                  .detail = {},
                  .status = ToText(report.comparison.verdict)};
  if (const PairComparison* pair = report.comparison.MainPair()) {
    const std::string witnesses = fmt::format("{} against {}", pair->measured, pair->truth);
    const auto force = pair->metrics.find(Metric::kForceNrmse);
    const auto place = pair->metrics.find(Metric::kPoseM);
    if (force != pair->metrics.end()) {
      caption.detail =
          fmt::format("drive forces: {}, NRMSE {:.1e}", witnesses, force->second.value);
    } else if (place != pair->metrics.end()) {
      caption.detail =
          fmt::format("motion: {}, outputs within {:.1e} m", witnesses, place->second.value);
    }
  }
  caption.mood = report.comparison.verdict == Verdict::kAgree      ? Caption::Mood::kGood
                 : report.comparison.verdict == Verdict::kDisagree ? Caption::Mood::kBad
                                                                   : Caption::Mood::kNeutral;
  return caption;
}

RunSummary DrawAt(const std::vector<double>& times_s, const Scenario& scenario,
                  const Mechanism& mechanism, const SimulationRun& run, const Caption& caption,
                  const PictureSink& sink) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<PictureFrame> frames;
  for (const double t_s : times_s) {
    const int sample = NearestSample(run.trace.time_s, t_s);
    frames.push_back(SampleFrame(mechanism, run, sample));
    AddGhosts(scenario.snapshots, mechanism, run, t_s, &frames.back());
    if (caption.title.empty()) continue;
    frames.back().caption = caption;
    frames.back().caption.detail = fmt::format(
        "t = {:.3f} s   {}", run.trace.time_s[static_cast<size_t>(sample)], caption.detail);
  }
  PictureOptions options = OptionsOf(scenario.snapshots);
  if (frames.size() > kFewPictures) options.passes = kVideoPasses;
  Overlay overlay;
  if (scenario.snapshots.path_output >= 0) {
    PolylineOverlay path = PathOf(mechanism, run, scenario.snapshots.path_output);
    if (path.points_W.size() > 1) overlay.paths.push_back(std::move(path));
  }
  RunSummary summary = RenderPictures(mechanism, frames, overlay, options, sink);
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

RunSummary DrawSnapshots(const Scenario& scenario, const Mechanism& mechanism,
                         const SimulationRun& run, const Caption& caption,
                         const std::function<void(double)>& progress,
                         std::vector<PictureFile>* files) {
  std::vector<double> times_s = scenario.snapshots.times_s;
  std::erase_if(times_s, [&](double t_s) {
    return !HasPoses(mechanism, run, static_cast<size_t>(NearestSample(run.trace.time_s, t_s)));
  });
  if (times_s.empty()) return RunSummary::Done();
  for (const double t_s : times_s) {
    const int sample = NearestSample(run.trace.time_s, t_s);
    const double sample_s = run.trace.time_s[static_cast<size_t>(sample)];
    files->push_back({SnapshotName(sample_s) + ".png", "", ""});
  }
  RunSummary summary =
      DrawAt(times_s, scenario, mechanism, run, caption, [&](int index, Picture picture) {
        PictureFile& file = (*files)[static_cast<size_t>(index)];
        file.content = EncodePng(picture);
        file.preview = EncodePng(Shrunk(picture));
        if (progress) progress((index + 1.0) / static_cast<double>(times_s.size()));
        return true;
      });
  if (!summary.ok()) files->clear();
  return summary;
}

}  // namespace mbv
