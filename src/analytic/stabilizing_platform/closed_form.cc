#include "analytic/stabilizing_platform/closed_form.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "analytic/stabilizing_platform/dynamics.h"
#include "analytic/stabilizing_platform/parameters.h"
#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv::stabilizing_platform {
namespace {

class StabilizingPlatform final : public ClosedForm {
 public:
  StabilizingPlatform(const Mechanism& mechanism, const PlatformParameters& parameters,
                      const CommandMap& map, std::vector<LoadPlace> loads, Model model,
                      SignInM sign)
      : map_(map),
        load_places_(std::move(loads)),
        equations_(parameters, map.pairs, model, sign),
        amplification_(parameters),
        prescribed_(static_cast<int>(mechanism.prescribed.size())),
        has_base_output_(mechanism.FindOutput("platform_in_base") >= 0) {
    loads_.reserve(load_places_.size());
    if (model != Model::kPaperText) reactions_ = ReactionChannelsOfLimbs(mechanism);
    MakeChannels();
  }

  [[nodiscard]] std::vector<Channel> extra_channels() const override { return channels_; }

  [[nodiscard]] RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    PoseCommand pose;
    RunSummary summary = ReadCommand(map_, command, &pose);
    if (summary.ok()) summary = equations_.EvaluateKinematics(pose, &state_);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    Fill(pose, driven);
    return summary;
  }

  [[nodiscard]] RunSummary Dynamics(const CommandSample& command,
                                    ClosedFormSample* sample) override {
    RunSummary summary = Kinematics(command, &sample->driven);
    if (!summary.ok()) return summary;
    CollectLoads(command);
    summary = equations_.EvaluateDynamics(loads_, &state_);
    if (!summary.ok()) {
      summary.time_s = command.time_s;
      return summary;
    }
    sample->force.resize(6);
    for (int i = 0; i < 6; ++i) {
      sample->force[map_.drives[i]] = state_.forces[i / 2].drive[i % 2];
    }
    sample->extra.resize(static_cast<Eigen::Index>(channels_.size()));
    FillExtra(sample->extra.data());
    return summary;
  }

 private:
  void MakeChannels() {
    channels_ = PoseChannels("platform", "world");
    if (has_base_output_) {
      for (Channel& channel : PoseChannels("platform_in_base", "lower_platform")) {
        channels_.push_back(std::move(channel));
      }
    }
    for (int i = 1; i <= 3; ++i) {
      const std::string limb = fmt::format("limb{}", i);
      channels_.push_back({limb + ".length", "m", ""});
      if (map_.pairs == DrivePairs::kSynchronous) {
        channels_.push_back({limb + ".amplification", "1", ""});
      }
      for (const char* c : {"X", "Y", "Z"}) {
        channels_.push_back({limb + ".f_" + c, "N", fmt::format("A_{}", i)});
      }
    }
    channels_.insert(channels_.end(), reactions_.channels().begin(), reactions_.channels().end());
  }

  void CollectLoads(const CommandSample& command) {
    loads_.clear();
    for (size_t k = 0; k < load_places_.size(); ++k) {
      if (load_places_[k].on_ship) continue;
      const LoadSample& load = command.loads[k];
      loads_.push_back({.limb = load_places_[k].limb,
                        .link = load_places_[k].link,
                        .p_BoQ_B = load.p_BoQ_B,
                        .in_body_axes = load.in_body_axes,
                        .force = load.force,
                        .moment = load.moment});
    }
  }

  void Fill(const PoseCommand& pose, DrivenSample* driven) const {
    const Eigen::Index n = 6 + prescribed_;
    for (VecX* v : {&driven->position, &driven->velocity, &driven->acceleration}) v->resize(n);
    auto set = [&](Eigen::Index row, const Jet& jet) {
      driven->position[row] = jet.value;
      driven->velocity[row] = jet.rate;
      driven->acceleration[row] = jet.acceleration;
    };
    for (int i = 0; i < 6; ++i) set(map_.drives[i], state_.limbs[i / 2].side[i % 2].R);
    set(6 + map_.prescribed[0], pose.roll);
    set(6 + map_.prescribed[1], pose.pitch);
    set(6 + map_.prescribed[2], pose.heave);
  }

