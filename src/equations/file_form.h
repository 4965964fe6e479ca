// A user's equations as the closed form of a scenario.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analytic/closed_form.h"
#include "equations/equations.h"

namespace mbv {

/// A closed form out of a file, or why there is none.
struct FileForm {
  std::unique_ptr<ClosedForm> closed_form;
  /// Why the equations do not apply: other commands, another mechanism, loads or masses that they
  /// do not cover. Empty where there is a closed form, and after errors.
  std::vector<Finding> uncovered;
  /// For every verdict: what they take for granted is not stated. "" where it is.
  std::string unchecked;
};

/// The form of the file whose commands are the scenario's. It is tried at the motion's first
/// instant: what does not work there is an error in `diagnostics`, with the file's own line; so are
/// stated rates that are not the derivatives of the positions.
[[nodiscard]] FileForm MakeFileForm(const std::string& file, const Mechanism& mechanism,
                                    const Motion& motion, Diagnostics* diagnostics);

}  // namespace mbv
