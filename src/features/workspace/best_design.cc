#include "features/workspace/best_design.h"

#include <fmt/format.h>
#include <nlopt.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <memory>
#include <random>

#include "base/text.h"
#include "base/worker_pool.h"
#include "model_file/yaml/units.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr int kEach = 100;                                            // designs for each parameter
constexpr double kGlobalShare = 0.5;                                  // of them
constexpr double kFirstMove = 0.1, kLocalMove = 0.25, kMoved = 1e-6;  // of the ranges
constexpr double kSearchShare = 1e-6;  // error of volumes in a search, by the volume
constexpr double kMoveBeside = 0.05;   // of the ranges
constexpr int kElsewhere = 4;          // for each parameter
constexpr double kMost_s = 4 * 3600.0;
constexpr std::array<int, 4> kCoarse = {0, 200, 100, 32};  // cells of a lattice that verifies

VecX ValuesOf(const DesignQuestion& question, const VecX& share) {
  VecX values(share.size());
  for (Eigen::Index k = 0; k < share.size(); ++k) {
    const DesignParameter& p = question.parameters[static_cast<size_t>(k)];
    values[k] = p.low + share[k] * (p.high - p.low);
  }
  return values;
}
VecX SharesOf(const DesignQuestion& question, const VecX& values) {
  VecX shares(values.size());
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    const DesignParameter& p = question.parameters[static_cast<size_t>(k)];
    shares[k] = (values[k] - p.low) / (p.high - p.low);
  }
  return shares;
}

// One way to the set of a design.
TriedDesign MeasureDesign(const ModelOfDesign& model, const VecX& values,
                          const SetArguments& arguments, bool by_lattice) {
  TriedDesign design{.at = values, .measure = 0.0, .error = 0.0, .why = {}};
  const auto mechanism = model(values);
  if (!mechanism) {
    design.why = "the model cannot be built";
    return design;
  }
  Diagnostics diagnostics;
  const auto asked = ReadQuestion(*mechanism, arguments, &diagnostics);
  ReachableSet set;
  if (asked) {
    set = ComputeReachableSet(
        *asked, arguments, {}, nullptr,
        {.boundary = !by_lattice, .lattice = by_lattice, .share = kSearchShare});
    diagnostics.Append(set.diagnostics);
  }
  if (diagnostics.has_errors() || !set.summary.ok()) {
    design.why = set.verdict;
    for (const Finding& f : diagnostics.findings()) {
      if (f.severity == Severity::kError && design.why.empty()) design.why = f.message;
    }
    return design;
  }
  design.measure = by_lattice ? set.flooded.measure : set.traced.measure;
  design.error = by_lattice ? set.flooded.error : set.traced.error;
  return design;
}

SetArguments CoarseOf(SetArguments arguments, int over) {
  if (arguments.flood.resolution == 0 && over > 0) {
    arguments.flood.resolution = kCoarse.at(static_cast<size_t>(over));
  }
  return arguments;
}

class Search {
 public:
  Search(const DesignQuestion& question, const ModelOfDesign& model, const SetArguments& arguments,
         const ProgressFunction& progress, ResultLog log)
      : question_(question),
        model_(model),
        arguments_(arguments),
        progress_(progress),
        log_(std::move(log)),
        most_(question.evaluations > 0 ? question.evaluations
                                       : kEach * static_cast<int>(question.parameters.size())) {}

  void Run(BestDesign* result) {
    const auto n = static_cast<Eigen::Index>(question_.parameters.size());
    VecX start(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const DesignParameter& p = question_.parameters[static_cast<size_t>(k)];
      const bool inside = p.low <= p.own && p.own <= p.high;
      start[k] = inside ? (p.own - p.low) / (p.high - p.low) : 0.5;
    }
    const auto began = Clock::now();
    (void)Try(start);
    const double each = std::chrono::duration<double>(Clock::now() - began).count();
    if (each * most_ > kMost_s) {
      result->summary.stop = Stop::kUnsupported;
      result->summary.message = fmt::format(
          "{} designs take about {}; state fewer by --evaluations, or fewer free "
          "coordinates by --over",
          most_, TimeText(each * most_));
      return;
    }
    if (question_.global) {
      Optimize(NLOPT_GN_CRS2_LM, static_cast<int>(kGlobalShare * most_), kFirstMove, start);
    }
    const VecX best = SharesOf(question_, tried_[best_].at).cwiseMax(0.0).cwiseMin(1.0);
    Optimize(NLOPT_LN_SBPLX, most_, question_.global ? kFirstMove : kLocalMove, best);
    result->tried = std::move(tried_);
    result->best = result->tried[best_];
    if (result->best.why.empty()) {
      result->summary = RunSummary::Done();
      return;
    }
    result->summary.stop = Stop::kUnreachable;
    result->summary.message = "none of the designs has a set; the first: " + result->best.why;
  }

