#include "render/scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "mechanism/named_places.h"
#include "model_file/mesh/decimate.h"

namespace mbv::render {

namespace {

// Annotations: they glow a little, so that shadows do not change their meaning.
const std::map<std::string, std::array<float, 4>>& Marks() {
  static const std::map<std::string, std::array<float, 4>> marks = {
      {"closure", {0.80F, 0.10F, 0.55F, 1.0F}}, {"gap", {1.00F, 0.05F, 0.05F, 1.0F}},
      {"pull", {0.10F, 0.35F, 0.85F, 1.0F}},    {"push", {0.88F, 0.12F, 0.10F, 1.0F}},
      {"x_axis", {0.95F, 0.68F, 0.00F, 1.0F}},  {"y_axis", {0.16F, 0.60F, 0.20F, 1.0F}},
      {"z_axis", {0.00F, 0.68F, 0.64F, 1.0F}},  {"path", {0.42F, 0.18F, 0.70F, 1.0F}},
  };
  return marks;
}

struct Finish {
  float specular = 0.25F, shininess = 0.35F;
};

Finish FinishOf(const std::string& color) {
  static const std::map<std::string, Finish> finishes = {
      {"aluminium", {0.6F, 0.6F}}, {"brass", {0.6F, 0.6F}},      {"copper", {0.6F, 0.6F}},
      {"dark", {0.6F, 0.6F}},      {"dark_steel", {0.6F, 0.6F}}, {"deck", {0.05F, 0.1F}},
      {"glass", {0.8F, 0.8F}},     {"rubber", {0.05F, 0.1F}},    {"steel", {0.6F, 0.6F}},
      {"wood", {0.05F, 0.1F}},
  };
  const auto it = finishes.find(color);
  return it == finishes.end() ? Finish{} : it->second;  // paint
}

}  // namespace

Material MaterialOf(const std::string& color) {
  if (const auto mark = Marks().find(color); mark != Marks().end()) {
    return {.rgba = mark->second, .specular = 0.1F, .shininess = 0.3F, .emission = 0.05F};
  }
  const Finish finish = FinishOf(color);
  Material material{.specular = finish.specular, .shininess = finish.shininess};
  const std::array<double, 4> rgba = ShapeColor(color);
  for (std::size_t i = 0; i < 4; ++i) material.rgba[i] = static_cast<float>(rgba[i]);
  return material;
}

bool IsScenery(const std::string& color) {
  return color == "sea" || color == "hull" || color == "deck";
}

Mat3 FrameAlong(const Vec3& axis) {
  const Vec3 z = axis.normalized();
  const Vec3 x = z.unitOrthogonal();
  Mat3 R;
  R << x, z.cross(x), z;
  return R;
}

Item Between(Solid solid, const Vec3& p, const Vec3& q, double radius, const Material& material) {
  const Vec3 d = q - p;
  const double length = d.norm();
  if (length < 1e-9 * radius) return BallAt(p, radius, material);
  Item item{.solid = solid, .material = material};
  item.X_WG.linear() = FrameAlong(d);
  item.X_WG.translation() = solid == Solid::kArrow ? p : Vec3(0.5 * (p + q));
  item.size = Vec3(radius, radius, solid == Solid::kArrow ? length : 0.5 * length);
  return item;
}

Item BallAt(const Vec3& p, double radius, const Material& material) {
  Item item{.solid = Solid::kBall, .material = material};
  item.X_WG.translation() = p;
  item.size = Vec3::Constant(radius);
  return item;
}

std::vector<Vec3> Corners(const Item& item) {
  Vec3 low = -item.size, high = item.size;
  if (item.solid == Solid::kCapsule) {
    low.z() -= item.size.x();
    high.z() += item.size.x();
  } else if (item.solid == Solid::kArrow) {
    low.z() = 0.0;
  }
  low += item.p_GBox;
  high += item.p_GBox;
  std::vector<Vec3> corners;
  for (int i = 0; i < 8; ++i) {
    const Vec3 p_G((i & 1) != 0 ? high.x() : low.x(), (i & 2) != 0 ? high.y() : low.y(),
                   (i & 4) != 0 ? high.z() : low.z());
    corners.push_back(item.X_WG * p_G);
  }
  return corners;
}

namespace {

// Points where joints and distance drives touch a body, in the body's frame. Joints that move a
// base (prescribed) or do not move at all are not touching points.
std::vector<Vec3> TouchPoints(const Mechanism& mechanism, int body) {
  std::vector<Vec3> points;
  const auto add = [&points](const Vec3& p) {
    for (const Vec3& q : points) {
      if ((p - q).norm() < 1e-9) return;
    }
    points.push_back(p);
  };
  for (std::size_t j = 0; j < mechanism.joints.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    const bool moves_base = std::ranges::any_of(
        mechanism.prescribed, [j](const Prescribed& p) { return p.joint == static_cast<int>(j); });
    if (moves_base || joint.kind == JointKind::kFree) continue;
    if (joint.parent == body) add(joint.X_PF.translation());
    if (joint.child == body) add(joint.X_CM.translation());
  }
  for (const Drive& drive : mechanism.drives) {
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      if (leg->body_from == body) add(leg->p_from);
      if (leg->body_to == body) add(leg->p_to);
    }
  }
  for (const SpringDamper& spring : mechanism.springs) {
    if (spring.body_from == body) add(spring.p_from);
    if (spring.body_to == body) add(spring.p_to);
  }
  return points;
}

Item MeshItem(const Mesh& mesh, const Pose& X_WB, const Material& material) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.surface->vertices) box.extend(p);
  return {.solid = Solid::kMesh,
          .X_WG = X_WB * mesh.X_BG,
          .size = 0.5 * box.sizes(),
          .material = material,
          .mesh = mesh.surface,
          .p_GBox = box.center()};
}

