#include "features/standin/standin.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "mechanism/spanning_tree.h"
#include "reference/reduced_model.h"

namespace mbv {
namespace {

constexpr size_t kNamed = 8;     // in a message at most
constexpr double kMoves = 1e-9;  // smaller shares of the largest rate are rounding

// Rates of a coordinate per unit of each column of T (ReducedModel::Motions()).
VecX RatesOf(const ScalarRow& row, const MatX& T) {
  VecX rates = VecX::Zero(T.cols());
  if (row.parent > 0) rates += T.middleRows<6>(6 * (row.parent - 1)).transpose() * row.J_parent;
  if (row.child > 0) rates += T.middleRows<6>(6 * (row.child - 1)).transpose() * row.J_child;
  return rates;
}

class TransmissionFinder {
 public:
  TransmissionFinder(const Mechanism& mechanism, const std::vector<std::string>& names,
                     Diagnostics* diagnostics)
      : mechanism_(mechanism), names_(names), diagnostics_(*diagnostics) {}

  std::optional<Transmission> Find() {
    if (!ReadJoints() || !CheckIndependent()) return std::nullopt;
    FindWay();
    if (!FindDrives() || !FindHeld()) return std::nullopt;
    FindLoopBodies();
    MakeParts();
    return std::move(found_);
  }

 private:
  bool Error(std::string message, std::string hint) {
    diagnostics_.AddError(mechanism_.file, std::move(message), std::move(hint));
    return false;
  }

  [[nodiscard]] const Joint& JointOf(const Coordinate& coordinate) const {
    return mechanism_.joints[static_cast<size_t>(coordinate.index)];
  }

  bool ReadJoints() {
    all_ = NamedJointCoordinates(mechanism_);
    const std::vector<std::string> known = NamesOf(all_);
    for (const std::string& name : names_) {
      const auto at = std::ranges::find(all_, name, &NamedCoordinate::name);
      if (at == all_.end()) {
        return Error("there is no joint coordinate '" + name + "'",
                     DidYouMean(name, known, "there are: " + Joined(known, kNamed)));
      }
      if (std::ranges::find(found_.joints, name, &NamedCoordinate::name) != found_.joints.end()) {
        return Error("'" + name + "' is chosen twice", "each joint once");
      }
      if (IsOfBall(JointOf(at->coordinate).kind, at->coordinate.component)) {
        return Error(
            "'" + name + "' is of a spherical joint: it has no axis that a serial joint could have",
            "choose joints with axes");
      }
      for (const Prescribed& prescribed : mechanism_.prescribed) {
        if (prescribed.joint == at->coordinate.index) {
          return Error("the motion of '" + name + "' is prescribed: no drive moves it",
                       "choose joints that drives move");
        }
      }
      found_.joints.push_back(*at);
    }
    if (names_.empty())
      return Error("no joints are chosen", "--joints A,B of: " + Joined(known, kNamed));
    return true;
  }

  // Prescribed joints first: they stay at home.
  [[nodiscard]] std::vector<NamedCoordinate> Fixed() const {
    std::vector<NamedCoordinate> fixed;
    for (size_t p = 0; p < mechanism_.prescribed.size(); ++p) {
      fixed.push_back(
          {mechanism_.prescribed[p].name, {Coordinate::Kind::kPrescribed, static_cast<int>(p), 0}});
    }
    return fixed;
  }
  [[nodiscard]] NamedCoordinate DriveCoordinate(int drive) const {
    return {mechanism_.drives[static_cast<size_t>(drive)].name,
            {Coordinate::Kind::kDrive, drive, 0}};
  }
  static void Append(const std::vector<NamedCoordinate>& more, std::vector<NamedCoordinate>* to) {
    to->insert(to->end(), more.begin(), more.end());
  }
  [[nodiscard]] CoordinateChoice Choose(const std::vector<NamedCoordinate>& candidates,
                                        size_t preferred) const {
    std::vector<Coordinate> coordinates;
    coordinates.reserve(candidates.size());
    for (const NamedCoordinate& named : candidates) coordinates.push_back(named.coordinate);
    return ChooseCoordinates(mechanism_, coordinates, preferred);
  }

