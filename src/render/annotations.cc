#include "render/annotations.h"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "plot/text_mask.h"
#include "render/scene.h"

namespace mbv::render {

double TextUnit(const std::array<int, 2>& size_px) {
  return std::min(size_px[0] * 0.75, static_cast<double>(size_px[1]));
}

// Lays a colour over a pixel; over a transparent one it makes it opaque as far as it covers it.
void Blend(Picture* picture, int x, int y, const Ink& color, float share) {
  if (x < 0 || y < 0 || x >= picture->width || y >= picture->height) return;
  const auto at = static_cast<std::size_t>(y) * picture->width + x;
  const float below =
      (1.0F - share) * (picture->alpha.empty() ? 1.0F : picture->alpha[at] / 255.0F);
  const float all = share + below;
  if (all <= 0.0F) return;
  std::uint8_t* pixel = picture->rgb.data() + 3 * at;
  for (int i = 0; i < 3; ++i) {
    const float value = (share * color[i] * 255.0F + below * pixel[i]) / all;
    pixel[i] = static_cast<std::uint8_t>(std::lround(value));
  }
  if (!picture->alpha.empty()) {
    picture->alpha[at] = static_cast<std::uint8_t>(std::lround(255.0F * all));
  }
}

void Fill(Picture* picture, int left, int top, int width, int height, const Ink& color,
          float share) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) Blend(picture, x, y, color, share);
  }
}

// A line of a pixel's width or two.
void Stroke(Picture* picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            const Ink& color) {
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).cwiseAbs().maxCoeff())));
  const int thick = std::max(1, picture->height / 960);
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = from + (to - from) * i / steps;
    Fill(picture, static_cast<int>(p.x()), static_cast<int>(p.y()), thick, thick, color);
  }
}

void Write(const std::string& text, double left, double top, double height_px, const Ink& color,
           Picture* picture) {
  const double whole = std::floor(left);
  const TextMask mask = DrawText(text, height_px, left - whole);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const std::uint8_t share = mask.coverage[static_cast<std::size_t>(y) * mask.width + x];
      if (share == 0) continue;
      Blend(picture, static_cast<int>(whole) + x, static_cast<int>(std::lround(top)) + y, color,
            static_cast<float>(share) / 255.0F);
    }
  }
}

namespace {

using TextBox = Eigen::AlignedBox2d;

// Where a text's box may begin, about its place: beside it, then on wider and wider rings.
std::vector<Eigen::Vector2d> TextCorners(const Eigen::Vector2d& at, double width, double height,
                                         double h) {
  std::vector<Eigen::Vector2d> corners = {at + Eigen::Vector2d(0.6 * h, -0.5 * height),
                                          at + Eigen::Vector2d(-0.6 * h - width, -0.5 * height),
                                          at + Eigen::Vector2d(-0.5 * width, -height - 0.6 * h),
                                          at + Eigen::Vector2d(-0.5 * width, 0.6 * h)};
  constexpr int kRings = 8, kTurns = 16;
  for (int ring = 1; ring <= kRings; ++ring) {
    for (int turn = 0; turn < kTurns; ++turn) {
      const double angle = 2.0 * std::numbers::pi * (turn + 0.5 * (ring % 2)) / kTurns;
      const Eigen::Vector2d e(std::cos(angle), std::sin(angle));
      const Eigen::Vector2d middle =
          at + e * (1.6 * h * ring) + Eigen::Vector2d(0.5 * width * e.x(), 0.5 * height * e.y());
      corners.emplace_back(middle - Eigen::Vector2d(0.5 * width, 0.5 * height));
    }
  }
  return corners;
}

// The first of the boxes that lies inside and over no other; empty if there is none.
TextBox FreeBox(const std::vector<Eigen::Vector2d>& corners, const Eigen::Vector2d& size,
                const TextBox& inside, const std::vector<TextBox>& taken) {
  for (const Eigen::Vector2d& corner : corners) {
    const TextBox box(corner, corner + size);
    const bool over =
        std::ranges::any_of(taken, [&](const TextBox& other) { return other.intersects(box); });
    if (inside.contains(box) && !over) return box;
  }
  return {};
}

std::string LengthText(double length_m) {
  if (length_m < 1e-3) return fmt::format("{:g} µm", length_m * 1e6);
  if (length_m < 1.0) return fmt::format("{:g} mm", length_m * 1e3);
  if (length_m < 1e3) return fmt::format("{:g} m", length_m);
  return fmt::format("{:g} km", length_m * 1e-3);
}

}  // namespace

