// Mesh files of a robot's shapes. Internal to the readers of models and URDF.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

/// Reads the surfaces of all meshes that have none yet, which their shapes name as the robot's file
/// does. Those that cannot be read are taken out of the bodies: one warning names the first, at
/// `place`. Files are looked for as FindMesh() says, `folder` being that of the robot's file.
void LoadMeshes(const std::filesystem::path& folder, const Finding& place,
                std::vector<Body>* bodies, Diagnostics* diagnostics);

}  // namespace mbv::internal
