#include "mechanism/spanning_tree.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <tuple>

namespace mbv {
namespace {

enum class Choice { kFree, kCut, kKeep };

Choice ChoiceOf(const ClosureHints& hints, size_t joint) {
  if (joint >= hints.size() || !hints[joint].has_value()) return Choice::kFree;
  return *hints[joint] ? Choice::kCut : Choice::kKeep;
}

// Joints on each body, in model order.
std::vector<std::vector<int>> Incidence(const Mechanism& mechanism,
                                        const std::vector<bool>& usable) {
  std::vector<std::vector<int>> at(mechanism.bodies.size());
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (!usable[j]) continue;
    at[mechanism.joints[j].parent].push_back(static_cast<int>(j));
    at[mechanism.joints[j].child].push_back(static_cast<int>(j));
  }
  return at;
}

int Across(const Joint& joint, int body) {
  return joint.parent == body ? joint.child : joint.parent;
}

// Visits bodies breadth-first from the world; visit(joint, inboard body, outboard body).
template <typename Visit>
void BreadthFirst(const Mechanism& mechanism, const std::vector<bool>& usable, Visit visit) {
  const auto at = Incidence(mechanism, usable);
  std::vector<bool> seen(mechanism.bodies.size(), false);
  std::queue<int> open;
  open.push(0);
  seen[0] = true;
  while (!open.empty()) {
    const int inboard = open.front();
    open.pop();
    for (const int j : at[inboard]) {
      const int outboard = Across(mechanism.joints[j], inboard);
      if (seen[outboard]) continue;
      seen[outboard] = true;
      visit(j, inboard, outboard);
      open.push(outboard);
    }
  }
}

// The lower, the sooner a joint enters the tree. Joints of which a coordinate is used keep it; a
// massless body should not become a leaf; a cut sphere or force-only joint costs three rows, a cut
// hinge five; a free joint imposes nothing and is the last resort.
int KeepClass(const Mechanism& mechanism, int j, Choice choice) {
  const Joint& joint = mechanism.joints[j];
  if (choice == Choice::kKeep) return 0;
  if (HasUsedCoordinate(mechanism, j)) return 1;
  if (joint.kind == JointKind::kFree) return 10;
  const auto massless = [&](int body) { return body != 0 && mechanism.bodies[body].mass == 0.0; };
  if (massless(joint.parent) || massless(joint.child)) return 2;
  if (joint.transmits_force_only) return 9;
  if (joint.kind == JointKind::kSpherical) return 8;
  return 3 + DofsOf(joint.kind);
}

int Root(std::vector<int>* link, int body) {
  while ((*link)[body] != body) body = (*link)[body] = (*link)[(*link)[body]];
  return body;
}

// Joints in the order in which they may enter the tree.
std::vector<int> KeepOrder(const Mechanism& mechanism, const ClosureHints& hints,
                           const std::vector<bool>& usable) {
  // Among equals, those near the world come first, which cuts loops opposite the world.
  std::vector<int> depth(mechanism.bodies.size(), std::numeric_limits<int>::max());
  depth[0] = 0;
  BreadthFirst(mechanism, usable,
               [&](int, int inboard, int outboard) { depth[outboard] = depth[inboard] + 1; });
  const auto key = [&](int j) {
    const Joint& joint = mechanism.joints[j];
    return std::tuple(KeepClass(mechanism, j, ChoiceOf(hints, j)),
                      std::min(depth[joint.parent], depth[joint.child]), j);
  };
  std::vector<int> order(mechanism.joints.size());
  std::iota(order.begin(), order.end(), 0);
  std::erase_if(order, [&](int j) { return !usable[j]; });
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b); });
  return order;
}

}  // namespace

bool HasUsedCoordinate(const Mechanism& mechanism, int joint) {
  return HasDrivenCoordinate(mechanism, joint) ||
         std::ranges::any_of(mechanism.elements, [joint](const ForceElement& element) {
           return element.joint == joint;
         });
}

bool HasDrivenCoordinate(const Mechanism& mechanism, int joint) {
  const auto uses = [joint](const auto& item) { return item.joint == joint; };
  return std::ranges::any_of(mechanism.prescribed, uses) ||
         std::ranges::any_of(mechanism.drives,
                             [&](const Drive& drive) {
                               const auto* on = std::get_if<JointDrive>(&drive.kind);
                               return on != nullptr && uses(*on);
                             }) ||
         std::ranges::any_of(mechanism.couplings, [&](const Coupling& coupling) {
           return std::ranges::any_of(coupling.terms, uses);
         });
}

SpanningTreeResult BuildSpanningTree(Mechanism* mechanism, const ClosureHints& hints) {
  SpanningTreeResult result;
  const size_t n = mechanism->joints.size();
  std::vector<bool> usable(n);
  for (size_t j = 0; j < n; ++j) usable[j] = ChoiceOf(hints, j) != Choice::kCut;

  // Grow a forest, the joint that is dearest to cut first.
  std::vector<bool> in_tree(n, false);
  std::vector<int> link(mechanism->bodies.size());
  std::iota(link.begin(), link.end(), 0);
  for (const int j : KeepOrder(*mechanism, hints, usable)) {
    const Joint& joint = mechanism->joints[j];
    const int a = Root(&link, joint.parent), b = Root(&link, joint.child);
    if (a != b) {
      link[a] = b;
      in_tree[j] = true;
    } else if (ChoiceOf(hints, j) == Choice::kKeep) {
      result.hints_broken.push_back(j);
    }
  }

  // Order it from the world outwards.
  mechanism->tree_joints.clear();
  mechanism->tree_reversed.clear();
  std::vector<bool> reached(mechanism->bodies.size(), false);
  reached[0] = true;
  BreadthFirst(*mechanism, in_tree, [&](int j, int inboard, int outboard) {
    reached[outboard] = true;
    mechanism->tree_joints.push_back(j);
    mechanism->tree_reversed.push_back(mechanism->joints[j].child == inboard);
  });
  for (size_t b = 0; b < reached.size(); ++b) {
    if (!reached[b]) result.unconnected_bodies.push_back(static_cast<int>(b));
  }
  for (size_t j = 0; j < n; ++j) mechanism->joints[j].closure = !in_tree[j];
  return result;
}

std::vector<int> BodiesBeyond(const Mechanism& mechanism, int joint) {
  std::vector<int> bodies;
  VisitBeyond(mechanism, joint, mechanism.joints[static_cast<size_t>(joint)].child,
              [&](int body) { bodies.push_back(body); });
  return bodies;
}

}  // namespace mbv
