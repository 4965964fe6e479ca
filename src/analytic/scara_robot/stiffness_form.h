// The SCARA robot's stiffness in closed form, for the stiffness command.
#pragma once

#include "analytic/scara_robot/stiffness.h"
#include "analytic/stiffness_form.h"

namespace mbv::scara {

/// Formulations, the default first: "corrected"; "as_printed", the paper's model with every printed
/// defect (position analysis as corrected, or most poses could not be reached); and one model per
/// defect alone, "printed_…".
[[nodiscard]] std::vector<std::string> StiffnessModels();

/// Pose: platform.x, .y, .z, .yaw. Shares: per limb the servo, the arm, the rods and, in limbs 1
/// and 2, the short rod. Indices: κ_m, κ_f of (21), the norms of K's blocks and of C's.
[[nodiscard]] std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                               const PoseCoordinates& pose,
                                                               const std::string& model,
                                                               Diagnostics* diagnostics);

/// The constants by their names in models/scara_robot/elastic.yaml; they must exist.
[[nodiscard]] StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism);

/// A pose for scenarios that give none.
[[nodiscard]] PoseCoordinates ExampleStiffnessPose();
/// Maps of Figs 9–11.
[[nodiscard]] std::vector<std::string> UsualStiffnessMaps();

}  // namespace mbv::scara
