// Drive forces of one witness against another.

#include <fmt/format.h>
#include <algorithm>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/biconnected_components.hpp>
#include <cmath>
#include <optional>
#include <set>

#include "comparison/driven.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/pair_reader.h"
#include "mechanism/channels.h"
#include "mechanism/reach.h"

namespace mbv::internal {
namespace {

// Fewer samples behind a start window are a window around what disagrees.
constexpr size_t kFewestBehindWindow = 5;

struct DriveError {
  size_t drive = 0;
  std::string unit;
  ErrorSum sum;
};

// From 0.1 % of the drive's own scale, or of the RMS force of the drives that carry the same,
// whichever is larger: a drive that holds nothing has no scale of its own.
double FloorOf(const ForceScale& scale, const std::vector<DriveError>& errors, size_t drive,
               const std::string& unit) {
  ErrorSum same;
  for (const DriveError& other : errors) {
    if (other.unit == unit && scale.carries[other.drive][drive]) same.Merge(other.sum);
  }
  const double idle = ForceScale::kIdle * same.rms_truth();
  return std::isnan(idle) ? idle : std::max(idle, scale.Floor(drive));
}

DriveMetrics DriveMetricsOf(const Drive& drive, const std::string& unit, const ErrorSum& force,
                            double floor) {
  const Measured nrmse = force.MeasuredNrmse(floor);
  return {.drive = drive.name,
          .unit = unit,
          .rms_truth = force.rms_truth(),
          .nrmse = nrmse.value,
          .max_error = force.max_error(),
          .max_relative = force.MaxRelative(floor),
          .digits = MatchingDigits(nrmse.value),
          .floored = nrmse.floored,
          .time_s = force.worst_time_s()};
}

// RMS of the measured force, and its best fit measured = factor · truth, where both are numbers.
void FitFactor(const PairReader& reader, Columns columns, double start_s, DriveMetrics* metrics) {
  const ForceSignal measured(reader.measured, columns.measured);
  const ForceSignal truth(reader.truth, columns.truth);
  double all = 0.0, ab = 0.0, bb = 0.0, count = 0.0;
  std::vector<std::pair<double, double>> numbers;
  for (const auto& [i, j] : reader.samples) {
    if (reader.measured.time_s[static_cast<size_t>(i)] < start_s) continue;
    const ForceBand a = measured.At(i), b = truth.At(j);
    all += a.middle * a.middle;
    count += 1.0;
    if (a.open() || b.open()) continue;
    ab += a.middle * b.middle;
    bb += b.middle * b.middle;
    numbers.emplace_back(a.middle, b.middle);
  }
  metrics->rms_measured = std::sqrt(all / count);
  metrics->factor = ab / bb;
  double residual2 = 0.0, offset = 0.0, beside2 = 0.0;
  for (const auto& [a, b] : numbers) {
    const double r = a - metrics->factor * b;
    residual2 += r * r;
    offset += (a - b) / static_cast<double>(numbers.size());
  }
  for (const auto& [a, b] : numbers) beside2 += (a - b - offset) * (a - b - offset);
  metrics->factor_residual = std::sqrt(residual2 / bb);
  metrics->offset_residual = std::sqrt(beside2 / bb);
}

// Errors of all drives that both have; `wanted` counts those that are not given their force.
std::vector<DriveError> DriveErrors(const ComparisonInput& input, const PairReader& reader,
                                    size_t* wanted) {
  std::vector<DriveError> errors;
  for (size_t d = 0; d < input.mechanism->drives.size(); ++d) {
    // Given to both.
    if (input.motion->FindForce(static_cast<int>(d)) >= 0) continue;
    if (SharesForces(input, reader.measured.witness, reader.truth.witness)) continue;
    const Drive& drive = input.mechanism->drives[d];
    ++*wanted;
    const std::string channel = ChannelName(Quantity::kForce, drive.name);
    const Columns columns = reader.Find(channel);
    if (!columns.both()) continue;
    const ErrorSum sum = reader.SumForces(channel, columns, input.start_window_s);
    if (sum.count() > 0) errors.push_back({d, ForceUnit(*input.mechanism, drive), sum});
  }
  return errors;
}

// Where forces were judged, in time.
void FindSpan(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  for (const auto& [i, j] : reader.samples) {
    const double time_s = reader.measured.time_s[static_cast<size_t>(i)];
    if (time_s < input.start_window_s) continue;
    if (std::isnan(pair->from_s)) pair->from_s = time_s;
    pair->to_s = time_s;
  }
}

// Samples in the judged window at which friction at rest leaves some force open in one of the two.
size_t CountAtRest(const ComparisonInput& input, const PairReader& reader) {
  const std::vector<bool> a = AtRest(reader.measured), b = AtRest(reader.truth);
  size_t count = 0;
  for (const auto& [i, j] : reader.samples) {
    const auto row = static_cast<size_t>(i);
    if (reader.measured.time_s[row] < input.start_window_s) continue;
    count += a[row] || b[static_cast<size_t>(j)] ? 1 : 0;
  }
  return count;
}

// Says why the pair's forces were not compared; "" if they were. A table need not hold every drive.
std::string NotComparableReason(const ComparisonInput& input, const PairReader& reader,
                                size_t wanted, const PairComparison& pair) {
  const bool table = input.table != nullptr && pair.Involves(role::kReference);
  if (reader.samples.empty()) return "the two have no sample time in common";
  const bool motion_only =
      input.motion->free() || SharesForces(input, reader.measured.witness, reader.truth.witness);
  if (pair.drives.empty() && !(motion_only && wanted == 0)) {
    return "no drive force is in both, or no sample is in the judged window";
  }
  if (pair.drives.size() != wanted && !table) {
    return "drive forces of some drives are missing in one of the two";
  }
  if (input.start_window_s > 0.0 && !pair.drives.empty() &&
      pair.force_samples < kFewestBehindWindow) {
    return fmt::format("the start window of {:g} s leaves {} sample{} to judge, fewer than {}",
                       input.start_window_s, pair.force_samples, pair.force_samples == 1 ? "" : "s",
                       kFewestBehindWindow);
  }
  return "";
}

}  // namespace

void CompareForces(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  const ForceScale scale = ForceScaleOf(input, reader.truth);
  size_t wanted = 0;
  const std::vector<DriveError> errors = DriveErrors(input, reader, &wanted);
  std::map<std::string, ErrorSum> pooled;
  for (const auto& [d, unit, sum] : errors) {
    const Drive& drive = input.mechanism->drives[d];
    const double floor = FloorOf(scale, errors, d, unit);
    pair->drives.push_back(DriveMetricsOf(drive, unit, sum, floor));
    FitFactor(reader, reader.Find(ChannelName(Quantity::kForce, drive.name)), input.start_window_s,
              &pair->drives.back());
    KeepWorst(&pair->metrics, Metric::kForceOwn, sum.MeasuredNrmse(floor));
    pair->force_samples = sum.count();
    pooled[unit].Merge(sum);
  }
  for (const auto& [unit, sum] : pooled) {
    const double floor = scale.Floor(unit);
    KeepWorst(&pair->metrics, Metric::kForceNrmse, sum.MeasuredNrmse(floor));
    KeepWorst(&pair->metrics, Metric::kForceMax, sum.MeasuredMax(floor));
  }
  FindSpan(input, reader, pair);
  pair->samples_at_rest = CountAtRest(input, reader);
  pair->forces_act = scale.acts;
  pair->reason = NotComparableReason(input, reader, wanted, *pair);
  pair->compared = pair->reason.empty();
  if (pair->compared && !pair->drives.empty()) {
    pair->digits = MatchingDigits(pair->metrics[Metric::kForceNrmse].value);
  }
}

// Reactions of joints and forces of prescribed joints of one witness against another.

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
    if (DofsOf(joint.kind) == 6) continue;  // transmits nothing
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

// What a body has anyway: its weight and the forces of its joints; the moment that turns it.
struct Local {
  double force_N = 0.0, moment_Nm = 0.0;
};

// The loops that joints belong to. Legs hold as joints do; loops that meet in one body only (the
// world, mostly) are apart: they are the blocks of the graph whose vertices are bodies and joints
// [Hopcroft, Tarjan 1973].
class Loops {
 public:
  explicit Loops(const Mechanism& mechanism) : graph_(mechanism.bodies.size()) {
    for (const Joint& joint : mechanism.joints) {
      Add(joint.parent, joint.child, DofsOf(joint.kind) < 6);
    }
    for (const Drive& drive : mechanism.drives) {
      if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
        Add(leg->body_from, leg->body_to, true);
      }
    }
    block_.assign(bodies_.size(), 0);
    count_ = boost::biconnected_components(
        graph_, boost::make_iterator_property_map(block_.begin(), get(boost::edge_index, graph_)));
  }
  [[nodiscard]] size_t count() const { return count_; }
  /// Of a joint, in the mechanism's order; none if it closes no loop.
  [[nodiscard]] std::optional<size_t> Of(size_t joint) const {
    const size_t block = block_[2 * joint];
    return block == block_[2 * joint + 1] ? std::optional(block) : std::nullopt;
  }
  /// Calls `visit(loop, body)` for every body at a joint or leg, repeatedly.
  template <typename Visit>
  void ForEach(const Visit& visit) const {
    for (size_t e = 0; e < bodies_.size(); ++e) visit(block_[e], bodies_[e]);
  }

