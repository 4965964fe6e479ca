// JSON documents that others may have written or damaged: one way to read them, which names the
// key, or the line, of what it refuses.
//
//   const JsonRead<Part> part = ReadJson(text, [](const JsonValue& root) {
//     return Part{root.at("name"), root.value("count", 1)};
//   });
//   if (!part.value) diagnostics->Add(part.refusal.FindingIn(file));
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/diagnostics.h"

namespace mbv {

/// What a document is refused for.
struct JsonRefusal {
  std::string key = {};      ///< "cases[3].metrics"; "" of the whole document
  int line = 0, column = 0;  ///< where the text is not JSON; 0 elsewhere
  std::string message = {};  ///< "is a number where a text is needed"
  std::string hint = {};

  /// "cases[3].metrics is a number where …", or "line 3, character 7: …".
  [[nodiscard]] std::string Text() const;
  [[nodiscard]] Finding FindingIn(const std::string& file) const;
};

namespace internal {
template <typename T>
inline constexpr bool kJsonCount =
    std::is_integral_v<T> && !std::is_same_v<T, bool> && !std::is_same_v<T, char>;
template <typename T>
struct JsonParts : std::bool_constant<kJsonCount<T> || std::is_same_v<T, bool> ||
                                      std::is_same_v<T, double> || std::is_same_v<T, std::string>> {
};
template <typename T>
struct JsonParts<std::vector<T>> : JsonParts<T> {};
template <typename T>
struct JsonParts<std::map<std::string, T>> : JsonParts<T> {};
}  // namespace internal

/// What a value can be asked for: bool, whole numbers, double, text; lists and maps of these.
template <typename T>
concept JsonReadable = internal::JsonParts<T>::value;

/// A value of a document, with its place. What is not as asked for throws its JsonRefusal, which
/// ReadJson() catches.
class JsonValue {
 public:
  explicit JsonValue(const nlohmann::json& json, std::string path = {})
      : json_(&json), path_(std::move(path)) {}

  [[nodiscard]] bool is_null() const { return json_->is_null(); }
  [[nodiscard]] const nlohmann::json& json() const { return *json_; }
  [[nodiscard]] bool contains(const std::string& key) const;  ///< of an object
  [[nodiscard]] JsonValue at(const std::string& key) const;
  [[nodiscard]] JsonValue at(size_t index) const;
  [[nodiscard]] std::vector<JsonValue> list() const;
  [[nodiscard]] std::vector<std::pair<std::string, JsonValue>> items() const;  ///< of an object
  /// A number; NaN of null.
  [[nodiscard]] double NumberOrNan() const;

  template <JsonReadable T>
  [[nodiscard]] T get() const {
    T value{};
    Take(&value);
    return value;
  }
  template <JsonReadable T>
  operator T() const {  // NOLINT(google-explicit-constructor): as of the library's values
    return get<T>();
  }
  /// `otherwise` where the key is left out.
  template <JsonReadable T>
  [[nodiscard]] T value(const std::string& key, T otherwise) const {
    return contains(key) ? at(key).get<T>() : otherwise;
  }
  [[nodiscard]] std::string value(const std::string& key, const char* otherwise) const {
    return value(key, std::string(otherwise));
  }

  /// Of a document of another schema, which is named only if it is another version of the same: a
  /// file of another kind may hold what must not be shown.
  [[noreturn]] void RefuseSchema(const std::string& found, const std::string& needed) const;
  /// Refuses the document for this value.
  [[noreturn]] void Refuse(std::string message, std::string hint = {}) const;

 private:
  void Take(bool* value) const;
  void Take(double* value) const;
  void Take(std::string* value) const;
  template <typename T>
  void Take(T* value) const requires(internal::kJsonCount<T>) {
    const auto least =
        static_cast<std::int64_t>(std::is_signed_v<T> ? std::numeric_limits<T>::min() : T{0});
    const auto most = static_cast<std::uint64_t>(std::numeric_limits<T>::max());
    DemandCount(least, most);
    *value = json_->get<T>();
  }
  template <typename T>
  void Take(std::vector<T>* value) const {
    for (const JsonValue& item : list()) value->push_back(item.get<T>());
  }
  template <typename T>
  void Take(std::map<std::string, T>* value) const {
    for (const auto& [key, item] : items()) (*value)[key] = item.template get<T>();
  }
  void DemandCount(std::int64_t least, std::uint64_t most) const;
  [[noreturn]] void RefuseKind(const char* needed) const;

  const nlohmann::json* json_;
  std::string path_;
};

/// A document that was read, or why not.
template <typename T>
struct JsonRead {
  std::optional<T> value;
  JsonRefusal refusal = {};  ///< where there is no value

  explicit operator bool() const { return value.has_value(); }
};

/// Parses a text; an object, at most 100 levels deep. Throws JsonRefusal: for ReadJson(), and for
/// who catches it.
[[nodiscard]] nlohmann::json ParseJsonDocument(std::string_view text);

/// `read` makes something of the document's root. Where it states a schema, `schema` must be it.
template <typename Read>
[[nodiscard]] auto ReadJson(std::string_view text, const Read& read, const char* schema = nullptr)
    -> JsonRead<std::invoke_result_t<Read, const JsonValue&>> {
  try {
    const nlohmann::json document = ParseJsonDocument(text);
    const JsonValue root(document);
    if (schema != nullptr) {
      const std::string found = root.at("schema");
      if (found != schema) {
        root.at("schema").RefuseSchema(found, schema);
      }
    }
    return {read(root), {}};
  } catch (JsonRefusal& refusal) {
    return {{}, std::move(refusal)};
  }
}

}  // namespace mbv
