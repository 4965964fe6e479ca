#include "features/workspace/reachable_set.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <map>
#include <numbers>
#include <set>

#include "base/text.h"
#include "base/worker_pool.h"
#include "features/workspace/fibre.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "mechanism/idle_spins.h"
#include "model_file/yaml/units.h"
#include "reference/reduced_model.h"

namespace mbv {
namespace {

using std::numbers::pi;

constexpr size_t kMostNamed = 8;         // names in a message
constexpr double kSingularHome = 1e-10;  // determinants of orthonormal motions below it are zero
constexpr size_t kMostChecked = 24;
constexpr double kMostError = 0.2;     // of both ways together, by the measure
constexpr double kLong_s = 10.0;       // what takes longer is announced
constexpr long kUsualFibres = 100000;  // times through a range that its sections of a solid cost
constexpr double kWeakLoops = 0.1;     // of what they hold with at home: near where branches cross
constexpr double kSamePose = 1e-8;     // of the reference [rad, characteristic lengths]
constexpr std::array<const char*, 6> kComponents = {"x", "y", "z", "roll", "pitch", "yaw"};
constexpr const char* kNameOne =
    "name a body or a frame by --output, joints or drives by --over, or state outputs: in the "
    "model";

// "leg1_mm=500:750" → name, SI values.
struct Assigned {
  std::string text, name;
  std::vector<double> values;
  UnitSuffix unit = kPlain;
};

// Makes parts between two balls symmetric about the line through these whose spins are idle but for
// that: centres of mass move onto it, inertias are averaged. Nothing else feels their turn where
// only places are asked; held at a joint's coordinate they would end sets. The parts' names.
std::vector<std::string> MakeSymmetric(Mechanism* mechanism) {
  std::vector<std::string> names;
  for (const Spin& spin : FindSpins(*mechanism)) {
    if (spin.why_not.empty()) continue;
    Mechanism even = *mechanism;
    const Pose& X_WB0 = even.X_WB_home[static_cast<size_t>(spin.bodies[0])];
    const Vec3 p_WP = X_WB0 * spin.p_BP, n_W = X_WB0.linear() * spin.n_B;
    for (const int b : spin.bodies) {
      Body& body = even.bodies[static_cast<size_t>(b)];
      const Pose X_BW = even.X_WB_home[static_cast<size_t>(b)].inverse();
      const Vec3 p = X_BW * p_WP, n = X_BW.linear() * n_W;
      body.p_BoBcm_B = p + n * n.dot(body.p_BoBcm_B - p);
      const double along = n.dot(body.I_Bcm_B * n);
      const double round = 0.5 * (body.I_Bcm_B.trace() - along);
      body.I_Bcm_B = round * Mat3::Identity() + (along - round) * n * n.transpose();
    }
    const std::vector<Spin> idle = IdleSpins(even);
    if (std::ranges::find(idle, spin.balls, &Spin::balls) == idle.end()) continue;
    *mechanism = std::move(even);
    names.push_back(spin.name);
  }
  return names;
}

class QuestionReader {
 public:
  QuestionReader(const Mechanism& mechanism, const SetArguments& arguments,
                 Diagnostics* diagnostics)
      : arguments_(arguments), diagnostics_(*diagnostics) {
    question_.mechanism = mechanism;
    const std::vector<std::string> even = MakeSymmetric(&question_.mechanism);
    if (!even.empty()) {
      question_.notes.push_back(
          "taken as symmetric about the line through their balls, about which they turn by "
          "themselves: " +
          Joined(even, kMostNamed));
    }
  }

  std::optional<SetQuestion> Read() {
    const Mechanism& m = question_.mechanism;
    if (!FindOutput()) return std::nullopt;
    known_ = NamedCommandCoordinates(m);
    for (NamedCoordinate& named : NamedJointCoordinates(m)) {
      if (std::ranges::find(known_, named.name, &NamedCoordinate::name) == known_.end()) {
        known_.push_back(std::move(named));
      }
    }
    ReadOver();
    ReadHeld();
    ReadRanged();
    ReadFrom();
    ReadRanges();
    ReadCones();
    if (failed_ || !Choose()) return std::nullopt;
    question_.output = output_;
    question_.ranges_changed = !arguments_.ranges.empty() || !arguments_.cones.empty() ||
                               !ranged_.empty() || std::isfinite(arguments_.clearance);
    return std::move(question_);
  }

 private:
  void Error(const std::string& where, std::string message, std::string hint = {}) {
    diagnostics_.AddError(where, std::move(message), std::move(hint));
    failed_ = true;
  }

