// What an SDF file holds, element by element, and which files it brings along.

#include <fmt/format.h>
#include <tinyxml2.h>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "base/demand.h"
#include "base/files.h"
#include "base/inputs.h"
#include "base/text.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/sdf/read_sdf.h"
#include "model_file/urdf/urdf_closures.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
using enum SdfFate;

constexpr const char* kWind = "wind drags and lifts the bodies";
constexpr const char* kOpen = "the loop that it closes is open";
constexpr const char* kDriven = "the drives of the file move it";

// clang-format off
const SdfRow kRows[] = {
    {"sdf", "version", kTaken},
    {"sdf/world", "name", kTaken},
    {"sdf/light", "**", kNoForce},
    {"sdf/actor", "**", kNoForce},

    {"world/gravity", "text", kTaken},
    {"world/frame", "name attached_to", kTaken},
    {"world/state", "", kLeftOut, "it moves links away from where their models have them"},
    {"world/population", "", kRefused, "the models that it places are missing"},
    {"world/joint", "", kRefused, "what it joins is apart"},
    {"world/wind", "**", kNoForce},  // acts on links by enable_wind
    {"world/physics", "**", kNoForce},
    {"world/scene", "**", kNoForce},
    {"world/gui", "**", kNoForce},
    {"world/light", "**", kNoForce},
    {"world/actor", "**", kNoForce},
    {"world/road", "**", kNoForce},
    {"world/audio", "**", kNoForce},
    {"world/atmosphere", "**", kNoForce},
    {"world/magnetic_field", "**", kNoForce},
    {"world/spherical_coordinates", "**", kNoForce},

    {"model", "name canonical_link placement_frame text", kTaken},
    {"model", "static", kLeftOut, "nothing of the model moves there", "", true},
    {"floating", "", kLeftOut, "it is held where it is", "", true},
    {"static", "text", kTaken},
    {"model/self_collide", "text", kNoForce},
    {"model/allow_auto_disable", "text", kNoForce},
    {"model/enable_wind", "text", kLeftOut, kWind, "false|0"},
    {"model/frame", "name attached_to", kTaken},
    {"model/gripper", "", kLeftOut, "it joins bodies while it runs"},
    {"pose", "text relative_to rotation_format degrees frame", kTaken},
    {"include", "merge", kTaken},
    {"include/uri", "text", kTaken},
    {"include/name", "text", kTaken},
    {"include/placement_frame", "text", kTaken},
    {"include/experimental:params", "", kRefused, "it changes the included model"},
    // By kinds: UrdfPluginRows().
    {"plugin", "", kLeftOut, "it may do anything to forces", "", true},

    {"model/link", "name", kTaken},
    {"link/gravity", "text", kTaken},
    {"link/enable_wind", "text", kLeftOut, kWind, "false|0"},
    {"link/kinematic", "text", kLeftOut, "no force moves the link", "false|0"},
    {"link/self_collide", "text", kNoForce},
    {"link/must_be_base_link", "text", kNoForce},
    {"link/velocity_decay", "text", kTaken},
    {"velocity_decay/linear", "text", kLeftOut, "a damper acts on the link", "0"},
    {"velocity_decay/angular", "text", kLeftOut, "a damper acts on the link", "0"},
    {"link/inertial", "text", kTaken},
    {"link/inertial", "auto", kRefused, "mass and inertia are to follow from shapes", "false|0"},
    {"inertial/density", "text", kNoForce},  // counts with `auto`
    {"inertial/mass", "text", kTaken},
    {"inertial/inertia", "text", kTaken},
    {"inertia/ixx", "text", kTaken},
    {"inertia/ixy", "text", kTaken},
    {"inertia/ixz", "text", kTaken},
    {"inertia/iyy", "text", kTaken},
    {"inertia/iyz", "text", kTaken},
    {"inertia/izz", "text", kTaken},
    {"inertial/fluid_added_mass", "", kLeftOut, "a fluid moves with the link"},
    {"link/visual", "**", kTaken},
    {"link/collision", "**", kNoForce},  // there are no contacts
    {"link/sensor", "**", kNoForce},
    {"link/light", "**", kNoForce},
    {"link/projector", "**", kNoForce},
    {"link/audio_sink", "**", kNoForce},
    {"link/audio_source", "**", kNoForce},
    {"link/battery", "**", kNoForce},
    {"link/particle_emitter", "**", kNoForce},

    {"model/joint", "name type", kTaken},
    {"joint/parent", "text", kTaken},
    {"joint/child", "text", kTaken},
    {"joint/thread_pitch", "text", kTaken},
    {"joint/screw_thread_pitch", "text", kTaken},
    {"joint/gearbox_ratio", "text", kTaken},
    {"joint/gearbox_reference_body", "text", kTaken},
    {"joint/sensor", "**", kNoForce},
    {"joint/axis", "text", kTaken},
    {"joint/axis2", "text", kTaken},
    {"xyz", "text expressed_in", kTaken},
    {"use_parent_model_frame", "text", kTaken},
    {"initial_position", "text", kNoForce},
    {"dynamics", "text", kTaken},
    {"dynamics/damping", "text", kTaken},
    {"dynamics/friction", "text", kTaken},
    {"dynamics/spring_reference", "text", kTaken},
    {"dynamics/spring_stiffness", "text", kTaken},
    {"dynamics", "negative", kLeftOut, "it drives the joint", "", true},
    {"ball", "spring_stiffness", kLeftOut, "it exerts moments in the ball", "", true},
    {"gearbox", "", kLeftOut, "the two bodies turn apart", "", true},
    {"axis/limit", "text", kTaken},
    {"axis2/limit", "text", kTaken},
    {"limit/lower", "text", kTaken},
    {"limit/upper", "text", kTaken},
    {"limit/effort", "text", kTaken},
    {"limit/velocity", "text", kTaken},
    {"limit/stiffness", "text", kNoForce},
    {"limit/dissipation", "text", kNoForce},
    {"axis/mimic", "joint axis text", kTaken},
    {"axis2/mimic", "", kLeftOut, "the second axis turns by itself"},
    {"mimic/multiplier", "text", kTaken},
    {"mimic/offset", "text", kTaken},
    {"mimic/reference", "text", kTaken},
    // How Gazebo's engines step.
    {"joint/physics", "text", kTaken},
    {"physics/simbody", "text", kTaken},
    {"simbody/must_be_loop_joint", "text", kTaken},
    {"physics/provide_feedback", "text", kNoForce},
    {"physics/ode", "text", kTaken},
    {"ode/provide_feedback", "text", kNoForce},
    {"ode/cfm_damping", "text", kNoForce},
    {"ode/implicit_spring_damper", "text", kNoForce},
    {"ode/fudge_factor", "text", kNoForce},
    {"ode/cfm", "text", kNoForce},
    {"ode/erp", "text", kNoForce},
    {"ode/bounce", "text", kNoForce},
    {"ode/velocity", "text", kNoForce},
    {"ode/limit", "**", kNoForce},
    {"ode/max_force", "text", kLeftOut, "a motor moves the joint", "0"},
    {"ode/suspension", "text", kTaken},
    {"suspension/erp", "text", kNoForce},
    {"suspension/cfm", "text", kLeftOut, "the joint gives way as a spring", "0"},

    // Drake.
    {"drake:proximity_properties", "**", kNoForce},
    {"drake:collision_filter_group", "**", kNoForce},
    {"limit/drake:acceleration", "text", kNoForce},
    {"joint/drake:controller_gains", "**", kNoForce},
    {"joint/drake:rotor_inertia", "text", kTaken},
    {"joint/drake:gear_ratio", "text", kTaken},
    {"drake:mimic", "joint multiplier offset text", kTaken},
    {"drake:joint", "", kRefused, "a link hangs on it"},
    {"drake:linear_bushing_rpy", "", kLeftOut, "a bushing acts between two frames"},
    {"drake:linear_spring_damper", "", kLeftOut, "a spring acts between two points"},
    {"drake:ball_constraint", "", kLeftOut, kOpen},
    {"drake:weld_constraint", "", kLeftOut, kOpen},
    {"drake:distance_constraint", "", kLeftOut, kOpen},
    {"drake:tendon_constraint", "", kLeftOut, kDriven},
    {"drake:deformable_properties", "", kLeftOut, "the link is not rigid"},
    {"link/drake:deformable_properties", "", kLeftOut, "the link is not rigid"},
};
// clang-format on