void AddShape(const Shape& shape, const Pose& X_WB, std::vector<Item>* items) {
  const Material material = MaterialOf(shape.color);
  Item item;
  if (const auto* capsule = std::get_if<Capsule>(&shape.geometry)) {
    item = Between(Solid::kCapsule, X_WB * capsule->p_from, X_WB * capsule->p_to, capsule->radius,
                   material);
  } else if (const auto* cylinder = std::get_if<Cylinder>(&shape.geometry)) {
    item = Between(Solid::kCylinder, X_WB * cylinder->p_from, X_WB * cylinder->p_to,
                   cylinder->radius, material);
  } else if (const auto* box = std::get_if<Box>(&shape.geometry)) {
    item = {.solid = Solid::kBox,
            .X_WG = X_WB * box->X_BG,
            .size = 0.5 * box->size,
            .material = material};
  } else if (const auto* ball = std::get_if<Ball>(&shape.geometry)) {
    item = BallAt(X_WB * ball->p_centre, ball->radius, material);
  } else if (const auto* mesh = std::get_if<Mesh>(&shape.geometry)) {
    if (mesh->surface->vertices.empty()) return;
    item = MeshItem(*mesh, X_WB, material);
  }
  if (IsScenery(shape.color)) item.framing = Framing::kNever;
  items->push_back(item);
}

