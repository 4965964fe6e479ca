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

Design ReadDesign(ValueReader* values, const YamlNode& node, const std::string& folder,
                  const std::vector<Factor>& factors, std::uint64_t most,
                  Diagnostics* list_findings) {
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
    design.count = ReadCount(values, value, path);
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
      const std::string beside = (std::filesystem::path(folder) / *file).string();
      design.list = PointList(beside, factors, list_findings).Read();
    }
  }
  if (yaml.has_errors() || factors.empty()) return design;
  std::vector<Axis> axes;
  axes.reserve(factors.size());
  for (const Factor& factor : factors) axes.push_back(factor.axis);
  const std::uint64_t count = DesignPoints(std::move(axes), design).count();
  if (count > most) {
    yaml.Error(value,
               fmt::format("{}: {:.3g} points, more than {:g}", path, static_cast<double>(count),
                           static_cast<double>(most)),
               "mbverify study --yes computes them");
  }
  return design;
}

}  // namespace mbv::internal
