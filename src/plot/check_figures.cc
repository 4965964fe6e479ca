#include "plot/figure.h"

#include <fmt/format.h>

#include "base/roles.h"
#include "base/text.h"
#include "plot/style.h"

namespace mbv {
namespace {

constexpr size_t kShownWords = 12;  // of a hint

class FigureChecker {
 public:
  FigureChecker(const std::vector<Channel>& known, const std::vector<std::string>& foreign,
                const std::string& file, Diagnostics* diagnostics)
      : known_(known), file_(file), diagnostics_(diagnostics) {
    for (const Channel& channel : known) names_.push_back(channel.name);
    for (const Role* role : kRoles) {
      if (IsCompared(*role)) roles_.emplace_back(role->name);
    }
    roles_.insert(roles_.end(), foreign.begin(), foreign.end());
  }

  void Check(const PanelSpec& panel) {
    std::string unit;
    for (const PlacedText& signal : panel.signals) CheckSignal(signal, &unit);
    CheckUnit(panel.unit, unit);
    for (const PlacedText& witness : panel.witnesses) CheckWitness(witness);
    for (const PlacedText& witness : panel.marks) CheckWitness(witness);
    if (panel.against.given()) CheckWitness(panel.against);
    CheckX(panel);
  }

 private:
  void Error(const PlacedText& at, const std::string& message, const std::string& hint) {
    diagnostics_->Add({.severity = Severity::kError,
                       .file = file_,
                       .line = at.line,
                       .column = at.column,
                       .message = at.path + message,
                       .hint = hint});
  }

  // All signals of a panel are shown in one unit.
  void CheckSignal(const PlacedText& signal, std::string* unit) {
    if (!signal.given()) return;
    bool any = false;
    for (const Channel& channel : known_) {
      if (!FitsPattern(channel.name, signal.text)) continue;
      any = true;
      if (unit->empty()) *unit = channel.unit;
      if (*unit == channel.unit) continue;
      return Error(signal,
                   fmt::format(" = '{}': '{}' is in {}, others of the panel in {}", signal.text,
                               channel.name, channel.unit, *unit),
                   "a panel has one unit: give it panels");
    }
    if (!any) RefuseUnknown(signal);
  }

  void RefuseUnknown(const PlacedText& signal) {
    Error(signal, fmt::format(" = '{}': no witness records such a signal", signal.text),
          DidYouMean(signal.text, names_, "signals: " + Joined(names_, kShownWords)));
  }

  void CheckUnit(const PlacedText& unit, const std::string& si) {
    if (!unit.given() || si.empty() || FindUnit(si, unit.text) != nullptr || unit.text == si) {
      return;
    }
    const std::vector<std::string> units = UnitsOf(si);
    Error(unit, fmt::format(" = '{}' is not a unit of what is recorded in {}", unit.text, si),
          DidYouMean(unit.text, units, "units: " + Joined(units)));
  }

  void CheckWitness(const PlacedText& witness) {
    if (!witness.given() || Contains(roles_, witness.text)) return;
    Error(witness, fmt::format(" = '{}' is not a witness", witness.text),
          DidYouMean(witness.text, roles_, "witnesses: " + Joined(roles_)));
  }

  void CheckX(const PanelSpec& panel) {
    std::string si = "s";
    if (panel.x.given()) {
      si.clear();
      for (const Channel& channel : known_) {
        if (channel.name == panel.x.text) si = channel.unit;
      }
      if (si.empty()) return RefuseUnknown(panel.x);
      if (panel.against.given()) {
        Error(panel.x, " and difference_to do not go together",
              "a difference is taken at common times");
      }
    }
    CheckUnit(panel.x_unit, si);
  }

  const std::vector<Channel>& known_;
  const std::string& file_;
  Diagnostics* diagnostics_;
  std::vector<std::string> names_, roles_;
};

}  // namespace

bool FitsPattern(const std::string& name, const std::string& pattern) {
  // The last star and where it was tried last: what it takes grows until the rest fits.
  size_t n = 0, p = 0, star = std::string::npos, tried = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      tried = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p, ++n;
    } else if (star != std::string::npos) {
      p = star + 1;
      n = ++tried;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string::npos;
}

void CheckFigures(const std::vector<FigureSpec>& figures, const std::vector<Channel>& known,
                  const std::vector<std::string>& foreign, const std::string& file,
                  Diagnostics* diagnostics) {
  FigureChecker checker(known, foreign, file, diagnostics);
  for (const FigureSpec& figure : figures) {
    for (const PanelSpec& panel : figure.panels) checker.Check(panel);
  }
}

}  // namespace mbv
