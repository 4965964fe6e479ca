#include "features/logs/log_columns.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "base/text.h"
#include "mechanism/reach.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

using Words = std::vector<std::string>;

constexpr size_t kNamedAtMost = 8;

// What a word of a heading stands for, where it is not part of a joint's name.
enum class Meaning { kQuantity, kFiller, kCommanded, kOther, kUnit, kTime, kUnknown };
struct WordMeaning {
  Meaning meaning = Meaning::kUnknown;
  LogQuantity quantity = LogQuantity::kPosition;
};

const std::map<std::string, LogQuantity, std::less<>>& QuantityWords() {
  using enum LogQuantity;
  static const std::map<std::string, LogQuantity, std::less<>> words = {
      {"pos", kPosition},
      {"position", kPosition},
      {"positions", kPosition},
      {"q", kPosition},
      {"qpos", kPosition},
      {"angle", kPosition},
      {"ang", kPosition},
      {"theta", kPosition},
      {"enc", kPosition},
      {"encoder", kPosition},
      {"stroke", kPosition},
      {"vel", kVelocity},
      {"velocity", kVelocity},
      {"velocities", kVelocity},
      {"qd", kVelocity},
      {"dq", kVelocity},
      {"qdot", kVelocity},
      {"qvel", kVelocity},
      {"speed", kVelocity},
      {"rate", kVelocity},
      {"omega", kVelocity},
      {"acc", kAcceleration},
      {"accel", kAcceleration},
      {"acceleration", kAcceleration},
      {"qdd", kAcceleration},
      {"ddq", kAcceleration},
      {"qddot", kAcceleration},
      {"qacc", kAcceleration},
      {"accelerations", kAcceleration},
      {"eff", kEffort},
      {"effort", kEffort},
      {"efforts", kEffort},
      {"tau", kEffort},
      {"torque", kEffort},
      {"torques", kEffort},
      {"trq", kEffort},
      {"force", kEffort},
      {"moment", kEffort}};
  return words;
}

WordMeaning MeaningOf(const std::string& word) {
  static const std::set<std::string, std::less<>> filler = {
      "joint", "joints",    "jointstates", "jointstate", "state", "states", "js",
      "field", "msg",       "data",        "measured",   "meas",  "actual", "act",
      "est",   "estimated", "feedback",    "fb",         "motor", "drive",  "actuator",
      "robot", "sensor",    "value",       "jnt",        "of",    "in"};
  static const std::set<std::string, std::less<>> commanded = {
      "cmd",       "command", "commanded", "des",  "desired", "ref",
      "reference", "target",  "setpoint",  "goal", "ff",      "feedforward"};
  static const std::set<std::string, std::less<>> other = {
      "temp",     "temperature", "current", "voltage", "error", "err",   "status",   "limit",
      "max",      "min",         "kp",      "kd",      "ki",    "gain",  "std",      "var",
      "cov",      "pwm",         "mode",    "fault",   "flag",  "seq",   "imu",      "gps",
      "header",   "frame",       "id",      "battery", "name",  "names", "analytic", "simulated",
      "reaction", "fx",          "fy",      "fz",      "mx",    "my",    "mz",       "power",
      "energy",   "work",        "gap",     "twist",   "lower", "upper"};
  static const std::set<std::string, std::less<>> units = {
      "rad", "rads", "radians", "deg",  "degs",  "degrees", "mm", "m",
      "s",   "nm",   "n",       "mnm",  "rpm",   "mrad",    "ms", "us",
      "ns",  "sec",  "secs",    "nsec", "nsecs", "nanosec", "kn"};
  static const std::set<std::string, std::less<>> time = {"time", "t", "timestamp", "stamp",
                                                          "timestamps"};
  if (const auto found = QuantityWords().find(word); found != QuantityWords().end()) {
    return {Meaning::kQuantity, found->second};
  }
  if (filler.contains(word)) return {Meaning::kFiller};
  if (commanded.contains(word)) return {Meaning::kCommanded};
  if (other.contains(word)) return {Meaning::kOther};
  if (units.contains(word)) return {Meaning::kUnit};
  if (time.contains(word)) return {Meaning::kTime};
  return {};
}

bool IsNumber(const std::string& word) {
  return !word.empty() &&
         std::ranges::all_of(word, [](unsigned char c) { return std::isdigit(c); });
}

// In lower case, cut at signs and before capitals: "leftKnee_pos[rad]" → left, knee, pos, rad.
Words WordsOf(std::string_view text) {
  Words words;
  std::string word;
  const auto end = [&] {
    if (!word.empty()) words.push_back(std::move(word));
    word.clear();
  };
  bool small = false;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (!std::isalnum(u) && u < 128) {
      end();
      small = false;
      continue;
    }
    if (std::isupper(u) && small) end();
    small = std::islower(u) != 0;
    word += static_cast<char>(std::tolower(u));
  }
  end();
  return words;
}

