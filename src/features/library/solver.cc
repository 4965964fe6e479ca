#include "mbverify/solver.h"

#include <fmt/format.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <thread>

#include "analytic/closed_form.h"
#include "base/diagnostics.h"
#include "base/text.h"
#include "kinematics/command_rank.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

constexpr size_t kMostNames = 8;  // in one message

Note NoteOf(const Finding& finding) {
  return {finding.severity == Severity::kError,
          finding.file,
          finding.line,
          finding.column,
          finding.message,
          finding.hint};
}

std::vector<Note> NotesOf(const Diagnostics& diagnostics) {
  std::vector<Note> notes;
  for (const Finding& finding : diagnostics.findings()) notes.push_back(NoteOf(finding));
  return notes;
}

std::string TextOf(const std::vector<Note>& notes) {
  Diagnostics diagnostics;
  for (const Note& note : notes) {
    diagnostics.Add({note.is_error ? Severity::kError : Severity::kWarning, note.file, note.line,
                     note.column, note.message, note.hint});
  }
  return diagnostics.Text();
}

[[noreturn]] void Refuse(const std::string& message) { throw std::invalid_argument(message); }

std::string Few(const std::vector<std::string>& names) {
  if (names.size() <= kMostNames) return Joined(names);
  return Joined({names.begin(), names.begin() + kMostNames}) + ", …";
}

// Each name once: a prescribed joint or a drive stands for its joint where they have one name.
std::vector<NamedCoordinate> CoordinatesOf(const Mechanism& mechanism) {
  std::vector<NamedCoordinate> all = NamedCommandCoordinates(mechanism);
  for (NamedCoordinate& named : NamedJointCoordinates(mechanism)) {
    if (std::ranges::find(all, named.name, &NamedCoordinate::name) == all.end()) {
      all.push_back(std::move(named));
    }
  }
  return all;
}

Status StatusOf(const RunSummary& summary) {
  using Kind = Status::Kind;
  switch (summary.stop) {
    case Stop::kDone:
      return {};
    case Stop::kUnreachable:
    case Stop::kLimit:
      return {Kind::kUnreachable, summary.message, summary.where};
    case Stop::kSingular:
      return {Kind::kSingular, summary.message, summary.where};
    case Stop::kUnsupported:
      return {Kind::kUnsupported, summary.message, summary.where};
    default:
      return {Kind::kNoConvergence, summary.message, summary.where};
  }
}

}  // namespace

InputError::InputError(std::vector<Note> found)
    : std::runtime_error(TextOf(found)), notes_(std::move(found)) {}

struct Model::Data {
  Mechanism mechanism;
  std::vector<Note> notes;
  std::vector<NamedCoordinate> coordinates;
  int dofs = 0;

  [[nodiscard]] const Coordinate& Find(const std::string& name) const {
    const auto found = std::ranges::find(coordinates, name, &NamedCoordinate::name);
    if (found != coordinates.end()) return found->coordinate;
    const std::vector<std::string> names = NamesOf(coordinates);
    Refuse(fmt::format("{} has no coordinate '{}'{}", mechanism.name, name,
                       DidYouMean(name, names, "its coordinates: " + Few(names))));
  }
};