// The outline of points in a plane with this normal, anticlockwise about it.
std::vector<Vec3> OutlineOf(std::vector<Vec3> points, const Vec3& x, const Vec3& y,
                            const Vec3& normal) {
  // Lower and upper hull [Andrew 1979].
  std::ranges::sort(points, {}, [&](const Vec3& p) { return std::pair(x.dot(p), y.dot(p)); });
  std::vector<Vec3> hull;
  for (int side = 0; side < 2; ++side, std::ranges::reverse(points)) {
    const std::size_t first = hull.size();
    for (const Vec3& p : points) {
      while (hull.size() >= first + 2) {
        const Vec3 &a = hull[hull.size() - 2], &b = hull.back();
        if ((b - a).cross(p - b).dot(normal) > 0.0) break;
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
  }
  return hull;
}

// A plate through points that lie in a plane and in no line; null for others.
std::shared_ptr<const TriangleMesh> PlateThrough(const std::vector<Vec3>& points,
                                                 double thickness) {
  constexpr double kFlat = 0.05, kWide = 0.05;  // of the largest extent
  if (points.size() < 3) return nullptr;
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points) centre += p / static_cast<double>(points.size());
  Mat3 spread = Mat3::Zero();
  for (const Vec3& p : points) spread += (p - centre) * (p - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
  const Vec3 extent = axes.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  if (extent[0] > kFlat * extent[2] || extent[1] < kWide * extent[2]) return nullptr;
  const Vec3 normal = axes.eigenvectors().col(0), x = axes.eigenvectors().col(2);
  const std::vector<Vec3> outline = OutlineOf(points, x, normal.cross(x), normal);
  auto plate = std::make_shared<TriangleMesh>();
  const auto n = static_cast<int>(outline.size());
  for (const double side : {-0.5, 0.5}) {
    for (const Vec3& p : outline) plate->vertices.push_back(p + side * thickness * normal);
  }
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    plate->triangles.push_back({k, next, next + n});
    plate->triangles.push_back({k, next + n, k + n});
    if (k == 0 || next == 0) continue;
    plate->triangles.push_back({0, next, k});
    plate->triangles.push_back({n, n + k, n + next});
  }
  return plate;
}

// A body without shapes: a rod between two touching points; for more a plate where they lie in a
// plane, else a star.
void AddDefaultShape(const Mechanism& mechanism, int body, const Pose& X_WB, const Scale& scale,
                     std::vector<Item>* items) {
  std::vector<Vec3> points = TouchPoints(mechanism, body);
  if (points.empty()) return;
  const Body& b = mechanism.bodies[body];
  const bool is_output = std::ranges::any_of(
      mechanism.outputs, [body](const Output& output) { return output.body == body; });
  const Material material = MaterialOf(body == 0 ? "base" : is_output ? "accent" : "steel");
  const double radius = 0.8 * scale.leg_m;
  if (points.size() == 1 && b.p_BoBcm_B != points[0] && b.mass > 0.0) points.push_back(b.p_BoBcm_B);
  if (points.size() == 1) {
    items->push_back(BallAt(X_WB * points[0], 1.2 * radius, material));
    return;
  }
  if (points.size() == 2) {
    items->push_back(
        Between(Solid::kCapsule, X_WB * points[0], X_WB * points[1], radius, material));
    return;
  }
  if (const auto& plate = scale.plates[static_cast<std::size_t>(body)]) {
    items->push_back(
        MeshItem({.X_BG = Pose::Identity(), .file = {}, .surface = plate}, X_WB, material));
    return;
  }
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points) centre += p / static_cast<double>(points.size());
  for (const Vec3& p : points) {
    items->push_back(Between(Solid::kCapsule, X_WB * centre, X_WB * p, radius, material));
  }
}

// Whether the model's own shapes already show a joint here: a ball at the point or a pin along
// the axis whose middle is the point.
bool IsShown(const Body& body, const Vec3& p, const Vec3& axis, double reach) {
  return std::ranges::any_of(body.shapes, [&](const Shape& shape) {
    if (const auto* ball = std::get_if<Ball>(&shape.geometry)) {
      return (ball->p_centre - p).norm() < reach;
    }
    if (const auto* pin = std::get_if<Cylinder>(&shape.geometry)) {
      const Vec3 d = pin->p_to - pin->p_from;
      return (0.5 * (pin->p_from + pin->p_to) - p).norm() < reach &&
             d.cross(axis).norm() < 1e-6 * d.norm();
    }
    return false;
  });
}

