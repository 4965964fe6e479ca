#include "mechanism/joint_coordinate.h"

namespace mbv::internal {

double RollPitchYaw(const RestingPair& pair, int component) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  if (component == 0) return Angle(Cosine(pair, z, y), Cosine(pair, z, z));
  if (component == 2) return Angle(Cosine(pair, y, x), Cosine(pair, x, x));
  return std::atan2(-Cosine(pair, z, x), std::hypot(Cosine(pair, z, y), Cosine(pair, z, z)));
}

}  // namespace mbv::internal