Model::Model(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

Model Model::Load(const std::string& name, const std::map<std::string, double>& parameters) {
  const std::optional<std::string> file = FindModel(name, ".");
  if (!file) {
    throw InputError({{.file = name, .message = "no such model", .hint = ModelHint(name, ".")}});
  }
  LoadOptions options;
  options.overrides = parameters;
  LoadResult loaded = LoadRobot(*file, options);
  std::vector<Note> notes = NotesOf(loaded.diagnostics);
  if (!loaded.mechanism) throw InputError(std::move(notes));
  for (const ModelCaveat& caveat : loaded.caveats) {
    notes.push_back({.is_error = false, .file = *file, .message = caveat.text, .hint = {}});
  }
  auto data = std::make_shared<Data>();
  data->mechanism = *std::move(loaded.mechanism);
  data->notes = std::move(notes);
  data->coordinates = CoordinatesOf(data->mechanism);
  data->dofs = ChooseCoordinates(data->mechanism, {}, 0).dofs;
  return Model(std::move(data));
}

const std::string& Model::name() const { return data_->mechanism.name; }
const std::string& Model::file() const { return data_->mechanism.file; }
const std::vector<Note>& Model::notes() const { return data_->notes; }
int Model::degrees_of_freedom() const { return data_->dofs; }
std::vector<std::string> Model::drives() const { return NamesOf(data_->mechanism.drives); }
std::vector<std::string> Model::prescribed() const { return NamesOf(data_->mechanism.prescribed); }
std::vector<std::string> Model::joints() const { return NamesOf(data_->mechanism.joints); }
std::vector<std::string> Model::bodies() const { return NamesOf(data_->mechanism.bodies); }
std::vector<std::string> Model::outputs() const { return NamesOf(data_->mechanism.outputs); }
std::map<std::string, double> Model::parameters() const {
  std::map<std::string, double> parameters;
  for (const Parameter& parameter : data_->mechanism.parameters) {
    parameters[parameter.name] = parameter.value;
  }
  return parameters;
}

std::vector<std::string> Model::coordinates() const { return NamesOf(data_->coordinates); }

std::string Model::UnitOf(const std::string& coordinate) const {
  return CoordinateUnit(data_->mechanism, data_->Find(coordinate));
}

double Model::HomeOf(const std::string& coordinate) const {
  return HomeValue(data_->mechanism, data_->Find(coordinate));
}

std::pair<double, double> Model::RangeOf(const std::string& coordinate) const {
  const Mechanism& mechanism = data_->mechanism;
  const Coordinate& c = data_->Find(coordinate);
  const auto index = static_cast<size_t>(c.index);
  CoordinateRange range;
  switch (c.kind) {
    case Coordinate::Kind::kDrive:
      range = mechanism.drives[index].range;
      break;
    case Coordinate::Kind::kPrescribed:
      range = mechanism.joints[static_cast<size_t>(mechanism.prescribed[index].joint)].range[0];
      break;
    case Coordinate::Kind::kJoint:
      range = mechanism.joints[index].range[static_cast<size_t>(c.component)];
      break;
    case Coordinate::Kind::kOutput:
      break;
  }
  return {range.lower, range.upper};
}

const Mechanism& Model::mechanism() const { return data_->mechanism; }

namespace {

// A frame whose motion a Jacobian gives, and from where it is seen.
struct SeenFrame {
  int body = 0, from = 0;
  Pose X_BF = Pose::Identity(), X_AR = Pose::Identity();
};

SeenFrame FrameCalled(const Mechanism& mechanism, const std::string& name) {
  if (const int o = mechanism.FindOutput(name); o >= 0) {
    const Output& output = mechanism.outputs[static_cast<size_t>(o)];
    return {output.body, output.reference_body, output.X_BO, output.X_RbR};
  }
  std::vector<std::string> names = NamesOf(mechanism.outputs);
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    if (body.name == name) return {.body = static_cast<int>(b)};
    names.push_back(body.name);
    for (const NamedFrame& frame : body.frames) {
      names.push_back(body.name + "." + frame.name);
      if (names.back() == name) return {.body = static_cast<int>(b), .X_BF = frame.X_BF};
    }
  }
  Refuse(fmt::format("{} has no output, body or frame '{}'{}", mechanism.name, name,
                     DidYouMean(name, names, "there are: " + Few(names))));
}

// Rows of T of a body, as twists of a point of it.
MatX TwistsOf(const MatX& T, int body, const Vec3& p_BoQ_W) {
  if (body == 0) return MatX::Zero(6, T.cols());
  MatX twists = T.middleRows<6>(6 * (body - 1));
  for (Eigen::Index k = 0; k < twists.cols(); ++k) {
    twists.col(k).tail<3>() += twists.col(k).head<3>().eval().cross(p_BoQ_W);
  }
  return twists;
}

MatX TwistsSeen(const SeenFrame& frame, const BodyStates& states, const MatX& T) {
  const Pose& X_WB = states.X_WB[static_cast<size_t>(frame.body)];
  const Pose& X_WA = states.X_WB[static_cast<size_t>(frame.from)];
  const Vec3 p_WF = X_WB * frame.X_BF.translation();
  MatX J = TwistsOf(T, frame.body, p_WF - X_WB.translation()) -
           TwistsOf(T, frame.from, p_WF - X_WA.translation());
  const Mat3 R_RW = (X_WA.linear() * frame.X_AR.linear()).transpose();
  J.topRows<3>() = (R_RW * J.topRows<3>()).eval();
  J.bottomRows<3>() = (R_RW * J.bottomRows<3>()).eval();
  return J;
}

std::vector<Coordinate> Chosen(const Mechanism& mechanism, const std::vector<std::string>& names) {
  const std::vector<NamedCoordinate> all = CoordinatesOf(mechanism);
  // Prescribed joints that are not chosen are held, before all others.
  std::vector<Coordinate> candidates;
  std::vector<std::string> of;
  for (const NamedCoordinate& named : all) {
    if (named.coordinate.kind != Coordinate::Kind::kPrescribed) continue;
    if (Contains(names, named.name)) continue;
    candidates.push_back(named.coordinate);
    of.push_back(named.name);
  }
  const size_t held = candidates.size();
  for (const std::string& name : names) {
    candidates.push_back(std::ranges::find(all, name, &NamedCoordinate::name)->coordinate);
    of.push_back(name);
  }
  const size_t preferred = candidates.size();
  for (const NamedCoordinate& named : all) {
    if (Contains(of, named.name)) continue;
    candidates.push_back(named.coordinate);
    of.push_back(named.name);
  }
  const CoordinateChoice choice = ChooseCoordinates(mechanism, candidates, preferred);
  std::vector<std::string> depend, would_do;
  for (const size_t k : choice.dependent) depend.push_back(of[k]);
  for (const size_t k : choice.chosen) {
    if (k >= held) would_do.push_back(of[k]);
  }
  const std::string instead = "; a set that does: " + Joined(would_do);
  if (!depend.empty()) {
    Refuse(fmt::format("{} at the home pose of {}: {} on the coordinates before{}",
                       names.size() + held > static_cast<size_t>(choice.dofs)
                           ? "too many coordinates"
                           : "coordinates that depend on each other",
                       mechanism.name,
                       Joined(depend) + (depend.size() == 1 ? " depends" : " depend"), instead));
  }
  if (choice.chosen.size() > preferred || choice.left() > 0) {
    Refuse(fmt::format("{} has {} degrees of freedom, of which {} are held or chosen{}",
                       mechanism.name, choice.dofs, preferred, instead));
  }
  return {candidates.begin() + static_cast<std::ptrdiff_t>(held),
          candidates.begin() + static_cast<std::ptrdiff_t>(preferred)};
}

}  // namespace