// Radius of the thickest rod of a body that ends at a point.
double RodRadiusAt(const Body& body, const Vec3& p, double reach) {
  double radius = 0.0;
  const auto visit = [&](const Vec3& from, const Vec3& to, double r) {
    if (std::min((from - p).norm(), (to - p).norm()) < reach) radius = std::max(radius, r);
  };
  for (const Shape& shape : body.shapes) {
    if (const auto* capsule = std::get_if<Capsule>(&shape.geometry)) {
      visit(capsule->p_from, capsule->p_to, capsule->radius);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape.geometry)) {
      visit(cylinder->p_from, cylinder->p_to, cylinder->radius);
    }
  }
  return radius;
}

void AddJoint(const Mechanism& mechanism, const Joint& joint, const PictureFrame& frame,
              const Scale& scale, std::vector<Item>* items) {
  const Pose X_WF = frame.X_WB[joint.parent] * joint.X_PF;
  const Pose X_WM = frame.X_WB[joint.child] * joint.X_CM;
  const Vec3 p = X_WF.translation();
  const Vec3 a1 = X_WF.linear() * joint.axis, a2 = X_WM.linear() * joint.axis2;
  const double r = JointRadius(mechanism, joint, scale);
  if (IsShown(mechanism.bodies[joint.parent], joint.X_PF.translation(),
              joint.X_PF.linear() * joint.axis, scale.joint_m) ||
      IsShown(mechanism.bodies[joint.child], joint.X_CM.translation(),
              joint.X_CM.linear() * joint.axis, scale.joint_m)) {
    return;
  }
  const Material pin = MaterialOf("dark_steel"), ball = MaterialOf("brass");
  switch (joint.kind) {
    case JointKind::kRevolute:
      items->push_back(Between(Solid::kCylinder, p - 1.5 * r * a1, p + 1.5 * r * a1, r, pin));
      break;
    case JointKind::kUniversal:
      items->push_back(Between(Solid::kCylinder, p - 1.6 * r * a1, p + 1.6 * r * a1, 0.6 * r, pin));
      items->push_back(
          Between(Solid::kCylinder, p - 1.6 * r * a2, p + 1.6 * r * a2, 0.6 * r, ball));
      break;
    case JointKind::kSpherical:
      items->push_back(BallAt(p, 1.2 * r, ball));
      break;
    case JointKind::kPrismatic:
    case JointKind::kCylindrical: {
      const Vec3 c = X_WM.translation();
      items->push_back(Between(Solid::kCylinder, c - 1.2 * r * a1, c + 1.2 * r * a1, r, pin));
      break;
    }
    case JointKind::kPlanar:
      items->push_back(Between(Solid::kCylinder, p - 0.2 * r * a1, p + 0.2 * r * a1, 2.0 * r, pin));
      break;
    case JointKind::kPointOnLine:
      items->push_back(Between(Solid::kCylinder, p - 4.0 * r * a1, p + 4.0 * r * a1, 0.4 * r, pin));
      items->push_back(BallAt(X_WM.translation(), 1.2 * r, ball));
      break;
    case JointKind::kPointOnPlane:
      items->push_back(Between(Solid::kCylinder, p - 0.2 * r * a1, p + 0.2 * r * a1, 2.5 * r, pin));
      items->push_back(BallAt(X_WM.translation(), 1.2 * r, ball));
      break;
    case JointKind::kFixed:
    case JointKind::kFree:
      break;
  }
}

