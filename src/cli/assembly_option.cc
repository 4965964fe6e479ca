#include "cli/assembly_option.h"

#include <charconv>

#include "cli/terminal.h"

namespace mbv {

void AddAssemblyOption(CLI::App* command, std::vector<std::string>* texts) {
  command
      ->add_option("--assembly", *texts,
                   "CLOSURE=N: takes the N-th of the ways to close the loops of this closure that "
                   "are told (repeatable)")
      ->allow_extra_args(false);
}

bool ReadAssembly(const std::vector<std::string>& texts, std::map<std::string, int>* assembly) {
  bool good = true;
  for (const std::string& text : texts) {
    const size_t at = text.rfind('=');
    const std::string number = at == std::string::npos ? "" : text.substr(at + 1);
    int n = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), n);
    if (at == 0 || error != std::errc() || end != number.data() + number.size() || n < 1) {
      Say(stderr, "--assembly {}: error: write CLOSURE=N with N from 1, e.g. knee_loop=2\n", text);
      good = false;
      continue;
    }
    (*assembly)[text.substr(0, at)] = n;
  }
  return good;
}

}  // namespace mbv