struct Solver::Impl {
  /// `coordinates` of these names, independent of each other.
  Impl(Model of, std::vector<std::string> chosen, const std::vector<Coordinate>& coordinates)
      : model(std::move(of)),
        names(std::move(chosen)),
        at(coordinates),
        reduced(model.mechanism(), coordinates) {}

  void CheckArgument(const char* what, const VecX& values, Eigen::Index wanted) const {
    if (values.size() != wanted) {
      Refuse(fmt::format("{} has {} values, not {}", what, values.size(), wanted));
    }
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      if (std::isfinite(values[k])) continue;
      Refuse(fmt::format("{}[{}] is not a finite number", what, k));
    }
  }

  // At the state, unless that is where the last call ended.
  RunSummary GoTo(const VecX& q, const VecX& v, const VecX& a) {
    CheckArgument("q", q, reduced.size());
    CheckArgument("v", v, reduced.size());
    CheckArgument("a", a, reduced.size());
    if (there && q == last[0] && v == last[1] && a == last[2]) return RunSummary::Done();
    there = false;
    has_motions = false;
    RunSummary summary = reduced.Move(q, v, a);
    if (!summary.ok()) return summary;
    there = true;
    last[0] = q, last[1] = v, last[2] = a;
    return summary;
  }
  RunSummary GoTo(const VecX& q) { return GoTo(q, Zero(), Zero()); }
  [[nodiscard]] VecX Zero() const { return VecX::Zero(reduced.size()); }

  // T at the state.
  RunSummary FindMotions() {
    if (has_motions) return RunSummary::Done();
    RunSummary summary = reduced.Motions(&T);
    has_motions = summary.ok();
    return summary;
  }
  // Both.
  RunSummary MotionsAt(const VecX& q, const VecX& v) {
    RunSummary summary = GoTo(q, v, Zero());
    return summary.ok() ? FindMotions() : summary;
  }

  [[nodiscard]] std::vector<LoadSample> LoadsOf(const std::vector<Wrench>& wrenches) const {
    std::vector<LoadSample> loads;
    for (const Wrench& wrench : wrenches) {
      const int body = model.mechanism().FindBody(wrench.body);
      if (body < 0) {
        Refuse(fmt::format(
            "{} has no body '{}'{}", model.name(), wrench.body,
            DidYouMean(wrench.body, model.bodies(), "its bodies: " + Few(model.bodies()))));
      }
      if (!wrench.point.allFinite() || !wrench.force.allFinite() || !wrench.moment.allFinite()) {
        Refuse(fmt::format("the load on {} is not finite", wrench.body));
      }
      loads.push_back(
          {.body = body, .p_BoQ_B = wrench.point, .force = wrench.force, .moment = wrench.moment});
    }
    return loads;
  }

  Model model;
  std::vector<std::string> names;
  std::vector<Coordinate> at;
  ReducedModel reduced;
  VecX last[3];
  bool there = false, has_motions = false;
  MatX T;
};

