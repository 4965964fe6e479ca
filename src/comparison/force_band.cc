#include "comparison/force_band.h"

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

int BandColumn(const Trace& trace, int column) {
  const Channel& force = trace.channels[static_cast<size_t>(column)];
  const Quantity band = BandOf(force.quantity);
  return band == Quantity::kOwn ? -1 : trace.Find(band, force.subject);
}

bool IsBand(const Channel& channel) {
  return channel.quantity == Quantity::kForceBand || channel.quantity == Quantity::kBaseForceBand;
}

// What a number lies outside a band; NaN stays.
double Outside(double number, const ForceBand& band) {
  const double away = number - band.middle;
  return std::copysign(std::max(std::abs(away) - band.half, 0.0), away);
}

}  // namespace

Quantity BandOf(Quantity force) {
  if (force == Quantity::kForce) return Quantity::kForceBand;
  return force == Quantity::kBaseForce ? Quantity::kBaseForceBand : Quantity::kOwn;
}

ForceSignal::ForceSignal(const Trace& trace, int column)
    : trace_(trace), column_(column), band_(BandColumn(trace, column)) {}

ForceBand ForceSignal::At(Eigen::Index row) const {
  return {trace_.values(row, column_), band_ < 0 ? 0.0 : trace_.values(row, band_)};
}

VecX ForceSignal::Worst() const {
  VecX worst = trace_.values.col(column_);
  for (Eigen::Index i = 0; i < worst.size(); ++i) worst[i] = At(i).worst();
  return worst;
}

double Difference(const ForceBand& a, const ForceBand& b) {
  if (a.open() == b.open()) {
    const double away = a.middle - b.middle;
    return away + std::copysign(std::abs(a.half - b.half), away);
  }
  return b.open() ? Outside(a.middle, b) : -Outside(b.middle, a);
}

Trace WithEnds(const Trace& trace) {
  Trace shown;
  shown.witness = trace.witness;
  std::vector<Channel> channels;
  std::vector<VecX> columns;
  const auto add = [&](Channel channel, const std::string& ending, VecX values) {
    channel.name += ending;
    if (!ending.empty()) channel.quantity = Quantity::kOwn;
    channels.push_back(std::move(channel));
    columns.push_back(std::move(values));
  };
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const Channel& channel = trace.channels[c];
    const auto column = static_cast<int>(c);
    if (IsBand(channel)) continue;
    VecX force = trace.values.col(column);
    const int band = BandColumn(trace, column);
    if (band < 0) {
      add(channel, "", std::move(force));
      continue;
    }
    const VecX half = trace.values.col(band);
    add(channel, "", (half.array() > 0.0).select(kNan, force));
    add(channel, ".lower", force - half);
    add(channel, ".upper", force + half);
  }
  shown.Reset(trace.time_s, std::move(channels));
  for (size_t c = 0; c < columns.size(); ++c) {
    shown.values.col(static_cast<Eigen::Index>(c)) = columns[c];
  }
  return shown;
}

std::vector<bool> AtRest(const Trace& trace) {
  std::vector<bool> open(trace.time_s.size(), false);
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    if (!IsBand(trace.channels[c])) continue;
    for (size_t i = 0; i < open.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(c);
      open[i] = open[i] || trace.values(row, column) > 0.0;
    }
  }
  return open;
}

}  // namespace mbv
