#include "features/workspace/set_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numbers>
#include <variant>

#include "base/text.h"
#include "base/worker_pool.h"
#include "plot/draw.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kShownSections = 7;
constexpr size_t kMostDrawnBounds = 16;

double Shown(double value, const std::string& unit) {
  return unit == "rad" ? value * 180.0 / std::numbers::pi : 1e3 * value;
}
const char* UnitShown(const std::string& unit) { return unit == "rad" ? "°" : "mm"; }

std::string WithError(double value, double error) {
  if (!std::isfinite(value)) return "–";
  return fmt::format("{:.{}f} ± {:.0e}", value, Decimals(error), error);
}

std::string Percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.1f} %", 100.0 * share) : "–";
}

std::string BoundName(const ReachableSet& set, int bound) {
  return bound < 0 ? "poses stop to close" : set.bounds[static_cast<size_t>(bound)].name;
}
std::string BoundKind(const ReachableSet& set, int bound) {
  return bound < 0 ? "unknown" : WordOf(set.bounds[static_cast<size_t>(bound)].kind);
}

std::string PlaceText(const ReachableSet& set, const Vec3& at) {
  std::vector<std::string> parts;
  for (size_t c = 0; c < set.over.size(); ++c) {
    const std::string& unit = set.over_units[c];
    const double value = Shown(at[static_cast<Eigen::Index>(c)], unit);
    parts.push_back(fmt::format("{} {:.4g} {}", set.over[c], std::abs(value) < 1e-9 ? 0.0 : value,
                                UnitShown(unit)));
  }
  return Joined(parts);
}

// Of a held coordinate that is asked for a range.
const CoordinateRange* RangeOf(const ReachableSet& set, size_t held) {
  for (const RangedCoordinate& ranged : set.ranged) {
    if (ranged.coordinate == static_cast<int>(set.over.size() + held)) return &ranged.range;
  }
  return nullptr;
}

// " for all yaw -10 … 10 °".
std::string RangedText(const ReachableSet& set) {
  std::vector<std::string> parts;
  for (size_t k = 0; k < set.held.size(); ++k) {
    const CoordinateRange* range = RangeOf(set, k);
    if (range == nullptr) continue;
    const std::string& unit = set.held_units[k];
    parts.push_back(fmt::format("{} {:.5g} … {:.5g} {}", set.held[k], Shown(range->lower, unit),
                                Shown(range->upper, unit), UnitShown(unit)));
  }
  return parts.empty() ? "" : (set.for_all ? " for all " : " for some ") + Joined(parts);
}

std::string HeldText(const ReachableSet& set) {
  std::vector<std::string> parts;
  for (size_t k = 0; k < set.held.size(); ++k) {
    if (RangeOf(set, k) != nullptr) continue;
    const std::string& unit = set.held_units[k];
    const double value = Shown(set.held_values[static_cast<Eigen::Index>(k)], unit);
    parts.push_back(fmt::format("{} = {:.5g} {}", set.held[k],
                                std::abs(value) < 1e-12 ? 0.0 : value, UnitShown(unit)));
  }
  return Joined(parts);
}

std::string HeadLine(const SetReport& report) {
  const ReachableSet& set = report.set;
  const std::string held = HeldText(set);
  return fmt::format("reachable {} over {}{}{}", set.measure, Joined(set.over), RangedText(set),
                     held.empty() ? "" : " at " + held);
}