  bool FindOutput() {
    const Mechanism& m = question_.mechanism;
    if (arguments_.output.empty()) {
      output_ = m.outputs.empty() ? "" : m.outputs.front().name;
      if (m.outputs.empty() && arguments_.over.empty()) {
        Error(m.file, "the model has no output, whose poses could be asked", kNameOne);
      }
      return !failed_;
    }
    output_ = arguments_.output;
    if (m.FindOutput(output_) >= 0 || AddOutput()) return true;
    std::vector<std::string> names;
    for (const Output& output : m.outputs) names.push_back(output.name);
    for (size_t b = 1; b < m.bodies.size(); ++b) names.push_back(m.bodies[b].name);
    Error("--output " + output_, "there is no such output",
          DidYouMean(output_, names, "there are: " + Joined(names, kMostNamed)));
    return false;
  }

  // A moving body, "BODY.FRAME" or a frame whose name is used once, in the world: robots' files
  // state no outputs.
  bool AddOutput() {
    Mechanism& m = question_.mechanism;
    std::vector<Output> found;
    for (size_t b = 1; b < m.bodies.size(); ++b) {
      const Body& body = m.bodies[b];
      Output output{.name = output_, .body = static_cast<int>(b)};
      if (body.name == output_) {
        found = {output};
        break;
      }
      for (const NamedFrame& frame : body.frames) {
        if (frame.name != output_ && body.name + "." + frame.name != output_) continue;
        output.X_BO = frame.X_BF;
        found.push_back(output);
      }
    }
    if (found.size() != 1) return false;
    m.outputs.push_back(found.front());
    return true;
  }

  // "x" is the output's.
  [[nodiscard]] const NamedCoordinate* Find(const std::string& name) const {
    for (const std::string& full : {name, output_ + "." + name}) {
      const auto at = std::ranges::find(known_, full, &NamedCoordinate::name);
      if (at != known_.end()) return &*at;
    }
    return nullptr;
  }

  // "NAME=1" or "NAME=0:1", as many values as `count`; without values where `bare`.
  std::optional<Assigned> Split(const char* option, const std::string& text, size_t count,
                                bool bare, bool of_coordinate = true) {
    Assigned result{.text = std::string(option) + " " + text, .name = {}, .values = {}};
    const size_t equals = text.find('=');
    const std::string given = text.substr(0, equals);
    const NameInUnit named = SplitUnit(given, [&](const std::string& name) {
      return of_coordinate ? Find(name) != nullptr : !name.ends_with("_deg");
    });
    result.name = named.name;
    result.unit = named.unit;
    if (of_coordinate) {
      const NamedCoordinate* found = Find(named.name);
      if (found == nullptr && output_.empty() &&
          std::ranges::find(kComponents, named.name) != kComponents.end()) {
        Error(result.text,
              fmt::format("the model has no output, whose '{}' could be asked", named.name),
              kNameOne);
        return std::nullopt;
      }
      if (found == nullptr) {
        const std::vector<std::string> names = NamesOf(known_);
        Error(result.text, fmt::format("there is no coordinate '{}'", named.name),
              DidYouMean(named.name, names, "there are: " + Joined(names, kMostNamed)));
        return std::nullopt;
      }
      const std::string unit = CoordinateUnit(question_.mechanism, found->coordinate);
      if (!named.unit.Suits(unit)) {
        Error(result.text, "the coordinate is in " + unit,
              unit == "rad" ? "NAME=… in rad or NAME_deg=…" : "NAME=… in m or NAME_mm=…");
        return std::nullopt;
      }
    }
    if (equals == std::string::npos) {
      if (bare) return result;
      Error(result.text, "a value is needed", count == 1 ? "NAME=VALUE" : "NAME=LOW:HIGH");
      return std::nullopt;
    }
    std::string rest = text.substr(equals + 1);
    for (size_t k = 0; k < count; ++k) {
      const size_t colon = k + 1 < count ? rest.find(':') : std::string::npos;
      const std::string word = rest.substr(0, colon);
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      if (word.empty() || *end != '\0' || !std::isfinite(value) ||
          (k + 1 < count && colon == std::string::npos)) {
        Error(result.text, count == 1 ? "a number is needed" : "two numbers are needed",
              count == 1 ? "NAME=VALUE" : "NAME=LOW:HIGH");
        return std::nullopt;
      }
      result.values.push_back(named.unit.to_si(value));
      rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
    }
    if (count == 2 && !(result.values[0] < result.values[1])) {
      Error(result.text, "LOW is not below HIGH", "NAME=LOW:HIGH");
      return std::nullopt;
    }
    return result;
  }