int PaintLabels(const std::vector<Label>& labels, int floor_px, Picture* picture) {
  const double h = kSmallText * TextUnit({picture->width, picture->height});
  const TextBox inside(Eigen::Vector2d::Zero(), Eigen::Vector2d(picture->width, floor_px));
  std::vector<TextBox> taken;
  std::vector<Eigen::Vector2d> places;
  for (const Label& label : labels) {
    places.emplace_back(label.x * picture->width, label.y * picture->height);
    // No name lies over another one's place.
    const Eigen::Vector2d dot = Eigen::Vector2d::Constant(2.0);
    if (inside.contains(places.back()))
      taken.emplace_back(places.back() - dot, places.back() + dot);
  }
  int left_out = 0;
  for (std::size_t k = 0; k < labels.size(); ++k) {
    const Eigen::Vector2d& at = places[k];
    if (!inside.contains(at)) continue;
    const Eigen::Vector2d size(TextWidth(labels[k].text, h) + 0.6 * h, 1.15 * h);
    const TextBox box = FreeBox(TextCorners(at, size.x(), size.y(), h), size, inside, taken);
    if (box.isEmpty()) {
      ++left_out;
      continue;
    }
    taken.push_back(box);
    const Eigen::Vector2d near = at.cwiseMax(box.min()).cwiseMin(box.max());
    if ((near - at).norm() > h) Stroke(picture, at, near, kInk);
    Fill(picture, static_cast<int>(box.min().x()), static_cast<int>(box.min().y()),
         static_cast<int>(size.x()), static_cast<int>(size.y()), kPaper, 0.72F);
    const int dot = std::max(1, picture->height / 480);
    Fill(picture, static_cast<int>(at.x()) - dot / 2, static_cast<int>(at.y()) - dot / 2, dot + 1,
         dot + 1, kInk);
    Write(labels[k].text, box.min().x() + 0.3 * h, box.min().y() + 0.05 * h, h, kInk, picture);
  }
  return left_out;
}

double RoundLength(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return (digit >= 5.0 ? 5.0 : digit >= 2.0 ? 2.0 : 1.0) * power;
}

void PaintScaleBar(double height_m, bool parallel, int floor_px, Picture* picture) {
  const double unit = TextUnit({picture->width, picture->height}), h = kSmallText * unit;
  const double px_per_m = picture->height / height_m;
  const double length_m = RoundLength(0.25 * picture->width / px_per_m);
  const int width = static_cast<int>(std::lround(length_m * px_per_m));
  const std::string text = LengthText(length_m) + (parallel ? "" : " at the point looked at");
  const double text_width = TextWidth(text, h), pad = 0.018 * unit;
  const int thick = std::max(2, static_cast<int>(std::lround(0.005 * unit)));
  const double room = std::max<double>(width, text_width);
  const double middle = picture->width - pad - 0.5 * room, top = floor_px - pad - thick - 1.2 * h;
  Fill(picture, static_cast<int>(middle - 0.5 * room - 0.4 * h), static_cast<int>(top - 0.2 * h),
       static_cast<int>(room + 0.8 * h), static_cast<int>(1.6 * h) + thick, kPaper, 0.72F);
  Write(text, middle - 0.5 * text_width, top, h, kInk, picture);
  Fill(picture, static_cast<int>(std::lround(middle - 0.5 * width)),
       static_cast<int>(top + 1.2 * h), width, thick, kInk);
}

