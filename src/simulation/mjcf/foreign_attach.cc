#include "simulation/mjcf/foreign_frames.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <numbers>
#include <set>
#include <string_view>

#include "base/diagnostics.h"
#include "simulation/mjcf/foreign_rows.h"

namespace mbv::mjcf {
namespace {

using tinyxml2::XMLDocument;
using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

std::string Text(const char* text) { return text == nullptr ? "" : text; }

// The kinds of things that elements refer to, and by which attributes.
struct Reference {
  const char* attribute;
  const char* tag;  // of what is meant
};
constexpr Reference kReferences[] = {
    {"joint", "joint"},     {"jointinparent", "joint"}, {"joint1", "joint"},
    {"joint2", "joint"},    {"body", "body"},           {"body1", "body"},
    {"body2", "body"},      {"target", "body"},         {"site", "site"},
    {"site1", "site"},      {"site2", "site"},          {"refsite", "site"},
    {"slidersite", "site"}, {"cranksite", "site"},      {"sidesite", "site"},
    {"geom", "geom"},       {"geom1", "geom"},          {"geom2", "geom"},
    {"tendon", "tendon"},   {"tendon1", "tendon"},      {"tendon2", "tendon"},
    {"mesh", "mesh"},       {"hfield", "hfield"},       {"material", "material"},
};
constexpr const char* kHint =
    "write the model out with a current MuJoCo (mj_saveLastXML) and import that";

const char* KindOf(const XMLElement* e) {
  const auto* parent = e->Parent()->ToElement();
  if (parent != nullptr && IsTag(parent, "tendon")) return "tendon";
  return IsTag(e, "freejoint") ? "joint" : e->Name();
}

// Takes a class, by itself.
bool HasClass(const XMLElement* e) {
  const auto* parent = e->Parent()->ToElement();
  const std::string element = ForeignElement(parent == nullptr ? "" : parent->Name(), e->Name());
  const ForeignRow* row = FindForeignRow(element, "class");
  return row != nullptr && std::string_view(row->attributes) != "*" && !IsTag(e, "default");
}

}  // namespace

void NameMainDefault(const std::string& main, XMLDocument* document) {
  XMLElement* root = document->RootElement();
  XMLElement* all = document->NewElement("default");
  all->SetAttribute("class", main.c_str());
  std::vector<XMLElement*> sections;
  std::set<std::string> former{"main"};
  for (XMLElement* section = root->FirstChildElement("default"); section != nullptr;
       section = section->NextSiblingElement("default")) {
    sections.push_back(section);
    if (section->Attribute("class") != nullptr) former.insert(section->Attribute("class"));
    while (XMLNode* row = section->FirstChild()) all->InsertEndChild(row);
  }
  for (XMLElement* section : sections) document->DeleteNode(section);
  XMLElement* outer = document->NewElement("default");
  root->InsertFirstChild(outer);
  outer->InsertEndChild(all);
  ForEach(root, [&](XMLElement* e) {
    for (const char* attribute : {"class", "childclass"}) {
      const char* name = IsTag(e, "default") ? nullptr : e->Attribute(attribute);
      if (name != nullptr && former.contains(name)) e->SetAttribute(attribute, main.c_str());
    }
    const auto* parent = e->Parent()->ToElement();
    if (IsTag(parent, "worldbody")) {
      const bool of_tree = IsTag(e, "body") || IsTag(e, "frame") || IsTag(e, "replicate");
      const char* attribute = of_tree ? "childclass" : "class";
      if ((of_tree || HasClass(e)) && e->Attribute(attribute) == nullptr) {
        e->SetAttribute(attribute, main.c_str());
      }
    } else if (parent->Parent() == root && !IsTag(parent, "default") && HasClass(e) &&
               e->Attribute("class") == nullptr) {
      e->SetAttribute("class", main.c_str());
    }
  });
}

namespace {

class Grafter {
 public:
  Grafter(XMLElement* attach, const std::filesystem::path& folder, std::vector<AttachedKey> keys,
          bool is_own, XMLDocument* model)
      : attach_(attach),
        into_(*attach->GetDocument()),
        model_(*model),
        folder_(folder),
        is_own_(is_own),
        keys_(std::move(keys)),
        prefix_(Text(attach->Attribute("prefix"))) {}