  bool CheckIndependent() {
    std::vector<NamedCoordinate> candidates = Fixed();
    Append(found_.joints, &candidates);
    const size_t preferred = candidates.size();
    Append(all_, &candidates);
    std::vector<std::string> depend;
    for (const size_t k : Choose(candidates, preferred).dependent) {
      depend.push_back(candidates[k].name);
    }
    if (depend.empty()) return true;
    std::vector<NamedCoordinate> alone = Fixed();
    for (const NamedCoordinate& joint : found_.joints) {
      if (!Contains(depend, joint.name)) continue;
      alone.push_back(joint);
      if (!Choose(alone, alone.size()).dependent.empty()) {
        return Error("'" + joint.name + "' cannot move at home",
                     "choose joints that move, or another home pose (guesses of the model)");
      }
      alone.pop_back();
    }
    return Error(fmt::format("joints that depend on each other at home: {} on those before",
                             Joined(depend, kNamed)),
                 "leave out " + Joined(depend, kNamed));
  }

  // Those that move a chosen joint while all other drives hold.
  bool FindDrives() {
    std::vector<NamedCoordinate> candidates = Fixed();
    const size_t fixed = candidates.size();
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      candidates.push_back(DriveCoordinate(static_cast<int>(d)));
    }
    const size_t preferred = candidates.size();
    Append(all_, &candidates);
    const CoordinateChoice choice = Choose(candidates, preferred);
    std::vector<NamedCoordinate> chosen;
    std::vector<Coordinate> coordinates;
    for (const size_t k : choice.chosen) {
      if (k < fixed) continue;
      chosen.push_back(candidates[k]);
      coordinates.push_back(candidates[k].coordinate);
    }
    ReducedModel model(mechanism_, coordinates);
    const VecX still = VecX::Zero(model.size());
    MatX T;
    RunSummary summary = model.Move(model.home(), still, still);
    if (summary.ok()) summary = model.Motions(&T);
    if (!summary.ok()) return Error("at home: " + summary.message, "move the home pose (guesses)");
    std::set<Eigen::Index> movers;
    for (const NamedCoordinate& joint : found_.joints) {
      const VecX rates = RatesOf(CoordinateRow(mechanism_, joint.coordinate, model.states()), T);
      const double largest = rates.size() > 0 ? rates.cwiseAbs().maxCoeff() : 0.0;
      for (Eigen::Index k = 0; k < rates.size(); ++k) {
        if (std::abs(rates[k]) > kMoves * largest) movers.insert(k);
      }
    }
    std::vector<std::string> drives, passive;
    for (const Eigen::Index k : movers) {
      const NamedCoordinate& mover = chosen[static_cast<size_t>(k)];
      const bool drive = mover.coordinate.kind == Coordinate::Kind::kDrive;
      (drive ? drives : passive).push_back(mover.name);
      if (drive) found_.drives.push_back(mover.coordinate.index);
    }
    if (!passive.empty()) return RefusePassive(passive);
    if (!RefuseRedundant(choice, candidates, fixed, model.DriveRates(T), movers)) return false;
    if (found_.drives.size() == found_.joints.size()) return true;
    if (drives.empty()) return Error("no drive moves " + Joined(names_), "choose driven joints");
    if (HoldDrivesAbove(chosen, movers, T, model.states())) return true;
    return Error(fmt::format("{} drives move the {} chosen joint{}: {}", drives.size(),
                             names_.size(), names_.size() == 1 ? "" : "s", Joined(drives, kNamed)),
                 SetThatDoes());
  }

  // `passive`: coordinates without a drive that move the chosen joints.
  bool RefusePassive(const std::vector<std::string>& passive) {
    if (mechanism_.drives.empty()) {
      return Error("the robot has no drive: what moves " + Joined(names_, kNamed) + " is not known",
                   "name its motors: <actuator> in MJCF, name_mot or <transmission> with a URDF, a "
                   "<plugin> in SDF, drives in a model.yaml");
    }
    std::string hint =
        Joined(passive, kNamed) + ": a drive, or fixed (joint_type of a closure file)";
    std::vector<std::string> loose;
    for (const Drive& drive : mechanism_.drives) {
      if (EndsLoose(drive)) loose.push_back(drive.name);
    }
    if (!loose.empty()) {
      hint = Joined(loose, kNamed) + (loose.size() == 1 ? " moves" : " move") +
             " no loop and no chosen joint: is a loop closure missing in the robot's file? Else " +
             hint;
    }
    return Error(fmt::format("no drive holds {}, which {} the chosen joints",
                             Joined(passive, kNamed), passive.size() == 1 ? "moves" : "move"),
                 hint);
  }