// How a name may stand in a heading: in full, and without "joint" or "motor" at its ends.
std::vector<Words> VariantsOf(const std::string& name) {
  static const std::set<std::string, std::less<>> ends = {"joint", "jnt", "motor", "drive",
                                                          "actuator"};
  std::vector<Words> variants = {WordsOf(name)};
  Words bare = variants[0];
  while (bare.size() > 1 && ends.contains(bare.back())) bare.pop_back();
  while (bare.size() > 1 && ends.contains(bare.front())) bare.erase(bare.begin());
  const bool says = std::ranges::any_of(
      bare, [](const std::string& word) { return !IsNumber(word) && !ends.contains(word); });
  if (bare != variants[0] && says) variants.push_back(bare);
  return variants;
}

// A name in a heading.
struct NameMatch {
  size_t axis = 0, at = 0, words = 0, letters = 0;
};

// A heading as far as its words explain it.
struct HeadingSense {
  enum class Kind {
    kSignal,      // of an axis
    kIndexed,     // position[3]
    kName,        // name[3], or all names
    kCommanded,   // a command, not what was measured
    kNoQuantity,  // names a joint, but the words behind are unknown
    kAmbiguous,   // several joints
    kElse
  };
  Kind kind = Kind::kElse;
  size_t axis = 0;
  LogQuantity quantity = LogQuantity::kPosition;
  int number = -1;
  std::string unit;  // as the words write it: "rad/s"
  std::string word;  // that is unknown
  std::vector<std::string> candidates;
};

std::string UnitOfWords(const Words& words) {
  static const std::map<std::string, std::string, std::less<>> plain = {
      {"rads", "rad/s"}, {"degs", "deg/s"}, {"radians", "rad"}, {"degrees", "deg"},
      {"nm", "N*m"},     {"n", "N"},        {"mnm", "mN*m"},    {"kn", "kN"}};
  std::string unit;
  for (const std::string& word : words) {
    const auto found = plain.find(word);
    unit += (unit.empty() ? "" : "/") + (found == plain.end() ? word : found->second);
  }
  return unit;
}

// What is left of a heading without a joint's name, from its words before and behind the name.
HeadingSense SenseOfRest(const Words& before, const Words& behind, bool strict) {
  HeadingSense sense;
  sense.kind = HeadingSense::Kind::kSignal;
  std::set<LogQuantity> quantities;
  bool commanded = false, other = false;
  Words units;
  const auto look = [&](const std::string& word, bool unknown_too) {
    const WordMeaning meaning = MeaningOf(word);
    switch (meaning.meaning) {
      case Meaning::kQuantity:
        quantities.insert(meaning.quantity);
        break;
      case Meaning::kCommanded:
        commanded = true;
        break;
      case Meaning::kOther:
      case Meaning::kTime:
        other = true;
        break;
      case Meaning::kUnit:
        units.push_back(word);
        break;
      case Meaning::kUnknown:
        if (unknown_too) sense.word = word;
        break;
      case Meaning::kFiller:
        break;
    }
  };
  // In front, other words are the name of a robot or a topic.
  for (const std::string& word : before) look(word, strict);
  units.clear();
  for (const std::string& word : behind) look(word, true);
  const bool several = !commanded && sense.word.empty() && quantities.size() > 1;
  if (other || several) {
    sense.kind = HeadingSense::Kind::kElse;
  } else if (commanded) {
    sense.kind = HeadingSense::Kind::kCommanded;
  } else if (!sense.word.empty()) {
    sense.kind = strict ? HeadingSense::Kind::kElse : HeadingSense::Kind::kNoQuantity;
  } else if (!quantities.empty()) {
    sense.quantity = *quantities.begin();
  }
  sense.unit = UnitOfWords(units);
  return sense;
}

// "position[3]", "field.position3", "name_3".
HeadingSense SenseOfIndexed(Words words) {
  HeadingSense sense;
  if (words.empty()) return sense;
  std::string number;
  if (IsNumber(words.back())) {
    number = words.back();
    words.pop_back();
  } else {
    std::string& last = words.back();
    while (!last.empty() && std::isdigit(static_cast<unsigned char>(last.back())) != 0) {
      number.insert(number.begin(), last.back());
      last.pop_back();
    }
    if (last.empty()) return sense;
  }
  if (words.empty() || number.size() > 4) return sense;
  const bool name = words.back() == "name" || words.back() == "names";
  if (name) words.pop_back();
  std::set<LogQuantity> quantities;
  for (const std::string& word : words) {
    const WordMeaning meaning = MeaningOf(word);
    if (meaning.meaning == Meaning::kQuantity) {
      quantities.insert(meaning.quantity);
    } else if (meaning.meaning != Meaning::kFiller) {
      return sense;
    }
  }
  if (quantities.size() != (name ? 0U : 1U)) {
    // All names in one cell.
    if (name && number.empty()) sense.kind = HeadingSense::Kind::kName;
    return sense;
  }
  if (name) {
    sense.kind = HeadingSense::Kind::kName;
    if (!number.empty()) sense.number = std::atoi(number.c_str());
    return sense;
  }
  if (number.empty()) return sense;
  sense.kind = HeadingSense::Kind::kIndexed;
  sense.quantity = *quantities.begin();
  sense.number = std::atoi(number.c_str());
  return sense;
}

