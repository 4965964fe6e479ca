#include "base/json_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/json_document.h"
#include "base/text.h"

namespace mbv {
namespace {

constexpr int kMostLevels = 100;     // of nesting: what follows a document recurses
constexpr size_t kMostQuoted = 200;  // characters of a refusal, which may quote the document

// What a terminal obeys or a reader does not see, as \uXXXX: the value is the same, the text shows
// it.
std::string Visible(std::string json) {
  const auto is_plain = [](char c) { return (c >= ' ' && c != '\x7f') || c == '\n'; };
  if (std::ranges::all_of(json, is_plain)) return json;
  std::string visible;
  for (size_t at = 0; at < json.size();) {
    if (is_plain(json[at])) {
      visible += json[at++];
      continue;
    }
    const auto first = static_cast<unsigned char>(json[at]);
    const size_t length = first < 0xC0 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
    const std::string_view character = std::string_view(json).substr(at, length);
    at += length;
    if (OneLine(character) == character) {
      visible += character;
      continue;
    }
    const std::string escaped = nlohmann::json(character).dump(-1, ' ', true);
    visible += character == "\x7f" ? "\\u007f" : escaped.substr(1, escaped.size() - 2);
  }
  return visible;
}

template <typename Json>
std::string Dumped(const Json& json, int blanks) {
  return Visible(json.dump(blanks, ' ', false, Json::error_handler_t::replace));
}

// Without what a terminal obeys, and not longer than a line that is read.
std::string Clipped(const std::string& text) {
  std::string clipped = Printable(text);
  if (clipped.size() <= kMostQuoted) return clipped;
  size_t end = kMostQuoted;
  while (end > 0 && (static_cast<unsigned char>(clipped[end]) & 0xC0U) == 0x80U) --end;
  return clipped.substr(0, end) + " …";
}

JsonRefusal NotJson(std::string_view text, size_t byte) {
  const size_t at = std::min(byte == 0 ? 0 : byte - 1, text.size());
  const std::string_view before = text.substr(0, at);
  const size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
  const bool ends = byte > text.size();
  return {.line = static_cast<int>(std::count(before.begin(), before.end(), '\n')) + 1,
          .column = static_cast<int>(at - line_start) + 1,
          .message = text.empty() ? "the file is empty, where a JSON object is needed"
                     : ends       ? "the file ends before its JSON does"
                                  : "this is not JSON: what stands here cannot continue it"};
}

const char* KindOf(const nlohmann::json& json) {
  switch (json.type()) {
    case nlohmann::json::value_t::null:
      return "null";
    case nlohmann::json::value_t::object:
      return "an object";
    case nlohmann::json::value_t::array:
      return "a list";
    case nlohmann::json::value_t::string:
      return "a text";
    case nlohmann::json::value_t::boolean:
      return "true or false";
    default:
      return "a number";
  }
}

// Parses without running down a document that is nested too deep; throws as the library does, and
// a JsonRefusal.
template <typename Json>
Json ParseShallow(std::string_view text) {
  const auto level = [](int depth, typename Json::parse_event_t, Json&) {
    if (depth <= kMostLevels) return true;
    throw JsonRefusal{.message =
                          fmt::format("the JSON is nested more than {} levels deep", kMostLevels)};
  };
  return Json::parse(text, level);
}

}  // namespace

std::string JsonRefusal::Text() const {
  const std::string place = line > 0      ? fmt::format("line {}, character {}: ", line, column)
                            : key.empty() ? ""
                                          : Clipped(key) + " ";
  return place + Clipped(message);
}

Finding JsonRefusal::FindingIn(const std::string& file) const {
  return {.file = file,
          .line = line,
          .column = column,
          .message = (line > 0 || key.empty() ? "" : Clipped(key) + " ") + Clipped(message),
          .hint = hint};
}

bool JsonValue::contains(const std::string& key) const {
  if (!json_->is_object()) RefuseKind("an object");
  return json_->contains(key);
}

JsonValue JsonValue::at(const std::string& key) const {
  const std::string path = (path_.empty() ? "" : path_ + ".") + key;
  if (!contains(key)) JsonValue(*json_, path).Refuse("is missing");
  return JsonValue(json_->at(key), path);
}

JsonValue JsonValue::at(size_t index) const {
  if (!json_->is_array()) RefuseKind("a list");
  const std::string path = fmt::format("{}[{}]", path_, index);
  if (index >= json_->size()) JsonValue(*json_, path).Refuse("is missing");
  return JsonValue(json_->at(index), path);
}

std::vector<JsonValue> JsonValue::list() const {
  if (!json_->is_array()) RefuseKind("a list");
  std::vector<JsonValue> list;
  list.reserve(json_->size());
  for (size_t i = 0; i < json_->size(); ++i) list.push_back(at(i));
  return list;
}

std::vector<std::pair<std::string, JsonValue>> JsonValue::items() const {
  if (!json_->is_object()) RefuseKind("an object");
  std::vector<std::pair<std::string, JsonValue>> items;
  for (const auto& [key, value] : json_->items()) items.emplace_back(key, at(key));
  return items;
}

double JsonValue::NumberOrNan() const {
  return is_null() ? std::numeric_limits<double>::quiet_NaN() : get<double>();
}

void JsonValue::Refuse(std::string message, std::string hint) const {
  throw JsonRefusal{.key = path_, .message = std::move(message), .hint = std::move(hint)};
}

void JsonValue::RefuseSchema(const std::string& found, const std::string& needed) const {
  constexpr size_t kLongest = 40;
  if (found.starts_with(needed.substr(0, needed.rfind('/') + 1)) && found.size() <= kLongest) {
    Refuse(fmt::format("is '{}', needed is {}", found, needed),
           "another version of mbverify may have written it");
  }
  Refuse("is not " + needed, "the file is of another kind");
}

void JsonValue::RefuseKind(const char* needed) const {
  Refuse(fmt::format("is {} where {} is needed", KindOf(*json_), needed));
}

void JsonValue::Take(bool* value) const {
  if (!json_->is_boolean()) RefuseKind("true or false");
  *value = json_->get<bool>();
}

void JsonValue::Take(double* value) const {
  if (!json_->is_number()) RefuseKind("a number");
  *value = json_->get<double>();
}

void JsonValue::Take(std::string* value) const {
  if (!json_->is_string()) RefuseKind("a text");
  *value = json_->get_ref<const std::string&>();
}

void JsonValue::DemandCount(std::int64_t least, std::uint64_t most) const {
  if (!json_->is_number_integer()) RefuseKind("a whole number");
  const bool inside = json_->is_number_unsigned() ? json_->get<std::uint64_t>() <= most
                                                  : json_->get<std::int64_t>() >= least;
  if (!inside) Refuse(fmt::format("is {}, needed is {} … {}", json_->dump(), least, most));
}

nlohmann::json ParseJsonDocument(std::string_view text) {
  nlohmann::json document;
  try {
    document = ParseShallow<nlohmann::json>(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw NotJson(text, error.byte);
  } catch (const nlohmann::json::exception&) {
    throw JsonRefusal{.message = "a number of it is too large"};
  }
  if (!document.is_object())
    JsonValue(document).Refuse(
        fmt::format("the document is {} where an object is needed", KindOf(document)));
  return document;
}

std::string Dump(const nlohmann::ordered_json& json, int blanks) {
  return Dumped(json, blanks) + "\n";
}

template <typename Json>
std::string DumpLine(const Json& json) {
  return Dumped(json, -1);
}

template <typename Json>
Json ParseJson(std::string_view text) {
  return Json::parse(text);
}

template <typename Json>
Json ParseIfJson(std::string_view text) {
  try {
    return ParseShallow<Json>(text);
  } catch (const typename Json::exception&) {
  } catch (const JsonRefusal&) {
  }
  return Json(Json::value_t::discarded);
}

template std::string DumpLine(const nlohmann::json&);
template nlohmann::json ParseJson(std::string_view);
template nlohmann::json ParseIfJson(std::string_view);
template std::string DumpLine(const nlohmann::ordered_json&);
template nlohmann::ordered_json ParseJson(std::string_view);
template nlohmann::ordered_json ParseIfJson(std::string_view);

}  // namespace mbv
