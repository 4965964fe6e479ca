// Text, page and JSON of a linearised mechanism.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/text.h"
#include "features/linearise/linearise.h"
#include "mechanism/channels.h"
#include "report/html_report.h"
#include "report/page.h"
#include "verify/pictures.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMostNamed = 12, kMostColumns = 12;
constexpr double kPeriod_s = 1.0;  // that a mode takes on the page

std::string NumberText(double x) { return std::isfinite(x) ? fmt::format("{:.6g}", x) : "–"; }

std::string WordOf(const VibrationMode& mode) {
  switch (mode.kind) {
    case VibrationMode::Kind::kVibrates:
      return "vibrates";
    case VibrationMode::Kind::kDecays:
      return "decays";
    case VibrationMode::Kind::kGrows:
      return "grows: unstable";
    case VibrationMode::Kind::kRigid:
      break;
  }
  return "moves freely";
}

// "leg1 1, leg2 -0.31": what moves most, with its phase where it has one.
std::string ShapeText(const VibrationMode& mode, const std::vector<NamedCoordinate>& coordinates) {
  constexpr double kLeast = 0.02;
  std::vector<std::string> parts;
  const double largest = mode.shape.cwiseAbs().maxCoeff();
  for (Eigen::Index k = 0; k < mode.shape.size(); ++k) {
    const std::complex<double> x = mode.shape[k];
    if (std::abs(x) < kLeast * largest) continue;
    const std::string& name = coordinates[static_cast<size_t>(k)].name;
    const bool real = std::abs(x.imag()) < 1e-6 * std::abs(x);
    parts.push_back(real ? fmt::format("{} {:.3g}", name, x.real())
                         : fmt::format("{} {:.3g} at {:.0f}°", name, std::abs(x),
                                       std::arg(x) * 180.0 / std::numbers::pi));
  }
  return Joined(parts, kMostNamed);
}

Table StateTable(const Linearisation& result, const Mechanism* mechanism) {
  Table table{.columns = {Text("coordinate"), Digits("position"), Digits("rate"),
                          Digits("acceleration"), Text("unit")}};
  for (size_t k = 0; k < result.coordinates.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    table.rows.push_back(
        {Code(result.coordinates[k].name), NumberText(result.q[at]), NumberText(result.v[at]),
         NumberText(result.a[at]),
         mechanism == nullptr ? "" : CoordinateUnit(*mechanism, result.coordinates[k].coordinate)});
  }
  return table;
}

Table ModeTable(const Linearisation& result) {
  Table table{.columns = {Text("mode"), Digits("frequency, Hz"), Digits("damping ratio"),
                          Digits("eigenvalue, 1/s"), Text(""), Wide("moves")}};
  for (size_t k = 0; k < result.modes.size(); ++k) {
    const VibrationMode& mode = result.modes[k];
    const bool grows = mode.kind == VibrationMode::Kind::kGrows;
    table.rows.push_back(
        {std::to_string(k + 1), NumberText(mode.frequency_hz),
         std::abs(mode.damping_ratio) < 1e-12 ? "0" : NumberText(mode.damping_ratio),
         mode.eigenvalue.imag() == 0.0
             ? fmt::format("{:.6g}", mode.eigenvalue.real())
             : fmt::format("{:.6g} ± {:.6g} i", mode.eigenvalue.real(), mode.eigenvalue.imag()),
         Cell(WordOf(mode), grows ? Mark::kWarn : Mark::kNone),
         ShapeText(mode, result.coordinates)});
  }
  return table;
}

