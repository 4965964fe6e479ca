// OpenGL (3.3, core profile) as OSMesa has it, and small owners of its objects, for which a context
// must be current. OSMesa, and LLVM, which compiles its shaders, are loaded with the first picture:
// they would take half the start of a program that draws nothing.
#pragma once

#ifndef GL_GLEXT_PROTOTYPES  // mbv_render has it for all its files, whatever they include first
#define GL_GLEXT_PROTOTYPES
#endif
#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/osmesa.h>

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/types.h"
#include "math/triangle_mesh.h"
#include "render/camera.h"
#include "render/scene.h"

// What is drawn with.
// clang-format off
#define MBV_GL_FUNCTIONS(F)                                                                       \
  F(OSMesaCreateContextAttribs) F(OSMesaDestroyContext) F(OSMesaMakeCurrent) F(glActiveTexture)   \
  F(glAttachShader) F(glBindBuffer) F(glBindFramebuffer) F(glBindTexture) F(glBindVertexArray)    \
  F(glBlendFunc) F(glBufferData) F(glCheckFramebufferStatus) F(glClear) F(glClearColor)           \
  F(glClearStencil) F(glColorMask) F(glCompileShader) F(glCreateProgram) F(glCreateShader)        \
  F(glCullFace) F(glDeleteBuffers) F(glDeleteFramebuffers) F(glDeleteProgram) F(glDeleteShader)   \
  F(glDeleteTextures) F(glDeleteVertexArrays) F(glDepthFunc) F(glDepthMask) F(glDisable)          \
  F(glDrawArrays) F(glDrawBuffer) F(glDrawElements) F(glEnable) F(glEnableVertexAttribArray)      \
  F(glFramebufferTexture2D) F(glFrontFace) F(glGenBuffers) F(glGenFramebuffers)                   \
  F(glGenTextures) F(glGenVertexArrays) F(glGenerateMipmap) F(glGetError) F(glGetIntegerv)        \
  F(glGetProgramiv) F(glGetShaderInfoLog) F(glGetShaderiv) F(glGetUniformLocation)                \
  F(glIsEnabled) F(glLinkProgram) F(glPixelStorei) F(glPolygonOffset) F(glReadBuffer)             \
  F(glReadPixels) F(glShaderSource) F(glStencilFunc) F(glStencilOp) F(glTexImage2D)               \
  F(glTexParameterfv) F(glTexParameteri) F(glUniform1f) F(glUniform1i) F(glUniform2fv)            \
  F(glUniform3fv) F(glUniform4fv) F(glUniformMatrix3fv) F(glUniformMatrix4fv) F(glUseProgram)     \
  F(glVertexAttribPointer) F(glViewport)
// clang-format on

namespace mbv::render {

// Code of this namespace finds these before those of <GL/gl.h>, which are declared only.
#define MBV_GL_DECLARE(name) extern decltype(&::name) name;
MBV_GL_FUNCTIONS(MBV_GL_DECLARE)
#undef MBV_GL_DECLARE

/// Loads `library` with the first call that succeeds; "" or why nothing can be drawn.
[[nodiscard]] std::string LoadGl(const char* library = "libOSMesa.so.8");

/// A linked program. A failure to compile is our own bug.
class GlProgram {
 public:
  GlProgram(const std::string& vertex, const std::string& fragment);
  ~GlProgram();
  GlProgram(const GlProgram&) = delete;
  GlProgram& operator=(const GlProgram&) = delete;

  void Use() const { glUseProgram(id_); }
  // Of the program in use; names that it does not have are passed over.
  void Set(const char* name, int value) const;
  void Set(const char* name, double value) const;
  void Set(const char* name, const Eigen::Vector2d& value) const;
  void Set(const char* name, const Vec3& value) const;
  void Set(const char* name, const Eigen::Vector4d& value) const;
  void Set(const char* name, const Mat3& value) const;
  void Set(const char* name, const Eigen::Matrix4d& value) const;

 private:
  GLuint id_ = 0;
};

/// Pixels to draw into: colour in a format of its own, depth, and a stencil where it is asked for.
/// Sized anew on demand.
class GlFrame {
 public:
  enum class Depth { kBuffer, kBufferAndStencil, kShadowMap };
  /// `color` is GL_RGBA8, GL_RGBA32F or 0 for none.
  GlFrame(GLenum color, Depth depth);
  ~GlFrame();
  GlFrame(const GlFrame&) = delete;
  GlFrame& operator=(const GlFrame&) = delete;

  /// False if there is no frame of this size.
  [[nodiscard]] bool Resize(int width, int height);
  void Bind() const;
  [[nodiscard]] GLuint color() const { return color_; }
  [[nodiscard]] GLuint depth() const { return depth_; }

 private:
  GLenum format_;
  Depth kind_;
  int width_ = 0, height_ = 0;
  GLuint frame_ = 0, color_ = 0, depth_ = 0;
};

/// Vertices, and indices of triangles if there are any.
class GlMesh {
 public:
  GlMesh();
  ~GlMesh();
  GlMesh(const GlMesh&) = delete;
  GlMesh& operator=(const GlMesh&) = delete;

  void Bind() const { glBindVertexArray(array_); }
  void Fill(const void* vertices, std::size_t bytes);
  void FillIndices(const void* indices, std::size_t bytes);
  /// Floats at an offset in each vertex of `stride` bytes, or bytes 0 … 255 as 0 … 1.
  void Attribute(GLuint place, int count, GLenum type, std::size_t stride,
                 std::size_t offset) const;

 private:
  GLuint array_ = 0, vertices_ = 0, indices_ = 0;
};

// Solids as one buffer of triangles in the drawing frame, for one picture.

/// Meshes as they are drawn, made once for all pictures of a stage.
using DrawnMeshes = std::map<const TriangleMesh*, Facets>;
[[nodiscard]] DrawnMeshes DrawnMeshesOf(
    const std::vector<std::shared_ptr<const TriangleMesh>>& meshes);

/// Indices [first, first + count) of a buffer.
struct IndexRange {
  int first = 0, count = 0;
};
/// Items of one instant, by how they are drawn.
struct SolidRanges {
  IndexRange primitives, meshes;  ///< with shadows
  IndexRange marks;               ///< without
};

class SolidBuffer {
 public:
  SolidBuffer(const DrawnMeshes& meshes, const Camera& camera, const Mat3& R_DW, int height_px)
      : meshes_(meshes), camera_(camera), R_DW_(R_DW), height_px_(height_px) {}

  [[nodiscard]] SolidRanges Add(const std::vector<Item>& items);
  void Upload(GlMesh* mesh) const;

 private:
  struct Vertex {
    float position[3], normal[3];
    std::uint8_t color[4];
    float finish[4];  // specular, shininess, emission, number of the face
  };

  // An item and the number of the part that it belongs to.
  struct Part {
    const Item* item;
    int number;
  };

  template <typename Test>
  [[nodiscard]] IndexRange AddThose(std::vector<Part> parts, const Test& test);
  void AddOne(const Part& part);
  void Append(const Part& part, const Facets& facets);
  [[nodiscard]] double PixelsOf(const Item& item, double length_m) const;

  const DrawnMeshes& meshes_;
  const Camera& camera_;
  Mat3 R_DW_;
  int height_px_, parts_ = 0;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace mbv::render