  // Its joint is neither in a loop nor on the way to a chosen joint.
  [[nodiscard]] bool EndsLoose(const Drive& drive) const {
    const auto* on = std::get_if<JointDrive>(&drive.kind);
    if (on == nullptr) return false;
    for (size_t b = 0; b < found_.kept.size(); ++b) {
      if (found_.kept[b] && found_.toward_world[b] == on->joint) return false;
    }
    return std::ranges::none_of(LoopGroups(mechanism_), [&](const LoopGroup& group) {
      return std::ranges::count(group.joints, on->joint) > 0;
    });
  }

  // Of drives too many, those stay at home that also move joints between the world and the chosen
  // ones: the knee above an ankle whose rods pass it.
  bool HoldDrivesAbove(const std::vector<NamedCoordinate>& chosen,
                       const std::set<Eigen::Index>& movers, const MatX& T,
                       const BodyStates& states) {
    std::set<Eigen::Index> above;
    std::vector<std::string> joints;
    for (size_t b = 1; b < found_.kept.size(); ++b) {
      const int j = found_.kept[b] ? found_.toward_world[b] : -1;
      if (j < 0 || IsChosen(j)) continue;
      const Joint& joint = mechanism_.joints[static_cast<size_t>(j)];
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        const VecX rates = RatesOf(JointCoordinateRow(joint, c, states), T);
        const size_t before = above.size();
        for (const Eigen::Index k : movers) {
          if (std::abs(rates[k]) > kMoves * rates.cwiseAbs().maxCoeff()) above.insert(k);
        }
        if (above.size() > before) joints.push_back(joint.name);
      }
    }
    if (movers.size() - above.size() != found_.joints.size()) return false;
    std::vector<NamedCoordinate> candidates = Fixed();
    std::vector<std::string> held;
    std::vector<int> drives;
    for (const Eigen::Index k : movers) {
      const NamedCoordinate& mover = chosen[static_cast<size_t>(k)];
      if (!above.contains(k)) {
        drives.push_back(mover.coordinate.index);
        continue;
      }
      held.push_back(mover.name);
      candidates.push_back(mover);
    }
    Append(found_.joints, &candidates);
    if (!Choose(candidates, candidates.size()).dependent.empty()) return false;
    found_.drives = std::move(drives);
    found_.notes.push_back(
        fmt::format("{} {} the chosen joints, too, and {} at home: choose {} as "
                    "well to have both move",
                    Joined(held), held.size() == 1 ? "moves" : "move",
                    held.size() == 1 ? "stays" : "stay", Joined(joints)));
    return true;
  }

  [[nodiscard]] bool IsChosen(int joint) const {
    return std::ranges::any_of(found_.joints, [&](const NamedCoordinate& chosen) {
      return chosen.coordinate.index == joint;
    });
  }

  // A drive that is no coordinate and moves with those that are.
  bool RefuseRedundant(const CoordinateChoice& choice,
                       const std::vector<NamedCoordinate>& candidates, size_t fixed,
                       const MatX& rates, const std::set<Eigen::Index>& movers) {
    for (const size_t k : choice.dependent) {
      if (k < fixed) continue;
      const VecX row = rates.row(candidates[k].coordinate.index).transpose();
      for (const Eigen::Index mover : movers) {
        if (std::abs(row[mover]) <= kMoves * row.cwiseAbs().maxCoeff()) continue;
        return Error(fmt::format("drive '{}' moves with the others: how redundant drives share "
                                 "the torque is a choice, no property of the transmission",
                                 candidates[k].name),
                     "a model with as many drives as degrees of freedom");
      }
    }
    return true;
  }