// Elements that hold numbers, and how many: others are for libsdformat to judge.
struct NumbersRow {
  const char* element;  // as of SdfRow
  size_t count;
  bool may_be_infinite = false;
};
constexpr NumbersRow kNumbers[] = {
    {"pose", 6},
    {"world/gravity", 3},
    {"xyz", 3},
    {"inertial/mass", 1},
    {"ixx", 1},
    {"ixy", 1},
    {"ixz", 1},
    {"iyy", 1},
    {"iyz", 1},
    {"izz", 1},
    {"dynamics/damping", 1},
    {"dynamics/friction", 1},
    {"spring_reference", 1},
    {"spring_stiffness", 1},
    {"thread_pitch", 1},
    {"screw_thread_pitch", 1},
    {"gearbox_ratio", 1},
    {"mimic/multiplier", 1},
    {"mimic/offset", 1},
    {"mimic/reference", 1},
    {"drake:rotor_inertia", 1},
    {"drake:gear_ratio", 1},
    {"limit/lower", 1, true},
    {"limit/upper", 1, true},
    {"limit/effort", 1, true},
};

// The numbers of a text; empty where something else stands in it.
std::optional<std::vector<double>> NumbersIn(const std::string& text) {
  std::vector<double> numbers;
  for (const char* at = text.c_str(); *at != '\0';) {
    char* end = nullptr;
    numbers.push_back(std::strtod(at, &end));
    if (end == at || (*end != '\0' && std::isspace(static_cast<unsigned char>(*end)) == 0)) {
      return std::nullopt;
    }
    for (at = end; std::isspace(static_cast<unsigned char>(*at)) != 0;) ++at;
  }
  return numbers;
}