Table MatrixTable(const std::string& caption, const MatX& matrix,
                  const std::vector<std::string>& rows, const std::vector<std::string>& columns) {
  Table table{.caption = caption, .columns = {Text("")}};
  if (matrix.cols() > static_cast<Eigen::Index>(kMostColumns)) return {};
  for (const std::string& name : columns) table.columns.push_back(Digits(name));
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    std::vector<Cell> row = {Code(rows[static_cast<size_t>(i)])};
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) row.emplace_back(NumberText(matrix(i, k)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table WitnessTable(const Linearisation& result) {
  const auto row = [](const char* what, double error, double limit) {
    const bool good = error <= limit;
    return std::vector<Cell>{what, fmt::format("{:.1e}", error), fmt::format("{:.1e}", limit),
                             Cell(good ? "agrees" : "differs", good ? Mark::kOk : Mark::kFail)};
  };
  Table table{.columns = {Text("derivatives against those of the reference"), Digits("error"),
                          Digits("limit"), Text("")}};
  table.rows.push_back(
      row("dual numbers through the second evaluator", result.dual_error, result.dual_limit));
  table.rows.push_back(row("extrapolated differences of the reference's forces",
                           result.difference_error, result.difference_limit));
  if (result.no_every.empty()) {
    table.rows.push_back(row("dual numbers, of drive forces and reactions", result.every.dual_error,
                             result.every.dual_limit));
    table.rows.push_back(row("differences, of drive forces and reactions",
                             result.every.difference_error, result.every.difference_limit));
  } else {
    table.rows.push_back(
        {"drive forces and reactions: " + result.no_every, "–", "", Cell("none", Mark::kOff)});
  }
  for (const DerivativeCheck& check : result.checks) {
    std::vector<Cell> cells = row("", check.error, result.check_limit);
    cells[0] = Cell(check.of + ", " + check.matrix +
                    (check.explained.empty() ? "" : ": " + check.explained));
    table.rows.push_back(std::move(cells));
  }
  if (!result.program_trouble.empty()) {
    table.rows.push_back(
        {"your program: " + result.program_trouble, "–", "", Cell("not judged", Mark::kWarn)});
  }
  for (const EngineDerivative& engine : result.engines) {
    const std::string name = engine.engine + ", " + engine.softness;
    if (!engine.why_not.empty()) {
      table.rows.push_back({name + ": " + engine.why_not, "–", "", Cell("none", Mark::kOff)});
      continue;
    }
    for (const auto& [what, error] :
         {std::pair(": ∂/∂q", engine.position_error), std::pair(": ∂/∂v", engine.velocity_error)}) {
      table.rows.push_back({name + what, fmt::format("{:.1e}", error), "", Cell("measured")});
    }
  }
  return table;
}

std::string VerdictText(const Linearisation& result) {
  if (!result.witnesses_agree()) {
    return "DISAGREE: two computations of the derivatives differ";
  }
  for (const DerivativeCheck& check : result.checks) {
    if (check.error <= result.check_limit) continue;
    return fmt::format("DISAGREE: {} ({}) is off by {:.2g} of its largest entry{}", check.matrix,
                       check.of, check.error,
                       check.explained.empty() ? "" : "; " + check.explained);
  }
  return fmt::format("AGREE: derivatives computed {}",
                     result.checks.empty() ? "three ways" : "three ways, and yours") +
         (result.program_trouble.empty() ? "" : "; the program is not judged");
}

std::vector<ReportSection> SectionsOf(const Linearisation& result, const Mechanism* mechanism) {
  ReportSection modes{.title = "Natural frequencies and modes", .link = "Modes"};
  modes.Add(ModeTable(result));
  modes.Note(
      "The largest coordinate of a mode is 1 rad or one characteristic length; lengths are in m.");
  ReportSection state{.title = "The state", .link = "State"};
  state.Add(StateTable(result, mechanism));
  Table forces{.columns = {Text("drive"), Digits("force")}};
  for (size_t d = 0; d < result.drives.size(); ++d) {
    forces.rows.push_back(
        {Code(result.drives[d]), NumberText(result.drive_force[static_cast<Eigen::Index>(d)])});
  }
  state.Add(forces);
  for (const std::string& note : result.notes) state.Add(Paragraph{note});
  ReportSection witnesses{.title = "How the derivatives were checked", .link = "Witnesses"};
  witnesses.Add(WitnessTable(result));
  if (result.no_every.empty() && !result.every.by.of_drives) {
    witnesses.Note(
        "Drives are too few, or share their forces: reactions are those under forces along the "
        "coordinates.");
  }
  if (!result.not_unique.empty()) {
    witnesses.Note(
        fmt::format("Redundant constraints share {} of {} components of reactions, which "
                    "have no derivatives: {}.",
                    result.not_unique.size(), result.every.by.unique.size(),
                    Joined(result.not_unique, kMostNamed)));
  }
  ReportSection matrices{.title = "Matrices", .link = "Matrices"};
  const std::vector<std::string> names = NamesOf(result.coordinates);
  const auto add = [&](const char* caption, const MatX& matrix) {
    Table table = MatrixTable(caption, matrix, names, names);
    if (!table.rows.empty()) matrices.Add(std::move(table), On::kPage);
  };
  add("M, of M a + h = J_dᵀ τ", result.mass);
  add("K = ∂f/∂q − ∂(J_dᵀ τ)/∂q: the stiffness that springs, weight, loops and motion give",
      result.K);
  add("D = ∂f/∂v", result.D);
  matrices.Note(
      "A and B, what they are made of, and the derivatives of drive forces and reactions are in "
      "linearise.json.");
  return {modes, state, witnesses, matrices};
}

Json MatrixJson(const MatX& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) row.push_back(matrix(i, k));
    rows.push_back(std::move(row));
  }
  return rows;
}
Json VectorJson(const VecX& vector) {
  return std::vector<double>(vector.data(), vector.data() + vector.size());
}
Json NumberJson(double x) { return std::isfinite(x) ? Json(x) : Json(); }