class Mapper {
 public:
  Mapper(const TableText& text, const std::string& file, const LogSettings& settings,
         const std::vector<LogAxis>& axes, Diagnostics* diagnostics)
      : text_(text), file_(file), settings_(settings), axes_(axes), diagnostics_(*diagnostics) {
    for (const LogAxis& axis : axes) {
      variants_.emplace_back();
      for (const std::string& name : axis.names) {
        for (Words& words : VariantsOf(name)) {
          if (!words.empty()) variants_.back().push_back(std::move(words));
        }
      }
    }
  }

  LogMapping Map() {
    if (!text_.has_names && settings_.columns.empty()) {
      Error(0, 0, "has no heading: nothing says what its columns are",
            "write names above the columns, or name them by number in a map file: --map FILE");
      return {};
    }
    taken_.assign(text_.columns, false);
    TakeIgnored();
    TakeStated();
    TakeClock();
    FindSenses();
    TakeNames();
    for (size_t i = 0; i < text_.columns; ++i) TakeColumn(i);
    ReportArrays();
    ReportUnused();
    RefuseDoubled();
    std::ranges::sort(mapping_.columns, {}, &LogColumn::index);
    return std::move(mapping_);
  }

 private:
  using Kind = HeadingSense::Kind;

  Finding FindingAt(int line, int character, std::string message, std::string hint) const {
    Finding finding;
    finding.file = file_;
    finding.line = line;
    finding.column = character;
    finding.message = std::move(message);
    finding.hint = std::move(hint);
    return finding;
  }
  void Error(int line, int character, std::string message, std::string hint) {
    diagnostics_.Add(FindingAt(line, character, std::move(message), std::move(hint)));
  }
  void ErrorAt(const Finding& place, std::string message, std::string hint) {
    Finding finding = FindingAt(place.line, place.column, std::move(message), std::move(hint));
    finding.file = place.file;
    diagnostics_.Add(std::move(finding));
  }

  [[nodiscard]] Words Headings() const {
    Words names;
    for (const TableHeading& heading : text_.headings) names.push_back(heading.full);
    return names;
  }

  // The column of this heading, with or without its unit.
  [[nodiscard]] std::optional<size_t> FindHeading(const std::string& name) const {
    for (size_t i = 0; i < text_.columns; ++i) {
      const TableHeading& heading = text_.headings[i];
      if (heading.full == name || heading.name == name) return i;
    }
    return {};
  }

  [[nodiscard]] std::optional<size_t> FindStated(const LogRequest& request) {
    const TableColumnSettings& stated = request.column;
    if (stated.number > 0) {
      if (static_cast<size_t>(stated.number) <= text_.columns) return stated.number - 1;
      ErrorAt(request.place,
              fmt::format("{}: there is no column {}, {} has {}", stated.path, stated.number, file_,
                          text_.columns),
              "");
      return {};
    }
    if (auto found = FindHeading(stated.column)) return found;
    ErrorAt(request.place,
            fmt::format("{}: {} has no column '{}'", stated.path, file_, stated.column),
            DidYouMean(stated.column, Headings(), "it has " + Joined(Headings(), kNamedAtMost)));
    return {};
  }

  void TakeIgnored() {
    for (const std::string& name : settings_.ignore) {
      if (const auto column = FindHeading(name)) {
        taken_[*column] = true;
        continue;
      }
      Error(0, 0, fmt::format("has no column '{}' to be ignored", name),
            DidYouMean(name, Headings(), "it has " + Joined(Headings(), kNamedAtMost)));
    }
  }

