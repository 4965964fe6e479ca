#include "features/paper/compose.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "comparison/force_band.h"
#include "features/paper/signals.h"
#include "plot/check_figures.h"
#include "plot/layout.h"

namespace mbv {
namespace {

constexpr size_t kMostMarks = 60;  // of one curve; more would be a band

class PanelComposer {
 public:
  PanelComposer(const PanelSpec& spec, const Report& report, Language language)
      : spec_(spec), report_(report), language_(language) {
    for (const WitnessRecord* record : ShownWitnesses(report)) {
      const auto named = [&](const PlacedText& text) { return text.text == record->name; };
      const bool wanted = spec.witnesses.empty() || std::ranges::any_of(spec.witnesses, named);
      if (wanted && record->name != spec.against.text) witnesses_.push_back(record);
    }
    FindChannels();
  }

  // What was not recorded.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

  [[nodiscard]] bool empty() const { return channels_.empty(); }

  FigurePanel Compose() {
    panel_.share = spec_.share;
    panel_.y.log = spec_.log;
    panel_.equal_scale = spec_.equal_scale;
    ChooseUnits();
    if (spec_.against.given()) {
      Differences();
    } else if (spec_.x.given() || channels_.size() == 1) {
      LinePerWitness();
    } else {
      AddOverTime(Rows(), witnesses_, LineOf(),
                  {x_unit_, unit_, language_, spec_.legend, spec_.from_start}, &panel_);
    }
    if (!spec_.legend) {
      for (FigureCurve& curve : panel_.curves) curve.label.clear();
    }
    NameAxes();
    return std::move(panel_);
  }

 private:
  // In the order of the patterns, then of the traces; each once.
  void FindChannels() {
    for (const PlacedText& signal : spec_.signals) {
      const size_t before = channels_.size();
      for (const WitnessRecord* record : witnesses_) {
        for (const Channel& channel : record->trace.channels) {
          if (!FitsPattern(channel.name, signal.text) || Contains(channels_, channel.name))
            continue;
          channels_.push_back(channel.name);
          si_ = channel.unit;
        }
      }
      if (channels_.size() == before) missing_.push_back(signal.path + " = '" + signal.text + "'");
    }
  }

  void ChooseUnits() {
    double largest = 0, x_largest = report_.duration_s;
    for (const std::string& channel : channels_) {
      largest = std::max(largest, LargestOf(report_, channel));
    }
    if (spec_.against.given()) largest = 1.0;
    std::string x_si = "s";
    if (spec_.x.given()) {
      for (const WitnessRecord* record : witnesses_) {
        const int column = record->trace.Find(spec_.x.text);
        if (column >= 0) x_si = record->trace.channels[static_cast<size_t>(column)].unit;
      }
      x_largest = LargestOf(report_, spec_.x.text);
    }
    unit_ = Chosen(spec_.unit, si_, largest);
    x_unit_ = Chosen(spec_.x_unit, x_si, x_largest);
  }

  static ShownUnit Chosen(const PlacedText& wanted, const std::string& si, double largest) {
    const ShownUnit* unit = wanted.given() ? FindUnit(si, wanted.text) : nullptr;
    return unit != nullptr ? *unit : UsualUnit(si, largest);
  }

  [[nodiscard]] const WitnessRecord* LineOf() const {
    const WitnessRecord* line = LineWitness(report_);
    const bool shown = std::ranges::find(witnesses_, line) != witnesses_.end();
    return shown ? line : witnesses_.empty() ? nullptr : witnesses_.front();
  }

  [[nodiscard]] std::string NameOf(const std::string& channel) const {
    const auto found = spec_.names.find(channel);
    return found != spec_.names.end() ? found->second : AsPlainText(channel);
  }

  [[nodiscard]] std::vector<SignalRow> Rows() const {
    std::vector<SignalRow> rows;
    for (const std::string& channel : channels_) rows.push_back({channel, NameOf(channel)});
    return rows;
  }

  // "name", "witness", or both where there are several of both.
  [[nodiscard]] std::string RowName(const std::string& channel, const std::string& witness) const {
    if (channels_.size() == 1 && !spec_.names.contains(channel)) return witness;
    if (witnesses_.size() == 1) return NameOf(channel);
    return NameOf(channel) + ", " + witness;
  }

  void AddCurve(const std::string& label, const FigurePoints& points) {
    panel_.curves.push_back(
        {.label = label, .points = points, .look = static_cast<int>(panel_.curves.size())});
  }

  [[nodiscard]] bool IsMarks(const WitnessRecord& record) const {
    return std::ranges::any_of(spec_.marks,
                               [&](const PlacedText& text) { return text.text == record.name; });
  }

  // The curve added last stands as markers.
  void MarkLast() {
    FigureCurve& curve = panel_.curves.back();
    curve.line = false;
    if (curve.points.size() > kMostMarks) curve.points = SomeOf(curve.points, 0.5);
    curve.marker = markers_++ % kMarkerShapes;
  }

