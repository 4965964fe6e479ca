#include "comparison/contact_load.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "mechanism/channels.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using Limit = ContactLoad::Limit;
using Wrenches = std::vector<Vec6>;  // [f; m] per sample, in the contact's frame about its origin

// Of the largest force of all feet: what is less is rounding, or the error of an integration.
constexpr double kNothing = 1e-9;
constexpr double kSamePlane = 1e-6;  // characteristic lengths, rad

// Empty where the witness does not record them.
Wrenches WrenchesOf(const Joint& joint, const Trace& trace) {
  std::array<int, 6> columns{};
  for (int c = 0; c < 6; ++c) {
    const auto at = static_cast<size_t>(c);
    columns[at] = trace.Find(Quantity::kReaction, joint.name, c);
    if (columns[at] < 0) return {};
  }
  Wrenches wrenches(trace.time_s.size());
  for (size_t i = 0; i < wrenches.size(); ++i) {
    for (int c = 0; c < 6; ++c) {
      wrenches[i][c] = trace.values(static_cast<Eigen::Index>(i), columns[static_cast<size_t>(c)]);
    }
  }
  const bool complete =
      std::ranges::all_of(wrenches, [](const Vec6& wrench) { return wrench.allFinite(); });
  return complete ? wrenches : Wrenches();
}

double LargestForce(const Wrenches& wrenches) {
  double largest = 0.0;
  for (const Vec6& wrench : wrenches) largest = std::max(largest, wrench.head<3>().norm());
  return largest;
}

// From the nearest edge, negative outside; of a line along it. NaN without an outline.
double DistanceInside(const std::vector<Eigen::Vector2d>& outline, const Eigen::Vector2d& p) {
  if (outline.size() == 2) return std::min(p.x() - outline[0].x(), outline[1].x() - p.x());
  double least = outline.size() < 3 ? kNan : std::numeric_limits<double>::infinity();
  for (size_t k = 0; k < outline.size() && outline.size() > 2; ++k) {
    const Eigen::Vector2d& a = outline[k];
    const Eigen::Vector2d along = (outline[(k + 1) % outline.size()] - a).normalized();
    least = std::min(least, along.x() * (p.y() - a.y()) - along.y() * (p.x() - a.x()));
  }
  return least;
}

// What a foot can bear.
struct Strength {
  double friction = kNan, torsion = kNan;
  bool bears_moment = false;  // about the normal: lines and soles
};

class ContactMeter {
 public:
  /// `scale_N`: the largest force of all feet, `length_m`: characteristic.
  ContactMeter(const std::vector<double>& time_s, double scale_N, double length_m,
               ContactLoad* load)
      : time_s_(time_s),
        nothing_N_(kNothing * scale_N),
        nothing_Nm_(kNothing * scale_N * length_m),
        load_(*load) {}

  void Measure(const Wrenches& wrenches, const Strength& strength) {
    const bool has_outline = load_.outline.size() >= 2;
    ContactLoad::Use lift{.limit = Limit::kLift, .allowed = 0.0};
    ContactLoad::Use slip{.limit = Limit::kSlip, .allowed = strength.friction};
    ContactLoad::Use tip{.limit = Limit::kTip, .allowed = 0.0};
    ContactLoad::Use twist{.limit = Limit::kTwist, .allowed = strength.torsion};
    double sum = 0.0;
    for (size_t i = 0; i < wrenches.size(); ++i) {
      const Vec3 f = wrenches[i].head<3>(), m = wrenches[i].tail<3>();
      const double N = f.z();
      sum += N;
      if (!(load_.most_normal >= N)) load_.most_normal = N;
      Take(i, N, N < -nothing_N_, true, &lift);
      if (N <= nothing_N_) continue;  // nothing pushes: no pressure, no friction
      const double across = std::hypot(f.x(), f.y());
      Take(i, across / N, across > strength.friction * N + nothing_N_, false, &slip);
      const Eigen::Vector2d c(-m.y() / N, m.x() / N);
      load_.pressure.push_back(c);
      if (has_outline) {
        const double inside = DistanceInside(load_.outline, c);
        Take(i, inside, inside * N < -nothing_Nm_, true, &tip);
      }
      if (strength.bears_moment) {
        const double moment = std::abs(m.z() - c.x() * f.y() + c.y() * f.x());
        Take(i, moment / N, moment > strength.torsion * N + nothing_Nm_, false, &twist);
      }
    }
    load_.mean_normal = sum / static_cast<double>(wrenches.size());
    for (const ContactLoad::Use& use : {lift, slip, tip, twist}) {
      if (!std::isnan(use.worst)) load_.uses.push_back(use);
    }
  }