 private:
  double Try(const VecX& share) {
    const VecX values = ValuesOf(question_, share);
    const auto is_best = [&](const TriedDesign& design) {
      const bool first = tried_.empty() || !tried_[best_].why.empty();
      return design.why.empty() && (first || design.measure > tried_[best_].measure);
    };
    TriedDesign last = log_.Get<TriedDesign>([&] {
      TriedDesign design = MeasureDesign(model_, values, arguments_, false);
      if (!is_best(design)) return design;
      // A boundary that is wrong does not lead the search.
      const TriedDesign other = MeasureDesign(
          model_, values, CoarseOf(arguments_, static_cast<int>(arguments_.over.size())), true);
      if (std::abs(other.measure - design.measure) > other.error + design.error) {
        design.why = other.why.empty()
                         ? fmt::format("the two ways to its set differ: {:.4g}, {:.4g}",
                                       design.measure, other.measure)
                         : other.why;
        design.measure = 0.0;
      }
      return design;
    });
    const double measure = last.measure;
    if (is_best(last)) best_ = tried_.size();
    tried_.push_back(std::move(last));
    if (progress_) {
      progress_(fmt::format("design {} of {}", tried_.size(), most_),
                std::min(1.0, static_cast<double>(tried_.size()) / most_));
    }
    return measure;
  }
  static double Callback(unsigned n, const double* share, double* /*gradient*/, void* self) {
    return static_cast<Search*>(self)->Try(
        Eigen::Map<const VecX>(share, static_cast<Eigen::Index>(n)));
  }
  // Until `most` designs in all.
  void Optimize(nlopt_algorithm algorithm, int most, double first_move, VecX at) {
    const int left = most - static_cast<int>(tried_.size());
    if (left < 1) return;
    const std::unique_ptr<nlopt_opt_s, decltype(&nlopt_destroy)> search(
        nlopt_create(algorithm, static_cast<unsigned>(at.size())), &nlopt_destroy);
    nlopt_srand(question_.seed);
    nlopt_set_max_objective(search.get(), &Callback, this);
    nlopt_set_lower_bounds1(search.get(), 0.0);
    nlopt_set_upper_bounds1(search.get(), 1.0);
    nlopt_set_initial_step1(search.get(), first_move);
    nlopt_set_xtol_abs1(search.get(), kMoved);
    nlopt_set_maxeval(search.get(), left);
    double value = 0.0;
    (void)nlopt_optimize(search.get(), at.data(), &value);  // Try() keeps the best
  }

  const DesignQuestion& question_;
  const ModelOfDesign& model_;
  const SetArguments& arguments_;
  const ProgressFunction& progress_;
  ResultLog log_;
  const int most_;
  std::vector<TriedDesign> tried_;
  size_t best_ = 0;
};

// Halton's point, 0 … 1.
double RadicalInverse(unsigned base, unsigned index) {
  double sum = 0.0, digit = 1.0;
  for (; index > 0; index /= base) {
    digit /= base;
    sum += digit * (index % base);
  }
  return sum;
}
unsigned Prime(size_t k) {
  unsigned prime = 2;
  for (;; ++prime) {
    bool divided = false;
    for (unsigned d = 2; d * d <= prime; ++d) divided = divided || prime % d == 0;
    if (!divided && k-- == 0) return prime;
  }
}

// Steps along each parameter and in as many directions, within the box.
std::vector<VecX> SharesBeside(const DesignQuestion& question, const VecX& best) {
  const Eigen::Index n = best.size();
  std::vector<VecX> moves;
  for (Eigen::Index k = 0; k < n; ++k) moves.emplace_back(VecX::Unit(n, k));
  std::mt19937_64 random(question.seed);
  for (Eigen::Index k = 0; k < n && n > 1; ++k) {
    VecX move(n);
    for (double& m : move) m = static_cast<double>(random() >> 11U) * 0x1p-52 - 1.0;
    moves.emplace_back(move.normalized());
  }
  std::vector<VecX> shares;
  for (const VecX& move : moves) {
    for (const double sign : {-1.0, 1.0}) {
      const VecX there = (best + sign * kMoveBeside * move).cwiseMax(0.0).cwiseMin(1.0);
      if ((there - best).norm() > 0.1 * kMoveBeside) shares.push_back(there);
    }
  }
  return shares;
}

