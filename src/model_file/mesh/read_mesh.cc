#include "model_file/mesh/read_mesh.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>
#include <algorithm>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <map>
#include <new>
#include <optional>
#include <sstream>
#include <string_view>

#include "base/files.h"
#include "base/inputs.h"
#include "base/worker_pool.h"
#include "math/bytes.h"
#include "model_file/mesh/mass_properties.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::vector<MeshPackage>& Packages() {
  static std::vector<MeshPackage> packages;
  return packages;
}

// The folders that an environment variable lists.
std::vector<fs::path> Listed(const char* variable) {
  std::vector<fs::path> folders;
  const char* text = std::getenv(variable);
  std::istringstream stream(text == nullptr ? "" : text);
  for (std::string folder; std::getline(stream, folder, ':');) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

std::vector<fs::path> AmentShares() {
  std::vector<fs::path> shares;
  for (const fs::path& prefix : Listed("AMENT_PREFIX_PATH")) shares.push_back(prefix / "share");
  return shares;
}

bool LiesBelow(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path base = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder), error);
  if (error) return false;
  const fs::path inside = fs::weakly_canonical(fs::absolute(file), error).lexically_relative(base);
  return !error && !inside.empty() && *inside.begin() != ".." && inside != ".";
}

// Where ROS and Gazebo look for packages and models, as their users set it.
std::vector<fs::path> ListedFolders() {
  std::vector<fs::path> folders;
  for (const char* variable : {"ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH"}) {
    std::ranges::copy(Listed(variable), std::back_inserter(folders));
  }
  return folders;
}

// Where PACKAGE/REST may be.
std::vector<fs::path> InPackage(const std::string& package, const fs::path& rest,
                                const fs::path& folder) {
  if (package.empty()) return {folder / rest};
  std::vector<fs::path> paths;
  for (const MeshPackage& given : Packages()) {
    if (given.name == package) paths.push_back(given.folder / rest);
  }
  for (const fs::path& listed : ListedFolders()) {
    if (listed.filename() == package) paths.push_back(listed / rest);
    paths.push_back(listed / package / rest);
  }
  for (const fs::path& share : AmentShares()) paths.push_back(share / package / rest);
  paths.push_back(folder / package / rest);
  std::error_code error;
  for (fs::path above = fs::weakly_canonical(fs::absolute(folder.empty() ? "." : folder), error);
       above.has_relative_path(); above = above.parent_path()) {
    if (!MayBeNamed(above, folder)) break;
    paths.push_back(above.parent_path() / package / rest);
  }
  return paths;
}

// What files name as FOLDER/… or SCHEME://NAME/….
std::vector<fs::path> Candidates(const std::string& name, const fs::path& folder) {
  for (const char* scheme : {"package://", "model://"}) {
    if (!name.starts_with(scheme)) continue;
    const std::string path = name.substr(std::string(scheme).size());
    const size_t slash = path.find('/');
    if (slash == std::string::npos) return {};
    return InPackage(path.substr(0, slash), fs::path(path.substr(slash + 1)).relative_path(),
                     folder);
  }
  const std::string file = "file://";
  return {folder / (name.starts_with(file) ? name.substr(file.size()) : name)};
}

}  // namespace

void UseMeshPackages(std::vector<MeshPackage> packages) { Packages() = std::move(packages); }

const std::vector<MeshPackage>& MeshPackages() { return Packages(); }

bool MayBeNamed(const fs::path& file, const fs::path& folder) {
  std::vector<fs::path> open = {folder};
  for (const MeshPackage& package : Packages()) open.push_back(package.folder);
  std::ranges::move(ListedFolders(), std::back_inserter(open));
  std::ranges::move(AmentShares(), std::back_inserter(open));
  return std::ranges::any_of(open, [&](const fs::path& f) { return LiesBelow(f, file); });
}

FoundMesh FindMesh(const std::string& name, const fs::path& folder) {
  bool outside = false;
  for (const fs::path& path : Candidates(name, folder)) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) continue;
    if (MayBeNamed(path, folder)) return {path.lexically_normal(), "", false};
    outside = true;
  }
  return {{}, outside ? "lies outside the folder of the file" : "is not there", outside};
}

std::string PathSeenFrom(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  const fs::path base = fs::absolute(folder.empty() ? "." : folder, error).lexically_normal();
  const fs::path path = fs::absolute(file, error).lexically_normal();
  const fs::path inside = path.lexically_relative(base);
  return inside.empty() || *inside.begin() == ".." ? path.string() : inside.string();
}

