#include "render/gl_objects.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <mutex>
#include <vector>

#include "base/demand.h"
#include "model_file/mesh/decimate.h"

namespace mbv::render {

#define MBV_GL_DEFINE(name) decltype(&::name) name = nullptr;
MBV_GL_FUNCTIONS(MBV_GL_DEFINE)
#undef MBV_GL_DEFINE

std::string LoadGl(const char* library) {
  static std::mutex mutex;
  static bool loaded = false;
  const std::lock_guard lock(mutex);
  if (loaded) return "";
  void* const handle = dlopen(library, RTLD_NOW | RTLD_LOCAL);  // stays: so do threads of LLVM
  if (handle == nullptr) return fmt::format("{} (package libosmesa6)", dlerror());
  std::string missing;
  const auto find = [&](const char* name, auto* function) {
    *function = reinterpret_cast<std::remove_pointer_t<decltype(function)>>(dlsym(handle, name));
    if (*function == nullptr) missing += fmt::format("{}{}", missing.empty() ? "" : ", ", name);
  };
#define MBV_GL_FIND(name) find(#name, &name);
  MBV_GL_FUNCTIONS(MBV_GL_FIND)
#undef MBV_GL_FIND
  if (!missing.empty()) return fmt::format("{} has no {}", library, missing);
  loaded = true;
  return "";
}

namespace {

GLuint CompiledShader(GLenum kind, const std::string& source) {
  const std::string text = "#version 330 core\n" + source;
  const GLuint shader = glCreateShader(kind);
  const char* start = text.c_str();
  glShaderSource(shader, 1, &start, nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == 0) {
    std::string log(4000, '\0');
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
    MBV_DEMAND(ok != 0, log);
  }
  return shader;
}

template <typename Matrix>
auto Floats(const Matrix& value) {
  return value.template cast<float>().eval();
}

GLint PlaceOf(const char* name) {
  GLint program = 0;
  glGetIntegerv(GL_CURRENT_PROGRAM, &program);
  return glGetUniformLocation(static_cast<GLuint>(program), name);
}

}  // namespace

GlProgram::GlProgram(const std::string& vertex, const std::string& fragment)
    : id_(glCreateProgram()) {
  for (const auto& [kind, source] :
       {std::pair(GL_VERTEX_SHADER, &vertex), {GL_FRAGMENT_SHADER, &fragment}}) {
    const GLuint shader = CompiledShader(kind, *source);
    glAttachShader(id_, shader);
    glDeleteShader(shader);
  }
  glLinkProgram(id_);
  GLint ok = 0;
  glGetProgramiv(id_, GL_LINK_STATUS, &ok);
  MBV_DEMAND(ok != 0, vertex + fragment);
}

GlProgram::~GlProgram() { glDeleteProgram(id_); }

void GlProgram::Set(const char* name, int value) const { glUniform1i(PlaceOf(name), value); }
void GlProgram::Set(const char* name, double value) const {
  glUniform1f(PlaceOf(name), static_cast<float>(value));
}
void GlProgram::Set(const char* name, const Eigen::Vector2d& value) const {
  glUniform2fv(PlaceOf(name), 1, Floats(value).data());
}
void GlProgram::Set(const char* name, const Vec3& value) const {
  glUniform3fv(PlaceOf(name), 1, Floats(value).data());
}
void GlProgram::Set(const char* name, const Eigen::Vector4d& value) const {
  glUniform4fv(PlaceOf(name), 1, Floats(value).data());
}
void GlProgram::Set(const char* name, const Mat3& value) const {
  glUniformMatrix3fv(PlaceOf(name), 1, GL_FALSE, Floats(value).data());
}
void GlProgram::Set(const char* name, const Eigen::Matrix4d& value) const {
  glUniformMatrix4fv(PlaceOf(name), 1, GL_FALSE, Floats(value).data());
}

GlFrame::GlFrame(GLenum color, Depth depth) : format_(color), kind_(depth) {
  glGenFramebuffers(1, &frame_);
}

GlFrame::~GlFrame() {
  glDeleteFramebuffers(1, &frame_);
  glDeleteTextures(1, &color_);
  glDeleteTextures(1, &depth_);
}

bool GlFrame::Resize(int width, int height) {
  if (width == width_ && height == height_) return true;
  width_ = width;
  height_ = height;
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  const auto attach = [&](GLuint* texture, GLenum point, GLenum inner, GLenum outer, GLenum type) {
    glDeleteTextures(1, texture);
    glGenTextures(1, texture);
    glBindTexture(GL_TEXTURE_2D, *texture);
    glTexImage2D(GL_TEXTURE_2D, 0, static_cast<GLint>(inner), width, height, 0, outer, type,
                 nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) {
      glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
    }
    glFramebufferTexture2D(GL_FRAMEBUFFER, point, GL_TEXTURE_2D, *texture, 0);
  };
  if (format_ != 0) {
    attach(&color_, GL_COLOR_ATTACHMENT0, format_, GL_RGBA,
           format_ == GL_RGBA8 ? GL_UNSIGNED_BYTE : GL_FLOAT);
  } else {
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
  }
  if (kind_ == Depth::kBufferAndStencil) {
    attach(&depth_, GL_DEPTH_STENCIL_ATTACHMENT, GL_DEPTH24_STENCIL8, GL_DEPTH_STENCIL,
           GL_UNSIGNED_INT_24_8);
  } else {
    attach(&depth_, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT, GL_UNSIGNED_INT);
  }
  if (kind_ == Depth::kShadowMap) {
    // Compared and blended by the sampler; what lies beyond the map is in the light.
    const std::array<float, 4> light = {1.0F, 1.0F, 1.0F, 1.0F};
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
    glTexParameterfv(GL_TEXTURE_2D, GL_TEXTURE_BORDER_COLOR, light.data());
  }
  return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

void GlFrame::Bind() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_);
  glViewport(0, 0, width_, height_);
}