Table WaysTable(const SetReport& report) {
  const ReachableSet& set = report.set;
  Table table{.name = "workspace_ways",
              .caption = fmt::format("The {} by independent ways [{}]", set.measure, set.unit),
              .columns = {Text("way"), Digits(set.measure), Digits("poses closed"),
                          Digits("time [s]", On::kTerminal)}};
  const auto row = [&](const char* way, double value, double error, long closings, double wall) {
    if (closings == 0) return;
    table.rows.push_back(
        {way, WithError(value, error), fmt::format("{}", closings), fmt::format("{:.2f}", wall)});
  };
  row(!set.ranged.empty()
          ? set.for_all ? "sections of the range, intersected" : "sections of the range, united"
      : set.over.size() == 1 ? "path to both ends"
                             : "boundary, traced and integrated",
      set.traced.measure, set.traced.error, set.traced.closings, set.traced.wall_s);
  row("flooded lattice", set.flooded.measure, set.flooded.error, set.flooded.closings,
      set.flooded.wall_s);
  for (const KnownMeasure& known : report.known) {
    table.rows.push_back({known.way, WithError(known.value, known.error), "", ""});
  }
  return table;
}

Table BoundsTable(const ReachableSet& set) {
  Table table{.name = "workspace_bounds",
              .caption = "What ends the set, by its share of the boundary",
              .columns = {Text("bound"), Text("kind"), Digits("traced"), Digits("flooded")}};
  for (const BoundShare& share : set.shares) {
    table.rows.push_back({BoundName(set, share.bound), BoundKind(set, share.bound),
                          Percent(share.traced), Percent(share.flooded)});
  }
  return table;
}

Table LevelsTable(const ReachableSet& set) {
  Table table{.name = "workspace_levels",
              .caption = "Convergence of the flooded lattice",
              .columns = {Text("cells"), Digits(set.measure + " [" + set.unit + "]"),
                          Digits("changed by")}};
  double before = kNan;
  for (size_t k = 0; k < set.flooded.levels.size(); ++k) {
    const double factor = std::exp2(static_cast<double>(set.flooded.levels.size() - 1 - k));
    std::vector<std::string> sizes;
    for (size_t c = 0; c < set.over.size(); ++c) {
      sizes.push_back(fmt::format("{:.3g} {}",
                                  Shown(factor * set.flooded.step.at(c), set.over_units[c]),
                                  UnitShown(set.over_units[c])));
    }
    const double value = set.flooded.levels[k];
    table.rows.push_back({Joined(sizes), fmt::format("{:.9g}", value),
                          std::isfinite(before) ? fmt::format("{:.1e}", value - before) : ""});
    before = value;
  }
  return table;
}

Table QualityTable(const SetReport& report) {
  Table table{.name = "workspace_quality",
              .caption = "Over the lattice's poses: mean with its error of integration",
              .columns = {Text("index"), Text("unit"), Digits("mean"), Digits("least"),
                          Digits("most"), Wide("at its worst")}};
  for (const QualityIndex& index : report.quality.indices) {
    if (!std::isfinite(index.mean)) continue;
    table.rows.push_back(
        {index.name, index.unit, fmt::format("{:.4g} ± {:.0e}", index.mean, index.mean_error),
         fmt::format("{:.4g}", index.least), fmt::format("{:.4g}", index.most),
         PlaceText(report.set, index.low_is_bad ? index.least_at : index.most_at)});
  }
  return table;
}

// Figures.

std::string AxisLabel(const ReachableSet& set, size_t c) {
  return fmt::format("{} [{}]", set.over[c], UnitShown(set.over_units[c]));
}

void Append(const ReachableSet& set, const TracedArc& arc, PlotLine* line) {
  if (!line->points.empty()) line->points.emplace_back(kNan, kNan);
  for (const Eigen::Vector2d& p : arc.points) {
    line->points.emplace_back(Shown(p[0], set.over_units[0]), Shown(p[1], set.over_units[1]));
  }
}