// A leg that telescopes: the barrel keeps its length, the rod slides in it.
void AddLeg(const Drive& drive, const DistanceDrive& leg, double barrel_m,
            const PictureFrame& frame, const Scale& scale, std::vector<Item>* items) {
  const Vec3 p = frame.X_WB[leg.body_from] * leg.p_from;
  const Vec3 q = frame.X_WB[leg.body_to] * leg.p_to;
  const double length = (q - p).norm(), r = drive.radius > 0.0 ? drive.radius : scale.leg_m;
  const Vec3 e = length > 0.0 ? Vec3((q - p) / length) : Vec3::UnitZ();
  const Vec3 mouth = p + std::min(barrel_m, length) * e;
  items->push_back(Between(Solid::kCylinder, p, mouth, r, MaterialOf("blue")));
  items->push_back(Between(Solid::kCylinder, mouth - 0.25 * r * e, mouth + 0.5 * r * e, 1.15 * r,
                           MaterialOf("dark_steel")));
  items->push_back(Between(Solid::kCylinder, mouth, q, 0.55 * r, MaterialOf("aluminium")));
  for (const Vec3& end : {p, q}) items->push_back(BallAt(end, 1.25 * r, MaterialOf("brass")));
}

// A helix between its ends, around a telescoping damper if there is damping.
void AddSpring(const SpringDamper& spring, const PictureFrame& frame, const Scale& scale,
               std::vector<Item>* items) {
  const Vec3 p = frame.X_WB[spring.body_from] * spring.p_from;
  const Vec3 q = frame.X_WB[spring.body_to] * spring.p_to;
  const double length = (q - p).norm(), r = scale.leg_m;
  if (length <= 0.0) return;
  const Mat3 R = FrameAlong(q - p);
  const Vec3 e = R.col(2);
  const double plain = std::min(0.1 * length, 3.0 * r);  // straight ends
  if (spring.damping > 0.0) {
    const Vec3 mouth = p + 0.55 * length * e;
    items->push_back(Between(Solid::kCylinder, p + plain * e, mouth, 0.8 * r, MaterialOf("grey")));
    items->push_back(Between(Solid::kCylinder, p, q, 0.3 * r, MaterialOf("dark_steel")));
  }
  for (const Vec3& end : {p, q}) items->push_back(BallAt(end, 0.8 * r, MaterialOf("brass")));
  if (spring.stiffness == 0.0) return;
  constexpr int kTurns = 7, kPerTurn = 14;
  const double coil = 1.7 * r, wire = 0.28 * r;
  const auto point = [&](int i) {
    const double angle = 2.0 * std::numbers::pi * i / kPerTurn;
    const double along = plain + (length - 2.0 * plain) * i / (kTurns * kPerTurn);
    return Vec3(p + R * Vec3(coil * std::cos(angle), coil * std::sin(angle), along));
  };
  const Material steel = MaterialOf("steel");
  for (int i = 0; i < kTurns * kPerTurn; ++i) {
    items->push_back(Between(Solid::kCapsule, point(i), point(i + 1), wire, steel));
  }
  items->push_back(Between(Solid::kCapsule, p, point(0), wire, steel));
  items->push_back(Between(Solid::kCapsule, point(kTurns * kPerTurn), q, wire, steel));
}

void AddTriad(const Pose& X_WO, double length, std::vector<Item>* items) {
  const char* names[] = {"x_axis", "y_axis", "z_axis"};
  for (int i = 0; i < 3; ++i) {
    const Vec3 p = X_WO.translation(), q = p + length * X_WO.linear().col(i);
    items->push_back(Between(Solid::kArrow, p, q, 0.035 * length, MaterialOf(names[i])));
    items->back().casts_shadow = false;
  }
}

}  // namespace

double JointRadius(const Mechanism& mechanism, const Joint& joint, const Scale& scale) {
  const double rod =
      std::max(RodRadiusAt(mechanism.bodies[joint.parent], joint.X_PF.translation(), scale.joint_m),
               RodRadiusAt(mechanism.bodies[joint.child], joint.X_CM.translation(), scale.joint_m));
  return std::min(std::max(scale.joint_m, 1.2 * rod), 4.0 * scale.joint_m);
}

