// The solver object for Python: mbverify.Model and mbverify.Solver.
//
// Arrays go in and out as NumPy's. One state: arrays of n values, the result an object or an array.
// Many: arrays of rows × n, computed on all cores without the interpreter's lock.
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <optional>
#include <string>
#include <vector>

#include "mbverify/solver.h"

namespace mbv {
namespace {

namespace py = pybind11;
using py::literals::operator""_a;

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Python's exceptions; made once, with the module.
struct Exceptions {
  py::object input, solver, unreachable, singular, convergence, unsupported;

  [[nodiscard]] const py::object& Of(Status::Kind kind) const {
    switch (kind) {
      case Status::Kind::kUnreachable:
        return unreachable;
      case Status::Kind::kSingular:
        return singular;
      case Status::Kind::kUnsupported:
        return unsupported;
      default:
        return convergence;
    }
  }
};
Exceptions& Raised() {
  static auto* const exceptions = new Exceptions;  // outlives the interpreter's modules
  return *exceptions;
}

[[noreturn]] void Raise(const py::object& type, const py::object& error) {
  PyErr_SetObject(type.ptr(), error.ptr());
  throw py::error_already_set();
}

void Check(const Status& status) {
  if (status.ok()) return;
  const py::object& type = Raised().Of(status.kind);
  const py::object error = type(status.message);
  error.attr("where") = status.where;
  Raise(type, error);
}

void Translate(std::exception_ptr pointer) {
  try {
    if (pointer) std::rethrow_exception(pointer);
  } catch (const InputError& error) {
    const py::object raised = Raised().input(error.what());
    raised.attr("findings") = error.notes();
    PyErr_SetObject(Raised().input.ptr(), raised.ptr());
  }
}

Eigen::VectorXd Vector(const Array& array) {
  return Eigen::Map<const Eigen::VectorXd>(array.data(), array.size());
}

// One value per coordinate; zeros where nothing is given.
Eigen::VectorXd VectorOr0(const std::optional<Array>& array, Eigen::Index size) {
  return array ? Vector(*array) : Eigen::VectorXd::Zero(size);
}

bool IsRows(const Array& array, const char* name) {
  if (array.ndim() == 1) return false;
  if (array.ndim() == 2) return true;
  throw std::invalid_argument(std::string(name) + " has " + std::to_string(array.ndim()) +
                              " dimensions, not 1 (a state) or 2 (rows of states)");
}

Eigen::MatrixXd Rows(const Array& array, const char* name) {
  if (!IsRows(array, name)) {
    throw std::invalid_argument(std::string(name) + " is one state where others are rows");
  }
  return Eigen::Map<const RowMajor>(array.data(), array.shape(0), array.shape(1));
}

Eigen::MatrixXd RowsOr0(const std::optional<Array>& array, const char* name, Eigen::Index rows,
                        Eigen::Index columns) {
  return array ? Rows(*array, name) : Eigen::MatrixXd::Zero(rows, columns);
}

// Runs a batch without the interpreter's lock; Ctrl-C ends it.
template <typename Batch>
RowMajor RunRows(bool failures_as_nan, const Batch& batch) {
  Eigen::MatrixXd result;
  bool interrupted = false;
  const auto goes_on = [&interrupted](Eigen::Index) {
    const py::gil_scoped_acquire lock;
    if (!interrupted && PyErr_CheckSignals() != 0) interrupted = true;
    return !interrupted;
  };
  BatchStatus status;
  {
    const py::gil_scoped_release released;
    status = batch(&result, goes_on);
  }
  if (interrupted) throw py::error_already_set();
  if (!status.ok() && !failures_as_nan) {
    const auto& [row, first] = status.failed.front();
    const py::object& type = Raised().Of(first.kind);
    const py::object error =
        type("row " + std::to_string(row) + ": " + first.message +
             (status.failed.size() > 1
                  ? " (and " + std::to_string(status.failed.size() - 1) + " rows more)"
                  : ""));
    error.attr("where") = first.where;
    py::list rows;
    for (const auto& failed : status.failed) rows.append(failed.first);
    error.attr("rows") = rows;
    Raise(type, error);
  }
  return result;
}

py::object Close(Solver* solver, const Array& q, int threads, bool failures_as_nan) {
  if (IsRows(q, "q")) {
    const Eigen::MatrixXd rows = Rows(q, "q");
    return py::cast(RunRows(failures_as_nan, [&](Eigen::MatrixXd* drives, const auto& goes_on) {
      return solver->CloseRows(rows, drives, threads, goes_on);
    }));
  }
  State state;
  Check(solver->Close(Vector(q), &state));
  return py::cast(std::move(state));
}

// Positions, rates and accelerations, rows of each.
struct MotionRows {
  Eigen::MatrixXd q, v, a;