  [[nodiscard]] std::vector<NamedCoordinate> OtherDrives() const {
    std::vector<NamedCoordinate> others;
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      const int drive = static_cast<int>(d);
      if (std::ranges::find(found_.drives, drive) == found_.drives.end()) {
        others.push_back(DriveCoordinate(drive));
      }
    }
    return others;
  }

  [[nodiscard]] std::string SetThatDoes() const {
    std::vector<NamedCoordinate> candidates = Fixed();
    Append(OtherDrives(), &candidates);
    const size_t others = candidates.size();
    Append(found_.joints, &candidates);
    // Of the others first those at the same bodies as the chosen ones.
    std::vector<NamedCoordinate> others_by_distance[2];
    for (const NamedCoordinate& named : all_) {
      const Joint& joint = JointOf(named.coordinate);
      bool driven = false, beside = false;
      for (const Drive& drive : mechanism_.drives) {
        const auto* on = std::get_if<JointDrive>(&drive.kind);
        driven = driven || (on != nullptr && on->joint == named.coordinate.index);
      }
      for (const NamedCoordinate& chosen : found_.joints) {
        const Joint& own = JointOf(chosen.coordinate);
        for (const int body : {own.parent, own.child}) {
          beside = beside || (body > 0 && (joint.parent == body || joint.child == body));
        }
      }
      if (driven || IsOfBall(joint.kind, named.coordinate.component)) continue;
      others_by_distance[beside ? 0 : 1].push_back(named);
    }
    for (const auto& near : others_by_distance) Append(near, &candidates);
    std::vector<std::string> would_do;
    for (const size_t k : Choose(candidates, candidates.size()).chosen) {
      if (k >= others && would_do.size() < found_.drives.size()) {
        would_do.push_back(candidates[k].name);
      }
    }
    if (would_do.size() < found_.drives.size()) return "choose as many joints as drives";
    return "a set that does: " + Joined(would_do);
  }

  bool FindHeld() {
    std::vector<NamedCoordinate> candidates = Fixed();
    const size_t fixed = candidates.size();
    Append(found_.joints, &candidates);
    const size_t own = candidates.size();
    Append(OtherDrives(), &candidates);
    const size_t preferred = candidates.size();
    Append(all_, &candidates);
    const CoordinateChoice choice = Choose(candidates, preferred);
    for (const size_t k : choice.chosen) {
      if (k >= own) found_.held.push_back(candidates[k]);
    }
    for (const size_t k : choice.chosen) {
      if (k < fixed)
        found_.notes.push_back("prescribed '" + candidates[k].name + "' stays at home");
    }
    for (const int d : found_.drives) {
      const Drive& drive = mechanism_.drives[static_cast<size_t>(d)];
      CoordinateRange range = drive.range;
      if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
        const CoordinateRange& joint = mechanism_.joints[static_cast<size_t>(on->joint)]
                                           .range[static_cast<size_t>(on->coordinate)];
        range.lower = std::max(range.lower, joint.lower);
        range.upper = std::min(range.upper, joint.upper);
      }
      found_.ranges.push_back(range);
    }
    return true;
  }

  // Joints and couplings as edges between bodies.
  [[nodiscard]] std::vector<std::array<int, 2>> Edges() const {
    std::vector<std::array<int, 2>> edges;
    for (const Joint& joint : mechanism_.joints) edges.push_back({joint.parent, joint.child});
    for (const Coupling& coupling : mechanism_.couplings) {
      for (size_t k = 1; k < coupling.terms.size(); ++k) {
        const auto child = [&](size_t term) {
          return mechanism_.joints[static_cast<size_t>(coupling.terms[term].joint)].child;
        };
        edges.push_back({child(0), child(k)});
      }
    }
    return edges;
  }

  // A serial model keeps the bodies on the way from the world to the chosen joints, by the fewest
  // joints that are not chosen themselves.
  void FindWay() {
    const std::vector<std::array<int, 2>> edges = Edges();
    const size_t bodies = mechanism_.bodies.size();
    constexpr int kFar = 1 << 30;
    std::vector<int> distance(bodies, kFar);
    before_.assign(bodies, -1);
    found_.toward_world.assign(bodies, -1);
    distance[0] = 0;
    for (bool better = true; better;) {
      better = false;
      for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
        const int cost = IsChosen(static_cast<int>(j)) ? 0 : 1;
        for (const auto& [from, to] :
             {std::pair(edges[j][0], edges[j][1]), std::pair(edges[j][1], edges[j][0])}) {
          const auto f = static_cast<size_t>(from), t = static_cast<size_t>(to);
          if (distance[f] == kFar || distance[f] + cost >= distance[t]) continue;
          distance[t] = distance[f] + cost;
          before_[t] = from;
          found_.toward_world[t] = static_cast<int>(j);
          better = true;
        }
      }
    }
    found_.kept.assign(bodies, false);
    found_.kept[0] = true;
    for (const NamedCoordinate& chosen : found_.joints) {
      const Joint& joint = JointOf(chosen.coordinate);
      for (int b : {joint.parent, joint.child}) {
        for (; b > 0; b = before_[static_cast<size_t>(b)])
          found_.kept[static_cast<size_t>(b)] = true;
      }
    }
  }

  // What is tied to two of the kept bodies with a chosen joint between closes a loop over it.
  void FindLoopBodies() {
    const std::vector<std::array<int, 2>> edges = Edges();
    const std::vector<bool>& kept = found_.kept;
    const size_t bodies = mechanism_.bodies.size();
    const auto chosen_before = [&](int b) {
      std::set<int> on_way;
      for (; b > 0; b = before_[static_cast<size_t>(b)]) {
        const int by = found_.toward_world[static_cast<size_t>(b)];
        if (IsChosen(by)) on_way.insert(by);
      }
      return on_way;
    };
    std::vector<bool> seen = kept;
    for (size_t start = 0; start < bodies; ++start) {
      if (seen[start]) continue;
      std::vector<int> group = {static_cast<int>(start)};
      std::set<std::set<int>> ends;
      seen[start] = true;
      for (size_t k = 0; k < group.size(); ++k) {
        for (const auto& edge : edges) {
          if (edge[0] != group[k] && edge[1] != group[k]) continue;
          const int other = edge[0] == group[k] ? edge[1] : edge[0];
          if (kept[static_cast<size_t>(other)]) ends.insert(chosen_before(other));
          if (seen[static_cast<size_t>(other)]) continue;
          seen[static_cast<size_t>(other)] = true;
          group.push_back(other);
        }
      }
      if (ends.size() < 2) continue;
      found_.loop_bodies.insert(found_.loop_bodies.end(), group.begin(), group.end());
    }
    std::ranges::sort(found_.loop_bodies);
  }

  void MakeParts() {
    Mechanism& full = found_.full;
    full = mechanism_;
    bool by_load = false, compensates = false;
    for (ForceElement& element : full.elements) {
      auto* friction = std::get_if<FrictionLaw>(&element.law);
      if (friction == nullptr || friction->coefficient == 0.0) continue;
      friction->coefficient = friction->skew = 0.0;
      by_load = true;
    }
    if (by_load) {
      found_.notes.emplace_back("friction that grows with a joint's load is left out");
    }
    for (Drive& drive : full.drives) {
      compensates = compensates || drive.compensates_gravity;
      drive.compensates_gravity = false;
    }
    if (compensates) {
      found_.notes.emplace_back("gravity compensation is counted beside the drives' forces");
    }
    for (const Motor& motor : full.motors) {
      if (!(motor.rotor_inertia > 0.0)) continue;
      ForceElement rotor{
          .name = full.drives[static_cast<size_t>(motor.drive)].name + " rotor",
          .law = RotorLaw{.inertia = motor.rotor_inertia, .ratio = motor.gear_ratio}};
      if (const auto* on =
              std::get_if<JointDrive>(&full.drives[static_cast<size_t>(motor.drive)].kind)) {
        rotor.joint = on->joint;
        rotor.coordinate = on->coordinate;
      } else {
        rotor.drive = motor.drive;
      }
      full.elements.push_back(std::move(rotor));
    }
    found_.without_rotors = full;
    std::erase_if(found_.without_rotors.elements, [](const ForceElement& element) {
      return std::holds_alternative<RotorLaw>(element.law);
    });
    std::vector<bool> loop(full.bodies.size(), false);
    for (const int b : found_.loop_bodies) loop[static_cast<size_t>(b)] = true;
    const auto in_loop = [&](int parent, int child) {
      return loop[static_cast<size_t>(parent)] || loop[static_cast<size_t>(child)];
    };
    Mechanism& serial = found_.serial;
    serial = found_.without_rotors;
    std::erase_if(serial.elements, [&](const ForceElement& element) {
      if (element.joint >= 0) {
        const Joint& joint = full.joints[static_cast<size_t>(element.joint)];
        return in_loop(joint.parent, joint.child);
      }
      if (element.drive >= 0) {
        return std::ranges::find(found_.drives, element.drive) != found_.drives.end();
      }
      if (element.spring >= 0) return false;  // goes with its spring
      const Bushing& bushing = full.bushings[static_cast<size_t>(element.bushing)];
      return in_loop(bushing.parent, bushing.child);
    });
    EraseSprings(&serial, [&](const SpringDamper& spring) {
      return in_loop(spring.body_from, spring.body_to);
    });
    Mechanism& inertia = found_.loop_inertia;
    inertia = serial;
    inertia.elements.clear();
    inertia.springs.clear();
    inertia.gravity_W.setZero();
    for (size_t b = 0; b < full.bodies.size(); ++b) {
      Body& body = loop[b] ? serial.bodies[b] : inertia.bodies[b];
      body.mass = 0.0;
      body.I_Bcm_B.setZero();
    }
  }

  const Mechanism& mechanism_;
  const std::vector<std::string>& names_;
  Diagnostics& diagnostics_;
  std::vector<NamedCoordinate> all_;
  std::vector<int> before_;  // per body: the one towards the world
  Transmission found_;
};