  Attachment Run() {
    if (!is_own_) {
      CompareCompilers();
      CompareOptions();
      NameMainDefault("main of " + Text(attach_->Attribute("model")), &model_);
      ReadKeys();
    }
    Select();
    if (!good()) return std::move(result_);
    const FrameTrouble trouble = DissolveFrames(AngleUnit(into_.RootElement()), &model_);
    if (!trouble.text.empty()) {
      result_.trouble = trouble;
      result_.in_model = true;
      return std::move(result_);
    }
    if (!is_own_) FindMeshFiles();
    DropWhatRefersElsewhere();
    TakePrefix();
    Move();
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool good() const { return result_.trouble.text.empty(); }
  XMLElement* root() { return model_.RootElement(); }

  void Fail(const std::string& text, const std::string& hint) {
    if (good()) result_.trouble = {attach_->GetLineNum(), text, hint};
  }

  static std::string Setting(XMLElement* root, const char* section, const char* attribute,
                             const char* fallback) {
    std::string value = fallback;
    for (XMLElement* e = root->FirstChildElement(section); e != nullptr;
         e = e->NextSiblingElement(section)) {
      if (e->Attribute(attribute) != nullptr) value = e->Attribute(attribute);
    }
    return value;
  }

  // What MuJoCo 3 compiles the model's bodies by, and 2.2 knows of the whole only.
  void CompareCompilers() {
    constexpr std::pair<const char*, const char*> kSettings[] = {{"boundmass", "0"},
                                                                 {"boundinertia", "0"},
                                                                 {"balanceinertia", "false"},
                                                                 {"inertiafromgeom", "auto"},
                                                                 {"inertiagrouprange", "0 5"},
                                                                 {"fitaabb", "false"},
                                                                 {"exactmeshinertia", "false"},
                                                                 {"coordinate", "local"}};
    for (const auto& [attribute, fallback] : kSettings) {
      const std::string own = Setting(root(), "compiler", attribute, fallback);
      const std::string whole = Setting(into_.RootElement(), "compiler", attribute, fallback);
      if (own == whole) continue;
      Fail(fmt::format("the attached model is compiled with {} = '{}', the model with '{}'",
                       attribute, own, whole),
           fmt::format("state the same in both, or {}", kHint));
    }
    // Every range of a file of MuJoCo 3 holds, unless it says otherwise itself.
    XMLElement* compiler = into_.RootElement()->FirstChildElement("compiler");
    for (; compiler != nullptr; compiler = compiler->NextSiblingElement("compiler")) {
      if (compiler->Attribute("autolimits")) compiler->SetAttribute("autolimits", "true");
    }
  }

  // <option> is the whole's; what the model states otherwise is reported, or taken where the
  // whole says nothing and merges. [MuJoCo, model editing, attribute merging]
  void CompareOptions() {
    const std::string conflict = Setting(into_.RootElement(), "compiler", "conflict", "warning");
    for (const char* name : {"gravity", "wind", "density", "viscosity"}) {
      Compare("option", conflict, name, root()->FirstChildElement("option"));
    }
    for (XMLElement* option = root()->FirstChildElement("option"); option != nullptr;
         option = option->NextSiblingElement("option")) {
      XMLElement* flag = option->FirstChildElement("flag");
      if (flag == nullptr) continue;
      for (const auto* a = flag->FirstAttribute(); a != nullptr; a = a->Next()) {
        if (std::string_view(a->Value()) == "disable") Compare("flag", conflict, a->Name(), flag);
      }
    }
  }

  void Compare(const std::string& tag, const std::string& conflict, const char* name,
               const XMLElement* of_model) {
    const char* own = of_model == nullptr ? nullptr : of_model->Attribute(name);
    if (own == nullptr) return;
    XMLElement* top = into_.RootElement();
    XMLElement *option = top->FirstChildElement("option"), *place = option;
    if (option != nullptr && tag == "flag") place = option->FirstChildElement("flag");
    const char* whole = place == nullptr ? nullptr : place->Attribute(name);
    if (whole != nullptr && std::string_view(own) == whole) return;
    const bool unites = tag == "flag";  // flags of both are switched off
    if (conflict == "merge" && (whole == nullptr || unites)) {
      if (option == nullptr) {
        option = into_.NewElement("option");
        top->InsertFirstChild(option);
      }
      if (place == nullptr) place = option;
      if (unites && place == option) {
        place = into_.NewElement("flag");
        option->InsertEndChild(place);
      }
      place->SetAttribute(name, own);
    } else if (whole != nullptr && conflict != "warning") {
      Fail(fmt::format("the attached model states {} = '{}', the model '{}' (conflict = '{}')",
                       name, own, whole, conflict),
           "state the same in both");
    } else {
      result_.remarks.push_back(fmt::format(
          "{} = '{}' of the attached model is not taken: options are those of the model", name,
          own));
    }
  }

  // Joints of the model in MuJoCo's order, with their number of coordinates.
  static std::vector<std::pair<std::string, size_t>> JointsOf(XMLDocument* model) {
    std::vector<std::pair<std::string, size_t>> joints;
    const auto visit = [&](const auto& self, XMLElement* body) -> void {
      for (XMLElement* e = body->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
        if (!IsTag(e, "joint") && !IsTag(e, "freejoint")) continue;
        const char* type = IsTag(e, "freejoint") ? "free" : Inherited(e, "type");
        const std::string_view kind = type == nullptr ? "hinge" : type;
        joints.emplace_back(e->Attribute("name"), kind == "free" ? 7 : kind == "ball" ? 4 : 1);
      }
      for (XMLElement* e = body->FirstChildElement("body"); e != nullptr;
           e = e->NextSiblingElement("body")) {
        self(self, e);
      }
    };
    for (XMLElement* world = model->RootElement()->FirstChildElement("worldbody"); world != nullptr;
         world = world->NextSiblingElement("worldbody")) {
      visit(visit, world);
    }
    return joints;
  }

  // Keyframes, by joints: which of them are attached is decided later.
  void ReadKeys() {
    std::vector<XMLElement*> keys;
    ForEach(root(), [&](XMLElement* e) {
      if (IsTag(e, "key") && e->Attribute("qpos") != nullptr) keys.push_back(e);
    });
    if (keys.empty()) return;
    NameJoints();
    XMLDocument flat;
    model_.DeepCopy(&flat);
    if (!DissolveFrames(&flat).text.empty()) return;  // reported for the model itself
    const auto joints = JointsOf(&flat);
    size_t count = 0;
    for (const auto& [name, size] : joints) count += size;
    for (const XMLElement* key : keys) {
      std::vector<double> numbers;
      const char* at = key->Attribute("qpos");
      for (char* end = nullptr;; at = end) {
        const double x = std::strtod(at, &end);
        if (end == at) break;
        numbers.push_back(x);
      }
      if (numbers.size() != count) {
        result_.trouble = {key->GetLineNum(),
                           fmt::format("keyframe '{}' has {} numbers in qpos, the model {}",
                                       Text(key->Attribute("name")), numbers.size(), count),
                           ""};
        result_.in_model = true;
        return;
      }
      AttachedKey taken{.name = Text(key->Attribute("name")), .qpos = {}};
      auto next = numbers.begin();
      for (const auto& [name, size] : joints) {
        taken.qpos[name].assign(next, next + static_cast<std::ptrdiff_t>(size));
        next += static_cast<std::ptrdiff_t>(size);
      }
      keys_.push_back(std::move(taken));
    }
  }

  // Names that nothing in either document has, with or without the numbers of replicas behind them:
  // these follow a '_', so that joint1_ and its replicas are none of joint10_.
  void NameJoints() {
    std::vector<XMLElement*> unnamed;
    std::vector<std::string> taken;
    ForEach(root(), [&](XMLElement* e) {
      if ((!IsTag(e, "joint") && !IsTag(e, "freejoint")) || !HasName(e)) return;
      if (e->Attribute("name") == nullptr) {
        unnamed.push_back(e);
      } else {
        taken.push_back(prefix_ + e->Attribute("name"));
      }
    });
    ForEach(into_.RootElement(), [&](XMLElement* e) {
      const bool joint = IsTag(e, "joint") || IsTag(e, "freejoint");
      if (joint && e->Attribute("name") != nullptr) taken.emplace_back(e->Attribute("name"));
    });
    int next = 0;
    for (XMLElement* e : unnamed) {
      std::string name;
      const auto clashes = [&](const std::string& other) {
        return other.starts_with(prefix_ + name) || (prefix_ + name).starts_with(other);
      };
      do {
        name = fmt::format("joint{}_", next++);
      } while (std::ranges::any_of(taken, clashes));
      taken.push_back(prefix_ + name);
      e->SetAttribute("name", name.c_str());
    }
  }

  // Joints of bodies, not those of tendons and defaults.
  static bool HasName(const XMLElement* e) {
    const auto* parent = e->Parent()->ToElement();
    return parent != nullptr && (IsTag(parent, "body") || IsTag(parent, "worldbody") ||
                                 IsTag(parent, "frame") || IsTag(parent, "replicate"));
  }

  // Leaves of the model's tree what is attached, in <worldbody>.
  void Select() {
    const char *body = attach_->Attribute("body"), *frame = attach_->Attribute("frame");
    if (attach_->Attribute("prefix") == nullptr) {
      Fail("<attach> has no prefix", "names of what is attached begin with it; it may be empty");
    }
    if (body != nullptr && frame != nullptr) {
      Fail("<attach> names both a body and a frame",
           "one of them is attached, with all it carries");
    }
    if (is_own_ && body == nullptr && frame == nullptr) {
      Fail("<attach> without a model names neither body nor frame", "");
    }
    if (!good()) return;
    XMLElement* world = model_.NewElement("worldbody");
    if (body == nullptr && frame == nullptr) {
      for (XMLElement* e = root()->FirstChildElement("worldbody"); e != nullptr;
           e = e->NextSiblingElement("worldbody")) {
        while (XMLElement* each = e->FirstChildElement()) world->InsertEndChild(each);
      }
    } else {
      XMLElement* chosen = Find(body != nullptr ? "body" : "frame", body != nullptr ? body : frame);
      if (chosen == nullptr) return model_.DeleteNode(world);
      // The class of the bodies around it holds for it.
      for (const XMLElement* up = chosen;
           up != nullptr && chosen->Attribute("childclass") == nullptr;
           up = up->Parent()->ToElement()) {
        if (const char* name = up->Attribute("childclass"))
          chosen->SetAttribute("childclass", name);
      }
      world->InsertEndChild(chosen);
    }
    std::vector<XMLElement*> former;
    for (XMLElement* e = root()->FirstChildElement("worldbody"); e != nullptr;
         e = e->NextSiblingElement("worldbody")) {
      former.push_back(e);
    }
    for (XMLElement* e : former) model_.DeleteNode(e);
    root()->InsertEndChild(world);
  }

  XMLElement* Find(const char* tag, const char* name) {
    XMLElement* found = nullptr;
    std::vector<std::string> names;
    ForEach(root(), [&](XMLElement* e) {
      if (!IsTag(e, tag) || !HasName(e) || e->Attribute("name") == nullptr) return;
      names.emplace_back(e->Attribute("name"));
      if (names.back() == name) found = e;
    });
    if (found == nullptr) {
      const std::string hint = DidYouMean(name, names);
      Fail(fmt::format("<attach> {} '{}': {} has no such {}", tag, name,
                       is_own_ ? "the model" : "the attached model", tag),
           hint);
    }
    return found;
  }

  // Files of meshes count from the model's own folder; they name what has no name.
  void FindMeshFiles() {
    std::string meshes = Setting(root(), "compiler", "assetdir", "");
    meshes = Setting(root(), "compiler", "meshdir", meshes.c_str());
    const bool stripped = Setting(root(), "compiler", "strippath", "false") == "true";
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      const char* file = e->Attribute("file");
      if (file == nullptr || parent == nullptr || !IsTag(parent, "asset")) return;
      const std::filesystem::path path = file;
      if (e->Attribute("name") == nullptr) e->SetAttribute("name", path.stem().string().c_str());
      std::error_code error;
      const auto whole =
          std::filesystem::absolute(folder_ / meshes / (stripped ? path.filename() : path), error);
      e->SetAttribute("file", whole.lexically_normal().string().c_str());
    });
  }