GlMesh::GlMesh() {
  glGenVertexArrays(1, &array_);
  glGenBuffers(1, &vertices_);
  glGenBuffers(1, &indices_);
}

GlMesh::~GlMesh() {
  glDeleteBuffers(1, &vertices_);
  glDeleteBuffers(1, &indices_);
  glDeleteVertexArrays(1, &array_);
}

void GlMesh::Fill(const void* vertices, std::size_t bytes) {
  Bind();
  glBindBuffer(GL_ARRAY_BUFFER, vertices_);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), vertices, GL_STATIC_DRAW);
}

void GlMesh::FillIndices(const void* indices, std::size_t bytes) {
  Bind();
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices_);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(bytes), indices, GL_STATIC_DRAW);
}

void GlMesh::Attribute(GLuint place, int count, GLenum type, std::size_t stride,
                       std::size_t offset) const {
  glEnableVertexAttribArray(place);
  glVertexAttribPointer(place, count, type, type == GL_UNSIGNED_BYTE ? GL_TRUE : GL_FALSE,
                        static_cast<GLsizei>(stride), reinterpret_cast<const void*>(offset));
}

namespace {

constexpr std::size_t kMostTriangles = 400'000;  // of all meshes together

std::uint8_t Byte(float share) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F)));
}

// Whether a rod or ball goes on where the one before ends: arcs, coils and paths are one part.
bool GoesOn(const Item& before, const Item& item) {
  const auto end = [](const Item& of, double side) {
    const double half = of.solid == Solid::kCapsule ? of.size.z() : 0.0;
    return Vec3(of.X_WG * Vec3(0.0, 0.0, side * half));
  };
  const auto is_rod = [](const Item& of) {
    return of.solid == Solid::kCapsule || of.solid == Solid::kBall;
  };
  return is_rod(before) && is_rod(item) && before.casts_shadow == item.casts_shadow &&
         before.material.rgba == item.material.rgba &&
         (end(before, 1.0) - end(item, -1.0)).norm() < before.size.x();
}

}  // namespace

DrawnMeshes DrawnMeshesOf(const std::vector<std::shared_ptr<const TriangleMesh>>& meshes) {
  std::vector<const TriangleMesh*> all;
  all.reserve(meshes.size());
  for (const auto& mesh : meshes) all.push_back(mesh.get());
  const std::vector<std::size_t> shares = SharesOf(all, kMostTriangles);
  DrawnMeshes drawn;
  for (std::size_t i = 0; i < all.size(); ++i) drawn[all[i]] = FacetsOf(*all[i], shares[i]);
  return drawn;
}

