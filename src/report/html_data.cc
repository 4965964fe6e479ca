// The signals of report.html: what its plots and its replay draw.
#include <algorithm>
#include <cmath>
#include <set>

#include "comparison/metrics.h"
#include "core/json_text.h"
#include "core/markup.h"
#include "report/html_replay.h"
#include "report/html_report.h"
#include "report/html_text.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxSamples = 2400;  // per plotted signal

// The witnesses' signals on one time grid, thinned out for plotting.
class Signals {
 public:
  explicit Signals(const Report& report) : report_(report) {
    for (const WitnessRecord& record : report.witnesses) {
      if (record.trace.time_s.size() > (grid_ ? grid_->time_s.size() : 0)) grid_ = &record.trace;
    }
    if (grid_ != nullptr) stride_ = (grid_->time_s.size() - 1) / kMaxSamples + 1;
  }

  [[nodiscard]] bool empty() const { return grid_ == nullptr; }

  [[nodiscard]] Json Times() const {
    Json times = Json::array();
    for (size_t i = 0; i < grid_->time_s.size(); i += stride_) times.push_back(grid_->time_s[i]);
    return times;
  }

  // A channel on the grid; empty when the witness has none.
  [[nodiscard]] std::vector<double> Full(const Trace& trace, const std::string& channel) const {
    const int column = trace.Find(channel);
    if (column < 0) return {};
    std::vector<double> values(grid_->time_s.size(), kNan);
    for (const auto& [a, b] : AlignSamples(*grid_, trace)) {
      values[static_cast<size_t>(a)] = trace.values(b, column);
    }
    return values;
  }

  [[nodiscard]] Json Plain(const Trace& trace, const std::string& channel) const {
    const std::vector<double> values = Full(trace, channel);
    if (values.empty()) return {};
    std::vector<float> thin;
    for (size_t i = 0; i < values.size(); i += stride_) {
      thin.push_back(static_cast<float>(values[i]));
    }
    return Base64(thin);
  }

  // |a − b| · scale; where samples are left out, the largest of them is kept.
  [[nodiscard]] Json Error(const std::vector<double>& a, const std::vector<double>& b,
                           double scale) const {
    if (a.empty() || b.empty()) return {};
    std::vector<float> thin;
    for (size_t i = 0; i < a.size(); i += stride_) {
      double worst = kNan;
      for (size_t k = i; k < std::min(i + stride_, a.size()); ++k) {
        worst = std::fmax(worst, std::abs(a[k] - b[k]) * scale);
      }
      thin.push_back(static_cast<float>(worst));
    }
    return Base64(thin);
  }

  [[nodiscard]] const Trace* TraceOf(const std::string& witness) const {
    for (const WitnessRecord& record : report_.witnesses) {
      if (record.name == witness && !record.trace.time_s.empty()) return &record.trace;
    }
    return nullptr;
  }

 private:
  const Report& report_;
  const Trace* grid_ = nullptr;
  size_t stride_ = 1;
};

double Largest(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double value : values) largest = std::fmax(largest, std::abs(value));
  return largest;
}

Json Finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

class DataWriter {
 public:
  explicit DataWriter(const HtmlInput& input)
      : input_(input), report_(*input.report), mechanism_(*input.mechanism), signals_(report_) {}

  std::string Write() {
    Json json = {{"schema", "mbverify.page/1"},
                 {"title", report_.mechanism + " / " + report_.scenario},
                 {"verdict", ToText(report_.comparison.verdict)}};
    json["drives"] = Drives();
    if (!signals_.empty()) {
      json["time"] = signals_.Times();
      json["witnesses"] = Witnesses();
      json["pairs"] = Pairs();
    }
    json["replay"] = ReplayJson(input_);
    return EscapeScript(DumpLine(json));
  }

 private:
  Json Drives() const {
    Json drives = Json::array();
    for (const Drive& drive : mechanism_.drives) {
      drives.push_back({{"name", drive.name},
                        {"unit", ForceUnit(mechanism_, drive)},
                        {"position_unit", PositionUnit(mechanism_, drive)}});
    }
    return drives;
  }

  Json Witnesses() const {
    Json witnesses = Json::array();
    for (const WitnessRecord& record : report_.witnesses) {
      if (record.trace.time_s.empty()) continue;
      Json json = {{"name", record.name}};
      for (const auto& [key, quantity] :
           {std::pair{"force", Quantity::kForce}, std::pair{"position", Quantity::kPosition}}) {
        json[key] = Json::array();
        for (const Drive& drive : mechanism_.drives) {
          json[key].push_back(signals_.Plain(record.trace, ChannelName(quantity, drive.name)));
        }
      }
      json["band"] = Json::array();
      for (const Drive& drive : mechanism_.drives) {
        json["band"].push_back(
            signals_.Plain(record.trace, ChannelName(Quantity::kForceBand, drive.name)));
      }
      json["outputs"] = Outputs(record.trace);
      AddAudit(record, &json);
      witnesses.push_back(std::move(json));
    }
    return witnesses;
  }

