#include "equations/equations.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "mechanism/channels.h"

namespace mbv {
namespace {

constexpr size_t kMostNames = 8;  // in one sentence
constexpr int kInstants = 9;      // at which stated rates are held against derivatives
constexpr double kRoundOff = 1e-9;

std::map<std::string, double> ParametersOf(const Mechanism& mechanism) {
  std::map<std::string, double> parameters;
  for (const Parameter& parameter : mechanism.parameters) {
    parameters[parameter.name] = parameter.value;
  }
  return parameters;
}

// "x" and "platform_x" are platform.x.
bool IsCalled(const std::string& command, const std::string& name) {
  if (command == name) return true;
  std::string plain = command;
  std::ranges::replace(plain, '.', '_');
  if (plain == name) return true;
  const size_t dot = command.rfind('.');
  return dot != std::string::npos && command.substr(dot + 1) == name;
}

// Where each command of the form is among the motion's; empty unless all of both have a partner.
std::vector<Eigen::Index> PlacesOf(const FormInfo& form, const Motion& motion) {
  std::vector<Eigen::Index> places;
  std::set<Eigen::Index> taken;
  for (const std::string& name : form.commands) {
    Eigen::Index found = -1;
    for (size_t k = 0; k < motion.commands.size(); ++k) {
      if (!IsCalled(motion.commands[k].name, name)) continue;
      if (motion.commands[k].name == name || found < 0) found = static_cast<Eigen::Index>(k);
    }
    if (found < 0 || !taken.insert(found).second) return {};
    places.push_back(found);
  }
  if (places.size() != motion.commands.size()) return {};
  return places;
}

RunSummary SummaryOf(const EquationFailure& failure, double time_s) {
  RunSummary summary;
  using Kind = EquationFailure::Kind;
  summary.stop = failure.kind == Kind::kUnreachable ? Stop::kUnreachable
                 : failure.kind == Kind::kSingular  ? Stop::kSingular
                                                    : Stop::kUnsupported;
  summary.message = failure.Text();
  summary.time_s = time_s;
  summary.where = failure.function;
  return summary;
}

class FileClosedForm final : public ClosedForm {
 public:
  FileClosedForm(std::shared_ptr<Equations> equations, size_t index, const FormInfo& info,
                 const Mechanism& mechanism, std::vector<Eigen::Index> places)
      : equations_(std::move(equations)),
        index_(index),
        info_(info),
        parameters_(ParametersOf(mechanism)),
        drives_(NamesOf(mechanism.drives)),
        bodies_(NamesOf(mechanism.bodies)),
        places_(std::move(places)),
        n_(static_cast<Eigen::Index>(mechanism.drives.size() + mechanism.prescribed.size())) {
    for (VecX* vector : {&q_, &v_, &a_}) vector->setZero(static_cast<Eigen::Index>(places_.size()));
    for (const Prescribed& prescribed : mechanism.prescribed) {
      prescribed_.push_back(prescribed.name);
    }
    AddChannels(mechanism);
  }

  // Prescribed joints are where the motion's commands have them.
  void FindPrescribed(const Motion& motion) {
    for (const std::string& name : prescribed_) {
      Eigen::Index found = -1;
      for (size_t k = 0; k < motion.commands.size(); ++k) {
        if (motion.commands[k].name == name) found = static_cast<Eigen::Index>(k);
      }
      commanded_.push_back(found);
    }
  }

  [[nodiscard]] std::vector<Channel> extra_channels() const override { return channels_; }

  [[nodiscard]] bool gives_forces() const override { return info_.has_forces; }

  [[nodiscard]] RunSummary Kinematics(const CommandSample& command, DrivenSample* driven) override {
    return At(command, false, driven, nullptr);
  }

  [[nodiscard]] RunSummary Dynamics(const CommandSample& command,
                                    ClosedFormSample* sample) override {
    return At(command, true, &sample->driven, sample);
  }

