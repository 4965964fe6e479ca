#include "base/names.h"

#include <algorithm>
#include <cctype>
#include <vector>

namespace mbv {
namespace {

constexpr size_t kLongestPart = 200;  // bytes; file systems take 255, endings are added

bool IsNameCharacter(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u < 0x80 && (std::isalnum(u) != 0 || c == '_');
}

bool IsLetter(char c) {
  return IsNameCharacter(c) && std::isalpha(static_cast<unsigned char>(c)) != 0;
}

bool IsPlainCharacter(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u >= 0x20 && u != 0x7F && c != '\\';
}

std::vector<std::string_view> PartsOf(std::string_view path) {
  std::vector<std::string_view> parts;
  for (size_t at = 0; at <= path.size();) {
    const size_t end = std::min(path.find('/', at), path.size());
    parts.push_back(path.substr(at, end - at));
    at = end + 1;
  }
  return parts;
}

}  // namespace

bool IsName(std::string_view name) {
  return !name.empty() && name.size() <= kLongestName && IsLetter(name[0]) &&
         std::all_of(name.begin(), name.end(), IsNameCharacter);
}

std::string NearestName(const std::string& name) {
  std::string near;
  for (const char c : name.substr(0, kLongestName)) near += IsNameCharacter(c) ? c : '_';
  while (!near.empty() && !IsLetter(near[0])) near.erase(near.begin());
  while (!near.empty() && near.back() == '_') near.pop_back();
  return near;
}

bool IsPlainPath(std::string_view path) {
  const std::vector<std::string_view> parts = PartsOf(path);
  return std::all_of(parts.begin(), parts.end(), [](std::string_view part) {
    return !part.empty() && part[0] != '.' && part.size() <= kLongestPart &&
           std::all_of(part.begin(), part.end(), IsPlainCharacter);
  });
}

std::string NearestPlainPath(std::string_view path) {
  std::string near;
  for (const std::string_view part : PartsOf(path)) {
    if (part.empty()) continue;
    if (!near.empty()) near += '/';
    near += part[0] == '.' ? '_' : IsPlainCharacter(part[0]) ? part[0] : '_';
    for (const char c : part.substr(1, kLongestPart - 1)) near += IsPlainCharacter(c) ? c : '_';
  }
  return near;
}

}  // namespace mbv