bool HasWord(std::string_view words, std::string_view word) {
  while (true) {
    const size_t end = words.find(' ');
    if (words.substr(0, end) == word) return true;
    if (end == std::string_view::npos) return false;
    words.remove_prefix(end + 1);
  }
}

// True for an element with a row of its own.
bool IsKnownElement(std::string_view element) {
  const std::string_view tag = element.substr(element.rfind('/') + 1);
  return std::ranges::any_of(kRows, [&](const SdfRow& row) {
    return !row.imported && (row.element == element || row.element == tag);
  });
}

std::string TrimmedText(const XMLElement& e) {
  const std::string all = e.GetText() == nullptr ? "" : e.GetText();
  const size_t from = all.find_first_not_of(" \t\r\n"), to = all.find_last_not_of(" \t\r\n");
  return from == std::string::npos ? "" : all.substr(from, to - from + 1);
}

int DepthBelow(const XMLElement& element) {
  int deepest = 0;
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    deepest = std::max(deepest, 1 + DepthBelow(*e));
  }
  return deepest;
}

// libsdformat 12 reads SDF up to 1.9; what came later is read as 1.9, with the new elements.
std::string AsKnownVersion(std::string text) {
  const size_t sdf = text.find("<sdf");
  const size_t version = text.find("version", sdf);
  const size_t end = sdf == std::string::npos ? sdf : text.find('>', sdf);
  if (version == std::string::npos || version > end) return text;
  const size_t one = text.find("1.1", version);
  if (one == std::string::npos || one > end || one + 3 >= end) return text;
  if (text[one + 3] >= '0' && text[one + 3] <= '9') text.replace(one, 4, "1.9");
  return text;
}

// The > of the tag that begins at `at`; npos without one.
size_t EndOfTag(const std::string& text, size_t at) {
  char quote = '\0';
  for (; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != '\0') {
      if (c == quote) quote = '\0';
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at;
    }
  }
  return std::string::npos;
}

// True for what libsdformat need not see: no force depends on it, and no picture.
bool IsIdle(const std::string& element) {
  const SdfRow* row = FindSdfRow(element, "**");
  return (row != nullptr && row->fate == kNoForce) || element == "material/script";
}