  void FillExtra(double* values) const {
    auto write = [&](double value) { *values++ = value; };
    auto write_pose = [&](const Vec3& p, const Mat3& R) {
      const Vec3 rpy = RpyOf(R);
      for (int c = 0; c < 3; ++c) write(p[c]);
      for (int c = 0; c < 3; ++c) write(rpy[c]);
    };
    write_pose(state_.upper.p_EB, state_.upper.R_EB);
    if (has_base_output_) write_pose(state_.motion.p_op, state_.motion.R_op);
    for (int i = 0; i < 3; ++i) {
      write(state_.limbs[i].length.value);
      if (map_.pairs == DrivePairs::kSynchronous) write(amplification_(state_.limbs[i]));
      for (int c = 0; c < 3; ++c) write(state_.forces[i].on_platform[c]);
    }
    reactions_.Write(state_, values);
  }

  CommandMap map_;
  std::vector<LoadPlace> load_places_;
  PlatformEquations equations_;
  Amplification amplification_;
  int prescribed_ = 0;
  bool has_base_output_ = false;
  ReactionChannelsOfLimbs reactions_;
  std::vector<Channel> channels_;
  std::vector<BodyLoad> loads_;
  Evaluation state_;
};

}  // namespace

std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism, const Motion& motion,
                                           const ClosedFormOptions& options,
                                           Diagnostics* diagnostics) {
  Diagnostics findings;
  const PlatformParameters parameters = ReadParameters(mechanism, &findings);
  const CommandMap map = MapCommands(mechanism, motion, &findings);
  std::vector<LoadPlace> loads = MapLoads(mechanism, motion, &findings);

  Model model = Model::kFull;
  if (options.model == "massless") {
    model = Model::kMassless;
  } else if (options.model == "paper_text") {
    model = Model::kPaperText;
  } else if (!options.model.empty() && options.model != "full") {
    findings.AddError("", fmt::format("analytic: model \"{}\" is unknown", options.model),
                      "full, massless or paper_text");
  }
  SignInM sign = SignInM::kCorrected;
  for (const std::string& erratum : options.as_printed) {
    if (erratum == "E2") {
      sign = SignInM::kPrinted;
      continue;
    }
    findings.AddError("", fmt::format("analytic: as_printed: \"{}\" is not offered", erratum),
                      "E2, the sign in M of equation (6)");
  }
  diagnostics->Append(findings);
  if (findings.has_errors()) return nullptr;
  return std::make_unique<StabilizingPlatform>(mechanism, parameters, map, std::move(loads), model,
                                               sign);
}

