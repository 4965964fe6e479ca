// The manual page of the program, of what its commands say of themselves.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace mbv {

/// man(7) source, section 1: every command and option that help shows, with examples and exit
/// codes. `version` stands at its foot.
[[nodiscard]] std::string ManPage(const CLI::App& app, const std::string& version);

}  // namespace mbv
