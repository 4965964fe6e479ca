#include "simulation/mjcf/foreign.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tinyxml2.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "base/files.h"
#include "base/text.h"
#include "model_file/mesh/read_mesh.h"
#include "simulation/mjcf/foreign_frames.h"
#include "simulation/mjcf/foreign_rows.h"

namespace mbv::mjcf {

namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

constexpr int kDeepest = 200;  // nesting of elements
constexpr size_t kMostNames = 6;
constexpr const char* kOpenFolders =
    "in the model's folder or below, or in a folder that --package NAME=DIR names";

// What a row's element and attribute are called in findings.
std::string NameOf(const std::string& element, const std::string& attribute) {
  const std::string tag = element.substr(element.find('/') + 1);
  if (attribute.empty()) return fmt::format("<{}>", tag);
  return fmt::format("{} of <{}>", attribute, tag);
}

std::string ElementOf(const XMLElement* e) {
  const XMLElement* parent = e->Parent() == nullptr ? nullptr : e->Parent()->ToElement();
  return ForeignElement(parent == nullptr ? "" : parent->Name(), e->Name());
}

// True if an attribute switches something off, "disable".
bool IsOff(const XMLElement* flag, const char* name) {
  const char* value = flag->Attribute(name);
  return value != nullptr && std::string_view(value) == "disable";
}

int DepthOf(const XMLElement* element) {
  int deepest = 0;
  for (const XMLElement* e = element->FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    deepest = std::max(deepest, 1 + DepthOf(e));
  }
  return deepest;
}

}  // namespace

struct ForeignMjcf::Impl {
  XMLDocument document;
  fs::path file, folder;
  fs::path top;                  // folder of the whole
  std::vector<fs::path> around;  // files of models that this one is attached to
  std::vector<AttachedKey> attached_keys;
  Diagnostics* diagnostics = nullptr;
  std::map<std::string, SitePair> by_sites;
  std::map<std::string, ForeignMesh> meshes;
  std::vector<ModelCaveat> left_out;
  bool good = false;

  void Add(Severity severity, int line, const std::string& text, const std::string& hint = "") {
    diagnostics->Add({severity, file.string(), line, line > 0 ? 1 : 0, text, hint});
    if (severity == Severity::kError) good = false;
  }

  XMLElement* root() { return document.RootElement(); }

  [[nodiscard]] bool IsOpen(const fs::path& path) const { return MayBeNamed(path, top); }

  void Parse(const std::string& text) {
    good = true;
    const tinyxml2::XMLError trouble = document.Parse(text.c_str(), text.size());
    if (trouble == tinyxml2::XML_ELEMENT_DEPTH_EXCEEDED) {
      Add(Severity::kError, document.ErrorLineNum(),
          fmt::format("elements are nested deeper than {}, which no XML reader of MuJoCo takes",
                      TINYXML2_MAX_ELEMENT_DEPTH - 1),
          "a chain of this many bodies can be written as a model.yaml, where bodies do not nest");
      return;
    }
    if (trouble != tinyxml2::XML_SUCCESS) {
      Add(Severity::kError, document.ErrorLineNum(), "the file is not well-formed XML",
          fmt::format("the XML reader says {}", document.ErrorName()));
      return;
    }
    if (root() == nullptr || !IsTag(root(), "mujoco")) {
      Add(Severity::kError, 0, "no MJCF: the root element is not <mujoco>");
      return;
    }
    if (DepthOf(root()) > kDeepest) {
      Add(Severity::kError, 0, fmt::format("elements are nested deeper than {}", kDeepest));
    }
  }

  void TakeIncludes() {
    constexpr int kMost = 100;
    for (int taken = 0; good && taken <= kMost; ++taken) {
      XMLElement* found = nullptr;
      ForEach(root(), [&](XMLElement* e) {
        if (found == nullptr && IsTag(e, "include")) found = e;
      });
      if (found == nullptr) return;
      if (taken == kMost) {
        Add(Severity::kError, found->GetLineNum(), fmt::format("more than {} includes", kMost));
        return;
      }
      TakeInclude(found);
    }
  }

  void TakeInclude(XMLElement* include) {
    const char* name = include->Attribute("file");
    const fs::path path = folder / (name == nullptr ? "" : name);
    const auto text = IsOpen(path) ? ReadWholeFile(path) : std::nullopt;
    XMLDocument other;
    if (!text || other.Parse(text->c_str(), text->size()) != tinyxml2::XML_SUCCESS ||
        other.RootElement() == nullptr || DepthOf(other.RootElement()) > kDeepest) {
      Add(Severity::kError, include->GetLineNum(),
          fmt::format("include '{}' cannot be read", name == nullptr ? "" : name),
          fmt::format("it must be an XML file {}", kOpenFolders));
      return;
    }
    tinyxml2::XMLNode* parent = include->Parent();
    tinyxml2::XMLNode* last = include;
    for (const XMLElement* e = other.RootElement()->FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement()) {
      last = parent->InsertAfterChild(last, e->DeepClone(&document));
    }
    document.DeleteNode(include);
  }

  // Since MuJoCo 3.2 parts of other models, and of the model itself, stand where <attach> is.
  void AttachModels() {
    constexpr int kMost = 20'000;  // elements; models that attach models may multiply
    bool named = false;
    while (good) {
      XMLElement* attach = nullptr;
      int elements = 0;
      ForEach(root(), [&](XMLElement* e) {
        ++elements;
        if (attach == nullptr && IsTag(e, "attach")) attach = e;
      });
      if (attach == nullptr) break;
      if (elements > kMost) {
        Add(Severity::kError, attach->GetLineNum(),
            fmt::format("<attach> makes more than {} elements", kMost));
        return;
      }
      if (!named) NameMainDefault("main of the model", &document);
      named = true;
      if (attach->Attribute("model") == nullptr) {
        XMLDocument own;
        document.DeepCopy(&own);
        Take(Attach(attach, folder, {}, true, &own), file.string());
      } else {
        AttachModel(attach);
      }
    }
  }