namespace {

constexpr JointKind kRevolute = JointKind::kRevolute, kPrismatic = JointKind::kPrismatic;
const Mat3 kParallel = Mat3::Identity();

// Heave, roll and pitch, in this order, and the deck.
void StateShip(const ParameterReader& read, Coverage* c) {
  const Vec3 zero = Vec3::Zero();
  for (const char* body : {"ship_heave", "ship_roll", "ship", "lower_platform"}) {
    c->bodies.push_back({.name = body});
  }
  const auto add = [&](const char* name, JointKind kind, const char* parent, const char* child,
                       const Vec3& axis) {
    c->joints.push_back({.name = name,
                         .kind = kind,
                         .parent = parent,
                         .child = child,
                         .p_parent = zero,
                         .p_child = zero,
                         .axis_parent = axis,
                         .axis_child = axis,
                         .R_zero = kParallel});
    c->prescribed.push_back({.name = name, .joint = name});
  };
  add("heave", kPrismatic, "world", "ship_heave", Vec3::UnitZ());
  add("roll", kRevolute, "ship_heave", "ship_roll", Vec3::UnitX());
  add("pitch", kRevolute, "ship_roll", "ship", Vec3::UnitY());
  c->joints.push_back({.name = "deck",
                       .kind = JointKind::kFixed,
                       .parent = "ship",
                       .child = "lower_platform",
                       .p_parent = zero,
                       .p_child = Vec3(0, 0, -read("s_r_so")),
                       .R_zero = kParallel});
}

void StatePlatform(const ParameterReader& read, Coverage* c) {
  c->bodies.push_back({.name = "platform",
                       .mass = read("m_p"),
                       .com = read.Vector("c_p", 0.0),
                       .inertia = read.Vector("I_p").asDiagonal(),
                       .why = "the platform's principal axes are those of {p}"});
  c->outputs.push_back({.name = "platform", .body = "platform"});
}

void StateLinks(const ParameterReader& read, const std::string& limb, Coverage* c) {
  const double scale = read("link_mass_scale", 1.0);
  const double inertia_scale = read("link1_inertia_scale", 1.0);
  for (int k = 0; k < 4; ++k) {
    const std::string stem = kLinkStems[k];
    const bool first = k == kLink1 || k == kLink1p;
    const double length = read(first ? "L1" : "L3"), fraction = read(first ? "c_1" : "c_2");
    const double factor = scale * (first ? inertia_scale : 1.0);
    c->bodies.push_back(
        {.name = limb + kLinkNames[k],
         .mass = scale * read("m_" + stem),
         .com =
             Vec3(read("c_" + stem + "_x", 0.0), fraction * length, read("c_" + stem + "_z", 0.0)),
         .inertia = (factor * read.Vector("I_" + stem)).asDiagonal(),
         .why = fmt::format("the centre of mass is at (c_{0}_x, {1} of the length, c_{0}_z), the "
                            "principal axes are along and across the link",
                            stem, first ? "c_1" : "c_2")});
  }
}

// Joints and drives of one limb; `e_r`, `e_t`: radial and tangential unit vectors.
void StateLimb(const ParameterReader& read, int index, double azimuth, Coverage* c) {
  const std::string limb = fmt::format("limb{}.", index + 1);
  const Vec3 e_r(std::cos(azimuth), std::sin(azimuth), 0), e_t(-e_r.y(), e_r.x(), 0);
  const Vec3 X = Vec3::UnitX(), Y = Vec3::UnitY(), zero = Vec3::Zero();
  const double r_a = read("r_a"), theta = read("theta_3"), L2 = read("L2");
  const Vec3 elbow = read("L1") * Y, tip = read("L3") * Y;
  const auto add = [&](const char* name, JointKind kind, const std::string& parent,
                       const std::string& child, const Vec3& p_parent, const Vec3& p_child,
                       const Vec3& axis_parent, const Vec3& axis_child) {
    c->joints.push_back({.name = limb + name,
                         .kind = kind,
                         .parent = parent,
                         .child = child,
                         .p_parent = p_parent,
                         .p_child = p_child,
                         .axis_parent = axis_parent,
                         .axis_child = axis_child,
                         .reversible = true});
  };
  for (int j = 0; j < 2; ++j) {
    const double s = kSides[j];
    const std::string suffix = j == 0 ? "" : "_p";
    const std::string link1 = limb + "link1" + suffix, link2 = limb + "link2" + suffix;
    add(j == 0 ? "U1" : "U1_p", JointKind::kUniversal, "lower_platform", link1,
        r_a * e_r - s * read("L5") * e_t, zero, e_t, X);
    add(j == 0 ? "R12" : "R12_p", kRevolute, link1, link2, elbow, zero, X, X);
    c->drives.push_back({.name = limb + "drive" + suffix,
                         .body_from = "lower_platform",
                         .body_to = link1,
                         .p_from = r_a * e_r + s * read("L4") * e_t,
                         .p_to = Vec3(0, L2 * std::cos(theta), s * L2 * std::sin(theta))});
  }
  add("R22", kRevolute, limb + "link2", limb + "link2_p", tip, tip, X, X);
  add("S", JointKind::kSpherical, limb + "link2", "platform", tip, read("r_b") * e_r, kAnyVector,
      kAnyVector);
}

// Links 1 and 2 of a side at home: the elbow lies outside, links 1 and 1' cross.
void StateAssembly(const Mechanism& mechanism, int index, Coverage* c) {
  for (int j = 0; j < 2; ++j) {
    const std::string limb = fmt::format("limb{}.", index + 1);
    const std::string link1 = limb + kLinkNames[size_t(kLink1 + j)];
    const std::string link2 = limb + kLinkNames[size_t(kLink2 + j)];
    const Vec3 d1 = HomeAxis(mechanism, link1, 1), d2 = HomeAxis(mechanism, link2, 1);
    StateBranch("body " + link2,
                kSides[size_t(j)] * d1.cross(d2).dot(HomeAxis(mechanism, link1, 0)),
                "the minus root of (20), links 1 and 1' cross", c);
  }
}

}  // namespace