  // Largest difference of stated rates from the derivatives of positions; where there is one that
  // is more than round-off, in words.
  [[nodiscard]] std::string WrongRate(const CommandSample& command) {
    const EquationResult<FormSample> given = Ask(command, true);
    if (!given || given.value->rates.empty()) return "";
    double size = 0.0;
    for (const Jet& drive : given.value->drives) size = std::max(size, std::abs(drive.rate));
    for (size_t d = 0; d < drives_.size(); ++d) {
      const double stated = given.value->rates[d], exact = given.value->drives[d].rate;
      if (std::abs(stated - exact) <= kRoundOff * std::max(size, std::abs(stated))) continue;
      return fmt::format(
          "{} at t = {:.6g} s: {:.9g} stated, {:.9g} by differentiating its position", drives_[d],
          command.time_s, stated, exact);
    }
    return "";
  }

  [[nodiscard]] EquationResult<FormSample> Ask(const CommandSample& command, bool with_forces) {
    for (size_t k = 0; k < places_.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      q_[i] = command.position[places_[k]];
      v_[i] = command.velocity[places_[k]];
      a_[i] = command.acceleration[places_[k]];
    }
    const std::lock_guard lock(equations_->mutex());
    if (auto failure = equations_->SetParameters(parameters_)) return {{}, std::move(*failure)};
    return equations_->Sample(index_, q_, v_, a_, command.loads, bodies_, drives_, with_forces);
  }

  [[nodiscard]] std::vector<std::string> UnreadParameters() const {
    const std::lock_guard lock(equations_->mutex());
    const std::vector<std::string> read = equations_->ReadParameters();
    std::vector<std::string> unread;
    for (const auto& [name, value] : parameters_) {
      // Those of instances ("leg1.phi") only place what a part is.
      if (name.find('.') == std::string::npos && !Contains(read, name)) unread.push_back(name);
    }
    return unread;
  }

 private:
  // Signals that other witnesses have are theirs; others are the file's own.
  void AddChannels(const Mechanism& mechanism) {
    std::vector<Channel> known = OutputChannels(mechanism);
    for (const Joint& joint : mechanism.joints) {
      for (Channel& channel : ReactionChannels(joint)) known.push_back(std::move(channel));
    }
    for (const Output& output : mechanism.outputs) {
      for (Channel& channel : OutputRateChannels(mechanism, output)) {
        known.push_back(std::move(channel));
      }
    }
    for (const auto& [name, unit] : info_.outputs) {
      const auto found = std::ranges::find(known, name, &Channel::name);
      channels_.push_back(found != known.end() ? *found
                                               : Channel{name, unit.empty() ? "1" : unit, ""});
    }
  }

  RunSummary At(const CommandSample& command, bool with_forces, DrivenSample* driven,
                ClosedFormSample* sample) {
    const EquationResult<FormSample> given = Ask(command, with_forces);
    if (!given) return SummaryOf(given.failure, command.time_s);
    const FormSample& values = *given.value;
    for (VecX* vector : {&driven->position, &driven->velocity, &driven->acceleration}) {
      vector->resize(n_);
    }
    const auto drives = static_cast<Eigen::Index>(drives_.size());
    for (Eigen::Index d = 0; d < drives; ++d) {
      const Jet& drive = values.drives[static_cast<size_t>(d)];
      driven->position[d] = drive.value;
      driven->velocity[d] =
          values.rates.empty() ? drive.rate : values.rates[static_cast<size_t>(d)];
      driven->acceleration[d] = drive.acceleration;
    }
    for (size_t p = 0; p < prescribed_.size(); ++p) {
      const Eigen::Index k = commanded_[p], i = drives + static_cast<Eigen::Index>(p);
      driven->position[i] = k < 0 ? 0.0 : command.position[k];
      driven->velocity[i] = k < 0 ? 0.0 : command.velocity[k];
      driven->acceleration[i] = k < 0 ? 0.0 : command.acceleration[k];
    }
    if (!driven->position.allFinite() || !driven->velocity.allFinite() ||
        !driven->acceleration.allFinite()) {
      return NotFinite(command.time_s, "the motion of a drive");
    }
    if (sample == nullptr) return RunSummary::Done();
    sample->force.resize(info_.has_forces ? drives : 0);
    for (Eigen::Index d = 0; d < sample->force.size(); ++d) {
      sample->force[d] = values.forces[static_cast<size_t>(d)];
    }
    sample->extra.resize(static_cast<Eigen::Index>(values.outputs.size()));
    for (size_t k = 0; k < values.outputs.size(); ++k) {
      sample->extra[static_cast<Eigen::Index>(k)] = values.outputs[k];
    }
    if (!sample->force.allFinite()) return NotFinite(command.time_s, "the force of a drive");
    if (!sample->extra.allFinite()) return NotFinite(command.time_s, "an output");
    return RunSummary::Done();
  }