Scale ScaleOf(const Mechanism& mechanism, const std::vector<PictureFrame>& frames) {
  Scale scale;
  const std::vector<Pose>& X_WB = frames.empty() ? mechanism.X_WB_home : frames[0].X_WB;
  Eigen::AlignedBox3d box;
  for (std::size_t b = 0; b < mechanism.bodies.size(); ++b) {
    for (const Vec3& p : TouchPoints(mechanism, static_cast<int>(b))) box.extend(X_WB[b] * p);
  }
  if (!box.isEmpty() && box.diagonal().norm() > 1e-9) scale.extent_m = box.diagonal().norm();
  scale.joint_m = 0.0075 * scale.extent_m;
  scale.leg_m = 0.0085 * scale.extent_m;
  scale.arrow_m = 0.18 * scale.extent_m;
  scale.plates.resize(mechanism.bodies.size());
  for (std::size_t b = 1; b < mechanism.bodies.size(); ++b) {
    if (!mechanism.bodies[b].shapes.empty()) continue;
    scale.plates[b] = PlateThrough(TouchPoints(mechanism, static_cast<int>(b)), 0.8 * scale.leg_m);
  }
  scale.barrel_m.assign(mechanism.drives.size(), 0.0);
  for (std::size_t d = 0; d < mechanism.drives.size(); ++d) {
    const bool linear = ForceUnit(mechanism, mechanism.drives[d]) == "N";
    double& longest = linear ? scale.longest_force_N : scale.longest_torque_Nm;
    double shortest = std::numeric_limits<double>::infinity();
    for (const PictureFrame& frame : frames) {
      if (d < frame.drive_forces.size() && std::isfinite(frame.drive_forces[d])) {
        longest = std::max(longest, std::abs(frame.drive_forces[d]));
      }
      if (const auto* leg = std::get_if<DistanceDrive>(&mechanism.drives[d].kind)) {
        shortest = std::min(shortest, (frame.X_WB[leg->body_from] * leg->p_from -
                                       frame.X_WB[leg->body_to] * leg->p_to)
                                          .norm());
      }
    }
    const double lower = mechanism.drives[d].range.lower;
    if (std::isfinite(lower) && lower > 0.0) shortest = std::min(shortest, lower);
    if (std::isfinite(shortest)) scale.barrel_m[d] = 0.62 * shortest;
  }
  // Rounding is not a force: against the weight of a kilogram where there is no other.
  double mass = 0.0;
  for (const Body& body : mechanism.bodies) mass += body.mass;
  const double floor_N = 1e-9 * 9.81 * (mass > 0.0 ? mass : 1.0);
  if (scale.longest_force_N < floor_N) scale.longest_force_N = 0.0;
  if (scale.longest_torque_Nm < floor_N * scale.extent_m) scale.longest_torque_Nm = 0.0;
  return scale;
}

std::vector<Item> MechanismItems(const Mechanism& mechanism, const PictureFrame& frame,
                                 const Scale& scale, const PictureOptions& options) {
  std::vector<Item> items;
  const bool any_shapes =
      std::ranges::any_of(mechanism.bodies, [](const Body& body) { return !body.shapes.empty(); });
  for (std::size_t b = 0; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const bool massless_piece = b > 0 && body.mass <= 0.0 && any_shapes;
    for (const Shape& shape : body.shapes) {
      if (b == 0 && shape.color == "sea") continue;  // drawn as an endless plane
      AddShape(shape, frame.X_WB[b], &items);
      if (b == 0 && !items.empty() && items.back().framing == Framing::kAlways) {
        const bool window = shape.color == "glass" || shape.color == "glass_frame";
        items.back().framing = window ? Framing::kNever : Framing::kIfNear;
      }
    }
    if (body.shapes.empty() && !massless_piece && !(b == 0 && any_shapes)) {
      AddDefaultShape(mechanism, static_cast<int>(b), frame.X_WB[b], scale, &items);
    }
  }
  for (std::size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (const auto* leg = std::get_if<DistanceDrive>(&mechanism.drives[d].kind)) {
      AddLeg(mechanism.drives[d], *leg, scale.barrel_m[d], frame, scale, &items);
    }
  }
  for (const SpringDamper& spring : mechanism.springs) AddSpring(spring, frame, scale, &items);
  if (options.joints) {
    for (std::size_t j = 0; j < mechanism.joints.size(); ++j) {
      const bool moves_base = std::ranges::any_of(mechanism.prescribed, [j](const Prescribed& p) {
        return p.joint == static_cast<int>(j);
      });
      if (!moves_base) AddJoint(mechanism, mechanism.joints[j], frame, scale, &items);
    }
  }
  if (options.output_frames) {
    for (const Output& output : mechanism.outputs) {
      AddTriad(frame.X_WB[output.body] * output.X_BO, 0.10 * scale.extent_m, &items);
    }
  }
  return items;
}