 private:
  // What does not hold its child leads nowhere.
  void Add(int parent, int child, bool holds) {
    const auto joint = boost::add_vertex(graph_);
    for (const int body : {parent, child}) {
      const auto to = static_cast<size_t>(body);
      boost::add_edge(joint, holds ? to : boost::add_vertex(graph_), bodies_.size(), graph_);
      bodies_.push_back(to);
    }
  }

  boost::adjacency_list<boost::vecS, boost::vecS, boost::undirectedS, boost::no_property,
                        boost::property<boost::edge_index_t, size_t>>
      graph_;
  std::vector<size_t> bodies_, block_;  ///< per edge
  size_t count_ = 0;
};

// Per joint, of which all together bear `rms_N`. Where it closes no loop, equilibrium of the
// smaller of its bodies gives its reaction. In a loop equilibrium of one body does not: a rod
// transmits what the bodies at its ends leave, and were it massless that would be all. There the
// loop's largest body counts. A massless end bears nothing, and in a simulation what its stand-in
// for the mass weighs: there all joints count.
std::vector<Local> LocalScales(const ComparisonInput& input, const ForceScale& scale,
                               const std::vector<JointError>& errors, double rms_N) {
  const Mechanism& mechanism = *input.mechanism;
  std::vector<Local> bodies(mechanism.bodies.size());
  const auto raise = [](Local* local, const Local& by) {
    *local = {std::max(local->force_N, by.force_N), std::max(local->moment_Nm, by.moment_Nm)};
  };
  for (size_t b = 1; b < bodies.size(); ++b) {
    bodies[b] = {mechanism.bodies[b].mass * scale.acceleration[b], scale.moment[b]};
  }
  for (const JointError& error : errors) {
    for (const int body : {error.joint->parent, error.joint->child}) {
      if (body > 0) raise(&bodies[static_cast<size_t>(body)], {OrZero(error.force.rms_truth())});
    }
  }
  const Loops loops(mechanism);
  std::vector<Local> of_loops(loops.count()), joints;
  loops.ForEach([&](size_t loop, size_t body) { raise(&of_loops[loop], bodies[body]); });
  for (size_t b = 1; b < bodies.size(); ++b) {
    if (IsMassless(mechanism.bodies[b]) && bodies[b].force_N == 0.0) bodies[b].force_N = rms_N;
  }
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (const auto loop = loops.Of(j)) {
      joints.push_back(of_loops[*loop]);
      continue;
    }
    const Joint& joint = mechanism.joints[j];
    const Local& a = bodies[static_cast<size_t>(joint.parent)];
    const Local& b = bodies[static_cast<size_t>(joint.child)];
    joints.push_back(joint.parent == 0  ? b
                     : joint.child == 0 ? a
                                        : Local{std::min(a.force_N, b.force_N),
                                                std::min(a.moment_Nm, b.moment_Nm)});
  }
  return joints;
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
  const double rms_N = OrZero(all.rms_truth()), roundoff = kRoundoff * rms_N;
  const std::vector<Local> scales = LocalScales(input, scale, errors, rms_N);
  for (const JointError& error : errors) {
    const auto joint = static_cast<size_t>(error.joint - input.mechanism->joints.data());
    const double turned = scales[joint].moment_Nm;
    const double local = std::max(scales[joint].force_N, kMomentArm * turned / scale.length_m);
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
