// The workspace of scara_robot for the workspace command.
#pragma once

#include "analytic/workspace_form.h"

namespace mbv::scara {

/// The paper's cylinder point by point, volumes, singularity maps (CSV, SVG).
[[nodiscard]] WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism,
                                                 const WorkspaceRequest& request);

}  // namespace mbv::scara
