#include "mjcf/foreign.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <map>
#include <optional>
#include <set>
#include <vector>

#include "core/files.h"
#include "mjcf/foreign_meshes.h"
#include "mjcf/xml_walk.h"

namespace mbv::mjcf {
namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;

constexpr int kDeepest = 200;  // nesting of elements

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
  Diagnostics* diagnostics = nullptr;
  std::map<std::string, SitePair> by_sites;
  std::map<std::string, ForeignMesh> meshes;
  bool good = false;

  void Add(Severity severity, int line, const std::string& text, const std::string& hint = "") {
    diagnostics->Add({severity, file.string(), line, line > 0 ? 1 : 0, text, hint});
    if (severity == Severity::kError) good = false;
  }

  XMLElement* root() { return document.RootElement(); }

  // The path of a file that the model names, if it lies below the model's folder.
  [[nodiscard]] bool IsBelow(const fs::path& path) const {
    std::error_code error;
    const fs::path base = fs::weakly_canonical(folder, error);
    const fs::path inside = fs::weakly_canonical(path, error).lexically_relative(base);
    return !error && !inside.empty() && *inside.begin() != "..";
  }

  void Parse(const std::string& text) {
    good = true;
    if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
      Add(Severity::kError, document.ErrorLineNum(),
          fmt::format("no XML: {}", document.ErrorName()));
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
    const auto text = IsBelow(path) ? ReadWholeFile(path) : std::nullopt;
    XMLDocument other;
    if (!text || other.Parse(text->c_str(), text->size()) != tinyxml2::XML_SUCCESS ||
        other.RootElement() == nullptr || DepthOf(other.RootElement()) > kDeepest) {
      Add(Severity::kError, include->GetLineNum(),
          fmt::format("include '{}' cannot be read", name == nullptr ? "" : name),
          "it must be an XML file in the model's folder or below");
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

  // What dynamics without contacts do not need.
  void DropPictures() {
    MeshGeoms geoms = TakeMeshGeoms(
        MeshFolder(), [this](const fs::path& path) { return IsBelow(path); }, &document);
    meshes = std::move(geoms.meshes);
    if (geoms.lost > 0) {
      Add(Severity::kWarning, 0, fmt::format("{} meshes are left out of the pictures", geoms.lost),
          "meshes of files in the model's folder or below are drawn");
    }
    std::vector<XMLElement*> others;
    ForEach(root(), [&](XMLElement* e) {
      for (const char* attribute : {"material", "texture"}) e->DeleteAttribute(attribute);
      const bool in_assets = e->Parent() != nullptr && e->Parent()->ToElement() != nullptr &&
                             IsTag(e->Parent()->ToElement(), "asset");
      if (in_assets && (IsTag(e, "texture") || IsTag(e, "material") || IsTag(e, "skin"))) {
        others.push_back(e);
      }
      if (e->Parent() != root()) return;
      for (const char* section : {"visual", "sensor", "contact"}) {
        if (IsTag(e, section)) others.push_back(e);
      }
    });
    for (XMLElement* e : others) document.DeleteNode(e);
    DropUnusedMeshes();
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
      } else if (from != nullptr && !IsBelow(MeshFolder() / from)) {
        Add(Severity::kError, e->GetLineNum(),
            fmt::format("mesh '{}' lies outside the model's folder", from));
      }
    });
    for (XMLElement* e : unused) document.DeleteNode(e);
  }

  XMLElement* Compiler() {
    XMLElement* compiler = root()->FirstChildElement("compiler");
    if (compiler == nullptr) {
      compiler = document.NewElement("compiler");
      root()->InsertFirstChild(compiler);
    }
    return compiler;
  }

  // Since MuJoCo 3.0 a range holds unless the file says otherwise.
  void LetRangesHold() {
    int open = 0, line = 0;
    ForEach(root(), [&](XMLElement* e) {
      if (e->Attribute("range") == nullptr || e->Attribute("limited") != nullptr) return;
      if (open++ == 0) line = e->GetLineNum();
    });
    bool stated = false;
    for (XMLElement* e = root()->FirstChildElement("compiler"); e != nullptr;
         e = e->NextSiblingElement("compiler")) {
      stated = stated || e->Attribute("autolimits") != nullptr;
    }
    if (stated || open == 0) return;
    Compiler()->SetAttribute("autolimits", "true");
    Add(Severity::kWarning, line,
        fmt::format("{} range{} without `limited` hold{}, as since MuJoCo 3", open,
                    open == 1 ? "" : "s", open == 1 ? "s" : ""),
        "<compiler autolimits=\"false\"/> if they should not");
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
    return meshes == nullptr ? folder : folder / meshes;
  }

  bool DropWeightlessGeoms(const std::string& message);

  void MakeFoldersAbsolute() {
    std::error_code error;
    const std::string meshes = fs::absolute(MeshFolder(), error).lexically_normal().string();
    Compiler()->SetAttribute("meshdir", meshes.c_str());
  }
};

