#include "kinematics/loop_groups.h"

#include <map>
#include <numeric>

#include "mechanism/spanning_tree.h"

namespace mbv {

std::vector<LoopGroup> LoopGroups(const Mechanism& mechanism) {
  const size_t n = mechanism.joints.size();
  // Tree joint that carries each body.
  std::vector<int> carrier(mechanism.bodies.size(), -1), inboard(mechanism.bodies.size(), 0);
  std::vector<int> depth(mechanism.bodies.size(), 0);
  for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
    const int out = OutboardBody(mechanism, t), in = InboardBody(mechanism, t);
    carrier[out] = mechanism.tree_joints[t];
    inboard[out] = in;
    depth[out] = depth[in] + 1;
  }
  // Union-find over tree joints and closures.
  std::vector<size_t> root(n);
  std::iota(root.begin(), root.end(), size_t{0});
  const auto find = [&](size_t j) {
    while (root[j] != j) j = root[j] = root[root[j]];
    return j;
  };
  std::vector<bool> in_loop(n, false);
  for (size_t c = 0; c < n; ++c) {
    if (!mechanism.joints[c].closure) continue;
    in_loop[c] = true;
    int a = mechanism.joints[c].parent, b = mechanism.joints[c].child;
    while (a != b) {
      int& deeper = depth[a] >= depth[b] ? a : b;
      const auto j = static_cast<size_t>(carrier[deeper]);
      in_loop[j] = true;
      root[find(j)] = find(c);
      deeper = inboard[deeper];
    }
  }
  std::vector<LoopGroup> groups;
  std::map<size_t, size_t> group_of;
  for (size_t c = 0; c < n; ++c) {
    if (!mechanism.joints[c].closure) continue;
    const auto [at, fresh] = group_of.emplace(find(c), groups.size());
    if (fresh) groups.emplace_back();
    groups[at->second].closures.push_back(static_cast<int>(c));
  }
  for (const int j : mechanism.tree_joints) {
    if (in_loop[j]) groups[group_of.at(find(static_cast<size_t>(j)))].joints.push_back(j);
  }
  return groups;
}

}  // namespace mbv
