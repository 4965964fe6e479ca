#include "features/code/code.h"

#include <fmt/format.h>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "base/files.h"
#include "base/scratch_folder.h"
#include "base/worker_pool.h"

namespace mbv {
namespace {

constexpr double kSame = 1e-6;  // of the largest value: a slip explains a difference
constexpr size_t kSlipStates = 30;
constexpr int kBranchStarts = 60, kBranchSteps = 60;
constexpr double kHalfTurn = 180.0;

// Of the drives and prescribed joints, in this order.
VecX Chosen(const Mechanism& mechanism, const std::vector<NamedCoordinate>& actuators,
            const VecX& of) {
  VecX chosen(static_cast<Eigen::Index>(actuators.size()));
  for (size_t i = 0; i < actuators.size(); ++i) {
    const Coordinate& at = actuators[i].coordinate;
    const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
    chosen[static_cast<Eigen::Index>(i)] =
        of[at.kind == Coordinate::Kind::kDrive ? at.index : drives + at.index];
  }
  return chosen;
}

// Runs a program in a folder; why it did not end well, or "". What it wrote is in `log` there.
std::string Ended(const std::vector<std::string>& argv, const std::filesystem::path& folder) {
  WorkerEnd end;
  WorkerPool pool;
  pool.ended = [&](size_t /*job*/, const WorkerEnd& ended) { end = ended; };
  if (!pool.Run({{.argv = argv, .log = folder / "log", .folder = folder}})) return "interrupted";
  if (!end.trouble.empty()) return end.trouble;
  if (end.timed_out) return "took longer than " + TimeText(pool.timeout_s);
  if (end.signal != 0) return fmt::format("was ended by signal {}", end.signal);
  if (end.exit_code != 0) return fmt::format("ended with code {}", end.exit_code);
  return "";
}

std::vector<Coordinate> AllOf(const CodeTask& task) {
  std::vector<Coordinate> all;
  for (const auto* named : {&task.coordinates, &task.held}) {
    for (const NamedCoordinate& at : *named) all.push_back(at.coordinate);
  }
  return all;
}

}  // namespace

CodeReference::CodeReference(const Mechanism& mechanism, const CodeTask& task)
    : mechanism_(mechanism),
      task_(task),
      model_(task.whole != nullptr ? *task.whole : mechanism, AllOf(task)) {
  if (task.whole != nullptr) {
    own_.emplace(mechanism, AllOf(task));
    given_.emplace(*task.given, AllOf(task));
  }
  held_ = model_.home().tail(static_cast<Eigen::Index>(task.held.size()));
}

bool CodeReference::Find(TestState* state, std::string* why) {
  const auto n = static_cast<Eigen::Index>(task_.coordinates.size());
  const auto all = model_.size();
  VecX q(all), v = VecX::Zero(all), a = VecX::Zero(all);
  q << state->q, held_;
  v.head(n) = state->v;
  a.head(n) = state->a;
  model_.Restart();
  RunSummary summary = model_.Move(q, v, a);
  const auto failed = [&] {
    *why = summary.message;
    return !summary.ok();
  };
  if (failed()) return false;
  const DrivenSample& driven = model_.sample().driven;
  const auto chosen = [this](const VecX& of) { return Chosen(mechanism_, task_.actuators, of); };
  state->actuators = chosen(driven.position);
  state->rates = chosen(driven.velocity);
  state->accelerations = chosen(driven.acceleration);
  state->forces.resize(0);
  const MatX& outputs = model_.sample().outputs;
  state->outputs.resize(outputs.size());
  for (Eigen::Index o = 0; o < outputs.rows(); ++o) {
    state->outputs.segment<6>(6 * o) = outputs.row(o).transpose();
  }
  MatX T;
  const auto along = [&](ReducedModel* model, VecX* forces) {
    if (model != &model_) {
      model->Restart();
      summary = model->Move(q, v, a);
    }
    if (summary.ok()) summary = model->Motions(&T);
    if (summary.ok()) *forces = model->Forces(T, {}).head(n);
    return !failed();
  };
  state->more = VecX::Zero(n);
  if (given_ && !along(&*given_, &state->more)) return false;
  if (!along(own_ ? &*own_ : &model_, &state->along)) return false;
  if (task_.actuators.size() != task_.coordinates.size()) return true;
  summary = model_.AllForces({});
  if (summary.ok() && !given_) {
    VecX forces(driven.position.size());
    forces << model_.sample().drive_force, model_.sample().prescribed_force;
    state->forces = chosen(forces);
    return true;
  }
  // What is held needs forces that no actuator gives: those along the coordinates alone.
  if (own_) summary = model_.Motions(&T);
  if (own_ && failed()) return false;
  const MatX rates = model_.DriveRates(T);
  MatX J(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Coordinate& at = task_.actuators[static_cast<size_t>(i)].coordinate;
    if (at.kind != Coordinate::Kind::kDrive) return false;
    J.row(i) = rates.row(at.index).head(n);
  }
  const Eigen::ColPivHouseholderQR<MatX> qr(J.transpose());
  if (!qr.isInvertible()) {
    *why = "the actuators do not hold the coordinates";
    return false;
  }
  state->forces = qr.solve(VecX(state->along + state->more));
  return true;
}

double CodeClosureTolerance(const MechanismFormulas& formulas) {
  constexpr double kRounding = 1e-10, kShare = 10.0;
  const FormulaTape tape(formulas.closure.gaps);
  std::vector<double> inputs(formulas.graph.inputs(), 0.0), work, gaps;
  for (size_t i = 0; i < formulas.x.size(); ++i) {
    inputs[formulas.graph.InputOf(formulas.x[i])] = formulas.x_home[static_cast<Eigen::Index>(i)];
  }
  for (size_t k = 0; k < formulas.size(); ++k) {
    inputs[formulas.graph.InputOf(formulas.closure.q[k])] =
        formulas.closure.home[static_cast<Eigen::Index>(k)];
  }
  tape.Evaluate(inputs, &work, &gaps);
  double largest = 0.0;
  for (const double gap : gaps) largest = std::max(largest, std::abs(gap));
  return std::max(kRounding, kShare * largest);
}

std::string CheckProgram(const MechanismFormulas& formulas, const CodeTextOptions& options) {
  const bool square = formulas.actuators.size() == formulas.size() && !formulas.forces.empty();
  std::string text =
      R"code(/* Self-test of @.h; with a file of states, values at these. Made by mbverify. */
#include "@.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

int main(int argc, char** argv) {
  double s[4 * @_N], row[1 + 4 * @_ACTUATORS + @_N + OUTPUTS + 1], sum = 0.0, count = 0.0;
  clock_t began;
  FILE *in, *out;
  @_pose p, home;
  int table;
  if (argc < 3) {
    SELFTEST
  }
  table = argc > 3 && strcmp(argv[3], "table") == 0;
  in = fopen(argv[1], "rb");
  out = fopen(argv[2], "wb");
  if (in == 0 || out == 0 || @_home(&home) != @_OK) return 2;
  while (fread(s, sizeof s, 1, in) == 1) {
    double* at = row + 1;
    memset(row, 0, sizeof row);
    p = home;
    row[0] = FIND;
    if (row[0] == @_OK) {
      @_actuators(&p, at);
      @_actuator_motion(&p, s + @_N, s + 2 * @_N, at + @_ACTUATORS, at + 2 * @_ACTUATORS);
      row[0] = FORCES(at + 3 * @_ACTUATORS);
      at += 4 * @_ACTUATORS;
      ALONG
      at += @_N;
      POSES
      at += OUTPUTS;
      BACK
    }
    fwrite(row, sizeof row, 1, out);
  }
  rewind(in);
  began = clock();
  p = home;
  while (count < 2e5) {
    if (fread(s, sizeof s, 1, in) != 1) {
      rewind(in);
      if (count == 0.0 || clock() - began > CLOCKS_PER_SEC / 10) break;
      continue;
    }
    count += 1.0;
    if (FIND == @_OK && FORCES(row) == @_OK) sum += row[0];
  }
  printf("%g %g\n", (double)(clock() - began) / CLOCKS_PER_SEC / (count > 0.0 ? count : 1.0), sum);
  if (fclose(out) != 0) return 2;
  fclose(in);
  return 0;
}
)code";
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (size_t at = text.find(from); at != std::string::npos;
         at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  };
  replace("SELFTEST", square ? R"code(const double worst = @_self_test();
    printf("%g\n", worst);
    return worst <= 1e-9 ? 0 : 1;)code"
                             : "return 0; /* no forces to compare */");
  replace("FIND", options.table ? "table ? @_at(&p, s) : @_close(&p, s)" : "@_close(&p, s)");
  std::string poses, back;
  for (size_t o = 0; o < formulas.outputs.size(); ++o) {
    poses += fmt::format("@_pose_{}(&p, at + {});", o, 6 * o);
  }
  if (formulas.from_actuators) {
    back =
        "{ @_pose b = home; int k;\n        *at = @_close_by_actuators(&b, row + 1) == @_OK ? 0.0 "
        ": 1e300;\n"
        "        for (k = 0; k < @_N; ++k) {\n"
        "          if (!(fabs(b.q[k] - s[k]) <= *at)) *at = fabs(b.q[k] - s[k]);\n        }\n      "
        "}";
  }
  // Forces of actuators into an array.
  for (const char* into : {"at + 3 * @_ACTUATORS", "row"}) {
    replace(fmt::format("FORCES({})", into),
            square
                ? fmt::format("@_inverse_dynamics(&p, s + @_N, s + 2 * @_N, s + 3 * @_N, {})", into)
                : "@_OK");
  }
  replace("ALONG", formulas.forces.empty() ? "" : "@_forces(&p, s + @_N, s + 2 * @_N, at);");
  replace("POSES", poses);
  replace("BACK", back);
  replace("OUTPUTS", std::to_string(6 * formulas.outputs.size()));
  if (!options.table) replace("  table = argc > 3 && strcmp(argv[3], \"table\") == 0;\n", "");
  if (!options.table) replace("  int table;\n", "");
  replace("@", options.name);
  return text;
}