// Of two dimensions: a line per bound, the ends of most of the boundary first.
LinePlot BoundaryPlot(const SetReport& report) {
  const ReachableSet& set = report.set;
  LinePlot plot{.title = report.mechanism + ": what ends the set",
                .x_label = AxisLabel(set, 0),
                .y_label = AxisLabel(set, 1),
                .equal_scale = set.over_units[0] == set.over_units[1],
                .lines = {}};
  std::vector<int> order;
  for (const BoundShare& share : set.shares) order.push_back(share.bound);
  for (const int bound : order) {
    if (plot.lines.size() == kMostDrawnBounds) break;
    PlotLine line{.label = BoundName(set, bound), .points = {}};
    for (const TracedLoop& loop : set.traced.sections[0].loops) {
      for (const TracedArc& arc : loop.arcs) {
        if (arc.bound == bound) Append(set, arc, &line);
      }
    }
    if (!line.points.empty()) plot.lines.push_back(std::move(line));
  }
  PlotLine singular{.label = "type-2 singularity inside", .points = {}, .dashed = true};
  for (const TracedArc& arc : report.quality.singular) Append(set, arc, &singular);
  if (!singular.points.empty()) plot.lines.push_back(std::move(singular));
  PlotLine lost{.label = "constraint singularity inside", .points = {}, .dashed = true};
  for (const TracedArc& arc : report.constraint) Append(set, arc, &lost);
  if (!lost.points.empty()) plot.lines.push_back(std::move(lost));
  return plot;
}

// Sections of three dimensions nearest to round shares of the height.
LinePlot SectionsPlot(const SetReport& report) {
  const ReachableSet& set = report.set;
  LinePlot plot{.title = report.mechanism + ": sections",
                .x_label = AxisLabel(set, 0),
                .y_label = AxisLabel(set, 1),
                .equal_scale = set.over_units[0] == set.over_units[1],
                .lines = {}};
  for (size_t k = 0; k < kShownSections; ++k) {
    const double share = (static_cast<double>(k) + 0.5) / kShownSections;
    const double height = set.traced.low + share * (set.traced.high - set.traced.low);
    const auto nearest = std::ranges::min_element(
        set.traced.sections, {},
        [&](const TracedSection& section) { return std::abs(section.height - height); });
    PlotLine line{.label = fmt::format("{} = {:.4g} {}", set.over[2],
                                       Shown(nearest->height, set.over_units[2]),
                                       UnitShown(set.over_units[2])),
                  .points = {}};
    for (const TracedLoop& loop : nearest->loops) {
      if (!line.points.empty()) line.points.emplace_back(kNan, kNan);
      for (const TracedArc& arc : loop.arcs) {
        for (const Eigen::Vector2d& p : arc.points) {
          line.points.emplace_back(Shown(p[0], set.over_units[0]), Shown(p[1], set.over_units[1]));
        }
      }
    }
    plot.lines.push_back(std::move(line));
  }
  return plot;
}

MapPlot QualityPlot(const SetReport& report, size_t index) {
  const ReachableSet& set = report.set;
  const QualityIndex& of = report.quality.indices[index];
  std::array<double, 2> low{}, high{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const size_t p : report.quality.points) {
    const Vec3& at = set.flooded.lattice[p].at;
    for (size_t c = 0; c < 2; ++c) {
      low.at(c) = std::min(low.at(c), at[static_cast<Eigen::Index>(c)]);
      high.at(c) = std::max(high.at(c), at[static_cast<Eigen::Index>(c)]);
    }
  }
  std::array<int, 2> count{};
  const auto& step = set.flooded.lattice_step;
  for (size_t c = 0; c < 2; ++c) {
    count.at(c) = 1 + static_cast<int>(std::lround((high.at(c) - low.at(c)) / step.at(c)));
  }
  MapPlot plot{.title = report.mechanism + ": " + of.name,
               .x_label = AxisLabel(set, 0),
               .y_label = AxisLabel(set, 1),
               .value_label = fmt::format("{} [{}]", of.name, of.unit),
               .values = std::vector<double>(static_cast<size_t>(count[0] * count[1]), kNan),
               .log_scale = of.least > 0.0 && of.most > 30.0 * of.least};
  plot.columns = count[0];
  plot.rows = count[1];
  plot.contours = 10;
  plot.x_min = Shown(low[0] - 0.5 * step[0], set.over_units[0]);
  plot.x_max = Shown(high[0] + 0.5 * step[0], set.over_units[0]);
  plot.y_min = Shown(low[1] - 0.5 * step[1], set.over_units[1]);
  plot.y_max = Shown(high[1] + 0.5 * step[1], set.over_units[1]);
  for (size_t i = 0; i < report.quality.points.size(); ++i) {
    const Vec3& at = set.flooded.lattice[report.quality.points[i]].at;
    const long column = std::lround((at[0] - low[0]) / step[0]);
    const long row = std::lround((at[1] - low[1]) / step[1]);
    plot.values[static_cast<size_t>(row * count[0] + column)] =
        report.quality.values[i][static_cast<Eigen::Index>(index)];
  }
  return plot;
}