// Rows in the order of `channels`: reactions that are unique, then drives and prescribed joints
// where these exert the forces.
struct ForceRows {
  std::vector<std::string> channels;
  VecX value;
  MatX by_position, by_velocity, by_acceleration;
};
ForceRows RowsOf(const Linearisation& result, const Mechanism& mechanism) {
  ForceRows rows;
  if (!result.no_every.empty()) return rows;
  const EveryForce& by = result.every.by;
  std::vector<std::pair<const ForceSlopes*, Eigen::Index>> from;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    for (int c = 0; c < 6; ++c) {
      if (!by.unique[6 * j + static_cast<size_t>(c)]) continue;
      rows.channels.push_back(ChannelName(Quantity::kReaction, mechanism.joints[j].name, c));
      from.emplace_back(&by.reactions, 6 * static_cast<Eigen::Index>(j) + c);
    }
  }
  if (by.of_drives) {
    for (const Drive& drive : mechanism.drives) {
      rows.channels.push_back(ChannelName(Quantity::kForce, drive.name));
    }
    for (const Prescribed& prescribed : mechanism.prescribed) {
      rows.channels.push_back(ChannelName(Quantity::kBaseForce, prescribed.name));
    }
    for (Eigen::Index i = 0; i < by.acting.force.size(); ++i) from.emplace_back(&by.acting, i);
  }
  const auto n = static_cast<Eigen::Index>(from.size());
  rows.value.resize(n);
  for (MatX* matrix : {&rows.by_position, &rows.by_velocity, &rows.by_acceleration}) {
    matrix->resize(n, by.acting.by_position.cols());
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& [of, row] = from[static_cast<size_t>(i)];
    rows.value[i] = of->force[row];
    rows.by_position.row(i) = of->by_position.row(row);
    rows.by_velocity.row(i) = of->by_velocity.row(row);
    rows.by_acceleration.row(i) = of->by_acceleration.row(row);
  }
  return rows;
}

