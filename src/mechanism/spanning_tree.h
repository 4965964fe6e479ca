// Spanning tree of the joint graph: which joints carry coordinates and which ones close loops.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Hints by joint index: true = cut here, false = never cut, empty = free choice. A shorter vector
/// leaves the remaining joints free.
using ClosureHints = std::vector<std::optional<bool>>;

struct SpanningTreeResult {
  /// Bodies that no chain of uncut joints connects to the world. A floating mechanism needs an
  /// explicit `free` joint; nothing is added silently.
  std::vector<int> unconnected_bodies;
  /// Joints hinted "never cut" that nevertheless had to be cut (they close a loop of such joints).
  std::vector<int> hints_broken;

  [[nodiscard]] bool ok() const { return unconnected_bodies.empty() && hints_broken.empty(); }
};

/// Chooses the spanning tree from the world and sets Mechanism::tree_joints (inboard first),
/// tree_reversed and Joint::closure. Among joints without hint the tree prefers the costlier to
/// cut (driven and prescribed joints, then those with the fewest DOFs), so that spherical and
/// force-only joints become the closures. Depends only on the order and data of the joints.
SpanningTreeResult BuildSpanningTree(Mechanism* mechanism, const ClosureHints& hints = {});

/// True when a drive, a prescribed joint or a coupling prescribes a coordinate of this joint.
[[nodiscard]] bool HasDrivenCoordinate(const Mechanism& mechanism, int joint);
/// True when one of these or a force element uses a coordinate of this joint.
[[nodiscard]] bool HasUsedCoordinate(const Mechanism& mechanism, int joint);

/// visit(body) of `body` and of those that tree joints other than `joint` join with it, where all
/// bodies' joints with the world are cut. Nothing is allocated.
template <typename Visit>
void VisitBeyond(const Mechanism& mechanism, int joint, int body, const Visit& visit) {
  if (body == 0) return;
  visit(body);
  for (const int j : mechanism.tree_joints) {
    const Joint& other = mechanism.joints[static_cast<size_t>(j)];
    if (j == joint || (other.parent != body && other.child != body)) continue;
    VisitBeyond(mechanism, j, other.parent == body ? other.child : other.parent, visit);
  }
}

/// Bodies that tree joints join with a joint's child, where the joint and all bodies' joints with
/// the world are cut: what a tree joint carries, wherever the world holds the tree.
[[nodiscard]] std::vector<int> BodiesBeyond(const Mechanism& mechanism, int joint);

/// Body on the world's side of the t-th tree joint, and the one that this joint carries.
[[nodiscard]] inline int InboardBody(const Mechanism& mechanism, size_t t) {
  const Joint& joint = mechanism.joints[mechanism.tree_joints[t]];
  return mechanism.tree_reversed[t] ? joint.child : joint.parent;
}
[[nodiscard]] inline int OutboardBody(const Mechanism& mechanism, size_t t) {
  const Joint& joint = mechanism.joints[mechanism.tree_joints[t]];
  return mechanism.tree_reversed[t] ? joint.parent : joint.child;
}

}  // namespace mbv
