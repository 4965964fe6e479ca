#include "analytic/coverage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv {

double ParameterReader::operator()(const std::string& name) const {
  if (mechanism_.HasParameter(name)) return mechanism_.ParameterValue(name);
  auto& missing = coverage_->missing;
  if (std::find(missing.begin(), missing.end(), name) == missing.end()) missing.push_back(name);
  return kNan;
}

double ParameterReader::operator()(const std::string& name, double fallback) const {
  return mechanism_.HasParameter(name) ? mechanism_.ParameterValue(name) : fallback;
}

Vec3 ParameterReader::Vector(const std::string& stem) const {
  return {(*this)(stem + "_x"), (*this)(stem + "_y"), (*this)(stem + "_z")};
}

Vec3 ParameterReader::Vector(const std::string& stem, double fallback) const {
  return {(*this)(stem + "_x", fallback), (*this)(stem + "_y", fallback),
          (*this)(stem + "_z", fallback)};
}

Vec3 HomeAxis(const Mechanism& mechanism, const std::string& body, int axis) {
  const int index = mechanism.FindBody(body);
  if (index < 0 || mechanism.X_WB_home.size() != mechanism.bodies.size()) return kAnyVector;
  return mechanism.X_WB_home[static_cast<size_t>(index)].linear().col(axis);
}

void StateBranch(const std::string& subject, double value, const std::string& why,
                 Coverage* coverage) {
  if (std::isnan(value)) return;
  coverage->numbers.push_back({.subject = subject,
                               .quantity = "branch at home",
                               .actual = value > 0.0 ? 1.0 : -1.0,
                               .assumed = 1.0,
                               .unit = {},
                               .why = why});
}

std::vector<Finding> FindUncoveredLoads(const Coverage& coverage, const Mechanism& mechanism,
                                        const Motion& motion) {
  std::string takers;
  for (const AssumedBody& body : coverage.bodies) {
    if (body.takes_loads) takers += (takers.empty() ? "" : ", ") + body.name;
  }
  std::vector<Finding> findings;
  for (const Load& load : motion.loads) {
    const std::string& name = mechanism.bodies[size_t(load.body)].name;
    const bool taken =
        std::any_of(coverage.bodies.begin(), coverage.bodies.end(),
                    [&](const AssumedBody& body) { return body.name == name && body.takes_loads; });
    if (!load.following.empty()) {
      findings.push_back(
          {.severity = Severity::kWarning,
           .file = {},
           .message = fmt::format("load {} follows the mechanism's state", load.name),
           .hint = coverage.form + " takes loads as functions of time"});
      continue;
    }
    if (taken) continue;
    findings.push_back({.severity = Severity::kWarning,
                        .file = {},
                        .message = fmt::format("load {} acts on {}", load.name, name),
                        .hint = fmt::format("{} takes loads on {}", coverage.form, takers)});
  }
  return findings;
}

std::string ReasonToDecline(std::span<const Finding> uncovered) {
  if (uncovered.empty()) return {};
  std::string text = fmt::format("outside what the equations cover: {}; {}", uncovered[0].message,
                                 uncovered[0].hint);
  if (uncovered.size() > 1) text += fmt::format(" (and {} more)", uncovered.size() - 1);
  return text;
}

}  // namespace mbv
