// <frame> and <replicate> of MuJoCo 3 in foreign MJCF files. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "simulation/mjcf/foreign.h"

// Walks through XML. Internal to mjcf/.

namespace mbv::mjcf {

// Calls visit(element) on all elements below, deepest last.
template <typename Element, typename Visit>
void ForEach(Element* element, const Visit& visit) {
  for (Element* e = element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    visit(e);
    ForEach(e, visit);
  }
}

inline bool IsTag(const tinyxml2::XMLElement* element, const char* tag) {
  return std::string_view(element->Name()) == tag;
}

/// What could not be dissolved; empty text: nothing.
struct FrameTrouble {
  int line = 0;
  std::string text, hint = {};
};

/// Writes out what <replicate> repeats, with the elements that refer to it, and moves what stands
/// in a <frame> to the body around it, posed as it was.
[[nodiscard]] FrameTrouble DissolveFrames(tinyxml2::XMLDocument* document);

/// The same; then states all orientations as quaternions and the angles of joints in a unit [rad],
/// each at its element, so that neither depends on the document's <compiler>.
[[nodiscard]] FrameTrouble DissolveFrames(double unit, tinyxml2::XMLDocument* document);

/// The unit of angles that a document's <compiler> states [rad].
[[nodiscard]] double AngleUnit(const tinyxml2::XMLElement* root);

/// An attribute's text: the element's own, or that of its class; null without one.
[[nodiscard]] const char* Inherited(const tinyxml2::XMLElement* e, const char* attribute);

// Mesh geoms of foreign MJCF files. Internal to mjcf/.

struct MeshGeoms {
  std::map<std::string, ForeignMesh> meshes;  ///< by the name of the sphere in the geom's place
  int lost = 0;                               ///< geoms that went without one
  /// Bodies whose inertia is that of meshes whose files are not there.
  struct Missing {
    int line = 0;  ///< of the geom
    std::string body, file;
  };
  std::vector<Missing> missing = {};
};

/// Puts a sphere of no mass where a geom shows a mesh of a file that `is_open` allows, and removes
/// mesh geoms that give no mass to their body. `folder`: that of the mesh files.
[[nodiscard]] MeshGeoms TakeMeshGeoms(
    const std::filesystem::path& folder,
    const std::function<bool(const std::filesystem::path&)>& is_open,
    tinyxml2::XMLDocument* document);

// <attach> of MuJoCo 3 in foreign MJCF files. Internal to mjcf/.

/// A keyframe of an attached model: what it says of joints, by their names in the whole.
struct AttachedKey {
  std::string name;
  std::map<std::string, std::vector<double>> qpos;
};

/// What an attachment brings, beside what it writes.
struct Attachment {
  FrameTrouble trouble;  ///< `line` is one of the document, or of the attached model's
  bool in_model = false;
  std::vector<std::string> remarks;
  std::vector<AttachedKey> keys;
};

/// Gives every class-less element the class `main`, which takes the rows of the outermost default,
/// so that documents with defaults of their own can stand in one.
void NameMainDefault(const std::string& main, tinyxml2::XMLDocument* document);

/// Puts a part of a model where <attach> stands, with all that refers to it, named by the prefix;
/// without the defaults and assets if `model` is the document's own copy. `keys`: of the model's
/// own attachments. Its folder is that of its file. [MuJoCo, XML reference, body/attach]
[[nodiscard]] Attachment Attach(tinyxml2::XMLElement* attach, const std::filesystem::path& folder,
                                std::vector<AttachedKey> keys, bool is_own,
                                tinyxml2::XMLDocument* model);

}  // namespace mbv::mjcf