LinePlot QualityLine(const SetReport& report, size_t index) {
  const QualityIndex& of = report.quality.indices[index];
  LinePlot plot{.title = report.mechanism + ": " + of.name,
                .x_label = AxisLabel(report.set, 0),
                .y_label = fmt::format("{} [{}]", of.name, of.unit),
                .lines = {PlotLine{}}};
  for (size_t i = 0; i < report.quality.points.size(); ++i) {
    const Vec3& at = report.set.flooded.lattice[report.quality.points[i]].at;
    plot.lines[0].points.emplace_back(Shown(at[0], report.set.over_units[0]),
                                      report.quality.values[i][static_cast<Eigen::Index>(index)]);
  }
  return plot;
}

// By the names of their files, without endings.
std::vector<std::pair<std::string, std::variant<LinePlot, MapPlot>>> Plots(
    const SetReport& report) {
  const ReachableSet& set = report.set;
  std::vector<std::pair<std::string, std::variant<LinePlot, MapPlot>>> plots;
  if (set.over.size() == 2 && !set.traced.sections.empty()) {
    plots.emplace_back("reachable_boundary", BoundaryPlot(report));
  }
  if (set.over.size() == 3 && !set.traced.sections.empty()) {
    plots.emplace_back("reachable_sections", SectionsPlot(report));
  }
  for (size_t i = 0; i < report.quality.indices.size(); ++i) {
    const QualityIndex& index = report.quality.indices[i];
    if (!std::isfinite(index.mean) || set.over.size() > 2) continue;
    if (set.over.size() == 2) {
      plots.emplace_back("quality_" + index.name, QualityPlot(report, i));
    } else {
      plots.emplace_back("quality_" + index.name, QualityLine(report, i));
    }
  }
  return plots;
}

// Sections.

Paragraph VerdictOf(const SetReport& report) {
  const ReachableSet& set = report.set;
  if (!set.summary.ok()) return {set.verdict, Paragraph::Look::kReason};
  std::string text = std::string(report.agree() ? "AGREE: " : "DISAGREE: ") + set.verdict;
  for (const KnownMeasure& known : report.known) {
    text +=
        fmt::format("; {} is {:.1e} {} off", known.way, known.value - set.traced.measure, set.unit);
  }
  return {text, report.agree() ? Paragraph::Look::kPlain : Paragraph::Look::kReason};
}

