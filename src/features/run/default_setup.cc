#include "features/run/default_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/text.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "mechanism/idle_spins.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "model_file/write_model.h"
#include "reference/reference.h"
#include "verify/model_text.h"
#include "verify/ranges.h"

namespace mbv {
namespace {

constexpr size_t kMostNames = 6;

bool StandsOnFeet(const Mechanism& m) {
  return std::ranges::any_of(m.contacts, [](const Contact& contact) { return contact.joint >= 0; });
}

bool IsContact(const Mechanism& m, size_t joint) {
  return std::ranges::any_of(m.contacts, [joint](const Contact& contact) {
    return contact.joint == static_cast<int>(joint);
  });
}

struct Candidates {
  std::vector<Coordinate> coordinates;
  size_t makeshift = 0;  ///< index of the first that the robot has no hinge or slide for
};

// The drives' coordinates, then all others that can be driven: hinges and slides first.
Candidates CandidatesOf(const Mechanism& m) {
  Candidates candidates;
  std::vector<Coordinate> others;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    candidates.coordinates.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  for (size_t j = 0; j < m.joints.size(); ++j) {
    // Nothing is there that a drive could act on.
    if (m.joints[j].kind == JointKind::kFree || IsContact(m, j)) continue;
    const bool usual = DofsOf(m.joints[j].kind) == 1 && !m.joints[j].closure;
    for (int c = 0; c < DofsOf(m.joints[j].kind); ++c) {
      const bool driven = std::any_of(m.drives.begin(), m.drives.end(), [&](const Drive& drive) {
        const auto* on = std::get_if<JointDrive>(&drive.kind);
        return on != nullptr && on->joint == static_cast<int>(j) && on->coordinate == c;
      });
      if (!driven && !IsOfBall(m.joints[j].kind, c)) {
        (usual ? candidates.coordinates : others)
            .push_back({Coordinate::Kind::kJoint, static_cast<int>(j), c});
      }
    }
  }
  candidates.makeshift = candidates.coordinates.size();
  candidates.coordinates.insert(candidates.coordinates.end(), others.begin(), others.end());
  return candidates;
}

Drive DriveOn(const Mechanism& m, const Coordinate& coordinate) {
  const Joint& joint = m.joints[coordinate.index];
  Drive drive{.name = joint.name,
              .kind = JointDrive{coordinate.index, coordinate.component},
              .range = joint.range[coordinate.component]};
  if (DofsOf(joint.kind) > 1) drive.name += fmt::format("_{}", coordinate.component);
  return drive;
}

// A ball becomes a universal joint that does not turn about a direction at home. Its axes stay at
// right angles, so that damping and rotors of its rotation are the same along both coordinates;
// friction is limited about these axes instead of the child's.
void HoldAbout(const Vec3& n_W, int ball, Mechanism* m) {
  Mat3 E;
  E.col(2) = n_W.normalized();
  E.col(0) = E.col(2).unitOrthogonal();
  E.col(1) = E.col(2).cross(E.col(0));
  Joint& joint = m->joints[static_cast<size_t>(ball)];
  joint.kind = JointKind::kUniversal;
  joint.axis = Vec3::UnitX();
  joint.axis2 = Vec3::UnitY();
  joint.X_PF.linear() = m->X_WB_home[joint.parent].linear().transpose() * E;
  joint.X_CM.linear() = m->X_WB_home[joint.child].linear().transpose() * E;
  joint.guess = joint.home = {};
  joint.range = {};
  joint.max_rotation = std::numeric_limits<double>::infinity();
  std::erase_if(m->elements, [ball](const ForceElement& element) {
    return element.joint == ball && element.coordinate == 2;
  });
}

// A free body that moves in this motion is held where it is; false without one.
bool HoldFloating(const std::vector<Vec6>& motion, Mechanism* m) {
  for (Joint& joint : m->joints) {
    const Vec6 moves = motion[joint.child] - motion[joint.parent];
    if (joint.kind != JointKind::kFree || moves.norm() < 1e-3) continue;
    joint.kind = JointKind::kFixed;
    joint.X_PF = m->X_WB_home[joint.parent].inverse() * m->X_WB_home[joint.child];
    joint.X_CM = Pose::Identity();
    joint.guess = joint.home = {};
    joint.range = {};
    const auto held = static_cast<int>(&joint - m->joints.data());
    std::erase_if(m->elements,
                  [held](const ForceElement& element) { return element.joint == held; });
    return true;
  }
  return false;
}

// A ball that turns in this motion is held about it; false without one.
bool HoldTurn(const std::vector<Vec6>& motion, Mechanism* m) {
  for (size_t j = 0; j < m->joints.size(); ++j) {
    const Joint& joint = m->joints[j];
    if (joint.kind != JointKind::kSpherical) continue;
    const Vec3 turn = motion[joint.child].head<3>() - motion[joint.parent].head<3>();
    if (turn.norm() < 1e-3) continue;
    HoldAbout(turn, static_cast<int>(j), m);
    return true;
  }
  return false;
}

// Spins of rods between two balls that are not quite symmetric about their lines, or whose balls
// damp them: in a robot friction holds them, and here one of their balls does, if there is one
// whose rotation no force acts on.
std::vector<ModelCaveat> HoldUnevenSpins(Mechanism* m) {
  std::vector<Spin> spins = FindSpins(*m);
  std::erase_if(spins, [](const Spin& spin) { return spin.why_not.empty(); });
  if (spins.empty()) return {};
  const auto is_bare = [m](int ball) {
    return std::ranges::none_of(
        m->elements, [ball](const ForceElement& element) { return element.joint == ball; });
  };
  std::vector<std::string> names;
  for (const Spin& spin : spins) {
    const Vec3 n_W = m->X_WB_home[static_cast<size_t>(spin.bodies[0])].linear() * spin.n_B;
    HoldAbout(n_W,
              is_bare(spin.balls[0]) || !is_bare(spin.balls[1]) ? spin.balls[0] : spin.balls[1], m);
    names.push_back(spin.name);
  }
  return {{.kind = ModelCaveat::Kind::kLeftOut,
           .text = fmt::format(
               "the free spin of {} about the line{} between {} spherical joints is left out: "
               "one of each, a universal joint here, bears the moment about the line",
               Joined(names, kMostNames), names.size() == 1 ? "" : "s",
               names.size() == 1 ? "its" : "their"),
           .source = "ball"}};
}

// The mechanism with balls, or else floating bodies, held where no drive holds them: for a look at
// where the drives lead.
Mechanism WithTurnsHeld(const Mechanism& mechanism) {
  Mechanism m = mechanism;
  std::vector<Coordinate> drives;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    drives.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  for (std::vector<Vec6> free = FreeMotion(m, drives); !free.empty();
       free = FreeMotion(m, drives)) {
    if (!HoldTurn(free, &m) && !HoldFloating(free, &m)) break;
  }
  return m;
}

// Rotations of balls, and coordinates of free bodies, that stay when `held` are held, as
// independent coordinates.
std::vector<Coordinate> TurnsLeft(const Mechanism& m, const std::vector<Coordinate>& held) {
  std::vector<Coordinate> candidates = held;
  for (size_t j = 0; j < m.joints.size(); ++j) {
    for (int c = 0; c < DofsOf(m.joints[j].kind); ++c) {
      if (!IsOfBall(m.joints[j].kind, c) && m.joints[j].kind != JointKind::kFree) continue;
      candidates.push_back({Coordinate::Kind::kJoint, static_cast<int>(j), c});
    }
  }
  std::vector<Coordinate> turns;
  for (const size_t k : ChooseCoordinates(m, candidates, held.size()).chosen) {
    if (k >= held.size()) turns.push_back(candidates[k]);
  }
  return turns;
}

// "J.0, J.1 …", as a scenario names start values.
std::vector<std::string> StartNames(const Mechanism& m, const std::vector<Coordinate>& turns) {
  std::vector<std::string> names;
  names.reserve(turns.size());
  for (const Coordinate& turn : turns) {
    names.push_back(
        fmt::format("{}.{}", m.joints[static_cast<size_t>(turn.index)].name, turn.component));
  }
  return names;
}

std::string ByForcesNote(const Mechanism& m, const std::vector<Coordinate>& turns) {
  std::string text =
      fmt::format("{} degree{} of freedom that no drive on a joint can hold move{} by forces: {}",
                  turns.size(), turns.size() == 1 ? "" : "s", turns.size() == 1 ? "s" : "",
                  Joined(StartNames(m, turns), kMostNames));
  std::vector<std::string> spins;
  for (const Spin& spin : FindSpins(m)) {
    if (spin.why_not.empty()) continue;
    spins.push_back(fmt::format("{} ({})", spin.name, spin.why_not));
  }
  if (!spins.empty()) {
    text += "; these spins between two spherical joints are not idle: " + Joined(spins, kMostNames);
  }
  return text;
}

// Without outputs nothing shows how balls turn and free bodies move. Idle spins stay idle without
// one.
void AddOutputs(Mechanism* m) {
  if (!m->outputs.empty()) return;
  std::vector<bool> shown(m->bodies.size(), false);
  for (const Joint& joint : m->joints) {
    if (!HasBall(joint.kind)) continue;
    for (const int b : {joint.parent, joint.child}) shown[static_cast<size_t>(b)] = b != 0;
  }
  for (const Spin& spin : IdleSpins(*m)) {
    for (const int b : spin.bodies) shown[static_cast<size_t>(b)] = false;
  }
  for (size_t b = 1; b < shown.size(); ++b) {
    if (!shown[b]) continue;
    m->outputs.push_back({.name = m->bodies[b].name,
                          .body = static_cast<int>(b),
                          .X_BO = Pose::Identity(),
                          .reference_body = 0,
                          .X_RbR = Pose::Identity()});
  }
}

// The bodies that float but for their feet: what a motion of a robot on its feet is about.
void AddBases(Mechanism* m) {
  if (!StandsOnFeet(*m)) return;
  for (const Joint& joint : m->joints) {
    if (joint.kind != JointKind::kFree || joint.parent != 0) continue;
    const bool known = std::ranges::any_of(
        m->outputs, [&](const Output& output) { return output.body == joint.child; });
    if (known) continue;
    m->outputs.push_back({.name = m->bodies[static_cast<size_t>(joint.child)].name,
                          .body = joint.child,
                          .X_BO = Pose::Identity(),
                          .reference_body = 0,
                          .X_RbR = Pose::Identity()});
  }
}

// What a first motion commands: the drives, or, where feet make them depend on each other, the
// bases and what these leave free.
std::vector<Coordinate> Commanded(const Mechanism& m, bool by_forces) {
  std::vector<Coordinate> drives, candidates;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    drives.push_back({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
  }
  if (!StandsOnFeet(m)) return drives;
  for (size_t o = 0; o < m.outputs.size() && !by_forces; ++o) {
    const bool floats = std::ranges::any_of(m.joints, [&](const Joint& joint) {
      return joint.kind == JointKind::kFree && joint.child == m.outputs[o].body;
    });
    for (int c = 0; c < 6 && floats; ++c) {
      candidates.push_back({Coordinate::Kind::kOutput, static_cast<int>(o), c});
    }
  }
  candidates.insert(candidates.end(), drives.begin(), drives.end());
  std::vector<Coordinate> chosen;
  for (const size_t k : ChooseCoordinates(m, candidates, candidates.size()).chosen) {
    chosen.push_back(candidates[k]);
  }
  return chosen;
}

// How fast the bodies are against the drives.
double Quickness(const Mechanism& m, const ReferenceSample& sample, double length) {
  double fastest = 0.0;
  for (const Vec6& V : sample.states.V_WB) {
    fastest = std::max({fastest, V.head<3>().norm(), V.tail<3>().norm() / length});
  }
  double drives = 0.0;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    const double rate = sample.driven.velocity[static_cast<Eigen::Index>(d)];
    drives = std::max(drives, std::abs(rate) / (PositionUnit(m, m.drives[d]) == "m" ? length : 1));
  }
  return drives > 0.0 ? fastest / drives : 0.0;
}

class MotionSearch {
 public:
  MotionSearch(const Mechanism& m, const std::vector<Coordinate>& commanded,
               const std::vector<std::string>& resting)
      : m_(m), length_(CharacteristicLength(m)) {
    BodyStates home;
    home.Resize(m.bodies.size());
    home.X_WB = m.X_WB_home;
    motion_.beyond_ranges = !IsWithinRanges(m, m.X_WB_home);
    motion_.duration_s = 1.0;
    motion_.coordinates = commanded;
    for (const Coordinate& coordinate : commanded) {
      const auto d = static_cast<size_t>(coordinate.index);
      motion_.strokes.push_back(coordinate.kind == Coordinate::Kind::kDrive
                                    ? FullStroke(d, DriveRow(m, m.drives[d], home).value,
                                                 Contains(resting, m.drives[d].name))
                                    : StrokeOfBase(coordinate));
    }
  }

