// Consent for the programs that scenarios name.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "verify/program_consent.h"

namespace mbv {

/// --trust: the programs that scenarios name run this time.
void AddTrustOption(CLI::App* command, bool* trust);

/// Before anything runs: lists the programs of all scenarios on stderr (`quiet`: only those that
/// need consent) and asks for what is not trusted, if a person can be asked. Exit code 0 with what
/// was agreed to in `consent`, or 2 after stating what would run and how to allow it.
[[nodiscard]] int AskForPrograms(const std::vector<std::string>& scenarios,
                                 const ScenarioOptions& options, bool trust, bool quiet,
                                 ProgramConsent* consent);

/// The same of one whose programs are known (ProgramList::Lines()), for this time; true: they may.
[[nodiscard]] bool AskForPrograms(const std::string& scenario,
                                  const std::vector<std::string>& programs);
/// Shows them on stderr.
void ListPrograms(const std::string& scenario, const std::vector<std::string>& programs);

}  // namespace mbv