std::vector<ReportSection> SectionsOf(const SetReport& report) {
  const ReachableSet& set = report.set;
  const auto plots = Plots(report);
  const auto draw = [&](const char* beginning, ReportSection* section) {
    for (const auto& [name, plot] : plots) {
      if (!name.starts_with(beginning)) continue;
      section->Add(Drawing{std::visit([](const auto& of) { return ToSvg(of); }, plot)}, On::kPage);
    }
  };
  std::vector<ReportSection> sections;
  ReportSection reached{.title = "What is reached", .link = "Set"};
  reached.Add(VerdictOf(report));
  reached.Add(WaysTable(report));
  reached.Add(LevelsTable(set), On::kPage);
  reached.Note(
      "Both ways close poses with the same code and evaluate the same margins of bounds; nothing "
      "else is common. Error of the boundary: last coefficients of its polynomials, and of three "
      "dimensions the Gauss–Kronrod rule's; of the lattice: what the last halving changed, "
      "or half of the one before, and a quarter of the cells where bounds meet or cross.");
  if (!set.ranged.empty()) {
    reached.Note(
        "Of a range, sections at its values are intersected (all) or united (some), twice as many "
        "until the measure rests: their error is the last change. The lattice goes through the "
        "range at every corner. Qualities and poses are those at the value that is held, or the "
        "best one.");
  }
  Items notes{set.notes};
  if (set.checked + set.unchecked > 0) {
    notes.texts.push_back(fmt::format(
        "{} poses inside were closed anew by the reference from home: drives and outputs differ by "
        "{:.1e} (rad, or characteristic lengths) at most{}",
        set.checked, set.checked_off,
        set.unchecked > 0 ? fmt::format("; {} were not, its straight way is barred", set.unchecked)
                          : ""));
  }
  reached.Add(std::move(notes));
  sections.push_back(std::move(reached));

  ReportSection bounds{.title = "What ends it", .link = "Bounds"};
  bounds.Add(BoundsTable(set));
  draw("reachable_", &bounds);
  if (!report.quality.singular.empty()) {
    bounds.Note(fmt::format("{} curves inside the set where the drives lose their hold (type 2)",
                            report.quality.singular.size()),
                On::kAll);
  }
  if (!report.constraint.empty()) {
    bounds.Note(
        fmt::format("constraint singularities inside the set, in {} cells of the lattice: the "
                    "joints alone lose rank on these curves, and the set goes on beyond",
                    report.constraint.size()),
        On::kAll);
  }
  if (const TriangleMesh& surface = report.constraint_surface; !surface.triangles.empty()) {
    bounds.Note(fmt::format("constraint singularities inside the set, a surface of {} triangles in "
                            "reachable_constraint.stl: the joints alone lose rank there, and the "
                            "set goes on beyond",
                            surface.triangles.size()),
                On::kAll);
  }
  if (const TriangleMesh& surface = report.type2_surface; !surface.triangles.empty()) {
    bounds.Note(fmt::format("the drives lose their hold (type 2) inside the set, on a surface of "
                            "{} triangles in reachable_type2.stl",
                            surface.triangles.size()),
                On::kAll);
  }
  sections.push_back(std::move(bounds));

  ReportSection quality{.title = "Quality", .link = "Quality"};
  if (report.quality.why_none.empty()) {
    quality.Add(QualityTable(report));
    Items about;
    for (const QualityIndex& index : report.quality.indices) {
      if (std::isfinite(index.mean)) about.texts.push_back(index.name + ": " + index.about);
    }
    quality.Add(Fold{"what they mean", {{std::move(about), On::kPage}}}, On::kPage);
    draw("quality_", &quality);
    if (!report.quality.no_limb.empty()) {
      quality.Note("no transmission angles of " + Joined(report.quality.no_limb, 8) +
                       ": not one single chain from base to output",
                   On::kAll);
    }
    if (report.quality.missed > 0) {
      quality.Note(fmt::format("{} poses were not closed by the reference and are left out",
                               report.quality.missed),
                   On::kAll);
    }
  } else {
    quality.Note("no qualities: " + report.quality.why_none, On::kAll);
  }
  sections.push_back(std::move(quality));
  return sections;
}

// Files.

std::string Header(const ReachableSet& set) {
  std::string text;
  for (size_t c = 0; c < set.over.size(); ++c) {
    text += CsvCell(set.over[c] + "_" + set.over_units[c]) + ",";
  }
  return text;
}