template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<MeshText>& mesh) {
  visit(mesh.surface.vertices), visit(mesh.surface.triangles), visit(mesh.trouble);
}

namespace {

constexpr size_t kMostBytes = 256UL << 20;
constexpr size_t kMostBytesOfAnswer = 60'000'000;  // what a child may answer
constexpr const char* kNothing = "it gave nothing";
constexpr double kReadTimeout_s = 60.0;
constexpr size_t kMostKnown = 500;  // surfaces

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// Adds the meshes of a node and of those below it.
void AddNode(const aiScene& scene, const aiNode& node, const aiMatrix4x4& above,
             TriangleMesh* surface) {
  const aiMatrix4x4 X = above * node.mTransformation;
  for (unsigned i = 0; i < node.mNumMeshes; ++i) {
    const aiMesh& part = *scene.mMeshes[node.mMeshes[i]];
    const int first = static_cast<int>(surface->vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      const aiVector3D p = X * part.mVertices[v];
      surface->vertices.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      std::array<int, 3> triangle{};
      for (int k = 0; k < 3; ++k) triangle[k] = first + static_cast<int>(face.mIndices[k]);
      if (X.Determinant() < 0.0F) std::swap(triangle[1], triangle[2]);
      surface->triangles.push_back(triangle);
    }
  }
  for (unsigned i = 0; i < node.mNumChildren; ++i) {
    AddNode(scene, *node.mChildren[i], X, surface);
  }
}

// Polygons whose corners are there, and that are cut into triangles in time: the time grows with
// the square of the corners. "" or what is wrong.
std::string PolygonTrouble(const aiScene& scene) {
  constexpr unsigned kMostCorners = 10'000;
  constexpr double kMostPairs = 4e8;  // of corners, in all polygons
  double pairs = 0.0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      for (unsigned k = 0; k < face.mNumIndices; ++k) {
        if (face.mIndices[k] >= part.mNumVertices) return "a face has a vertex that is not there";
      }
      if (face.mNumIndices > kMostCorners) {
        return fmt::format("a face has {} corners, at most {} are read", face.mNumIndices,
                           kMostCorners);
      }
      if (face.mNumIndices > 4) pairs += static_cast<double>(face.mNumIndices) * face.mNumIndices;
    }
  }
  return pairs > kMostPairs ? "its faces have too many corners: export it as triangles" : "";
}

// For the library, the mesh is the only file that there is.
class NoFiles : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*file*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*file*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*file*/) override {}
};

// Of a PLY file, whose header promises counts: it must end, and what follows must hold them, or the
// library reads on without an end. "" if it does, or is not a PLY file.
class PlyCheck {
 public:
  explicit PlyCheck(const std::string& bytes) : bytes_(bytes) {}

  std::string Run() {
    if (Lower(bytes_.substr(0, 3)) != "ply") return "";  // the library refuses it
    if (!ReadHeader()) return fmt::format("its header {}", header_trouble_);
    if (ascii_ && PromisesInSomeLine()) return "one of its lists promises more than it can hold";
    for (const Element& element : elements_) {
      if (element.count > 0 && element.properties.empty()) {
        return fmt::format("its {} {} have no property", element.count, element.name);
      }
      for (unsigned long long i = 0; i < element.count; ++i) {
        for (const Property& property : element.properties) {
          if (!Skip(property)) {
            return fmt::format("its header promises {} {}, and it ends in the {}th", element.count,
                               element.name, i + 1);
          }
        }
      }
    }
    return "";
  }

 private:
  struct Property {
    size_t bytes = 0, count_bytes = 0;  // count_bytes: of a list
  };
  struct Element {
    std::string name;
    unsigned long long count = 0;
    std::vector<Property> properties;
  };