CodeCheck::CodeCheck(const MechanismFormulas& formulas, const CodeTextOptions& options,
                     const std::vector<TestState>& states, const std::vector<TestState>& open)
    : formulas_(formulas), options_(options), states_(states), open_(open) {}
CodeCheck::~CodeCheck() = default;

std::string CodeCheck::Run(const std::vector<std::string>& argv,
                           const std::filesystem::path& folder, size_t count,
                           CodeJudgement* judgement) {
  std::string bytes;
  const auto add = [&](const TestState& state) {
    VecX more = state.more;
    if (more.size() == 0) more = VecX::Zero(state.q.size());
    for (const VecX* part : {&state.q, &state.v, &state.a, &static_cast<const VecX&>(more)}) {
      bytes.append(reinterpret_cast<const char*>(part->data()),  // NOLINT: numbers as they are
                   sizeof(double) * static_cast<size_t>(part->size()));
    }
  };
  for (size_t i = 0; i < count; ++i) add(states_[i]);
  const size_t open = std::min(open_.size(), count);
  for (size_t i = 0; i < open; ++i) add(open_[i]);
  if (!WriteFile(folder / "states", bytes).empty()) return "temporary files cannot be written";
  const std::string trouble = Ended(argv, folder);
  const std::string log = ReadWholeFile(folder / "log").value_or("");
  if (!trouble.empty()) return log.empty() ? trouble : trouble + ": " + log;
  const std::optional<std::string> values = ReadWholeFile(folder / "values");
  const auto m = static_cast<Eigen::Index>(formulas_.actuators.size());
  const auto n = static_cast<Eigen::Index>(formulas_.size());
  const auto o = static_cast<Eigen::Index>(6 * formulas_.outputs.size());
  std::vector<double> row(static_cast<size_t>(1 + 4 * m + n + o + 1));
  const size_t size = sizeof(double) * row.size();
  if (!values || values->size() != size * (count + open)) return "has not computed all states";
  judgement->nanoseconds = 1e9 * std::strtod(log.c_str(), nullptr);
  found_.clear();
  compared_ = count;
  for (size_t i = 0; i < count + open; ++i) {
    std::memcpy(row.data(), values->data() + i * size, size);
    const Eigen::Map<const VecX> all(row.data() + 1, 4 * m + n + o + 1);
    found_.push_back({row[0] == 0.0, all.head(m), all.segment(m, m), all.segment(2 * m, m),
                      all.segment(3 * m, m), all.segment(4 * m, n), all.segment(4 * m + n, o),
                      formulas_.from_actuators ? row.back() : kNan});
  }
  return "";
}