namespace {

constexpr Ink kRule{0.55F, 0.58F, 0.62F};

Ink MoodColor(Caption::Mood mood) {
  switch (mood) {
    case Caption::Mood::kNeutral:
      return kSoftInk;
    case Caption::Mood::kGood:
      return {0.07F, 0.50F, 0.20F};
    case Caption::Mood::kBad:
      return {0.78F, 0.09F, 0.08F};
  }
  return kInk;
}

// Heights of the rows as fractions of the picture's smaller side.
struct Layout {
  double pad, title, detail, legend;

  Layout(const Caption& caption, const std::array<int, 2>& size_px) {
    const double unit = TextUnit(size_px);
    pad = 0.009 * unit;
    title = 0.033 * unit;
    detail = caption.detail.empty() ? -pad : 0.0245 * unit;  // without its gap, too
    legend = kSmallText * unit;
  }
  [[nodiscard]] double bar() const { return 5.3 * pad + title + detail + 2.0 * legend; }
};

void WriteLegend(const std::vector<LegendEntry>& legend, double top, const Layout& layout,
                 Picture* picture) {
  const double h = layout.legend;
  std::array<double, 2> lefts = {2.0 * layout.pad, 2.0 * layout.pad};
  const bool any_above =
      std::ranges::any_of(legend, [](const LegendEntry& entry) { return entry.row == 0; });
  for (const LegendEntry& entry : legend) {
    const int row = any_above ? entry.row : 0;
    double& left = lefts[static_cast<size_t>(row)];
    const double y = top + row * (h + 0.7 * layout.pad);
    const double mark = entry.color.empty() ? 0.0 : 1.5 * h;
    const double width = TextWidth(entry.text, h);
    if (left + mark + width > picture->width - 2.0 * layout.pad) continue;
    if (!entry.color.empty()) {
      const auto rgba = MaterialOf(entry.color).rgba;
      Fill(picture, static_cast<int>(left), static_cast<int>(y + 0.22 * h),
           static_cast<int>(1.1 * h), static_cast<int>(0.56 * h), {rgba[0], rgba[1], rgba[2]});
    }
    Write(entry.text, left + mark, y, h, kSoftInk, picture);
    left += mark + width + 1.6 * h;
  }
}

}  // namespace

bool IsEmpty(const Caption& caption) {
  return caption.title.empty() && caption.detail.empty() && caption.status.empty();
}

int BarHeight(const Caption& caption, const std::array<int, 2>& size_px) {
  return IsEmpty(caption) ? 0 : static_cast<int>(std::ceil(Layout(caption, size_px).bar()));
}

void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend,
                  Picture* picture) {
  const std::array<int, 2> size{picture->width, picture->height};
  const int bar = BarHeight(caption, size);
  if (bar == 0) return;
  const Layout layout(caption, size);
  const int top = picture->height - bar;
  Fill(picture, 0, top, picture->width, bar, kPaper);
  Fill(picture, 0, top, picture->width, std::max(1, picture->height / 500), kRule);
  const double left = 2.0 * layout.pad, room = picture->width - 2.0 * left;
  // The verdict first: the title gets the room that is left.
  const std::string status = FittedText(caption.status, layout.title, 0.5 * room);
  const double status_width = TextWidth(status, layout.title);
  double y = top + 1.5 * layout.pad;
  Write(status, left + room - status_width, y, layout.title, MoodColor(caption.mood), picture);
  const double title_room = room - status_width - (status.empty() ? 0.0 : layout.title);
  Write(FittedText(caption.title, layout.title, title_room), left, y, layout.title, kInk, picture);
  y += layout.title + layout.pad;
  if (!caption.detail.empty()) {
    Write(FittedText(caption.detail, layout.detail, room), left, y, layout.detail, kInk, picture);
  }
  y += layout.detail + layout.pad;
  WriteLegend(legend, y, layout, picture);
}

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFullArc = 300.0 / 180.0 * kPi;  // sweep of the largest torque [rad]
constexpr double kSmallestShare = 0.02;           // forces below this share get no arrow
constexpr double kSmallestArc = 0.05;             // torques no arc: it would be a lone head
constexpr float kGhost = 0.5F;                    // opacity of what bodies hide