  FirstMotion Run() {
    std::vector<DriveStroke> full = motion_.strokes;
    constexpr int kHalvings = 7;
    // At the smallest motion the bodies are as fast as at home.
    const auto scaled = [&](double scale) {
      for (size_t d = 0; d < full.size(); ++d) {
        motion_.strokes[d].height = scale * full[d].height;
      }
    };
    scaled(std::ldexp(1.0, -kHalvings));
    Course at_home;
    if (!Follow({}, &at_home)) {
      if (!left_range_) return motion_;
      TurnToWhereRoomIs(std::ldexp(1.0, -kHalvings), &full);
      scaled(std::ldexp(1.0, -kHalvings));
      if (!Follow({}, &at_home)) return motion_;
    }
    const Course limit{.quickest = kMostQuicker * at_home.quickest,
                       .weakest = at_home.weakest / kMostQuicker};
    for (int i = 0; i <= kHalvings; ++i) {
      scaled(std::ldexp(1.0, -i));
      Course course;
      if (!Follow(limit, &course)) continue;
      motion_.found = true;
      break;
    }
    return motion_;
  }

 private:
  static constexpr double kMostQuicker = 3.0;

  // How fast the bodies get against the drives, and how weakly these hold them: near a pose where
  // assemblies meet (bars in line) the motion may go on in either, at any speed.
  struct Course {
    double quickest = std::numeric_limits<double>::infinity(), weakest = 0.0;
  };