 private:
  void Take(size_t i, double value, bool beyond, bool least, ContactLoad::Use* use) const {
    const bool worse = std::isnan(use->worst) || (least ? value < use->worst : value > use->worst);
    if (worse) {
      use->worst = value;
      use->time_s = time_s_[i];
    }
    if (!beyond) return;
    if (use->beyond++ == 0) use->from_s = time_s_[i];
  }

  const std::vector<double>& time_s_;
  const double nothing_N_, nothing_Nm_;
  ContactLoad& load_;
};

struct Foot {
  const Contact* contact;
  const Joint* joint;
  Wrenches wrenches;
};

// Components of the wrench that a limit is about.
std::vector<int> ComponentsOf(Limit limit) {
  switch (limit) {
    case Limit::kLift:
      return {2};
    case Limit::kSlip:
      return {0, 1, 2};
    case Limit::kTip:
      return {2, 3, 4};
    case Limit::kTwist:
      return {0, 1, 2, 3, 4, 5};
  }
  return {};
}

void MarkOpen(const Joint& joint, const std::vector<std::string>& not_unique, ContactLoad* load) {
  for (ContactLoad::Use& use : load->uses) {
    for (const int c : ComponentsOf(use.limit)) {
      if (Contains(not_unique, ChannelName(Quantity::kReaction, joint.name, c))) use.unique = false;
    }
  }
}

// Nothing but these feet and a free joint tie bodies to the ground.
bool BearAll(const Mechanism& mechanism, const std::vector<Foot>& feet) {
  const int ground = feet.front().joint->parent;
  if (ground != 0) return false;
  for (const Joint& joint : mechanism.joints) {
    const bool on_ground = joint.parent == ground || joint.child == ground;
    const bool foot = std::ranges::any_of(feet, [&](const Foot& f) { return f.joint == &joint; });
    if (on_ground && !foot && joint.kind != JointKind::kFree) return false;
  }
  return std::ranges::none_of(mechanism.drives, [&](const Drive& drive) {
    const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
    return leg != nullptr && (leg->body_from == ground || leg->body_to == ground);
  });
}

// In the first foot's frame; empty where their grounds are not one plane.
std::vector<Pose> PlacesOnOnePlane(const Mechanism& mechanism, const std::vector<Foot>& feet) {
  const double length = CharacteristicLength(mechanism);
  std::vector<Pose> places;
  for (const Foot& foot : feet) {
    if (foot.joint->parent != feet.front().joint->parent) return {};
    places.push_back(feet.front().joint->X_PF.inverse() * foot.joint->X_PF);
    const Vec3 n = places.back().linear().col(2);
    const double height = places.back().translation().z();
    if (n.head<2>().norm() > kSamePlane || n.z() < 0.0) return {};
    if (std::abs(height) > kSamePlane * length) return {};
  }
  return places;
}

ContactLoad Together(const std::vector<Foot>& feet, const std::vector<Pose>& places,
                     const Trace& trace, double scale_N, double length_m) {
  ContactLoad load{.witness = trace.witness};
  Wrenches sum(trace.time_s.size(), Vec6::Zero());
  Strength strength{.friction = 0.0};
  std::vector<Eigen::Vector2d> corners;
  bool outlined = true;
  for (size_t k = 0; k < feet.size(); ++k) {
    const Contact& contact = *feet[k].contact;
    for (size_t i = 0; i < sum.size(); ++i) {
      const Vec3 f = places[k].linear() * feet[k].wrenches[i].head<3>();
      sum[i].head<3>() += f;
      sum[i].tail<3>() +=
          places[k].linear() * feet[k].wrenches[i].tail<3>() + places[k].translation().cross(f);
    }
    strength.friction = std::isnan(contact.friction) || std::isnan(strength.friction)
                            ? kNan
                            : std::max(strength.friction, contact.friction);
    outlined = outlined && (contact.kind == Contact::Kind::kPoint || !contact.outline.empty());
    std::vector<Eigen::Vector2d> own = contact.outline;
    if (contact.kind == Contact::Kind::kPoint) own = {Eigen::Vector2d::Zero()};
    for (const Eigen::Vector2d& p : own) {
      corners.emplace_back((places[k] * Vec3(p.x(), p.y(), 0.0)).head<2>());
    }
  }
  if (outlined) load.outline = ConvexHull(std::move(corners));
  if (load.outline.size() < 3) load.outline.clear();
  ContactMeter(trace.time_s, scale_N, length_m, &load).Measure(sum, strength);
  return load;
}