  // Names of what there is, by kind.
  std::set<std::pair<std::string, std::string>> Names() {
    std::set<std::pair<std::string, std::string>> names;
    ForEach(root(), [&](XMLElement* e) {
      if (e->Attribute("name") != nullptr) names.emplace(KindOf(e), e->Attribute("name"));
    });
    return names;
  }

  // As in MuJoCo, what refers to something that is not attached is not, either.
  void DropWhatRefersElsewhere() {
    for (const char* section : {"tendon", "contact", "equality", "actuator"}) {
      const auto names = Names();
      std::vector<XMLElement*> others;
      for (XMLElement* s = root()->FirstChildElement(section); s != nullptr;
           s = s->NextSiblingElement(section)) {
        for (XMLElement* e = s->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
          bool elsewhere = RefersElsewhere(names, e);
          ForEach(e, [&](XMLElement* in) { elsewhere = elsewhere || RefersElsewhere(names, in); });
          if (elsewhere) others.push_back(e);
        }
      }
      for (XMLElement* e : others) {
        if (std::string_view(section) != "contact" && !is_own_) {
          result_.remarks.push_back(fmt::format(
              "<{}>{} is not attached, as in MuJoCo: it refers to what is not", e->Name(),
              e->Attribute("name") == nullptr ? "" : fmt::format(" '{}'", e->Attribute("name"))));
        }
        model_.DeleteNode(e);
      }
    }
  }

