#include "features/workspace/workspace.h"

#include <fmt/format.h>

#include "analytic/closed_form.h"
#include "analytic/workspace_form.h"
#include "base/png.h"
#include "base/text.h"
#include "plot/svg_plot.h"
#include "render/render.h"
#include "verify/ranges.h"

namespace mbv {
namespace {

// The workspace has no other witness: outside what the equations cover it is an error.
void RefuseUncovered(const Mechanism& mechanism, Diagnostics* diagnostics) {
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr || row->coverage == nullptr) return;
  for (Finding& finding :
       FindUncovered(row->coverage(mechanism), mechanism, Concern::kKinematics)) {
    finding.severity = Severity::kError;
    finding.file = mechanism.file;
    diagnostics->Add(std::move(finding));
  }
}

// "a", "a and b", "a, b and c".
std::string Enumerated(const std::vector<std::string>& words) {
  if (words.empty()) return "none";
  const std::string first = Joined({words.begin(), words.end() - 1});
  return first.empty() ? words.back() : first + " and " + words.back();
}

std::string ContentOf(const WorkspaceFile& file) {
  if (const auto* text = std::get_if<std::string>(&file.content)) return *text;
  if (const auto* lines = std::get_if<LinePlot>(&file.content)) return ToSvg(*lines);
  return ToSvg(std::get<MapPlot>(file.content));
}

}  // namespace

RunSummary DrawInside(const Mechanism& mechanism,
                      const std::vector<std::pair<TriangleMesh, std::string>>& surfaces,
                      const std::string& title, const std::string& name,
                      std::vector<std::pair<std::string, std::string>>* files) {
  PictureFrame frame = HomeFrame(mechanism);
  frame.caption.title = title;
  Overlay overlay;
  for (const auto& [mesh, color] : surfaces) {
    overlay.meshes.push_back({mesh.vertices, mesh.triangles, color + "80"});
  }
  for (const auto& [side, azimuth, elevation] :
       {std::tuple{"front", 25.0, 15.0}, std::tuple{"below", 140.0, -20.0}}) {
    PictureOptions options;
    options.camera.azimuth_deg = azimuth;
    options.camera.elevation_deg = elevation;
    const RunSummary summary =
        RenderPictures(mechanism, {frame}, overlay, options, [&, at = side](int, Picture picture) {
          files->emplace_back(fmt::format("{}_{}.png", name, at), EncodePng(picture));
          return true;
        });
    if (!summary.ok()) return summary;
  }
  return RunSummary::Done();
}

std::vector<std::string> WorkspaceMechanisms() {
  std::vector<std::string> names;
  for (const WorkspaceFormRow& row : WorkspaceForms()) names.push_back(row.mechanism);
  return names;
}

WorkspaceOutcome ComputeWorkspace(const Mechanism& mechanism, bool pictures, int jobs,
                                  const ProgressFunction& progress) {
  WorkspaceOutcome outcome;
  RefuseUncovered(mechanism, &outcome.diagnostics);
  if (outcome.diagnostics.has_errors()) return outcome;
  const WorkspaceFormRow* row = FindWorkspaceForm(mechanism.name);
  if (row == nullptr) {
    outcome.summary.stop = Stop::kUnsupported;
    outcome.summary.message = fmt::format("no workspace is computed for '{}'; there is one for {}",
                                          mechanism.name, Enumerated(WorkspaceMechanisms()));
    return outcome;
  }
  RangeFilter within_ranges;
  if (HasRanges(mechanism)) {
    within_ranges = [&](const std::vector<Pose>& X_WB) { return IsWithinRanges(mechanism, X_WB); };
  }
  const WorkspaceForm form = row->compute(
      mechanism,
      {.within_ranges = within_ranges, .jobs = jobs, .progress = StageOf(progress, "workspace")});
  outcome.summary = form.summary;
  outcome.diagnostics.Append(form.diagnostics);
  outcome.text = form.text;
  outcome.measures = form.measures;
  outcome.agree = form.agree;
  for (const WorkspaceFile& file : form.files) {
    outcome.files.emplace_back(file.name, ContentOf(file));
    if (const auto* lines = std::get_if<LinePlot>(&file.content)) {
      outcome.plots.emplace_back(file.name, *lines);
    }
    if (const auto* map = std::get_if<MapPlot>(&file.content)) {
      outcome.maps.emplace_back(file.name, *map);
    }
  }
  if (!pictures || !form.summary.ok() || form.mesh.triangles.empty()) return outcome;
  const RunSummary drawn = DrawInside(mechanism, {{form.mesh, "#2f7ed8"}}, form.mesh_caption,
                                      "workspace", &outcome.files);
  if (!drawn.ok()) outcome.summary = drawn;
  return outcome;
}

}  // namespace mbv