Coverage CoverageOf(const Mechanism& mechanism) {
  Coverage c;
  c.form = "the closed form of the stabilizing platform";
  const ParameterReader read(mechanism, &c);
  (void)read("z_0");
  const double g = read("g");
  const char* axes[] = {"x", "y"};
  for (int k = 0; k < 2; ++k) {
    c.numbers.push_back({.subject = "gravity",
                         .quantity = std::string("component ") + axes[k],
                         .actual = mechanism.gravity_W[k],
                         .assumed = 0.0,
                         .scale = std::abs(g),
                         .unit = "m/s^2",
                         .why = "gravity is along z",
                         .inertial = true});
  }
  StateShip(read, &c);
  StatePlatform(read, &c);
  for (int i = 0; i < 3; ++i) {
    const double azimuth = i == 0 ? 0.0 : read(i == 1 ? "theta_1" : "theta_2");
    StateLinks(read, fmt::format("limb{}.", i + 1), &c);
    StateLimb(read, i, azimuth, &c);
    StateAssembly(mechanism, i, &c);
  }
  return c;
}

namespace {

constexpr std::array kShip = {"roll", "pitch", "heave"};
constexpr std::array kPose = {"x", "y", "z", "roll", "pitch", "yaw"};

constexpr const char* kHint =
    "command roll, pitch and heave, and either platform.z, platform.roll, platform.pitch with "
    "three equal pairs of drives, or all of platform.x, y, z, roll, pitch, yaw";

// Fills the entry of `map` that a command belongs to; false when there is none.
bool Place(const Mechanism& mechanism, const Command& command, int index, CommandMap* map) {
  using Kind = Coordinate::Kind;
  if (command.terms.size() == 1 && command.terms[0].factor == 1.0) {
    const Coordinate& c = command.terms[0].coordinate;
    if (c.kind == Kind::kPrescribed) {
      for (int k = 0; k < 3; ++k) {
        if (map->prescribed[k] != c.index) continue;
        map->ship[k] = index;
        return true;
      }
    }
    if (c.kind == Kind::kOutput && c.index == mechanism.FindOutput("platform")) {
      map->platform[c.component] = index;
      return true;
    }
  }
  if (command.terms.size() == 2 && command.terms[0].factor == -command.terms[1].factor) {
    const Coordinate &a = command.terms[0].coordinate, &b = command.terms[1].coordinate;
    if (a.kind != Kind::kDrive || b.kind != Kind::kDrive) return false;
    for (int i = 0; i < 3; ++i) {
      const int d = map->drives[2 * i], d_p = map->drives[2 * i + 1];
      if ((a.index != d || b.index != d_p) && (a.index != d_p || b.index != d)) continue;
      map->pair[i] = index;
      return true;
    }
  }
  return false;
}

Jet At(const CommandSample& sample, int index) {
  return {sample.position[index], sample.velocity[index], sample.acceleration[index]};
}

bool IsZero(const Jet& jet) {
  constexpr double kRoundoff = 1e-12;  // m, rad and their rates
  return std::abs(jet.value) <= kRoundoff && std::abs(jet.rate) <= kRoundoff &&
         std::abs(jet.acceleration) <= kRoundoff;
}

RunSummary Unsupported(const CommandSample& sample, std::string where, double amount,
                       const char* unit, const char* why) {
  return {.stop = Stop::kUnsupported,
          .message = fmt::format("{} = {:.6g} {}: {}", where, amount, unit, why),
          .time_s = sample.time_s,
          .where = where,
          .amount = amount,
          .unit = unit,
          .names_where = true};
}

// Drives and prescribed joints by their names.
void FindDriven(const Mechanism& mechanism, CommandMap* map, Diagnostics* diagnostics) {
  for (int i = 0; i < 6; ++i) {
    const std::string name = fmt::format("limb{}.drive{}", i / 2 + 1, i % 2 == 0 ? "" : "_p");
    map->drives[i] = mechanism.FindDrive(name);
    if (map->drives[i] < 0) {
      diagnostics->AddError("", fmt::format("drives: \"{}\" is missing", name),
                            "the closed form finds the drives by name");
    }
  }
  if (mechanism.drives.size() != 6) {
    diagnostics->AddError(
        "", fmt::format("drives: {} drives violate the closed form's 6", mechanism.drives.size()),
        "the limbs have two drives each");
  }
  for (int k = 0; k < 3; ++k) {
    for (size_t j = 0; j < mechanism.prescribed.size(); ++j) {
      if (mechanism.prescribed[j].name == kShip[k]) map->prescribed[k] = static_cast<int>(j);
    }
    if (map->prescribed[k] < 0) {
      diagnostics->AddError("", fmt::format("prescribed: \"{}\" is missing", kShip[k]),
                            "the closed form finds the ship's motions by name");
    }
  }
}

}  // namespace

