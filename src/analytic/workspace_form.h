// WorkspaceForm: where a mechanism can go, from its paper's equations.
//
// Results are data: text, files, figures and a mesh; nothing is drawn here. A form is added by one
// row in registry.cc, or from outside by register_closed_form.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "math/plot.h"
#include "math/triangle_mesh.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Says whether no joint and no drive is beyond its range at these body poses X_WB, by body index;
/// empty where the mechanism has no ranges.
using RangeFilter = std::function<bool(const std::vector<Pose>& X_WB)>;

/// What a workspace is computed with.
struct WorkspaceRequest {
  RangeFilter within_ranges = {};
  int jobs = 1;  ///< processes at once (ShareOut() of base/worker_pool.h): nothing depends on it
  std::function<void(double fraction)> progress = {};

  void Report(double fraction) const {
    if (progress) progress(fraction);
  }
};

struct WorkspaceFile {
  std::string name;  ///< with its ending: .svg for figures
  std::variant<std::string, LinePlot, MapPlot> content;
};

/// A number with its uncertainty (NaN: not known).
struct WorkspaceMeasure {
  std::string name;  ///< "volume by voxels"
  double value = kNan, error = kNan;
  std::string unit;
  /// The set that it measures, for other ways to it: output coordinates "x" … that are free, and
  /// values of others; poses beyond singularities of type 2 count. Empty: no set of poses.
  std::vector<std::string> over = {};
  std::vector<std::pair<std::string, double>> at = {};
};

struct WorkspaceForm {
  RunSummary summary;
  Diagnostics diagnostics;  ///< parameters that do not suit it
  std::string text;         ///< findings to read
  std::vector<WorkspaceMeasure> measures;
  bool agree = true;  ///< false: two ways to the same measure differ by more than their errors
  std::vector<WorkspaceFile> files;
  TriangleMesh mesh;         ///< its boundary, for pictures; empty: none
  std::string mesh_caption;  ///< "spr_tripod / workspace of the platform centre"
};

/// Decimals that an error leaves: the last one printed is of its size.
[[nodiscard]] inline int Decimals(double error) {
  constexpr int kMost = 14;
  if (!(error > 0.0)) return kMost;
  return std::clamp(static_cast<int>(std::ceil(-std::log10(error))), 0, kMost);
}

/// The outcome where a process that shared the work was killed.
[[nodiscard]] inline WorkspaceForm LostWork() {
  WorkspaceForm form;
  form.summary.message = "a process that shared the work was killed";
  return form;
}

using WorkspaceFunction = WorkspaceForm (*)(const Mechanism&, const WorkspaceRequest&);

struct WorkspaceFormRow {
  std::string mechanism;  ///< Mechanism::name
  WorkspaceFunction compute = nullptr;
};

[[nodiscard]] std::span<const WorkspaceFormRow> WorkspaceForms();
/// The row for a mechanism name, or nullptr.
[[nodiscard]] const WorkspaceFormRow* FindWorkspaceForm(const std::string& mechanism);

}  // namespace mbv
