#include "features/paper/signals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/demand.h"
#include "base/roles.h"
#include "comparison/force_band.h"
#include "plot/layout.h"

namespace mbv {
namespace {

using Translations = std::array<const char*, 3>;  // in the order of Language

constexpr std::array<Translations, static_cast<size_t>(FigureWord::kCount_)> kWords = {{
    {"Time", "时间", "Zeit"},
    {"Drive force", "驱动力", "Antriebskraft"},
    {"Drive torque", "驱动力矩", "Antriebsmoment"},
    {"Drive position", "驱动位移", "Antriebsweg"},
    {"Drive angle", "驱动转角", "Antriebswinkel"},
    {"Drive speed", "驱动速度", "Geschwindigkeit"},
    {"Drive speed", "驱动角速度", "Winkelgeschwindigkeit"},
    {"Joint force", "关节力", "Gelenkkraft"},
    {"Joint moment", "关节力矩", "Gelenkmoment"},
    {"Drive power", "驱动功率", "Antriebsleistung"},
    {"Energy", "能量", "Energie"},
    {"all drives", "总和", "alle Antriebe"},
    {"kinetic", "动能", "kinetisch"},
    {"gravity, change", "重力势能变化", "Lage, Änderung"},
    {"springs", "弹性势能", "Federn"},
    {"Difference", "差值", "Differenz"},
    {"Step", "步长", "Schrittweite"},
    {"Time constant", "时间常数", "Zeitkonstante"},
    {"Force error, RMS / RMS force", "力误差（均方根 / 力均方根）",
     "Kraftfehler, Effektivwert / Kraft"},
    {"corrected engine", "修正引擎", "korrigiertes MuJoCo"},
    {"stock engine", "原始引擎", "MuJoCo, wie es ist"},
    {"step alone", "仅步长", "nur Schrittweite"},
    {"Distance from the axis", "到轴线的距离", "Abstand von der Achse"},
    {"azimuth", "方位角", "Azimut"},
    {"limit", "限值", "Grenze"},
}};

struct WitnessWords {
  const Role* role;
  Translations words;
};
constexpr std::array<WitnessWords, 5> kWitnessWords = {{
    {&role::kAnalytic, {"analytic", "解析", "analytisch"}},
    {&role::kReference, {"reference", "参考", "Referenz"}},
    {&role::kSimulated, {"simulation", "仿真", "Simulation"}},
    {&role::kSolver, {"generic solver", "通用求解", "allgemeiner Löser"}},
    {&role::kReached, {"reached motion", "实际运动", "erreichte Bewegung"}},
}};

}  // namespace

const std::vector<std::string>& LanguageCodes() {
  static const std::vector<std::string> codes = {"en", "zh", "de"};
  return codes;
}

Language LanguageOf(const std::string& code) {
  for (size_t k = 0; k < LanguageCodes().size(); ++k) {
    if (LanguageCodes()[k] == code) return static_cast<Language>(k);
  }
  MBV_DEMAND(false, code);
  return Language::kEnglish;
}

std::string WordFor(FigureWord word, Language language) {
  return kWords.at(static_cast<size_t>(word)).at(static_cast<size_t>(language));
}

std::string SayWitness(std::string_view name, Language language) {
  for (const WitnessWords& row : kWitnessWords) {
    if (name == *row.role) return row.words.at(static_cast<size_t>(language));
  }
  return AsPlainText(name);
}

std::vector<const WitnessRecord*> ShownWitnesses(const Report& report) {
  std::vector<const WitnessRecord*> shown;
  for (const WitnessRecord& record : report.witnesses) {
    const Role* role = FindRole(record.name);
    const bool compared = role == nullptr ? record.foreign.has_value() : IsCompared(*role);
    if (!compared || record.trace.time_s.empty()) continue;
    shown.push_back(&record);
  }
  return shown;
}

const WitnessRecord* LineWitness(const Report& report) {
  const std::vector<const WitnessRecord*> shown = ShownWitnesses(report);
  const PairComparison* pair = report.comparison.MainPair();
  for (const WitnessRecord* record : shown) {
    if (pair != nullptr && record->name == pair->truth) return record;
  }
  return shown.empty() ? nullptr : shown.front();
}

FigurePoints Scaled(const PlotPoints& points, const ShownUnit& x, const ShownUnit& y) {
  FigurePoints scaled;
  scaled.reserve(points.size());
  for (const auto& [u, v] : points) scaled.emplace_back(x.factor * u, y.factor * v);
  return scaled;
}

PlotPoints FromStart(PlotPoints points, bool from_start) {
  const double first = from_start && !points.empty() ? points.front().second : 0.0;
  for (auto& [time, value] : points) value -= first;
  return points;
}

PlotPoints Envelope(const PlotPoints& points, size_t spans) {
  if (points.size() <= spans) return points;
  PlotPoints upper;
  const size_t span = (points.size() + spans - 1) / spans;
  for (size_t from = 0; from < points.size(); from += span) {
    std::pair<double, double> largest = points[from];
    for (size_t i = from; i < std::min(from + span, points.size()); ++i) {
      if (!(points[i].second <= largest.second)) largest = points[i];
    }
    upper.push_back(largest);
  }
  return upper;
}

FigurePoints SomeOf(const FigurePoints& points, double shift) {
  FigurePoints some;
  const double step = static_cast<double>(points.size()) / static_cast<double>(kMarksAlong);
  for (size_t k = 0; k < kMarksAlong; ++k) {
    const auto at = static_cast<size_t>((static_cast<double>(k) + shift) * step);
    if (at < points.size() && (some.empty() || some.back() != points[at])) {
      some.push_back(points[at]);
    }
  }
  return some;
}

double LargestOf(const Report& report, const std::string& channel) {
  double largest = 0.0;
  for (const WitnessRecord* record : ShownWitnesses(report)) {
    const int column = record->trace.Find(channel);
    if (column < 0) continue;
    for (const double value : record->trace.values.col(column)) {
      if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
    }
  }
  return largest;
}

namespace {

constexpr int kBlackLook = -1;
constexpr double kFirstMark = 0.3, kNextMark = 0.4;  // of a spacing: no two witnesses' marks meet

class OverTimePainter {
 public:
  OverTimePainter(const OverTimeOptions& options, FigurePanel* panel)
      : options_(options), panel_(*panel) {}

