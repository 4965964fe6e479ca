#include "figure/words.h"

#include <array>

#include "core/demand.h"
#include "core/roles.h"
#include "figure/markup.h"

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
  return Verbatim(name);
}

std::string AxisLabel(const std::string& name, const std::string& symbol, const std::string& unit) {
  std::string label = name;
  if (!symbol.empty()) label += (label.empty() ? "" : " ") + symbol;
  return unit.empty() || unit == "1" ? label : label + " (" + unit + ")";
}

}  // namespace mbv