Json ForcesJson(const Linearisation& result, const Mechanism& mechanism) {
  const JudgedForces& every = result.every;
  const ForceRows rows = RowsOf(result, mechanism);
  return {{"why_not", result.no_every},
          {"exerted_by", every.by.of_drives ? "drives" : "coordinates"},
          {"channels", rows.channels},
          {"value", VectorJson(rows.value)},
          {"by_position", MatrixJson(rows.by_position)},
          {"by_velocity", MatrixJson(rows.by_velocity)},
          {"by_acceleration", MatrixJson(rows.by_acceleration)},
          {"not_unique", result.not_unique},
          {"control", NumberJson(every.by.control)}};
}

}  // namespace

std::string LinearisationText(const Linearisation& result, bool color, size_t columns) {
  const TextStyle style{.color = color, .columns = columns};
  const bool agrees = result.agrees();
  std::string text =
      Painted(VerdictText(result), agrees ? Paint::kGood : Paint::kBad, color) + "\n";
  for (const ReportSection& section : SectionsOf(result, nullptr)) {
    text += ToText(section, style);
  }
  return text;
}

std::string LinearisationPage(const Linearisation& result, const Mechanism& mechanism) {
  Page page;
  PageHead head{.kicker = "mbverify linearise",
                .title = mechanism.name,
                .lead = VerdictText(result) + ".",
                .judges = false,
                .footer = "linearise.json beside this page has all matrices and modes."};
  const std::vector<ReportSection> sections = SectionsOf(result, &mechanism);
  page.Add(sections.front());
  std::vector<std::vector<Pose>> frames;
  std::vector<double> time_s;
  for (size_t k = 0; k < result.modes.size(); ++k) {
    const auto& moving = result.modes[k].X_WB;
    for (size_t i = 0; i < moving.size(); ++i) {
      frames.push_back(moving[i]);
      time_s.push_back(kPeriod_s * (static_cast<double>(k) +
                                    static_cast<double>(i) / static_cast<double>(kModeFrames)));
    }
  }
  if (!frames.empty()) {
    AddReplay(mechanism, frames, time_s, PaintsOf(mechanism), "The modes in motion",
              "Mode 1 from 0 s, mode 2 from 1 s and so on, a period each; how far and how fast it "
              "moves is chosen to be seen.",
              &page, &head);
  }
  for (size_t k = 1; k < sections.size(); ++k) page.Add(sections[k]);
  return page.Write(head);
}