CommandMap MapCommands(const Mechanism& mechanism, const Motion& motion, Diagnostics* diagnostics) {
  CommandMap map;
  Diagnostics names;
  FindDriven(mechanism, &map, &names);
  if (mechanism.FindOutput("platform") < 0) {
    names.AddError("", "outputs: \"platform\" is missing", "it is the frame {p}");
  }
  diagnostics->Append(names);
  if (!names.empty()) return map;

  for (size_t k = 0; k < motion.commands.size(); ++k) {
    const Command& command = motion.commands[k];
    if (Place(mechanism, command, static_cast<int>(k), &map)) continue;
    diagnostics->AddError(
        "", fmt::format("motion: the closed form has no use for the command \"{}\"", command.name),
        kHint);
  }
  const bool whole_pose = map.platform[0] >= 0 || map.platform[1] >= 0 || map.platform[5] >= 0;
  map.pairs = whole_pose ? DrivePairs::kIndependent : DrivePairs::kSynchronous;
  auto require = [&](int index, const std::string& name) {
    if (index >= 0) return;
    diagnostics->AddError("", fmt::format("motion: \"{}\" is not commanded", name), kHint);
  };
  for (int k = 0; k < 3; ++k) require(map.ship[k], kShip[k]);
  for (int c = 0; c < 6; ++c) {
    const bool follows = !whole_pose && (c == 0 || c == 1 || c == 5);
    if (!follows) require(map.platform[c], std::string("platform.") + kPose[c]);
  }
  for (int i = 0; i < 3; ++i) {
    const std::string pair = fmt::format("limb{0}.drive - limb{0}.drive_p", i + 1);
    if (!whole_pose) require(map.pair[i], pair);
    if (whole_pose && map.pair[i] >= 0) {
      diagnostics->AddError(
          "", fmt::format("motion: \"{}\" is commanded in addition to the pose", pair), kHint);
    }
  }
  return map;
}

RunSummary ReadCommand(const CommandMap& map, const CommandSample& sample, PoseCommand* command) {
  command->roll = At(sample, map.ship[0]);
  command->pitch = At(sample, map.ship[1]);
  command->heave = At(sample, map.ship[2]);
  for (int c = 0; c < 6; ++c) {
    command->platform[c] = map.platform[c] >= 0 ? At(sample, map.platform[c]) : Jet{};
  }
  if (map.pairs == DrivePairs::kIndependent) return RunSummary::Done();
  for (int c : {3, 4}) {
    if (IsZero(command->platform[c])) continue;
    return Unsupported(sample, std::string("platform.") + kPose[c], command->platform[c].value,
                       "rad", "the parasitic motion is derived for a level platform");
  }
  for (int i = 0; i < 3; ++i) {
    const Jet difference = At(sample, map.pair[i]);
    if (IsZero(difference)) continue;
    return Unsupported(sample, fmt::format("limb{0}.drive - limb{0}.drive_p", i + 1),
                       difference.value, "m", "synchronous drives are equally long");
  }
  return RunSummary::Done();
}

std::vector<LoadPlace> MapLoads(const Mechanism& mechanism, const Motion& motion,
                                Diagnostics* diagnostics) {
  std::vector<LoadPlace> places;
  for (const Load& load : motion.loads) {
    const std::string& body = mechanism.bodies[load.body].name;
    LoadPlace place;
    bool known = body == "platform";
    for (const char* ship : {"ship", "ship_heave", "ship_roll", "lower_platform"}) {
      if (body == ship) known = place.on_ship = true;
    }
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 4; ++k) {
        if (body != fmt::format("limb{}.{}", i + 1, kLinkNames[k])) continue;
        place = {.limb = i, .link = k};
        known = true;
      }
    }
    if (!known) {
      diagnostics->AddError(
          "", fmt::format("loads: {}: the closed form knows no body \"{}\"", load.name, body),
          "loads may act on the platform, on links of the limbs and on the ship");
    }
    places.push_back(place);
  }
  return places;
}

namespace {

int LinkIndex(const std::string& body, int limb) {
  for (int k = 0; k < 4; ++k) {
    if (body == fmt::format("limb{}.{}", limb + 1, kLinkNames[k])) return k;
  }
  return -1;
}

}  // namespace