std::string BoundaryCsv(const SetReport& report) {
  const ReachableSet& set = report.set;
  std::string csv = "section,loop,arc," + Header(set) + "bound,kind\n";
  auto out = std::back_inserter(csv);
  for (const auto& [at, bound] : set.traced.ends) {
    fmt::format_to(out, "0,0,0,{:.17g},{},{}\n", at, CsvCell(BoundName(set, bound)),
                   BoundKind(set, bound));
  }
  const auto rows = [&](size_t s, size_t l, size_t a, const TracedArc& arc, double height,
                        const std::string& name, const std::string& kind) {
    for (const Eigen::Vector2d& p : arc.points) {
      fmt::format_to(out, "{},{},{},{:.17g},{:.17g},", s, l, a, p[0], p[1]);
      if (std::isfinite(height)) fmt::format_to(out, "{:.17g},", height);
      fmt::format_to(out, "{},{}\n", CsvCell(name), kind);
    }
  };
  for (size_t s = 0; s < set.traced.sections.size(); ++s) {
    const TracedSection& section = set.traced.sections[s];
    for (size_t l = 0; l < section.loops.size(); ++l) {
      for (size_t a = 0; a < section.loops[l].arcs.size(); ++a) {
        const TracedArc& arc = section.loops[l].arcs[a];
        rows(s, l, a, arc, section.height, BoundName(set, arc.bound), BoundKind(set, arc.bound));
      }
    }
  }
  for (size_t a = 0; a < report.quality.singular.size(); ++a) {
    rows(0, set.traced.sections[0].loops.size(), a, report.quality.singular[a], kNan, "inside",
         WordOf(SetBound::Kind::kType2));
  }
  for (size_t a = 0; a < report.constraint.size(); ++a) {
    rows(0, set.traced.sections[0].loops.size() + 1, a, report.constraint[a], kNan, "inside",
         WordOf(SetBound::Kind::kConstraint));
  }
  return csv;
}

std::string PosesCsv(const SetReport& report) {
  const ReachableSet& set = report.set;
  std::string csv = Header(set) + "inside,bound";
  auto out = std::back_inserter(csv);
  for (const QualityIndex& index : report.quality.indices) csv += "," + CsvCell(index.name);
  csv += "\n";
  size_t next = 0;
  for (size_t p = 0; p < set.flooded.lattice.size(); ++p) {
    const FloodPoint& point = set.flooded.lattice[p];
    for (size_t c = 0; c < set.over.size(); ++c) {
      fmt::format_to(out, "{:.17g},", point.at[static_cast<Eigen::Index>(c)]);
    }
    fmt::format_to(out, "{},{}", point.inside ? 1 : 0,
                   point.inside ? "" : CsvCell(BoundName(set, point.bound)));
    const bool has = next < report.quality.points.size() && report.quality.points[next] == p;
    for (size_t i = 0; i < report.quality.indices.size(); ++i) {
      fmt::format_to(out, ",{:.10g}",
                     has ? report.quality.values[next][static_cast<Eigen::Index>(i)] : kNan);
    }
    next += has;
    csv += "\n";
  }
  return csv;
}

bool IsSolid(const ReachableSet& set) {
  return set.over.size() == 3 && !set.flooded.facets.empty();
}

TriangleMesh MeshOf(const ReachableSet& set) {
  TriangleMesh mesh;
  for (const FloodVertex& vertex : set.flooded.vertices) mesh.vertices.push_back(vertex.at);
  for (const FloodFacet& facet : set.flooded.facets) mesh.triangles.push_back(facet.vertices);
  return mesh;
}

// By the order of their shares.
std::string ColorOfBound(const ReachableSet& set, int bound) {
  const auto at = std::ranges::find(set.shares, bound, &BoundShare::bound);
  return kLineColors.at(static_cast<size_t>(at - set.shares.begin()) % kLineColors.size());
}