  void ReadOver() {
    for (const std::string& text : arguments_.over) {
      const auto assigned = Split("--over", text, 2, true);
      if (!assigned) continue;
      const NamedCoordinate* found = Find(assigned->name);
      if (std::ranges::find(over_, found->name, &NamedCoordinate::name) != over_.end()) {
        Error(assigned->text, "'" + found->name + "' is stated twice", "each coordinate once");
        continue;
      }
      over_.push_back(*found);
      CoordinateRange box;
      if (!assigned->values.empty()) box = {assigned->values[0], assigned->values[1]};
      question_.boxed = question_.boxed || !assigned->values.empty();
      box_.push_back(box);
    }
    if (over_.size() > 3) {
      Error("--over",
            fmt::format("{} coordinates are stated: a set has one to three", over_.size()),
            "hold the others by --at");
    }
  }

  void ReadHeld() {
    for (const std::string& text : arguments_.at) {
      const auto assigned = Split("--at", text, 1, false);
      if (!assigned) continue;
      const NamedCoordinate* found = Find(assigned->name);
      if (held_.contains(found->name) ||
          std::ranges::find(over_, found->name, &NamedCoordinate::name) != over_.end()) {
        Error(assigned->text, "'" + found->name + "' is stated twice",
              "--over frees a coordinate, --at holds it");
        continue;
      }
      at_.push_back(*found);
      held_[found->name] = assigned->values[0];
    }
  }

  // What is held at all, or some, values of a range.
  void ReadRanged() {
    if (!arguments_.for_all.empty() && !arguments_.for_some.empty()) {
      Error("--for-some", "--for-all is stated, too", "one of them");
    }
    for (const auto& [option, texts] : {std::pair("--for-all", &arguments_.for_all),
                                        std::pair("--for-some", &arguments_.for_some)}) {
      for (const std::string& text : *texts) {
        const auto assigned = Split(option, text, 2, false);
        if (!assigned) continue;
        const NamedCoordinate* found = Find(assigned->name);
        if (held_.contains(found->name) ||
            std::ranges::find(over_, found->name, &NamedCoordinate::name) != over_.end()) {
          Error(assigned->text, "'" + found->name + "' is stated twice",
                "--over frees a coordinate, --at holds it, --for-all and --for-some ask a range");
          continue;
        }
        const CoordinateRange range = {assigned->values[0], assigned->values[1]};
        const double home = HomeValue(question_.mechanism, found->coordinate);
        at_.push_back(*found);
        held_[found->name] =
            range.lower <= home && home <= range.upper ? home : 0.5 * (range.lower + range.upper);
        ranged_[found->name] = range;
      }
    }
    question_.settings.for_all = !arguments_.for_all.empty();
  }

  void ReadFrom() {
    for (const std::string& text : arguments_.from) {
      const auto assigned = Split("--from", text, 1, false);
      if (!assigned) continue;
      const NamedCoordinate* found = Find(assigned->name);
      if (!arguments_.over.empty() &&
          std::ranges::find(over_, found->name, &NamedCoordinate::name) == over_.end()) {
        Error(assigned->text, "'" + found->name + "' is not of --over",
              "--at holds other coordinates");
        continue;
      }
      from_[found->name] = assigned->values[0];
    }
  }

  void ReadRanges() {
    Mechanism& m = question_.mechanism;
    for (const std::string& text : arguments_.ranges) {
      const auto assigned = Split("--range", text, 2, false);
      if (!assigned) continue;
      const Coordinate coordinate = Find(assigned->name)->coordinate;
      const CoordinateRange range = {assigned->values[0], assigned->values[1]};
      const auto index = static_cast<size_t>(coordinate.index);
      if (coordinate.kind == Coordinate::Kind::kDrive) {
        m.drives[index].range = range;
        // The joint may state the drive's range, too.
        if (const auto* on = std::get_if<JointDrive>(&m.drives[index].kind)) {
          m.joints[static_cast<size_t>(on->joint)].range[static_cast<size_t>(on->coordinate)] =
              range;
        }
      } else if (coordinate.kind == Coordinate::Kind::kJoint) {
        m.joints[index].range[static_cast<size_t>(coordinate.component)] = range;
      } else {
        Error(assigned->text, "ranges are of drives and joints",
              "bound an output's coordinate by --over NAME=LOW:HIGH");
      }
    }
  }

