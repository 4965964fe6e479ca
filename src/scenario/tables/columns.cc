#include "scenario/tables/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

#include "base/text.h"
#include "mechanism/channels.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

constexpr size_t kMostNamed = 8;  // columns named in a note

// Letters and digits in lower case: "Limb1_Drive.Force" → "limb1driveforce".
std::string Plain(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) != 0 || u >= 0x80) plain += static_cast<char>(std::tolower(u));
  }
  return plain;
}

class Mapper {
 public:
  Mapper(const TableText& text, const TableSettings& settings, const Mechanism& mechanism,
         YamlReader* yaml, Diagnostics* diagnostics)
      : text_(text),
        settings_(settings),
        mechanism_(mechanism),
        yaml_(yaml),
        diagnostics_(diagnostics),
        signals_(settings.signals.empty() ? TableSignals(mechanism) : settings.signals),
        used_(text.columns, false) {}

  TableMapping Map() {
    MapTime();
    for (const TableColumnSettings& column : settings_.columns) {
      if (column.signal != "time") MapStated(column);
    }
    if (settings_.signals.empty()) MapByName();
    if (mapping_.columns.empty() && !failed_) ReportNothing();
    NoteUnits();
    if (settings_.signals.empty()) NoteUnused();
    return std::move(mapping_);
  }

 private:
  [[nodiscard]] std::string NameOf(size_t index) const {
    const std::string& full = text_.headings[index].full;
    return full.empty() ? fmt::format("column {}", index + 1) : full;
  }

  void Fail(const YamlEntry& place, const std::string& message, const std::string& hint) {
    yaml_->Error(place, message, hint);
    failed_ = true;
  }

  // The column that the settings name; nothing after a finding.
  std::optional<size_t> FindStated(const TableColumnSettings& settings) {
    const std::string& path = settings.path;
    if (settings.number > 0) {
      const auto index = static_cast<size_t>(settings.number - 1);
      if (index < text_.columns) return index;
      Fail(settings.place,
           fmt::format("{}: column {} of {} violates 1 … {}", path, settings.number, settings_.csv,
                       text_.columns),
           "");
      return {};
    }
    const std::string& wanted = settings.column.empty() ? settings.signal : settings.column;
    for (int exactness = 0; exactness < 4; ++exactness) {
      std::vector<size_t> found;
      for (size_t i = 0; i < text_.columns; ++i) {
        const TableHeading& heading = text_.headings[i];
        const bool same = exactness == 0   ? heading.full == wanted
                          : exactness == 1 ? heading.name == wanted
                          : exactness == 2 ? Plain(heading.full) == Plain(wanted)
                                           : Plain(heading.name) == Plain(wanted);
        if (same && !wanted.empty()) found.push_back(i);
      }
      if (found.size() == 1) return found[0];
      if (found.empty()) continue;
      Fail(settings.place,
           fmt::format("{}: {} columns of {} are called '{}'", path, found.size(), settings_.csv,
                       wanted),
           "give the column by its number");
      return {};
    }
    ReportMissing(settings, path, wanted);
    return {};
  }

  void ReportMissing(const TableColumnSettings& settings, const std::string& path,
                     const std::string& wanted) {
    std::vector<std::string> names;
    for (const TableHeading& heading : text_.headings) {
      if (!heading.full.empty()) names.push_back(heading.full);
      if (!heading.name.empty() && heading.name != heading.full) names.push_back(heading.name);
    }
    const std::string otherwise =
        names.empty()
            ? fmt::format("it has no heading; give one of its {} columns by number", text_.columns)
            : "its columns: " + JoinedAndMore(names, kMostNamed);
    Fail(settings.place, fmt::format("{}: {} has no column '{}'", path, settings_.csv, wanted),
         DidYouMean(wanted, names, otherwise));
  }

  [[nodiscard]] const TableColumnSettings* TimeSettings() const {
    for (const TableColumnSettings& column : settings_.columns) {
      if (column.signal == "time") return &column;
    }
    return nullptr;
  }

  // The column stated, one named like a time, or the first.
  void MapTime() {
    const TableColumnSettings* stated = TimeSettings();
    std::string seconds_by_name;
    if (stated != nullptr) {
      const auto index = FindStated(*stated);
      if (!index) return;
      mapping_.time_index = *index;
    } else {
      bool named = false;
      for (size_t i = 0; i < text_.columns && !named; ++i) {
        const std::string name = Plain(text_.headings[i].name);
        named = name == "t" || name == "time" || name == "times" || name == "timesec" ||
                name == "timems" || name == "zeit";
        if (named) mapping_.time_index = i;
      }
      if (!named) {
        mapping_.notes.push_back(
            fmt::format("no column is named as the time: {} is taken", NameOf(0)));
      }
    }
    used_[mapping_.time_index] = true;
    SetTimeUnit(stated);
  }