std::array<float, 4> WithAlpha(const Material& material, float alpha) {
  return {material.rgba[0], material.rgba[1], material.rgba[2], alpha};
}

// A flat ring in the plane normal to `normal`; its hidden part shows through.
void AddRing(const Vec3& centre, const Vec3& normal, double inner, double outer,
             const Material& material, std::vector<FlatMesh>* flats) {
  constexpr int kPieces = 64;
  const Mat3 R = FrameAlong(normal);
  FlatMesh ring{.vertices_W = {}, .triangles = {}, .rgba = WithAlpha(material, 0.95F)};
  for (int i = 0; i < kPieces; ++i) {
    const double angle = 2.0 * kPi * i / kPieces;
    const Vec3 e = R * Vec3(std::cos(angle), std::sin(angle), 0.0);
    ring.vertices_W.emplace_back(centre + inner * e);
    ring.vertices_W.emplace_back(centre + outer * e);
    const int a = 2 * i, b = 2 * ((i + 1) % kPieces);
    ring.triangles.push_back({a, a + 1, b});
    ring.triangles.push_back({b, a + 1, b + 1});
  }
  flats->push_back(ring);
  ring.rgba[3] = kGhost;
  ring.depth = FlatMesh::Depth::kHidden;
  flats->push_back(std::move(ring));
}

// The outline of an arrow, turned to the camera, to be seen through what hides the arrow. It lies
// a head's width before the arrow, so that the arrow does not hide its own ghost.
void AddArrowGhost(const Vec3& p, const Vec3& q, double radius, const Material& material,
                   const Vec3& forward_W, std::vector<FlatMesh>* flats) {
  const Vec3 e = (q - p).normalized();
  const Vec3 across = e.cross(forward_W);
  if (across.norm() < 0.05) return;  // seen from its end
  const Vec3 s = across.normalized(), shift = -2.2 * radius * forward_W;
  const double head = std::min(6.0 * radius, 0.5 * (q - p).norm());
  const Vec3 neck = q - head * e + shift;
  FlatMesh ghost{.vertices_W = {p + shift - radius * s, p + shift + radius * s, neck - radius * s,
                                neck + radius * s, neck - 2.0 * radius * s, neck + 2.0 * radius * s,
                                q + shift},
                 .triangles = {{0, 1, 2}, {1, 3, 2}, {4, 5, 6}},
                 .rgba = WithAlpha(material, kGhost),
                 .depth = FlatMesh::Depth::kHidden};
  flats->push_back(std::move(ghost));
}

// A torque as an arc around its axis; the sweep follows the torque. The middle of the arc looks at
// the camera; what bodies hide of it shows through.
struct TorqueArc {
  Vec3 centre;
  Mat3 R;  // columns: middle of the arc, across it, axis
  double radius, thickness, sweep;

  [[nodiscard]] Vec3 Radial(double angle) const {
    return R * Vec3(std::cos(angle), std::sin(angle), 0.0);
  }
  [[nodiscard]] Vec3 Point(double angle) const { return centre + radius * Radial(angle); }
};

