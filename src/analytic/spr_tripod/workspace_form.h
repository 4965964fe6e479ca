// The workspace of spr_tripod for the workspace command.
#pragma once

#include "analytic/workspace_form.h"

namespace mbv::spr_tripod {

/// The six faces (STL, PLY) and sections (CSV, SVG).
[[nodiscard]] WorkspaceForm ComputeWorkspaceForm(const Mechanism& mechanism,
                                                 const WorkspaceRequest& request);

}  // namespace mbv::spr_tripod