Solver::Solver(const Model& model, const std::vector<std::string>& coordinates) {
  std::vector<std::string> names = coordinates.empty() ? model.drives() : coordinates;
  for (size_t k = 0; k < names.size(); ++k) {
    (void)model.HomeOf(names[k]);  // it exists
    if (std::find(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(k), names[k]) !=
        names.begin() + static_cast<std::ptrdiff_t>(k)) {
      Refuse("coordinate '" + names[k] + "' is chosen twice");
    }
  }
  const std::vector<Coordinate> chosen = Chosen(model.mechanism(), names);
  impl_ = std::make_unique<Impl>(model, std::move(names), chosen);
}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

const Model& Solver::model() const { return impl_->model; }
const std::vector<std::string>& Solver::coordinates() const { return impl_->names; }
Eigen::Index Solver::size() const { return impl_->reduced.size(); }
VecX Solver::home() const { return impl_->reduced.home(); }

void Solver::Restart() {
  impl_->reduced.Restart();
  impl_->there = false;
}

Status Solver::Close(const VecX& q, State* state) {
  return Move(q, impl_->Zero(), impl_->Zero(), state);
}

Status Solver::Move(const VecX& q, const VecX& v, const VecX& a, State* state) {
  if (const RunSummary summary = impl_->GoTo(q, v, a); !summary.ok()) return StatusOf(summary);
  const ReferenceSample& sample = impl_->reduced.sample();
  const auto drives = static_cast<Eigen::Index>(model().mechanism().drives.size());
  const auto split = [&](const VecX& all, VecX* of_drives, VecX* of_prescribed) {
    *of_drives = all.head(drives);
    *of_prescribed = all.tail(all.size() - drives);
  };
  split(sample.driven.position, &state->drives, &state->prescribed);
  split(sample.driven.velocity, &state->drive_rates, &state->prescribed_rates);
  split(sample.driven.acceleration, &state->drive_accelerations, &state->prescribed_accelerations);
  state->outputs = sample.outputs;
  const BodyStates& states = impl_->reduced.states();
  state->bodies = states.X_WB;
  const auto rows = static_cast<Eigen::Index>(states.X_WB.size());
  state->twists.resize(rows, 6);
  state->accelerations.resize(rows, 6);
  for (Eigen::Index b = 0; b < rows; ++b) {
    state->twists.row(b) = states.V_WB[static_cast<size_t>(b)].transpose();
    state->accelerations.row(b) = states.A_WB[static_cast<size_t>(b)].transpose();
  }
  return {};
}

