// Reactions of joints and forces of prescribed joints of one witness against another.
#include <algorithm>
#include <cmath>
#include <set>

#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/pair_reader.h"
#include "mechanism/channels.h"

namespace mbv::internal {
namespace {

// Moments count as small when the joint's forces would make them at this share of the
// characteristic length, and forces when this share of its moments would make them at that length.
constexpr double kMomentArm = 1e-3;
// Reactions below this share of the RMS of all of them are round-off of the whole mechanism.
constexpr double kRoundoff = 1e-9;

struct JointError {
  const Joint* joint = nullptr;
  ErrorSum force, moment;
};

// Where one knows only that something rests, its reactions are those without friction there; the
// other's, which moves by forces, contain the friction that holds.
PairReader WithoutOneSidedRest(const PairReader& reader) {
  const std::vector<bool> measured = AtRest(reader.measured), truth = AtRest(reader.truth);
  PairReader known = reader;
  std::erase_if(known.samples, [&](const auto& rows) {
    return measured[static_cast<size_t>(rows.first)] != truth[static_cast<size_t>(rows.second)];
  });
  return known;
}

double OrZero(double rms) { return std::isnan(rms) ? 0.0 : rms; }

std::vector<JointError> JointErrors(const ComparisonInput& input, const PairReader& reader) {
  const std::set<std::string> open(input.reactions_not_unique.begin(),
                                   input.reactions_not_unique.end());
  std::vector<JointError> errors;
  for (const Joint& joint : input.mechanism->joints) {
    if (FreedomsOf(joint.kind) == 6) continue;  // transmits nothing
    JointError error{.joint = &joint, .force = {}, .moment = {}};
    for (const Channel& channel : ReactionChannels(joint)) {
      const Columns c = reader.Find(channel.name);
      if (!c.both() || open.contains(channel.name)) continue;
      const Channel& a = reader.measured.channels[static_cast<size_t>(c.measured)];
      const Channel& b = reader.truth.channels[static_cast<size_t>(c.truth)];
      if (a.frame != b.frame || a.unit != b.unit) continue;
      (channel.unit == "N" ? error.force : error.moment)
          .Merge(reader.Sum(channel.name, c, input.start_window_s, false));
    }
    if (error.force.count() + error.moment.count() > 0) errors.push_back(std::move(error));
  }
  return errors;
}

// What the joint's bodies have anyway: the smaller moment that turning one of them takes.
double LocalMoment(const ForceScale& scale, const Joint& joint) {
  double smallest = kNan;
  for (const int body : {joint.parent, joint.child}) {
    const auto b = static_cast<size_t>(body);
    if (b > 0 && !(smallest <= scale.moment[b])) smallest = scale.moment[b];
  }
  return OrZero(smallest);
}

// The same for forces: the smaller one's weight and the forces of its joints.
double LocalForce(const ComparisonInput& input, const ForceScale& scale,
                  const std::vector<JointError>& errors, const Joint& joint) {
  double smallest = kNan;
  for (const int body : {joint.parent, joint.child}) {
    const auto b = static_cast<size_t>(body);
    if (b == 0) continue;
    double local = input.mechanism->bodies[b].mass * scale.acceleration[b];
    for (const JointError& error : errors) {
      if (error.joint->parent != body && error.joint->child != body) continue;
      local = std::max(local, OrZero(error.force.rms_truth()));
    }
    if (!(smallest <= local)) smallest = local;
  }
  return OrZero(smallest);
}

// Pooled over all joints, as the drives' forces are.
void ComparePooled(const ForceScale& scale, const std::vector<JointError>& errors,
                   PairComparison* pair) {
  ErrorSum forces, moments;
  for (const JointError& error : errors) {
    forces.Merge(error.force);
    moments.Merge(error.moment);
  }
  const double least =
      ForceScale::kIdle * std::max(scale.force_N, kMomentArm * scale.moment_Nm / scale.length_m);
  if (forces.count() > 0) {
    KeepWorst(&pair->metrics, Metric::kReaction, forces.MeasuredNrmse(least));
  }
  if (moments.count() > 0) {
    const double floor =
        std::max(std::max(OrZero(forces.rms_truth()), least) * kMomentArm * scale.length_m,
                 ForceScale::kIdle * scale.moment_Nm);
    KeepWorst(&pair->metrics, Metric::kReaction, moments.MeasuredNrmse(floor));
  }
}

// Each joint on its own scale.
void CompareOwn(const ComparisonInput& input, const ForceScale& scale,
                const std::vector<JointError>& errors, PairComparison* pair) {
  ErrorSum all;
  for (const JointError& error : errors) all.Merge(error.force);
  const double roundoff = kRoundoff * OrZero(all.rms_truth());
  for (const JointError& error : errors) {
    const double turned = LocalMoment(scale, *error.joint);
    const double local = std::max(LocalForce(input, scale, errors, *error.joint),
                                  kMomentArm * turned / scale.length_m);
    const double least = std::max(ForceScale::kIdle * local, roundoff);
    if (error.force.count() > 0) {
      KeepWorst(&pair->metrics, Metric::kReactionOwn, error.force.MeasuredNrmse(least));
    }
    if (error.moment.count() == 0) continue;
    const double floor =
        std::max(OrZero(error.force.rms_truth()), local) * kMomentArm * scale.length_m;
    KeepWorst(&pair->metrics, Metric::kReactionOwn,
              error.moment.MeasuredNrmse(
                  std::max({floor, roundoff * scale.length_m, ForceScale::kIdle * turned})));
  }
}

void CompareBase(const ComparisonInput& input, const PairReader& reader, const ForceScale& scale,
                 PairComparison* pair) {
  const size_t drives = input.mechanism->drives.size();
  for (size_t p = 0; p < input.mechanism->prescribed.size(); ++p) {
    const std::string channel =
        ChannelName(Quantity::kBaseForce, input.mechanism->prescribed[p].name);
    const Columns columns = reader.Find(channel);
    if (!columns.both()) continue;
    const ErrorSum sum = reader.SumForces(channel, columns, input.start_window_s);
    if (sum.count() == 0) continue;
    KeepWorst(&pair->metrics, Metric::kBaseForce, sum.MeasuredNrmse(scale.Floor(drives + p)));
  }
}

}  // namespace

void CompareReactions(const ComparisonInput& input, const PairReader& reader,
                      PairComparison* pair) {
  const ForceScale scale = ForceScaleOf(input, reader.truth);
  const std::vector<JointError> errors = JointErrors(input, WithoutOneSidedRest(reader));
  for (const JointError& error : errors) pair->reactions.push_back(error.joint->name);
  ComparePooled(scale, errors, pair);
  CompareOwn(input, scale, errors, pair);
  CompareBase(input, reader, scale, pair);
}

}  // namespace mbv::internal