  void LinePerWitness() {
    for (const std::string& channel : channels_) {
      for (const WitnessRecord* record : witnesses_) {
        const int column = record->trace.Find(channel);
        if (column < 0) continue;
        const PlotPoints points = FromStart(
            ValuesOf(record->trace, ForceSignal(record->trace, column)), spec_.from_start);
        const FigurePoints shown = spec_.x.given()
                                       ? OverSignal(*record, points)
                                       : Scaled(Thinned(points, kFigureBins), x_unit_, unit_);
        if (shown.empty()) continue;
        AddCurve(RowName(channel, SayWitnessOf(*record)), shown);
        if (IsMarks(*record)) MarkLast();
      }
    }
  }

  [[nodiscard]] std::string SayWitnessOf(const WitnessRecord& record) const {
    return SayWitness(record.name, language_);
  }

  [[nodiscard]] FigurePoints OverSignal(const WitnessRecord& record,
                                        const PlotPoints& points) const {
    FigurePoints shown;
    const int column = record.trace.Find(spec_.x.text);
    const size_t stride = 1 + points.size() / (2 * kFigureBins);
    for (size_t i = 0; column >= 0 && i < points.size(); i += stride) {
      shown.emplace_back(x_unit_.factor * record.trace.values(static_cast<Eigen::Index>(i), column),
                         unit_.factor * points[i].second);
    }
    return shown;
  }

  void Differences() {
    const Trace* truth = TraceOf(report_, spec_.against.text);
    if (truth == nullptr) {
      missing_.push_back(spec_.against.path + " = '" + spec_.against.text + "'");
      return;
    }
    for (const std::string& channel : channels_) {
      for (const WitnessRecord* record : witnesses_) {
        const int a = record->trace.Find(channel), b = truth->Find(channel);
        if (a < 0 || b < 0) continue;
        const PlotPoints points = DifferencesOf(record->trace, a, *truth, b);
        const std::string pair =
            SayWitnessOf(*record) + " − " + SayWitness(spec_.against.text, language_);
        AddCurve(RowName(channel, pair), Scaled(Shortened(points), x_unit_, unit_));
      }
    }
  }

  // Noise on a logarithmic scale: how large it becomes is what counts.
  [[nodiscard]] PlotPoints Shortened(const PlotPoints& points) const {
    return spec_.log ? Envelope(points, kDifferenceSpans) : Thinned(points, kFigureBins);
  }

  void NameAxes() {
    const bool one = channels_.size() == 1;
    const std::string usual = one ? NameOf(channels_.front()) : "";
    panel_.y.label = AxisLabel(spec_.label.empty() ? usual : spec_.label, "", unit_.shown);
    if (spec_.x.given()) {
      const std::string name = spec_.x_label.empty() ? NameOf(spec_.x.text) : spec_.x_label;
      panel_.x.label = AxisLabel(name, "", x_unit_.shown);
      return;
    }
    panel_.x.label = spec_.x_label.empty()
                         ? AxisLabel(WordFor(FigureWord::kTime, language_), "*t*", x_unit_.shown)
                         : AxisLabel(spec_.x_label, "", x_unit_.shown);
  }

  const PanelSpec& spec_;
  const Report& report_;
  const Language language_;
  std::vector<const WitnessRecord*> witnesses_;
  std::vector<std::string> channels_, missing_;
  std::string si_;
  int markers_ = 0;  // that were given
  ShownUnit unit_, x_unit_;
  FigurePanel panel_;
};

bool SameX(const std::vector<PanelSpec>& panels) {
  return std::ranges::all_of(panels, [&](const PanelSpec& panel) {
    return panel.x.text == panels.front().x.text && panel.x_unit.text == panels.front().x_unit.text;
  });
}

}  // namespace

FigureSet ComposeFigures(const std::vector<FigureSpec>& specs, const Report& report,
                         Language language) {
  FigureSet set;
  for (const FigureSpec& spec : specs) {
    Figure figure{.name = spec.name.text,
                  .caption = spec.caption,
                  .common_x = SameX(spec.panels),
                  .width_mm = spec.width_mm,
                  .height_mm = spec.height_mm};
    for (const PanelSpec& part : spec.panels) {
      PanelComposer composer(part, report, language);
      FigurePanel panel = composer.Compose();
      for (const std::string& what : composer.missing()) {
        set.left_out.push_back(
            fmt::format("{}: {}: no witness that is shown recorded it", spec.name.text, what));
      }
      if (!composer.empty() && !panel.curves.empty()) figure.panels.push_back(std::move(panel));
    }
    if (!figure.panels.empty()) set.figures.push_back(std::move(figure));
  }
  return set;
}

}  // namespace mbv
