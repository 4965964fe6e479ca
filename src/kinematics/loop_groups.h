// Which loops hang together.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Loops that share joints of the spanning tree, directly or by others.
struct LoopGroup {
  std::vector<int> closures;  ///< joints that close them
  std::vector<int> joints;    ///< tree joints around them, inboard first
};

/// The groups of the spanning tree (BuildSpanningTree first), in the order of their first closure.
[[nodiscard]] std::vector<LoopGroup> LoopGroups(const Mechanism& mechanism);

}  // namespace mbv
