// The sections of the MJCF beside its tree of bodies, each written whole. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>
#include <span>
#include <string>

#include "base/types.h"
#include "mechanism/mechanism.h"
#include "model_file/mesh/decimate.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"

// A thin layer over tinyxml2's printer: numbers that read back exactly.

namespace mbv::mjcf {

/// The shortest text that reads back as the same double; never "-0".
[[nodiscard]] std::string NumberText(double x);
[[nodiscard]] std::string NumbersText(std::span<const double> numbers);

class XmlWriter {
 public:
  XmlWriter() : printer_(nullptr, false) {}

  void Open(const char* element) { printer_.OpenElement(element); }
  void Close() { printer_.CloseElement(); }
  void Comment(const std::string& text) { printer_.PushComment(text.c_str()); }

  void Set(const char* name, const std::string& text) {
    printer_.PushAttribute(name, text.c_str());
  }
  void Set(const char* name, const char* text) { printer_.PushAttribute(name, text); }
  void Set(const char* name, double x) { Set(name, NumberText(x)); }
  void Set(const char* name, std::span<const double> xs) { Set(name, NumbersText(xs)); }
  /// A length or direction; components below 2e-16 are rounding and written as 0.
  void Set(const char* name, const Vec3& v);
  /// pos and quat, each left out where it is the identity.
  void SetPose(const Pose& X);

  [[nodiscard]] std::string Text() const { return printer_.CStr(); }

 private:
  tinyxml2::XMLPrinter printer_;
};

/// w, x, y, z of a rotation, w >= 0.
[[nodiscard]] Eigen::Vector4d QuatOf(const Mat3& R);

// Pictures in the MJCF: geoms, materials, lights and ground. Nothing here acts on the motion.

/// Triangles of all meshes in a file together: others decimate them as they like.
inline constexpr size_t kMostTriangles = 20000;

/// <asset> with the materials that the shapes name, and the meshes as numbers, so that the file
/// needs no other.
void WriteAssets(const Mechanism& mechanism, const DrawnSurfaces& surfaces, XmlWriter* xml);
/// Lights and ground, inside <worldbody>; up is against gravity.
void WriteSurroundings(const Mechanism& mechanism, XmlWriter* xml);
/// The shapes of a body, inside its <body>.
void WriteShapes(const Body& body, const DrawnSurfaces& surfaces, XmlWriter* xml);

/// What sections are written from, and where to.
struct Sections {
  const Mechanism& mechanism;
  const MjcfOptions& options;
  const Plan& plan;
  const DrawnSurfaces& surfaces;  ///< of the meshes
  XmlWriter* xml;
};

/// Comment, <compiler>, <option>, <size>, <default> and what pictures need.
void WriteHead(const Sections& s);
/// Lines of distance drives, and springs.
void WriteTendons(const Sections& s);
/// Closures, and what can hold drives and prescribed joints.
void WriteEqualities(const Sections& s);
/// Drive positions and forces, gaps of closures, forces of split ones.
void WriteSensors(const Sections& s);

}  // namespace mbv::mjcf