  static RunSummary NotFinite(double time_s, const char* what) {
    return {.stop = Stop::kUnsupported,
            .message = fmt::format("{} is not a finite number", what),
            .time_s = time_s};
  }

  std::shared_ptr<Equations> equations_;
  size_t index_;
  FormInfo info_;
  std::map<std::string, double> parameters_;
  std::vector<std::string> drives_, bodies_, prescribed_;
  std::vector<Channel> channels_;
  std::vector<Eigen::Index> places_, commanded_;
  Eigen::Index n_;
  VecX q_, v_, a_;
};

Finding Uncovered(const std::string& file, int line, std::string message, std::string hint) {
  Finding finding;
  finding.severity = Severity::kWarning;
  finding.file = file;
  finding.line = line;
  finding.message = std::move(message);
  finding.hint = std::move(hint);
  return finding;
}

// What a form's `covers` states, as data. Keys that mean nothing are errors.
class StatedCoverage {
 public:
  StatedCoverage(const std::string& file, int line, const Mechanism& mechanism,
                 Diagnostics* diagnostics)
      : file_(file), line_(line), mechanism_(mechanism), diagnostics_(diagnostics) {
    coverage_.form = "the closed form of " + file;
    for (const Joint& joint : mechanism.joints) {
      coverage_.joints.push_back({.name = joint.name,
                                  .kind = joint.kind,
                                  .parent = BodyName(joint.parent),
                                  .child = BodyName(joint.child)});
    }
    for (const Drive& drive : mechanism.drives) {
      AssumedDrive assumed{.name = drive.name};
      if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
        assumed.joint = mechanism.joints[size_t(on->joint)].name;
      } else if (const auto* between = std::get_if<DistanceDrive>(&drive.kind)) {
        assumed.body_from = BodyName(between->body_from);
        assumed.body_to = BodyName(between->body_to);
      }
      coverage_.drives.push_back(std::move(assumed));
    }
    for (const Prescribed& prescribed : mechanism.prescribed) {
      coverage_.prescribed.push_back(
          {.name = prescribed.name, .joint = mechanism.joints[size_t(prescribed.joint)].name});
    }
  }

  void Add(const std::string& key, const std::vector<double>& numbers) {
    if (key == "gravity") {
      if (!Has(key, numbers, {3})) return;
      for (int k = 0; k < 3; ++k) {
        coverage_.numbers.push_back({.subject = "gravity",
                                     .quantity = fmt::format("component {}", "xyz"[k]),
                                     .actual = mechanism_.gravity_W[k],
                                     .assumed = numbers[size_t(k)],
                                     .scale = std::max(mechanism_.gravity_W.norm(), 1.0),
                                     .unit = "m/s^2",
                                     .inertial = true});
      }
      return;
    }
    const size_t dot = key.rfind('.');
    const std::string name = key.substr(0, dot);
    const std::string what = dot == std::string::npos ? "" : key.substr(dot + 1);
    if (mechanism_.FindBody(name) > 0 && AddToBody(name, what, key, numbers)) return;
    if (mechanism_.FindJoint(name) >= 0 && AddToJoint(name, what, key, numbers)) return;
    diagnostics_->Add(Error(fmt::format("covers: '{}' is no quantity of {}", key, mechanism_.name),
                            "BODY.mass, BODY.com, BODY.inertia, JOINT.on_parent, JOINT.on_child, "
                            "JOINT.axis, gravity"));
  }

  [[nodiscard]] const Coverage& coverage() const { return coverage_; }