// A file with blanks in place of what is idle, on the same lines: libsdformat 12 refuses files
// whose sensors, materials or surfaces it does not know or finds faults in. `text` is well-formed.
std::string LeanText(std::string text) {
  std::vector<std::string> open;    // tags
  std::optional<size_t> idle_from;  // where the outermost idle element begins
  size_t idle_depth = 0;
  for (size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) {
    const auto skipped = [&](std::string_view begin, std::string_view end) {
      if (text.compare(at, begin.size(), begin) != 0) return false;
      at = std::min(text.find(end, at), text.size());
      return true;
    };
    if (skipped("<!--", "-->") || skipped("<![CDATA[", "]]>") || skipped("<?", "?>") ||
        skipped("<!", ">")) {
      continue;
    }
    const size_t close = EndOfTag(text, at);
    if (close == std::string::npos) return text;
    const bool ends = text[at + 1] == '/', empty = text[close - 1] == '/';
    if (!ends) {
      const size_t end = text.find_first_of(" \t\r\n/>", at + 1);
      const std::string tag = text.substr(at + 1, end - at - 1);
      const std::string element = open.empty() ? tag : open.back() + "/" + tag;
      open.push_back(tag);
      if (!idle_from && IsIdle(element)) {
        idle_from = at;
        idle_depth = open.size();
      }
    }
    at = close + 1;
    if (!ends && !empty) continue;
    if (idle_from && open.size() == idle_depth) {
      for (size_t i = *idle_from; i < at; ++i) {
        if (text[i] != '\n') text[i] = ' ';
      }
      idle_from.reset();
    }
    if (!open.empty()) open.pop_back();
  }
  return text;
}

class Inspector {
 public:
  Inspector(const std::string& file, Diagnostics* diagnostics, SdfSource* source)
      : root_(fs::absolute(file).parent_path()), diagnostics_(*diagnostics), source_(*source) {
    std::error_code error;
    open_.push_back(fs::weakly_canonical(file, error));
  }