  static size_t BytesOf(const std::string& type) {
    constexpr std::pair<std::string_view, size_t> kTypes[] = {
        {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
        {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
        {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
    for (const auto& [name, bytes] : kTypes) {
      if (type == name) return bytes;
    }
    return 0;
  }

  bool ReadHeader() {
    for (std::string line; NextLine(&line);) {
      std::istringstream words(line);
      std::string word, type, more;
      words >> word;
      if (word == "end_header") return true;
      if (word == "format") {
        words >> type;
        ascii_ = type == "ascii";
        big_ = type == "binary_big_endian";
      } else if (word == "element") {
        Element element;
        if (!(words >> element.name >> element.count)) {
          header_trouble_ = "has an element without a count";
          return false;
        }
        elements_.push_back(element);
      } else if (word == "property" && !elements_.empty()) {
        words >> type;
        Property property{.bytes = BytesOf(type)};
        if (type == "list") {
          words >> type >> more;
          property = {.bytes = BytesOf(more), .count_bytes = BytesOf(type)};
          if (property.count_bytes == 0) property.bytes = 0;
        }
        if (property.bytes == 0) {
          header_trouble_ = "has a property of an unknown type";
          return false;
        }
        elements_.back().properties.push_back(property);
      }
    }
    return false;
  }

  // The library reads a line per face, and after a damaged line not those that Run() takes for
  // faces: a count that no file of this length has is refused wherever a list may begin.
  [[nodiscard]] bool PromisesInSomeLine() const {
    constexpr unsigned long long kNeverMeant = 10'000'000;
    const unsigned long long most = std::max<unsigned long long>(bytes_.size(), kNeverMeant);
    for (size_t from = at_; from < bytes_.size();) {
      const size_t end = std::min(bytes_.find_first_of("\r\n", from), bytes_.size());
      const std::string_view line = std::string_view(bytes_).substr(from, end - from);
      from = end + 1;
      for (const Element& element : elements_) {
        std::string_view rest = line;
        for (const Property& property : element.properties) {
          const auto count = property.count_bytes > 0 ? CountOf(TakeWord(&rest)) : 1;
          if (count > most) return true;
          if (property.count_bytes == 0) (void)TakeWord(&rest);
          for (unsigned long long i = 0; property.count_bytes > 0 && i < count && !rest.empty();
               ++i) {
            (void)TakeWord(&rest);
          }
        }
      }
    }
    return false;
  }

  static std::string_view TakeWord(std::string_view* line) {
    constexpr std::string_view kSpace = " \t";
    line->remove_prefix(std::min(line->find_first_not_of(kSpace), line->size()));
    const std::string_view word = line->substr(0, line->find_first_of(kSpace));
    line->remove_prefix(word.size());
    return word;
  }

  static unsigned long long CountOf(std::string_view word) {
    unsigned long long count = 0;
    const auto error = std::from_chars(word.data(), word.data() + word.size(), count).ec;
    return error == std::errc::result_out_of_range ? ~0ULL : count;
  }

  bool NextLine(std::string* line) {
    if (at_ >= bytes_.size()) return false;
    const size_t end = std::min(bytes_.find_first_of("\r\n", at_), bytes_.size());
    *line = bytes_.substr(at_, end - at_);
    at_ = end + (bytes_.compare(end < bytes_.size() ? end : 0, 2, "\r\n") == 0 ? 2 : 1);
    return true;
  }

  bool Skip(const Property& property) {
    if (ascii_) {
      unsigned long long count = 1;
      if (property.count_bytes > 0) {
        const std::string_view text = NextWord();
        if (text.empty() ||
            std::from_chars(text.data(), text.data() + text.size(), count).ec != std::errc()) {
          return false;
        }
      }
      for (unsigned long long i = 0; i < count; ++i) {
        if (NextWord().empty()) return false;
      }
      return true;
    }
    unsigned long long count = 1;
    if (property.count_bytes > 0) {
      if (at_ > bytes_.size() || property.count_bytes > bytes_.size() - at_) return false;
      count = 0;
      for (size_t k = 0; k < property.count_bytes; ++k) {
        const auto byte = static_cast<unsigned char>(bytes_[at_ + k]);
        count |= static_cast<unsigned long long>(byte)
                 << (8 * (big_ ? property.count_bytes - 1 - k : k));
      }
      at_ += property.count_bytes;
    }
    if (at_ > bytes_.size() || count > (bytes_.size() - at_) / property.bytes) return false;
    at_ += static_cast<size_t>(count) * property.bytes;
    return true;
  }

  std::string_view NextWord() {
    constexpr const char* kSpace = " \t\r\n";
    const size_t from = bytes_.find_first_not_of(kSpace, at_);
    if (from == std::string::npos) return {};
    at_ = std::min(bytes_.find_first_of(kSpace, from), bytes_.size());
    return std::string_view(bytes_).substr(from, at_ - from);
  }

  const std::string& bytes_;
  size_t at_ = 0;
  bool ascii_ = true, big_ = false;
  const char* header_trouble_ = "does not end (no line end_header)";
  std::vector<Element> elements_;
};

// Of a DAE file: counts of its arrays and primitives that it cannot hold (a number and a space are
// two bytes), and lists of indices with anything else between them, which the library would read
// without an end. "" without one.
std::string DaeTrouble(std::string_view bytes) {
  constexpr std::string_view kCount = "count=";
  for (size_t at = bytes.find(kCount); at != std::string_view::npos;
       at = bytes.find(kCount, at + 1)) {
    const char* from = bytes.data() + std::min(at + kCount.size() + 1, bytes.size());
    unsigned long long count = 0;
    const auto [end, error] = std::from_chars(from, bytes.data() + bytes.size(), count);
    if (error == std::errc::result_out_of_range || count > bytes.size()) {
      return "it states a count of " + std::string(from, end) + ", more than it can hold";
    }
  }
  for (const std::string_view open : {"<p", "<vcount", "<v"}) {
    for (size_t at = bytes.find(open); at != std::string_view::npos;
         at = bytes.find(open, at + 1)) {
      const std::string_view rest = bytes.substr(at + open.size());
      if (rest.empty() || std::string_view(" \t\r\n>").find(rest[0]) == std::string_view::npos)
        continue;
      const size_t tag = rest.find('>');
      if (tag == std::string_view::npos || rest[tag == 0 ? 0 : tag - 1] == '/') continue;
      const std::string_view inside = rest.substr(tag + 1);
      const size_t end = inside.find_first_not_of(" \t\r\n+-0123456789");
      if (end == std::string_view::npos || !inside.substr(end).starts_with("</")) {
        return "one of its lists of indices holds something else";
      }
    }
  }
  return "";
}

// Of an OBJ file what makes its surface. Names of objects, groups and materials are left out: the
// library compares each with all others, and looks for the files of materials.
std::string ObjSurface(std::string_view bytes) {
  std::string surface;
  bool continues = false, kept = false;
  for (size_t from = 0; from < bytes.size();) {
    const size_t end = std::min(bytes.find('\n', from), bytes.size() - 1);
    const std::string_view line = bytes.substr(from, end + 1 - from);
    from = end + 1;
    if (!continues) {
      const std::string_view text =
          line.substr(std::min(line.find_first_not_of(" \t"), line.size()));
      kept =
          std::ranges::any_of(std::initializer_list<std::string_view>{"v ", "v\t", "vt ", "vt\t",
                                                                      "vn ", "vn\t", "f ", "f\t"},
                              [&](std::string_view key) { return text.starts_with(key); });
    }
    if (kept) surface += line;
    const size_t last = line.find_last_not_of("\r\n");
    continues = last != std::string_view::npos && line[last] == '\\';
  }
  return surface;
}

// What a child answers.
std::string Answer(MeshText mesh) {
  std::string bytes = ToBytes(mesh);
  if (bytes.size() <= kMostBytesOfAnswer) return bytes;
  const size_t triangles = mesh.surface.triangles.size();
  return ToBytes(MeshText{{}, fmt::format("its {} triangles are too many", triangles)});
}

// Surfaces of this process by content and ending of their files.
std::map<std::string, MeshFile>& Known() {
  thread_local std::map<std::string, MeshFile> known;
  if (known.size() > kMostKnown) known.clear();
  return known;
}

}  // namespace

bool IsMeshFile(const std::filesystem::path& file) {
  const std::string extension = Lower(file.extension().string());
  return extension == ".stl" || extension == ".obj" || extension == ".dae" || extension == ".ply";
}

MeshText ReadMeshBytes(const std::string& bytes, const std::string& extension) {
  MeshText mesh;
  const std::string kind = Lower(extension).substr(extension.starts_with('.') ? 1 : 0);
  // The library itself compares the counts of STL, and OBJ has none.
  mesh.trouble = kind == "ply" ? PlyCheck(bytes).Run() : kind == "dae" ? DaeTrouble(bytes) : "";
  if (!mesh.trouble.empty()) return mesh;
  const std::string surface = kind == "obj" ? ObjSurface(bytes) : "";
  const std::string& read = kind == "obj" ? surface : bytes;
  Assimp::Importer importer;
  importer.SetIOHandler(new NoFiles);  // which it owns
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene = importer.ReadFileFromMemory(read.data(), read.size(), 0, kind.c_str());
  // The library's own words may quote the file, which may be something else than a mesh.
  mesh.trouble = scene == nullptr || scene->mRootNode == nullptr
                     ? "it is damaged, or of another kind than its name says"
                     : PolygonTrouble(*scene);
  if (!mesh.trouble.empty()) return mesh;
  scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (scene == nullptr) {
    mesh.trouble = "its faces cannot be cut into triangles";
    return mesh;
  }
  AddNode(*scene, *scene->mRootNode, aiMatrix4x4(), &mesh.surface);
  const bool finite = std::all_of(mesh.surface.vertices.begin(), mesh.surface.vertices.end(),
                                  [](const Vec3& p) { return p.allFinite(); });
  mesh.surface = Welded(mesh.surface, 0.0);
  if (!finite) mesh.trouble = "a vertex is not finite";
  if (finite && mesh.surface.triangles.empty()) mesh.trouble = "it holds no triangle";
  return mesh;
}

namespace {

// Of a process that reads a file of this many bytes: more is not needed, whatever the file asks
// for. (Sanitizers reserve memory as they like.)
void LimitMemory([[maybe_unused]] size_t bytes) {
#ifndef __SANITIZE_ADDRESS__
  constexpr rlim_t kLeast = 512UL << 20, kPerByte = 200;
  rlim_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most =
      pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + kLeast + kPerByte * bytes;
  rlimit limit{};
  if (pages == 0 || getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur < most) return;
  limit.rlim_cur = most;
  (void)setrlimit(RLIMIT_AS, &limit);
#endif
}

// In a child.
MeshText ReadLimited(const std::string& bytes, const std::string& extension) {
  LimitMemory(bytes.size());
  try {
    return ReadMeshBytes(bytes, extension);
  } catch (const std::bad_alloc&) {
    return {{}, "it asks for more memory than a file of its length may"};
  }
}

}  // namespace

std::vector<MeshFile> ReadMeshFiles(const std::vector<std::filesystem::path>& files) {
  std::vector<MeshFile> result(files.size());
  std::vector<std::string> contents, keys(files.size()), endings;
  std::vector<std::string> unknown;  // keys
  for (size_t i = 0; i < files.size(); ++i) {
    auto bytes = ReadWholeFile(files[i]);
    if (!bytes || bytes->size() > kMostBytes) {
      result[i].trouble = bytes ? "it is larger than 256 MB" : "it cannot be read";
      continue;
    }
    NoteInput(files[i].string(), *bytes);
    const std::string ending = Lower(files[i].extension().string());
    keys[i] = ending + ContentFingerprint(*bytes);
    if (Known().contains(keys[i])) continue;
    if (std::find(unknown.begin(), unknown.end(), keys[i]) != unknown.end()) continue;
    unknown.push_back(keys[i]);
    endings.push_back(ending);
    contents.push_back(std::move(*bytes));
  }
  const auto answers = InChildren(unknown.size(), kReadTimeout_s, [&](size_t k) {
    return Answer(ReadLimited(contents[k], endings[k]));
  });
  for (size_t k = 0; k < unknown.size(); ++k) {
    MeshText read =
        answers[k] ? FromBytes<MeshText>(*answers[k]).value_or(MeshText{{}, kNothing}) : MeshText{};
    if (!answers[k]) {
      read.trouble = fmt::format("reading it crashed, or took longer than {:g} s", kReadTimeout_s);
    }
    MeshFile& known = Known()[unknown[k]];
    known.trouble = read.trouble;
    if (read.trouble.empty()) {
      known.surface = std::make_shared<const TriangleMesh>(std::move(read.surface));
    }
  }
  for (size_t i = 0; i < files.size(); ++i) {
    if (!keys[i].empty()) result[i] = Known()[keys[i]];
  }
  return result;
}

TriangleMesh Scaled(const TriangleMesh& surface, const Vec3& scale) {
  TriangleMesh scaled = surface;
  for (Vec3& p : scaled.vertices) p = p.cwiseProduct(scale);
  if (scale.prod() < 0.0) {
    for (auto& t : scaled.triangles) std::swap(t[1], t[2]);
  }
  return scaled;
}

}  // namespace mbv