  void ReadCones() {
    const Mechanism& m = question_.mechanism;
    for (const std::string& text : arguments_.cones) {
      const auto assigned = Split("--cone", text, 1, false, false);
      if (!assigned) continue;
      JointCone cone;
      std::string name = assigned->name;
      for (const auto& [end, axis] :
           {std::pair(".x", Vec3(1, 0, 0)), {".y", Vec3(0, 1, 0)}, {".z", Vec3(0, 0, 1)}}) {
        if (m.FindJoint(name) >= 0 || !name.ends_with(end)) continue;
        name.resize(name.size() - 2);
        cone.axis = axis;
      }
      cone.joint = m.FindJoint(name);
      cone.angle = assigned->values[0];
      std::vector<std::string> names;
      for (const Joint& joint : m.joints) names.push_back(joint.name);
      if (cone.joint < 0) {
        Error(assigned->text, "there is no joint '" + name + "'",
              DidYouMean(name, names, "there are: " + Joined(names, kMostNamed)));
      } else if (!(cone.angle > 0.0) || cone.angle > pi || !assigned->unit.Suits("rad")) {
        Error(assigned->text, "a cone's angle lies between 0 and 180°",
              "--cone JOINT_deg=30, of the joint's axis z, or JOINT.x_deg=30");
      } else {
        question_.settings.cones.push_back(cone);
      }
    }
  }

  // Of x, y, z those that can move while prescribed joints and what --at holds rest.
  void ChooseFree() {
    std::vector<NamedCoordinate> candidates;
    for (const Prescribed& prescribed : question_.mechanism.prescribed) {
      candidates.push_back(*Find(prescribed.name));
    }
    candidates.insert(candidates.end(), at_.begin(), at_.end());
    const size_t held = candidates.size();
    for (const char* component : kComponents) {
      const NamedCoordinate& named = *Find(output_ + "." + component);
      if (!held_.contains(named.name)) candidates.push_back(named);
    }
    std::vector<Coordinate> coordinates;
    coordinates.reserve(candidates.size());
    for (const NamedCoordinate& named : candidates) coordinates.push_back(named.coordinate);
    const CoordinateChoice choice =
        ChooseCoordinates(question_.mechanism, coordinates, coordinates.size());
    for (const size_t k : choice.chosen) {
      const bool angle = k >= held && candidates[k].coordinate.component >= 3;
      // Angles only where no length is free.
      if (k < held || over_.size() == (ranged_.empty() ? 3 : 2) ||
          (angle && !over_.empty() && over_.back().coordinate.component < 3)) {
        continue;
      }
      over_.push_back(candidates[k]);
    }
  }