  // "left_knee.position" → axis and quantity.
  bool ReadSignal(const LogRequest& request, LogColumn* column) {
    const std::string& signal = request.column.signal;
    const size_t dot = signal.rfind('.');
    const std::string name = signal.substr(0, dot);
    const std::string word = dot == std::string::npos ? "" : signal.substr(dot + 1);
    const auto quantity = std::ranges::find(kLogQuantities, word);
    if (quantity == kLogQuantities.end()) {
      ErrorAt(request.place,
              fmt::format("'{}' is not NAME.position, .velocity, .acceleration or .effort", signal),
              DidYouMean(word, {kLogQuantities.begin(), kLogQuantities.end()}));
      return false;
    }
    column->quantity = static_cast<LogQuantity>(quantity - kLogQuantities.begin());
    if (const auto axis = FindAxis(name)) {
      column->axis = *axis;
      return true;
    }
    ErrorAt(request.place, fmt::format("'{}': the model has no drive or joint '{}'", signal, name),
            DidYouMean(name, AxisNames(), "it has " + Joined(AxisNames(), kNamedAtMost)));
    return false;
  }

  [[nodiscard]] std::optional<size_t> FindAxis(const std::string& name) const {
    for (size_t a = 0; a < axes_.size(); ++a) {
      if (Contains(axes_[a].names, name)) return a;
    }
    return {};
  }
  [[nodiscard]] Words AxisNames() const {
    Words names;
    for (const LogAxis& axis : axes_)
      names.insert(names.end(), axis.names.begin(), axis.names.end());
    return names;
  }

  void TakeStated() {
    for (const LogRequest& request : settings_.columns) {
      LogColumn column;
      const bool known = ReadSignal(request, &column);
      if (request.column.off) continue;
      const auto index = FindStated(request);
      if (!known || !index) continue;
      column.stated = request.column;
      taken_[*index] = true;
      if (SetUnit(*index, "", &request.place, &column)) mapping_.columns.push_back(column);
    }
  }

  // Unit, factor and shift of a column: as stated, as the heading says, as --degrees says, or SI.
  bool SetUnit(size_t index, const std::string& by_words, const Finding* place, LogColumn* column) {
    const TableHeading& heading = text_.headings[index];
    column->index = index;
    column->heading = heading.full.empty() ? fmt::format("column {}", index + 1) : heading.full;
    column->line = heading.line;
    column->character = heading.character;
    const std::string si = axes_[column->axis].UnitOf(column->quantity);
    const Finding at = place != nullptr && !column->stated.unit.empty()
                           ? *place
                           : FindingAt(heading.line, heading.character, "", "");
    std::string unit = column->stated.unit;
    if (unit.empty()) unit = heading.unit;
    if (unit.empty()) unit = by_words;
    if (unit.empty() && settings_.degrees && si.starts_with("rad")) unit = "deg" + si.substr(3);
    column->unit = unit.empty() ? si : unit;
    double factor = 1.0;
    if (!unit.empty()) {
      const auto found = FindUnit(unit);
      if (!found || found->si != si) {
        ErrorAt(at,
                found ? fmt::format("'{}': the unit {} is not one of {}, which is in {}",
                                    column->heading, unit, SignalOf(*column), si)
                      : fmt::format("'{}': the unit '{}' is not known", column->heading, unit),
                UnitHint(unit, si));
        return false;
      }
      factor = found->factor;
    } else {
      assumed_.push_back(column->heading);
    }
    column->factor = column->stated.sign * column->stated.scale * factor;
    column->shift = column->stated.offset * factor;
    return true;
  }

  [[nodiscard]] std::string SignalOf(const LogColumn& column) const {
    return axes_[column.axis].name() + "." + kLogQuantities[static_cast<size_t>(column.quantity)];
  }

  // Seconds of one unit of the clock.
  bool ReadClockUnit(LogClock* clock, const Words& words) {
    const TableHeading& heading = text_.headings[clock->index];
    std::string unit = settings_.time_unit.empty() ? heading.unit : settings_.time_unit;
    for (const std::string& word : words) {
      if (unit.empty() && MeaningOf(word).meaning == Meaning::kUnit) unit = word;
    }
    if (unit == "ns" || unit == "nsec" || unit == "nsecs" || unit == "nanosec") {
      clock->unit_s = 1e-9;
      return true;
    }
    if (unit == "secs") unit = "s";
    if (unit.empty()) {
      GuessClock(clock);
      return true;
    }
    const auto found = FindUnit(unit);
    if (found && found->si == "s") {
      clock->unit_s = found->factor;
      return true;
    }
    Error(heading.line, heading.character,
          fmt::format("the time '{}' is in '{}', which is no unit of time", clock->heading, unit),
          "--time-unit s, ms, us or ns");
    return false;
  }

