#include "pipeline/render_scenario.h"

#include <algorithm>

#include "pipeline/animation.h"
#include "pipeline/prepare.h"

namespace mbv {
namespace {

void AddError(const std::string& file, const RunSummary& summary, Diagnostics* diagnostics) {
  Finding finding;
  finding.file = file;
  finding.message = summary.message;
  diagnostics->Add(std::move(finding));
}

// Times of a video's frames.
std::vector<double> FrameTimes(double duration_s, double frames_per_s) {
  std::vector<double> times;
  const auto frames = static_cast<int>(duration_s * frames_per_s);
  for (int i = 0; i <= frames; ++i) times.push_back(i / frames_per_s);
  return times;
}

}  // namespace

RenderOutcome RenderScenario(const std::string& file, const RenderRequest& request) {
  RenderOutcome outcome;
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
  const auto progress = [&](const std::string& stage) {
    return request.progress ? [&request, stage](double f) { request.progress(stage, f); }
                            : std::function<void(double)>();
  };
  const SimulatedWitness witness =
      RunSimulation(scenario, prepared->mechanisms.simulated, prepared->MakeDrivenMotion(),
                    Engine::kCorrected, progress("simulation"));
  outcome.diagnostics.Append(witness.diagnostics);
  if (!witness.run.summary.ok()) {
    AddError(file, witness.run.summary, &outcome.diagnostics);
    return outcome;
  }
  if (request.frames_per_s) {
    scenario.snapshots.times_s = FrameTimes(scenario.motion.duration_s, *request.frames_per_s);
  }
  const RunSummary drawn = DrawSnapshots(
      scenario, prepared->mechanisms.simulated, witness.run,
      {.title = outcome.mechanism + " / " + outcome.scenario, .detail = {}, .status = {}},
      progress("pictures"), &outcome.pictures);
  if (!drawn.ok()) {
    AddError(file, drawn, &outcome.diagnostics);
    return outcome;
  }
  if (request.frames_per_s) {
    outcome.video = AnimatedPng(outcome.pictures, *request.frames_per_s);
    outcome.pictures.clear();
  }
  outcome.exit_code = 0;
  return outcome;
}

}  // namespace mbv
