#include "core/json_text.h"

namespace mbv {
namespace {

std::string Dumped(const nlohmann::ordered_json& json, int blanks) {
  return json.dump(blanks, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

std::string Dump(const nlohmann::ordered_json& json, int blanks) {
  return Dumped(json, blanks) + "\n";
}

std::string DumpLine(const nlohmann::ordered_json& json) { return Dumped(json, -1); }

template <typename Json>
Json ParseJson(std::string_view text) {
  return Json::parse(text);
}

template <typename Json>
Json ParseIfJson(std::string_view text) {
  return Json::parse(text, nullptr, false);
}

template nlohmann::json ParseJson(std::string_view);
template nlohmann::json ParseIfJson(std::string_view);
template nlohmann::ordered_json ParseJson(std::string_view);
template nlohmann::ordered_json ParseIfJson(std::string_view);

}  // namespace mbv
