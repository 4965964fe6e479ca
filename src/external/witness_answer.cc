#include "external/witness_answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/json_document.h"
#include "base/text.h"
#include "mechanism/channels.h"
#include "scenario/tables/table.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

constexpr const char* kTime = "time_s";
constexpr const char* kTraces = "traces.csv";
// Of the sample distance: how far a time stamp may lie from its sample.
constexpr double kStampShare = 1e-6;

bool States(const JsonValue& json, const char* key) {
  return json.contains(key) && !json.at(key).is_null();
}

// "" where it is left out.
std::string TextAt(const JsonValue& json, const char* key) {
  return States(json, key) ? json.at(key).get<std::string>() : "";
}

// At least 0; NaN where it is left out.
double AmountAt(const JsonValue& json, const char* key) {
  if (!States(json, key)) return kNan;
  const double amount = json.at(key);
  if (!(amount >= 0.0)) json.at(key).Refuse(fmt::format("is {:g}, which is below 0", amount));
  return amount;
}

WitnessAnswer AnswerOf(const JsonValue& json) {
  WitnessAnswer answer{.program = TextAt(json, "program"),
                       .version = TextAt(json, "version"),
                       .method = TextAt(json, "method"),
                       .refused = TextAt(json, "refused"),
                       .compute_s = AmountAt(json, "compute_s")};
  if (const std::string units = TextAt(json, "units"); units != "SI") {
    json.at("units").Refuse(fmt::format("is '{}': SI and radians are needed", units));
  }
  if (States(json, "declined")) {
    for (const JsonValue& entry : json.at("declined").list()) {
      answer.left_out.emplace_back(TextAt(entry, "what"), TextAt(entry, "why"));
    }
  }
  if (answer.program.empty()) json.Refuse("names no program");
  return answer;
}

// All signals that may be given.
std::vector<Channel> KnownChannels(const Mechanism& mechanism) {
  std::vector<Channel> known = TableSignals(mechanism);
  for (const Output& output : mechanism.outputs) {
    for (Channel& channel : OutputRateChannels(mechanism, output)) {
      known.push_back(std::move(channel));
    }
  }
  for (std::vector<Channel> more : {AuditChannels(), EnergyChannels()}) {
    for (Channel& channel : more) known.push_back(std::move(channel));
  }
  return known;
}

class TraceReader {
 public:
  TraceReader(const Mechanism& mechanism, const std::vector<double>& times_s)
      : known_(KnownChannels(mechanism)), times_s_(times_s) {}

  // "" or what is wrong.
  std::string Read(std::string_view csv, Trace* trace) {
    Diagnostics findings;
    const TableFormat format{.delimiter = ',', .decimal_comma = false, .heading_rows = 1};
    const auto text = CutTable(csv, kTraces, format, &findings);
    if (!text)
      return findings.empty() ? "traces.csv is empty" : findings.findings().front().message;
    std::string wrong = ReadHeading(*text, trace);
    return wrong.empty() ? ReadRows(*text, trace) : wrong;
  }

 private:
  std::string ReadHeading(const TableText& text, Trace* trace) {
    // Without times it is a file of something else, and not quoted.
    if (std::ranges::none_of(text.headings, [](const auto& each) { return each.full == kTime; })) {
      return "traces.csv has no column time_s";
    }
    std::vector<Channel> channels;
    for (const TableHeading& heading : text.headings) {
      if (heading.full == kTime && time_column_ < 0) {
        time_column_ = static_cast<int>(channels.size());
        continue;
      }
      const auto found = std::find_if(known_.begin(), known_.end(), [&](const Channel& channel) {
        return channel.name == heading.full;
      });
      if (found == known_.end()) return Unknown(heading.full);
      const bool twice = std::any_of(channels.begin(), channels.end(), [&](const Channel& channel) {
        return channel.name == heading.full;
      });
      if (twice) return fmt::format("traces.csv has two columns '{}'", heading.full);
      channels.push_back(*found);
    }
    trace->Reset(times_s_, std::move(channels));
    return "";
  }

  [[nodiscard]] std::string Unknown(const std::string& name) const {
    std::vector<std::string> names;
    names.reserve(known_.size());
    for (const Channel& channel : known_) names.push_back(channel.name);
    const std::string hint = DidYouMean(name, names);
    return fmt::format("traces.csv has a column '{}', which is not a signal of the mechanism{}",
                       name, hint.empty() ? "" : " (" + hint + ")");
  }

  std::string ReadRows(const TableText& text, Trace* trace) {
    if (text.rows.size() != times_s_.size()) {
      return fmt::format("traces.csv has {} rows for {} samples", text.rows.size(),
                         times_s_.size());
    }
    CutLine cut;
    for (size_t i = 0; i < text.rows.size(); ++i) {
      CutCells(text.rows[i].text, text.delimiter, &cut);
      if (cut.cells.size() != trace->channels.size() + 1) {
        return fmt::format("traces.csv:{} has {} cells for {} columns", text.rows[i].number,
                           cut.cells.size(), trace->channels.size() + 1);
      }
      const std::string wrong = ReadRow(text.rows[i], cut, i, trace);
      if (!wrong.empty()) return wrong;
    }
    return "";
  }

  std::string ReadRow(const TableLine& line, const CutLine& cut, size_t i, Trace* trace) {
    int column = 0;
    for (size_t c = 0; c < cut.cells.size(); ++c) {
      const CellNumber number = ReadCell(cut.cells[c].text, false);
      const bool is_time = static_cast<int>(c) == time_column_;
      if (number.kind != CellNumber::Kind::kNumber) {
        return fmt::format("traces.csv:{} gives '{}' for {}", line.number, cut.cells[c].text,
                           is_time ? kTime : trace->channels[static_cast<size_t>(column)].name);
      }
      if (!is_time) {
        trace->values(static_cast<Eigen::Index>(i), column++) = number.value;
      } else if (!(std::abs(number.value - times_s_[i]) <= kStampShare * Spacing())) {
        return fmt::format("traces.csv:{} is at t = {:.9g} s where the sample is at {:.9g} s",
                           line.number, number.value, times_s_[i]);
      }
    }
    return "";
  }

  [[nodiscard]] double Spacing() const {
    return times_s_.size() < 2 ? 1.0 : times_s_[1] - times_s_[0];
  }

  std::vector<Channel> known_;
  const std::vector<double>& times_s_;
  int time_column_ = -1;
};

}  // namespace

std::optional<WitnessAnswer> ReadAnswer(std::string_view json, std::string* trouble) {
  auto answer = ReadJson(json, AnswerOf, kWitnessSchema);
  *trouble = answer ? "" : "witness.json: " + answer.refusal.Text();
  return std::move(answer.value);
}

std::optional<Trace> ReadWitnessTrace(std::string_view csv, const Mechanism& mechanism,
                                      const std::vector<double>& times_s, std::string* trouble) {
  Trace trace;
  *trouble = TraceReader(mechanism, times_s).Read(csv, &trace);
  if (!trouble->empty()) return {};
  return trace;
}

}  // namespace mbv