Mat3 UprightRotation(const Vec3& gravity_W) {
  if (gravity_W.norm() == 0.0) return Mat3::Identity();
  const Vec3 up = -gravity_W.normalized();
  // x of D: the world's x made level, or its z where x is vertical.
  const Vec3 reference = std::abs(up.x()) < 0.99 ? Vec3::UnitX() : Vec3::UnitZ();
  const Vec3 x = (reference - reference.dot(up) * up).normalized();
  Mat3 R_DW;
  R_DW << x.transpose(), up.cross(x).transpose(), up.transpose();
  return R_DW;
}

std::optional<double> SeaLevel(const Mechanism& mechanism, const Mat3& R_DW) {
  for (const Shape& shape : mechanism.bodies[0].shapes) {
    if (shape.color != "sea") continue;
    std::vector<Item> items;
    AddShape(shape, Pose::Identity(), &items);
    double top = -std::numeric_limits<double>::infinity();
    for (const Vec3& p_W : Corners(items[0])) top = std::max(top, (R_DW * p_W).z());
    return top;
  }
  return std::nullopt;
}

namespace {

constexpr double kSagitta_px = 0.15;  // by which a side may miss its arc
constexpr double kEdge_rad = 0.6;     // sharper edges of meshes stay edges

// A circle about z with the normals on it, their part across and along z.
struct Circle {
  double radius, height, across, along;
};

void AddBand(const Circle& low, const Circle& high, int sides, int face, Facets* out) {
  const int first = static_cast<int>(out->points_G.size());
  for (int i = 0; i < sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sides, c = std::cos(angle),
                 s = std::sin(angle);
    for (const Circle& ring : {low, high}) {
      out->points_G.emplace_back(ring.radius * c, ring.radius * s, ring.height);
      out->normals_G.emplace_back(ring.across * c, ring.across * s, ring.along);
      out->faces.push_back(face);
    }
    const int a = first + 2 * i, b = first + 2 * ((i + 1) % sides);
    if (low.radius > 0.0) out->triangles.push_back({a, b, a + 1});
    if (high.radius > 0.0) out->triangles.push_back({a + 1, b, b + 1});
  }
}

// A part of a ball about (0, 0, centre), between two latitudes.
void AddCap(double centre, double radius, double from, double to, int sides, Facets* out) {
  const int bands =
      std::max(2, static_cast<int>(std::lround(sides * (to - from) / (2.0 * std::numbers::pi))));
  const auto ring = [&](int i) {
    const double latitude = from + (to - from) * i / bands;
    const bool pole = std::abs(std::abs(latitude) - 0.5 * std::numbers::pi) < 1e-9;
    const double c = pole ? 0.0 : std::cos(latitude), s = std::sin(latitude);
    return Circle{.radius = radius * c, .height = centre + radius * s, .across = c, .along = s};
  };
  for (int i = 0; i < bands; ++i) AddBand(ring(i), ring(i + 1), sides, 0, out);
}

void AddSide(double radius, double from, double to, int sides, Facets* out) {
  AddBand({radius, from, 1.0, 0.0}, {radius, to, 1.0, 0.0}, sides, 0, out);
}

// A flat ring or disc that looks up (+1) or down (-1).
void AddDisc(double inner, double outer, double height, double up, int sides, int face,
             Facets* out) {
  const Circle a{inner, height, 0.0, up}, b{outer, height, 0.0, up};
  AddBand(up > 0.0 ? b : a, up > 0.0 ? a : b, sides, face, out);
}

// The head is as AddArrowGhost() draws its outline.
void AddArrow(double radius, double length, int sides, Facets* out) {
  const double neck = length - std::min(6.0 * radius, 0.5 * length);
  const double slope = std::hypot(2.0 * radius, length - neck);
  const double across = (length - neck) / slope, along = 2.0 * radius / slope;
  AddDisc(0.0, radius, 0.0, -1.0, sides, 1, out);
  AddSide(radius, 0.0, neck, sides, out);
  AddDisc(radius, 2.0 * radius, neck, -1.0, sides, 2, out);
  AddBand({2.0 * radius, neck, across, along}, {0.0, length, across, along}, sides, 3, out);
}

void AddBox(const Vec3& half, Facets* out) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      const int first = static_cast<int>(out->points_G.size());
      for (const auto& [a, b] : {std::pair(-1.0, -1.0), {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
        Vec3 p;
        p[axis] = side * half[axis];
        p[u] = side * a * half[u];
        p[v] = b * half[v];
        out->points_G.push_back(p);
        out->normals_G.emplace_back(side * Vec3::Unit(axis));
        out->faces.push_back(2 * axis + (side > 0.0 ? 1 : 0));
      }
      out->triangles.push_back({first, first + 1, first + 2});
      out->triangles.push_back({first, first + 2, first + 3});
    }
  }
}

}  // namespace