  // Each drive alone: the other way where other joints are at the end of their ranges, or not at
  // all.
  void TurnToWhereRoomIs(double scale, std::vector<DriveStroke>* full) {
    for (size_t k = 0; k < full->size(); ++k) {
      double& height = (*full)[k].height;
      if (height == 0.0) continue;
      const auto has_room = [&] {
        for (DriveStroke& stroke : motion_.strokes) stroke.height = 0.0;
        motion_.strokes[k].height = scale * height;
        Course course;
        return Follow({}, &course) || !left_range_;
      };
      if (has_room()) continue;
      height = -height;
      if (has_room()) continue;
      height = 0.0;
      motion_.without_room.push_back(NameOf(m_, motion_.coordinates[k]));
    }
  }

  // Small enough for stretched knees; down, where they cannot stretch further.
  DriveStroke StrokeOfBase(const Coordinate& coordinate) const {
    constexpr double kDown = -0.03, kAcross = 0.015, kTurn = 0.03;  // lengths, rad
    const int c = coordinate.component;
    return {.home = HomeValue(m_, coordinate),
            .height = c == 2  ? kDown * length_
                      : c < 2 ? kAcross * length_
                              : kTurn,
            .start_s = 0.05 * static_cast<double>(c % 4),
            .duration_s = motion_.duration_s - 0.2};
  }

