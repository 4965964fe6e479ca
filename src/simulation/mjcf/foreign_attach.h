// <attach> of MuJoCo 3 in foreign MJCF files. Internal to mjcf/.
#pragma once

#include <tinyxml2.h>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "simulation/mjcf/foreign_frames.h"

namespace mbv::mjcf {

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
