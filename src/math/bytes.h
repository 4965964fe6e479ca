// Values as bytes, on their way out of a child process of the same program: no format for files.
//
// A type says once what it consists of, in its own namespace; writing and reading visit the same
// members in the same order:
//   template <typename Visit>
//   void VisitMembers(Visit& visit, typename Visit::template Of<Row>& row) {
//     visit(row.name), visit(row.values);
//   }
#pragma once

#include <array>
#include <cstring>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/types.h"

namespace mbv {

/// Numbers, enumerations and arrays of them: their bytes are all there is.
template <typename T>
concept PlainBytes = std::is_arithmetic_v<T> || std::is_enum_v<T> ||
    (std::is_trivially_copyable_v<T>&& requires { std::tuple_size<T>::value; });

class ByteWriter {
 public:
  template <typename T>
  using Of = const T;

  template <PlainBytes T>
  void operator()(const T& value) {
    Raw(&value, sizeof value);
  }
  void operator()(const std::string& text) {
    (*this)(text.size());
    bytes += text;
  }
  template <int R, int C>
  void operator()(const Eigen::Matrix<double, R, C>& values) {
    if constexpr (R < 0 || C < 0) (*this)(values.rows()), (*this)(values.cols());
    Raw(values.data(), static_cast<size_t>(values.size()) * sizeof(double));
  }
  void operator()(const Pose& value) { (*this)(value.matrix()); }
  template <typename A, typename B>
  void operator()(const std::pair<A, B>& value) {
    (*this)(value.first), (*this)(value.second);
  }
  template <typename T>
  void operator()(const std::vector<T>& values) {
    (*this)(values.size());
    for (const T& value : values) (*this)(value);
  }
  template <typename T>
  void operator()(const T& value) {
    VisitMembers(*this, value);
  }

  std::string bytes;

 private:
  void Raw(const void* from, size_t count) { bytes.append(static_cast<const char*>(from), count); }
};

class ByteReader {
 public:
  template <typename T>
  using Of = T;

  /// `bytes` outlives the reader.
  explicit ByteReader(const std::string& bytes) : bytes_(bytes) {}

  template <PlainBytes T>
  void operator()(T& value) {
    Raw(&value, sizeof value);
  }
  void operator()(bool& value) {
    unsigned char byte = 0;
    (*this)(byte);
    value = byte != 0;
  }
  void operator()(std::string& text) {
    text.assign(Count(1), '\0');
    Raw(text.data(), text.size());
  }
  template <int R, int C>
  void operator()(Eigen::Matrix<double, R, C>& values) {
    if constexpr (R < 0 || C < 0) {
      const size_t rows = Count(0), columns = Count(0);
      if (columns > 0 && rows > left() / sizeof(double) / columns) good_ = false;
      if (C > 0 && columns != static_cast<size_t>(C)) good_ = false;
      if (!good_) return;
      values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    }
    Raw(values.data(), static_cast<size_t>(values.size()) * sizeof(double));
  }
  void operator()(Pose& value) { (*this)(value.matrix()); }
  template <typename A, typename B>
  void operator()(std::pair<A, B>& value) {
    (*this)(value.first), (*this)(value.second);
  }
  template <typename T>
  void operator()(std::vector<T>& values) {
    values.resize(Count(1));
    for (size_t i = 0; i < values.size() && good_; ++i) {
      T value{};
      (*this)(value);
      values[i] = std::move(value);
    }
  }
  template <typename T>
  void operator()(T& value) {
    VisitMembers(*this, value);
  }

  /// True when all bytes were there, and no more.
  [[nodiscard]] bool good() const { return good_ && left() == 0; }

 private:
  [[nodiscard]] size_t left() const { return bytes_.size() - at_; }
  // Of things that take `each` bytes at least.
  size_t Count(size_t each) {
    size_t count = 0;
    (*this)(count);
    if (each > 0 && count > left() / each) good_ = false;
    return good_ ? count : 0;
  }
  void Raw(void* to, size_t count) {
    if (count > left()) good_ = false;
    if (!good_) return;
    if (count > 0) std::memcpy(to, bytes_.data() + at_, count);
    at_ += count;
  }

  const std::string& bytes_;
  size_t at_ = 0;
  bool good_ = true;
};

template <typename T>
[[nodiscard]] std::string ToBytes(const T& value) {
  ByteWriter writer;
  writer(value);
  return std::move(writer.bytes);
}

/// Empty where the bytes are no T.
template <typename T>
[[nodiscard]] std::optional<T> FromBytes(const std::string& bytes) {
  T value{};
  ByteReader reader(bytes);
  reader(value);
  if (!reader.good()) return std::nullopt;
  return value;
}

}  // namespace mbv