  void AttachModel(XMLElement* attach) {
    const std::string name = attach->Attribute("model");
    std::string path;
    std::vector<std::string> names;
    Impl model;
    model.diagnostics = diagnostics;
    for (XMLElement* asset : ModelAssets()) {
      const char *own = asset->Attribute("name"), *from = asset->Attribute("file");
      if (from == nullptr) continue;
      names.emplace_back(own == nullptr ? ModelNameOf(folder / from) : own);
      if (names.back() == name) path = from;
    }
    if (path.empty()) {
      return Add(Severity::kError, attach->GetLineNum(),
                 fmt::format("<attach> model '{}': no <model> of the assets has this name", name),
                 DidYouMean(name, names));
    }
    model.file = folder / path;
    model.folder = model.file.parent_path();
    model.top = top;
    model.around = around;
    model.around.push_back(fs::weakly_canonical(file));
    const auto text = IsOpen(model.file) ? ReadWholeFile(model.file) : std::nullopt;
    if (!text) {
      return Add(Severity::kError, attach->GetLineNum(),
                 fmt::format("<attach> model '{}': file '{}' cannot be read", name, path),
                 fmt::format("it must be an MJCF file {}", kOpenFolders));
    }
    if (std::ranges::find(model.around, fs::weakly_canonical(model.file)) != model.around.end()) {
      return Add(Severity::kError, attach->GetLineNum(),
                 fmt::format("<attach> model '{}': file '{}' attaches itself", name, path));
    }
    model.Parse(*text);
    if (model.good) model.TakeIncludes();
    if (model.good) model.AttachModels();
    good = model.good;
    if (!good) return;
    Take(Attach(attach, model.folder, std::move(model.attached_keys), false, &model.document),
         model.file.string());
  }

  void Take(Attachment attachment, const std::string& model) {
    for (const std::string& remark : attachment.remarks) {
      diagnostics->Add({Severity::kWarning, model, 0, 0, remark, ""});
    }
    std::ranges::move(attachment.keys, std::back_inserter(attached_keys));
    const FrameTrouble& trouble = attachment.trouble;
    if (trouble.text.empty()) return;
    good = false;
    diagnostics->Add({Severity::kError, attachment.in_model ? model : file.string(), trouble.line,
                      trouble.line > 0 ? 1 : 0, trouble.text, trouble.hint});
  }

  std::vector<XMLElement*> ModelAssets() {
    std::vector<XMLElement*> assets;
    for (XMLElement* section = root()->FirstChildElement("asset"); section != nullptr;
         section = section->NextSiblingElement("asset")) {
      for (XMLElement* e = section->FirstChildElement("model"); e != nullptr;
           e = e->NextSiblingElement("model")) {
        assets.push_back(e);
      }
    }
    return assets;
  }

  void DropModelAssets() {
    for (XMLElement* asset : ModelAssets()) document.DeleteNode(asset);
  }

  [[nodiscard]] std::string ModelNameOf(const fs::path& path) const {
    const auto text = IsOpen(path) ? ReadWholeFile(path) : std::nullopt;
    XMLDocument model;
    if (!text || model.Parse(text->c_str(), text->size()) != tinyxml2::XML_SUCCESS) return "";
    const char* name =
        model.RootElement() == nullptr ? nullptr : model.RootElement()->Attribute("model");
    return name == nullptr ? "" : name;
  }

  // What dynamics without contacts do not need.
  void DropPictures() {
    MeshGeoms geoms = TakeMeshGeoms(
        MeshFolder(), [this](const fs::path& path) { return IsOpen(path); }, &document);
    meshes = std::move(geoms.meshes);
    if (geoms.lost > 0) {
      Add(Severity::kWarning, 0, fmt::format("{} meshes are left out of the pictures", geoms.lost),
          fmt::format("meshes of files {} are drawn", kOpenFolders));
    }
    for (const MeshGeoms::Missing& missing : geoms.missing) {
      Add(Severity::kError, missing.line,
          fmt::format("body '{}' states no inertia: it is that of mesh file '{}', which is not in "
                      "the model's folder",
                      missing.body, missing.file),
          "put the file there, or write <inertial pos=… mass=… diaginertia=…/> into the body; of "
          "geoms that are for pictures only, mass=\"0\"");
    }
    std::vector<XMLElement*> others;
    std::set<std::string> bodies{"world"};
    ForEach(root(), [&](XMLElement* e) {
      if (IsTag(e, "body") && e->Attribute("name") != nullptr) bodies.insert(e->Attribute("name"));
    });
    const auto known = [&](const XMLElement* e, const char* body) {
      return e->Attribute(body) != nullptr && bodies.contains(e->Attribute(body));
    };
    ForEach(root(), [&](XMLElement* e) {
      for (const char* attribute : {"material", "texture"}) e->DeleteAttribute(attribute);
      if (IsTag(e, "camera") || IsTag(e, "light")) others.push_back(e);
      const bool in_assets = e->Parent() != nullptr && e->Parent()->ToElement() != nullptr &&
                             IsTag(e->Parent()->ToElement(), "asset");
      if (in_assets && (IsTag(e, "texture") || IsTag(e, "material") || IsTag(e, "skin"))) {
        others.push_back(e);
      }
      if (in_assets && IsTag(e, "hfield")) FlattenTerrain(e);
      if (e->Parent() != root()) return;
      for (const char* section : {"visual", "sensor"}) {
        if (IsTag(e, section)) others.push_back(e);
      }
      if (!IsTag(e, "contact")) return;
      for (XMLElement* pair = e->FirstChildElement("pair"); pair != nullptr;
           pair = pair->NextSiblingElement("pair")) {
        others.push_back(pair);  // of geoms that may be gone
      }
      // Of bodies of a scene that is another file.
      for (XMLElement* exclude = e->FirstChildElement("exclude"); exclude != nullptr;
           exclude = exclude->NextSiblingElement("exclude")) {
        if (!known(exclude, "body1") || !known(exclude, "body2")) others.push_back(exclude);
      }
    });
    for (XMLElement* e : others) document.DeleteNode(e);
    DropUnusedMeshes();
  }