std::string Since(const ContactLoad::Use& use) {
  return use.beyond == 1 ? ""
                         : fmt::format("; from {:.4g} s on, {} samples", use.from_s, use.beyond);
}

}  // namespace

const ContactLoad::Use* ContactLoad::Find(Limit limit) const {
  const auto found = std::ranges::find_if(uses, [&](const Use& use) { return use.limit == limit; });
  return found == uses.end() ? nullptr : &*found;
}

bool ContactLoad::unique() const {
  return std::ranges::all_of(uses, [](const Use& use) { return use.unique; });
}

const char* ToText(ContactLoad::Limit limit) {
  static constexpr std::array<const char*, 4> kWords = {"lift", "slip", "tip", "twist"};
  return kWords.at(static_cast<size_t>(limit));
}

std::vector<ContactLoad> ContactLoadsOf(const Mechanism& mechanism, const Trace& trace,
                                        const std::vector<std::string>& not_unique) {
  std::vector<Foot> feet;
  const double length_m = CharacteristicLength(mechanism);
  double scale_N = 0.0;
  for (const Contact& contact : mechanism.contacts) {
    if (contact.joint < 0) continue;
    const Joint& joint = mechanism.joints[static_cast<size_t>(contact.joint)];
    Wrenches wrenches = WrenchesOf(joint, trace);
    if (wrenches.empty()) return {};
    scale_N = std::max(scale_N, LargestForce(wrenches));
    feet.push_back({&contact, &joint, std::move(wrenches)});
  }
  std::vector<ContactLoad> loads;
  for (const Foot& foot : feet) {
    ContactLoad load{.contact = foot.contact->name,
                     .kind = WordOf(foot.contact->kind),
                     .witness = trace.witness,
                     .outline = foot.contact->outline};
    ContactMeter(trace.time_s, scale_N, length_m, &load)
        .Measure(foot.wrenches, {.friction = foot.contact->friction,
                                 .torsion = foot.contact->torsion,
                                 .bears_moment = foot.contact->kind != Contact::Kind::kPoint});
    MarkOpen(*foot.joint, not_unique, &load);
    loads.push_back(std::move(load));
  }
  if (feet.size() < 2 || !BearAll(mechanism, feet)) return loads;
  const std::vector<Pose> places = PlacesOnOnePlane(mechanism, feet);
  if (!places.empty()) loads.push_back(Together(feet, places, trace, scale_N, length_m));
  return loads;
}

std::string ExceededText(const ContactLoad& load, const ContactLoad::Use& use) {
  const char* verb = "";
  std::string what;
  switch (use.limit) {
    case Limit::kLift:
      verb = "lift";
      what = fmt::format("the ground would have to pull with {:.4g} N", -use.worst);
      break;
    case Limit::kSlip:
      verb = "slip";
      what = fmt::format("to hold, it takes a coefficient of friction of {:.4g}, stated is {:.4g},",
                         use.worst, use.allowed);
      break;
    case Limit::kTip:
      verb = "tip";
      what = fmt::format("the centre of pressure is {:.4g} mm outside what touches the ground",
                         -1e3 * use.worst);
      break;
    case Limit::kTwist:
      verb = "twist";
      what =
          fmt::format("the moment about the normal has a lever of {:.4g} mm, torsion states {:.4g}",
                      1e3 * use.worst, 1e3 * use.allowed);
      break;
  }
  return fmt::format("{} {}{}: {} at {:.4g} s{}{}", load.name(), verb,
                     load.contact.empty() ? "" : "s", what, use.time_s, Since(use),
                     use.unique
                         ? ""
                         : "; statics leaves open what the feet share, and this is one share "
                           "of many");
}

}  // namespace mbv
