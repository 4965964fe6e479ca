// Pictures and videos of a scenario, without judging it.

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/png.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "features/pictures/video.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "verify/pictures.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct RenderRequest {
  ScenarioOptions scenario;
  std::string video_file;  ///< given: one video instead of single pictures; its ending gives the
                           ///< format (features/pictures/video.h)
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

namespace {

struct RenderArguments {
  std::string scenario, at, size, camera, background, labels, ghosts, style, exploded, video;
  std::string out = "pictures";
  std::vector<std::string> set;
  bool no_caption = false, scale_bar = false, orthographic = false;
  double frames_per_s = 25.0;
};

// "1280x960" → "[1280, 960]".
std::string SizeText(const std::string& size) {
  const size_t at = size.find('x');
  if (at == std::string::npos) return "[" + size + "]";
  return "[" + size.substr(0, at) + ", " + size.substr(at + 1) + "]";
}

struct NamedView {
  const char* name;
  const char* angles;  // azimuth, elevation [deg]
};
constexpr NamedView kViews[] = {{"front", "-90,0"}, {"back", "90,0"},   {"left", "180,0"},
                                {"right", "0,0"},   {"top", "-90,90"},  {"bottom", "-90,-90"},
                                {"iso", "-45,35"},  {"usual", "-60,16"}};

std::vector<std::string> ViewNames() {
  std::vector<std::string> names;
  for (const NamedView& view : kViews) names.emplace_back(view.name);
  return names;
}

// A view's name or azimuth,elevation[,distance] as values of the scenario; false after a message.
bool SetCamera(const std::string& camera, ScenarioOptions* options) {
  std::string text = camera;
  for (const NamedView& view : kViews) {
    if (camera == view.name) text = view.angles;
  }
  const char* keys[] = {"azimuth_deg", "elevation_deg", "distance"};
  std::vector<std::string> parts;
  std::istringstream words(text);
  for (std::string part; std::getline(words, part, ',');) parts.push_back(part);
  const bool numbers = std::ranges::all_of(parts, [](const std::string& part) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
    return error == std::errc() && end == part.data() + part.size() && std::isfinite(value);
  });
  if (!numbers || parts.size() < 2 || parts.size() > 3) {
    return Refuse(fmt::format("--camera {} is not a view and not AZIMUTH,ELEVATION[,DISTANCE]",
                              camera),
                  DidYouMean(camera, ViewNames(), "views: " + Joined(ViewNames()))) == 0;
  }
  for (size_t i = 0; i < parts.size(); ++i) {
    options->set.emplace_back(std::string("snapshots.camera.") + keys[i], parts[i]);
  }
  return true;
}

// A list of words as a list of the scenario; one is a list, too.
std::string ListText(const std::string& words) { return "[" + words + "]"; }

// How the pictures look, as values of the scenario.
void SetLook(const RenderArguments& arguments, ScenarioOptions* options) {
  const auto set = [&](const char* key, const std::string& value) {
    options->set.emplace_back(std::string("snapshots.") + key, value);
  };
  // A colour's # would begin a comment.
  if (!arguments.background.empty()) set("background", "\"" + arguments.background + "\"");
  if (!arguments.labels.empty()) set("labels", ListText(arguments.labels));
  if (!arguments.ghosts.empty()) {
    const bool times = arguments.ghosts.find_first_of(",.") != std::string::npos;
    set("ghosts", times ? ListText(arguments.ghosts) : arguments.ghosts);
  }
  if (!arguments.style.empty()) set("style", arguments.style);
  if (!arguments.exploded.empty()) set("exploded", arguments.exploded);
  if (arguments.scale_bar) set("scale_bar", "true");
  if (arguments.orthographic) set("camera.projection", "orthographic");
}

// What the options set in the scenario; false after a message.
bool ReadRequest(const RenderArguments& arguments, RenderRequest* request) {
  ScenarioOptions& options = request->scenario;
  if (!ReadAssignments(arguments.set, "--set", "parameters.m_p=45000", &options.set)) return false;
  if (!arguments.at.empty()) {
    options.set.emplace_back("snapshots.times_s", "[" + arguments.at + "]");
  }
  if (!arguments.size.empty()) {
    options.set.emplace_back("snapshots.size_px", SizeText(arguments.size));
  }
  if (!arguments.camera.empty() && !SetCamera(arguments.camera, &options)) return false;
  SetLook(arguments, &options);
  request->caption = !arguments.no_caption;
  return true;
}

int Save(const std::string& path, const std::string& content,
         const std::vector<InputFile>& inputs) {
  if (const int code = WriteWholeFile(path, content, inputs); code != 0) return code;
  fmt::print("{}\n", path);
  return 0;
}

int Render(const RenderArguments& arguments) {
  RenderRequest request;
  if (!ReadRequest(arguments, &request)) return 2;
  request.video_file = arguments.video;
  request.frames_per_s = arguments.frames_per_s;
  ProgressLine progress(true);
  if (progress.active()) {
    request.progress = [&](const std::string& stage, double fraction) {
      progress.Show(stage, fraction);
    };
  }
  if (const int code = RefuseInput(arguments.video, arguments.scenario); code != 0) return code;
  const InputWatch inputs;
  const RenderOutcome outcome = RenderScenario(FindScenario(arguments.scenario), request);
  progress.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.exit_code != 0) return outcome.exit_code;
  if (!arguments.video.empty()) return Save(arguments.video, outcome.video, inputs.files());
  const std::filesystem::path folder =
      std::filesystem::path(arguments.out) / outcome.mechanism / outcome.scenario;
  int exit_code = 0;
  for (const PictureFile& picture : outcome.pictures) {
    exit_code = WorseExit(exit_code, Save(folder / picture.name, picture.content, inputs.files()));
  }
  return exit_code;
}

}  // namespace

void AddRenderCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* render = app->add_subcommand("render", "Draw pictures or a video of a scenario");
  render->add_option("scenario", arguments->scenario, "scenario file")->required();
  render->add_option("--at", arguments->at, "times [s], separated by commas");
  render->add_option("--size", arguments->size, "WIDTHxHEIGHT in pixels");
  render->add_option("--camera", arguments->camera,
                     "front, back, left, right, top, bottom, iso, usual, or "
                     "AZIMUTH,ELEVATION[,DISTANCE] in degrees and metres");
  render->add_option("--background", arguments->background,
                     "transparent, white, or another colour (e.g. #f4f4f4) instead of sky and "
                     "ground");
  render->add_flag("--no-caption", arguments->no_caption, "the picture alone");
  render->add_flag("--labels{usual}", arguments->labels,
                   "names of outputs, drives and joints; --labels=joints, frames, bodies or names, "
                   "separated by commas, for those alone");
  render->add_flag("--scale-bar", arguments->scale_bar, "a bar of a round length");
  render->add_flag("--orthographic", arguments->orthographic, "parallel rays");
  render->add_option("--ghosts", arguments->ghosts,
                     "earlier instants, pale: how many, or their times [s], separated by commas");
  render->add_option("--style", arguments->style, "shaded or line_art");
  render->add_option("--exploded", arguments->exploded,
                     "factor by which bodies move away from their middle, 1 to 10");
  render
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  render->add_option("--video", arguments->video,
                     "write a video of the whole motion: .mp4, .mkv, .webm, .gif (by ffmpeg), or "
                     "an animated .png, which needs nothing");
  render->add_option("--fps", arguments->frames_per_s, "frames per second of the video")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str();
  render->add_option("--out", arguments->out, "folder for pictures")->capture_default_str();
  SetFooter(
      render,
      {"render scenarios/stabilizing_platform/sea_state.yaml --at 0,1.42 --size 1920x1080",
       "render spr_tripod/default --camera iso --background white --no-caption",
       "render scenarios/four_bar/turn.yaml --camera -90,0 --labels --orthographic --scale-bar",
       "render four_bar/turn --at 0.5 --ghosts 5 --background transparent --no-caption",
       "render scara_robot/default --style line_art --labels=joints --size 7680x4320",
       "render scenarios/spr_tripod/default.yaml --video tripod.mp4"},
      "0 drawn, 2 bad input, 3 could not run");
  render->callback([arguments, exit_code] { *exit_code = Render(*arguments); });
}

}  // namespace mbv