  void SetTimeUnit(const TableColumnSettings* stated) {
    const TableHeading& heading = text_.headings[mapping_.time_index];
    const bool in_columns = stated != nullptr && !stated->unit.empty();
    const std::string& text = in_columns                     ? stated->unit
                              : !settings_.time_unit.empty() ? settings_.time_unit
                                                             : heading.unit;
    const std::string name = Plain(heading.name);
    if (text.empty()) {
      if (name == "timems") mapping_.time_factor = 1e-3;
      if (name != "timems" && name != "times" && name != "timesec") {
        mapping_.notes.emplace_back("its time has no unit: seconds are assumed");
        mapping_.time_unit_assumed = true;
      }
      return;
    }
    const auto unit = FindUnit(text);
    if (unit && unit->si == "s") {
      mapping_.time_factor = unit->factor;
      return;
    }
    const std::string message = fmt::format("'{}' is not a unit of time", text);
    const std::string hint = UnitHint(text, "s");
    failed_ = true;
    if (in_columns) {
      yaml_->AddAt(Severity::kError, stated->unit_line, stated->unit_character,
                   stated->path + ".unit: " + message, hint);
    } else if (!settings_.time_unit.empty()) {
      yaml_->AddAt(Severity::kError, settings_.time_unit_line, settings_.time_unit_character,
                   settings_.path + ".time_unit: " + message, hint);
    } else {
      AddFileFinding(Severity::kError, heading, NameOf(mapping_.time_index) + ": " + message,
                     hint + fmt::format("; or state {}.time_unit", settings_.path));
    }
  }

  void AddFileFinding(Severity severity, const TableHeading& heading, std::string message,
                      std::string hint) {
    Finding finding;
    finding.severity = severity;
    finding.file = settings_.file;
    finding.line = heading.line;
    finding.column = heading.character;
    finding.message = std::move(message);
    finding.hint = std::move(hint);
    diagnostics_->Add(std::move(finding));
  }

  void MapStated(const TableColumnSettings& settings) {
    const auto signal = std::find_if(signals_.begin(), signals_.end(), [&](const Channel& channel) {
      return channel.name == settings.signal;
    });
    if (signal == signals_.end()) {
      std::vector<std::string> names = {"time"};
      for (const Channel& channel : signals_) names.push_back(channel.name);
      Fail(
          settings.place,
          fmt::format("reference.columns: {} has no signal '{}'", mechanism_.name, settings.signal),
          DidYouMean(settings.signal, names,
                     "signals: DRIVE.force, .position, .velocity, .acceleration; OUTPUT.x … "
                     "OUTPUT.yaw; JOINT.reaction.fx … .mz"));
      return;
    }
    if (settings.off) {
      off_.push_back(settings.signal);
      return;
    }
    const auto index = FindStated(settings);
    if (index) Take(*index, *signal, &settings, false);
  }

  // Headings that are the names of signals.
  void MapByName() {
    if (!text_.has_names) return;
    const std::string suffix = "." + settings_.witness;
    for (const Channel& signal : signals_) {
      if (IsMapped(signal.name)) continue;
      std::vector<size_t> exact, ours, alike;
      for (size_t i = 0; i < text_.columns; ++i) {
        if (used_[i]) continue;
        const TableHeading& heading = text_.headings[i];
        if (heading.name == signal.name || heading.full == signal.name) exact.push_back(i);
        if (heading.full == signal.name + suffix) ours.push_back(i);
        if (Plain(heading.name) == Plain(signal.name)) alike.push_back(i);
      }
      if (exact.size() == 1) {
        Take(exact[0], signal, nullptr, false);
      } else if (ours.size() == 1) {
        Take(ours[0], signal, nullptr, true);
      } else if (alike.size() == 1) {
        Take(alike[0], signal, nullptr, false);
        mapping_.notes.push_back(
            fmt::format("column '{}' is taken as {}", NameOf(alike[0]), signal.name));
      }
    }
  }

  [[nodiscard]] bool IsMapped(const std::string& signal) const {
    if (std::find(off_.begin(), off_.end(), signal) != off_.end()) return true;
    return std::any_of(mapping_.columns.begin(), mapping_.columns.end(),
                       [&](const MappedColumn& m) { return m.column.channel.name == signal; });
  }

  void Take(size_t index, const Channel& signal, const TableColumnSettings* settings, bool ours) {
    if (used_[index] && settings != nullptr) {
      yaml_->AddAt(Severity::kWarning, settings->place.line, settings->place.column,
                   fmt::format("{}: column '{}' is used for another signal, too", settings->path,
                               NameOf(index)));
    }
    used_[index] = true;
    MappedColumn mapped{.index = index, .column = {}, .settings = settings};
    mapped.column.channel = signal;
    mapped.column.heading = NameOf(index);
    mapped.column.unit = signal.unit;
    double unit_factor = 1.0;
    if (!ours) SetUnit(&mapped, &unit_factor);
    if (settings != nullptr) {
      mapped.column.factor = settings->sign * settings->scale * unit_factor;
      mapped.column.shift = settings->offset * unit_factor;
      mapped.column.tolerance = settings->tolerance;
    } else {
      mapped.column.factor = unit_factor;
    }
    if (!mapped.column.tolerance) mapped.column.tolerance = settings_.tolerance;
    if (mapped.column.tolerance) mapped.column.tolerance->absolute *= unit_factor;
    mapping_.columns.push_back(std::move(mapped));
  }

