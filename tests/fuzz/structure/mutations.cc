#include "tests/fuzz/structure/mutations.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "model_file/write_model.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv::fuzz {
namespace {

constexpr std::array kWords = {
    "",     "0",     "-0",   "-1",     "1e-300",    "1e300",     "1e9",  ".nan",     ".inf",
    "nan",  "null",  "true", "off",    "world",     "x",         "-z",   "a.b.c",    "../../x",
    "1/0",  "pi",    "home", "[",      "{}",        "Ä²→",       "1,5",  "sqrt(-1)", "1e-17",
    "0x10", "fixed", "free", "planar", "universal", "spherical", "none", "inverse"};

size_t Below(size_t n, Random* random) { return static_cast<size_t>((*random)() % n); }
std::string AWord(Random* random) { return kWords[Below(kWords.size(), random)]; }

// A number made larger, smaller, negative or slightly wrong; other text becomes another word.
std::string Scaled(const std::string& text, Random* random) {
  const auto number = PlainNumber(text);
  if (!number || Below(8, random) == 0) return AWord(random);
  constexpr std::array kFactors = {0.0,  -1.0, 1e-12, 1e-6, 1e-3, 0.5, 0.999,
                                   1.01, 2.0,  10.0,  1e3,  1e6,  1e12};
  return fmt::format("{:.17g}", *number * kFactors[Below(kFactors.size(), random)]);
}

// A YAML value that can be changed; lists are maps without keys.
struct Tree {
  YamlNode::Kind kind = YamlNode::Kind::kNull;
  std::string text;
  std::vector<std::pair<std::string, Tree>> children;
};

Tree ToTree(const YamlNode& node) {
  Tree tree{node.kind, node.text, {}};
  for (const YamlNodePtr& item : node.items) tree.children.emplace_back("", ToTree(*item));
  for (const YamlEntry& entry : node.entries) {
    tree.children.emplace_back(entry.key, ToTree(*entry.value));
  }
  return tree;
}

// Flow style: nothing depends on indents. One line per entry at the top, for messages.
void Write(const Tree& tree, int depth, std::string* text) {
  const bool map = tree.kind == YamlNode::Kind::kMap;
  switch (tree.kind) {
    case YamlNode::Kind::kNull:
      *text += "null";
      return;
    case YamlNode::Kind::kScalar:
      *text += QuotedYaml(tree.text);
      return;
    case YamlNode::Kind::kSequence:
    case YamlNode::Kind::kMap:
      break;
  }
  *text += map ? "{" : "[";
  for (size_t i = 0; i < tree.children.size(); ++i) {
    if (i > 0) *text += depth < 2 ? ",\n" : ", ";
    if (map) *text += QuotedYaml(tree.children[i].first) + ": ";
    Write(tree.children[i].second, depth + 1, text);
  }
  *text += map ? "}" : "]";
}

// Every child in the tree, with its parent.
struct Place {
  Tree* parent;
  size_t index;
  [[nodiscard]] Tree& tree() const { return parent->children[index].second; }
};
void Collect(Tree* tree, std::vector<Place>* places) {
  for (size_t i = 0; i < tree->children.size(); ++i) {
    places->push_back({tree, i});
    Collect(&tree->children[i].second, places);
  }
}

Tree Retyped(const Tree& tree, Random* random) {
  using Kind = YamlNode::Kind;
  switch (Below(5, random)) {
    case 0:
      return {Kind::kNull, "", {}};
    case 1:
      return {Kind::kScalar, AWord(random), {}};
    case 2:
      return {Kind::kSequence, "", {{"", tree}}};
    case 3:
      return {Kind::kMap, "", {{AWord(random), tree}}};
    default:
      return {tree.kind == Kind::kMap ? Kind::kSequence : Kind::kMap, "", tree.children};
  }
}

void ChangeOnce(Tree* root, Random* random) {
  std::vector<Place> places;
  Collect(root, &places);
  if (places.empty()) return;
  const Place at = places[Below(places.size(), random)],
              other = places[Below(places.size(), random)];
  auto& siblings = at.parent->children;
  const auto here = siblings.begin() + static_cast<std::ptrdiff_t>(at.index);
  switch (Below(8, random)) {
    case 0:
      siblings.erase(here);
      return;
    case 1: {
      auto copy = *here;
      if (Below(2, random) == 0) copy.first += "2";
      siblings.insert(here, std::move(copy));
      return;
    }
    case 2: {  // values, not keys; a value may land inside itself as a copy
      Tree mine = at.tree(), theirs = other.tree();
      at.tree() = std::move(theirs);
      std::vector<Place> now;
      Collect(root, &now);
      now[Below(now.size(), random)].tree() = std::move(mine);
      return;
    }
    case 3:
      at.tree() = Retyped(at.tree(), random);
      return;
    case 4:
      siblings[at.index].first =
          Below(2, random) == 0 && at.parent->kind == YamlNode::Kind::kMap
              ? places[Below(places.size(), random)].parent->children[0].first
              : AWord(random);
      return;
    case 5:
      std::reverse(siblings.begin(), siblings.end());
      return;
    default:
      break;
  }
  // Most values are numbers: the first scalar found from here on.
  for (size_t k = 0; k < places.size(); ++k) {
    Tree& tree = places[(Below(places.size(), random) + k) % places.size()].tree();
    if (tree.kind != YamlNode::Kind::kScalar) continue;
    tree.text = Scaled(tree.text, random);
    return;
  }
}

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

void Collect(XMLElement* element, std::vector<XMLElement*>* all) {
  for (XMLElement* e = element->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
    all->push_back(e);
    Collect(e, all);
  }
}

void ChangeAttribute(XMLElement* element, Random* random) {
  std::vector<std::string> names;
  for (const auto* a = element->FirstAttribute(); a != nullptr; a = a->Next()) {
    names.emplace_back(a->Name());
  }
  if (names.empty()) return;
  const std::string name = names[Below(names.size(), random)];
  if (Below(5, random) == 0) {
    element->DeleteAttribute(name.c_str());
    return;
  }
  // One of several numbers.
  std::istringstream words(element->Attribute(name.c_str()));
  std::vector<std::string> parts;
  for (std::string word; words >> word;) parts.push_back(word);
  if (parts.empty()) parts.emplace_back();
  std::string& part = parts[Below(parts.size(), random)];
  part = Scaled(part, random);
  element->SetAttribute(name.c_str(), fmt::format("{}", fmt::join(parts, " ")).c_str());
}

using Json = nlohmann::ordered_json;

void Collect(Json* json, std::vector<std::pair<Json*, std::string>>* places) {
  if (!json->is_structured()) return;
  for (const auto& item : json->items()) {
    places->emplace_back(json, item.key());
    Collect(&item.value(), places);
  }
}

Json& At(const std::pair<Json*, std::string>& place) {
  Json& parent = *place.first;
  return parent.is_array() ? parent[std::stoul(place.second)] : parent[place.second];
}

// What a value becomes: another kind, another number, another text.
Json Changed(const Json& value, Random* random) {
  switch (Below(7, random)) {
    case 0:
      return nullptr;
    case 1:
      return Json::array({value});
    case 2:
      return Json::object({{AWord(random), value}});
    case 3:
      return Below(2, random) == 0;
    case 4:
      return AWord(random);
    default: {
      if (!value.is_number()) return value.is_string() ? Json(1.0) : Json();
      constexpr std::array kFactors = {0.0, -1.0, 1e-12, 0.5, 1.001, 2.0, 1e3, 1e18, 1e300};
      const double factor = kFactors[Below(kFactors.size(), random)];
      return value.get<double>() * factor;
    }
  }
}

}  // namespace