std::string ValueText(double value, const std::string& unit) {
  return fmt::format("{:.6g}{}", value, unit.empty() || unit == "1" ? "" : " " + unit);
}

// Larger than the best one by more than both errors.
bool IsLarger(const TriedDesign& design, const FloodedSet& best) {
  return design.why.empty() && design.measure - best.measure > design.error + best.error;
}
// Smaller by more than that.
bool IsSmaller(const TriedDesign& design, const FloodedSet& best) {
  return !design.why.empty() || best.measure - design.measure > design.error + best.error;
}

}  // namespace

std::vector<DesignParameter> ReadDesignParameters(const Mechanism& mechanism,
                                                  const std::vector<std::string>& texts,
                                                  Diagnostics* diagnostics) {
  std::vector<DesignParameter> parameters;
  std::vector<std::string> names;
  for (const Parameter& parameter : mechanism.parameters) names.push_back(parameter.name);
  for (const std::string& text : texts) {
    const std::string where = "--over-parameters " + text;
    const size_t equals = text.find('='), colon = text.find(':', equals);
    const NameInUnit named = SplitUnit(text.substr(0, equals), [&](const std::string& name) {
      return mechanism.HasParameter(name);
    });
    if (!mechanism.HasParameter(named.name)) {
      diagnostics->AddError(where, "the model has no parameter '" + named.name + "'",
                            DidYouMean(named.name, names, "there are: " + Joined(names, 8)));
      continue;
    }
    const auto at = std::ranges::find(mechanism.parameters, named.name, &Parameter::name);
    if (!named.unit.Suits(at->unit)) {
      diagnostics->AddError(where, "the parameter is in " + at->unit, "NAME=LOW:HIGH in SI units");
      continue;
    }
    if (std::ranges::find(parameters, named.name, &DesignParameter::name) != parameters.end()) {
      diagnostics->AddError(where, "'" + named.name + "' is stated twice", "each parameter once");
      continue;
    }
    const auto number = [&](size_t from, size_t to) {
      if (equals == std::string::npos || colon == std::string::npos) return kNan;
      const std::string word = text.substr(from, to - from);
      char* end = nullptr;
      const double value = std::strtod(word.c_str(), &end);
      return word.empty() || *end != '\0' ? kNan : named.unit.to_si(value);
    };
    const double low = number(equals + 1, colon), high = number(colon + 1, text.size());
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high)) {
      diagnostics->AddError(where, "two numbers are needed, the lower one first", "NAME=LOW:HIGH");
      continue;
    }
    parameters.push_back({named.name, at->unit, low, high, at->value});
  }
  return parameters;
}

void VerifyBestDesign(const DesignQuestion& question, const ModelOfDesign& model,
                      const SetArguments& arguments, BestDesign* result,
                      const ProgressFunction& progress, const ResumeFolder* folder) {
  result->agree = false;
  const auto mechanism = model(result->best.at);
  Diagnostics diagnostics;
  const auto asked = mechanism ? ReadQuestion(*mechanism, arguments, &diagnostics) : std::nullopt;
  if (!asked) {
    result->summary.stop = Stop::kNoConvergence;
    result->summary.message = result->verdict = "the best design's model cannot be built";
    return;
  }
  result->set = ComputeReachableSet(*asked, arguments, progress, folder);
  if (!result->set.summary.ok()) {
    result->summary = result->set.summary;
    result->verdict = result->set.verdict;
    return;
  }
  ResultLog log = folder == nullptr ? ResultLog() : folder->Log("verified");
  const SetArguments coarse = CoarseOf(arguments, asked->settings.over);
  const auto measure = [&](const std::vector<VecX>& shares, std::vector<TriedDesign>* designs) {
    designs->clear();
    for (const VecX& share : shares) {
      const VecX values = ValuesOf(question, share);
      designs->push_back(
          log.Get<TriedDesign>([&] { return MeasureDesign(model, values, coarse, true); }));
      if (progress) {
        progress("designs by the lattice",
                 static_cast<double>(designs->size()) / static_cast<double>(shares.size()));
      }
    }
  };
  measure(SharesBeside(question, SharesOf(question, result->best.at)), &result->beside);
  std::vector<VecX> shares;
  const auto n = static_cast<Eigen::Index>(question.parameters.size());
  for (unsigned i = 1; question.global && i <= static_cast<unsigned>(kElsewhere * n); ++i) {
    VecX share(n);
    for (Eigen::Index k = 0; k < n; ++k)
      share[k] = RadicalInverse(Prime(static_cast<size_t>(k)), i);
    shares.push_back(share);
  }
  measure(shares, &result->elsewhere);

  const FloodedSet& flooded = result->set.flooded;
  const TriedDesign* larger = nullptr;
  for (const auto* list : {&result->beside, &result->elsewhere}) {
    for (const TriedDesign& design : *list) {
      if (IsLarger(design, flooded) && (larger == nullptr || design.measure > larger->measure)) {
        larger = &design;
      }
    }
  }
  const bool same =
      std::abs(result->best.measure - flooded.measure) <= result->best.error + flooded.error;
  result->agree = result->set.agree && same && larger == nullptr;
  if (!result->set.agree) {
    result->verdict = result->set.verdict;
  } else if (!same) {
    result->verdict =
        fmt::format("the lattice measures {:.6g} {} at the best design, the search {:.6g}",
                    flooded.measure, result->set.unit, result->best.measure);
  } else if (larger != nullptr) {
    std::vector<std::string> values;
    for (size_t k = 0; k < question.parameters.size(); ++k) {
      const DesignParameter& p = question.parameters[k];
      values.push_back(p.name + " = " +
                       ValueText(larger->at[static_cast<Eigen::Index>(k)], p.unit));
    }
    result->verdict = fmt::format("by the lattice {} is larger: {:.6g} ± {:.1g} {}", Joined(values),
                                  larger->measure, larger->error, result->set.unit);
  } else {
    const auto smaller = std::ranges::count_if(
        result->beside, [&](const TriedDesign& design) { return IsSmaller(design, flooded); });
    result->verdict = fmt::format(
        "the lattice confirms the {}, and finds none of {} designs beside it and {} elsewhere "
        "larger; of those beside it {} are smaller by more than the errors, the others as large "
        "within them",
        result->set.measure, result->beside.size(), result->elsewhere.size(), smaller);
  }
}