  DriveStroke FullStroke(size_t d, double home, bool rests) const {
    const Drive& drive = m_.drives[d];
    DriveStroke stroke{.home = home, .height = 0.0};
    // Not all at once, so that forces can be distinguished.
    stroke.start_s = 0.05 * static_cast<double>(d % 4);
    stroke.duration_s = motion_.duration_s - 0.2;
    if (rests) return stroke;
    const double usual = PositionUnit(m_, drive) == "m" ? 0.1 * length_ : 0.2;
    const double up = drive.range.upper - home, down = home - drive.range.lower;
    const double sign = up >= down || up >= usual ? 1.0 : -1.0;
    const double room = sign > 0.0 ? up : down;
    stroke.height = sign * std::min(usual, room > 0.0 ? 0.6 * room : usual);
    return stroke;
  }

  Motion Commands() const {
    Motion motion{.duration_s = motion_.duration_s, .sample_s = 0.02, .commands = {}, .loads = {}};
    for (size_t k = 0; k < motion_.coordinates.size(); ++k) {
      const DriveStroke& stroke = motion_.strokes[k];
      Profile profile{{ConstantTerm{stroke.home}}};
      profile.terms.emplace_back(BumpTerm{stroke.start_s, stroke.duration_s, stroke.height});
      const Coordinate& coordinate = motion_.coordinates[k];
      motion.commands.push_back({NameOf(m_, coordinate), {{coordinate, 1.0}}, profile});
    }
    return motion;
  }

