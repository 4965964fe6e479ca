#include "reference/load_friction.h"

#include <fmt/format.h>

#include <algorithm>

namespace mbv::internal {
namespace {

// The contraction shrinks errors by q per pass; where q is close to 1 round-off ends it first.
constexpr int kMostPasses = 2000;
constexpr double kSettled = 4.0 * kEps;

double LoadOf(const LoadSystem& system, size_t e, const VecX& n) {
  Vec3 p = system.p[e];
  for (size_t d = 0; d < system.p.size(); ++d) {
    p -= system.P[e][d] * (system.sign[d] * system.per_load[d] * n[static_cast<Eigen::Index>(d)]);
  }
  return p.norm();
}

}  // namespace

std::vector<size_t> LoadedElements(const Mechanism& mechanism) {
  std::vector<size_t> loaded;
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const auto* friction = std::get_if<FrictionLaw>(&mechanism.elements[e].law);
    if (friction != nullptr && friction->per_load() > 0.0) loaded.push_back(e);
  }
  return loaded;
}

Vec3 AcrossAxis(const Mechanism& mechanism, size_t element, const MatX& reactions) {
  const int j = mechanism.elements[element].joint;
  const Vec3 a = mechanism.joints[static_cast<size_t>(j)].axis;
  const Vec3 R = reactions.row(j).head<3>().transpose();
  return R - a * a.dot(R);
}

RunSummary LoadShared(const Mechanism& mechanism, size_t element) {
  const ForceElement& at = mechanism.elements[element];
  return {.stop = Stop::kUnsupported,
          .message = fmt::format("the load of the {} ('{}') is not determined by statics: "
                                 "redundant constraints share it",
                                 Described(mechanism, at), at.name),
          .where = at.name,
          .unit = {}};
}

double LoadSystem::Raised(size_t e) const {
  double sum = 0.0;
  for (size_t d = 0; d < P[e].size(); ++d) {
    sum += P[e][d].norm() * std::abs(sign[d]) * per_load[d];
  }
  return sum;
}

size_t LoadSystem::MostRaised() const {
  size_t most = 0;
  for (size_t e = 0; e < P.size(); ++e) {
    if (Raised(e) > Raised(most)) most = e;
  }
  return most;
}

double LoadSystem::contraction() const { return P.empty() ? 0.0 : Raised(MostRaised()); }

RunSummary LoadSystem::Solve(VecX* n) const {
  n->setZero(static_cast<Eigen::Index>(p.size()));
  const double q = contraction();
  for (int pass = 0; q < 1.0 && pass < kMostPasses; ++pass) {
    const VecX last = *n;
    for (size_t e = 0; e < p.size(); ++e)
      (*n)[static_cast<Eigen::Index>(e)] = LoadOf(*this, e, last);
    if ((*n - last).cwiseAbs().maxCoeff() <= kSettled * n->maxCoeff()) return RunSummary::Done();
  }
  return {.stop = Stop::kSingular,
          .message = fmt::format(
              "friction by the joints' loads is not determined: a load grows by {:.3g} of what it "
              "causes (less than 1 has one solution): smaller coefficients or radii are needed",
              q),
          .where = {},
          .amount = q,
          .unit = std::string("1")};
}

}  // namespace mbv::internal