void AddTorqueArc(const TorqueArc& arc, const Material& material, const Vec3& forward_W,
                  Annotations* out) {
  const double head = std::copysign(std::min(0.6, 0.6 * std::abs(arc.sweep)), arc.sweep);
  const double start = -0.5 * arc.sweep, neck_angle = 0.5 * arc.sweep - head;
  const Vec3 neck = arc.Point(neck_angle);
  const Vec3 along = arc.R.col(2).cross(arc.Radial(neck_angle));
  const Vec3 tip = neck + arc.radius * head * along;
  const Vec3 shift = -2.2 * arc.thickness * forward_W;
  FlatMesh ghost{.rgba = WithAlpha(material, kGhost), .depth = FlatMesh::Depth::kHidden};
  const int pieces = std::max(1, static_cast<int>(std::ceil(std::abs(neck_angle - start) / 0.1)));
  for (int i = 0; i <= pieces; ++i) {
    const double angle = start + (neck_angle - start) * i / pieces;
    const double next = start + (neck_angle - start) * (i + 1) / pieces;
    for (const double side : {-1.0, 1.0}) {
      ghost.vertices_W.emplace_back(arc.Point(angle) + side * arc.thickness * arc.Radial(angle) +
                                    shift);
    }
    if (i == pieces) break;
    const int k = 2 * i;
    ghost.triangles.push_back({k, k + 1, k + 2});
    ghost.triangles.push_back({k + 2, k + 1, k + 3});
    out->items.push_back(
        Between(Solid::kCapsule, arc.Point(angle), arc.Point(next), arc.thickness, material));
  }
  // The head: a straight cone of balls that taper to the tip.
  constexpr int kBalls = 24;
  const double width = 2.6 * arc.thickness;
  for (int i = 0; i < kBalls; ++i) {
    const double share = static_cast<double>(i) / kBalls;
    out->items.push_back(BallAt(neck + share * (tip - neck), width * (1.0 - share), material));
  }
  const int k = static_cast<int>(ghost.vertices_W.size());
  for (const double side : {-1.0, 1.0}) {
    ghost.vertices_W.emplace_back(neck + side * width * arc.Radial(neck_angle) + shift);
  }
  ghost.vertices_W.emplace_back(tip + shift);
  ghost.triangles.push_back({k, k + 1, k + 2});
  out->flats.push_back(std::move(ghost));
}

// The arc's axes: its middle towards the viewer, as far as the axis allows.
Mat3 ArcAxes(const Vec3& axis, const Vec3& forward_W) {
  Vec3 middle = -forward_W + forward_W.dot(axis) * axis;
  middle = middle.norm() > 0.2 ? Vec3(middle.normalized()) : axis.unitOrthogonal();
  Mat3 R;
  R << middle, axis.cross(middle), axis;
  return R;
}

class ForceMarks {
 public:
  ForceMarks(const Mechanism& mechanism, const PictureFrame& frame, const Scale& scale,
             const Vec3& forward_W, Annotations* out)
      : mechanism_(mechanism), frame_(frame), scale_(scale), forward_W_(forward_W), out_(out) {}

  void Add(const Drive& drive, double force) const {
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      // The force on the far body: thrust points on along the leg, tension back towards it.
      const Vec3 p = frame_.X_WB[leg->body_from] * leg->p_from;
      const Vec3 q = frame_.X_WB[leg->body_to] * leg->p_to;
      if ((q - p).norm() > 0.0) AddArrow(q, (q - p).normalized(), force);
      return;
    }
    const JointDrive& at = std::get<JointDrive>(drive.kind);
    const Joint& joint = mechanism_.joints[at.joint];
    const Pose X_WF = frame_.X_WB[joint.parent] * joint.X_PF;
    const Vec3 p_M = (frame_.X_WB[joint.child] * joint.X_CM).translation();
    const Vec3 axis = X_WF.linear() * joint.axis;
    if (ForceUnit(mechanism_, drive) == "N") {
      AddArrow(p_M, axis, force);
      return;
    }
    if (scale_.longest_torque_Nm <= 0.0) return;
    const double share = force / scale_.longest_torque_Nm;
    if (std::abs(share) < kSmallestArc) return;
    AddTorqueArc({.centre = X_WF.translation(),
                  .R = ArcAxes(axis, forward_W_),
                  .radius = 0.3 * scale_.arrow_m,
                  .thickness = 0.022 * scale_.arrow_m,
                  .sweep = share * kFullArc},
                 Color(force), forward_W_, out_);
  }

 private:
  static Material Color(double force) { return MaterialOf(force >= 0.0 ? "push" : "pull"); }

  // Both signs on the far side of the point at which the force acts: a push points away from it,
  // a pull towards it.
  void AddArrow(const Vec3& point, const Vec3& direction, double force) const {
    if (scale_.longest_force_N <= 0.0) return;
    const double share = std::abs(force) / scale_.longest_force_N;
    if (share < kSmallestShare) return;
    Vec3 p = point, q = point + share * scale_.arrow_m * direction;
    if (force < 0.0) std::swap(p, q);
    const double radius = 0.038 * scale_.arrow_m;
    out_->items.push_back(Between(Solid::kArrow, p, q, radius, Color(force)));
    AddArrowGhost(p, q, radius, Color(force), forward_W_, &out_->flats);
  }

  const Mechanism& mechanism_;
  const PictureFrame& frame_;
  const Scale& scale_;
  const Vec3 forward_W_;
  Annotations* out_;
};