// A program of a header, and what compiling it gave.
struct CodeCheck::Built {
  ScratchFolder folder{"code"};
  std::string header;
  CodeJudgement judgement = {};  // what holds of each of its runs
};

void CodeCheck::Build(const std::string& header) {
  built_ = std::make_unique<Built>();
  built_->header = header;
  CodeJudgement& judgement = built_->judgement;
  const char* chosen = std::getenv("CC");
  const std::string called = chosen != nullptr && *chosen != '\0' ? chosen : "cc";
  const std::optional<std::string> compiler = FindProgram(called);
  if (!compiler) {
    judgement.not_judged = "there is no C compiler '" + called + "'";
    return;
  }
  judgement.not_judged = built_->folder.trouble();
  if (!judgement.not_judged.empty()) return;
  const std::filesystem::path& at = built_->folder.path();
  if (!WriteFile(at / (options_.name + ".h"), header).empty() ||
      !WriteFile(at / "test.c", CheckProgram(formulas_, options_)).empty()) {
    judgement.not_judged = "temporary files cannot be written";
    return;
  }
  const auto lines = [&] {
    std::vector<std::string> all;
    const std::string log = ReadWholeFile(at / "log").value_or("");
    for (size_t from = 0; from < log.size();) {
      const size_t to = std::min(log.find('\n', from), log.size());
      all.push_back(log.substr(from, to - from));
      from = to + 1;
    }
    return all;
  };
  if (Ended({*compiler, "--version"}, at).empty() && !lines().empty()) {
    judgement.compiler = lines().front();
  }
  const std::string trouble = Ended({*compiler, "-std=c99", "-O2", "-Wall", "-Wextra",
                                     "-Wconversion", "-pedantic", "test.c", "-o", "test", "-lm"},
                                    at);
  judgement.warnings = lines();
  if (trouble.empty()) return;
  judgement.not_judged = "it does not compile: the compiler " + trouble;
  judgement.broken = true;
}

