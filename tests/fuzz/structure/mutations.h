// Changes of a file's structure: parts deleted, doubled, exchanged, scaled, or made something else.
#pragma once

#include <random>
#include <string>

namespace mbv::fuzz {

using Random = std::mt19937_64;

/// Each takes a whole file that can be read and returns it with a few changes.
[[nodiscard]] std::string MutateYaml(const std::string& text, Random* random);
[[nodiscard]] std::string MutateXml(const std::string& text, Random* random);
[[nodiscard]] std::string MutateTable(const std::string& text, Random* random);
[[nodiscard]] std::string MutateJson(const std::string& text, Random* random);
/// Any bytes: some changed, left out, doubled or cut off.
[[nodiscard]] std::string MutateBytes(const std::string& bytes, Random* random);

}  // namespace mbv::fuzz