  // Heights touch only, and their file may be absent.
  static void FlattenTerrain(XMLElement* e) {
    const char* file = e->Attribute("file");
    if (file != nullptr && e->Attribute("name") == nullptr) {
      e->SetAttribute("name", fs::path(file).stem().string().c_str());
    }
    for (const char* attribute : {"file", "elevation", "content_type"}) {
      e->DeleteAttribute(attribute);
    }
    for (const char* attribute : {"nrow", "ncol"}) e->SetAttribute(attribute, 2);
  }

  void DropUnusedMeshes() {
    std::set<std::string> used;
    std::vector<XMLElement*> unused;
    ForEach(root(), [&](XMLElement* e) {
      if (IsTag(e, "geom") && e->Attribute("mesh") != nullptr) used.insert(e->Attribute("mesh"));
    });
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      if (!IsTag(e, "mesh") || parent == nullptr || !IsTag(parent, "asset")) return;
      std::string name = e->Attribute("name") == nullptr ? "" : e->Attribute("name");
      const char* from = e->Attribute("file");
      if (name.empty() && from != nullptr) name = fs::path(from).stem().string();
      if (used.count(name) == 0) {
        unused.push_back(e);
      } else if (from != nullptr && !IsOpen(MeshFolder() / from)) {
        Add(Severity::kError, e->GetLineNum(),
            fmt::format("mesh '{}' lies outside the model's folder", from),
            fmt::format("it must be a file {}", kOpenFolders));
      }
    });
    for (XMLElement* e : unused) document.DeleteNode(e);
  }

  // MuJoCo 2.2 finds the principal axes of a full tensor to six digits: they are stated instead.
  void StatePrincipalAxes() {
    ForEach(root(), [](XMLElement* e) {
      const char* full = IsTag(e, "inertial") ? e->Attribute("fullinertia") : nullptr;
      if (full == nullptr) return;
      for (const char* orientation : {"quat", "axisangle", "xyaxes", "zaxis", "euler"}) {
        if (e->Attribute(orientation) != nullptr) return;  // an error of the compiler's
      }
      std::istringstream text(full);
      std::array<double, 6> I{};
      for (double& value : I) text >> value;
      Mat3 tensor;
      tensor << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
      if (text.fail() || !tensor.allFinite()) return;
      const Eigen::SelfAdjointEigenSolver<Mat3> principal(tensor);
      const Vec3 d = principal.eigenvalues();
      if (!(d.minCoeff() > 0.0)) return;
      Mat3 axes = principal.eigenvectors();
      if (axes.determinant() < 0.0) axes.col(2) *= -1.0;
      const Eigen::Quaterniond q(axes);
      e->DeleteAttribute("fullinertia");
      e->SetAttribute("diaginertia", fmt::format("{} {} {}", d[0], d[1], d[2]).c_str());
      e->SetAttribute("quat", fmt::format("{} {} {} {}", q.w(), q.x(), q.y(), q.z()).c_str());
    });
  }

  XMLElement* Compiler() {
    XMLElement* compiler = root()->FirstChildElement("compiler");
    if (compiler == nullptr) {
      compiler = document.NewElement("compiler");
      root()->InsertFirstChild(compiler);
    }
    return compiler;
  }

  // Since MuJoCo 3.0 a range holds unless the file says otherwise, and since 3.0 one without room
  // (lower ≥ upper, "0 0") is none.
  void LetRangesHold() {
    constexpr std::pair<const char*, const char*> kLimits[] = {{"range", "limited"},
                                                               {"ctrlrange", "ctrllimited"},
                                                               {"forcerange", "forcelimited"},
                                                               {"actrange", "actlimited"}};
    int open = 0, line = 0;
    bool any = false;
    ForEach(root(), [&](XMLElement* e) {
      for (const auto& [attribute, limited] : kLimits) {
        any = any || e->Attribute(attribute) != nullptr;
        const bool of_actuator = attribute != kLimits[0].first;  // muscles have another `range`
        const XMLElement* parent = e == root() ? e : e->Parent()->ToElement();
        if (IsBelowDefault(e) || of_actuator != IsTag(parent, "actuator")) continue;
        const char* range = Inherited(e, attribute);
        if (range == nullptr || !IsAuto(Inherited(e, limited))) continue;
        if (!HasRoom(range)) {
          e->SetAttribute(limited, "false");
        } else if (!of_actuator && open++ == 0) {  // no force: actuators' motion is commanded
          line = e->GetLineNum();
        }
      }
    });
    if (StatesAutolimits() || !any) return;
    Compiler()->SetAttribute("autolimits", "true");
    if (open == 0) return;
    Add(Severity::kWarning, line,
        fmt::format("{} range{} without `limited` hold{}, as since MuJoCo 3", open,
                    open == 1 ? "" : "s", open == 1 ? "s" : ""),
        "<compiler autolimits=\"false\"/> if they should not");
  }

  static bool IsBelowDefault(const XMLElement* e) {
    for (const tinyxml2::XMLNode* up = e->Parent(); up != nullptr; up = up->Parent()) {
      if (up->ToElement() != nullptr && IsTag(up->ToElement(), "default")) return true;
    }
    return false;
  }

  static bool IsAuto(const char* limited) {
    return limited == nullptr || std::string_view(limited) == "auto";
  }

  // As MuJoCo reads it: what is not there is 0. What is not a number is for its reader to judge.
  static bool HasRoom(const char* range) {
    double lower = 0.0, upper = 0.0;
    std::istringstream text(range);
    text >> lower;
    if (text.fail()) return true;
    text >> upper;
    return lower < upper || (text.fail() && !text.eof());
  }

  bool StatesAutolimits() {
    for (const XMLElement* e = root()->FirstChildElement("compiler"); e != nullptr;
         e = e->NextSiblingElement("compiler")) {
      if (e->Attribute("autolimits") != nullptr) return true;
    }
    return false;
  }

  // What MuJoCo 3 says of bodies and joints and 2.2 has no word for goes through its compiler as
  // the numbers that users may give them (UserNumber).
  void CarryThrough() {
    bool any = false;
    ForEach(root(), [&](XMLElement* e) {
      for (const char* of : {"gravcomp", "actuatorgravcomp", "actuatorfrcrange"}) {
        any = any || e->Attribute(of) != nullptr;
      }
    });
    if (!any) return;
    std::vector<XMLElement*> joints;
    ForEach(root(), [&](XMLElement* e) {
      if (IsTag(e, "body")) {
        e->DeleteAttribute("user");
        if (e->Attribute("gravcomp") != nullptr) {
          e->SetAttribute("user", e->Attribute("gravcomp"));
          e->DeleteAttribute("gravcomp");
        }
      }
      if (IsTag(e, "joint") && ElementOf(e) == "body/joint") joints.push_back(e);
    });
    std::vector<std::string> numbers;
    numbers.reserve(joints.size());
    for (const XMLElement* e : joints) numbers.push_back(JointNumbers(e));
    for (size_t j = 0; j < joints.size(); ++j) {
      for (const char* of : {"actuatorgravcomp", "actuatorfrclimited", "actuatorfrcrange"}) {
        joints[j]->DeleteAttribute(of);
      }
      joints[j]->DeleteAttribute("user");
      const bool stands = IsTag(joints[j]->Parent()->ToElement(), "body");
      if (stands) joints[j]->SetAttribute("user", numbers[j].c_str());
    }
    for (XMLElement* size = root()->FirstChildElement("size"); size != nullptr;
         size = size->NextSiblingElement("size")) {
      size->DeleteAttribute("nuser_body");
      size->DeleteAttribute("nuser_jnt");
    }
    XMLElement* size = document.NewElement("size");
    size->SetAttribute("nuser_body", 1);
    size->SetAttribute("nuser_jnt", 4);
    root()->InsertEndChild(size);
  }

  // In the order of UserNumber.
  std::string JointNumbers(const XMLElement* joint) {
    const auto is = [joint](const char* attribute, std::string_view value) {
      const char* text = Inherited(joint, attribute);
      return text != nullptr && text == value;
    };
    const char* range = Inherited(joint, "actuatorfrcrange");
    const bool limited = range != nullptr && HasRoom(range) && !is("actuatorfrclimited", "false");
    if (is("actuatorfrclimited", "true") && !limited) {
      Add(Severity::kError, joint->GetLineNum(),
          "actuatorfrcrange is limited, but its first number is not below its second",
          "MuJoCo 3 refuses it; actuatorfrclimited=\"false\" is no limit");
    }
    return fmt::format("{} {} {}", is("actuatorgravcomp", "true") ? 1 : 0, limited ? 1 : 0,
                       limited ? range : "0 0");
  }

  // The body that carries a site, by its name, which it is given if it has none; empty without one.
  std::string BodyOfSite(const std::string& site) {
    XMLElement* body = nullptr;
    ForEach(root(), [&](XMLElement* e) {
      const char* name = IsTag(e, "site") ? e->Attribute("name") : nullptr;
      if (name != nullptr && name == site) body = e->Parent()->ToElement();
    });
    if (body == nullptr) return "";
    if (IsTag(body, "worldbody")) return "world";
    if (!IsTag(body, "body")) return "";
    if (body->Attribute("name") == nullptr) {
      body->SetAttribute("name", ("body_of_" + site).c_str());
    }
    return body->Attribute("name");
  }

  // Since MuJoCo 3.2 a connect or weld may name two sites.
  void NameBodiesOfSites() {
    std::vector<XMLElement*> closures;
    ForEach(root(), [&](XMLElement* e) {
      if ((IsTag(e, "connect") || IsTag(e, "weld")) && e->Attribute("site1") != nullptr &&
          e->Attribute("site2") != nullptr) {
        closures.push_back(e);
      }
    });
    for (XMLElement* e : closures) {
      const SitePair sites{e->Attribute("site1"), e->Attribute("site2")};
      const std::string body1 = BodyOfSite(sites.first), body2 = BodyOfSite(sites.second);
      if (body1.empty() || body2.empty()) {
        Add(Severity::kError, e->GetLineNum(),
            fmt::format("<{}> names the site '{}', which no body has", e->Name(),
                        body1.empty() ? sites.first : sites.second));
        continue;
      }
      std::string name =
          e->Attribute("name") == nullptr ? sites.first + "_" + sites.second : e->Attribute("name");
      while (by_sites.contains(name)) name += "_";
      for (const char* attribute : {"site1", "site2", "relpose"}) e->DeleteAttribute(attribute);
      e->SetAttribute("name", name.c_str());
      e->SetAttribute("body1", body1.c_str());
      e->SetAttribute("body2", body2.c_str());
      e->SetAttribute("anchor", "0 0 0");
      by_sites.emplace(name, sites);
    }
  }

  fs::path MeshFolder() {
    const XMLElement* compiler = root()->FirstChildElement("compiler");
    const char* meshes = compiler == nullptr ? nullptr : compiler->Attribute("meshdir");
    if (meshes == nullptr && compiler != nullptr) meshes = compiler->Attribute("assetdir");
    return meshes == nullptr ? folder : folder / meshes;
  }

  void WriteOutFrames() {
    const FrameTrouble trouble = DissolveFrames(&document);
    if (!trouble.text.empty()) Add(Severity::kError, trouble.line, trouble.text, trouble.hint);
  }

  // Words that MuJoCo 2.2 has another one for: `implicitfast` leaves terms out of the Jacobian of
  // `implicit`, and `filterexact` integrates the same filter without error.
  void TranslateWords() {
    constexpr const char* kWords[][3] = {{"integrator", "implicitfast", "implicit"},
                                         {"dyntype", "filterexact", "filter"}};
    ForEach(root(), [&](XMLElement* e) {
      for (const auto& [attribute, newer, instead] : kWords) {
        const char* value = e->Attribute(attribute);
        if (value == nullptr || std::string_view(value) != newer) continue;
        e->SetAttribute(attribute, instead);
        Add(Severity::kWarning, e->GetLineNum(),
            fmt::format("{} '{}' is read as '{}': forces that a motion takes do not depend on it",
                        attribute, newer, instead));
      }
    });
  }

  // Three slides along the axes and a ball under a body of the world move it as a free joint does.
  // Where anything acts along one of them or names it they stay what they are.
  void JoinFloatingBases() {
    bool numbered = false;
    XMLElement* world = root()->FirstChildElement("worldbody");
    for (; world != nullptr; world = world->NextSiblingElement("worldbody")) {
      for (XMLElement* body = world->FirstChildElement("body"); body != nullptr;
           body = body->NextSiblingElement("body")) {
        if (!IsFloatingBase(body)) continue;
        if (!std::exchange(numbered, true)) NumberJoints();
        body->InsertAfterChild(body->FirstChildElement("joint"), document.NewElement("freejoint"));
        while (XMLElement* joint = body->FirstChildElement("joint")) body->DeleteChild(joint);
        const char* name = body->Attribute("name");
        Add(Severity::kWarning, body->GetLineNum(),
            fmt::format("three slides and a ball of {} are read as one free joint",
                        name == nullptr ? "a body" : fmt::format("'{}'", name)));
      }
    }
  }

  // Joints without a name keep MuJoCo's number of the file as it is.
  void NumberJoints() {
    std::set<std::string> names;
    std::vector<XMLElement*> joints;
    XMLElement* world = root()->FirstChildElement("worldbody");
    for (; world != nullptr; world = world->NextSiblingElement("worldbody")) {
      ForEach(world, [&](XMLElement* e) {
        if (!IsTag(e, "joint") && !IsTag(e, "freejoint")) return;
        joints.push_back(e);
        if (e->Attribute("name") != nullptr) names.insert(e->Attribute("name"));
      });
    }
    for (size_t k = 0; k < joints.size(); ++k) {
      const std::string name = fmt::format("joint_{}", k);
      if (joints[k]->Attribute("name") == nullptr && !names.contains(name)) {
        joints[k]->SetAttribute("name", name.c_str());
      }
    }
  }

  bool IsFloatingBase(const XMLElement* body) {
    constexpr const char* kTypes[] = {"slide", "slide", "slide", "ball"};
    const bool keys = root()->FirstChildElement("keyframe") != nullptr;
    const std::vector<double> place = NumbersOf(body->Attribute("pos"), {0.0, 0.0, 0.0});
    if (keys) {  // whose numbers are then those of the free joint
      for (const char* turn : {"quat", "axisangle", "euler", "xyaxes", "zaxis"}) {
        if (body->Attribute(turn) != nullptr) return false;
      }
    }
    size_t k = 0;
    for (const XMLElement* joint = body->FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint"), ++k) {
      const char* type = Inherited(joint, "type");
      if (k >= std::size(kTypes) || type == nullptr || std::string_view(type) != kTypes[k]) {
        return false;
      }
      const char* limited = Inherited(joint, "limited");
      const bool free = limited != nullptr && std::string_view(limited) == "false";
      if (!free && (limited == nullptr || IsAuto(limited)) &&
          Inherited(joint, "range") != nullptr) {
        return false;
      }
      if (!free && limited != nullptr && !IsAuto(limited)) return false;
      for (const char* acts :
           {"stiffness", "damping", "armature", "frictionloss", "springdamper"}) {
        for (const double x : NumbersOf(Inherited(joint, acts), {})) {
          if (x != 0.0) return false;
        }
      }
      if (IsNamed(joint)) return false;
      const std::vector<double> zero = {0.0, 0.0, 0.0};
      if (k < 3) {
        std::vector<double> along = zero;
        along[k] = 1.0;
        if (NumbersOf(Inherited(joint, "axis"), {0.0, 0.0, 1.0}) != along) return false;
        const std::vector<double> ref = NumbersOf(Inherited(joint, "ref"), {0.0});
        if (keys && (place.size() != 3 || ref != std::vector{place[k]})) return false;
      } else if (NumbersOf(Inherited(joint, "pos"), zero) != zero) {
        return false;
      }
    }
    return k == std::size(kTypes);
  }

  static std::vector<double> NumbersOf(const char* text, std::vector<double> otherwise) {
    if (text == nullptr) return otherwise;
    std::istringstream words(text);
    std::vector<double> numbers;
    for (double x = 0.0; words >> x;) numbers.push_back(x);
    return numbers;
  }

  // Another element's attribute has its name.
  bool IsNamed(const XMLElement* joint) {
    const char* name = joint->Attribute("name");
    bool named = false;
    if (name == nullptr) return named;
    ForEach(root(), [&](const XMLElement* e) {
      for (const auto* a = e->FirstAttribute(); a != nullptr && e != joint; a = a->Next()) {
        named = named || std::string_view(a->Value()) == name;
      }
    });
    return named;
  }

  // Since MuJoCo 3.3.6 springs and dampers are switched off apart.
  void SwitchOff() {
    bool springs = false, dampers = false;
    ForEach(root(), [&](XMLElement* e) {
      if (!IsTag(e, "flag")) return;
      springs = springs || IsOff(e, "spring");
      dampers = dampers || IsOff(e, "damper");
      if (springs && dampers) e->SetAttribute("passive", "disable");
      e->DeleteAttribute("spring");
      e->DeleteAttribute("damper");
    });
    if (springs == dampers) return;
    const char* off = springs ? "stiffness" : "damping";
    ForEach(root(), [&](XMLElement* e) {
      for (const char* tag : {"joint", "spatial", "fixed", "tendon"}) {
        if (IsTag(e, tag) && e->Attribute(off) != nullptr) e->SetAttribute(off, "0");
      }
    });
  }

  // Of several numbers, whether one beyond the first is not zero.
  static bool MoreThanFirst(const std::string& text) {
    const char* at = text.c_str();
    char* end = nullptr;
    (void)std::strtod(at, &end);
    for (at = end; *at != '\0'; at = end) {
      const double x = std::strtod(at, &end);
      if (end == at) return false;
      if (x != 0.0) return true;
    }
    return false;
  }

  // Something of one kind that is left out, and where.
  struct Loss {
    int count = 0, line = 0;
    std::vector<std::string> names;
  };
  using Losses = std::map<std::pair<std::string, std::string>, Loss>;  // by element, attribute

  static void Note(const XMLElement* e, const std::string& element, const std::string& attribute,
                   Losses* losses) {
    Loss& loss = (*losses)[{element, attribute}];
    if (loss.count++ == 0) loss.line = e->GetLineNum();
    for (const XMLElement* at = e; at != nullptr; at = at->Parent()->ToElement()) {
      if (const char* name = at->Attribute("name")) {
        if (loss.names.empty() || loss.names.back() != name) loss.names.emplace_back(name);
        return;
      }
    }
  }

  // Every element and attribute against the rows.
  void LookUpAll() {
    Losses lost, unknown;
    ForEach(root(), [&](XMLElement* e) { LookUp(e, &lost, &unknown); });
    for (const auto& [what, loss] : lost) {
      const ForeignRow* row = FindForeignRow(what.first, what.second);
      if (row->fate == Fate::kRefused) {
        Add(Severity::kError, loss.line,
            fmt::format("{} is not read: {}", Described(what, loss), row->effect),
            "write the model out with a current MuJoCo (mj_saveLastXML) and import that");
      } else {
        LeaveOut(what, loss, row->effect);
      }
    }
    for (const auto& [what, loss] : unknown) {
      LeaveOut(what, loss, "it is not known, and forces may depend on it");
    }
  }

  void LookUp(XMLElement* e, Losses* lost, Losses* unknown) {
    const std::string element = ElementOf(e);
    const ForeignRow* row = FindForeignRow(element, "");
    if (row != nullptr && !row->compiled &&
        (row->fate == Fate::kLeftOut || row->fate == Fate::kRefused)) {
      Note(e, element, "", lost);
      return;
    }
    if (!IsForeignElement(element)) {
      Note(e, element, "", unknown);
      return;
    }
    TakeFirstNumber(e, lost);
    for (const auto* a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
      row = FindForeignRow(element, a->Name());
      if (row == nullptr) Note(e, element, a->Name(), unknown);
      if (row == nullptr || row->fate != Fate::kLeftOut || row->compiled) continue;
      if (IsNeutral(*row, a->Value())) continue;
      Note(e, element, a->Name(), lost);
    }
  }

  // Springs and dampers may be polynomials since MuJoCo 3.
  static void TakeFirstNumber(XMLElement* e, Losses* lost) {
    for (const char* tag : {"joint", "spatial", "fixed", "tendon"}) {
      if (!IsTag(e, tag)) continue;
      for (const char* attribute : {"stiffness", "damping"}) {
        const char* text = e->Attribute(attribute);
        if (text == nullptr) continue;
        if (MoreThanFirst(text)) Note(e, attribute, "2nd", lost);
        char* end = nullptr;
        (void)std::strtod(text, &end);
        while (*end == ' ') ++end;
        if (*end == '\0' || end == text) continue;
        e->SetAttribute(attribute, std::string(text, static_cast<const char*>(end)).c_str());
      }
      TakeOneLength(e, lost);
    }
  }

  // MuJoCo 3: between two lengths the spring of a tendon exerts no force.
  static void TakeOneLength(XMLElement* e, Losses* lost) {
    const char* text = e->Attribute("springlength");
    double lengths[2] = {};
    char* end = nullptr;
    if (text == nullptr) return;
    lengths[0] = std::strtod(text, &end);
    const char* const second = end;
    lengths[1] = std::strtod(second, &end);
    if (end == second) return;  // one length, or for the compiler to refuse
    if (lengths[0] == lengths[1]) {
      e->SetAttribute("springlength", lengths[0]);
      return;
    }
    Note(e, "springlength", "2nd", lost);
    e->DeleteAttribute("springlength");
    e->SetAttribute("stiffness", 0);
  }

  static std::string Described(const std::pair<std::string, std::string>& what, const Loss& loss) {
    const std::string name = what.second == "2nd" ? fmt::format("a second number of {}", what.first)
                                                  : NameOf(what.first, what.second);
    return fmt::format("{} ({}{}{})", name, loss.count, loss.names.empty() ? "" : ": ",
                       Joined(loss.names, kMostNames));
  }

  void LeaveOut(const std::pair<std::string, std::string>& what, const Loss& loss,
                const std::string& effect) {
    left_out.push_back({.kind = ModelCaveat::Kind::kLeftOut,
                        .text = fmt::format("{} is left out: {}", Described(what, loss), effect),
                        .source = what.first + (what.second.empty() ? "" : " ") + what.second});
    Add(Severity::kWarning, loss.line, left_out.back().text, "forces are computed without it");
  }

  bool DropWeightlessGeoms(const std::string& body);
  bool DropWord(const std::string& word, const std::string& tag);

  void MakeFoldersAbsolute() {
    std::error_code error;
    const std::string meshes = fs::absolute(MeshFolder(), error).lexically_normal().string();
    Compiler()->SetAttribute("meshdir", meshes.c_str());
  }
};