  // The free coordinates, those held, then what is left: the output's other coordinates first.
  bool Choose() {
    const Mechanism& m = question_.mechanism;
    SpaceSettings& settings = question_.settings;
    settings.cross_type2 = arguments_.cross_singularities;
    settings.clearance = arguments_.clearance;
    if (over_.empty()) ChooseFree();
    std::vector<NamedCoordinate> candidates = over_;
    const auto add = [&](const NamedCoordinate& named) {
      if (std::ranges::find(candidates, named.name, &NamedCoordinate::name) == candidates.end()) {
        candidates.push_back(named);
      }
    };
    for (const NamedCoordinate& named : at_) add(named);
    const size_t stated = candidates.size();
    for (const Prescribed& prescribed : m.prescribed) add(*Find(prescribed.name));
    // Of drives and joints that are asked, the other drives rest; else the output does.
    const bool of_output = std::ranges::any_of(over_, [](const NamedCoordinate& named) {
      return named.coordinate.kind == Coordinate::Kind::kOutput;
    });
    const auto add_drives = [&] {
      for (const Drive& drive : m.drives) add(*Find(drive.name));
    };
    if (!of_output) add_drives();
    if (!output_.empty()) {
      for (const char* component : kComponents) add(*Find(output_ + "." + component));
    }
    add_drives();
    const size_t preferred = candidates.size();
    // Balls of rods, whose own turn depends on the way, only where nothing else holds it.
    std::set<int> balls;
    for (const Spin& spin : IdleSpins(m)) balls.insert(spin.balls.begin(), spin.balls.end());
    const auto of_rod = [&](const NamedCoordinate& named) {
      return named.coordinate.kind == Coordinate::Kind::kJoint &&
             balls.contains(named.coordinate.index);
    };
    for (const NamedCoordinate& named : known_) {
      if (!of_rod(named)) add(named);
    }
    const auto choose = [&] {
      std::vector<Coordinate> coordinates;
      coordinates.reserve(candidates.size());
      for (const NamedCoordinate& named : candidates) coordinates.push_back(named.coordinate);
      return ChooseCoordinates(m, coordinates, preferred);
    };
    CoordinateChoice choice = choose();
    if (choice.left() > 0) {
      for (const NamedCoordinate& named : known_) add(named);
      choice = choose();
    }
    if (choice.dofs == 0) {
      Error(m.file, "the model has no degree of freedom at home", "see mbverify model");
      return false;
    }
    for (const size_t k : choice.dependent) {
      if (k >= stated) continue;
      Error(
          (k < over_.size() ? "--over " : "--at ") + candidates[k].name,
          fmt::format("'{}' is no coordinate of its own at home: those before determine it, or "
                      "it does not move ({} degree{} of freedom)",
                      candidates[k].name, choice.dofs, choice.dofs == 1 ? "" : "s"),
          "leave it out, or choose others: " + Joined(Independent(candidates, choice), kMostNamed));
    }
    if (failed_) return false;
    std::vector<NamedCoordinate> chosen;
    std::vector<CoordinateRange> box;
    for (const size_t k : choice.chosen) {
      if (k >= over_.size()) continue;
      chosen.push_back(candidates[k]);
      box.push_back(k < box_.size() ? box_[k] : CoordinateRange{});
    }
    if (chosen.empty()) {
      // The output's origin does not move: what else does?
      chosen.push_back(candidates[choice.chosen.front()]);
      box.emplace_back();
    }
    settings.over = static_cast<int>(chosen.size());
    for (const size_t k : choice.chosen) {
      if (std::ranges::find(chosen, candidates[k].name, &NamedCoordinate::name) != chosen.end()) {
        continue;
      }
      chosen.push_back(candidates[k]);
      if (held_.contains(candidates[k].name)) continue;
      question_.notes.push_back(candidates[k].name + " is held at home");
    }
    if (static_cast<int>(chosen.size()) != choice.dofs) {
      Error(m.file, "the model's coordinates do not hold all degrees of freedom at home",
            "see mbverify model");
      return false;
    }
    settings.coordinates = chosen;
    const auto d = static_cast<Eigen::Index>(chosen.size());
    question_.start.resize(d);
    for (Eigen::Index k = 0; k < d; ++k) {
      const NamedCoordinate& named = chosen[static_cast<size_t>(k)];
      double value = HomeValue(m, named.coordinate);
      if (const auto at = held_.find(named.name); at != held_.end()) value = at->second;
      if (const auto at = from_.find(named.name); at != from_.end()) value = at->second;
      if (k < settings.over) {
        CoordinateRange& range = box[static_cast<size_t>(k)];
        const bool stated_box = std::isfinite(range.lower);
        if (!stated_box && !IsLength(m, named.coordinate)) {
          const bool output = named.coordinate.kind == Coordinate::Kind::kOutput;
          const double half = output && named.coordinate.component == 4 ? pi / 2 : pi;
          range = {output ? -half : value - half, output ? half : value + half};
        }
        if (stated_box && (value <= range.lower || value >= range.upper)) {
          value = 0.5 * (range.lower + range.upper);
        }
      }
      question_.start[k] = value;
      if (const auto at = ranged_.find(named.name); at != ranged_.end()) {
        settings.ranged.push_back({static_cast<int>(k), at->second});
      }
    }
    settings.box = box;
    settings.held = question_.start.tail(d - settings.over);
    return true;
  }

  [[nodiscard]] static std::vector<std::string> Independent(
      const std::vector<NamedCoordinate>& candidates, const CoordinateChoice& choice) {
    std::vector<std::string> names;
    for (const size_t k : choice.chosen) names.push_back(candidates[k].name);
    return names;
  }