std::string LinearisationJson(const Linearisation& result, const Mechanism& mechanism) {
  Json json = {{"mechanism", mechanism.name},
               {"agree", result.agrees()},
               {"verdict", VerdictText(result)},
               {"coordinates", NamesOf(result.coordinates)},
               {"held", NamesOf(result.held)},
               {"drives", result.drives},
               {"position", VectorJson(result.q)},
               {"rate", VectorJson(result.v)},
               {"acceleration", VectorJson(result.a)},
               {"drive_force", VectorJson(result.drive_force)},
               {"imbalance", result.imbalance},
               {"control", NumberJson(result.control)},
               {"A", MatrixJson(result.A)},
               {"B", MatrixJson(result.B)},
               {"M", MatrixJson(result.mass)},
               {"K", MatrixJson(result.K)},
               {"D", MatrixJson(result.D)},
               {"J_d", MatrixJson(result.by_reference.drive_rates)},
               {"f_q", MatrixJson(result.by_reference.by_position)},
               {"f_v", MatrixJson(result.by_reference.by_velocity)},
               {"f_a", MatrixJson(result.by_reference.by_acceleration)}};
  Json terms = Json::array();
  for (const ForceDerivatives::Term& term : result.by_reference.terms) {
    terms.push_back({{"term", term.name},
                     {"f_q", MatrixJson(term.by_position)},
                     {"f_v", MatrixJson(term.by_velocity)}});
  }
  json["terms"] = std::move(terms);
  json["forces"] = ForcesJson(result, mechanism);
  Json modes = Json::array();
  for (const VibrationMode& mode : result.modes) {
    modes.push_back({{"frequency_hz", mode.frequency_hz},
                     {"damping_ratio", NumberJson(mode.damping_ratio)},
                     {"eigenvalue", {mode.eigenvalue.real(), mode.eigenvalue.imag()}},
                     {"kind", WordOf(mode)},
                     {"shape_real", VectorJson(mode.shape.real())},
                     {"shape_imaginary", VectorJson(mode.shape.imag())}});
  }
  json["modes"] = std::move(modes);
  json["witnesses"] = {{{"name", "dual_numbers"},
                        {"error", NumberJson(result.dual_error)},
                        {"limit", result.dual_limit}},
                       {{"name", "differences"},
                        {"error", NumberJson(result.difference_error)},
                        {"limit", result.difference_limit}}};
  if (result.no_every.empty()) {
    for (const auto& [name, error, limit] :
         {std::tuple("dual_numbers_of_forces", result.every.dual_error, result.every.dual_limit),
          std::tuple("differences_of_forces", result.every.difference_error,
                     result.every.difference_limit)}) {
      json["witnesses"].push_back({{"name", name}, {"error", NumberJson(error)}, {"limit", limit}});
    }
  }
  Json checks = Json::array();
  for (const DerivativeCheck& check : result.checks) {
    checks.push_back({{"of", check.of},
                      {"matrix", check.matrix},
                      {"error", NumberJson(check.error)},
                      {"limit", result.check_limit},
                      {"explained", check.explained}});
  }
  json["checks"] = std::move(checks);
  json["program_trouble"] = result.program_trouble;
  Json engines = Json::array();
  for (const EngineDerivative& engine : result.engines) {
    engines.push_back({{"engine", engine.engine},
                       {"softness", engine.softness},
                       {"position_error", NumberJson(engine.position_error)},
                       {"velocity_error", NumberJson(engine.velocity_error)},
                       {"why_not", engine.why_not}});
  }
  json["mujoco"] = std::move(engines);
  json["notes"] = result.notes;
  return json.dump(2);
}

DataMatrices LinearisationMatrices(const Linearisation& result, const Mechanism& mechanism) {
  DataMatrices data;
  data.about = {{"mechanism", mechanism.name},
                {"verdict", VerdictText(result)},
                {"exerted_by", result.every.by.of_drives ? "drives" : "coordinates"}};
  const ForceRows rows = RowsOf(result, mechanism);
  data.names = {{"coordinates", NamesOf(result.coordinates)},
                {"drives", result.drives},
                {"force_channels", rows.channels}};
  const ForceDerivatives& by = result.by_reference;
  const auto modes = static_cast<Eigen::Index>(result.modes.size());
  MatX eigenvalues(modes, 2), real(result.q.size(), modes), imaginary(result.q.size(), modes);
  VecX frequencies(modes);
  for (Eigen::Index k = 0; k < modes; ++k) {
    const VibrationMode& mode = result.modes[static_cast<size_t>(k)];
    eigenvalues.row(k) << mode.eigenvalue.real(), mode.eigenvalue.imag();
    frequencies[k] = mode.frequency_hz;
    real.col(k) = mode.shape.real(), imaginary.col(k) = mode.shape.imag();
  }
  data.matrices = {{"A", result.A},
                   {"B", result.B},
                   {"M", result.mass},
                   {"K", result.K},
                   {"D", result.D},
                   {"J_d", by.drive_rates},
                   {"f_q", by.by_position},
                   {"f_v", by.by_velocity},
                   {"f_a", by.by_acceleration},
                   {"position", result.q},
                   {"rate", result.v},
                   {"acceleration", result.a},
                   {"drive_force", result.drive_force},
                   {"force", rows.value},
                   {"force_q", rows.by_position},
                   {"force_v", rows.by_velocity},
                   {"force_a", rows.by_acceleration},
                   {"frequency_hz", frequencies},
                   {"eigenvalue", eigenvalues},
                   {"shape_real", real},
                   {"shape_imaginary", imaginary}};
  return data;
}

}  // namespace mbv