Status Solver::InverseDynamics(const VecX& q, const VecX& v, const VecX& a,
                               const std::vector<Wrench>& loads, Forces* forces) {
  const std::vector<LoadSample> samples = impl_->LoadsOf(loads);
  if (const RunSummary summary = impl_->GoTo(q, v, a); !summary.ok()) return StatusOf(summary);
  if (const RunSummary summary = impl_->FindMotions(); !summary.ok()) return StatusOf(summary);
  const RunSummary summary = impl_->reduced.AllForces(samples);
  if (!summary.ok()) return StatusOf(summary);
  const ReferenceSample& sample = impl_->reduced.sample();
  forces->drives = sample.drive_force;
  forces->coordinates = impl_->reduced.friction_by_load() == nullptr
                            ? impl_->reduced.Forces(impl_->T, samples)
                            : impl_->reduced.DriveRates(impl_->T).transpose() * forces->drives;
  forces->prescribed = sample.prescribed_force;
  forces->reactions = sample.reactions;
  return {};
}

Status Solver::ForwardDynamics(const VecX& q, const VecX& v, const VecX& drive_forces,
                               const std::vector<Wrench>& loads, VecX* a) {
  impl_->CheckArgument("drive_forces", drive_forces,
                       static_cast<Eigen::Index>(model().mechanism().drives.size()));
  const std::vector<LoadSample> samples = impl_->LoadsOf(loads);
  if (const RunSummary summary = impl_->MotionsAt(q, v); !summary.ok()) return StatusOf(summary);
  return StatusOf(impl_->reduced.Accelerations(impl_->T, samples, drive_forces, a));
}

Status Solver::Jacobian(const VecX& q, const std::string& of, MatX* J) {
  const SeenFrame frame = FrameCalled(model().mechanism(), of);
  const RunSummary summary = impl_->MotionsAt(q, impl_->Zero());
  if (summary.ok()) *J = TwistsSeen(frame, impl_->reduced.states(), impl_->T);
  return StatusOf(summary);
}

Status Solver::DriveJacobian(const VecX& q, MatX* J) {
  const RunSummary summary = impl_->MotionsAt(q, impl_->Zero());
  if (summary.ok()) *J = impl_->reduced.DriveRates(impl_->T);
  return StatusOf(summary);
}

Status Solver::ForceDerivatives(const VecX& q, const VecX& v, const VecX& a, ForceSlopes* slopes) {
  RunSummary summary = impl_->GoTo(q, v, a);
  if (summary.ok()) summary = impl_->FindMotions();
  mbv::ForceDerivatives found;
  if (summary.ok()) summary = impl_->reduced.Derivatives(impl_->T, {}, &found);
  if (summary.ok()) {
    *slopes = {found.by_position, found.by_velocity, found.by_acceleration};
  }
  return StatusOf(summary);
}

Status Solver::MassMatrix(const VecX& q, MatX* M) {
  const RunSummary summary = impl_->MotionsAt(q, impl_->Zero());
  if (summary.ok()) *M = impl_->reduced.MassMatrix(impl_->T);
  return StatusOf(summary);
}

Status Solver::Bias(const VecX& q, const VecX& v, VecX* bias) {
  const RunSummary summary = impl_->MotionsAt(q, v);
  if (!summary.ok()) return StatusOf(summary);
  if (const ForceElement* element = impl_->reduced.friction_by_load();
      element != nullptr && !v.isZero(0.0)) {
    const Mechanism& mechanism = model().mechanism();
    return {Status::Kind::kUnsupported,
            Described(mechanism, *element) +
                " has friction that grows with its load, which is no function of q and v",
            mechanism.joints[static_cast<size_t>(element->joint)].name};
  }
  *bias = impl_->reduced.Forces(impl_->T, {});
  return {};
}

Status Solver::Gravity(const VecX& q, VecX* gravity) { return Bias(q, impl_->Zero(), gravity); }

Status Solver::Derivatives(const VecX& q, MatX* T, MatX* H) {
  RunSummary summary = impl_->MotionsAt(q, impl_->Zero());
  if (summary.ok()) *T = impl_->T;
  if (summary.ok()) summary = impl_->reduced.Curvatures(H);
  return StatusOf(summary);
}