  const SetArguments& arguments_;
  Diagnostics& diagnostics_;
  SetQuestion question_;
  std::string output_;
  std::vector<NamedCoordinate> known_, over_, at_;
  std::vector<CoordinateRange> box_;
  std::map<std::string, double> held_, from_;
  std::map<std::string, CoordinateRange> ranged_;
  bool failed_ = false;
};

// The pose to begin with: from home to the values that are asked.
bool PlaceStart(const SetQuestion& question, PoseSpace* space, PlacedPose* start,
                ReachableSet* result) {
  const std::string& file = question.mechanism.file;
  Diagnostics& diagnostics = result->diagnostics;
  PlacedPose home;
  if (!space->Home(&home)) {
    diagnostics.AddError(file,
                         "the home pose is a constraint singularity: it has more degrees of "
                         "freedom than poses nearby",
                         "move the home pose (guesses of the model)");
    return false;
  }
  if (std::abs(home.type1) < kSingularHome) {
    diagnostics.AddError(file, "the coordinates do not determine the pose at home (type 1)",
                         "choose other coordinates, or another home pose");
    return false;
  }
  space->CountFrom(&home);
  if (!space->Close(home, question.start, start)) {
    std::vector<std::string> values;
    for (size_t k = 0; k < question.settings.coordinates.size(); ++k) {
      values.push_back(fmt::format("{} = {:.6g}", question.settings.coordinates[k].name,
                                   question.start[static_cast<Eigen::Index>(k)]));
    }
    diagnostics.AddError(file, "the set cannot be reached from home: " + Joined(values),
                         "hold other values by --at, or begin elsewhere by --from");
    return false;
  }
  space->CountFrom(start);
  for (size_t b = 0; b < space->bounds().size(); ++b) {
    const SetBound& bound = space->bounds()[b];
    const double margin = start->pose.margin[static_cast<Eigen::Index>(b)];
    if (margin > 0.0 || IsSingularity(bound.kind)) continue;
    diagnostics.AddError(
        file,
        fmt::format("the pose to begin with is beyond {} by {:.4g} {}", bound.name, -margin,
                    bound.unit),
        "begin elsewhere by --from, hold other values by --at, or state another --range");
  }
  return !diagnostics.has_errors();
}

// Poses inside, closed anew by the reference from home.
void CheckByReference(const SetQuestion& question, const PoseSpace& space, ReachableSet* result) {
  const Mechanism& m = question.mechanism;
  std::vector<Coordinate> coordinates;
  for (const NamedCoordinate& named : question.settings.coordinates) {
    coordinates.push_back(named.coordinate);
  }
  ReducedModel model(m, coordinates);
  const VecX still = VecX::Zero(model.size());
  const std::vector<SpacePose>& poses = result->traced.inside;
  const size_t stride = std::max<size_t>(1, poses.size() / kMostChecked);
  for (size_t i = 0; i < poses.size(); i += stride) {
    if (!model.Move(poses[i].at, still, still).ok()) {
      ++result->unchecked;
      continue;
    }
    ++result->checked;
    const BodyStates states = space.States(poses[i]);
    const auto compare = [&](const Coordinate& coordinate) {
      const double other = CoordinateRow(m, coordinate, model.states()).value;
      const double off = CoordinateRow(m, coordinate, states, other).value - other;
      const double unit = IsLength(m, coordinate) ? space.length() : 1.0;
      result->checked_off = std::max(result->checked_off, std::abs(off) / unit);
    };
    for (size_t d = 0; d < m.drives.size(); ++d) {
      compare({Coordinate::Kind::kDrive, static_cast<int>(d), 0});
    }
    for (size_t o = 0; o < m.outputs.size(); ++o) {
      for (int c = 0; c < 3; ++c) compare({Coordinate::Kind::kOutput, static_cast<int>(o), c});
    }
  }
}

double LengthOf(const TracedArc& arc) {
  double length = 0.0;
  for (size_t k = 1; k < arc.points.size(); ++k)
    length += (arc.points[k] - arc.points[k - 1]).norm();
  return length;
}

void FindShares(ReachableSet* result) {
  std::map<int, BoundShare> shares;
  double all = 0.0;
  if (result->traced.sections.size() == 1) {
    std::map<int, double> traced;
    for (const TracedLoop& loop : result->traced.sections[0].loops) {
      for (const TracedArc& arc : loop.arcs) {
        traced[arc.bound] += LengthOf(arc);
        all += LengthOf(arc);
      }
    }
    for (const auto& [bound, length] : traced) shares[bound].traced = length / all;
  }
  for (const auto& [at, bound] : result->traced.ends) {
    double& share = shares[bound].traced;
    share = std::isfinite(share) ? share + 0.5 : 0.5;
  }
  std::map<int, double> flooded;
  const auto& vertices = result->flooded.vertices;
  double sum = 0.0;
  for (const FloodFacet& facet : result->flooded.facets) {
    std::vector<const FloodVertex*> v;
    for (const int i : facet.vertices) {
      if (i >= 0) v.push_back(&vertices[static_cast<size_t>(i)]);
    }
    const double size = v.size() == 3
                            ? 0.5 * (v[1]->at - v[0]->at).cross(v[2]->at - v[0]->at).norm()
                        : v.size() == 2 ? (v[1]->at - v[0]->at).norm()
                                        : 1.0;
    for (const FloodVertex* vertex : v) {
      flooded[vertex->bound] += size / static_cast<double>(v.size());
    }
    sum += size;
  }
  for (const auto& [bound, size] : flooded) shares[bound].flooded = size / sum;
  for (auto& [bound, share] : shares) {
    share.bound = bound;
    result->shares.push_back(share);
  }
  std::ranges::stable_sort(result->shares, [](const BoundShare& a, const BoundShare& b) {
    return std::max(a.flooded, 0.0) > std::max(b.flooded, 0.0);
  });
}

std::string UnitOfMeasure(const std::vector<std::string>& units) {
  std::map<std::string, int> powers;
  for (const std::string& unit : units) ++powers[unit];
  std::vector<std::string> parts;
  parts.reserve(powers.size());
  for (const auto& [unit, power] : powers) {
    parts.push_back(unit + (power == 2 ? "²" : power == 3 ? "³" : ""));
  }
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : " ") + part;
  return text;
}

// What both ways found is ambiguous: which branch is followed depends on the way.
std::string ConflictText(const ReachableSet& set) {
  std::string text =
      fmt::format("{} poses of the lattice are reached in two ways", set.flooded.conflicts);
  if (!(set.flooded.conflict_margin < kWeakLoops)) return text;
  std::vector<std::string> places;
  for (size_t c = 0; c < set.over.size(); ++c) {
    places.push_back(fmt::format("{} = {:.4g} {}", set.over[c],
                                 set.flooded.conflict_at[static_cast<Eigen::Index>(c)],
                                 set.over_units[c]));
  }
  return text + fmt::format(
                    ", branches of which cross at a constraint singularity near {}: state a box "
                    "that leaves it out, --over NAME=LOW:HIGH",
                    Joined(places));
}

}  // namespace

