// Snapshots of a run.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "render/render.h"
#include "report/html_report.h"
#include "report/report.h"
#include "scenario/scenario.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {

struct PictureFile {
  std::string name;     ///< "t_1.500s.png"
  std::string content;  ///< PNG
  std::string preview;  ///< PNG, at most 640 pixels wide
};

/// Title and status of a run's pictures; the time is added to the detail of each.
[[nodiscard]] Caption CaptionOf(const Report& report);

/// How a page draws the shapes of a mechanism.
[[nodiscard]] std::map<std::string, HtmlPaint> PaintsOf(const Mechanism& mechanism);

/// Index of the sample nearest to a time.
[[nodiscard]] int NearestSample(const std::vector<double>& times_s, double t_s);

/// The simulation's poses at the scenario's snapshot times as keyframes (at rest) of its MJCF,
/// named like the pictures.
[[nodiscard]] std::vector<MjcfKey> SnapshotKeys(const Scenario& scenario,
                                                const Mechanism& mechanism,
                                                const SimulationRun& run);

/// Draws the simulation at the scenario's snapshot times (nearest sample each); without a bar below
/// if the caption is empty.
[[nodiscard]] RunSummary DrawSnapshots(const Scenario& scenario, const Mechanism& mechanism,
                                       const SimulationRun& run, const Caption& caption,
                                       const std::function<void(double)>& progress,
                                       std::vector<PictureFile>* files);

/// Draws the simulation at these times (nearest sample each), a little less smooth if there are
/// many.
[[nodiscard]] RunSummary DrawAt(const std::vector<double>& times_s, const Scenario& scenario,
                                const Mechanism& mechanism, const SimulationRun& run,
                                const Caption& caption, const PictureSink& sink);

}  // namespace mbv