BestDesign FindBestDesign(const DesignQuestion& question, const ModelOfDesign& model,
                          const SetArguments& arguments, const ProgressFunction& progress,
                          const ResumeFolder* folder) {
  BestDesign result;
  Search(question, model, arguments, progress,
         folder == nullptr ? ResultLog() : folder->Log("designs"))
      .Run(&result);
  if (result.summary.ok()) {
    VerifyBestDesign(question, model, arguments, &result, progress, folder);
  } else {
    result.verdict = result.summary.message;
  }
  return result;
}

ReportSection SectionOf(const DesignQuestion& question, const BestDesign& design,
                        const std::string& command) {
  const ReachableSet& set = design.set;
  ReportSection section{.title = "TriedDesign of the largest " + set.measure,
                        .link = "TriedDesign"};
  section.Add(Paragraph{(design.agree ? "AGREE: " : "DISAGREE: ") + design.verdict,
                        design.agree ? Paragraph::Look::kPlain : Paragraph::Look::kReason});
  Table values{.name = "design_values",
               .caption = "Values of the parameters",
               .columns = {Text("parameter"), Digits("low"), Digits("high"), Digits("model's own"),
                           Digits("best"), Text("")}};
  for (size_t k = 0; k < question.parameters.size(); ++k) {
    const DesignParameter& p = question.parameters[k];
    const double best = design.best.at[static_cast<Eigen::Index>(k)];
    const double share = (best - p.low) / (p.high - p.low);
    values.rows.push_back({Code(p.name), ValueText(p.low, p.unit), ValueText(p.high, p.unit),
                           ValueText(p.own, p.unit), ValueText(best, p.unit),
                           share < 1e-4       ? "at its lower end"
                           : share > 1 - 1e-4 ? "at its upper end"
                                              : ""});
  }
  section.Add(std::move(values));
  const TriedDesign& own = design.tried.front();
  Table measures{.name = "design_measures",
                 .caption = fmt::format("The {} [{}]", set.measure, set.unit),
                 .columns = {Text("design"), Digits("by the boundary"), Digits("by the lattice")}};
  measures.rows.push_back({"where the search began",
                           own.why.empty() ? fmt::format("{:.8g}", own.measure) : own.why, ""});
  measures.rows.push_back({"best",
                           fmt::format("{:.10g} ± {:.0e}", set.traced.measure, set.traced.error),
                           fmt::format("{:.6g} ± {:.0e}", set.flooded.measure, set.flooded.error)});
  for (const auto& [name, list] :
       {std::pair("largest beside it", &design.beside), {"largest elsewhere", &design.elsewhere}}) {
    const auto most = std::ranges::max_element(*list, {}, &TriedDesign::measure);
    if (most == list->end()) continue;
    measures.rows.push_back({name, "", fmt::format("{:.6g} ± {:.0e}", most->measure, most->error)});
  }
  section.Add(std::move(measures));
  const auto none = std::ranges::count_if(
      design.tried, [](const TriedDesign& tried) { return !tried.why.empty(); });
  section.Note(
      fmt::format("{} designs by the boundary (seed {}, {}){}", design.tried.size(), question.seed,
                  question.global ? "controlled random search, then Nelder and Mead's "
                                    "method in subspaces"
                                  : "Nelder and Mead's method in subspaces",
                  none > 0 ? fmt::format("; {} of them have no set, the first one since {}", none,
                                         std::ranges::find_if(design.tried,
                                                              [](const TriedDesign& tried) {
                                                                return !tried.why.empty();
                                                              })
                                             ->why)
                           : ""),
      On::kAll);
  section.Note("Set and qualities of this design:", On::kAll);
  section.Add(Verbatim{command});
  LinePlot plot{.title = "best so far",
                .x_label = "designs tried",
                .y_label = fmt::format("{} [{}]", set.measure, set.unit),
                .lines = {}};
  PlotLine line{.label = "best so far", .points = {}};
  double best = 0.0;
  for (size_t i = 0; i < design.tried.size(); ++i) {
    best = std::max(best, design.tried[i].measure);
    line.points.emplace_back(static_cast<double>(i + 1), best);
  }
  plot.lines.push_back(std::move(line));
  section.Add(Drawing{ToSvg(plot)}, On::kPage);
  if (question.parameters.size() == 1) {
    PlotLine along{.label = set.measure, .points = {}};
    for (const TriedDesign& tried : design.tried)
      along.points.emplace_back(tried.at[0], tried.measure);
    std::ranges::sort(along.points);
    const DesignParameter& p = question.parameters[0];
    section.Add(Drawing{ToSvg(LinePlot{.title = "over the parameter",
                                       .x_label = p.name + " [" + p.unit + "]",
                                       .y_label = plot.y_label,
                                       .lines = {std::move(along)}})},
                On::kPage);
  }
  return section;
}

