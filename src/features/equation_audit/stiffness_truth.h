// Truth of the stiffness rows: frame elements (reference) on models/NAME/elastic.yaml, whole or
// with some of its joints opened, and the way matrices enter a row.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "features/equation_audit/audit.h"
#include "mechanism/mechanism.h"

namespace mbv::stiffness_audit {

/// models_dir/name/elastic.yaml.
[[nodiscard]] Mechanism LoadElastic(const std::string& models_dir, const std::string& name,
                                    const std::map<std::string, double>& parameters = {});

/// Poses of all bodies at values of drives and of OUTPUT.x … OUTPUT.yaw, loops closed by the
/// reference solver.
[[nodiscard]] std::vector<Pose> PosesAt(const Mechanism& mechanism,
                                        const std::map<std::string, double>& pose);

/// The mechanism with these joints opened: what hangs on them hangs loose.
[[nodiscard]] Mechanism Opened(Mechanism mechanism, const std::vector<std::string>& joints);
/// The mechanism with the joint's child clamped to the world at its pose.
[[nodiscard]] Mechanism Clamped(Mechanism mechanism, const std::string& joint,
                                const std::vector<Pose>& X_WB);

/// Stiffness and compliance, order [rotation; displacement], of a point of a body in world axes.
[[nodiscard]] Mat6 StiffnessAt(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                               const std::string& body, const Vec3& p_BoQ_B = Vec3::Zero());
[[nodiscard]] Mat6 ComplianceAt(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                                const std::string& body, const Vec3& p_BoQ_B = Vec3::Zero());

/// Tip stiffness and compliance of a clamped beam in its axes.
[[nodiscard]] Mat6 CantileverStiffness(const Beam& section_and_material, double length);
[[nodiscard]] Mat6 CantileverCompliance(const Beam& section_and_material, double length);

/// The same in axes turned by R_WE: R_WEᵀ M R_WE of each block.
[[nodiscard]] Mat6 InAxes(const Mat6& M_W, const Mat3& R_WE);

/// Adds all entries of stiffnesses [N/m] or compliances [m/N], whose rows and columns of rotations
/// are made displacements by `length`: a rotation of 1 rad counts as `length` metres.
enum class MatrixKind { kStiffness, kCompliance };
void AddMatrix(RowMeter* meter, MatrixKind kind, double length, const Mat6& truth,
               const Mat6& printed, const Mat6& corrected);

}  // namespace mbv::stiffness_audit
