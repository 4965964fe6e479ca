#include "core/json_text.h"

namespace mbv {
namespace {

template <typename Json>
std::string Dumped(const Json& json, int blanks) {
  return json.dump(blanks, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

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
  return Json::parse(text, nullptr, false);
}

template std::string DumpLine(const nlohmann::json&);
template nlohmann::json ParseJson(std::string_view);
template nlohmann::json ParseIfJson(std::string_view);
template std::string DumpLine(const nlohmann::ordered_json&);
template nlohmann::ordered_json ParseJson(std::string_view);
template nlohmann::ordered_json ParseIfJson(std::string_view);

}  // namespace mbv