  // A file and all that it includes.
  void Read(const std::string& text, const std::string& file, const std::string& scope,
            const std::string& model_name) {
    constexpr int kDeepest = 100;
    if (FindNonText(text) != std::string::npos) {
      Refuse(file, 0, "the file is not UTF-8 text");
      return;
    }
    XMLDocument document;
    if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
      Refuse(file, document.ErrorLineNum(), "the file is not well-formed XML",
             fmt::format("the XML reader says {}", document.ErrorName()));
      return;
    }
    const XMLElement* sdf = document.RootElement();
    if (sdf == nullptr || std::string_view(sdf->Name()) != "sdf") {
      Refuse(file, sdf == nullptr ? 0 : sdf->GetLineNum(), "no SDF: the root element is not <sdf>",
             sdf != nullptr && std::string_view(sdf->Name()) == "robot"
                 ? "a URDF file is read as FILE.urdf, and cannot be included"
                 : "");
      return;
    }
    if (DepthBelow(*sdf) > kDeepest) {
      Refuse(file, 0, fmt::format("elements are nested deeper than {}", kDeepest));
      return;
    }
    const std::string above = std::exchange(file_, file);
    const std::string name = std::exchange(model_name_, model_name);
    LookUp(*sdf, "", scope);
    file_ = above;
    model_name_ = name;
  }

  void Report() {
    for (const auto& [what, loss] : losses_) {
      const auto& [element, value] = what;
      const SdfRow* row = FindSdfRow(element, value);
      const std::string text = Described(element, value, loss);
      if (row != nullptr && row->fate == kRefused) {
        Refuse(loss.file, loss.line, fmt::format("{} is not read: {}", text, row->effect));
        continue;
      }
      source_.left_out.push_back(
          row != nullptr
              ? LeftOutOfSdf(element, value, text)
              : ModelCaveat{.text = fmt::format("{} is left out: it is not known, and forces may "
                                                "depend on it",
                                                text),
                            .source = element + (value.empty() ? "" : " ") + value});
      Warn(loss.file, loss.line, source_.left_out.back().text);
    }
  }

 private:
  // Something of one kind that is left out, and where.
  struct Loss {
    int count = 0, line = 0;
    std::string file;
    std::vector<std::string> names;
  };

  void Refuse(const std::string& file, int line, const std::string& text,
              const std::string& hint = "") {
    diagnostics_.Add({Severity::kError, file, line, line > 0 ? 1 : 0, text, hint});
  }
  void Warn(const std::string& file, int line, const std::string& text) {
    diagnostics_.Add(
        {Severity::kWarning, file, line, line > 0 ? 1 : 0, text, "forces are computed without it"});
  }

  static std::string Described(const std::string& element, const std::string& value,
                               const Loss& loss) {
    const std::string tag = element.substr(element.rfind('/') + 1);
    const bool whole = value.empty() || value == "text" || value == "**";
    return fmt::format("{} ({}{}{})",
                       whole ? fmt::format("<{}>", tag) : fmt::format("{} of <{}>", value, tag),
                       loss.count, loss.names.empty() ? "" : ": ", Joined(loss.names, 6));
  }

  void Note(const XMLElement& e, const std::string& element, const std::string& value) {
    Loss& loss = losses_[{element, value}];
    if (loss.count++ == 0) {
      loss.line = e.GetLineNum();
      loss.file = file_;
    }
    for (const tinyxml2::XMLNode* at = &e; at != nullptr; at = at->Parent()) {
      const XMLElement* owner = at->ToElement();
      const char* name = owner == nullptr ? nullptr : owner->Attribute("name");
      if (name == nullptr) continue;
      if (!Contains(loss.names, name)) loss.names.emplace_back(name);
      return;
    }
  }

  void NoteUnlessNeutral(const XMLElement& e, const std::string& element, const std::string& value,
                         const std::string& content) {
    const SdfRow* row = FindSdfRow(element, value);
    const bool counts =
        row == nullptr || ((row->fate == kLeftOut || row->fate == kRefused) && !row->imported);
    const bool is_neutral =
        row != nullptr && *row->neutral != '\0' && internal::IsNeutralValue(row->neutral, content);
    if (counts && !is_neutral) Note(e, element, value);
  }

  void CheckVersion(const XMLElement& sdf) {
    constexpr unsigned kNewest = 12;  // 1.12
    const char* version = sdf.Attribute("version");
    const std::string text = version == nullptr ? "" : version;
    unsigned minor = 0;
    const char* end = text.data() + text.size();
    const bool good = text.starts_with("1.") &&
                      std::from_chars(text.data() + 2, end, minor).ptr == end && minor <= kNewest;
    if (good) return;
    Refuse(file_, sdf.GetLineNum(),
           fmt::format("version = '{}' of <sdf> is not one of 1.0 … 1.{}", QuotedValue(text),
                       kNewest));
  }

  void CheckJointType(const XMLElement& joint) {
    static const std::vector<std::string> kTypes = {"revolute", "continuous", "prismatic",
                                                    "ball",     "universal",  "revolute2",
                                                    "screw",    "fixed",      "gearbox"};
    const char* type = joint.Attribute("type");
    if (type != nullptr && Contains(kTypes, type)) return;
    const char* name = joint.Attribute("name");
    Refuse(file_, joint.GetLineNum(),
           fmt::format("joint '{}': type = '{}' is not one of {}", name == nullptr ? "" : name,
                       QuotedValue(type == nullptr ? "" : type), Joined(kTypes)),
           DidYouMean(type == nullptr ? "" : type, kTypes));
  }

  void CheckNumbers(const XMLElement& e, std::string_view element) {
    const std::string_view tag = element.substr(element.rfind('/') + 1);
    const auto* row = std::ranges::find_if(kNumbers, [&](const NumbersRow& numbers) {
      return numbers.element == element || numbers.element == tag;
    });
    const std::string text = TrimmedText(e);
    if (row == std::end(kNumbers) || text.empty()) return;  // SDF has defaults
    const auto numbers = NumbersIn(text);
    const bool is_quaternion = e.Attribute("rotation_format") != nullptr;
    const bool good = numbers && (numbers->size() == row->count || is_quaternion) &&
                      std::ranges::all_of(*numbers, [&](double x) {
                        return std::isfinite(x) || (row->may_be_infinite && !std::isnan(x));
                      });
    if (good) return;
    const char* name = nullptr;
    for (const tinyxml2::XMLNode* at = &e; at != nullptr && name == nullptr; at = at->Parent()) {
      if (const XMLElement* owner = at->ToElement()) name = owner->Attribute("name");
    }
    Refuse(file_, e.GetLineNum(),
           fmt::format("<{}> '{}' of '{}' is not {}", tag, QuotedValue(text),
                       name == nullptr ? "" : name,
                       row->may_be_infinite ? "a number"
                       : row->count == 1    ? "a finite number"
                                            : fmt::format("{} finite numbers", row->count)));
  }

  void LookUp(const XMLElement& e, const std::string& parent, std::string scope) {
    const std::string tag = e.Name();
    const std::string element = parent.empty() ? tag : parent + "/" + tag;
    if (FindSdfRow(element, "**") != nullptr) return;
    if (tag == "plugin") {
      ReadPlugin(e);
      return;
    }
    const SdfRow* whole = FindSdfRow(element, "");
    if (!IsKnownElement(element) || (whole != nullptr && !whole->imported &&
                                     (whole->fate == kLeftOut || whole->fate == kRefused))) {
      Note(e, element, "");
      return;
    }
    if (FindSdfRow(element, "text") != nullptr && tag != "model") {
      NoteUnlessNeutral(e, element, "text", TrimmedText(e));
      CheckNumbers(e, element);
    }
    for (const auto* a = e.FirstAttribute(); a != nullptr; a = a->Next()) {
      if (std::string_view(a->Name()).starts_with("xmlns")) continue;
      NoteUnlessNeutral(e, element, a->Name(), a->Value());
    }
    if (tag == "include") {
      Include(e, scope);
      return;
    }
    const char* name = e.Attribute("name");
    if (element == "model/joint") CheckJointType(e);
    if (element == "sdf") CheckVersion(e);
    if (tag == "model") {
      const std::string own = !model_name_.empty() ? model_name_ : name == nullptr ? "" : name;
      model_name_.clear();  // of the included file's own model
      scope += own + "::";
    } else if (name != nullptr && (tag == "link" || tag == "joint")) {
      source_.places.push_back({tag + " " + scope + name, file_, e.GetLineNum()});
    }
    for (const XMLElement* inner = e.FirstChildElement(); inner != nullptr;
         inner = inner->NextSiblingElement()) {
      LookUp(*inner, tag, scope);
    }
  }

  // By its file, else by its name: names are chosen freely.
  void ReadPlugin(const XMLElement& plugin) {
    const char* file = plugin.Attribute("filename");
    const char* name = plugin.Attribute("name");
    const std::string word = file != nullptr ? file : name != nullptr ? name : "";
    const internal::UrdfPluginRow* row = internal::FindUrdfPlugin(word);
    if (row == nullptr && file != nullptr && name != nullptr) row = internal::FindUrdfPlugin(name);
    if (row != nullptr && row->effect == nullptr) {  // a drive's, or it measures
      const std::string_view part = row->part;
      if (part.find("control") == std::string_view::npos &&
          part.find("trajectory") == std::string_view::npos) {
        return;
      }
      for (const XMLElement* joint = plugin.FirstChildElement("joint_name"); joint != nullptr;
           joint = joint->NextSiblingElement("joint_name")) {
        source_.motors.push_back(TrimmedText(*joint));
      }
      return;
    }
    ModelCaveat caveat =
        LeftOutOfSdf("plugin", "", word.empty() ? "<plugin>" : "<plugin> " + QuotedValue(word));
    if (row != nullptr) {
      caveat.text = fmt::format("<plugin> {} is left out: {}", QuotedValue(word), row->effect);
    }
    source_.left_out.push_back(caveat);
    Warn(file_, plugin.GetLineNum(), caveat.text);
  }

  // A name in the folder that the file which is read now lies in, as seen from the first file's.
  [[nodiscard]] std::string FromRoot(const std::string& uri) const {
    if (uri.find("://") != std::string::npos) return uri;
    const fs::path folder = fs::absolute(file_).parent_path();
    return (folder.lexically_proximate(root_) / uri).string();
  }

  // The SDF file that a folder of a model names in its model.config; "" without one.
  static std::string FileOfModel(const fs::path& config) {
    const auto text = ReadWholeFile(config);
    XMLDocument document;
    if (!text || document.Parse(text->c_str(), text->size()) != tinyxml2::XML_SUCCESS ||
        document.RootElement() == nullptr) {
      return "";
    }
    std::pair<double, std::string> newest{-1.0, ""};
    for (const XMLElement* sdf = document.RootElement()->FirstChildElement("sdf"); sdf != nullptr;
         sdf = sdf->NextSiblingElement("sdf")) {
      newest = std::max(newest, {sdf->DoubleAttribute("version"), TrimmedText(*sdf)});
    }
    return newest.second;
  }

  // A file, or the one that a model's folder names.
  [[nodiscard]] FoundMesh FindIncluded(const std::string& uri) const {
    FoundMesh found = FindMesh(uri, root_);
    if (!found.path.empty() || found.outside) return found;
    const FoundMesh config = FindMesh(uri + "/model.config", root_);
    const std::string model = config.path.empty() ? "" : FileOfModel(config.path);
    if (!model.empty()) found = FindMesh(uri + "/" + model, root_);
    found.outside = found.outside || config.outside;
    return found;
  }

  void Include(const XMLElement& e, const std::string& scope) {
    constexpr size_t kMostIncludes = 100;
    const XMLElement* uri_element = e.FirstChildElement("uri");
    const std::string uri = uri_element == nullptr ? "" : TrimmedText(*uri_element);
    const std::string says = fmt::format("include '{}'", QuotedValue(uri));
    const int line = e.GetLineNum();
    for (const XMLElement* inner = e.FirstChildElement(); inner != nullptr;
         inner = inner->NextSiblingElement()) {
      LookUp(*inner, "include", scope);
    }
    if (++includes_ > kMostIncludes) {
      if (includes_ == kMostIncludes + 1) {
        Refuse(file_, line, fmt::format("more than {} includes", kMostIncludes));
      }
      return;
    }
    FoundMesh found = FindIncluded(FromRoot(uri));
    // Gazebo looks a bare name up as a model's.
    if (found.path.empty() && !found.outside && uri.find_first_of(":/.") == std::string::npos) {
      found = FindIncluded("model://" + uri);
    }
    const auto text = found.path.empty() ? std::nullopt : ReadWholeFile(found.path);
    if (!text) {
      Refuse(file_, line,
             fmt::format("{} {}", says,
                         found.outside ? "lies outside the folder of the file" : "cannot be read"),
             "included are files in the folder of the file or below, and in folders that --package "
             "NAME=DIR names; nothing is loaded from the network");
      return;
    }
    std::error_code error;
    const fs::path path = fs::weakly_canonical(found.path, error);
    if (std::ranges::find(open_, path) != open_.end()) {
      Refuse(file_, line, says + " includes itself");
      return;
    }
    const auto known = std::ranges::find(source_.includes, uri, &SdfSource::Include::uri);
    if (known == source_.includes.end()) {
      source_.includes.push_back({uri, path.string(), AsKnownVersion(LeanText(*text))});
    } else if (known->file != path.string()) {
      Refuse(file_, line, fmt::format("{} is also another file, {}", says, known->file),
             "give one of them another name");
      return;
    }
    NoteInput(found.path.string(), *text);
    const XMLElement* name = e.FirstChildElement("name");
    open_.push_back(path);
    Read(*text, PathSeenFrom(fs::current_path(error), found.path), scope,
         name == nullptr ? "" : TrimmedText(*name));
    open_.pop_back();
  }

  const fs::path root_;  // where the first file lies
  Diagnostics& diagnostics_;
  SdfSource& source_;
  std::vector<fs::path> open_;  // files that are being read
  std::string file_, model_name_;
  size_t includes_ = 0;
  std::map<std::pair<std::string, std::string>, Loss> losses_;
};

}  // namespace

