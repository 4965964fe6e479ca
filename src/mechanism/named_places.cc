#include "mechanism/named_places.h"

#include <algorithm>
#include <set>

namespace mbv {
namespace {

bool AsksFor(const std::string& word, const NamedPlace& place) {
  switch (place.kind) {
    case PlaceKind::kOutput:
    case PlaceKind::kDrive:
      if (word == "usual") return true;
      break;
    case PlaceKind::kJoint:
      if (word == "usual" || word == "joints") return true;
      break;
    case PlaceKind::kFrame:
      if (word == "frames") return true;
      break;
    case PlaceKind::kBody:
      if (word == "bodies") return true;
      break;
  }
  return word == place.name;
}

NamedPlace At(PlaceKind kind, const std::string& name, int body, const Vec3& p) {
  return {.kind = kind, .name = name, .body_a = body, .body_b = body, .p_a = p, .p_b = p};
}

NamedPlace PlaceOf(const Mechanism& mechanism, const Drive& drive) {
  if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
    return {.kind = PlaceKind::kDrive,
            .name = drive.name,
            .body_a = leg->body_from,
            .body_b = leg->body_to,
            .p_a = leg->p_from,
            .p_b = leg->p_to};
  }
  const Joint& joint = mechanism.joints[std::get<JointDrive>(drive.kind).joint];
  return At(PlaceKind::kDrive, drive.name, joint.child, joint.X_CM.translation());
}

}  // namespace

std::vector<NamedPlace> NamedPlacesOf(const Mechanism& mechanism) {
  std::vector<NamedPlace> places;
  for (const Output& output : mechanism.outputs) {
    places.push_back(At(PlaceKind::kOutput, output.name, output.body, output.X_BO.translation()));
  }
  for (const Drive& drive : mechanism.drives) places.push_back(PlaceOf(mechanism, drive));
  for (const Joint& joint : mechanism.joints) {
    if (joint.kind == JointKind::kFree) continue;
    places.push_back(At(PlaceKind::kJoint, joint.name, joint.child, joint.X_CM.translation()));
  }
  for (int b = 0; b < static_cast<int>(mechanism.bodies.size()); ++b) {
    const Body& body = mechanism.bodies[b];
    for (const NamedFrame& frame : body.frames) {
      places.push_back(
          At(PlaceKind::kFrame, body.name + "." + frame.name, b, frame.X_BF.translation()));
    }
  }
  for (int b = 1; b < static_cast<int>(mechanism.bodies.size()); ++b) {
    const Body& body = mechanism.bodies[b];
    places.push_back(At(PlaceKind::kBody, body.name, b, body.p_BoBcm_B));
  }
  return places;
}

const std::vector<std::string>& PlaceWords() {
  static const std::vector<std::string> words = {"joints", "frames", "bodies", "usual"};
  return words;
}

std::vector<NamedPlace> PlacesFor(const Mechanism& mechanism,
                                  const std::vector<std::string>& words) {
  std::vector<NamedPlace> places = NamedPlacesOf(mechanism);
  std::erase_if(places, [&](const NamedPlace& place) {
    return std::ranges::none_of(words,
                                [&](const std::string& word) { return AsksFor(word, place); });
  });
  std::set<std::string> known;
  std::erase_if(places, [&](const NamedPlace& place) { return !known.insert(place.name).second; });
  return places;
}

}  // namespace mbv
