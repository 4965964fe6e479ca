// The audit of the source model (the user's MJCF): run as it is, what makes it wrong, recommended
// settings.
//
// Every number is a run of MuJoCo on the user's file in a process of its own.
#pragma once

#include <string>
#include <vector>

#include "report/source_model_report.h"
#include "verify/prepare.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct SourceModelRequest {
  std::string file;                    ///< the user's MJCF
  std::string text = {};               ///< its text; "": read from the file
  std::string base = {};               ///< LoadOptions::base with which the scenario was made
  const Prepared* prepared = nullptr;  ///< the scenario that was made of it
  /// Channels of reactions that statics leaves open.
  std::vector<std::string> reactions_not_unique = {};
  ProgressFunction progress = {};
  double search_s = 15.0;  ///< processor time for the search of settings
};

[[nodiscard]] SourceModelAudit AuditSourceModel(const SourceModelRequest& request);

}  // namespace mbv