ForeignMjcf::ForeignMjcf(const std::string& text, const fs::path& file, Diagnostics* diagnostics)
    : impl_(std::make_unique<Impl>()) {
  impl_->file = file;
  impl_->folder = impl_->top = file.parent_path();
  impl_->diagnostics = diagnostics;
  impl_->Parse(text);
  if (ok()) impl_->TakeIncludes();
  if (ok()) impl_->AttachModels();
  if (ok()) impl_->DropModelAssets();
  if (ok()) impl_->SwitchOff();
  if (ok()) impl_->TranslateWords();
  if (ok()) impl_->WriteOutFrames();
  if (ok()) impl_->StatePrincipalAxes();
  if (ok()) impl_->DropPictures();
  if (ok()) impl_->LookUpAll();  // what only serves pictures needs no word
  if (ok()) impl_->CarryThrough();
  if (ok()) impl_->LetRangesHold();
  if (ok()) impl_->JoinFloatingBases();
  if (ok()) impl_->NameBodiesOfSites();
  if (ok()) impl_->MakeFoldersAbsolute();
}

ForeignMjcf::~ForeignMjcf() = default;

bool ForeignMjcf::ok() const { return impl_->good; }

bool ForeignMjcf::StateMeshMasses(const std::map<std::string, double>& volumes) {
  const char* exact = impl_->Compiler()->Attribute("exactmeshinertia");
  if (exact != nullptr && std::string_view(exact) == "true") return false;
  bool any = false;
  ForEach(impl_->root(), [&](XMLElement* e) {
    const auto* body = e->Parent()->ToElement();
    const bool in_body = body != nullptr && (IsTag(body, "body") || IsTag(body, "worldbody"));
    if (!in_body || !IsTag(e, "geom") || e->Attribute("mesh") == nullptr) return;
    const char* type = mjcf::Inherited(e, "type");
    const char* shell = mjcf::Inherited(e, "shellinertia");
    const bool solid = shell == nullptr || std::string_view(shell) != "true";
    const auto volume = volumes.find(e->Attribute("mesh"));
    if (volume == volumes.end() || mjcf::Inherited(e, "mass") != nullptr || !solid ||
        type == nullptr || std::string_view(type) != "mesh") {
      return;
    }
    const char* density = mjcf::Inherited(e, "density");
    const double mass =
        (density == nullptr ? 1000.0 : std::strtod(density, nullptr)) * volume->second;
    e->SetAttribute("mass", fmt::format("{}", mass).c_str());
    any = true;
  });
  return any;
}

