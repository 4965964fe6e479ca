// A certificate as it is shown, and what it does to a verdict.
#pragma once

#include "features/certify/certify.h"
#include "report/report.h"
#include "verify/prepare.h"

namespace mbv {

/// Certifies a judged run, of the mechanism with the scenario's common parameters: adds
/// `certificate` to its parts. A computed witness that is wrong by proof takes an agreement away,
/// and names the culprit of a disagreement.
void AddCertificate(const Prepared& prepared, const CertifyOptions& options, Report* report);

}  // namespace mbv
