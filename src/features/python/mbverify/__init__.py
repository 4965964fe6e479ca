"""Verifies multibody models of closed-loop mechanisms, and asks them for poses and forces.

    import mbverify

    result = mbverify.run("spr_tripod/static")        # what `mbverify run` does
    solver = mbverify.load("stewart").solver()        # the solver object, in the drives
    forces = solver.inverse_dynamics(solver.home)     # of this state

SI units and radians. `run`, `audit`, `study`, `workspace`, `best_design`, `linearise` and `figures`
start the program: their results are its files, and a file that ends the program ends no interpreter.
"""

from ._native import (
    ConvergenceError,
    Finding,
    Forces,
    InputError,
    Model,
    PaperEquations,
    SingularError,
    Solver,
    SolverError,
    State,
    UnreachableError,
    UnsupportedError,
    Wrench,
    load,
)
from ._program import (
    BestDesign,
    Linearisation,
    ProgramError,
    Result,
    StudyResult,
    WorkspaceResult,
    audit,
    best_design,
    figures,
    linearise,
    program,
    run,
    study,
    workspace,
)

__all__ = [
    "BestDesign",
    "ConvergenceError",
    "Finding",
    "Forces",
    "InputError",
    "Linearisation",
    "Model",
    "PaperEquations",
    "ProgramError",
    "Result",
    "SingularError",
    "Solver",
    "SolverError",
    "State",
    "StudyResult",
    "UnreachableError",
    "UnsupportedError",
    "WorkspaceResult",
    "Wrench",
    "audit",
    "best_design",
    "figures",
    "linearise",
    "load",
    "program",
    "run",
    "study",
    "workspace",
]

# `mbverify.load("stewart").solver()`
Model.solver = lambda self, coordinates=(): Solver(self, list(coordinates))
Model.solver.__doc__ = Solver.__init__.__doc__
