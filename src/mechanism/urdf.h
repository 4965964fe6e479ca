// URDF export of the spanning tree and import of a URDF tree, through urdfdom's types.
#pragma once

#include <string>

#include "mechanism/load_model.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// The spanning tree as URDF text (closures are listed in a comment and cannot be stated).
[[nodiscard]] std::string WriteUrdf(const Mechanism& mechanism);

}  // namespace mbv
