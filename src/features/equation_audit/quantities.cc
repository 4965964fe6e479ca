#include "features/equation_audit/quantities.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "base/diagnostics.h"
#include "base/text.h"
#include "kinematics/constraints.h"
#include "reference/frame_stiffness.h"

namespace mbv {
class QuantityParser {
 public:
  using Kind = AuditQuantity::Kind;
  using Of = AuditQuantity::Of;

  QuantityParser(std::string text, const Mechanism& mechanism, std::string* reason,
                 std::string* hint)
      : text_(std::move(text)), mechanism_(mechanism), reason_(reason), hint_(hint) {}

  std::optional<AuditQuantity> Run() {
    std::string text = text_;
    if (!TakeElement(&text) || !TakeSuffix(" from ", &text, &q_.from_) ||
        !TakeSuffix(" in ", &text, &q_.in_) || !TakeSuffix(" from ", &text, &q_.from_) ||
        !TakeElement(&text)) {
      return {};
    }
    if (Whole(text) || OfCoordinate(text) || OfDrive(text) || OfStiffness(text) || OfJoint(text) ||
        OfBody(text)) {
      return q_;
    }
    *reason_ = fmt::format("{} has no quantity '{}'", mechanism_.name, text_);
    *hint_ = DidYouMean(text, Known());
    return {};
  }

 private:
  bool Fail(std::string reason) {
    *reason_ = std::move(reason);
    return false;
  }

  // "platform.velocity in rod": the body behind the word.
  bool TakeSuffix(const std::string& word, std::string* text, int* body) {
    const size_t at = text->rfind(word);
    if (at == std::string::npos) return true;
    const std::string name = text->substr(at + word.size());
    // The other word may stand behind it: that is taken first.
    if (name.find(' ') != std::string::npos) return true;
    *body = mechanism_.FindBody(name);
    if (*body < 0) {
      *hint_ = DidYouMean(name, NamesOf(mechanism_.bodies));
      return Fail(fmt::format("'{}': {} has no body '{}'", text_, mechanism_.name, name));
    }
    text->erase(at);
    return true;
  }

  // "[2]", "[1,3]", from 1.
  bool TakeElement(std::string* text) {
    if (!text->ends_with(']')) return true;
    const size_t open = text->rfind('[');
    if (open == std::string::npos) return Fail(fmt::format("'{}': '[' is missing", text_));
    const char* at = text->data() + open + 1;
    const char* end = text->data() + text->size() - 1;
    std::vector<int> numbers;
    while (at < end) {
      int number = 0;
      const auto [next, error] = std::from_chars(at, end, number);
      if (error != std::errc() || number < 1) {
        return Fail(fmt::format("'{}': elements are counted from 1", text_));
      }
      numbers.push_back(number - 1);
      at = next;
      while (at < end && (*at == ',' || *at == ' ')) ++at;
    }
    if (numbers.empty() || numbers.size() > 2) {
      return Fail(fmt::format("'{}': an element is [k] or [i,k]", text_));
    }
    q_.element_ = true;
    q_.row_ = numbers[0];
    q_.column_ = numbers.size() == 2 ? numbers[1] : -1;
    text->erase(open);
    return true;
  }

  bool Is(Kind kind) {
    q_.kind_ = kind;
    return true;
  }

  bool Whole(const std::string& text) {
    if (text == "0") return Is(Kind::kZero);
    if (text == "mass_matrix") return Is(Kind::kMass);
    if (text == "bias") return Is(Kind::kBias);
    return text == "gravity_forces" && Is(Kind::kGravity);
  }

  // The part of the text behind a name and a point; empty if it does not begin with it.
  static std::optional<std::string> Behind(const std::string& text, const std::string& name) {
    if (!text.starts_with(name)) return {};
    if (text.size() == name.size()) return "";
    if (text[name.size()] != '.') return {};
    return text.substr(name.size() + 1);
  }

  bool OfCoordinate(const std::string& text) {
    std::vector<NamedCoordinate> all = NamedCommandCoordinates(mechanism_);
    for (NamedCoordinate& joint : NamedJointCoordinates(mechanism_)) {
      all.push_back(std::move(joint));
    }
    for (const NamedCoordinate& named : all) {
      const auto rest = Behind(text, named.name);
      if (!rest) continue;
      const int order = rest->empty()             ? 0
                        : *rest == "velocity"     ? 1
                        : *rest == "acceleration" ? 2
                                                  : -1;
      if (order < 0) continue;
      q_.coordinate_ = named.coordinate;
      q_.order_ = order;
      return Is(Kind::kCoordinate);
    }
    return false;
  }

  bool OfDrive(const std::string& text) {
    for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
      const auto rest = Behind(text, mechanism_.drives[d].name);
      if (!rest || (*rest != "force" && *rest != "jacobian")) continue;
      q_.index_ = static_cast<int>(d);
      return Is(*rest == "force" ? Kind::kDriveForce : Kind::kDriveJacobian);
    }
    return false;
  }

