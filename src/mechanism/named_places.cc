#include "mechanism/named_places.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <map>
#include <optional>
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

namespace {

using Rgba = std::array<double, 4>;

const std::map<std::string, Rgba>& Table() {
  static const std::map<std::string, Rgba> table = {
      {"accent", {0.93, 0.55, 0.14, 1}},     {"aluminium", {0.78, 0.8, 0.83, 1}},
      {"base", {0.27, 0.3, 0.34, 1}},        {"black", {0.1, 0.1, 0.11, 1}},
      {"blue", {0.2, 0.42, 0.7, 1}},         {"brass", {0.8, 0.65, 0.3, 1}},
      {"copper", {0.74, 0.45, 0.28, 1}},     {"dark", {0.3, 0.32, 0.35, 1}},
      {"dark_steel", {0.34, 0.37, 0.41, 1}}, {"deck", {0.52, 0.57, 0.58, 1}},
      {"glass", {0.7, 0.82, 0.9, 0.3}},      {"glass_frame", {0.56, 0.69, 0.78, 1}},
      {"green", {0.27, 0.57, 0.36, 1}},      {"grey", {0.58, 0.6, 0.62, 1}},
      {"hull", {0.36, 0.14, 0.13, 1}},       {"light_grey", {0.8, 0.81, 0.82, 1}},
      {"platform", {0.93, 0.55, 0.14, 1}},   {"red", {0.75, 0.2, 0.17, 1}},
      {"rubber", {0.16, 0.16, 0.17, 1}},     {"sea", {0.16, 0.37, 0.5, 1}},
      {"steel", {0.6, 0.64, 0.69, 1}},       {"white", {0.93, 0.93, 0.92, 1}},
      {"wood", {0.72, 0.56, 0.38, 1}},       {"yellow", {0.93, 0.77, 0.2, 1}},
  };
  return table;
}

// "#rrggbb" or "#rrggbbaa".
std::optional<Rgba> ParseHex(const std::string& text) {
  const auto is_hex = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if ((text.size() != 7 && text.size() != 9) || text[0] != '#' ||
      !std::all_of(text.begin() + 1, text.end(), is_hex)) {
    return std::nullopt;
  }
  Rgba rgba{0, 0, 0, 1};
  for (std::size_t i = 0; 2 * i + 2 < text.size(); ++i) {
    int value = 0;
    std::from_chars(text.data() + 2 * i + 1, text.data() + 2 * i + 3, value, 16);
    rgba[i] = value / 255.0;
  }
  return rgba;
}

}  // namespace

std::array<double, 4> ShapeColor(const std::string& color) {
  if (const auto it = Table().find(color); it != Table().end()) return it->second;
  return ParseHex(color).value_or(Table().at("grey"));
}

bool IsShapeColor(const std::string& color) {
  return Table().contains(color) || ParseHex(color).has_value();
}

std::vector<std::string> ShapeColorNames() {
  std::vector<std::string> names;
  for (const auto& [name, rgba] : Table()) names.push_back(name);
  return names;
}

}  // namespace mbv
