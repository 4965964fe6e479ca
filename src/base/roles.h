// Witnesses: who computes a scenario, and what follows from it. One row each.
//
// A witness joins by a row here, and by its computation (kComputations in
// verify/run_witnesses.cc). Nothing else knows its name.
#pragma once

#include <array>
#include <string>
#include <string_view>

namespace mbv {

/// What a witness is.
enum class RoleKind {
  kClosedForm,  ///< equations of one mechanism: no bodies, hence no loops and no energy
  kGeneric,     ///< computes any mechanism from its commands
  kEngine,      ///< a simulation: another witness gives its drives their motion or forces, it
                ///< integrates, and its own limits judge it
  kAfterwards,  ///< evaluated where an engine went: it is compared with it, not judged by itself
};

/// A witness' row.
struct Role {
  const char* name;    ///< in scenarios, CSV, JSON and checks: "simulated"
  const char* called;  ///< in sentences of a verdict: "simulation"
  const char* method;  ///< what computes: "closed form"
  RoleKind kind;
  /// The witnesses that it is held against; null: no more.
  std::array<const Role*, 4> against;

  [[nodiscard]] constexpr bool is_engine() const { return kind == RoleKind::kEngine; }
  [[nodiscard]] constexpr bool has_bodies() const { return kind != RoleKind::kClosedForm; }
  [[nodiscard]] constexpr bool judged_alone() const { return kind != RoleKind::kAfterwards; }
  [[nodiscard]] constexpr bool IsHeldAgainst(const Role& truth) const {
    for (const Role* other : against) {
      if (other == &truth) return true;
    }
    return false;
  }
};

[[nodiscard]] constexpr bool operator==(std::string_view name, const Role& role) {
  return name == role.name;
}

namespace role {

/// A paper's equations.
inline constexpr Role kAnalytic{"analytic", "analytic", "closed form", RoleKind::kClosedForm, {}};
/// The generic solver beside a table that has the reference's place.
inline constexpr Role kSolver{
    "solver", "the generic solver", "generic solver", RoleKind::kGeneric, {}};
/// The generic solver, or a table in its place.
inline constexpr Role kReference{
    "reference", "reference", "reference", RoleKind::kGeneric, {&kAnalytic, &kSolver}};
/// The generic solver where servos moved the simulation.
inline constexpr Role kReached{"reached", "reached", "reference", RoleKind::kAfterwards, {}};
inline constexpr Role kSimulated{"simulated",
                                 "simulation",
                                 "MuJoCo",
                                 RoleKind::kEngine,
                                 {&kAnalytic, &kReference, &kSolver, &kReached}};
/// The simulation driven by perturbed forces: a measure of how errors grow, compared with nothing
/// else.
inline constexpr Role kPerturbed{"perturbed", "simulation", "MuJoCo", RoleKind::kEngine, {}};

}  // namespace role

/// In the order in which they run and are shown.
inline constexpr std::array kRoles = {&role::kAnalytic, &role::kReference, &role::kSimulated,
                                      &role::kSolver,   &role::kReached,   &role::kPerturbed};

/// The row of this name; null for what is not a witness.
[[nodiscard]] constexpr const Role* FindRole(std::string_view name) {
  for (const Role* role : kRoles) {
    if (name == *role) return role;
  }
  return nullptr;
}
[[nodiscard]] constexpr bool IsEngine(std::string_view name) {
  const Role* role = FindRole(name);
  return role != nullptr && role->is_engine();
}

/// `measured` is held against `truth`.
struct RolePair {
  const Role* measured = nullptr;
  const Role* truth = nullptr;
};

namespace internal {

constexpr size_t CountRolePairs() {
  size_t count = 0;
  for (const Role* truth : kRoles) {
    for (const Role* measured : kRoles) count += measured->IsHeldAgainst(*truth) ? 1 : 0;
  }
  return count;
}

// By truth; of those that are held against it, engines come first.
constexpr auto MakeRolePairs() {
  std::array<RolePair, CountRolePairs()> pairs{};
  size_t k = 0;
  for (const Role* truth : kRoles) {
    for (const bool engines : {true, false}) {
      for (const Role* measured : kRoles) {
        if (measured->is_engine() != engines || !measured->IsHeldAgainst(*truth)) continue;
        pairs[k++] = {measured, truth};
      }
    }
  }
  return pairs;
}

}  // namespace internal

/// All pairs that are compared, in the order in which they are shown.
inline constexpr auto kRolePairs = internal::MakeRolePairs();

/// Some pair is about it.
[[nodiscard]] constexpr bool IsCompared(const Role& role) {
  for (const RolePair& pair : kRolePairs) {
    if (pair.measured == &role || pair.truth == &role) return true;
  }
  return false;
}

/// The pairs that a reader looks at first, the most significant one first.
inline constexpr std::array<RolePair, 4> kMainPairs = {{{&role::kSimulated, &role::kReached},
                                                        {&role::kSimulated, &role::kAnalytic},
                                                        {&role::kSimulated, &role::kReference},
                                                        {&role::kReference, &role::kAnalytic}}};

/// "simulated_vs_analytic": the name of a pair in CSV, JSON and checks.
[[nodiscard]] inline std::string PairName(std::string_view measured, std::string_view truth) {
  return std::string(measured) + "_vs_" + std::string(truth);
}
[[nodiscard]] inline std::string PairName(const Role& measured, const Role& truth) {
  return PairName(measured.name, truth.name);
}

}  // namespace mbv