double SolidBuffer::PixelsOf(const Item& item, double length_m) const {
  const Vec3 p_D = R_DW_ * item.X_WG.translation();
  const double reach = item.size.norm();
  double depth = camera_.distance_m;
  if (!camera_.parallel) {
    depth = std::max((p_D - camera_.position_D()).dot(camera_.forward_D()) - reach,
                     0.05 * camera_.distance_m);
  }
  return length_m * height_px_ * camera_.distance_m / (HeightAtLookat(camera_) * depth);
}

void SolidBuffer::Append(const Part& part, const Facets& facets) {
  const Item& item = *part.item;
  const auto base = static_cast<std::uint32_t>(vertices_.size());
  const Mat3 R_DG = R_DW_ * item.X_WG.linear();
  const Vec3 p_DG = R_DW_ * item.X_WG.translation();
  const Material& m = item.material;
  // Meshes have no numbers of faces, which a negative number says.
  for (std::size_t i = 0; i < facets.points_G.size(); ++i) {
    const Vec3 p = R_DG * facets.points_G[i] + p_DG, n = R_DG * facets.normals_G[i];
    const int face =
        item.solid == Solid::kMesh ? -part.number : part.number * kMostFaces + facets.faces[i];
    Vertex vertex{.position = {}, .normal = {}, .color = {}, .finish = {}};
    for (int k = 0; k < 3; ++k) {
      vertex.position[k] = static_cast<float>(p[k]);
      vertex.normal[k] = static_cast<float>(n[k]);
    }
    for (int k = 0; k < 4; ++k) vertex.color[k] = Byte(m.rgba[static_cast<std::size_t>(k)]);
    vertex.finish[0] = m.specular;
    vertex.finish[1] = m.shininess;
    vertex.finish[2] = m.emission;
    vertex.finish[3] = static_cast<float>(face);
    vertices_.push_back(vertex);
  }
  for (const auto& triangle : facets.triangles) {
    for (const int corner : triangle) {
      indices_.push_back(base + static_cast<std::uint32_t>(corner));
    }
  }
}

void SolidBuffer::AddOne(const Part& part) {
  const Item& item = *part.item;
  if (item.solid != Solid::kMesh) {
    const double radius = item.solid == Solid::kArrow ? 2.0 * item.size.x() : item.size.x();
    Append(part, FacetsOf(item, SidesFor(PixelsOf(item, radius))));
    return;
  }
  if (const auto found = meshes_.find(item.mesh.get()); found != meshes_.end()) {
    Append(part, found->second);
  }
}

// What ends nearest first, so that decks and floors come last: what others hide is not lit.
template <typename Test>
IndexRange SolidBuffer::AddThose(std::vector<Part> parts, const Test& test) {
  const int first = static_cast<int>(indices_.size());
  std::erase_if(parts, [&](const Part& part) { return !test(*part.item); });
  std::ranges::stable_sort(parts, {}, [&](const Part& part) {
    const Vec3 p_D = R_DW_ * part.item->X_WG.translation();
    return p_D.dot(camera_.forward_D()) + part.item->size.norm();
  });
  for (const Part& part : parts) AddOne(part);
  return {first, static_cast<int>(indices_.size()) - first};
}

SolidRanges SolidBuffer::Add(const std::vector<Item>& items) {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool same = i > 0 && GoesOn(items[i - 1], items[i]);
    parts.push_back({&items[i], same ? parts_ : ++parts_});
  }
  const auto is_mesh = [](const Item& item) { return item.solid == Solid::kMesh; };
  return {.primitives = AddThose(
              parts, [&](const Item& item) { return item.casts_shadow && !is_mesh(item); }),
          .meshes = AddThose(parts, is_mesh),
          .marks = AddThose(
              parts, [&](const Item& item) { return !item.casts_shadow && !is_mesh(item); })};
}

void SolidBuffer::Upload(GlMesh* mesh) const {
  mesh->Fill(vertices_.data(), vertices_.size() * sizeof(Vertex));
  mesh->FillIndices(indices_.data(), indices_.size() * sizeof(std::uint32_t));
  mesh->Attribute(0, 3, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, position));
  mesh->Attribute(1, 3, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, normal));
  mesh->Attribute(2, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offsetof(Vertex, color));
  mesh->Attribute(3, 4, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, finish));
}

}  // namespace mbv::render
