#include "mechanism/joint_coordinate.h"

namespace mbv::internal {

double RollPitchYaw(const RestingPair& pair, int component) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  if (component == 0) return Angle(Cosine(pair, z, y), Cosine(pair, z, z));
  if (component == 2) return Angle(Cosine(pair, y, x), Cosine(pair, x, x));
  return std::atan2(-Cosine(pair, z, x), std::hypot(Cosine(pair, z, y), Cosine(pair, z, z)));
}

bool IsAngle(JointKind kind, int coordinate) {
  switch (kind) {
    case JointKind::kFixed:
    case JointKind::kPrismatic:
      return false;
    case JointKind::kRevolute:
    case JointKind::kUniversal:
    case JointKind::kSpherical:
      return true;
    case JointKind::kCylindrical:
      return coordinate == 1;
    case JointKind::kPlanar:
      return coordinate == 2;
    case JointKind::kFree:
      return coordinate >= 3;
  }
  return false;
}

}  // namespace mbv::internal
