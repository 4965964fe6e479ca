// Types that are written to JSON and read back, described once for both directions:
//
//   template <typename F, Is<Drift> T>
//   void Describe(F& field, T& drift) {
//     field("metric", drift.metric);
//     field("value", drift.value);                                  // NaN is null
//     field.Optional("since", drift.since, !drift.since.empty());   // otherwise left out
//   }
//
// Then JsonOf(drift) and FromJson<Drift>(value). Parts may be described types, lists, maps by text
// and optional values (null: none) of them.
#pragma once

#include <algorithm>
#include <concepts>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/json_document.h"
#include "base/json_text.h"

namespace mbv {

/// T, or const T while it is written.
template <typename S, typename T>
concept Is = std::same_as<std::remove_const_t<S>, T>;

class JsonFieldWriter;
class JsonFieldReader;

template <typename T>
[[nodiscard]] nlohmann::ordered_json JsonOf(const T& value);
/// Throws JsonRefusal, for ReadJson().
template <typename T>
[[nodiscard]] T FromJson(const JsonValue& json);

class JsonFieldWriter {
 public:
  template <typename T>
  void operator()(const char* key, const T& value) {
    json[key] = JsonOf(value);
  }
  /// Left out unless `written`; read, it keeps its value where it is left out.
  template <typename T>
  void Optional(const char* key, const T& value, bool written = true) {
    if (written) json[key] = JsonOf(value);
  }
  /// An enumeration as one of `words`, in its order.
  template <typename T>
  void Word(const char* key, const T& value, std::span<const char* const> words) {
    json[key] = words[static_cast<size_t>(value)];
  }

  nlohmann::ordered_json json = nlohmann::ordered_json::object();
};

class JsonFieldReader {
 public:
  explicit JsonFieldReader(const JsonValue& json) : json_(json) {}

  template <typename T>
  void operator()(const char* key, T& value) const {
    value = FromJson<T>(json_.at(key));
  }
  template <typename T>
  void Optional(const char* key, T& value, bool /*written*/ = true) const {
    if (json_.contains(key)) value = FromJson<T>(json_.at(key));
  }
  template <typename T>
  void Word(const char* key, T& value, std::span<const char* const> words) const {
    const JsonValue at = json_.at(key);
    const std::string word = at;
    const auto found = std::find(words.begin(), words.end(), word);
    if (found == words.end()) at.Refuse("is not one of the known words");
    value = static_cast<T>(found - words.begin());
  }

 private:
  const JsonValue& json_;
};

namespace internal {

template <typename T>
struct JsonShape {  // a described type
  static nlohmann::ordered_json Write(const T& value) {
    JsonFieldWriter writer;
    Describe(writer, value);
    return std::move(writer.json);
  }
  static T Read(const JsonValue& json) {
    T value{};
    const JsonFieldReader reader(json);
    Describe(reader, value);
    return value;
  }
};

template <typename T>
requires(kJsonCount<T> || std::same_as<T, bool> ||
         std::same_as<T, std::string>) struct JsonShape<T> {
  static nlohmann::ordered_json Write(const T& value) { return value; }
  static T Read(const JsonValue& json) { return json.get<T>(); }
};

template <>
struct JsonShape<double> {
  static nlohmann::ordered_json Write(double value) { return Number(value); }
  static double Read(const JsonValue& json) { return json.NumberOrNan(); }
};

template <typename T>
struct JsonShape<std::optional<T>> {
  static nlohmann::ordered_json Write(const std::optional<T>& value) {
    return value ? JsonOf(*value) : nlohmann::ordered_json();
  }
  static std::optional<T> Read(const JsonValue& json) {
    return json.is_null() ? std::nullopt : std::optional<T>(FromJson<T>(json));
  }
};

template <typename T>
struct JsonShape<std::vector<T>> {
  static nlohmann::ordered_json Write(const std::vector<T>& values) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const T& value : values) list.push_back(JsonOf(value));
    return list;
  }
  static std::vector<T> Read(const JsonValue& json) {
    std::vector<T> values;
    for (const JsonValue& item : json.list()) values.push_back(FromJson<T>(item));
    return values;
  }
};

template <typename T>
struct JsonShape<std::map<std::string, T>> {
  static nlohmann::ordered_json Write(const std::map<std::string, T>& values) {
    nlohmann::ordered_json object = nlohmann::ordered_json::object();
    for (const auto& [key, value] : values) object[key] = JsonOf(value);
    return object;
  }
  static std::map<std::string, T> Read(const JsonValue& json) {
    std::map<std::string, T> values;
    for (const auto& [key, item] : json.items()) values[key] = FromJson<T>(item);
    return values;
  }
};

}  // namespace internal

template <typename T>
nlohmann::ordered_json JsonOf(const T& value) {
  return internal::JsonShape<T>::Write(value);
}

template <typename T>
T FromJson(const JsonValue& json) {
  return internal::JsonShape<T>::Read(json);
}

}  // namespace mbv