  // Stamps of the system's clock count from 1970: their size says in what.
  void GuessClock(LogClock* clock) {
    const std::string cell = CellOf(0, clock->index);
    const double value = std::abs(ReadCell(cell, text_.decimal_comma).value);
    for (const auto& [least, unit_s, name] :
         {std::tuple{1e17, 1e-9, "ns"}, std::tuple{1e14, 1e-6, "us"},
          std::tuple{1e11, 1e-3, "ms"}}) {
      if (value < least) continue;
      clock->unit_s = unit_s;
      mapping_.notes.push_back(
          fmt::format("the time '{}' counts {} since 1970, by its size", clock->heading, name));
      return;
    }
    clock->assumed = true;
  }

  [[nodiscard]] std::string CellOf(size_t row, size_t column) const {
    if (row >= text_.rows.size()) return "";
    CutLine cut;
    CutCells(text_.rows[row].text, text_.delimiter, &cut);
    return column < cut.cells.size() ? std::string(cut.cells[column].text) : "";
  }

  // Stamps of the message before the time of its recording, before a plain time.
  void TakeClock() {
    LogClock clock;
    std::optional<size_t> seconds, nanoseconds, stamp, plain;
    if (!settings_.time.empty()) {
      plain = FindHeading(settings_.time);
      if (!plain) {
        Error(0, 0, fmt::format("has no column '{}' of the time", settings_.time),
              DidYouMean(settings_.time, Headings(), "it has " + Joined(Headings(), kNamedAtMost)));
        return;
      }
    }
    for (size_t i = 0; i < text_.columns && settings_.time.empty(); ++i) {
      if (taken_[i]) continue;
      const Words words = WordsOf(text_.headings[i].name);
      bool time = false, header = false, all = !words.empty();
      for (const std::string& word : words) {
        const Meaning meaning = MeaningOf(word).meaning;
        time = time || meaning == Meaning::kTime;
        header = header || word == "header";
        all = all && (meaning == Meaning::kTime || meaning == Meaning::kUnit ||
                      meaning == Meaning::kFiller || word == "header" || word == "ros" ||
                      word == "elapsed" || word == "sim");
      }
      if (!time || !all) continue;
      const std::string& last = words.back();
      taken_[i] = true;
      if (header && (last == "sec" || last == "secs")) {
        seconds = i;
      } else if (header && (last == "nsec" || last == "nsecs" || last == "nanosec")) {
        nanoseconds = i;
      } else if (header && !stamp) {
        stamp = i;
      } else if (!plain) {
        plain = i;
      }
    }
    if (seconds && nanoseconds) {
      clock.index = *seconds;
      clock.nanoseconds = nanoseconds;
    } else if (stamp || plain) {
      clock.index = stamp ? *stamp : *plain;
    } else {
      Error(0, 0, "has no column of time: none is called time, t, timestamp or stamp",
            "--time HEADING names it");
      return;
    }
    taken_[clock.index] = true;
    clock.heading = text_.headings[clock.index].full;
    if (!clock.nanoseconds && !ReadClockUnit(&clock, WordsOf(text_.headings[clock.index].name))) {
      return;
    }
    if ((stamp || clock.nanoseconds) && plain) {
      mapping_.notes.push_back(
          fmt::format("the time is '{}', not '{}'", clock.heading, text_.headings[*plain].full));
    }
    mapping_.clock = clock;
  }

  // Names in a heading: the longest wins, of equally long ones the one in full.
  [[nodiscard]] std::vector<NameMatch> BestMatches(const Words& words) const {
    std::vector<NameMatch> best;
    for (size_t a = 0; a < variants_.size(); ++a) {
      for (const Words& name : variants_[a]) {
        const auto at = std::search(words.begin(), words.end(), name.begin(), name.end());
        if (at == words.end()) continue;
        NameMatch match{a, static_cast<size_t>(at - words.begin()), name.size(), 0};
        for (const std::string& word : name) match.letters += word.size();
        if (!best.empty() && (match.words < best[0].words ||
                              (match.words == best[0].words && match.letters < best[0].letters))) {
          continue;
        }
        if (!best.empty() && (match.words > best[0].words || match.letters > best[0].letters)) {
          best.clear();
        }
        const bool known = std::ranges::any_of(
            best, [&](const NameMatch& other) { return other.axis == match.axis; });
        if (!known) best.push_back(match);
      }
    }
    return best;
  }

  void FindSenses() {
    senses_.resize(text_.columns);
    for (size_t i = 0; i < text_.columns; ++i) {
      if (taken_[i]) continue;
      Words words = WordsOf(text_.headings[i].name);
      // Our own traces.csv: the reference's columns.
      const bool ours = words.size() > 2 && words.back() == "reference" &&
                        MeaningOf(words[words.size() - 2]).meaning == Meaning::kQuantity &&
                        text_.headings[i].name.ends_with(".reference");
      if (ours) words.pop_back();
      senses_[i] = SenseOf(words);
    }
  }