  // The stated unit, else the heading's; SI where there is none.
  void SetUnit(MappedColumn* mapped, double* factor) {
    const TableHeading& heading = text_.headings[mapped->index];
    const std::string& si = mapped->column.channel.unit;
    const bool stated = mapped->settings != nullptr && !mapped->settings->unit.empty();
    const std::string& text = stated ? mapped->settings->unit : heading.unit;
    if (text.empty()) {
      unitless_.push_back(mapped->column.heading);
      mapped->unit_assumed = true;
      return;
    }
    const auto unit = FindUnit(text);
    if (unit && unit->si == si) {
      mapped->column.unit = unit->text;
      *factor = unit->factor;
      if (stated) CompareUnits(*mapped, *unit, heading);
      return;
    }
    failed_ = true;
    const std::string message = unit ? fmt::format("'{}' is not a unit of {}, which is in {}", text,
                                                   mapped->column.channel.name, si)
                                     : fmt::format("'{}' is not a known unit", text);
    const std::string hint = UnitHint(unit ? "" : text, si);
    if (stated) {
      yaml_->AddAt(Severity::kError, mapped->settings->unit_line, mapped->settings->unit_character,
                   fmt::format("{}.unit: {}", mapped->settings->path, message), hint);
    } else {
      AddFileFinding(Severity::kError, heading, mapped->column.heading + ": " + message,
                     hint + fmt::format("; or state {}.unit", PathOf(*mapped)));
    }
  }

  static std::string PathOf(const MappedColumn& mapped) {
    return mapped.settings != nullptr ? mapped.settings->path
                                      : "reference.columns." + mapped.column.channel.name;
  }

  // A stated unit wins over the heading's, but not silently.
  void CompareUnits(const MappedColumn& mapped, const TableUnit& stated,
                    const TableHeading& heading) {
    const auto written = FindUnit(heading.unit);
    if (!written || (written->si == stated.si && written->factor == stated.factor)) return;
    yaml_->AddAt(Severity::kWarning, mapped.settings->unit_line, mapped.settings->unit_character,
                 fmt::format("{}.unit = '{}', but the heading of {} says '{}'",
                             mapped.settings->path, stated.text, settings_.csv, heading.unit),
                 "the scenario's unit is used");
  }

  void ReportNothing() {
    std::vector<std::string> names;
    bool ours = false;
    for (const TableHeading& heading : text_.headings) {
      if (!heading.full.empty()) names.push_back(heading.full);
      ours = ours || heading.full.ends_with(".analytic") || heading.full.ends_with(".simulated");
    }
    std::string hint = "map them: columns: {time: 1, DRIVE.force: 2}";
    if (!names.empty()) hint += "; its columns: " + JoinedAndMore(names, kMostNamed);
    if (ours) hint += "; or state witness: analytic | simulated";
    yaml_->Error(settings_.place,
                 fmt::format("no column of {} is a signal of {}", settings_.csv, mechanism_.name),
                 hint);
  }

  void NoteUnits() {
    if (unitless_.empty()) return;
    mapping_.notes.push_back("no unit is given, SI is assumed: " +
                             JoinedAndMore(unitless_, kMostNamed));
  }

  void NoteUnused() {
    std::vector<std::string> unused;
    for (size_t i = 0; i < text_.columns; ++i) {
      if (!used_[i]) unused.push_back(NameOf(i));
    }
    if (unused.empty()) return;
    mapping_.notes.push_back(fmt::format("{} column{} not used: {}", unused.size(),
                                         unused.size() == 1 ? " is" : "s are",
                                         JoinedAndMore(unused, kMostNamed)));
  }

  const TableText& text_;
  const TableSettings& settings_;
  const Mechanism& mechanism_;
  YamlReader* yaml_;
  Diagnostics* diagnostics_;
  const std::vector<Channel> signals_;
  std::vector<bool> used_;
  std::vector<std::string> off_, unitless_;
  TableMapping mapping_;
  bool failed_ = false;
};

}  // namespace

std::vector<Channel> TableSignals(const Mechanism& mechanism) {
  std::vector<Channel> signals = DriveChannels(mechanism);
  const auto add = [&signals](std::vector<Channel> more) {
    signals.insert(signals.end(), more.begin(), more.end());
  };
  add(OutputChannels(mechanism));
  add(PrescribedChannels(mechanism));
  for (const Joint& joint : mechanism.joints) add(ReactionChannels(joint));
  return signals;
}

TableMapping MapColumns(const TableText& text, const TableSettings& settings,
                        const Mechanism& mechanism, YamlReader* yaml, Diagnostics* diagnostics) {
  return Mapper(text, settings, mechanism, yaml, diagnostics).Map();
}

}  // namespace mbv