  // False where the motion cannot be followed, leaves a range or goes beyond `limit`.
  bool Follow(const Course& limit, Course* course) {
    left_range_ = false;
    *course = {.quickest = 0.0, .weakest = std::numeric_limits<double>::infinity()};
    const Motion motion = Commands();
    ReferenceSolver solver(m_, motion);
    ReferenceSample sample;
    CommandSample command;
    const int samples = static_cast<int>(std::lround(motion.duration_s / motion.sample_s));
    for (int i = 0; i <= samples; ++i) {
      EvaluateMotion(motion, i * motion.sample_s, &command);
      if (!solver.Kinematics(command, &sample).ok()) return false;
      const double quick = Quickness(m_, sample, length_);
      if (!std::isfinite(quick) || quick > limit.quickest) return false;
      if (sample.control < limit.weakest) return false;
      course->quickest = std::max(course->quickest, quick);
      course->weakest = std::min(course->weakest, sample.control);
      left_range_ = !motion_.beyond_ranges && !IsWithinRanges(m_, sample.states.X_WB);
      if (left_range_) return false;
    }
    return true;
  }

  const Mechanism& m_;
  const double length_;
  FirstMotion motion_;
  bool left_range_ = false;  // why the last motion could not be followed
};

std::string ScenarioText(const Mechanism& m, const FirstMotion& motion,
                         const std::string& model_ref, const std::vector<std::string>& notes,
                         const std::vector<Coordinate>& by_forces, bool holding) {
  const WrittenNames names = NamesInModel(m);
  std::string text = fmt::format(
      "# A first motion, made by mbverify: {} out and back again.\n"
      "# All keys: docs/reference/scenario_file.md.\n",
      StandsOnFeet(m) ? "the base and the drives that it leaves free go" : "each drive goes");
  for (const std::string& note : notes) text += "# " + note + "\n";
  text += fmt::format(
      "mechanism: {}\ndescription: {} out and back, from rest to rest\nmotion:\n"
      "  duration_s: {}\n  sample_s: 0.01\n{}",
      QuotedYaml(model_ref), StandsOnFeet(m) ? "On its feet, the base" : "Each drive",
      motion.duration_s, motion.coordinates.empty() ? "" : "  commands:\n");
  for (size_t k = 0; k < motion.coordinates.size(); ++k) {
    const DriveStroke& stroke = motion.strokes[k];
    const Coordinate& coordinate = motion.coordinates[k];
    const auto index = static_cast<size_t>(coordinate.index);
    const std::string name =
        coordinate.kind == Coordinate::Kind::kDrive
            ? names.drives[index]
            : fmt::format("{}.{}", names.outputs[index],
                          kPoseComponents.at(static_cast<size_t>(coordinate.component)));
    if (stroke.height == 0.0) {
      text += fmt::format("    {}: home\n", name);
    } else {
      text += fmt::format(
          "    {}: [home, {{bump: {{start_s: {:g}, duration_s: {:g}, height: {:.6g}}}}}]\n", name,
          stroke.start_s, stroke.duration_s, stroke.height);
    }
  }
  if (!by_forces.empty()) {
    text += "  initial:\n";
    for (const Coordinate& turn : by_forces) {
      text +=
          fmt::format("    {}: home\n",
                      QuotedYaml(fmt::format("{}.{}", names.joints[turn.index], turn.component)));
    }
  }
  return text +
         fmt::format(
             "analytic: none\n"
             "simulation: {{mode: forward, step_s: 0.001, stock_too: false{}}}\n"
             "{}checks: {{force_nrmse: {{forward: 1.0e-6, inverse: 1.0e-10}}{}}}\n"
             "snapshots: {{times_s: [0, {:g}]}}\n",
             motion.beyond_ranges ? ", ignore_ranges: true" : "",
             holding
                 ? "# Drives that only hold a degree of freedom carry next to nothing: no scale of "
                   "their own to judge them by.\n"
                 : "",
             holding ? ", force_nrmse_own: off" : "", 0.5 * motion.duration_s);
}

}  // namespace

Mechanism WithDriveForEachDof(const Mechanism& mechanism, std::vector<std::string>* notes,
                              std::vector<Coordinate>* by_forces) {
  Mechanism m = mechanism;
  // Here nothing gives their motion: drives hold them like the others.
  m.prescribed.clear();
  const Candidates candidates = CandidatesOf(m);
  const CoordinateChoice choice =
      ChooseCoordinates(m, candidates.coordinates, m.drives.size(), candidates.makeshift);
  std::vector<Coordinate> taken;
  for (const size_t k : choice.chosen) taken.push_back(candidates.coordinates[k]);
  by_forces->clear();
  if (choice.left() > 0) *by_forces = TurnsLeft(m, taken);
  if (!by_forces->empty()) notes->push_back(ByForcesNote(m, *by_forces));
  if (const auto held = static_cast<int>(by_forces->size()); held < choice.left()) {
    notes->push_back(fmt::format("{} degrees of freedom cannot be held by a drive on a joint",
                                 choice.left() - held));
  }
  std::vector<Drive> drives;
  std::vector<std::string> dropped, added;
  for (size_t d = 0; d < m.drives.size(); ++d) {
    if (StandsOnFeet(m) ||
        std::find(choice.dependent.begin(), choice.dependent.end(), d) == choice.dependent.end()) {
      drives.push_back(m.drives[d]);
    } else {
      dropped.push_back(m.drives[d].name);
    }
  }
  for (const Coordinate& coordinate : taken) {
    if (coordinate.kind != Coordinate::Kind::kJoint) continue;
    drives.push_back(DriveOn(m, coordinate));
    added.push_back(drives.back().name);
  }
  if (!dropped.empty()) {
    notes->push_back(fmt::format("these drives depend on the others and are left out: {}",
                                 Joined(dropped, kMostNames)));
  }
  if (!added.empty()) {
    notes->push_back(fmt::format(
        "{} degree{} of freedom without a drive {} held by added drives, chosen by rank: {}",
        added.size(), added.size() == 1 ? "" : "s", added.size() == 1 ? "is" : "are",
        Joined(added, kMostNames)));
  }
  // Motors stay with their drives.
  std::vector<Motor> motors;
  for (Motor& motor : m.motors) {
    const std::string& name = m.drives[static_cast<size_t>(motor.drive)].name;
    const auto kept = std::ranges::find(drives, name, &Drive::name);
    if (kept == drives.end()) continue;
    motor.drive = static_cast<int>(kept - drives.begin());
    motors.push_back(std::move(motor));
  }
  m.motors = std::move(motors);
  m.drives = std::move(drives);
  return m;
}

FirstMotion FindFirstMotion(const Mechanism& mechanism, const std::vector<std::string>& resting) {
  const Mechanism held = WithTurnsHeld(mechanism);
  const bool by_forces = CountDofs(held) != CountDofs(mechanism);
  return MotionSearch(held, Commanded(held, by_forces), resting).Run();
}

DefaultSetupResult MakeDefaultSetup(const std::string& file, const std::string& name,
                                    const std::string& model_ref, const LoadOptions& options) {
  DefaultSetupResult result;
  LoadResult loaded = LoadRobot(file, options);
  result.diagnostics = loaded.diagnostics;
  if (!loaded.mechanism) return result;
  DefaultSetup setup;
  std::vector<Coordinate> by_forces;
  Mechanism m = WithDriveForEachDof(*loaded.mechanism, &setup.notes, &by_forces);
  std::vector<ModelCaveat> caveats =
      by_forces.empty() ? std::vector<ModelCaveat>() : HoldUnevenSpins(&*loaded.mechanism);
  if (!caveats.empty()) {
    setup.notes.clear();
    m = WithDriveForEachDof(*loaded.mechanism, &setup.notes, &by_forces);
    setup.notes.push_back(caveats[0].text);
  }
  caveats.insert(caveats.end(), loaded.caveats.begin(), loaded.caveats.end());
  AddMotorsOfJoints(loaded.motors_of_joints, &m);
  setup.by_forces = static_cast<int>(by_forces.size());
  if (setup.by_forces > 0) AddOutputs(&m);
  AddBases(&m);
  if (!name.empty()) m.name = name;
  const bool has_mass =
      std::ranges::any_of(m.bodies, [](const Body& body) { return body.mass > 0.0; });
  if (!has_mass) {
    result.diagnostics.Add({Severity::kError, file, 0, 0,
                            "no body has mass: there are no forces to compare",
                            "give the links an <inertial>"});
    return result;
  }
  if (m.drives.empty() && by_forces.empty()) {
    result.diagnostics.Add({Severity::kError, file, 0, 0,
                            "the mechanism has no degree of freedom: there is nothing to move",
                            "`mbverify model` says what holds it; loops that only rounded numbers "
                            "keep from moving take --closure-tolerance METRES"});
    return result;
  }
  // Added drives hold what the robot's own ones leave free; without own ones all move.
  std::vector<std::string> resting;
  for (const Drive& drive : m.drives) {
    if (!loaded.mechanism->drives.empty() && loaded.mechanism->FindDrive(drive.name) < 0) {
      resting.push_back(drive.name);
    }
  }
  FirstMotion motion = FindFirstMotion(m, resting);
  if (!motion.found && !m.drives.empty()) {
    setup.notes.emplace_back(
        by_forces.empty()
            ? "no motion was found that stays away from singular poses: the smallest is taken"
            : "no motion of the drives was found with what moves by forces held: the smallest is "
              "taken");
  }
  if (!motion.without_room.empty()) {
    setup.notes.push_back(fmt::format(
        "at home other joints that move along are at an end of their ranges: no room for {}, which "
        "rest{}",
        Joined(motion.without_room, kMostNames), motion.without_room.size() == 1 ? "s" : ""));
  }
  if (motion.beyond_ranges) {
    setup.notes.emplace_back("the home pose is beyond the range of a joint: ranges are ignored");
  }
  // What falls would rest at the end of its range, on a stop that no mechanism here has.
  std::vector<std::string> falling;
  for (const Coordinate& turn : by_forces) {
    const Joint& joint = m.joints[static_cast<size_t>(turn.index)];
    const bool named = !falling.empty() && falling.back() == joint.name;
    if (std::isfinite(joint.max_rotation) && !named) falling.push_back(joint.name);
  }
  if (!falling.empty() && !motion.beyond_ranges) {
    motion.beyond_ranges = true;
    setup.notes.push_back(
        fmt::format("{} may leave the range by forces, as nothing here stops it there: ranges are "
                    "ignored",
                    Joined(falling, kMostNames)));
  }
  setup.meshes = TakeMeshesAlong(&m);
  setup.model = WriteModel(m, caveats);
  setup.scenario = ScenarioText(m, motion, model_ref, setup.notes, by_forces, !resting.empty());
  setup.mechanism = std::move(m);
  for (const std::string& note : setup.notes) {
    result.diagnostics.Add({Severity::kWarning, file, 0, 0, note, ""});
  }
  result.setup = std::move(setup);
  return result;
}

std::string WriteSetup(const DefaultSetup& setup, const std::string& folder,
                       std::string* scenario) {
  const std::filesystem::path place =
      std::filesystem::path(folder) / setup.mechanism.name / "setup";
  std::vector<std::pair<std::filesystem::path, std::string>> files = {
      {place / "model.yaml", setup.model}, {place / "first.yaml", setup.scenario}};
  for (const ModelMeshFile& mesh : setup.meshes) {
    files.emplace_back(place / mesh.path, mesh.content);
  }
  for (const auto& [path, text] : files) {
    if (std::string trouble = WriteFile(path, text); !trouble.empty()) return trouble;
  }
  *scenario = (place / "first.yaml").string();
  return "";
}

}  // namespace mbv
