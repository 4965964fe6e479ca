#include "scenario/study_design.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <sstream>

#include "core/files.h"
#include "core/inputs.h"
#include "core/word_hints.h"
#include "table/numbers.h"
#include "table/text.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kDesignWords = {"sobol", "saltelli",      "latin_hypercube",
                                               "grid",  "one_at_a_time", "list"};

// The points of a file with commas between cells, in the order of the factors; its first line names
// the columns.
class PointList {
 public:
  PointList(std::string file, const std::vector<Factor>& factors, Diagnostics* findings)
      : file_(std::move(file)), factors_(factors), findings_(findings) {}

  std::vector<std::vector<double>> Read() {
    const auto text = ReadWholeFile(file_);
    if (!text) {
      findings_->AddError(file_, "cannot be read", DidYouMeanPath(file_));
      return {};
    }
    NoteInput(file_, *text);
    std::vector<std::vector<double>> points;
    std::istringstream lines(text->starts_with("\xEF\xBB\xBF") ? text->substr(3) : *text);
    CutLine cut;
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      CutCells(line, ',', &cut);
      if (cut.cells.size() == 1 && cut.cells[0].text.empty()) continue;
      if (!columns_.empty()) {
        points.push_back(PointOf({line, number}, cut));
      } else if (!FindColumns(cut)) {
        return {};
      }
    }
    if (points.empty()) findings_->AddError(file_, "has no points");
    return points;
  }

 private:
  // The heading: names as they are, whatever units they look like.
  bool FindColumns(const CutLine& heading) {
    std::vector<std::string> names;
    for (const TableCell& cell : heading.cells) names.emplace_back(cell.text);
    for (const Factor& factor : factors_) {
      const auto found = std::find(names.begin(), names.end(), factor.name);
      columns_.push_back(static_cast<size_t>(found - names.begin()));
      if (found != names.end()) continue;
      findings_->AddError(file_, fmt::format("has no column '{}'", factor.name),
                          DidYouMean(factor.name, names, "its first line names what is varied"));
    }
    return !findings_->has_errors();
  }

  std::vector<double> PointOf(const TableLine& line, const CutLine& cut) {
    std::vector<double> point;
    for (size_t k = 0; k < factors_.size(); ++k) {
      const bool there = columns_[k] < cut.cells.size();
      const auto cell = there ? ReadCell(cut.cells[columns_[k]].text, false) : CellNumber();
      point.push_back(cell.value);
      if (cell.kind == CellNumber::Kind::kNumber) continue;
      Finding finding;
      finding.file = file_;
      finding.line = line.number;
      finding.column = there ? cut.cells[columns_[k]].column : 1;
      finding.message = fmt::format("'{}' is no number of {}",
                                    there ? cut.cells[columns_[k]].text : "", factors_[k].name);
      if (findings_->findings().size() < 20) findings_->Add(std::move(finding));
    }
    return point;
  }

  std::string file_;
  const std::vector<Factor>& factors_;
  Diagnostics* findings_;
  std::vector<size_t> columns_;
};

// A whole number from 1 on, exact in a double.
std::uint64_t ReadCount(ValueReader* values, const YamlNode& node, const std::string& path) {
  const auto number = values->yaml().Number(node, path);
  if (!number) return 1;
  if (*number >= 1.0 && *number <= 0x1p53 && *number == std::floor(*number)) {
    return static_cast<std::uint64_t>(*number);
  }
  values->yaml().Error(node, fmt::format("{} = {:g} is no whole number from 1 on", path, *number));
  return 1;
}

// 2^m points of Sobol's sequence are balanced in every number; others are not.
void CheckPower(const YamlNode& node, const std::string& path, std::uint64_t count,
                YamlReader* yaml) {
  if (std::has_single_bit(count)) return;
  const std::uint64_t below = std::bit_floor(count);
  yaml->Error(node, fmt::format("{} = {} is no power of two", path, count),
              fmt::format("{} or {}: only these leave no part of a range out", below, 2 * below));
}

// Grids combine levels; the others need what points are drawn from.
void CheckFactors(const YamlNode& node, DesignKind kind, const std::vector<Factor>& factors,
                  YamlReader* yaml) {
  for (const Factor& factor : factors) {
    const bool levels = std::holds_alternative<Levels>(factor.axis.distribution);
    if (kind == DesignKind::kGrid && !levels) {
      yaml->Error(node, fmt::format("design.grid: {} has no levels", factor.name),
                  fmt::format("vary: {{{}: {{grid: […]}}}}, or another design", factor.name));
    }
    if (kind == DesignKind::kOneAtATime && std::isnan(factor.axis.nominal)) {
      yaml->Error(node,
                  fmt::format("design.one_at_a_time: the scenario does not state {}, so it has no "
                              "nominal value",
                              factor.name));
    }
  }
}

}  // namespace

bool IsListDesign(const YamlNode* node) {
  return node != nullptr && node->is_map() && node->Find("list") != nullptr;
}

