#include "mjcf/writer.h"

#include <fmt/format.h>

#include <cmath>

namespace mbv::mjcf {
namespace {

constexpr double kRounding = 2e-16;

double Clean(double x) { return std::abs(x) < kRounding ? 0.0 : x; }

}  // namespace

std::string NumberText(double x) {
  std::string text = fmt::format("{}", x == 0.0 ? 0.0 : x);
  // "1e-05" → "1e-5"
  const size_t exponent = text.find('e');
  if (exponent != std::string::npos && exponent + 2 < text.size() && text[exponent + 2] == '0') {
    text.erase(exponent + 2, 1);
  }
  return text;
}

std::string NumbersText(std::span<const double> numbers) {
  std::string text;
  for (double x : numbers) {
    if (!text.empty()) text += ' ';
    text += NumberText(x);
  }
  return text;
}

Eigen::Vector4d QuatOf(const Mat3& R) {
  const Eigen::Quaterniond q(R);
  Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
  wxyz /= wxyz.norm();
  for (double& x : wxyz) x = Clean(x);
  // The double cover: first component that is not zero is positive.
  for (double x : wxyz) {
    if (x != 0.0) return x < 0.0 ? Eigen::Vector4d(-wxyz) : wxyz;
  }
  return wxyz;
}

void XmlWriter::Set(const char* name, const Vec3& v) {
  const Vec3 clean = v.unaryExpr(&Clean);
  Set(name, std::span<const double>(clean.data(), 3));
}

void XmlWriter::SetPose(const Pose& X) {
  const Vec3 p = X.translation().unaryExpr(&Clean);
  if (!p.isZero(0.0)) Set("pos", p);
  const Eigen::Vector4d quat = QuatOf(X.linear());
  if (quat != Eigen::Vector4d(1, 0, 0, 0)) Set("quat", std::span<const double>(quat.data(), 4));
}

}  // namespace mbv::mjcf
