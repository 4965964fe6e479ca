// Workspaces of the mechanisms whose closed forms compute one: text, data files and pictures.
// Those of any model: reachable_set.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "analytic/workspace_form.h"
#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct WorkspaceOutcome {
  RunSummary summary;       ///< kUnsupported when the mechanism has no workspace computation
  Diagnostics diagnostics;  ///< parameters that do not suit it
  std::string text;         ///< findings to read
  std::vector<WorkspaceMeasure> measures;
  bool agree = true;  ///< false: two ways to the same measure differ by more than their errors
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
  std::vector<std::pair<std::string, LinePlot>> plots;     ///< of those that draw lines
  std::vector<std::pair<std::string, MapPlot>> maps;       ///< of those that colour cells
};

/// The mechanism at home inside coloured surfaces (given in world axes), from two sides.
[[nodiscard]] RunSummary DrawInside(
    const Mechanism& mechanism, const std::vector<std::pair<TriangleMesh, std::string>>& surfaces,
    const std::string& title, const std::string& name,
    std::vector<std::pair<std::string, std::string>>* files);

/// Mechanism names that ComputeWorkspace() supports.
[[nodiscard]] std::vector<std::string> WorkspaceMechanisms();

/// What the mechanism's form computes (analytic/workspace_form.h), and with `pictures` the
/// mechanism inside its mesh; by `jobs` processes at once, on which nothing depends.
[[nodiscard]] WorkspaceOutcome ComputeWorkspace(const Mechanism& mechanism, bool pictures,
                                                int jobs = 1,
                                                const ProgressFunction& progress = {});

}  // namespace mbv