Facets FacetsOf(const Item& item, int sides) {
  Facets out;
  const double r = item.size.x(), half = item.size.z();
  switch (item.solid) {
    case Solid::kBall:
      AddCap(0.0, r, -0.5 * std::numbers::pi, 0.5 * std::numbers::pi, sides, &out);
      break;
    case Solid::kCapsule:
      AddCap(-half, r, -0.5 * std::numbers::pi, 0.0, sides, &out);
      AddSide(r, -half, half, sides, &out);
      AddCap(half, r, 0.0, 0.5 * std::numbers::pi, sides, &out);
      break;
    case Solid::kCylinder:
      AddDisc(0.0, r, -half, -1.0, sides, 1, &out);
      AddSide(r, -half, half, sides, &out);
      AddDisc(0.0, r, half, 1.0, sides, 2, &out);
      break;
    case Solid::kBox:
      AddBox(item.size, &out);
      break;
    case Solid::kArrow:
      AddArrow(r, half, sides, &out);
      break;
    case Solid::kMesh:
      break;
  }
  return out;
}

Facets FacetsOf(const TriangleMesh& mesh, std::size_t most) {
  const TriangleMesh drawn = WithSharpEdges(Decimated(mesh, most), kEdge_rad);
  Facets out{.points_G = drawn.vertices,
             .normals_G = std::vector<Vec3>(drawn.vertices.size(), Vec3::Zero()),
             .faces = std::vector<int>(drawn.vertices.size(), 0)};
  for (const auto& [i, j, k] : drawn.triangles) {
    const Vec3 &a = drawn.vertices[i], &b = drawn.vertices[j], &c = drawn.vertices[k];
    const Vec3 normal = (b - a).cross(c - a);  // as long as twice the area
    for (const auto corner : {i, j, k}) out.normals_G[corner] += normal;
    out.triangles.push_back({static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)});
  }
  for (Vec3& normal : out.normals_G) {
    normal = normal.norm() > 0.0 ? Vec3(normal.normalized()) : Vec3::UnitZ();
  }
  return out;
}

int SidesFor(double radius_px) {
  if (!(radius_px > kSagitta_px)) return 8;
  const double sides = std::numbers::pi / std::acos(1.0 - kSagitta_px / radius_px);
  return std::clamp(static_cast<int>(std::ceil(sides)), 8, 160);
}

}  // namespace mbv::render