// Joints that move with the chosen ones: those of their loops, of the drives', and what couplings
// tie to these.
std::vector<bool> MovingJoints(const Mechanism& mechanism, const Transmission& transmission) {
  std::vector<std::vector<int>> ties;
  for (const LoopGroup& group : LoopGroups(mechanism)) {
    ties.push_back(group.joints);
    ties.back().insert(ties.back().end(), group.closures.begin(), group.closures.end());
  }
  for (const Coupling& coupling : mechanism.couplings) {
    ties.emplace_back();
    for (const Coupling::Term& term : coupling.terms) ties.back().push_back(term.joint);
  }
  std::vector<bool> moving(mechanism.joints.size(), false);
  for (const NamedCoordinate& joint : transmission.joints) {
    moving[static_cast<size_t>(joint.coordinate.index)] = true;
  }
  for (const int d : transmission.drives) {
    const auto* on = std::get_if<JointDrive>(&mechanism.drives[static_cast<size_t>(d)].kind);
    if (on != nullptr) moving[static_cast<size_t>(on->joint)] = true;
  }
  for (bool more = true; more;) {
    more = false;
    for (const std::vector<int>& tie : ties) {
      const auto moves = [&](int j) { return bool{moving[static_cast<size_t>(j)]}; };
      if (std::ranges::none_of(tie, moves) || std::ranges::all_of(tie, moves)) continue;
      for (const int j : tie) moving[static_cast<size_t>(j)] = true;
      more = true;
    }
  }
  return moving;
}

}  // namespace