  static bool RefersElsewhere(const std::set<std::pair<std::string, std::string>>& names,
                              const XMLElement* e) {
    return std::ranges::any_of(kReferences, [&](const Reference& reference) {
      const char* to = e->Attribute(reference.attribute);
      return to != nullptr && !names.contains({reference.tag, to});
    });
  }

  void TakePrefix() {
    constexpr std::array<std::string_view, 3> kOfAssets = {"mesh", "hfield", "material"};
    ForEach(root(), [&](XMLElement* e) {
      const auto add = [&](const char* attribute) {
        if (const char* name = e->Attribute(attribute)) {
          e->SetAttribute(attribute, (prefix_ + name).c_str());
        }
      };
      add("name");
      for (const Reference& reference : kReferences) {
        const bool of_asset = std::ranges::find(kOfAssets, reference.tag) != kOfAssets.end();
        if (!(is_own_ && of_asset)) add(reference.attribute);
      }
      if (is_own_) return;
      add("class");
      add("childclass");
    });
    for (AttachedKey& key : keys_) {
      AttachedKey named{.name = prefix_ + key.name, .qpos = {}};
      for (const auto& [joint, values] : key.qpos) named.qpos[prefix_ + joint] = values;
      result_.keys.push_back(std::move(named));
    }
  }