  bool OfStiffness(const std::string& text) {
    for (size_t o = 0; o < mechanism_.outputs.size(); ++o) {
      const auto rest = Behind(text, mechanism_.outputs[o].name);
      if (!rest || (*rest != "stiffness" && *rest != "compliance")) continue;
      q_.index_ = static_cast<int>(o);
      return Is(*rest == "stiffness" ? Kind::kStiffness : Kind::kCompliance);
    }
    return false;
  }

  bool OfJoint(const std::string& text) {
    for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
      const auto rest = Behind(text, mechanism_.joints[j].name);
      if (!rest) continue;
      q_.index_ = static_cast<int>(j);
      if (*rest == "axis") return Is(Kind::kAxis);
      if (*rest == "position") return Is(Kind::kJointPosition);
      if (*rest == "reaction.force" || *rest == "reaction.moment") {
        q_.component_ = *rest == "reaction.force" ? 0 : 3;
        return Is(Kind::kReaction);
      }
      constexpr const char* kComponents[] = {"fx", "fy", "fz", "mx", "my", "mz"};
      for (int c = 0; c < 6; ++c) {
        if (*rest != std::string("reaction.") + kComponents[c]) continue;
        q_.component_ = c;
        return Is(Kind::kReactionComponent);
      }
    }
    return false;
  }

  static constexpr std::pair<const char*, Of> kWords[] = {
      {"position", Of::kPosition},
      {"rotation", Of::kRotation},
      {"velocity", Of::kVelocity},
      {"angular_velocity", Of::kAngularVelocity},
      {"acceleration", Of::kAcceleration},
      {"angular_acceleration", Of::kAngularAcceleration},
      {"jacobian", Of::kJacobian},
      {"inertia_force", Of::kInertiaForce},
      {"inertia_moment", Of::kInertiaMoment},
      {"weight", Of::kWeight}};

  // The longest name of a body that fits.
  bool OfBody(const std::string& text) {
    size_t longest = 0;
    for (size_t b = 0; b < mechanism_.bodies.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      const auto rest = Behind(text, body.name);
      if (!rest || rest->empty() || body.name.size() < longest) continue;
      if (!OfPoint(body, *rest)) continue;
      longest = body.name.size();
      q_.index_ = static_cast<int>(b);
    }
    return longest > 0 && Is(Kind::kBody);
  }

  bool OfPoint(const Body& body, const std::string& text) {
    const size_t dot = text.rfind('.');
    const std::string point = dot == std::string::npos ? "" : text.substr(0, dot);
    const std::string word = dot == std::string::npos ? text : text.substr(dot + 1);
    Pose X_BF = Pose::Identity();
    if (point == "com") {
      X_BF.translation() = body.p_BoBcm_B;
    } else if (!point.empty()) {
      const auto frame = std::ranges::find(body.frames, point, &NamedFrame::name);
      if (frame == body.frames.end()) return false;
      X_BF = frame->X_BF;
    }
    for (const auto& [known, of] : kWords) {
      if (word != known) continue;
      q_.X_BF_ = X_BF;
      q_.of_ = of;
      return true;
    }
    return false;
  }

  [[nodiscard]] std::vector<std::string> Known() const {
    std::vector<std::string> known = NamesOf(NamedCommandCoordinates(mechanism_));
    for (const Drive& drive : mechanism_.drives) known.push_back(drive.name + ".force");
    for (const Output& output : mechanism_.outputs) {
      known.push_back(output.name + ".stiffness");
      known.push_back(output.name + ".compliance");
    }
    for (const Body& body : mechanism_.bodies) {
      for (const auto& [word, of] : kWords) {
        known.push_back(body.name + "." + word);
        for (const NamedFrame& frame : body.frames) {
          known.push_back(body.name + "." + frame.name + "." + word);
        }
      }
    }
    for (const Joint& joint : mechanism_.joints) {
      for (const char* word : {"axis", "position", "reaction.force", "reaction.moment"}) {
        known.push_back(joint.name + "." + word);
      }
    }
    return known;
  }

  std::string text_;
  const Mechanism& mechanism_;
  std::string* reason_;
  std::string* hint_;
  AuditQuantity q_;
};

std::optional<AuditQuantity> AuditQuantity::Parse(const std::string& text,
                                                  const Mechanism& mechanism, std::string* reason,
                                                  std::string* hint) {
  return QuantityParser(text, mechanism, reason, hint).Run();
}

AuditQuantity AuditQuantity::OfCoordinate(const Coordinate& coordinate, int order) {
  AuditQuantity quantity;
  quantity.kind_ = Kind::kCoordinate;
  quantity.coordinate_ = coordinate;
  quantity.order_ = order;
  return quantity;
}

