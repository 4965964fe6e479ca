// What the program consists of: one row per command and one per kind of document. A product leaves
// with its folder in features/ and its rows in program.cc.
#pragma once

namespace mbv {

/// Makes the kinds of documents known to CheckFile (verify/check_file.h).
void UseDocumentKinds();

/// Runs the program; never throws. Exit codes: cli/cli.h.
[[nodiscard]] int RunProgram(int argc, char** argv);

}  // namespace mbv