  void Line(const Trace& trace, const SignalRow& row, int look) {
    const int column = trace.Find(row.channel);
    if (column < 0) return;
    const ForceSignal signal(trace, column);
    panel_.curves.push_back({.label = options_.legend ? row.label : "",
                             .points = Placed(Thinned(Values(trace, signal), kFigureBins)),
                             .look = look});
    const PlotPoints strokes = StrokesOf(trace, signal);
    if (strokes.empty() || options_.from_start) return;
    panel_.curves.push_back({.points = Placed(strokes), .look = look, .extent = true});
  }

  void Marks(const Trace& trace, const SignalRow& row, int look, int marker) {
    const int column = trace.Find(row.channel);
    if (column < 0) return;
    const FigurePoints points = Placed(Values(trace, ForceSignal(trace, column)));
    panel_.curves.push_back({.points = SomeOf(points, kFirstMark + kNextMark * marker),
                             .look = look,
                             .line = false,
                             .marker = marker});
  }

  // A row of the legend alone.
  void Name(const WitnessRecord& witness, int marker) {
    if (!options_.legend) return;
    panel_.curves.push_back({.label = SayWitness(witness.name, options_.language),
                             .look = kBlackLook,
                             .line = marker < 0,
                             .marker = marker});
  }

 private:
  [[nodiscard]] PlotPoints Values(const Trace& trace, const ForceSignal& signal) const {
    return FromStart(ValuesOf(trace, signal), options_.from_start);
  }

  [[nodiscard]] FigurePoints Placed(const PlotPoints& points) const {
    return Scaled(points, options_.time, options_.unit);
  }

  const OverTimeOptions& options_;
  FigurePanel& panel_;
};

}  // namespace

void AddOverTime(const std::vector<SignalRow>& rows,
                 const std::vector<const WitnessRecord*>& witnesses, const WitnessRecord* line,
                 const OverTimeOptions& options, FigurePanel* panel) {
  if (line == nullptr) return;
  OverTimePainter painter(options, panel);
  for (size_t k = 0; k < rows.size(); ++k) {
    painter.Line(line->trace, rows[k], static_cast<int>(k));
  }
  int marker = 0;
  for (const WitnessRecord* witness : witnesses) {
    if (witness == line) continue;
    for (size_t k = 0; k < rows.size(); ++k) {
      painter.Marks(witness->trace, rows[k], static_cast<int>(k), marker);
    }
    ++marker;
  }
  marker = 0;
  for (const WitnessRecord* witness : witnesses) {
    painter.Name(*witness, witness == line ? -1 : marker++);
  }
}

}  // namespace mbv