// ToPly() with a colour per vertex.
std::string ColoredPly(const ReachableSet& set, const std::string& title) {
  std::string out = fmt::format(
      "ply\nformat ascii 1.0\ncomment {}; metres\nelement vertex {}\nproperty double x\n"
      "property double y\nproperty double z\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      title, set.flooded.vertices.size(), set.flooded.facets.size());
  auto to = std::back_inserter(out);
  for (const FloodVertex& vertex : set.flooded.vertices) {
    const unsigned long rgb = std::stoul(ColorOfBound(set, vertex.bound).substr(1), nullptr, 16);
    fmt::format_to(to, "{:.9g} {:.9g} {:.9g} {} {} {}\n", vertex.at[0], vertex.at[1], vertex.at[2],
                   rgb >> 16U, (rgb >> 8U) & 255U, rgb & 255U);
  }
  for (const FloodFacet& facet : set.flooded.facets) {
    fmt::format_to(to, "3 {} {} {}\n", facet.vertices[0], facet.vertices[1], facet.vertices[2]);
  }
  return out;
}

Json VectorJson(const VecX& values) {
  Json json = Json::array();
  for (const double value : values) json.push_back(Number(value));
  return json;
}
Json PlaceJson(const ReachableSet& set, const Vec3& at) {
  return VectorJson(at.head(static_cast<Eigen::Index>(set.over.size())));
}

}  // namespace

bool SetReport::agree() const {
  return set.agree && std::ranges::all_of(known, [&](const KnownMeasure& other) {
           return std::abs(other.value - set.traced.measure) <= other.error + set.traced.error;
         });
}

std::string ToText(const SetReport& report, const TextStyle& style) {
  std::string text = report.mechanism + ": " + HeadLine(report) + "\n";
  for (const ReportSection& section : SectionsOf(report)) text += ToText(section, style);
  return text;
}

Json ToJson(const SetReport& report) {
  const ReachableSet& set = report.set;
  Json coordinates = Json::array();
  for (size_t k = 0; k < set.over.size(); ++k) {
    coordinates.push_back({{"name", set.over[k]},
                           {"unit", set.over_units[k]},
                           {"low", Number(set.box[k].lower)},
                           {"high", Number(set.box[k].upper)}});
  }
  Json held = Json::array();
  for (size_t k = 0; k < set.held.size(); ++k) {
    held.push_back({{"name", set.held[k]},
                    {"unit", set.held_units[k]},
                    {"value", Number(set.held_values[static_cast<Eigen::Index>(k)])}});
  }
  Json bounds = Json::array();
  for (const BoundShare& share : set.shares) {
    bounds.push_back({{"name", BoundName(set, share.bound)},
                      {"kind", BoundKind(set, share.bound)},
                      {"traced", Number(share.traced)},
                      {"flooded", Number(share.flooded)}});
  }
  Json levels = Json::array();
  for (const double value : set.flooded.levels) levels.push_back(Number(value));
  Json indices = Json::array();
  for (const QualityIndex& index : report.quality.indices) {
    indices.push_back({{"name", index.name},
                       {"unit", index.unit},
                       {"about", index.about},
                       {"mean", Number(index.mean)},
                       {"mean_error", Number(index.mean_error)},
                       {"least", Number(index.least)},
                       {"least_at", PlaceJson(set, index.least_at)},
                       {"most", Number(index.most)},
                       {"most_at", PlaceJson(set, index.most_at)}});
  }
  Json ranged = Json::array();
  for (size_t k = 0; k < set.held.size(); ++k) {
    const CoordinateRange* range = RangeOf(set, k);
    if (range == nullptr) continue;
    ranged.push_back({{"name", set.held[k]},
                      {"unit", set.held_units[k]},
                      {"low", range->lower},
                      {"high", range->upper}});
  }
  Json json = {
      {"over", std::move(coordinates)},
      {"held", std::move(held)},
      {"measure", set.measure},
      {"unit", set.unit},
      {"traced", {{"value", Number(set.traced.measure)}, {"error", Number(set.traced.error)}}},
      {"flooded",
       {{"value", Number(set.flooded.measure)},
        {"error", Number(set.flooded.error)},
        {"levels", std::move(levels)}}},
      {"agree", report.agree()},
      {"verdict", set.verdict},
      {"bounds", std::move(bounds)},
      {"notes", set.notes},
      {"checked_poses", set.checked},
      {"checked_difference", Number(set.checked_off)},
      {"characteristic_length_m", Number(set.length)},
      {"constraint_cells", report.constraint.size() + report.constraint_surface.triangles.size()},
      {"type2_triangles", report.type2_surface.triangles.size()},
      {"quality", std::move(indices)}};
  if (!set.ranged.empty()) json[set.for_all ? "for_all" : "for_some"] = std::move(ranged);
  return json;
}

