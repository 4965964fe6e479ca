// The equations of a mechanism as formulas of its joints' coordinates: positions, loop closure with
// first and second derivatives, and inverse dynamics.
//
//   r(x) = 0,  ṙ = J u = 0,  r̈ = J u̇ + γ(x, u) = 0                                          (1)
//   u = G v,  f = Gᵀ τ(x, u, u̇)                                                              (2)
//   ḋ = D G v,  (D G)ᵀ τ_d = f                                                                (3)
//
// x: coordinates of the joints that make a tree, a unit quaternion w, x, y, z for a ball; u: their
// rates, a ball's angular velocity in its own axes on the child; r: what closes the loops, and what
// the chosen coordinates q are beyond x itself; v = q̇; τ: the force along each u that motion,
// weight, springs and force elements need, by Newton and Euler from body to body [Featherstone
// 2008, ch. 5 and 8]; d: the actuators. γ is the second derivative by symbolic differentiation.
// Rods whose spin is idle (mechanism/idle_spins.h) have a universal joint for one ball and no
// inertia about their line: nothing else changes by it.
//
// (1) falls into blocks that are solved one after the other: a matching of rows and rates, and the
// strongly connected parts of what it leads to [Duff, Reid 1978].
//
// This stands on the description of the mechanism (with its joint kinds' formulas,
// mechanism/joint_pose.h) and on nothing of kinematics/, analytic/ or reference/.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/code/formula_graph.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// One entry of u.
struct TreeRate {
  std::string name;
  bool length = false;  ///< [m/s], else [rad/s]
  int x = 0;            ///< its entry of x, or the first of four
  int ball = -1;        ///< 0…2: of a ball
};

struct RowFormula {
  Expr residual, rate;  ///< r [m/L or cosine or rad], ṙ with q at rest
  int coordinate = -1;  ///< of q that it commands: ṙ − weight q̇ = 0
  double weight = 0.0;
};

/// Rows and rates that are solved together, given those of the blocks before.
struct ClosureBlock {
  std::vector<int> rates;      ///< of u, m of them
  std::vector<int> known;      ///< of u: others in its rows
  std::vector<Expr> residual;  ///< m
  std::vector<Expr> columns;   ///< m × m by rows: ∂ṙ/∂u
  std::vector<Expr> others;    ///< m × known by rows
  std::vector<Expr> bias;      ///< m: γ
  std::vector<int> commanded;  ///< m: RowFormula::coordinate
  std::vector<double> weight;  ///< m
};

/// The loops closed for one choice of coordinates.
struct ClosureFormulas {
  std::vector<NamedCoordinate> coordinates;  ///< q, n of them
  std::vector<int> direct = {};              ///< per coordinate: the entry of u that it is, or −1
  std::vector<Expr> values = {};             ///< the coordinates' own, of x
  VecX home = {};
  std::vector<Expr> q = {};               ///< inputs "q[0]" …
  std::vector<ClosureBlock> blocks = {};  ///< in their order
  std::vector<Expr> gaps = {};            ///< all r, also what the blocks do not need
};

struct ActuatorFormula {
  std::string name, unit;
  Expr value = {};                               ///< d
  std::vector<std::pair<int, Expr>> rates = {};  ///< D: entries of u, factor
  Expr bias = {};                                ///< d̈ − D u̇
};

struct OutputFormula {
  std::string name;
  std::vector<Expr> pose;  ///< x, y, z, roll, pitch, yaw in its reference frame
};

struct MechanismFormulas {
  FormulaGraph graph;   ///< all below are its
  double length = 1.0;  ///< L: characteristic length [m]
  std::vector<TreeRate> rates;
  std::vector<Expr> x, u, du;  ///< inputs
  VecX x_home;
  ClosureFormulas closure;                        ///< for the chosen coordinates
  std::optional<ClosureFormulas> from_actuators;  ///< where the actuators alone hold it at home
  std::vector<NamedCoordinate> held;              ///< at home
  std::vector<ActuatorFormula> actuators;
  std::vector<Expr> forces;  ///< τ, per u; empty: `no_forces`
  std::string no_forces;     ///< why there are none
  std::vector<OutputFormula> outputs;

  [[nodiscard]] size_t size() const { return closure.coordinates.size(); }
};

/// `coordinates` and `held` determine the mechanism's position near home; `actuators` are drives
/// and prescribed joints. Refuses what formulas cannot say.
[[nodiscard]] std::unique_ptr<MechanismFormulas> MakeFormulas(
    const Mechanism& mechanism, const std::vector<NamedCoordinate>& coordinates,
    const std::vector<NamedCoordinate>& held, const std::vector<NamedCoordinate>& actuators,
    Diagnostics* diagnostics);

}  // namespace mbv
