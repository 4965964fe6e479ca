#include "features/regress/golden.h"

#include <fmt/format.h>
#include <zlib.h>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/demand.h"
#include "base/roles.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

constexpr const char* kMagic = "mbvgold1";
constexpr int kDroppedBits = 52 - 36;
constexpr double kMostRows = 1e7, kMostDrives = 1e4;  // of traces that are not damaged

struct GoldenColumn {
  std::string witness, drive;
};

// "limb1.drive.force.analytic" → {analytic, limb1.drive}; no witness: not a drive force.
GoldenColumn ColumnOf(std::string_view name) {
  const size_t dot = name.rfind('.');
  constexpr std::string_view kForce = ".force";
  if (dot == std::string_view::npos || !name.substr(0, dot).ends_with(kForce)) return {};
  return {std::string(name.substr(dot + 1)), std::string(name.substr(0, dot - kForce.size()))};
}

std::vector<GoldenColumn> ReadHeader(std::string_view line) {
  CutLine cut;
  CutCells(line, ',', &cut);  // names with commas are in quotes
  std::vector<GoldenColumn> columns;
  for (const TableCell& cell : cut.cells) columns.push_back(ColumnOf(cell.text));
  return columns;
}

double ReadNumber(std::string_view text) {
  double value = kNan;
  const auto parsed = std::from_chars(text.data(), text.data() + text.size(), value);
  return parsed.ec == std::errc() ? value : kNan;
}

double Round(double value) {
  auto bits = std::bit_cast<std::uint64_t>(value);
  if (!std::isfinite(value)) return kNan;
  bits += 1ULL << (kDroppedBits - 1);
  bits &= ~((1ULL << kDroppedBits) - 1);
  return std::bit_cast<double>(bits);
}

// Byte k of every value next to each other: compresses far better.
std::string Shuffle(const MatX& values) {
  const auto count = static_cast<size_t>(values.size());
  std::string bytes(8 * count, '\0');
  for (size_t i = 0; i < count; ++i) {
    const auto bits = std::bit_cast<std::uint64_t>(Round(values.data()[i]));
    for (size_t k = 0; k < 8; ++k) bytes[k * count + i] = static_cast<char>(bits >> (8 * k));
  }
  return bytes;
}

void Unshuffle(const char* bytes, MatX* values) {
  const auto count = static_cast<size_t>(values->size());
  for (size_t i = 0; i < count; ++i) {
    std::uint64_t bits = 0;
    for (size_t k = 0; k < 8; ++k) {
      bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[k * count + i]))
              << (8 * k);
    }
    values->data()[i] = std::bit_cast<double>(bits);
  }
}

// Text between `at` and the next newline; moves on.
std::string NextLine(const std::string& text, size_t* at) {
  const size_t end = std::min(text.find('\n', *at), text.size());
  std::string line = text.substr(std::min(*at, text.size()), end - *at);
  *at = end + 1;
  return line;
}

}  // namespace

GoldenTraces ReadForces(const std::string& csv, size_t max_samples) {
  std::vector<std::string_view> lines;
  for (size_t at = 0; at < csv.size();) {
    const size_t end = std::min(csv.find('\n', at), csv.size());
    if (end > at) lines.push_back(std::string_view(csv).substr(at, end - at));
    at = end + 1;
  }
  if (lines.size() < 2) return {};
  const std::vector<GoldenColumn> columns = ReadHeader(lines[0]);
  const size_t all = lines.size() - 1;
  const size_t stride = (all + max_samples - 1) / max_samples;
  const auto samples = static_cast<Eigen::Index>((all + stride - 1) / stride);
  GoldenTraces traces;
  std::vector<double*> target(columns.size(), nullptr);
  for (const GoldenColumn& column : columns) {
    if (!column.witness.empty()) traces[column.witness].drives.push_back(column.drive);
  }
  for (auto& [witness, trace] : traces) {
    trace.force.setConstant(samples, static_cast<Eigen::Index>(trace.drives.size()), kNan);
  }
  std::map<std::string, Eigen::Index> next;
  for (size_t c = 0; c < columns.size(); ++c) {
    if (columns[c].witness.empty()) continue;
    target[c] = traces[columns[c].witness].force.col(next[columns[c].witness]++).data();
  }
  for (Eigen::Index row = 0; row < samples; ++row) {
    const std::string_view line = lines[1 + static_cast<size_t>(row) * stride];
    size_t at = 0;
    for (size_t c = 0; c < columns.size() && at <= line.size(); ++c) {
      const size_t comma = std::min(line.find(',', at), line.size());
      if (target[c] != nullptr) target[c][row] = ReadNumber(line.substr(at, comma - at));
      at = comma + 1;
    }
  }
  return traces;
}

std::string Encode(const ForceTrace& trace) {
  std::string head = fmt::format("{}\n{}\n{}\n", kMagic, trace.force.rows(), trace.drives.size());
  for (const std::string& drive : trace.drives) head += drive + "\n";
  const std::string plain = Shuffle(trace.force);
  uLongf size = compressBound(plain.size());
  std::string packed(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                               reinterpret_cast<const Bytef*>(plain.data()), plain.size(), 6);
  MBV_DEMAND(status == Z_OK, status);
  packed.resize(size);
  return head + packed;
}