  [[nodiscard]] HeadingSense SenseOf(const Words& words) const {
    constexpr size_t kShortName = 3;
    const std::vector<NameMatch> matches = BestMatches(words);
    if (matches.empty()) return SenseOfIndexed(words);
    const NameMatch& match = matches[0];
    const auto at = words.begin() + static_cast<std::ptrdiff_t>(match.at);
    HeadingSense sense = SenseOfRest({words.begin(), at},
                                     {at + static_cast<std::ptrdiff_t>(match.words), words.end()},
                                     match.letters < kShortName);
    sense.axis = match.axis;
    if (matches.size() > 1 && sense.kind == Kind::kSignal) {
      sense.kind = Kind::kAmbiguous;
      for (const NameMatch& other : matches) sense.candidates.push_back(axes_[other.axis].name());
    }
    return sense;
  }

  // Names of arrays in the file's own text columns.
  void TakeNames() {
    std::map<int, std::string> names;
    bool any = false;
    for (size_t i = 0; i < text_.columns; ++i) {
      if (taken_[i] || senses_[i].kind != Kind::kName) continue;
      taken_[i] = any = true;
      const std::string cell = CellOf(0, i);
      if (senses_[i].number >= 0) {
        names[senses_[i].number] = cell;
        continue;
      }
      // "['left_knee', 'right_knee']", "(left_knee; right_knee)".
      std::string name;
      int count = 0;
      for (const char c : cell + ",") {
        if (c == ',' || c == ';' || c == ' ') {
          if (!name.empty()) names[count++] = name;
          name.clear();
        } else if (c != '[' && c != ']' && c != '\'' && c != '"' && c != '(' && c != ')') {
          name += c;
        }
      }
    }
    int first = std::numeric_limits<int>::max();
    for (size_t i = 0; i < text_.columns; ++i) {
      if (!taken_[i] && senses_[i].kind == Kind::kIndexed)
        first = std::min(first, senses_[i].number);
    }
    if (!settings_.joints.empty()) {
      names.clear();
      for (size_t k = 0; k < settings_.joints.size(); ++k) {
        names[static_cast<int>(k) + first] = settings_.joints[k];
      }
    } else if (any && !names.empty() && names.begin()->first != first) {
      std::map<int, std::string> shifted;
      for (const auto& [k, name] : names) shifted[k - names.begin()->first + first] = name;
      names = std::move(shifted);
    }
    for (const auto& [k, name] : names) {
      if (const auto axis = FindAxis(name)) {
        array_[k] = *axis;
        continue;
      }
      const std::vector<NameMatch> matches = BestMatches(WordsOf(name));
      if (matches.size() == 1 && matches[0].words == WordsOf(name).size()) {
        array_[k] = matches[0].axis;
      } else {
        elsewhere_.insert(k);
        mapping_.notes.push_back(fmt::format(
            "the model has no joint '{}': column {} of the arrays is not used", name, k));
      }
    }
  }

  void TakeColumn(size_t i) {
    if (taken_[i]) return;
    const HeadingSense& sense = senses_[i];
    const TableHeading& heading = text_.headings[i];
    LogColumn column;
    column.quantity = sense.quantity;
    switch (sense.kind) {
      case Kind::kSignal:
        column.axis = sense.axis;
        break;
      case Kind::kIndexed: {
        if (elsewhere_.contains(sense.number)) return;
        const auto found = array_.find(sense.number);
        if (found == array_.end()) {
          nameless_.push_back(i);
          return;
        }
        column.axis = found->second;
        break;
      }
      case Kind::kNoQuantity: {
        Words words;
        for (const auto& [word, quantity] : QuantityWords()) words.push_back(word);
        Error(heading.line, heading.character,
              fmt::format("'{}' names '{}', but '{}' is not known as something measured",
                          heading.full, axes_[sense.axis].name(), sense.word),
              DidYouMean(sense.word, words,
                         fmt::format("--column {}.position='{}' (or .velocity, .acceleration, "
                                     ".effort) says what it is, --ignore '{}' passes it over",
                                     axes_[sense.axis].name(), heading.full, heading.full)));
        return;
      }
      case Kind::kAmbiguous:
        Error(heading.line, heading.character,
              fmt::format("'{}' may belong to {}", heading.full, Joined(sense.candidates)),
              fmt::format("--column {}.{}='{}' says which one is meant, --ignore '{}' none",
                          sense.candidates[0], kLogQuantities[static_cast<size_t>(sense.quantity)],
                          heading.full, heading.full));
        return;
      case Kind::kCommanded:
      case Kind::kName:
      case Kind::kElse:
        if (!heading.full.empty()) unused_.push_back(heading.full);
        return;
    }
    // What is stated replaces what is found.
    const bool stated = std::ranges::any_of(mapping_.columns, [&](const LogColumn& other) {
      return !other.stated.signal.empty() && other.axis == column.axis &&
             other.quantity == column.quantity;
    });
    const bool off = std::ranges::any_of(settings_.columns, [&](const LogRequest& request) {
      return request.column.off && request.column.signal == SignalOf(column);
    });
    if (stated || off) {
      unused_.push_back(heading.full);
      return;
    }
    if (SetUnit(i, sense.unit, nullptr, &column)) mapping_.columns.push_back(column);
  }