std::span<const SdfRow> SdfRows() { return kRows; }

const SdfRow* FindSdfRow(std::string_view element, std::string_view value) {
  const std::string_view tag = element.substr(element.rfind('/') + 1);
  for (const std::string_view name : {element, tag}) {
    for (const SdfRow& row : kRows) {
      if (row.element == name && HasWord(row.values, value)) return &row;
    }
  }
  return nullptr;
}

ModelCaveat LeftOutOfSdf(std::string_view element, std::string_view value,
                         const std::string& what) {
  const SdfRow* row = FindSdfRow(element, value);
  MBV_DEMAND(row != nullptr && row->fate == kLeftOut, std::string(element));
  return {.kind = ModelCaveat::Kind::kLeftOut,
          .text = fmt::format("{} is left out: {}", what, row->effect),
          .source = fmt::format("{}{}{}", row->element, value.empty() ? "" : " ", value)};
}

std::optional<SdfSource> InspectSdf(const std::string& text, const std::string& file,
                                    Diagnostics* diagnostics) {
  SdfSource source;
  source.file = file;
  source.folder = fs::absolute(file).parent_path().string();
  for (const MeshPackage& package : MeshPackages()) {
    source.packages.push_back(package.name);
    source.packages.push_back(fs::absolute(package.folder).string());
  }
  Diagnostics found;
  Inspector inspector(file, &found, &source);
  inspector.Read(text, file, "", "");
  inspector.Report();
  diagnostics->Append(found);
  if (found.has_errors()) return std::nullopt;
  source.text = AsKnownVersion(LeanText(text));  // it is well-formed
  return source;
}

}  // namespace mbv
