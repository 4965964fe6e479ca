#include "math/spatial.h"

#include <Eigen/Geometry>
#include <array>

#include "math/spatial.h"

namespace mbv {
namespace {

// Points on (0, 1) and weights of Gauss's rule.
constexpr std::array<double, 4> kPoint = {0.06943184420297371, 0.33000947820757187,
                                          0.6699905217924281, 0.9305681557970262};
constexpr std::array<double, 4> kWeight = {0.17392742256872692, 0.32607257743127307,
                                           0.32607257743127307, 0.17392742256872692};

// Hermite's polynomial of degree five on (0, 1), and its derivative there.
struct Between {
  Vec3 p, rate;
};

Between At(const MovingDirection& from, const MovingDirection& to, double h, double s) {
  const Vec3 v0 = h * from.rate, v1 = h * to.rate;
  const Vec3 a0 = h * h * from.acceleration, a1 = h * h * to.acceleration;
  const Vec3 d = to.n - from.n - v0 - 0.5 * a0, e = v1 - v0 - a0, f = a1 - a0;
  const Vec3 c3 = 10.0 * d - 4.0 * e + 0.5 * f, c4 = -15.0 * d + 7.0 * e - f,
             c5 = 6.0 * d - 3.0 * e + 0.5 * f;
  return {from.n + s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5)))),
          v0 + s * (a0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))};
}

}  // namespace

Mat3 LeastRotation(const Vec3& n0, const Vec3& n1) {
  return Eigen::Quaterniond::FromTwoVectors(n0, n1).toRotationMatrix();
}

double TurnBeyond(const Mat3& R0, const Mat3& R, const Vec3& n) {
  const Eigen::AngleAxisd rest(Mat3(R * R0.transpose()));
  return rest.angle() * rest.axis().dot(n);
}

Mat3 Transported(const Mat3& R0, const MovingDirection& from, const MovingDirection& to, double h) {
  double psi = 0.0;
  for (size_t k = 0; k < kPoint.size(); ++k) {
    // Unit length: n = p/|p|, and the part of ṅ along p adds nothing to the triple product.
    const Between at = At(from, to, h, kPoint[k]);
    const double length = at.p.norm();
    psi += kWeight[k] * from.n.cross(at.p).dot(at.rate) / (length * (length + from.n.dot(at.p)));
  }
  return ExpRotation(psi * to.n) * LeastRotation(from.n, to.n) * R0;
}

}  // namespace mbv