namespace {

// Runs `row(solver, i)` for all rows, in blocks each of which begins with a solver at home.
template <typename AtHome>
BatchStatus ForRows(const AtHome& make, Eigen::Index rows, int threads,
                    const Solver::Progress& progress,
                    const std::function<Status(decltype(make())*, Eigen::Index)>& row) {
  const Eigen::Index blocks = (rows + Solver::kBlock - 1) / Solver::kBlock;
  std::vector<BatchStatus> found(static_cast<size_t>(blocks));
  std::atomic<Eigen::Index> next{0}, done{0};
  std::atomic<bool> stopped{false};
  std::mutex mutex;
  std::exception_ptr trouble;
  const auto work = [&] {
    try {
      for (Eigen::Index block = next++; block < blocks; block = next++) {
        auto solver = make();
        const Eigen::Index end = std::min(rows, (block + 1) * Solver::kBlock);
        for (Eigen::Index i = block * Solver::kBlock; i < end; ++i) {
          Status status{Status::Kind::kNoConvergence, "interrupted"};
          if (!stopped) status = row(&solver, i);
          if (!status.ok()) found[static_cast<size_t>(block)].failed.emplace_back(i, status);
        }
        done += end - block * Solver::kBlock;
        if (progress) {
          const std::scoped_lock lock(mutex);
          if (!progress(done)) stopped = true;
        }
      }
    } catch (...) {
      const std::scoped_lock lock(mutex);
      trouble = std::current_exception();
      next = blocks;
    }
  };
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  const auto count = std::min<Eigen::Index>(threads > 0 ? threads : cores, blocks);
  std::vector<std::thread> pool;
  for (Eigen::Index k = 1; k < count; ++k) pool.emplace_back(work);
  work();
  for (std::thread& thread : pool) thread.join();
  if (trouble) std::rethrow_exception(trouble);
  BatchStatus all;
  for (BatchStatus& block : found) {
    std::ranges::move(block.failed, std::back_inserter(all.failed));
  }
  return all;
}

void CheckRows(const char* what, const MatX& rows, Eigen::Index count, Eigen::Index columns) {
  if (rows.rows() != count || rows.cols() != columns) {
    Refuse(fmt::format("{} has {} × {} values, not {} × {}", what, rows.rows(), rows.cols(), count,
                       columns));
  }
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    if (!rows.row(i).allFinite()) Refuse(fmt::format("{}[{}] is not finite", what, i));
  }
}

}  // namespace

BatchStatus Solver::CloseRows(const MatX& q, MatX* drives, int threads,
                              const Progress& progress) const {
  CheckRows("q", q, q.rows(), size());
  drives->setConstant(q.rows(), static_cast<Eigen::Index>(model().mechanism().drives.size()), kNan);
  const auto make = [this] { return ReducedModel(model().mechanism(), impl_->at); };
  return ForRows(make, q.rows(), threads, progress, [&](ReducedModel* reduced, Eigen::Index i) {
    const VecX still = VecX::Zero(size());
    const RunSummary summary = reduced->Move(q.row(i).transpose(), still, still);
    if (summary.ok()) drives->row(i) = reduced->sample().driven.position.head(drives->cols());
    return StatusOf(summary);
  });
}

BatchStatus Solver::InverseDynamicsRows(const MatX& q, const MatX& v, const MatX& a,
                                        MatX* drive_forces, int threads,
                                        const Progress& progress) const {
  CheckRows("q", q, q.rows(), size());
  CheckRows("v", v, q.rows(), size());
  CheckRows("a", a, q.rows(), size());
  drive_forces->setConstant(q.rows(), static_cast<Eigen::Index>(model().mechanism().drives.size()),
                            kNan);
  struct Block {
    ReducedModel reduced;
    VecX q, v, a;
  };
  const auto make = [this] {
    return Block{ReducedModel(model().mechanism(), impl_->at), VecX(), VecX(), VecX()};
  };
  return ForRows(make, q.rows(), threads, progress, [&](Block* at, Eigen::Index i) {
    at->q = q.row(i).transpose();
    at->v = v.row(i).transpose();
    at->a = a.row(i).transpose();
    RunSummary summary = at->reduced.Move(at->q, at->v, at->a);
    if (summary.ok()) summary = at->reduced.AllForces({});
    if (summary.ok()) drive_forces->row(i) = at->reduced.drive_force().transpose();
    return StatusOf(summary);
  });
}