 private:
  [[nodiscard]] const std::string& BodyName(int body) const {
    return mechanism_.bodies[size_t(body)].name;
  }
  [[nodiscard]] Finding Error(std::string message, std::string hint) const {
    Finding finding = Uncovered(file_, line_, std::move(message), std::move(hint));
    finding.severity = Severity::kError;
    return finding;
  }
  bool Has(const std::string& key, const std::vector<double>& numbers,
           const std::vector<size_t>& sizes) {
    if (std::ranges::find(sizes, numbers.size()) != sizes.end()) return true;
    diagnostics_->Add(Error(fmt::format("covers: '{}' has {} numbers", key, numbers.size()),
                            fmt::format("it needs {}", fmt::join(sizes, " or "))));
    return false;
  }

  bool AddToBody(const std::string& name, const std::string& what, const std::string& key,
                 const std::vector<double>& numbers) {
    auto body = std::ranges::find(coverage_.bodies, name, &AssumedBody::name);
    if (body == coverage_.bodies.end()) {
      body = coverage_.bodies.insert(body, {.name = name});
    }
    if (what == "mass") {
      if (Has(key, numbers, {1})) body->mass = numbers[0];
    } else if (what == "com") {
      if (Has(key, numbers, {3})) body->com = Vec3(numbers.data());
    } else if (what == "inertia") {
      if (!Has(key, numbers, {3, 9})) return true;
      if (numbers.size() == 3) {
        body->inertia = Vec3(numbers.data()).asDiagonal();
        for (int k = 0; k < 3; ++k) {
          if (!std::isnan(numbers[size_t(k)])) continue;
          // Where a moment is of no influence, neither are its products.
          body->inertia.row(k).setConstant(kNan);
          body->inertia.col(k).setConstant(kNan);
        }
      } else {
        body->inertia = Mat3(numbers.data()).transpose();
      }
    } else {
      return false;
    }
    return true;
  }

  bool AddToJoint(const std::string& name, const std::string& what, const std::string& key,
                  const std::vector<double>& numbers) {
    const auto joint = std::ranges::find(coverage_.joints, name, &AssumedJoint::name);
    Vec3* into = what == "on_parent"  ? &joint->p_parent
                 : what == "on_child" ? &joint->p_child
                 : what == "axis"     ? &joint->axis_parent
                                      : nullptr;
    if (into == nullptr) return false;
    if (Has(key, numbers, {3})) *into = Vec3(numbers.data());
    return true;
  }

  const std::string& file_;
  int line_;
  const Mechanism& mechanism_;
  Diagnostics* diagnostics_;
  Coverage coverage_;
};

class FileFormMaker {
 public:
  FileFormMaker(const std::string& file, const Mechanism& mechanism, const Motion& motion,
                Diagnostics* diagnostics)
      : file_(file), mechanism_(mechanism), motion_(motion), diagnostics_(diagnostics) {}

  FileForm Run() {
    equations_ = OpenEquations(file_, diagnostics_);
    if (equations_ == nullptr) return std::move(made_);
    const EquationResult<EquationsInfo> info = [&] {
      const std::lock_guard lock(equations_->mutex());
      return equations_->Load();
    }();
    if (!info || !Choose(*info.value) || !Cover()) return std::move(made_);
    auto form = std::make_unique<FileClosedForm>(equations_, index_, form_, mechanism_, places_);
    form->FindPrescribed(motion_);
    if (!Try(form.get())) return std::move(made_);
    if (!form_.covers_stated) {
      const std::vector<std::string> unread = form->UnreadParameters();
      made_.unchecked = fmt::format(
          "{} does not state what its equations take for granted of the mechanism; what a model or "
          "its copy has otherwise would show in the forces only{}",
          file_,
          unread.empty()
              ? ""
              : "; parameters that they never read: " +
                    Joined({unread.begin(), unread.begin() + std::min(unread.size(), kMostNames)}) +
                    (unread.size() > kMostNames ? ", …" : ""));
    }
    made_.closed_form = std::move(form);
    return std::move(made_);
  }

 private:
  void Error(const EquationFailure& failure) {
    for (Finding finding : failure.Findings()) {
      if (finding.file.empty()) finding.file = file_;
      diagnostics_->Add(std::move(finding));
    }
  }