  MotionRows(const Array& positions, const std::optional<Array>& rates,
             const std::optional<Array>& accelerations)
      : q(Rows(positions, "q")),
        v(RowsOr0(rates, "v", q.rows(), q.cols())),
        a(RowsOr0(accelerations, "a", q.rows(), q.cols())) {}
};

py::object InverseDynamics(Solver* solver, const Array& q, const std::optional<Array>& v,
                           const std::optional<Array>& a, const std::vector<Wrench>& loads,
                           int threads, bool failures_as_nan) {
  if (IsRows(q, "q")) {
    if (!loads.empty()) {
      throw std::invalid_argument("loads are taken with one state, not with rows");
    }
    const MotionRows rows(q, v, a);
    return py::cast(RunRows(failures_as_nan, [&](Eigen::MatrixXd* forces, const auto& goes_on) {
      return solver->InverseDynamicsRows(rows.q, rows.v, rows.a, forces, threads, goes_on);
    }));
  }
  Forces forces;
  Check(solver->InverseDynamics(Vector(q), VectorOr0(v, solver->size()),
                                VectorOr0(a, solver->size()), loads, &forces));
  return py::cast(std::move(forces));
}

void DefineModel(py::module_& m) {
  py::class_<Note>(m, "Finding", "What was found in a file.")
      .def(py::init([](bool is_error, std::string file, int line, int column, std::string message,
                       std::string hint) {
             return Note{is_error, std::move(file),    line,
                         column,   std::move(message), std::move(hint)};
           }),
           "is_error"_a, "file"_a, "line"_a, "column"_a, "message"_a, "hint"_a)
      .def_readonly("is_error", &Note::is_error)
      .def_readonly("file", &Note::file)
      .def_readonly("line", &Note::line, "From 1; 0: none.")
      .def_readonly("column", &Note::column)
      .def_readonly("message", &Note::message)
      .def_readonly("hint", &Note::hint)
      .def("__repr__", [](const Note& note) {
        return "<" + std::string(note.is_error ? "error" : "warning") + " " + note.file +
               (note.line > 0 ? ":" + std::to_string(note.line) : "") + ": " + note.message + ">";
      });
  py::class_<Model>(m, "Model", "A mechanism as its file describes it.")
      .def_property_readonly("name", &Model::name)
      .def_property_readonly("file", &Model::file)
      .def_property_readonly("findings", &Model::notes,
                             "Warnings, and what of the file is not modelled.")
      .def_property_readonly("degrees_of_freedom", &Model::degrees_of_freedom)
      .def_property_readonly("drives", &Model::drives)
      .def_property_readonly("prescribed", &Model::prescribed)
      .def_property_readonly("joints", &Model::joints)
      .def_property_readonly("bodies", &Model::bodies)
      .def_property_readonly("outputs", &Model::outputs)
      .def_property_readonly("parameters", &Model::parameters,
                             "What load() takes others of, with their values.")
      .def_property_readonly("coordinates", &Model::coordinates,
                             "All that may be a coordinate of a solver.")
      .def("unit_of", &Model::UnitOf, "coordinate"_a, "'m' or 'rad'.")
      .def("home_of", &Model::HomeOf, "coordinate"_a)
      .def("range_of", &Model::RangeOf, "coordinate"_a,
           "Limits as the file states them; infinite where it states none.")
      .def("__repr__", [](const Model& model) {
        return "<mbverify.Model " + model.name() + ": " +
               std::to_string(model.degrees_of_freedom()) + " degrees of freedom, " +
               std::to_string(model.drives().size()) + " drives>";
      });
}

void DefineSolver(py::module_& m) {
  py::class_<Wrench>(m, "Wrench",
                     "A force [N] and a moment [N m] in world axes on a body, at a "
                     "point [m] in its frame.")
      .def(py::init([](std::string body, const Eigen::Vector3d& force,
                       const Eigen::Vector3d& moment, const Eigen::Vector3d& point) {
             return Wrench{std::move(body), point, force, moment};
           }),
           "body"_a, "force"_a = Eigen::Vector3d::Zero().eval(),
           "moment"_a = Eigen::Vector3d::Zero().eval(), "point"_a = Eigen::Vector3d::Zero().eval())
      .def_readonly("body", &Wrench::body)
      .def_readonly("force", &Wrench::force)
      .def_readonly("moment", &Wrench::moment)
      .def_readonly("point", &Wrench::point);
  py::class_<State>(m, "State", "Where everything is, and how it moves; world axes.")
      .def_readonly("drives", &State::drives)
      .def_readonly("drive_rates", &State::drive_rates)
      .def_readonly("drive_accelerations", &State::drive_accelerations)
      .def_readonly("prescribed", &State::prescribed)
      .def_readonly("prescribed_rates", &State::prescribed_rates)
      .def_readonly("prescribed_accelerations", &State::prescribed_accelerations)
      .def_readonly("outputs", &State::outputs,
                    "Per output x, y, z, roll, pitch, yaw in its reference frame.")
      .def_readonly("twists", &State::twists, "Bodies × 6: [ω; v of the body's origin].")
      .def_readonly("accelerations", &State::accelerations)
      .def_property_readonly(
          "bodies",
          [](const State& state) {
            py::array_t<double> poses(
                {static_cast<py::ssize_t>(state.bodies.size()), py::ssize_t{4}, py::ssize_t{4}});
            auto at = poses.mutable_unchecked<3>();
            for (py::ssize_t b = 0; b < poses.shape(0); ++b) {
              const Eigen::Matrix4d X = state.bodies[static_cast<size_t>(b)].matrix();
              for (int i = 0; i < 4; ++i) {
                for (int j = 0; j < 4; ++j) at(b, i, j) = X(i, j);
              }
            }
            return poses;
          },
          "Bodies × 4 × 4: homogeneous transforms from body to world.");
  py::class_<Forces>(m, "Forces", "What holds and moves a mechanism.")
      .def_readonly("drives", &Forces::drives, "[N or N m], positive towards a larger position.")
      .def_readonly("prescribed", &Forces::prescribed)
      .def_readonly("coordinates", &Forces::coordinates, "Along the chosen coordinates.")
      .def_readonly("reactions", &Forces::reactions,
                    "Joints × 6: [f; m] of the parent on the child, about the joint's frame on "
                    "the child, in the axes of that on the parent; drive forces excluded.");
  const auto with_matrix = [](auto method) {
    return [method](Solver* solver, const Array& q) {
      Eigen::MatrixXd result;
      Check((solver->*method)(Vector(q), &result));
      return RowMajor(result);
    };
  };
  py::class_<Solver>(m, "Solver",
                     "The mechanism as functions of chosen coordinates, as many as it has degrees "
                     "of freedom that are not prescribed. SI units and radians.")
      .def(py::init<const Model&, const std::vector<std::string>&>(), "model"_a,
           "coordinates"_a = std::vector<std::string>(),
           "`coordinates` of `model.coordinates`; none: its drives. ValueError where they depend "
           "on each other at home, or are too many or too few.")
      .def_property_readonly("model", &Solver::model)
      .def_property_readonly("coordinates", &Solver::coordinates)
      .def_property_readonly("size", &Solver::size)
      .def_property_readonly("home", &Solver::home, "The coordinates at the home pose.")
      .def("restart", &Solver::Restart, "The next pose is searched from home.")
      .def("close", &Close, "q"_a, "threads"_a = 0, "failures_as_nan"_a = false,
           "Closes the loops. q [n]: the State. q [rows × n]: positions of the drives.")
      .def(
          "move",
          [](Solver* solver, const Array& q, const std::optional<Array>& v,
             const std::optional<Array>& a) {
            State state;
            Check(solver->Move(Vector(q), VectorOr0(v, solver->size()),
                               VectorOr0(a, solver->size()), &state));
            return state;
          },
          "q"_a, "v"_a = py::none(), "a"_a = py::none(),
          "The State with rates and accelerations of the coordinates.")
      .def("inverse_dynamics", &InverseDynamics, "q"_a, "v"_a = py::none(), "a"_a = py::none(),
           "loads"_a = std::vector<Wrench>(), "threads"_a = 0, "failures_as_nan"_a = false,
           "Forces for a motion. Arrays [n]: the Forces. Arrays [rows × n]: drive forces, rows × "
           "drives, on `threads` threads (0: all cores), the same for any number of them. "
           "failures_as_nan: instead of an exception rows that fail are NaN.")
      .def(
          "forward_dynamics",
          [](Solver* solver, const Array& q, const Array& v, const Array& drive_forces,
             const std::vector<Wrench>& loads) {
            Eigen::VectorXd a;
            Check(solver->ForwardDynamics(Vector(q), Vector(v), Vector(drive_forces), loads, &a));
            return a;
          },
          "q"_a, "v"_a, "drive_forces"_a, "loads"_a = std::vector<Wrench>(),
          "Accelerations of the coordinates that drive forces give.")
      .def(
          "jacobian",
          [](Solver* solver, const Array& q, const std::string& of) {
            Eigen::MatrixXd J;
            Check(solver->Jacobian(Vector(q), of, &J));
            return RowMajor(J);
          },
          "q"_a, "of"_a,
          "6 × n: twist [ω; v] per unit rate of each coordinate, of an output (in its reference "
          "frame), a body's origin or 'BODY.FRAME' (world axes).")
      .def("drive_jacobian", with_matrix(&Solver::DriveJacobian), "q"_a,
           "Drives × n: their rates per unit rate of each coordinate.")
      .def("mass_matrix", with_matrix(&Solver::MassMatrix), "q"_a,
           "M of M a + bias = J_dᵀ (drive forces), n × n.")
      .def(
          "force_derivatives",
          [](Solver* solver, const Array& q, const std::optional<Array>& v,
             const std::optional<Array>& a) {
            Solver::ForceSlopes slopes;
            Check(solver->ForceDerivatives(Vector(q), VectorOr0(v, solver->size()),
                                           VectorOr0(a, solver->size()), &slopes));
            return py::make_tuple(RowMajor(slopes.by_position), RowMajor(slopes.by_velocity),
                                  RowMajor(slopes.by_acceleration));
          },
          "q"_a, "v"_a = py::none(), "a"_a = py::none(),
          "∂f/∂q, ∂f/∂v, ∂f/∂a of f = M a + bias, n × n each, columns per coordinate.")
      .def(
          "bias",
          [](Solver* solver, const Array& q, const Array& v) {
            Eigen::VectorXd bias;
            Check(solver->Bias(Vector(q), Vector(v), &bias));
            return bias;
          },
          "q"_a, "v"_a, "Bias: velocities, weight, springs, dampers, friction; n.")
      .def(
          "gravity",
          [](Solver* solver, const Array& q) {
            Eigen::VectorXd gravity;
            Check(solver->Gravity(Vector(q), &gravity));
            return gravity;
          },
          "q"_a, "The bias at rest: weight and springs; n.")
      .def(
          "derivatives",
          [](Solver* solver, const Array& q) {
            Eigen::MatrixXd T, H;
            Check(solver->Derivatives(Vector(q), &T, &H));
            const auto n = static_cast<py::ssize_t>(solver->size());
            return py::make_tuple(RowMajor(T), py::cast(RowMajor(H)).attr("reshape")(-1, n, n));
          },
          "q"_a,
          "T [6 (bodies − 1) × n] and H [6 (bodies − 1) × n × n]: the twists of all bodies are "
          "T v, their accelerations T a + Σ_ij H_ij v_i v_j.")
      .def("__repr__", [](const Solver& solver) {
        std::string names;
        for (const std::string& name : solver.coordinates()) {
          names += (names.empty() ? "" : ", ") + name;
        }
        return "<mbverify.Solver of " + solver.model().name() + " in " + names + ">";
      });
}

void DefineEquations(py::module_& m) {
  py::class_<PaperEquations>(m, "PaperEquations",
                             "A paper's equations, as a scenario drives them: drive forces as "
                             "functions of its commands, by its closed form.")
      .def(py::init(&PaperEquations::Load), "scenario"_a,
           "`scenario`: MODEL/NAME or a file. InputError where no closed form applies.")
      .def_property_readonly("commands", &PaperEquations::commands,
                             "Columns of q, v, a: ties between drives last.")
      .def_property_readonly("drives", &PaperEquations::drives, "Columns of the forces.")
      .def_property_readonly("duration_s", &PaperEquations::duration_s)
      .def(
          "motion",
          [](const PaperEquations& equations, const Array& times_s) {
            Eigen::MatrixXd q, v, a;
            equations.MotionAt(Vector(times_s), &q, &v, &a);
            return py::make_tuple(RowMajor(q), RowMajor(v), RowMajor(a));
          },
          "times_s"_a, "The scenario's own motion: q, v, a, a row per time.")
      .def(
          "inverse_dynamics",
          [](const PaperEquations& equations, const Array& q, const std::optional<Array>& v,
             const std::optional<Array>& a, int threads, bool failures_as_nan) {
            const MotionRows rows(q, v, a);
            return RunRows(failures_as_nan, [&](Eigen::MatrixXd* forces, const auto& goes_on) {
              return equations.InverseDynamicsRows(rows.q, rows.v, rows.a, forces, threads,
                                                   goes_on);
            });
          },
          "q"_a, "v"_a = py::none(), "a"_a = py::none(), "threads"_a = 0,
          "failures_as_nan"_a = false, "Drive forces, rows × drives, of rows × commands.")
      .def("__repr__", [](const PaperEquations& equations) {
        return "<mbverify.PaperEquations with " + std::to_string(equations.commands().size()) +
               " commands, " + std::to_string(equations.drives().size()) + " drives>";
      });
}

}  // namespace
}  // namespace mbv