  XMLElement* Section(const char* name) {
    XMLElement* section = into_.RootElement()->FirstChildElement(name);
    if (section == nullptr) {
      section = into_.NewElement(name);
      into_.RootElement()->InsertEndChild(section);
    }
    return section;
  }

  // Classes of both models may share names: MuJoCo 3 lets each keep its own.
  void NameClassesApart(const std::set<std::string>& known) {
    const XMLElement* all = root()->FirstChildElement("default")->FirstChildElement("default");
    const std::string main = Text(all->Attribute("class"));
    const bool again = known.contains(main);  // the same model once more under the same prefix
    std::map<std::string, std::string> names;
    ForEach(root(), [&](XMLElement* e) {
      if (!IsTag(e, "default") || e->Attribute("class") == nullptr || e == all) return;
      const std::string own = e->Attribute("class"), apart = own + " of " + main;
      if (known.contains(again ? apart : own)) names[own] = apart;
    });
    ForEach(root(), [&](XMLElement* e) {
      for (const char* attribute : {"class", "childclass"}) {
        const auto found = names.find(Text(e->Attribute(attribute)));
        if (found != names.end()) e->SetAttribute(attribute, found->second.c_str());
      }
    });
  }

  void Move() {
    std::set<std::string> classes;
    ForEach(into_.RootElement(), [&](XMLElement* e) {
      if (IsTag(e, "default") && e->Attribute("class")) classes.insert(e->Attribute("class"));
    });
    if (!is_own_) NameClassesApart(classes);
    for (const char* name : {"default", "asset", "tendon", "contact", "equality", "actuator"}) {
      const std::string_view section = name;
      if (is_own_ && (section == "default" || section == "asset")) continue;
      for (const XMLElement* s = root()->FirstChildElement(name); s != nullptr;
           s = s->NextSiblingElement(name)) {
        for (const XMLElement* e = s->FirstChildElement(); e != nullptr;
             e = e->NextSiblingElement()) {
          // The same model once more under the same prefix.
          if (section == "default" && classes.contains(Text(e->Attribute("class")))) continue;
          if (section == "asset" && (IsTag(e, "model") || IsThere(e))) continue;
          Section(name)->InsertEndChild(e->DeepClone(&into_));
        }
      }
    }
    XMLNode *parent = attach_->Parent(), *last = attach_;
    const XMLElement* world = root()->FirstChildElement("worldbody");
    for (const XMLElement* e = world->FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement()) {
      last = parent->InsertAfterChild(last, e->DeepClone(&into_));
    }
    into_.DeleteNode(attach_);
  }

  bool IsThere(const XMLElement* asset) {
    const std::string name = Text(asset->Attribute("name"));
    for (const XMLElement* e = Section("asset")->FirstChildElement(asset->Name()); e != nullptr;
         e = e->NextSiblingElement(asset->Name())) {
      if (Text(e->Attribute("name")) == name) return true;
    }
    return false;
  }

  XMLElement* attach_;
  XMLDocument &into_, &model_;
  const std::filesystem::path& folder_;
  bool is_own_;
  std::vector<AttachedKey> keys_;
  std::string prefix_;
  Attachment result_;
};

}  // namespace

Attachment Attach(XMLElement* attach, const std::filesystem::path& folder,
                  std::vector<AttachedKey> keys, bool is_own, XMLDocument* model) {
  return Grafter(attach, folder, std::move(keys), is_own, model).Run();
}

}  // namespace mbv::mjcf