  bool Choose(const EquationsInfo& info) {
    std::vector<std::string> commands;
    for (const Command& command : motion_.commands) commands.push_back(command.name);
    std::vector<std::string> others, takes;
    for (size_t k = 0; k < info.forms.size(); ++k) {
      const FormInfo& form = info.forms[k];
      if (form.mechanism != mechanism_.name) {
        others.push_back(form.mechanism);
        continue;
      }
      places_ = PlacesOf(form, motion_);
      takes.push_back(Joined(form.commands));
      if (places_.empty() && !form.commands.empty()) continue;
      index_ = k;
      form_ = form;
      return true;
    }
    if (takes.empty()) {
      Finding finding =
          Uncovered(file_, 0,
                    info.forms.empty() ? "declares no closed form"
                                       : fmt::format("declares closed forms of {}, not of {}",
                                                     Joined(others), mechanism_.name),
                    info.forms.empty() ? "@closed_form(\"" + mechanism_.name + "\")" : "");
      finding.severity = Severity::kError;
      diagnostics_->Add(std::move(finding));
      return false;
    }
    made_.uncovered.push_back(
        Uncovered(file_, 0,
                  fmt::format("its closed form takes {}, and the motion commands {}",
                              fmt::format("{}", fmt::join(takes, "; or ")), Joined(commands)),
                  ""));
    return false;
  }

  // False where the equations do not apply.
  bool Cover() {
    if (!form_.takes_loads && !motion_.loads.empty()) {
      made_.uncovered.push_back(
          Uncovered(file_, form_.line,
                    fmt::format("its forces take no loads, and the motion has {}",
                                Joined(NamesOf(motion_.loads))),
                    "forces(p, q, qd, qdd, load) gets them"));
      return false;
    }
    if (!form_.covers_stated) return true;
    const std::lock_guard lock(equations_->mutex());
    if (const auto failure = equations_->SetParameters(ParametersOf(mechanism_))) {
      Error(*failure);
      return false;
    }
    const auto stated = equations_->Covers(index_);
    if (!stated) {
      Error(stated.failure);
      return false;
    }
    const size_t before = diagnostics_->findings().size();
    StatedCoverage coverage(file_, form_.line, mechanism_, diagnostics_);
    for (const auto& [key, numbers] : *stated.value) coverage.Add(key, numbers);
    if (diagnostics_->findings().size() > before) return false;
    made_.uncovered = FindUncovered(coverage.coverage(), mechanism_, Concern::kDynamics);
    return made_.uncovered.empty();
  }

  // At the first instant, and stated rates at a few more.
  bool Try(FileClosedForm* form) {
    CommandSample command;
    EvaluateMotion(motion_, 0.0, &command);
    const EquationResult<FormSample> first = form->Ask(command, true);
    if (!first) {
      using Kind = EquationFailure::Kind;
      // A pose out of reach is reported by the run, with its time.
      if (first.failure.kind == Kind::kUnreachable || first.failure.kind == Kind::kSingular) {
        return true;
      }
      Error(first.failure);
      return false;
    }
    if (!form_.has_rates) return true;
    for (int k = 0; k < kInstants; ++k) {
      EvaluateMotion(motion_, motion_.duration_s * k / (kInstants - 1), &command);
      const std::string wrong = form->WrongRate(command);
      if (wrong.empty()) continue;
      diagnostics_->Add(Uncovered(file_, form_.line,
                                  "its rates are not the derivatives of its positions: " + wrong,
                                  "the stated ones are compared with the other witnesses"));
      break;
    }
    return true;
  }

  const std::string& file_;
  const Mechanism& mechanism_;
  const Motion& motion_;
  Diagnostics* diagnostics_;
  std::shared_ptr<Equations> equations_;
  size_t index_ = 0;
  FormInfo form_;
  std::vector<Eigen::Index> places_;
  FileForm made_;
};

}  // namespace

FileForm MakeFileForm(const std::string& file, const Mechanism& mechanism, const Motion& motion,
                      Diagnostics* diagnostics) {
  return FileFormMaker(file, mechanism, motion, diagnostics).Run();
}

}  // namespace mbv