std::string MutateJson(const std::string& text, Random* random) {
  Json root = Json::parse(text, nullptr, false);
  if (root.is_discarded()) return text;
  for (size_t k = 1 + Below(3, random); k > 0; --k) {
    std::vector<std::pair<Json*, std::string>> places;
    Collect(&root, &places);
    if (places.empty()) break;
    const auto& at = places[Below(places.size(), random)];
    const Json other = At(places[Below(places.size(), random)]);
    switch (Below(4, random)) {
      case 0:
        if (at.first->is_array()) {
          at.first->erase(std::stoul(at.second));
        } else {
          at.first->erase(at.second);
        }
        break;
      case 1:
        At(at) = other;
        break;
      default:
        At(at) = Changed(At(at), random);
    }
  }
  return root.dump(1, ' ', false, Json::error_handler_t::replace);
}

std::string MutateBytes(const std::string& bytes, Random* random) {
  std::string changed = bytes;
  for (size_t k = 1 + Below(6, random); k > 0 && !changed.empty(); --k) {
    const size_t at = Below(changed.size(), random);
    const size_t length = std::min(changed.size() - at, 1 + Below(64, random));
    switch (Below(5, random)) {
      case 0:
        changed.erase(at, length);
        break;
      case 1:
        changed.insert(at, changed.substr(at, length));
        break;
      case 2:
        changed.resize(at);
        break;
      default:
        changed[at] = static_cast<char>((*random)());
    }
  }
  return changed;
}

std::string MutateYaml(const std::string& text, Random* random) {
  YamlReader reader("seed.yaml");
  const YamlNodePtr root = reader.Parse(text);
  if (root == nullptr) return text;
  Tree tree = ToTree(*root);
  for (size_t k = 1 + Below(3, random); k > 0; --k) ChangeOnce(&tree, random);
  std::string mutated;
  Write(tree, 0, &mutated);
  return mutated + "\n";
}

std::string MutateXml(const std::string& text, Random* random) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return text;
  for (size_t k = 1 + Below(3, random); k > 0; --k) {
    std::vector<XMLElement*> all;
    Collect(document.RootElement(), &all);
    if (all.empty()) break;
    XMLElement* at = all[Below(all.size(), random)];
    XMLNode* parent = at->Parent();
    switch (Below(6, random)) {
      case 0:
        parent->DeleteChild(at);
        break;
      case 1:
        parent->InsertAfterChild(at, at->DeepClone(&document));
        break;
      case 2:
        all[Below(all.size(), random)]->InsertEndChild(at->DeepClone(&document));
        break;
      case 3:
        at->SetName(all[Below(all.size(), random)]->Name());
        break;
      default:
        ChangeAttribute(at, random);
    }
  }
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

std::string MutateTable(const std::string& text, Random* random) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  for (size_t k = 1 + Below(4, random); k > 0 && !lines.empty(); --k) {
    const size_t at = Below(lines.size(), random), other = Below(lines.size(), random);
    const auto here = lines.begin() + static_cast<std::ptrdiff_t>(at);
    switch (Below(6, random)) {
      case 0:
        lines.erase(here);
        break;
      case 1:
        lines.insert(here, lines[at]);
        break;
      case 2:
        std::swap(lines[at], lines[other]);
        break;
      default: {
        // A cell, whatever separates them.
        const size_t from =
            lines[at].find_first_not_of(",; \t", Below(lines[at].size() + 1, random));
        if (from == std::string::npos) break;
        const size_t to = std::min(lines[at].find_first_of(",; \t", from), lines[at].size());
        lines[at].replace(from, to - from, Scaled(lines[at].substr(from, to - from), random));
      }
    }
  }
  return fmt::format("{}\n", fmt::join(lines, "\n"));
}

}  // namespace mbv::fuzz