ForeignMjcf::ForeignMjcf(const std::string& text, const fs::path& file, Diagnostics* diagnostics)
    : impl_(std::make_unique<Impl>()) {
  impl_->file = file;
  impl_->folder = file.parent_path();
  impl_->diagnostics = diagnostics;
  impl_->Parse(text);
  if (ok()) impl_->TakeIncludes();
  if (ok()) impl_->DropPictures();
  if (ok()) impl_->LetRangesHold();
  if (ok()) impl_->NameBodiesOfSites();
  if (ok()) impl_->MakeFoldersAbsolute();
}

ForeignMjcf::~ForeignMjcf() = default;

bool ForeignMjcf::ok() const { return impl_->good; }

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

const std::map<std::string, SitePair>& ForeignMjcf::closures_by_sites() const {
  return impl_->by_sites;
}

namespace {

// What stands between two marks of a message, beyond a text that must come before them.
std::optional<std::string> TextBetween(const std::string& message, const std::string& beyond,
                                       const std::string& open, const std::string& close) {
  const size_t mark = message.find(open, message.find(beyond));
  if (mark == std::string::npos) return {};
  const size_t from = mark + open.size(), to = message.find(close, from);
  if (to == std::string::npos) return {};
  return message.substr(from, to - from);
}

}  // namespace

// MuJoCo 2.2 wants mass of every geom of a body that does not state its own.
bool ForeignMjcf::Impl::DropWeightlessGeoms(const std::string& message) {
  const auto name = TextBetween(message, "body mass is too small", "Object name = ", ",");
  if (!name) return false;
  std::vector<XMLElement*> geoms;
  int line = 0;
  ForEach(root(), [&](XMLElement* e) {
    if (!IsTag(e, "body") || e->Attribute("name") == nullptr || *name != e->Attribute("name")) {
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
      fmt::format("body '{}' has no mass: its {} geoms are left out", *name, geoms.size()));
  return true;
}

bool ForeignMjcf::DropWhatIsUnknown(const std::string& message) {
  if (impl_->DropWeightlessGeoms(message)) return true;
  const auto tag = TextBetween(message, "", "Element '", "'");
  if (!tag) return false;
  if (const auto name = TextBetween(message, "", "unrecognized attribute: '", "'")) {
    int count = 0, line = 0;
    ForEach(impl_->root(), [&](XMLElement* e) {
      if (!IsTag(e, tag->c_str()) || e->Attribute(name->c_str()) == nullptr) return;
      if (count++ == 0) line = e->GetLineNum();
      e->DeleteAttribute(name->c_str());
    });
    if (count == 0) return false;
    impl_->Add(
        Severity::kWarning, line,
        fmt::format("attribute '{}' of <{}> ({} times) is unknown to MuJoCo 2.2 and left out",
                    *name, *tag, count));
    return true;
  }
  if (message.find("unrecognized element") == std::string::npos) return false;
  std::vector<XMLElement*> dropped;
  ForEach(impl_->root(), [&](XMLElement* e) {
    if (IsTag(e, tag->c_str())) dropped.push_back(e);
  });
  if (dropped.empty()) return false;
  impl_->Add(Severity::kWarning, dropped.front()->GetLineNum(),
             fmt::format("element <{}> ({} times) is unknown to MuJoCo 2.2 and left out", *tag,
                         dropped.size()));
  // One at a time: an element may lie inside another of its kind.
  impl_->document.DeleteNode(dropped.front());
  return true;
}

}  // namespace mbv::mjcf
