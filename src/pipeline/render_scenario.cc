#include "pipeline/render_scenario.h"

#include "image/png.h"
#include "pipeline/animation.h"
#include "pipeline/run_witnesses.h"
#include "pipeline/video.h"

namespace mbv {
namespace {

// Times of a video's frames.
std::vector<double> FrameTimes(double duration_s, double frames_per_s) {
  std::vector<double> times;
  const auto frames = static_cast<int>(duration_s * frames_per_s);
  for (int i = 0; i <= frames; ++i) times.push_back(i / frames_per_s);
  return times;
}

// Frames go to the encoder as they are drawn; an animated PNG is joined at the end.
RunSummary DrawVideo(const Scenario& scenario, const Mechanism& mechanism, const SimulationRun& run,
                     const Caption& caption, const RenderRequest& request,
                     const std::function<void(double)>& progress, std::string* video) {
  const std::vector<double> times = FrameTimes(scenario.motion.duration_s, request.frames_per_s);
  const auto advance = [&](int index) {
    if (progress) progress((index + 1.0) / static_cast<double>(times.size()));
  };
  if (VideoFormatOf(request.video_file) == VideoFormat::kAnimatedPng) {
    std::vector<PictureFile> frames;
    RunSummary drawn =
        DrawAt(times, scenario, mechanism, run, caption, [&](int index, const Picture& picture) {
          frames.push_back({"", EncodePng(picture), ""});
          advance(index);
          return true;
        });
    if (drawn.ok()) *video = AnimatedPng(frames, request.frames_per_s);
    return drawn;
  }
  VideoEncoder encoder(request.video_file, request.frames_per_s);
  RunSummary drawn =
      DrawAt(times, scenario, mechanism, run, caption, [&](int index, const Picture& picture) {
        advance(index);
        return encoder.Add(OnWhite(picture));
      });
  if (!drawn.ok()) return drawn;
  const std::string trouble = encoder.Finish(video);
  if (trouble.empty()) return drawn;
  drawn.stop = Stop::kEngineFailure;
  drawn.message = trouble;
  return drawn;
}

}  // namespace

RenderOutcome RenderScenario(const std::string& file, const RenderRequest& request) {
  RenderOutcome outcome;
  if (const std::string trouble = request.video_file.empty() ? "" : CheckVideo(request.video_file);
      !trouble.empty()) {
    Finding finding;
    finding.message = trouble;
    outcome.diagnostics.Add(std::move(finding));
    outcome.exit_code = 2;
    return outcome;
  }
  auto prepared = Prepare(file, request.scenario, &outcome.diagnostics);
  if (!prepared) {
    outcome.exit_code = 2;
    return outcome;
  }
  Scenario& scenario = prepared->scenario;
  outcome.mechanism = prepared->base.name;
  outcome.scenario = scenario.name;
  outcome.exit_code = 3;
  scenario.simulation.extrapolate.reset();  // changes forces, not poses
  const auto progress = [&](const std::string& stage) { return StageOf(request.progress, stage); };
  const SimulatedWitness witness =
      WitnessRunner(*prepared, {}, request.progress).Simulate(Engine::kCorrected, "simulation");
  outcome.diagnostics.Append(witness.diagnostics);
  if (!witness.run.summary.ok()) {
    outcome.diagnostics.AddError(file, witness.run.summary.message);
    return outcome;
  }
  Caption caption;
  if (request.caption) caption.title = outcome.mechanism + " / " + outcome.scenario;
  const RunSummary drawn =
      request.video_file.empty()
          ? DrawSnapshots(scenario, prepared->mechanisms.simulated, witness.run, caption,
                          progress("pictures"), &outcome.pictures)
          : DrawVideo(scenario, prepared->mechanisms.simulated, witness.run, caption, request,
                      progress("video"), &outcome.video);
  if (!drawn.ok()) {
    outcome.diagnostics.AddError(file, drawn.message);
    return outcome;
  }
  outcome.exit_code = 0;
  return outcome;
}

}  // namespace mbv