void JudgeSet(ReachableSet* result) {
  const TracedSet& traced = result->traced;
  const FloodedSet& flooded = result->flooded;
  for (const RunSummary* summary : {&traced.summary, &flooded.summary}) {
    if (summary->ok()) continue;
    result->summary = *summary;
    result->verdict = "one way has no result: " + summary->message;
    return;
  }
  result->summary = RunSummary::Done();
  const double off = std::abs(traced.measure - flooded.measure);
  const double error = traced.error + flooded.error;
  const bool sharp = error <= kMostError * std::abs(traced.measure);
  result->agree = off <= error && sharp && flooded.conflicts == 0 && result->checked > 0 &&
                  result->checked_off < kSamePose;
  result->verdict =
      flooded.conflicts > 0  ? ConflictText(*result)
      : result->checked == 0 ? "the reference reaches none of the poses inside"
      : result->checked_off >= kSamePose
          ? fmt::format(
                "the reference closes a pose elsewhere: {:.2g} rad or characteristic lengths off",
                result->checked_off)
          : fmt::format("the two ways differ by {:.2g} {}, their errors are {:.2g} together{}", off,
                        result->unit, error, sharp ? "" : ": too large to judge");
}

std::optional<SetQuestion> ReadQuestion(const Mechanism& mechanism, const SetArguments& arguments,
                                        Diagnostics* diagnostics) {
  return QuestionReader(mechanism, arguments, diagnostics).Read();
}