Design ReadDesign(ValueReader* values, const YamlNode& node, const std::vector<Factor>& factors,
                  const DesignContext& context) {
  Design design;
  YamlReader& yaml = values->yaml();
  std::vector<std::string> keys = kDesignWords;
  keys.emplace_back("seed");
  YamlMap map(&yaml, &node, "design", keys);
  std::vector<size_t> given;
  for (size_t k = 0; k < kDesignWords.size(); ++k) {
    if (map.Has(kDesignWords[k])) given.push_back(k);
  }
  if (map.valid() && given.size() != 1) {
    yaml.Error(node,
               "design: give one of sobol, saltelli, latin_hypercube, grid, one_at_a_time, "
               "list",
               "e.g. design: {sobol: 256}");
  }
  if (given.size() != 1) return design;
  design.kind = static_cast<DesignKind>(given[0]);
  const std::string path = "design." + kDesignWords[given[0]];
  const YamlNode& value = *map.Find(kDesignWords[given[0]]);
  if (const YamlNode* seed = map.Find("seed")) {
    design.seed = ReadCount(values, *seed, "design.seed");
    if (!design.draws()) yaml.Error(*seed, path + " draws nothing: it has no seed");
  }
  if (design.draws()) {
    design.count = context.drawn.count.value_or(ReadCount(values, value, path));
    design.seed = context.drawn.seed.value_or(design.seed);
  } else if (context.drawn.count || context.drawn.seed) {
    yaml.Error(value, path + " draws nothing: --count and --seed are about points that are drawn");
  } else if (design.kind != DesignKind::kList) {
    if (yaml.Flag(value, path) == false) yaml.Error(value, path + " = false: nothing is computed");
  }
  if (design.kind == DesignKind::kSobol || design.kind == DesignKind::kSaltelli) {
    CheckPower(value, path, design.count, &yaml);
  }
  CheckFactors(value, design.kind, factors, &yaml);
  if (design.kind == DesignKind::kList) {
    const auto file = yaml.Text(value, path);
    if (file && !factors.empty()) {
      const std::string beside = (std::filesystem::path(context.folder) / *file).string();
      design.list = PointList(beside, factors, context.list_findings).Read();
    }
  }
  if (yaml.has_errors() || factors.empty()) return design;
  std::vector<Axis> axes;
  axes.reserve(factors.size());
  for (const Factor& factor : factors) axes.push_back(factor.axis);
  const std::uint64_t count = DesignPoints(std::move(axes), design).count();
  if (count > context.most) {
    yaml.Error(value,
               fmt::format("{}: {:.3g} points, more than {:g}", path, static_cast<double>(count),
                           static_cast<double>(context.most)),
               "mbverify study --yes computes them");
  }
  return design;
}

namespace {

// One entry: two normal numbers and a coefficient.
std::optional<Correlation> ReadCorrelation(ValueReader* values, const YamlNode& node,
                                           const std::vector<Factor>& factors) {
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, &node, "correlations", {"of", "coefficient"});
  const YamlNode* of = map.Required("of");
  const YamlNode* coefficient = map.Required("coefficient");
  if (of == nullptr || coefficient == nullptr) return {};
  const auto items = yaml.Items(*of, "correlations.of");
  const auto number = values->Number(*coefficient, "correlations.coefficient");
  if (!items || !number) return {};
  if (items->size() != 2) {
    yaml.Error(*of, "correlations.of: name two numbers", "e.g. {of: [m_p, m_1], coefficient: 0.8}");
    return {};
  }
  std::vector<std::string> names;
  for (const Factor& factor : factors) names.push_back(factor.name);
  std::vector<size_t> axes;
  for (const YamlNode* item : *items) {
    const auto name = yaml.Text(*item, "correlations.of");
    if (!name) return {};
    const auto found = std::find(names.begin(), names.end(), *name);
    if (found == names.end()) {
      yaml.Error(*item, fmt::format("correlations.of: '{}' is not varied", *name),
                 DidYouMean(*name, names));
      continue;
    }
    axes.push_back(static_cast<size_t>(found - names.begin()));
    if (std::holds_alternative<Normal>(factors[axes.back()].axis.distribution)) continue;
    yaml.Error(*item, fmt::format("correlations.of: {} is not normal", *name),
               "only normal numbers have correlations here");
  }
  if (axes.size() < 2) return {};
  if (axes[0] == axes[1]) {
    yaml.Error(*of, fmt::format("correlations.of: {} with itself", names[axes[0]]));
    return {};
  }
  if (!(std::abs(*number) < 1.0)) {
    yaml.Error(
        *coefficient,
        fmt::format("correlations.coefficient = {:g} violates -1 < coefficient < 1", *number),
        "two numbers that always go together are one: vary a parameter that both are "
        "computed from");
    return {};
  }
  return Correlation{axes[0], axes[1], *number};
}

}  // namespace

void ReadCorrelations(ValueReader* values, const YamlNode& node, const std::vector<Factor>& factors,
                      Design* design) {
  YamlReader& yaml = values->yaml();
  const auto items = yaml.Items(node, "correlations");
  if (!items) return;
  if (design->kind != DesignKind::kSobol && design->kind != DesignKind::kLatinHypercube) {
    yaml.Error(node, "correlations: are drawn by sobol and latin_hypercube alone",
               design->kind == DesignKind::kSaltelli
                   ? "Sobol' indices share a variance among independent numbers"
                   : "");
    return;
  }
  for (const YamlNode* item : *items) {
    const auto read = ReadCorrelation(values, *item, factors);
    if (!read) continue;
    const auto same = [&](const Correlation& c) {
      return std::minmax(c.first, c.second) == std::minmax(read->first, read->second);
    };
    if (std::any_of(design->correlations.begin(), design->correlations.end(), same)) {
      yaml.Error(*item, fmt::format("correlations: that of {} and {} is given twice",
                                    factors[read->first].name, factors[read->second].name));
    }
    design->correlations.push_back(*read);
  }
  if (yaml.has_errors() || design->correlations.empty()) return;
  // Below this the root of the matrix loses its digits.
  constexpr double kSmallest = 1e-10;
  const double smallest = SmallestEigenvalue(CorrelationMatrix(*design, factors.size()));
  if (smallest >= kSmallest) return;
  yaml.Error(node,
             fmt::format("correlations: no numbers have these together: the smallest eigenvalue of "
                         "their matrix is {:.3g} and must be above 0",
                         smallest),
             "make the coefficients smaller, or state those that are left out");
}

}  // namespace mbv::internal