CodeJudgement CodeCheck::C(const std::string& header, bool from_table) {
  if (built_ == nullptr || built_->header != header) Build(header);
  CodeJudgement judgement = built_->judgement;
  judgement.language = from_table ? "C, from the table" : "C";
  if (!judgement.not_judged.empty()) return judgement;
  const std::filesystem::path& at = built_->folder.path();
  std::vector<std::string> argv = {(at / "test").string(), "states", "values"};
  if (from_table) argv.emplace_back("table");
  judgement.not_judged = Run(argv, at, states_.size(), &judgement);
  judgement.broken = !judgement.not_judged.empty();
  if (judgement.broken) return judgement;
  // What lies outside of the proved cells is said by their share, not by states.
  Compare(&judgement, /*may_refuse=*/from_table);
  return judgement;
}

CodeJudgement CodeCheck::Python(const std::string& module, size_t most) {
  CodeJudgement judgement{.language = "Python"};
  const std::optional<std::string> python = FindProgram("python3");
  if (!python) {
    judgement.not_judged = "there is no python3";
    return judgement;
  }
  const ScratchFolder folder("code");
  judgement.not_judged = folder.trouble();
  if (!judgement.not_judged.empty()) return judgement;
  const bool square = formulas_.actuators.size() == formulas_.size() && !formulas_.forces.empty();
  std::string poses;
  for (size_t o = 0; o < formulas_.outputs.size(); ++o) {
    poses += fmt::format("{}code.pose_{}(p)", o == 0 ? "" : " + ", o);
  }
  const std::string program =
      fmt::format(R"code(import struct, sys, time
sys.path.insert(0, ".")
import {0} as code
data = open("states", "rb").read()
size, m = 4 * code.N, code.ACTUATORS
values, began, count = open("values", "wb"), time.perf_counter(), 0
for at in range(0, len(data), 8 * size):
    s = struct.unpack_from("%dd" % size, data, at)
    q, v, a, more = (s[k * code.N:(k + 1) * code.N] for k in range(4))
    p = code.Pose()
    row = [float(code.close(p, q))] + [0.0] * (4 * m + code.N + {2} + 1)
    count += 1
    if row[0] == code.OK:
        dd, ddd = code.actuator_motion(p, v, a)
        tau = {1}
        back, way = {4}, 1e300
        if back is not None and code.close_by_actuators(back, code.actuators(p)) == code.OK:
            way = max(abs(x - y) for x, y in zip(back.q, q))
        row = ([0.0 if tau is not None else 2.0] + code.actuators(p) + dd + ddd + (tau or [0.0] * m)
               + {3} + {5} + [way])
    values.write(struct.pack("%dd" % len(row), *row))
print((time.perf_counter() - began) / max(1, count))
)code",
                  options_.name, square ? "code.inverse_dynamics(p, v, a, more)" : "[0.0] * m",
                  6 * formulas_.outputs.size(),
                  formulas_.forces.empty() ? "[0.0] * code.N" : "code.forces(p, v, a)",
                  formulas_.from_actuators ? "code.Pose()" : "None", poses.empty() ? "[]" : poses);
  if (!WriteFile(folder.path() / (options_.name + ".py"), module).empty() ||
      !WriteFile(folder.path() / "run.py", program).empty()) {
    judgement.not_judged = "temporary files cannot be written";
    return judgement;
  }
  judgement.not_judged =
      Run({*python, "run.py"}, folder.path(), std::min(most, states_.size()), &judgement);
  judgement.broken = !judgement.not_judged.empty();
  if (!judgement.broken) Compare(&judgement, /*may_refuse=*/false);
  return judgement;
}