MatX AuditQuantity::OfBody(const AuditState& state) const {
  const auto b = static_cast<size_t>(index_);
  const Body& body = state.mechanism->bodies[b];
  const Pose& X = state.states.X_WB[b];
  const Vec3 w = state.states.V_WB[b].head<3>(), v = state.states.V_WB[b].tail<3>();
  const Vec3 alpha = state.states.A_WB[b].head<3>(), a = state.states.A_WB[b].tail<3>();
  const Vec3 r = X.linear() * X_BF_.translation();
  const auto acceleration = [&](const Vec3& arm) -> Vec3 {
    return a + alpha.cross(arm) + w.cross(w.cross(arm));
  };
  const Vec3 r_cm = X.linear() * body.p_BoBcm_B;
  const Mat3 I = X.linear() * body.I_Bcm_B * X.linear().transpose();
  switch (of_) {
    case Of::kPosition: {
      Vec3 p = X * X_BF_.translation();
      if (from_ >= 0) p -= state.states.X_WB[static_cast<size_t>(from_)].translation();
      return p;
    }
    case Of::kRotation:
      return X.linear() * X_BF_.linear();
    case Of::kVelocity:
      return v + w.cross(r);
    case Of::kAngularVelocity:
      return w;
    case Of::kAcceleration:
      return acceleration(r);
    case Of::kAngularAcceleration:
      return alpha;
    case Of::kJacobian: {
      MatX J = MatX::Zero(6, state.T.cols());
      if (index_ > 0) J = state.T.middleRows<6>(6 * (index_ - 1));
      for (Eigen::Index k = 0; k < J.cols(); ++k) {
        J.col(k).tail<3>() += J.col(k).head<3>().eval().cross(r);
      }
      return J;
    }
    case Of::kInertiaForce:
      return -body.mass * acceleration(r_cm);
    case Of::kInertiaMoment:
      return -(I * alpha + w.cross(I * w));
    case Of::kWeight:
      return body.mass * state.mechanism->gravity_W;
  }
  return {};
}

MatX AuditQuantity::Whole(const AuditState& state) const {
  const auto index = static_cast<size_t>(index_);
  const auto number = [](double value) -> MatX { return MatX::Constant(1, 1, value); };
  switch (kind_) {
    case Kind::kZero:
      return number(0.0);
    case Kind::kCoordinate: {
      const ScalarRow row = CoordinateRow(*state.mechanism, coordinate_, state.states,
                                          HomeValue(*state.mechanism, coordinate_));
      return number(order_ == 0   ? row.value
                    : order_ == 1 ? RateOf(row, state.states.V_WB)
                                  : RateOf(row, state.states.A_WB) + row.bias);
    }
    case Kind::kDriveForce:
      return number(state.drive_force[index_]);
    case Kind::kDriveJacobian:
      return state.drive_rates.row(index_).transpose();
    case Kind::kBody:
      return OfBody(state);
    case Kind::kAxis: {
      const Joint& joint = state.mechanism->joints[index];
      return state.states.X_WB[static_cast<size_t>(joint.parent)].linear() * joint.X_PF.linear() *
             joint.axis;
    }
    case Kind::kJointPosition: {
      const Joint& joint = state.mechanism->joints[index];
      Vec3 p = state.states.X_WB[static_cast<size_t>(joint.parent)] * joint.X_PF.translation();
      if (from_ >= 0) p -= state.states.X_WB[static_cast<size_t>(from_)].translation();
      return p;
    }
    case Kind::kReaction:
      return state.sample.reactions.row(index_).segment<3>(component_).transpose();
    case Kind::kReactionComponent:
      return number(state.sample.reactions(index_, component_));
    case Kind::kMass:
      return state.mass;
    case Kind::kBias:
      return state.bias;
    case Kind::kStiffness:
      return FrameStiffness(*state.mechanism, state.states.X_WB, index_).K;
    case Kind::kCompliance:
      return FrameStiffness(*state.mechanism, state.states.X_WB, index_).C;
    case Kind::kGravity:
      return state.gravity;
  }
  return {};
}

Argument AuditQuantity::At(const AuditState& state) const {
  MatX whole = Whole(state);
  if (in_ >= 0 && whole.rows() % 3 == 0) {
    const Mat3 R = state.states.X_WB[static_cast<size_t>(in_)].linear().transpose();
    for (Eigen::Index k = 0; k < whole.rows(); k += 3) {
      whole.middleRows<3>(k) = (R * whole.middleRows<3>(k)).eval();
    }
  }
  if (element_) {
    const Eigen::Index k = column_ < 0 ? 0 : column_;
    const bool there = row_ < whole.rows() && k < whole.cols();
    return {.values = {there ? whole(row_, k) : kNan}};
  }
  const bool scalar = whole.size() == 1 && kind_ != Kind::kMass && kind_ != Kind::kBias &&
                      kind_ != Kind::kGravity && kind_ != Kind::kDriveJacobian;
  Argument argument{
      .rows = scalar ? 0 : static_cast<int>(whole.rows()),
      .columns = whole.cols() == 1 && kind_ != Kind::kMass ? 0 : static_cast<int>(whole.cols())};
  for (Eigen::Index i = 0; i < whole.rows(); ++i) {
    for (Eigen::Index k = 0; k < whole.cols(); ++k) argument.values.push_back(whole(i, k));
  }
  return argument;
}

}  // namespace mbv