std::string ForeignMjcf::Text() const {
  tinyxml2::XMLPrinter printer;
  impl_->document.Print(&printer);
  return printer.CStr();
}

const std::map<std::string, ForeignMesh>& ForeignMjcf::meshes() const { return impl_->meshes; }

std::string ForeignMjcf::ModelName() const {
  const char* name = impl_->root()->Attribute("model");
  return name == nullptr ? "" : name;
}

const std::vector<ModelCaveat>& ForeignMjcf::left_out() const { return impl_->left_out; }

bool ForeignMjcf::PlaceKeyframes(const std::vector<double>& reference,
                                 const std::map<std::string, int>& address) {
  // Where an attached model is replicated, its keyframes are about none of the copies.
  std::erase_if(impl_->attached_keys, [&](const AttachedKey& key) {
    return std::ranges::none_of(key.qpos,
                                [&](const auto& of) { return address.contains(of.first); });
  });
  if (impl_->attached_keys.empty()) return false;
  XMLDocument& document = impl_->document;
  XMLElement* section = document.NewElement("keyframe");
  impl_->root()->InsertEndChild(section);
  for (const AttachedKey& key : impl_->attached_keys) {
    std::vector<double> qpos = reference;
    for (const auto& [joint, values] : key.qpos) {
      const auto at = address.find(joint);
      if (at != address.end()) std::ranges::copy(values, qpos.begin() + at->second);
    }
    XMLElement* e = document.NewElement("key");
    e->SetAttribute("name", key.name.c_str());
    e->SetAttribute("qpos", fmt::format("{}", fmt::join(qpos, " ")).c_str());
    section->InsertEndChild(e);
  }
  impl_->attached_keys.clear();
  return true;
}

