#include "scenario/coordinate_names.h"

namespace mbv {

std::vector<std::string> CoordinateNames(const Mechanism& mechanism) {
  std::vector<std::string> names;
  for (const Prescribed& p : mechanism.prescribed) names.push_back(p.name);
  for (const Drive& d : mechanism.drives) names.push_back(d.name);
  for (const Output& o : mechanism.outputs) {
    for (const char* c : kPoseComponents) names.push_back(o.name + "." + c);
  }
  return names;
}

Coordinate CoordinateAt(const Mechanism& mechanism, size_t k) {
  using Kind = Coordinate::Kind;
  if (k < mechanism.prescribed.size()) return {Kind::kPrescribed, static_cast<int>(k), 0};
  k -= mechanism.prescribed.size();
  if (k < mechanism.drives.size()) return {Kind::kDrive, static_cast<int>(k), 0};
  k -= mechanism.drives.size();
  return {Kind::kOutput, static_cast<int>(k / 6), static_cast<int>(k % 6)};
}

}  // namespace mbv
