#include "render/gl_objects.h"

#include <vector>

#include "core/demand.h"

namespace mbv::render {
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

}  // namespace mbv::render