void CodeCheck::Compare(CodeJudgement* judgement, bool may_refuse) const {
  // Positions, rates, accelerations and forces of actuators, forces along coordinates.
  constexpr size_t kParts = 5;
  const auto parts_of = [](const auto& of) {
    return std::array<const VecX*, kParts>{&of.actuators, &of.rates, &of.accelerations, &of.forces,
                                           &of.along};
  };
  std::array<VecX, kParts> worst, largest;
  size_t back = 0;
  double output = 0.0;
  for (size_t i = 0; i < found_.size(); ++i) {
    const Found& found = found_[i];
    if (i >= compared_ || !found.reached) {
      judgement->only_one += found.reached || (i < compared_ && !may_refuse) ? 1 : 0;
      continue;
    }
    ++judgement->states;
    const TestState& state = states_[i];
    const auto has = parts_of(found), should = parts_of(state);
    for (size_t part = 0; part < kParts; ++part) {
      if (worst[part].size() == 0) worst[part] = largest[part] = VecX::Zero(should[part]->size());
      if (should[part]->size() == 0) continue;
      worst[part] = worst[part].cwiseMax((*has[part] - *should[part]).cwiseAbs());
      largest[part] = largest[part].cwiseMax(should[part]->cwiseAbs());
      if (!has[part]->allFinite()) worst[part].setConstant(std::numeric_limits<double>::infinity());
    }
    for (Eigen::Index k = 0; k < state.outputs.size(); ++k) {
      double off = found.outputs[k] - state.outputs[k];
      off = k % 6 > 2 ? std::remainder(off, 2.0 * M_PI) : off / formulas_.length;
      if (!(std::abs(off) <= output)) output = std::abs(off);
    }
    back += found.back <= CodeJudgement::kLimit ? 1 : 0;
  }
  if (judgement->states == 0) return;
  // By the largest value of its own, but not below rounding of the others.
  const auto relative = [&](size_t part) {
    if (worst[part].size() == 0) return kNan;
    double most = 0.0;
    const double floor = 1e-6 * largest[part].maxCoeff();
    for (Eigen::Index k = 0; k < worst[part].size(); ++k) {
      const double scale = std::max(largest[part][k], floor);
      if (worst[part][k] > 0.0) most = std::max(most, worst[part][k] / scale);
    }
    return most;
  };
  judgement->position = relative(0);
  judgement->jacobian = std::max(relative(1), relative(2));
  if (!formulas_.forces.empty()) {
    judgement->force = relative(3);
    judgement->along = relative(4);
  }
  if (!formulas_.outputs.empty()) judgement->output = output;
  if (formulas_.from_actuators) {
    judgement->back = static_cast<double>(back) / static_cast<double>(judgement->states);
  }
}