std::vector<Coordinate> Transmission::coordinates() const {
  std::vector<Coordinate> coordinates;
  for (const auto* named : {&joints, &held}) {
    for (const NamedCoordinate& coordinate : *named) coordinates.push_back(coordinate.coordinate);
  }
  return coordinates;
}

std::optional<Transmission> FindTransmission(const Mechanism& mechanism,
                                             const std::vector<std::string>& names,
                                             Diagnostics* diagnostics) {
  return TransmissionFinder(mechanism, names, diagnostics).Find();
}

Mechanism MovingPart(const Mechanism& mechanism, const Transmission& transmission) {
  // A held length may tie any two bodies.
  for (const Drive& drive : mechanism.drives) {
    if (std::holds_alternative<DistanceDrive>(drive.kind)) return mechanism;
  }
  const std::vector<bool> moving = MovingJoints(mechanism, transmission);
  std::vector<int> body_at(mechanism.bodies.size(), -1);  // new index
  Mechanism part = mechanism;
  part.outputs.clear();
  part.contacts.clear();
  part.beams.clear();
  part.bodies.resize(1);
  part.X_WB_home.resize(1);
  body_at[0] = 0;
  for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
    const auto outboard = static_cast<size_t>(OutboardBody(mechanism, t));
    const bool still = body_at[static_cast<size_t>(InboardBody(mechanism, t))] == 0 &&
                       !moving[static_cast<size_t>(mechanism.tree_joints[t])];
    body_at[outboard] = still ? 0 : static_cast<int>(part.bodies.size());
    if (still) continue;
    part.bodies.push_back(mechanism.bodies[outboard]);
    part.X_WB_home.push_back(mechanism.X_WB_home[outboard]);
  }
  // Of a place on a body; on one that is still, it is in the world.
  const auto move = [&](int* body, const auto& shift) {
    const auto old = static_cast<size_t>(*body);
    *body = body_at[old];
    if (*body == 0) shift(mechanism.X_WB_home[old]);
  };
  const auto move_pose = [&](int* body, Pose* X_BF) {
    move(body, [&](const Pose& X_WB) { *X_BF = X_WB * *X_BF; });
  };
  const auto move_point = [&](int* body, Vec3* p_B) {
    move(body, [&](const Pose& X_WB) { *p_B = X_WB * *p_B; });
  };
  // Keeps what `change` returns true for, and says where it went.
  const auto keep = [](auto* list, const auto& change) {
    std::vector<int> at(list->size(), -1);
    size_t kept = 0;
    for (size_t k = 0; k < list->size(); ++k) {
      if (!change(&(*list)[k])) continue;
      at[k] = static_cast<int>(kept);
      if (kept != k) (*list)[kept] = std::move((*list)[k]);
      ++kept;
    }
    list->resize(kept);
    return at;
  };
  const auto follow = [](const std::vector<int>& at, int* index) {
    if (*index >= 0) *index = at[static_cast<size_t>(*index)];
    return *index >= 0;
  };
  const std::vector<int> joint_at = keep(&part.joints, [&](Joint* joint) {
    move_pose(&joint->parent, &joint->X_PF);
    move_pose(&joint->child, &joint->X_CM);
    return joint->parent != joint->child;
  });
  const std::vector<int> drive_at = keep(&part.drives, [&](Drive* drive) {
    return follow(joint_at, &std::get<JointDrive>(drive->kind).joint);
  });
  const std::vector<int> bushing_at = keep(&part.bushings, [&](Bushing* bushing) {
    move_pose(&bushing->parent, &bushing->X_PF);
    move_pose(&bushing->child, &bushing->X_CM);
    return bushing->parent != bushing->child;
  });
  keep(&part.prescribed, [&](Prescribed* one) { return follow(joint_at, &one->joint); });
  keep(&part.motors, [&](Motor* motor) { return follow(drive_at, &motor->drive); });
  const std::vector<int> spring_at = keep(&part.springs, [&](SpringDamper* spring) {
    move_point(&spring->body_from, &spring->p_from);
    move_point(&spring->body_to, &spring->p_to);
    return spring->body_from != spring->body_to;
  });
  keep(&part.couplings, [&](Coupling* coupling) {
    return std::ranges::all_of(coupling->terms,
                               [&](Coupling::Term& term) { return follow(joint_at, &term.joint); });
  });
  keep(&part.elements, [&](ForceElement* element) {
    if (auto* rotor = std::get_if<RotorLaw>(&element->law); rotor != nullptr && rotor->carrier) {
      move(&rotor->carrier->body, [&](const Pose& X_WB) {
        rotor->carrier->axis_B = X_WB.linear() * rotor->carrier->axis_B;
      });
    }
    return follow(joint_at, &element->joint) || follow(drive_at, &element->drive) ||
           follow(bushing_at, &element->bushing) || follow(spring_at, &element->spring);
  });
  return BuildSpanningTree(&part).ok() ? part : mechanism;
}

}  // namespace mbv