ReachableSet ComputeReachableSet(const SetQuestion& question, const SetArguments& arguments,
                                 const ProgressFunction& progress, const ResumeFolder* folder,
                                 const SetWays& which) {
  ReachableSet result;
  const Mechanism& m = question.mechanism;
  SpaceSettings settings = question.settings;
  result.notes = question.notes;
  result.dofs = static_cast<int>(settings.coordinates.size());
  result.drives = static_cast<int>(m.drives.size());
  result.start = question.start;
  result.box = settings.box;
  result.ranged = settings.ranged;
  result.for_all = settings.for_all;
  result.held_values = settings.held;
  for (size_t k = 0; k < settings.coordinates.size(); ++k) {
    const bool free = static_cast<int>(k) < settings.over;
    (free ? result.over : result.held).push_back(settings.coordinates[k].name);
    (free ? result.over_units : result.held_units)
        .push_back(CoordinateUnit(m, settings.coordinates[k].coordinate));
  }
  result.unit = UnitOfMeasure(result.over_units);
  result.measure = settings.over == 1 ? "length" : settings.over == 2 ? "area" : "volume";
  {
    PlacedPose home;
    if (PoseSpace raw(m, settings); raw.Home(&home) && !std::isfinite(home.type2)) {
      result.notes.push_back(fmt::format(
          "{} drives and prescribed joints for {} degrees of freedom: no pose where the drives "
          "lose their hold (type 2) is looked for",
          m.drives.size() + m.prescribed.size(), result.dofs));
    } else if (!settings.cross_type2 && std::abs(home.type2) < kSingularHome) {
      settings.cross_type2 = true;
      result.notes.emplace_back(
          "the drives do not hold the mechanism at home (type 2): such poses end nothing");
    }
  }
  PlacedPose start;
  PoseSpace space(m, settings);
  if (!PlaceStart(question, &space, &start, &result)) return result;
  std::vector<std::string> endless;
  for (const Drive& drive : m.drives) {
    if (!std::isfinite(drive.range.lower) && !std::isfinite(drive.range.upper)) {
      endless.push_back(drive.name);
    }
  }
  if (!endless.empty()) {
    result.notes.push_back("drives without a range, which end nothing: " +
                           Joined(endless, kMostNamed));
  }
  if (const ShapePairs* shapes = space.shapes(); shapes != nullptr) {
    if (shapes->pairs.empty()) result.notes.emplace_back("no shapes can touch");
    if (!shapes->touching.empty()) {
      result.notes.push_back("nearer than the clearance at home, so their shapes end nothing: " +
                             Joined(shapes->touching, kMostNamed));
    }
  }
  result.length = space.length();
  result.start_pose = start.pose;
  result.bounds = space.bounds();

  FloodPlan plan;
  if (which.lattice) plan = PlanFlood(space, start, arguments.flood);
  if (which.lattice && !plan.summary.ok()) {
    result.summary = plan.summary;
    result.verdict = plan.summary.message;
    return result;
  }
  const double boundary_s =
      settings.over == 3
          ? plan.closing_s *
                static_cast<double>(settings.ranged.empty() ? kEnoughClosings : kUsualFibres) /
                arguments.flood.threads
          : 0.0;
  if (which.lattice && which.announce && plan.estimate_s + boundary_s > kLong_s) {
    const std::string boundary =
        settings.over < 3 ? ""
        : !settings.ranged.empty()
            ? fmt::format(", the boundary about {}", TimeText(boundary_s))
            : fmt::format(
                  ", the boundary up to {} (a million poses; six where its sections change)",
                  TimeText(boundary_s));
    which.announce(
        fmt::format("the lattice takes about {}{}", TimeText(plan.estimate_s), boundary));
  }
  // Both ways at once; neither knows of the other.
  FloodSettings flood = arguments.flood;
  std::atomic<bool> in_vain = false;
  flood.in_vain = &in_vain;
  const auto log = [&](const char* name) {
    return folder == nullptr ? ResultLog() : folder->Log(name);
  };
  std::atomic<double> of_trace = 0.0, of_flood = 0.0;
  const auto trace = [&] {
    const auto report = [&](double f) { of_trace = f; };
    result.traced =
        settings.ranged.empty()
            ? TraceSet(space, start, report, which.share, flood.threads, log("boundary"))
            : TraceRange(space, start, flood.threads, report, log("boundary"));
    of_trace = 1.0;
    in_vain = !result.traced.summary.ok();
  };
  const auto fill = [&] {
    result.flooded = FloodSet(
        space, start, flood, plan, [&](double f) { of_flood = f; }, log("lattice"));
    of_flood = 1.0;
  };
  std::vector<std::future<void>> ways;
  const auto policy = flood.threads > 1 ? std::launch::async : std::launch::deferred;
  if (which.boundary) ways.push_back(std::async(policy, trace));
  if (which.lattice) ways.push_back(std::async(policy, fill));
  for (std::future<void>& way : ways) {
    while (way.wait_for(std::chrono::milliseconds(50)) == std::future_status::timeout) {
      if (progress) progress("workspace", 0.5 * (of_trace + of_flood));
    }
    way.get();
  }
  if (!which.boundary || !which.lattice) {
    result.summary = which.boundary ? result.traced.summary : result.flooded.summary;
    if (!result.summary.ok()) result.verdict = result.summary.message;
    return result;
  }
  if (!result.traced.gone.empty()) {
    result.notes.push_back(
        fmt::format("{} sections have no boundary, and what lies about them counts as error: {}",
                    result.traced.gone.size(), result.traced.gone.front()));
  }
  if (result.traced.summary.ok()) CheckByReference(question, space, &result);
  FindShares(&result);
  JudgeSet(&result);
  return result;
}

}  // namespace mbv
