// A thin layer over tinyxml2's printer: numbers that read back exactly.
#pragma once

#include <tinyxml2.h>

#include <span>
#include <string>

#include "core/types.h"

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

}  // namespace mbv::mjcf