const std::map<std::string, SitePair>& ForeignMjcf::closures_by_sites() const {
  return impl_->by_sites;
}

namespace {

// What MuJoCo's compiler refuses.
struct Refused {
  enum class Kind { kOther, kWeightlessBody, kUnknownAttribute, kUnknownElement, kUnknownWord };
  Kind kind = Kind::kOther;
  std::string name = {};     // of the body or the attribute, or the word that is its value
  std::string element = {};  // with the unknown attribute, or unknown itself
};

// What stands between two marks of a message, beyond a text that must come before them.
std::optional<std::string> TextBetween(const std::string& message, const std::string& beyond,
                                       const std::string& open, const std::string& close) {
  const size_t mark = message.find(open, message.find(beyond));
  if (mark == std::string::npos) return {};
  const size_t from = mark + open.size(), to = message.find(close, from);
  if (to == std::string::npos) return {};
  return message.substr(from, to - from);
}

// The only place that reads a message: MuJoCo reports refusals as text alone.
Refused ReadRefusal(const std::string& message) {
  if (auto body = TextBetween(message, "body mass is too small", "Object name = ", ",")) {
    return {.kind = Refused::Kind::kWeightlessBody, .name = *std::move(body)};
  }
  auto element = TextBetween(message, "", "Element '", "'");
  if (!element) return {};
  if (auto attribute = TextBetween(message, "", "unrecognized attribute: '", "'")) {
    return {Refused::Kind::kUnknownAttribute, *std::move(attribute), *std::move(element)};
  }
  if (auto word = TextBetween(message, "", "invalid keyword: '", "'")) {
    return {Refused::Kind::kUnknownWord, *std::move(word), *std::move(element)};
  }
  if (message.find("unrecognized element") == std::string::npos) return {};
  return {.kind = Refused::Kind::kUnknownElement, .element = *std::move(element)};
}

}  // namespace