std::optional<ForceTrace> DecodeForces(const std::string& bytes) {
  size_t at = 0;
  if (NextLine(bytes, &at) != kMagic) return std::nullopt;
  const double rows = ReadNumber(NextLine(bytes, &at));
  const double drives = ReadNumber(NextLine(bytes, &at));
  if (!(rows >= 0.0 && rows < kMostRows && drives >= 0.0 && drives < kMostDrives)) {
    return std::nullopt;
  }
  ForceTrace trace;
  for (int i = 0; i < static_cast<int>(drives); ++i) trace.drives.push_back(NextLine(bytes, &at));
  if (at > bytes.size()) return std::nullopt;
  trace.force.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(drives));
  std::string plain(8 * static_cast<size_t>(trace.force.size()), '\0');
  uLongf size = plain.size();
  const int status =
      uncompress(reinterpret_cast<Bytef*>(plain.data()), &size,
                 reinterpret_cast<const Bytef*>(bytes.data() + at), bytes.size() - at);
  if (status != Z_OK || size != plain.size()) return std::nullopt;
  Unshuffle(plain.data(), &trace.force);
  return trace;
}

Movement Compare(const ForceTrace& before, const ForceTrace& now) {
  Movement movement;
  if (before.drives != now.drives || before.force.rows() != now.force.rows()) {
    return {std::numeric_limits<double>::infinity(), "all: other drives or samples"};
  }
  double change2 = 0.0, before2 = 0.0, worst2 = -1.0;
  for (Eigen::Index c = 0; c < now.force.cols(); ++c) {
    double drive2 = 0.0;
    for (Eigen::Index r = 0; r < now.force.rows(); ++r) {
      const double a = before.force(r, c), b = Round(now.force(r, c));
      if (std::isnan(a) && std::isnan(b)) continue;
      drive2 += (b - a) * (b - a);
      before2 += a * a;
    }
    change2 += drive2;
    if (drive2 > worst2) {
      worst2 = drive2;
      movement.worst = now.drives[static_cast<size_t>(c)];
    }
  }
  if (change2 == 0.0) return {0.0, ""};
  movement.relative = std::sqrt(change2 / before2);  // x/0 is infinite, NaN counts as moved
  return movement;
}

std::string AttributeMovement(const GoldenTraces& before, const GoldenTraces& now) {
  struct Part {
    const Role& role;
    bool moved = false;
  };
  std::vector<Part> parts = {{role::kAnalytic}, {role::kSimulated}, {role::kReference}};
  std::string amounts, worst;
  double largest = -1.0;
  for (Part& part : parts) {
    const auto a = before.find(part.role.name), b = now.find(part.role.name);
    if (a == before.end() || b == now.end()) continue;
    const Movement movement = Compare(a->second, b->second);
    if (!movement.moved()) continue;
    part.moved = true;
    amounts += fmt::format("{}{} by {:.1e}", amounts.empty() ? "" : ", ", part.role.called,
                           movement.relative);
    if (!(movement.relative <= largest)) {
      largest = movement.relative;
      worst = movement.worst;
    }
  }
  if (amounts.empty()) return "";
  std::string who;
  if (parts[0].moved && parts[1].moved) {
    who = "both moved";
  } else {
    for (const Part& part : parts) {
      if (part.moved) who += (who.empty() ? "" : " and ") + std::string(part.role.called);
    }
    who += " moved";
  }
  return fmt::format("{} ({}; most {})", who, amounts, worst);
}

namespace {

// Standard deviation of a normal distribution per median absolute deviation.
constexpr double kSigmaPerMad = 1.4826;
constexpr double kLevelRounding = 1e-9;  // of logarithms

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const size_t half = values.size() / 2;
  return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

}  // namespace

std::optional<DriftFinding> FindDrift(const std::vector<PastValue>& past, double now,
                                      const DriftRule& rule) {
  if (!std::isfinite(now)) return std::nullopt;
  const auto level = [&](double value) { return std::log10(std::max(value, rule.noise_floor)); };
  std::vector<double> levels;
  for (auto it = past.rbegin(); it != past.rend() && levels.size() < rule.window; ++it) {
    if (it->good && !it->drifted && std::isfinite(it->value)) levels.push_back(level(it->value));
  }
  if (levels.size() < rule.min_runs) return std::nullopt;
  const double median = Median(levels);
  std::vector<double> deviations;
  for (double value : levels) deviations.push_back(std::abs(value - median));
  const double sigma = kSigmaPerMad * Median(deviations);
  const double threshold = median + std::max(std::log10(rule.factor), rule.spread_factor * sigma);
  // A value at the factor counts: 1e-12 from 1e-13 is ten times worse, whatever the last bit says.
  if (level(now) < threshold - kLevelRounding) return std::nullopt;
  DriftFinding finding{std::pow(10.0, median), std::pow(10.0, threshold), levels.size(), 0};
  for (auto it = past.rbegin(); it != past.rend(); ++it) {
    if (!it->good) continue;  // a failed run neither ends nor begins a stretch
    if (!it->drifted) break;
    finding.since_run = it->run;
  }
  return finding;
}

}  // namespace mbv
