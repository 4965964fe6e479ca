// Pictures and videos of a scenario, without judging it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pipeline/pictures.h"
#include "pipeline/run_scenario.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct RenderRequest {
  ScenarioOptions scenario;
  std::string video_file;  ///< given: one video instead of single pictures; its ending tells the
                           ///< format (pipeline/video.h)
  double frames_per_s = 25.0;
  bool caption = true;
  ProgressFunction progress;
};

struct RenderOutcome {
  int exit_code = 4;  ///< 0 drawn, 2 bad input, 3 could not run
  Diagnostics diagnostics;
  std::string mechanism, scenario;
  std::vector<PictureFile> pictures;
  std::string video;  ///< content of the video file
};

[[nodiscard]] RenderOutcome RenderScenario(const std::string& file, const RenderRequest& request);

}  // namespace mbv