PYBIND11_MODULE(_native, m) {
  namespace py = pybind11;
  using py::literals::operator""_a;
  m.doc() = "Native part of mbverify.";
  mbv::DefineModel(m);
  mbv::DefineSolver(m);
  mbv::DefineEquations(m);
  mbv::Exceptions& raised = mbv::Raised();
  const auto make = [&m](const char* name, const py::object& base, const char* says) {
    const py::object type = py::reinterpret_steal<py::object>(PyErr_NewExceptionWithDoc(
        (std::string("mbverify.") + name).c_str(), says, base.ptr(), nullptr));
    m.attr(name) = type;
    return type;
  };
  const py::object value_error = py::reinterpret_borrow<py::object>(PyExc_ValueError);
  const py::object arithmetic = py::reinterpret_borrow<py::object>(PyExc_ArithmeticError);
  raised.input = make("InputError", value_error, "A file that cannot be read; `findings`.");
  raised.solver =
      make("SolverError", arithmetic, "A state that cannot be computed; `where`, of rows `rows`.");
  raised.unreachable = make("UnreachableError", raised.solver, "The loops cannot be closed.");
  raised.singular =
      make("SingularError", raised.solver, "The coordinates or drives do not hold it.");
  raised.convergence = make("ConvergenceError", raised.solver, "Newton's method did not converge.");
  raised.unsupported =
      make("UnsupportedError", raised.solver, "The model has what this does not cover.");
  py::register_exception_translator(&mbv::Translate);
  m.def("load", &mbv::Model::Load, "name"_a, "parameters"_a = std::map<std::string, double>(),
        "A model by name or the path of its model.yaml, URDF or MJCF file.");
}