  void ReportArrays() {
    if (nameless_.empty()) return;
    const TableHeading& first = text_.headings[nameless_[0]];
    Words names;
    for (const size_t i : nameless_) names.push_back(text_.headings[i].full);
    Error(first.line, first.character,
          fmt::format("{} column{} of arrays without the name of a joint: {}", names.size(),
                      names.size() == 1 ? "" : "s", Joined(names, kNamedAtMost)),
          "--joints A,B,C lists the joints in the order of the array");
  }

  void ReportUnused() {
    if (!unused_.empty()) {
      mapping_.notes.push_back(fmt::format("{} column{} not used: {}", unused_.size(),
                                           unused_.size() == 1 ? " is" : "s are",
                                           Joined(unused_, kNamedAtMost)));
    }
    if (!assumed_.empty()) {
      mapping_.notes.push_back(
          fmt::format("{} column{} without a unit {} taken as SI (rad, rad/s, N m; m, m/s, N): {}",
                      assumed_.size(), assumed_.size() == 1 ? "" : "s",
                      assumed_.size() == 1 ? "is" : "are", Joined(assumed_, kNamedAtMost)));
    }
  }

  void RefuseDoubled() {
    std::map<std::pair<size_t, LogQuantity>, const LogColumn*> first;
    for (const LogColumn& column : mapping_.columns) {
      const auto [at, fresh] = first.emplace(std::pair(column.axis, column.quantity), &column);
      if (fresh) continue;
      Error(column.line, column.character,
            fmt::format("'{}' and '{}' are both {}", at->second->heading, column.heading,
                        SignalOf(column)),
            fmt::format("--column {}='{}' takes one, --ignore '{}' passes one over",
                        SignalOf(column), at->second->heading, column.heading));
    }
  }

  const TableText& text_;
  const std::string& file_;
  const LogSettings& settings_;
  const std::vector<LogAxis>& axes_;
  Diagnostics& diagnostics_;
  std::vector<std::vector<Words>> variants_;  // per axis
  std::vector<bool> taken_;                   // per column
  std::vector<HeadingSense> senses_;
  std::map<int, size_t> array_;  // axis by index
  std::set<int> elsewhere_;      // indices of what the model has not
  std::vector<size_t> nameless_;
  Words unused_, assumed_;
  LogMapping mapping_;
};

// Reads a map file.
class MapReader {
 public:
  MapReader(const std::string& file, LogSettings* settings)
      : yaml_(file), values_(&yaml_, &scope_), settings_(*settings) {}

  Diagnostics Read() {
    const auto text = yaml_.ReadFile();
    const YamlNodePtr root = text ? yaml_.Parse(*text) : nullptr;
    if (root == nullptr) return yaml_.diagnostics();
    const YamlMap map(&yaml_, root.get(), "",
                      {"columns", "time", "time_unit", "joints", "ignore", "hold", "angles",
                       "velocities", "rate_hz", "from_s", "to_s", "delimiter", "decimal"});
    if (!map.valid()) return yaml_.diagnostics();
    if (const YamlNode* node = map.Find("columns")) ReadColumns(*node);
    ReadText(map, "time", &settings_.time);
    ReadText(map, "time_unit", &settings_.time_unit);
    ReadWords(map, "joints", &settings_.joints);
    ReadWords(map, "ignore", &settings_.ignore);
    ReadWords(map, "hold", &settings_.hold);
    if (const YamlNode* node = map.Find("angles")) {
      settings_.degrees = yaml_.Choice(*node, "angles", {"rad", "deg"}) == 1;
    }
    if (const YamlNode* node = map.Find("velocities")) {
      settings_.positions_only = yaml_.Choice(*node, "velocities", {"use", "compare"}) == 1;
    }
    if (const YamlNode* node = map.Find("rate_hz")) {
      settings_.rate_hz = values_.Positive(*node, "rate_hz").value_or(0.0);
    }
    if (const YamlNode* node = map.Find("from_s")) {
      settings_.from_s = values_.Number(*node, "from_s").value_or(kNan);
    }
    if (const YamlNode* node = map.Find("to_s")) {
      settings_.to_s = values_.Number(*node, "to_s").value_or(kNan);
    }
    if (const YamlNode* node = map.Find("delimiter")) {
      const auto choice = yaml_.Choice(*node, "delimiter", {"tab", "comma", "semicolon", "space"});
      if (choice) settings_.format.delimiter = "\t,; "[*choice];
    }
    if (const YamlNode* node = map.Find("decimal")) {
      const auto choice = yaml_.Choice(*node, "decimal", {"point", "comma"});
      if (choice) settings_.format.decimal_comma = *choice == 1;
    }
    return yaml_.diagnostics();
  }