std::string CodeCheck::Slip(CodeReference* reference) const {
  const size_t count = std::min(kSlipStates, compared_);
  const auto m = static_cast<Eigen::Index>(formulas_.actuators.size());
  const auto name = [&](Eigen::Index k) {
    return "'" + formulas_.actuators[static_cast<size_t>(k)].name + "'";
  };
  const auto coordinate = [&](size_t k) {
    return "'" + formulas_.closure.coordinates[k].name + "'";
  };
  std::vector<size_t> both;
  for (size_t i = 0; i < count; ++i) {
    if (found_[i].reached) both.push_back(i);
  }
  if (both.empty()) return "it reaches none of the states";
  const auto close = [](const VecX& a, const VecX& b) {
    return (a - b).cwiseAbs().maxCoeff() <= kSame * std::max(1e-300, b.cwiseAbs().maxCoeff());
  };
  // What an actuator has over the states.
  const auto series = [&](bool force, bool has, Eigen::Index k) {
    VecX values(static_cast<Eigen::Index>(both.size()));
    for (size_t i = 0; i < both.size(); ++i) {
      const Found& found = found_[both[i]];
      const TestState& state = states_[both[i]];
      const VecX& of =
          force ? (has ? found.forces : state.forces) : (has ? found.actuators : state.actuators);
      values[static_cast<Eigen::Index>(i)] = of[k];
    }
    return values;
  };
  struct Factor {
    double by;
    const char* says;
  };
  const std::array<Factor, 4> factors = {Factor{1.0, ""}, Factor{-1.0, "has the other sign"},
                                         Factor{kHalfTurn / M_PI, "is in degrees"},
                                         Factor{M_PI / kHalfTurn, "is taken from degrees"}};
  const auto of_outputs = [&](bool force) -> std::string {
    std::string slips;
    for (Eigen::Index i = 0; i < m; ++i) {
      const VecX has = series(force, true, i);
      bool explained = close(has, series(force, false, i));
      if (explained) continue;
      for (Eigen::Index j = 0; j < m && !explained; ++j) {
        for (const Factor& factor : factors) {
          const Eigen::Index k = (i + j) % m;  // itself first
          if (!close(has, factor.by * series(force, false, k))) continue;
          explained = true;
          if (!slips.empty()) slips += "; ";
          slips += fmt::format("the {} of {}", force ? "force" : "position", name(i));
          if (k != i) slips += " is that of " + name(k);
          if (factor.by != 1.0) slips += (k == i ? " " : " and ") + std::string(factor.says);
          break;
        }
      }
      if (!explained) return "";
    }
    return slips;
  };
  bool positions_right = true;
  for (Eigen::Index k = 0; k < m; ++k) {
    positions_right = positions_right && close(series(false, true, k), series(false, false, k));
  }
  if (positions_right && states_[both[0]].forces.size() != m) return "";
  std::string slip = of_outputs(positions_right);
  if (positions_right) return slip;
  // On a symmetric mechanism a slip of the coordinates looks like one of the actuators.
  const auto also = [&slip](const std::string& other) {
    slip += (slip.empty() ? "" : "; or: ") + other;
    return slip;
  };
  // The coordinates taken otherwise.
  const size_t n = formulas_.size();
  const auto taken = [&](const std::function<void(VecX*)>& change) {
    size_t reached = 0;
    for (const size_t i : both) {
      TestState state = states_[i];
      change(&state.q);
      change(&state.v);
      change(&state.a);
      std::string why;
      if (!reference->Find(&state, &why)) continue;
      ++reached;
      if (!close(found_[i].actuators, state.actuators)) return false;
    }
    return reached > 0;
  };
  for (size_t k = 0; k < n; ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    for (size_t l = 0; l < k; ++l) {
      const auto other = static_cast<Eigen::Index>(l);
      if (taken([&](VecX* q) { std::swap((*q)[at], (*q)[other]); })) {
        return also(
            fmt::format("the coordinates {} and {} are exchanged", coordinate(l), coordinate(k)));
      }
    }
    if (taken([&](VecX* q) { (*q)[at] *= -1.0; })) {
      return also(fmt::format("the coordinate {} has the other sign", coordinate(k)));
    }
  }
  for (const double factor : {kHalfTurn / M_PI, M_PI / kHalfTurn}) {
    if (taken([&](VecX* q) { *q *= factor; })) {
      return also(factor < 1.0 ? "the coordinates are taken as degrees"
                               : "the coordinates are turned into degrees");
    }
  }
  if (!slip.empty()) return slip;
  for (const size_t i : both) {
    if (close(found_[i].actuators, states_[i].actuators)) continue;
    if (ClosesOtherwise(states_[i].q, found_[i].actuators)) {
      return "another branch: the loops close with its positions, too, in an assembly that the "
             "home pose does not lead to";
    }
    break;
  }
  return "";
}