struct PaperEquations::Data {
  explicit Data(Prepared loaded)
      : prepared(std::move(loaded)), commands(NamesOf(prepared.scenario.motion.commands)) {}

  [[nodiscard]] const Mechanism& mechanism() const { return prepared.mechanisms.analytic; }
  [[nodiscard]] const Motion& motion() const { return prepared.scenario.motion; }
  [[nodiscard]] std::unique_ptr<ClosedForm> Make() const {
    Diagnostics known;  // when it was loaded
    return MakeClosedForm(prepared.scenario, mechanism(), prepared.consent, &known).closed_form;
  }

  const Prepared prepared;
  const std::vector<std::string> commands;
};

PaperEquations::PaperEquations(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

PaperEquations PaperEquations::Load(const std::string& scenario) {
  const std::string file = FindScenario(scenario);
  Diagnostics found;
  const auto refuse = [&](const std::string& message) {
    found.AddError(file, message, "");
    throw InputError(NotesOf(found));
  };
  std::optional<Prepared> prepared = Prepare(file, {}, &found);
  if (!prepared) throw InputError(NotesOf(found));
  if (!prepared->has_closed_form()) refuse("no closed form: " + prepared->closed_form.reason);
  const Scenario& read = prepared->scenario;
  if (!prepared->closed_form.closed_form->gives_forces()) refuse("the equations give no forces");
  if (!read.motion.loads.empty()) refuse("the scenario has loads, which are functions of time");
  auto data = std::make_shared<Data>(*std::move(prepared));
  return PaperEquations(std::move(data));
}

const std::vector<std::string>& PaperEquations::commands() const { return data_->commands; }
std::vector<std::string> PaperEquations::drives() const {
  return NamesOf(data_->mechanism().drives);
}
double PaperEquations::duration_s() const { return data_->motion().duration_s; }

void PaperEquations::MotionAt(const VecX& times_s, MatX* q, MatX* v, MatX* a) const {
  const auto n = static_cast<Eigen::Index>(data_->commands.size());
  for (MatX* rows : {q, v, a}) rows->resize(times_s.size(), n);
  CommandSample command;
  for (Eigen::Index i = 0; i < times_s.size(); ++i) {
    if (!std::isfinite(times_s[i])) Refuse(fmt::format("times_s[{}] is not finite", i));
    EvaluateMotion(data_->motion(), times_s[i], &command);
    q->row(i) = command.position.transpose();
    v->row(i) = command.velocity.transpose();
    a->row(i) = command.acceleration.transpose();
  }
}

BatchStatus PaperEquations::InverseDynamicsRows(const MatX& q, const MatX& v, const MatX& a,
                                                MatX* drive_forces, int threads,
                                                const Solver::Progress& progress) const {
  const auto n = static_cast<Eigen::Index>(data_->commands.size());
  CheckRows("q", q, q.rows(), n);
  CheckRows("v", v, q.rows(), n);
  CheckRows("a", a, q.rows(), n);
  const auto drives = static_cast<Eigen::Index>(data_->mechanism().drives.size());
  drive_forces->setConstant(q.rows(), drives, kNan);
  struct Block {
    std::unique_ptr<ClosedForm> form;
    CommandSample command;
    ClosedFormSample sample;
  };
  const auto make = [this] {
    Block block{.form = data_->Make(), .command = {}, .sample = {}};
    EvaluateMotion(data_->motion(), 0.0, &block.command);
    return block;
  };
  return ForRows(make, q.rows(), threads, progress, [&](Block* block, Eigen::Index i) {
    block->command.position = q.row(i).transpose();
    block->command.velocity = v.row(i).transpose();
    block->command.acceleration = a.row(i).transpose();
    const RunSummary summary = block->form->Dynamics(block->command, &block->sample);
    if (summary.ok()) drive_forces->row(i) = block->sample.force.transpose();
    return StatusOf(summary);
  });
}

}  // namespace mbv
