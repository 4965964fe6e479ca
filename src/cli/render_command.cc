// mbverify render
#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "pipeline/render_scenario.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct RenderArguments {
  std::string scenario, at, size, video, out = "pictures";
  std::vector<std::string> set;
  double frames_per_s = 25.0;
};

// "1280x960" → "[1280, 960]".
std::string SizeText(const std::string& size) {
  const size_t at = size.find('x');
  if (at == std::string::npos) return "[" + size + "]";
  return "[" + size.substr(0, at) + ", " + size.substr(at + 1) + "]";
}

int Save(const std::string& path, const std::string& content,
         const std::vector<InputFile>& inputs) {
  if (const int code = WriteWholeFile(path, content, inputs); code != 0) return code;
  fmt::print("{}\n", path);
  return 0;
}

int Render(const RenderArguments& arguments) {
  RenderRequest request;
  for (const std::string& text : arguments.set) {
    const auto set = SplitSet(text);
    if (!set) {
      return Refuse(fmt::format("--set {}: write key=value", text), "e.g. parameters.m_p=45000");
    }
    request.scenario.set.push_back(*set);
  }
  if (!arguments.at.empty()) {
    request.scenario.set.emplace_back("snapshots.times_s", "[" + arguments.at + "]");
  }
  if (!arguments.size.empty()) {
    request.scenario.set.emplace_back("snapshots.size_px", SizeText(arguments.size));
  }
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
  render->add_option("--video", arguments->video,
                     "write a video of the whole motion: .mp4, .mkv, .webm, .gif (by ffmpeg), or "
                     "an animated .png, which needs nothing");
  render->add_option("--fps", arguments->frames_per_s, "frames per second of the video")
      ->check(CLI::Range(1.0, 120.0))
      ->capture_default_str();
  render->add_option("--out", arguments->out, "folder for pictures")->capture_default_str();
  render
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  SetFooter(render,
            {"render scenarios/stabilizing_platform/sea_state.yaml --at 0,1.42 --size 1920x1080",
             "render four_bar/turn --set parameters.crank=0.16",
             "render scenarios/spr_tripod/default.yaml --video tripod.mp4"},
            "0 drawn, 2 bad input, 3 could not run");
  render->callback([arguments, exit_code] { *exit_code = Render(*arguments); });
}

}  // namespace mbv