// MuJoCo 2.2 wants mass of every geom of a body that does not state its own.
bool ForeignMjcf::Impl::DropWeightlessGeoms(const std::string& body) {
  std::vector<XMLElement*> geoms;
  int line = 0;
  ForEach(root(), [&](XMLElement* e) {
    if (!IsTag(e, "body") || e->Attribute("name") == nullptr || body != e->Attribute("name")) {
      return;
    }
    line = e->GetLineNum();
    for (XMLElement* g = e->FirstChildElement("geom"); g != nullptr;
         g = g->NextSiblingElement("geom")) {
      geoms.push_back(g);
    }
  });
  for (XMLElement* geom : geoms) document.DeleteNode(geom);
  if (geoms.empty()) return false;
  Add(Severity::kWarning, line,
      fmt::format("body '{}' has no mass: its {} geoms are left out", body, geoms.size()));
  return true;
}

// A value that is newer than this compiler, of an attribute on which no force depends.
bool ForeignMjcf::Impl::DropWord(const std::string& word, const std::string& tag) {
  std::string of;
  int line = 0;
  ForEach(root(), [&](XMLElement* e) {
    if (!IsTag(e, tag.c_str())) return;
    std::string found;
    for (const auto* a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
      const ForeignRow* row = FindForeignRow(ElementOf(e), a->Name());
      const bool harmless = row != nullptr && row->fate == Fate::kNoForce;
      if (harmless && std::string_view(a->Value()) == word) found = a->Name();
    }
    if (found.empty()) return;
    if (of.empty()) line = e->GetLineNum();
    of = found;
    e->DeleteAttribute(found.c_str());
  });
  if (of.empty()) return false;
  Add(Severity::kWarning, line,
      fmt::format("{} '{}' of <{}> is unknown to MuJoCo 2.2 and left out; no force depends on it",
                  of, word, tag));
  return true;
}