// A ring around closures that share a place, radius by the largest of them.
struct Ring {
  Vec3 centre;
  double radius;
};

void AddClosure(const Mechanism& mechanism, const Joint& joint, const PictureFrame& frame,
                const Scale& scale, std::vector<Ring>* rings, std::vector<Item>* items) {
  const double r = JointRadius(mechanism, joint, scale);
  const Vec3 p_F = (frame.X_WB[joint.parent] * joint.X_PF).translation();
  const Vec3 p_M = (frame.X_WB[joint.child] * joint.X_CM).translation();
  const auto same = std::ranges::find_if(
      *rings, [&](const Ring& ring) { return (ring.centre - p_M).norm() < 0.5 * r; });
  if (same == rings->end()) {
    rings->push_back({.centre = p_M, .radius = r});
  } else {
    same->radius = std::max(same->radius, r);
  }
  if (!MaySlide(joint.kind) && (p_F - p_M).norm() > 0.5 * r) {
    items->push_back(Between(Solid::kCapsule, p_F, p_M, 0.3 * r, MaterialOf("gap")));
  }
}

// Distance of a point from the stretch p … q.
double DistanceFromStretch(const Vec3& point, const Vec3& p, const Vec3& q) {
  const Vec3 d = q - p;
  const double s = d.squaredNorm() > 0.0 ? (point - p).dot(d) / d.squaredNorm() : 0.0;
  return (p + std::clamp(s, 0.0, 1.0) * d - point).norm();
}

// Leaves out points that lie within `tolerance` of the line through their neighbours that stay
// (Douglas and Peucker's rule).
std::vector<Vec3> Thinned(const std::vector<Vec3>& points, double tolerance) {
  if (points.size() < 3) return points;
  std::vector<bool> stays(points.size(), false);
  stays.front() = stays.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> stretches = {{0, points.size() - 1}};
  while (!stretches.empty()) {
    const auto [first, last] = stretches.back();
    stretches.pop_back();
    double farthest = tolerance;
    std::size_t at = first;
    for (std::size_t i = first + 1; i < last; ++i) {
      const double distance = DistanceFromStretch(points[i], points[first], points[last]);
      if (distance > farthest) {
        farthest = distance;
        at = i;
      }
    }
    if (at == first) continue;
    stays[at] = true;
    stretches.emplace_back(first, at);
    stretches.emplace_back(at, last);
  }
  std::vector<Vec3> thinned;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (stays[i]) thinned.push_back(points[i]);
  }
  return thinned;
}

