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
    : trace_(&trace), column_(column), band_(BandColumn(trace, column)) {}

ForceBand ForceSignal::At(Eigen::Index row) const {
  return {trace_->values(row, column_), band_ < 0 ? 0.0 : trace_->values(row, band_)};
}

VecX ForceSignal::Worst() const {
  VecX worst = trace_->values.col(column_);
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

double ShownColumn::At(Eigen::Index row) const {
  const ForceBand force = signal.At(row);
  if (part == Part::kNumber) return force.open() ? kNan : force.middle;
  return part == Part::kLower ? force.lower() : force.upper();
}

std::vector<ShownColumn> ShownColumns(const Trace& trace) {
  using Part = ShownColumn::Part;
  std::vector<ShownColumn> shown;
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const Channel& channel = trace.channels[c];
    if (IsBand(channel)) continue;
    const auto column = static_cast<int>(c);
    const ForceSignal signal(trace, column);
    shown.push_back({channel, column, signal});
    if (BandColumn(trace, column) < 0) continue;
    Channel end = channel;
    end.quantity = Quantity::kOwn;
    for (const auto& [word, part] : {std::pair{".lower", Part::kLower}, {".upper", Part::kUpper}}) {
      end.name = channel.name + word;
      shown.push_back({end, column, signal, part});
    }
  }
  return shown;
}

Trace AsShown(const Trace& trace) {
  const std::vector<ShownColumn> columns = ShownColumns(trace);
  std::vector<Channel> channels;
  channels.reserve(columns.size());
  for (const ShownColumn& column : columns) channels.push_back(column.channel);
  Trace shown;
  shown.witness = trace.witness;
  shown.Reset(trace.time_s, std::move(channels));
  for (size_t c = 0; c < columns.size(); ++c) {
    for (Eigen::Index i = 0; i < shown.values.rows(); ++i) {
      shown.values(i, static_cast<Eigen::Index>(c)) = columns[c].At(i);
    }
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
