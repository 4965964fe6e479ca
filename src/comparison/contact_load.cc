#include "comparison/contact_load.h"

#include <fmt/format.h>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/text.h"
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
    case Limit::kFall:
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

// (5): pushing forces at corners, as multiples x ≥ 0 of the edges of their pyramids, G x = w.
class PushingForces {
 public:
  PushingForces(const std::vector<Foot>& feet, double length_m) : length_m_(length_m) {
    std::vector<Vec3> corners;
    for (const Foot& foot : feet) {
      for (const Eigen::Vector2d& p : CornersOf(*foot.contact)) {
        corners.push_back(foot.joint->X_PF * Vec3(p.x(), p.y(), 0.0));
        middle_ += corners.back();
      }
    }
    middle_ /= static_cast<double>(corners.size());
    G_.resize(6, kSides * static_cast<Eigen::Index>(corners.size()));
    push_ = friction_ = G_;
    Eigen::Index column = 0;
    size_t corner = 0;
    for (const Foot& foot : feet) {
      const Mat3& R = foot.joint->X_PF.linear();
      for (size_t k = 0; k < CornersOf(*foot.contact).size(); ++k, ++corner) {
        for (int side = 0; side < kSides; ++side, ++column) {
          const double angle = 2.0 * std::numbers::pi * side / kSides;
          const Vec3 across(std::cos(angle), std::sin(angle), 0.0), p = corners[corner] - middle_;
          push_.col(column) = WrenchAt(p, R.col(2));
          friction_.col(column) = foot.contact->friction * WrenchAt(p, R * across);
        }
      }
    }
  }

  /// About the middle of the corners, per characteristic length, of the feet's at a sample.
  [[nodiscard]] Vec6 SumOf(const std::vector<Foot>& feet, size_t i) const {
    Vec6 w = Vec6::Zero();
    for (const Foot& foot : feet) {
      const Mat3& R = foot.joint->X_PF.linear();
      const Vec3 f = R * foot.wrenches[i].head<3>();
      const Vec3 p = foot.joint->X_PF.translation() - middle_;
      w.head<3>() += f;
      w.tail<3>() += (R * foot.wrenches[i].tail<3>() + p.cross(f)) / length_m_;
    }
    return w;
  }

  /// The least s of (5), to 1e-3 of it, from below 1 on to 2e-4; infinite above `kMost`.
  double LeastFriction(const Vec6& w) {
    constexpr double kMost = 1024.0;
    double most = 1.0, least = 0.0;
    while (!Hold(w, most)) {
      least = most;
      most *= 2.0;
      if (most > kMost) return std::numeric_limits<double>::infinity();
    }
    for (int i = 0; i < 12; ++i) {
      const double between = 0.5 * (least + most);
      (Hold(w, between) ? most : least) = between;
    }
    return most;
  }

 private:
  static constexpr int kSides = 32;

  static std::vector<Eigen::Vector2d> CornersOf(const Contact& contact) {
    if (contact.kind == Contact::Kind::kPoint) return {Eigen::Vector2d::Zero()};
    return contact.outline;
  }
  [[nodiscard]] Vec6 WrenchAt(const Vec3& p, const Vec3& f) const {
    return (Vec6() << f, p.cross(f) / length_m_).finished();
  }

  // Non-negative least squares [Lawson, Hanson 1974, ch. 23].
  bool Hold(const Vec6& w, double s) {
    constexpr double kHolds = 1e-7, kOut = 1e-10;  // of w, of unit columns
    G_ = (push_ + s * friction_).colwise().normalized();
    taken_.clear();
    Vec6 left = w;
    for (int step = 0; step < kMostSteps && left.norm() > kHolds * w.norm(); ++step) {
      Eigen::Index best = 0;
      if ((G_.transpose() * left).maxCoeff(&best) <= kOut * w.norm()) return false;
      if (std::ranges::find(taken_, best, &Share::column) != taken_.end()) return false;
      taken_.push_back({best, 0.0});
      while (!Balance(w, &left)) {
      }
    }
    return left.norm() <= kHolds * w.norm();
  }

  // Least squares of what is taken; false where one would pull, which is then given up.
  bool Balance(const Vec6& w, Vec6* left) {
    const auto n = static_cast<Eigen::Index>(taken_.size());
    Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 7> A(6, n);
    for (Eigen::Index k = 0; k < n; ++k) A.col(k) = G_.col(taken_[static_cast<size_t>(k)].column);
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 7, 1> x =
        A.completeOrthogonalDecomposition().solve(w);
    double step = 1.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double now = taken_[static_cast<size_t>(k)].force;
      if (x[k] <= 0.0) step = std::min(step, now / (now - x[k]));
    }
    for (Eigen::Index k = 0; k < n; ++k) {
      double& force = taken_[static_cast<size_t>(k)].force;
      force += step * (x[k] - force);
    }
    if (step < 1.0) {
      const double nothing = kEps * w.norm();
      std::erase_if(taken_, [&](const Share& share) { return share.force <= nothing; });
      return false;
    }
    *left = w - A * x;
    return true;
  }

  struct Share {
    Eigen::Index column;
    double force;
  };
  static constexpr int kMostSteps = 300;
  double length_m_;
  Vec3 middle_ = Vec3::Zero();
  /// Wrenches of pushing and of friction along the edges, per normal force; their sum.
  Eigen::Matrix<double, 6, Eigen::Dynamic> push_, friction_, G_;
  std::vector<Share> taken_;
};

// On ground that is not one plane.
std::optional<ContactLoad> OnAnyGround(const std::vector<Foot>& feet, const Trace& trace,
                                       double scale_N, double length_m) {
  for (const Foot& foot : feet) {
    const bool point = foot.contact->kind == Contact::Kind::kPoint;
    if (std::isnan(foot.contact->friction) || (!point && foot.contact->outline.empty())) return {};
  }
  ContactLoad load{.witness = trace.witness};
  ContactLoad::Use fall{.limit = Limit::kFall, .allowed = 1.0};
  PushingForces forces(feet, length_m);
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const Vec6 w = forces.SumOf(feet, i);
    if (w.norm() <= kNothing * scale_N) continue;
    const double s = forces.LeastFriction(w);
    if (!(s <= fall.worst)) {
      fall.worst = s;
      fall.time_s = trace.time_s[i];
    }
    if (s > fall.allowed && fall.beyond++ == 0) fall.from_s = trace.time_s[i];
  }
  if (!std::isnan(fall.worst)) load.uses.push_back(fall);
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
  static constexpr std::array<const char*, 5> kWords = {"lift", "slip", "tip", "twist", "fall"};
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
  if (!places.empty()) {
    loads.push_back(Together(feet, places, trace, scale_N, length_m));
  } else if (auto load = OnAnyGround(feet, trace, scale_N, length_m)) {
    loads.push_back(std::move(*load));
  }
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
    case Limit::kFall:
      verb = "fall";
      what = std::isinf(use.worst)
                 ? "no forces that push where they stand hold the robot, whatever the friction,"
                 : fmt::format(
                       "to hold, all coefficients of friction would have to be {:.3g} times "
                       "what is stated",
                       use.worst);
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
