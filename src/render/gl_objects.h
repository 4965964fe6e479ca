// Small owners of OpenGL objects (3.3, core profile). A context must be current.
#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>

#include <string>

#include "core/types.h"

namespace mbv::render {

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

}  // namespace mbv::render