ReactionChannelsOfLimbs::ReactionChannelsOfLimbs(const Mechanism& mechanism) {
  for (int limb = 0; limb < 3; ++limb) AddLimb(mechanism, limb);
}

void ReactionChannelsOfLimbs::AddLimb(const Mechanism& mechanism, int limb) {
  const std::string limb_name = fmt::format("limb{}.", limb + 1);
  auto add = [&](Kind kind, int side, const char* joint, const std::string& inner,
                 const std::string& outer) {
    Entry entry;
    entry.kind = kind;
    entry.limb = limb;
    entry.side = side;
    AddJoint(mechanism, std::move(entry), limb_name + joint, inner, outer);
  };
  const std::string link1 = limb_name + "link1", link1_p = limb_name + "link1_p";
  const std::string link2 = limb_name + "link2", link2_p = limb_name + "link2_p";
  add(Kind::kFoot, 0, "U1", "lower_platform", link1);
  add(Kind::kFoot, 1, "U1_p", "lower_platform", link1_p);
  add(Kind::kElbow, 0, "R12", link1, link2);
  add(Kind::kElbow, 1, "R12_p", link1_p, link2_p);
  add(Kind::kTip, 1, "R22", link2, link2_p);
  add(Kind::kBall, 0, "S", link2, "platform");
}

void ReactionChannelsOfLimbs::AddJoint(const Mechanism& mechanism, Entry entry,
                                       const std::string& name, const std::string& inner,
                                       const std::string& outer) {
  const int index = mechanism.FindJoint(name);
  if (index < 0) return;
  const Joint& joint = mechanism.joints[index];
  const std::string& parent = mechanism.bodies[joint.parent].name;
  const std::string& child = mechanism.bodies[joint.child].name;
  const bool reversed = parent == outer && child == inner;
  if (!reversed && (parent != inner || child != outer)) return;
  entry.sign = reversed ? -1.0 : 1.0;
  entry.parent_is_base = parent == "lower_platform";
  entry.parent_link = LinkIndex(parent, entry.limb);
  entry.R_PF = joint.X_PF.linear();
  const std::vector<Channel> all = ReactionChannels(joint);
  const bool with_moments = entry.kind == Kind::kFoot || entry.kind == Kind::kElbow;
  for (int c = 0; c < (with_moments ? 6 : 3); ++c) {
    // A joint does not transmit a moment about its (first) axis.
    if (c >= 3 && std::abs(joint.axis[c - 3]) > 1 - 1e-9) continue;
    entry.components.push_back(c);
    channels_.push_back(all[c]);
  }
  entries_.push_back(std::move(entry));
}

void ReactionChannelsOfLimbs::Write(const Evaluation& e, double* values) const {
  std::array<LimbReactions, 3> reactions;
  for (int i = 0; i < 3; ++i) {
    reactions[i] = ReactionsOf(e.geometry[i], e.required[i], e.forces[i]);
  }
  for (const Entry& entry : entries_) {
    const LimbForces& forces = e.forces[entry.limb];
    const Mat3& R_oA = e.limbs[entry.limb].R_oA;
    // Wrench of the inner on the outer body in {A_i}, [m; f].
    Vec3 m_A = Vec3::Zero(), f_A = Vec3::Zero();
    switch (entry.kind) {
      case Kind::kFoot:
        m_A = reactions[entry.limb].foot[entry.side].head<3>();
        f_A = reactions[entry.limb].foot[entry.side].tail<3>();
        break;
      case Kind::kElbow:
        m_A = reactions[entry.limb].elbow[entry.side].head<3>();
        f_A = reactions[entry.limb].elbow[entry.side].tail<3>();
        break;
      case Kind::kTip:
        f_A = forces.P[1];
        break;
      case Kind::kBall:
        f_A = forces.on_platform;
        break;
    }
    Mat3 R_AP;
    if (entry.parent_link >= 0) {
      R_AP = e.geometry[entry.limb].R_AL(entry.parent_link);
    } else if (entry.parent_is_base) {
      R_AP = R_oA.transpose();
    } else {
      R_AP = R_oA.transpose() * e.motion.R_op;
    }
    const Mat3 R_FA = (R_AP * entry.R_PF).transpose();
    const Vec3 f_F = entry.sign * (R_FA * f_A), m_F = entry.sign * (R_FA * m_A);
    for (int c : entry.components) *values++ = c < 3 ? f_F[c] : m_F[c - 3];
  }
}

}  // namespace mbv::stabilizing_platform