  Json Outputs(const Trace& trace) const {
    Json outputs = Json::array();
    for (const Output& output : mechanism_.outputs) {
      Json values = Json::array();
      for (int c = 0; c < 6; ++c) {
        values.push_back(signals_.Plain(trace, ChannelName(Quantity::kPose, output.name, c)));
      }
      const std::string& body = mechanism_.bodies[static_cast<size_t>(output.reference_body)].name;
      outputs.push_back({{"name", output.name}, {"frame", body}, {"values", std::move(values)}});
    }
    return outputs;
  }

  // Closure and power, with the limits they are judged by.
  void AddAudit(const WitnessRecord& record, Json* json) const {
    const std::string in = ChannelName(Quantity::kInputPower);
    const std::string out = ChannelName(Quantity::kEnergyRate);
    const std::vector<std::pair<const char*, std::string>> channels = {
        {"closure_m", ChannelName(Quantity::kLoopGap)},
        {"closure_rad", ChannelName(Quantity::kLoopTwist)},
        {"power_input", in},
        {"power_rate", out}};
    for (const auto& [key, channel] : channels) {
      (*json)[key] = signals_.Plain(record.trace, channel);
    }
    const std::vector<double> input = signals_.Full(record.trace, in);
    const std::vector<double> rate = signals_.Full(record.trace, out);
    const double largest = std::fmax(Largest(input), Largest(rate));
    (*json)["power_error"] = signals_.Error(input, rate, largest > 0.0 ? 1.0 / largest : 1.0);
    Json limits = Json::object();
    for (const CheckResult& check : report_.comparison.checks) {
      if (check.subject != record.name || !check.limit) continue;
      limits[RowOf(check.metric).key] = *check.limit;
    }
    (*json)["limits"] = std::move(limits);
  }

  // Force errors relative to the largest force of the drives of the same unit.
  Json Pairs() const {
    Json pairs = Json::array();
    for (const PairComparison& pair : report_.comparison.pairs) {
      const Trace* measured = signals_.TraceOf(pair.measured);
      const Trace* truth = signals_.TraceOf(pair.truth);
      if (measured == nullptr || truth == nullptr) continue;
      Json errors = Json::array(), scales = Json::array();
      for (const Drive& drive : mechanism_.drives) {
        const double largest = LargestForce(*truth, ForceUnit(mechanism_, drive));
        const std::string channel = ChannelName(Quantity::kForce, drive.name);
        scales.push_back(largest);
        errors.push_back(signals_.Error(signals_.Full(*measured, channel),
                                        signals_.Full(*truth, channel),
                                        largest > 0.0 ? 1.0 / largest : 1.0));
      }
      Json json = {{"name", pair.name()},
                   {"measured", pair.measured},
                   {"truth", pair.truth},
                   {"error", std::move(errors)},
                   {"scale", std::move(scales)}};
      AddWorst(pair, &json);
      pairs.push_back(std::move(json));
    }
    return pairs;
  }

  double LargestForce(const Trace& truth, const std::string& unit) const {
    double largest = 0.0;
    for (const Drive& drive : mechanism_.drives) {
      if (ForceUnit(mechanism_, drive) != unit) continue;
      const std::string channel = ChannelName(Quantity::kForce, drive.name);
      largest = std::fmax(largest, Largest(signals_.Full(truth, channel)));
    }
    return largest;
  }

  void AddWorst(const PairComparison& pair, Json* json) const {
    const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_max");
    if (check == nullptr) return;
    if (check->limit) (*json)["limit"] = *check->limit;
    for (size_t i = 0; i < mechanism_.drives.size(); ++i) {
      if (ChannelName(Quantity::kForce, mechanism_.drives[i].name) != check->channel) continue;
      (*json)["worst"] = {
          {"drive", i}, {"time", Finite(check->time_s)}, {"value", Finite(check->value)}};
    }
  }

  const HtmlInput& input_;
  const Report& report_;
  const Mechanism& mechanism_;
  const Signals signals_;
};

}  // namespace

std::string PageData(const HtmlInput& input) { return DataWriter(input).Write(); }

}  // namespace mbv
