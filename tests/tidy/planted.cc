// A mistake for the test `tidy_is_missed`; part of no program.
#include <string>
#include <utility>
#include <vector>

std::string FirstOfMoved(std::vector<std::string> words) {
  const std::vector<std::string> kept = std::move(words);
  return kept.empty() ? "" : words.front();
}