Json ToJson(const DesignQuestion& question, const BestDesign& design) {
  Json parameters = Json::array();
  for (size_t k = 0; k < question.parameters.size(); ++k) {
    const DesignParameter& p = question.parameters[k];
    parameters.push_back({{"name", p.name},
                          {"unit", p.unit},
                          {"low", p.low},
                          {"high", p.high},
                          {"own", Number(p.own)},
                          {"best", Number(design.best.at[static_cast<Eigen::Index>(k)])}});
  }
  return {
      {"parameters", std::move(parameters)},
      {"measure", design.set.measure},
      {"unit", design.set.unit},
      {"began", Number(design.tried.front().measure)},
      {"traced",
       {{"value", Number(design.set.traced.measure)}, {"error", Number(design.set.traced.error)}}},
      {"flooded",
       {{"value", Number(design.set.flooded.measure)},
        {"error", Number(design.set.flooded.error)}}},
      {"designs", design.tried.size()},
      {"verified", design.beside.size() + design.elsewhere.size()},
      {"agree", design.agree},
      {"verdict", design.verdict}};
}

std::vector<std::pair<std::string, std::string>> DesignFiles(const std::string& mechanism,
                                                             const DesignQuestion& question,
                                                             const BestDesign& design,
                                                             const std::string& command) {
  std::string csv = "way";
  auto out = std::back_inserter(csv);
  for (const DesignParameter& p : question.parameters) csv += "," + CsvCell(p.name);
  csv += ",measure,error,why_none\n";
  const auto rows = [&](const char* way, const std::vector<TriedDesign>& designs) {
    for (const TriedDesign& d : designs) {
      csv += way;
      for (const double value : d.at) fmt::format_to(out, ",{:.17g}", value);
      fmt::format_to(out, ",{:.17g},{:.3g},{}\n", d.measure, d.error, CsvCell(d.why));
    }
  };
  rows("boundary", design.tried);
  rows("lattice", design.beside);
  rows("lattice", design.elsewhere);
  Page page;
  page.Add(SectionOf(question, design, command));
  return {{"best_design.html",
           page.Write({.kicker = "mbverify workspace",
                       .title = mechanism,
                       .lead = fmt::format("design of the largest reachable {} over {}",
                                           design.set.measure, Joined(design.set.over)),
                       .verdict = design.agree ? Verdict::kAgree : Verdict::kDisagree,
                       .footer = "designs.csv beside this page has all designs that were tried."})},
          {"designs.csv", csv}};
}

}  // namespace mbv