 private:
  void ReadColumns(const YamlNode& node) {
    for (const YamlEntry& entry : yaml_.Entries(node, "columns")) {
      LogRequest request;
      request.column.signal = entry.key;
      request.column.path = JoinPath("columns", entry.key);
      ReadTableColumn(&values_, *entry.value, &request.column);
      request.place.file = yaml_.file();
      request.place.line = entry.line;
      request.place.column = entry.column;
      settings_.columns.push_back(std::move(request));
    }
  }

  void ReadText(const YamlMap& map, const char* key, std::string* text) {
    if (const YamlNode* node = map.Find(key)) *text = yaml_.Text(*node, key).value_or("");
  }

  void ReadWords(const YamlMap& map, const char* key, std::vector<std::string>* words) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return;
    const auto items = yaml_.Items(*node, key);
    if (!items) return;
    for (size_t i = 0; i < items->size(); ++i) {
      const auto word = yaml_.Text(*(*items)[i], fmt::format("{}[{}]", key, i));
      if (word) words->push_back(*word);
    }
  }

  YamlReader yaml_;
  Scope scope_;
  ValueReader values_;
  LogSettings& settings_;
};

}  // namespace

std::string LogAxis::UnitOf(LogQuantity quantity) const {
  switch (quantity) {
    case LogQuantity::kPosition:
      return unit;
    case LogQuantity::kVelocity:
      return unit + "/s";
    case LogQuantity::kAcceleration:
      return unit + "/s^2";
    case LogQuantity::kEffort:
      break;
  }
  return force_unit;
}

std::vector<LogAxis> LogAxes(const Mechanism& mechanism) {
  std::vector<LogAxis> axes;
  for (const NamedCoordinate& named : NamedMotionCoordinates(mechanism)) {
    if (named.coordinate.kind == Coordinate::Kind::kOutput) continue;
    const auto same = std::ranges::find(axes, named.coordinate, &LogAxis::coordinate);
    if (same != axes.end()) {
      if (!Contains(same->names, named.name)) same->names.push_back(named.name);
      continue;
    }
    LogAxis axis;
    axis.coordinate = named.coordinate;
    axis.names = {named.name};
    axis.unit = CoordinateUnit(mechanism, named.coordinate);
    axis.force_unit = axis.unit == "m" ? "N" : "N m";
    axis.size = axis.unit == "m" ? CharacteristicLength(mechanism) : 1.0;
    const auto index = static_cast<size_t>(named.coordinate.index);
    switch (named.coordinate.kind) {
      case Coordinate::Kind::kDrive: {
        axis.range = mechanism.drives[index].range;
        if (const auto* on = std::get_if<JointDrive>(&mechanism.drives[index].kind)) {
          const CoordinateRange& joint = mechanism.joints[static_cast<size_t>(on->joint)]
                                             .range[static_cast<size_t>(on->coordinate)];
          axis.range.lower = std::max(axis.range.lower, joint.lower);
          axis.range.upper = std::min(axis.range.upper, joint.upper);
        }
        break;
      }
      case Coordinate::Kind::kPrescribed:
        axis.range =
            mechanism.joints[static_cast<size_t>(mechanism.prescribed[index].joint)].range[0];
        break;
      case Coordinate::Kind::kJoint:
      case Coordinate::Kind::kOutput:
        axis.range = mechanism.joints[index].range[static_cast<size_t>(named.coordinate.component)];
        break;
    }
    axes.push_back(std::move(axis));
  }
  return axes;
}

LogMapping MapLog(const TableText& text, const std::string& file, const LogSettings& settings,
                  const std::vector<LogAxis>& axes, Diagnostics* diagnostics) {
  return Mapper(text, file, settings, axes, diagnostics).Map();
}

void ReadLogMap(const std::string& file, LogSettings* settings, Diagnostics* diagnostics) {
  diagnostics->Append(MapReader(file, settings).Read());
}

bool AddLogColumn(const std::string& text, LogSettings* settings) {
  const size_t at = text.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == text.size()) return false;
  LogRequest request;
  request.column.signal = text.substr(0, at);
  request.column.column = text.substr(at + 1);
  request.column.path = request.column.signal;
  request.place.file = "--column " + text;
  settings->columns.push_back(std::move(request));
  return true;
}

}  // namespace mbv