std::vector<std::pair<std::string, std::string>> SetFiles(const SetReport& report,
                                                          const PrintedFigures& printed) {
  const ReachableSet& set = report.set;
  Page page;
  for (const ReportSection& section : SectionsOf(report)) page.Add(section);
  std::vector<std::pair<std::string, std::string>> files = {
      {"reachable.html",
       page.Write({.kicker = "mbverify workspace",
                   .title = report.mechanism,
                   .lead = HeadLine(report),
                   .verdict = !set.summary.ok() ? Verdict::kNotRun
                              : report.agree()  ? Verdict::kAgree
                                                : Verdict::kDisagree,
                   .footer = "reachable_boundary.csv beside this page has the traced boundary, "
                             "reachable_poses.csv the lattice with its qualities."})},
      {"reachable_boundary.csv", BoundaryCsv(report)},
      {"reachable_poses.csv", PosesCsv(report)}};
  for (const auto& [name, plot] : Plots(report)) {
    files.emplace_back(name + ".svg", std::visit([](const auto& of) { return ToSvg(of); }, plot));
    for (const auto& [ending, format] :
         {std::pair("pdf", PictureFormat::kPdf), {"png", PictureFormat::kPng}}) {
      if (std::ranges::find(printed.formats, ending) == printed.formats.end()) continue;
      const Figure figure = std::visit([](const auto& of) { return FromPlot("", of); }, plot);
      files.emplace_back(name + "." + ending, DrawFigure(figure, printed.style, format));
    }
  }
  if (!IsSolid(set)) return files;
  const TriangleMesh mesh = MeshOf(set);
  const std::string title = report.mechanism + ": " + HeadLine(report);
  files.emplace_back("reachable.stl", ToStl(mesh, title));
  files.emplace_back("reachable.ply", ColoredPly(set, title));
  if (!report.constraint_surface.triangles.empty()) {
    files.emplace_back("reachable_constraint.stl", ToStl(report.constraint_surface, title));
  }
  if (!report.type2_surface.triangles.empty()) {
    files.emplace_back("reachable_type2.stl", ToStl(report.type2_surface, title));
  }
  return files;
}

std::vector<std::pair<TriangleMesh, std::string>> ColoredSurface(const ReachableSet& set) {
  if (!IsSolid(set)) return {};
  for (size_t c = 0; c < 3; ++c) {
    if (!set.over[c].ends_with(std::array{".x", ".y", ".z"}.at(c))) return {};
  }
  std::map<int, TriangleMesh> meshes;
  std::map<int, std::map<int, int>> index;
  for (const FloodFacet& facet : set.flooded.facets) {
    const auto bound = [&](size_t k) {
      return set.flooded.vertices[static_cast<size_t>(facet.vertices.at(k))].bound;
    };
    const int of = bound(1) == bound(2) ? bound(1) : bound(0);
    std::array<int, 3> triangle{};
    for (size_t k = 0; k < 3; ++k) {
      const auto [at, is_new] =
          index[of].try_emplace(facet.vertices.at(k), static_cast<int>(meshes[of].vertices.size()));
      if (is_new) {
        meshes[of].vertices.push_back(
            set.flooded.vertices[static_cast<size_t>(facet.vertices.at(k))].at);
      }
      triangle.at(k) = at->second;
    }
    meshes[of].triangles.push_back(triangle);
  }
  std::vector<std::pair<TriangleMesh, std::string>> colored;
  colored.reserve(meshes.size());
  for (auto& [bound, mesh] : meshes) {
    colored.emplace_back(std::move(mesh), ColorOfBound(set, bound));
  }
  return colored;
}

}  // namespace mbv