bool ForeignMjcf::DropWhatIsUnknown(const std::string& message) {
  const Refused refused = ReadRefusal(message);
  const std::string &name = refused.name, &tag = refused.element;
  if (refused.kind == Refused::Kind::kOther) return false;
  if (refused.kind == Refused::Kind::kWeightlessBody) return impl_->DropWeightlessGeoms(name);
  if (refused.kind == Refused::Kind::kUnknownWord) return impl_->DropWord(name, tag);
  if (refused.kind == Refused::Kind::kUnknownAttribute) {
    int count = 0, line = 0;
    bool forceless = true;
    ForEach(impl_->root(), [&](XMLElement* e) {
      if (!IsTag(e, tag.c_str()) || e->Attribute(name.c_str()) == nullptr) return;
      if (count++ == 0) line = e->GetLineNum();
      const ForeignRow* row = FindForeignRow(ElementOf(e), name);
      forceless = forceless && row != nullptr && row->fate == Fate::kNoForce;
      e->DeleteAttribute(name.c_str());
    });
    if (count == 0) return false;
    if (!forceless) return true;  // a finding already, or neutral
    impl_->Add(Severity::kWarning, line,
               fmt::format("attribute '{}' of <{}> ({} times) is unknown to MuJoCo 2.2 and left "
                           "out; no force depends on it",
                           name, tag, count));
    return true;
  }
  std::vector<XMLElement*> dropped;
  ForEach(impl_->root(), [&](XMLElement* e) {
    if (IsTag(e, tag.c_str())) dropped.push_back(e);
  });
  if (dropped.empty()) return false;
  const std::string element = ElementOf(dropped.front());
  const ForeignRow* row = FindForeignRow(element, "");
  const bool is_finding = !IsForeignElement(element) ||
                          (row != nullptr && row->fate == Fate::kLeftOut && !row->compiled);
  if (!is_finding) {
    impl_->Add(
        Severity::kWarning, dropped.front()->GetLineNum(),
        fmt::format("element <{}> ({} times) is unknown to MuJoCo 2.2 and left out; no force "
                    "depends on it",
                    tag, dropped.size()));
  }
  // One at a time: an element may lie inside another of its kind.
  for (XMLElement* next = dropped.front(); next != nullptr;) {
    impl_->document.DeleteNode(next);
    next = nullptr;
    ForEach(impl_->root(), [&](XMLElement* e) {
      if (next == nullptr && IsTag(e, tag.c_str()) && ElementOf(e) == element) next = e;
    });
  }
  return true;
}

std::string WithLines(const std::string& text, const std::string& lines) {
  std::string with = text;
  return with.insert(std::min(with.rfind("</mujoco"), with.size()), lines);
}

std::string WithClosureSettings(const std::string& text, const std::string& solref,
                                const std::string& solimp) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return text;
  }
  for (auto* section = document.RootElement()->FirstChildElement("equality"); section != nullptr;
       section = section->NextSiblingElement("equality")) {
    for (auto* e = section->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view tag = e->Name();
      if (tag != "connect" && tag != "weld") continue;
      if (!solref.empty()) e->SetAttribute("solref", solref.c_str());
      if (!solimp.empty()) e->SetAttribute("solimp", solimp.c_str());
    }
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

std::map<std::string, double> ServoDampings(const std::string& text) {
  std::map<std::string, double> dampings;
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS ||
      document.RootElement() == nullptr) {
    return dampings;
  }
  for (auto* section = document.RootElement()->FirstChildElement("actuator"); section != nullptr;
       section = section->NextSiblingElement("actuator")) {
    for (auto* e = section->FirstChildElement("position"); e != nullptr;
         e = e->NextSiblingElement("position")) {
      const char* name = e->Attribute("name");
      if (name == nullptr) name = e->Attribute("joint");
      const double kv = e->DoubleAttribute("kv");
      if (name != nullptr && kv > 0.0) dampings[name] = kv;
    }
  }
  return dampings;
}

}  // namespace mbv::mjcf
