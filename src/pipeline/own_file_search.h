// Settings that would mend a user's file. Internal to pipeline/.
#pragma once

#include "pipeline/own_file_runs.h"

namespace mbv {

/// Tries settings until the time is over, recommends one and runs the file with its lines in it.
/// `base`: how every run is led and what it leaves out; `own`: the file's run with that.
void SearchSettings(const OwnFileRequest& request, const OwnSettings& base,
                    const OwnFileRuns::Measured& own, OwnFileRuns* runs, OwnFileAudit* audit);

}  // namespace mbv