// A path as a ribbon that faces the camera, to be seen through what hides the path. As with arrows
// it lies before the path, so that the path does not hide its own ghost.
void AddPathGhost(const std::vector<Vec3>& points, double radius, const Material& material,
                  const Vec3& forward_W, std::vector<FlatMesh>* flats) {
  FlatMesh ghost{.rgba = WithAlpha(material, kGhost), .depth = FlatMesh::Depth::kHidden};
  const Vec3 shift = -2.2 * radius * forward_W;
  Vec3 side = forward_W.unitOrthogonal();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 along = points[std::min(i + 1, points.size() - 1)] - points[i == 0 ? 0 : i - 1];
    const Vec3 across = along.cross(forward_W);
    if (across.norm() > 0.05 * along.norm()) side = across.normalized();
    ghost.vertices_W.emplace_back(points[i] + shift - radius * side);
    ghost.vertices_W.emplace_back(points[i] + shift + radius * side);
    if (i == 0) continue;
    const int k = 2 * static_cast<int>(i);
    ghost.triangles.push_back({k - 2, k - 1, k});
    ghost.triangles.push_back({k, k - 1, k + 1});
  }
  flats->push_back(std::move(ghost));
}

void AddPath(const PolylineOverlay& path, double radius, const Vec3& forward_W, Annotations* out) {
  Material material = MaterialOf(path.color);
  material.emission = 0.05F;
  const std::vector<Vec3> points = Thinned(path.points_W, 0.1 * radius);
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    out->items.push_back(Between(Solid::kCapsule, points[i], points[i + 1], radius, material));
  }
  AddPathGhost(points, radius, material, forward_W, &out->flats);
}

}  // namespace

Annotations Annotate(const Mechanism& mechanism, const PictureFrame& frame, const Scale& scale,
                     const PictureOptions& options, const Vec3& forward_W) {
  Annotations out;
  if (options.drive_forces) {
    const ForceMarks marks(mechanism, frame, scale, forward_W, &out);
    for (std::size_t d = 0; d < frame.drive_forces.size(); ++d) {
      if (std::isfinite(frame.drive_forces[d])) {
        marks.Add(mechanism.drives[d], frame.drive_forces[d]);
      }
    }
  }
  if (options.closures) {
    std::vector<Ring> rings;
    for (const Joint& joint : mechanism.joints) {
      if (joint.closure) AddClosure(mechanism, joint, frame, scale, &rings, &out.items);
    }
    for (const Ring& ring : rings) {
      AddRing(ring.centre, forward_W, 1.75 * ring.radius, 2.1 * ring.radius, MaterialOf("closure"),
              &out.flats);
    }
  }
  for (Item& item : out.items) item.casts_shadow = false;
  return out;
}

FlatMesh GlassMesh(const Item& item) {
  constexpr int kSides = 48;
  FlatMesh mesh{.rgba = item.material.rgba, .shaded = true};
  if (item.solid == Solid::kMesh) {
    mesh.vertices_W = item.mesh->vertices;
    mesh.triangles = item.mesh->triangles;
  } else {
    Facets facets = FacetsOf(item, kSides);
    mesh.vertices_W = std::move(facets.points_G);
    mesh.triangles = std::move(facets.triangles);
  }
  for (Vec3& p : mesh.vertices_W) p = item.X_WG * p;
  return mesh;
}

Annotations OverlayAnnotations(const Overlay& overlay, const Scale& scale, const Vec3& forward_W) {
  Annotations out;
  for (const PolylineOverlay& path : overlay.paths) {
    AddPath(path, path.radius_m > 0.0 ? path.radius_m : 0.0025 * scale.extent_m, forward_W, &out);
  }
  for (const MeshOverlay& mesh : overlay.meshes) {
    FlatMesh flat{.vertices_W = mesh.vertices_W,
                  .triangles = mesh.triangles,
                  .rgba = MaterialOf(mesh.color).rgba,
                  .shaded = true};
    out.flats.push_back(flat);
    flat.rgba[3] *= kGhost;
    flat.depth = FlatMesh::Depth::kHidden;
    out.flats.push_back(std::move(flat));
  }
  for (Item& item : out.items) item.casts_shadow = false;
  return out;
}

}  // namespace mbv::render