// Least squares of all loops with coordinates and actuators given, from random places.
bool CodeCheck::ClosesOtherwise(const VecX& q, const VecX& actuators) const {
  const ClosureFormulas& closure = formulas_.closure;
  std::vector<Expr> rows = closure.gaps;
  for (const Expr& value : closure.values) rows.push_back(value);
  for (const ActuatorFormula& actuator : formulas_.actuators) rows.push_back(actuator.value);
  const FormulaTape tape(rows);
  std::vector<double> inputs(formulas_.graph.inputs(), 0.0), work, values;
  for (size_t k = 0; k < closure.q.size(); ++k) {
    inputs[formulas_.graph.InputOf(closure.q[k])] = q[static_cast<Eigen::Index>(k)];
  }
  const auto n = static_cast<Eigen::Index>(formulas_.x.size());
  const auto gap = [&](const VecX& x) {
    for (Eigen::Index i = 0; i < n; ++i) {
      inputs[formulas_.graph.InputOf(formulas_.x[static_cast<size_t>(i)])] = x[i];
    }
    tape.Evaluate(inputs, &work, &values);
    VecX r = Eigen::Map<VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
    const auto gaps = static_cast<Eigen::Index>(closure.gaps.size());
    // Angles but for turns.
    const auto less = [](double a, double b) { return std::remainder(a - b, 2.0 * M_PI); };
    for (Eigen::Index k = 0; k < q.size(); ++k) r[gaps + k] = less(r[gaps + k], q[k]);
    for (Eigen::Index k = 0; k < actuators.size(); ++k) {
      r[gaps + q.size() + k] = less(r[gaps + q.size() + k], actuators[k]);
    }
    return r;
  };
  std::mt19937_64 random(1);  // NOLINT(cert-msc51-cpp): the same each time
  std::uniform_real_distribution<double> turn(-M_PI, M_PI);
  for (int start = 0; start < kBranchStarts; ++start) {
    VecX x = formulas_.x_home;
    for (const TreeRate& rate : formulas_.rates) {
      if (rate.length) continue;
      if (rate.ball < 0) x[rate.x] += turn(random);
      if (rate.ball == 0)
        x.segment<4>(rate.x) =
            Eigen::Vector4d::NullaryExpr([&] { return turn(random); }).normalized();
    }
    double damping = 1.0;
    VecX r = gap(x);
    for (int step = 0; step < kBranchSteps && r.norm() > 1e-9; ++step) {
      MatX J(r.size() + n, n);
      constexpr double kStep = 1e-6;
      for (Eigen::Index i = 0; i < n; ++i) {
        VecX moved = x;
        moved[i] += kStep;
        const VecX up = gap(moved);
        moved[i] -= 2.0 * kStep;
        J.col(i).head(r.size()) = (up - gap(moved)) / (2.0 * kStep);
      }
      J.bottomRows(n) = std::sqrt(damping) * MatX::Identity(n, n);
      VecX right = VecX::Zero(r.size() + n);
      right.head(r.size()) = -r;
      VecX next = x + VecX(J.colPivHouseholderQr().solve(right));
      for (const TreeRate& rate : formulas_.rates) {
        if (rate.ball == 0) next.segment<4>(rate.x).normalize();
      }
      const VecX left = gap(next);
      if (left.norm() < r.norm()) {
        x = next;
        r = left;
        damping *= 0.2;
      } else {
        damping *= 5.0;
      }
    }
    if (r.norm() <= 1e-7) return true;
  }
  return false;
}

}  // namespace mbv
