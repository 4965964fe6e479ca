"""The Python package: the solver object, and commands whose results are the program's."""

import ast
import base64
import gc
import importlib.util
import json
import os
import pathlib
import re
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import numpy as np

import mbverify

SOURCE = pathlib.Path(os.environ["MBV_SOURCE"])


def model_file(name):
    return str(SOURCE / "models" / name / "model.yaml")


class TheSolver(unittest.TestCase):
    def setUp(self):
        self.model = mbverify.load("stewart")
        self.solver = self.model.solver()

    def test_names_its_model(self):
        self.assertEqual(self.model.name, "stewart")
        self.assertEqual(self.model.degrees_of_freedom, 6)
        self.assertEqual(self.solver.coordinates, self.model.drives)
        self.assertEqual(self.model.unit_of("platform.roll"), "rad")
        self.assertIn("6 degrees of freedom", repr(self.model))

    def test_moves_closes_and_balances(self):
        q = self.solver.home + 0.01
        v, a = np.linspace(-0.3, 0.3, 6), np.linspace(1, -1, 6)
        state = self.solver.move(q, v, a)
        np.testing.assert_allclose(state.drives, q, atol=1e-12)
        np.testing.assert_allclose(state.drive_rates, v, atol=1e-12)
        forces = self.solver.inverse_dynamics(q, v, a)
        M, bias = self.solver.mass_matrix(q), self.solver.bias(q, v)
        scale = abs(forces.drives).max()
        np.testing.assert_allclose(M @ a + bias, forces.drives, atol=1e-9 * scale)
        np.testing.assert_allclose(
            self.solver.forward_dynamics(q, v, forces.drives), a, atol=1e-8
        )
        T, H = self.solver.derivatives(q)
        self.assertEqual(H.shape, (T.shape[0], 6, 6))
        accelerations = T @ a + np.einsum("kij,i,j->k", H, v, v)
        np.testing.assert_allclose(accelerations, state.accelerations[1:].ravel(), atol=1e-9)
        self.assertEqual(state.bodies.shape, (len(self.model.bodies), 4, 4))
        platform = self.model.bodies.index("platform")
        J = self.solver.jacobian(q, "platform")
        moved = self.solver.close(q + 1e-6 * v).bodies[platform, :3, 3]
        back = self.solver.close(q - 1e-6 * v).bodies[platform, :3, 3]
        np.testing.assert_allclose((moved - back) / 2e-6, (J @ v)[3:], atol=1e-6)

    def test_notices_a_perturbed_parameter(self):
        home = self.solver.home
        here = self.solver.inverse_dynamics(home).drives
        noticed = 0
        for name, value in self.model.parameters.items():
            there = mbverify.load("stewart", {name: 1.0001 * value}).solver()
            try:
                noticed += abs(there.inverse_dynamics(home).drives - here).max() > 1e-7 * abs(here).max()
            except mbverify.SolverError:
                pass
        self.assertGreater(noticed, 2)

    def test_takes_loads(self):
        home = self.solver.home
        load = mbverify.Wrench("platform", force=[0, 0, -100])
        change = (
            self.solver.inverse_dynamics(home, loads=[load]).drives
            - self.solver.inverse_dynamics(home).drives
        )
        J = self.solver.jacobian(home, "platform")
        point = self.solver.close(home)  # the platform's origin: the output's frame is there
        np.testing.assert_allclose(change, -J.T @ [0, 0, 0, 0, 0, -100], atol=1e-8)
        self.assertEqual(len(point.drives), 6)

    def test_rows_are_states(self):
        generator = np.random.default_rng(1)
        q = self.solver.home + 0.02 * generator.standard_normal((600, 6))
        forces = self.solver.inverse_dynamics(q, threads=2)
        np.testing.assert_array_equal(forces, self.solver.inverse_dynamics(q, threads=1))
        for row in (0, 299, 599):
            one = self.solver.inverse_dynamics(q[row]).drives
            np.testing.assert_allclose(forces[row], one, rtol=1e-9)
        np.testing.assert_allclose(self.solver.close(q), q, atol=1e-10)
        # Any layout and type that NumPy can convert.
        np.testing.assert_array_equal(self.solver.close(np.asfortranarray(q)), self.solver.close(q))

    def test_rows_that_fail_are_named(self):
        q = np.tile(self.solver.home, (10, 1))
        q[3, 0] += 40
        with self.assertRaises(mbverify.SolverError) as raised:
            self.solver.inverse_dynamics(q)
        self.assertEqual(raised.exception.rows, [3])
        self.assertIn("row 3", str(raised.exception))
        forces = self.solver.inverse_dynamics(q, failures_as_nan=True)
        self.assertEqual(list(np.isnan(forces).all(axis=1)), [k == 3 for k in range(10)])

    def test_wrong_arguments_are_value_errors(self):
        solver, home = self.solver, self.solver.home
        nan = home.copy()
        nan[0] = np.nan
        for call, says in (
            (lambda: solver.close(home[:5]), "q has 5 values, not 6"),
            (lambda: solver.close(nan), r"q\[0\] is not a finite number"),
            (lambda: solver.close(np.zeros((2, 3, 6))), "3 dimensions"),
            (lambda: solver.close(np.zeros((2, 5))), "not"),
            (lambda: solver.inverse_dynamics(np.zeros((2, 6)), np.zeros(6)), "one state"),
            (lambda: solver.inverse_dynamics(home, loads=[mbverify.Wrench("p")]), "no body 'p'"),
            (lambda: solver.jacobian(home, "platfrom"), "platform"),
            (lambda: self.model.solver(["platform.z"]), "degrees of freedom"),
            (lambda: self.model.solver(self.model.drives + ["platform.z"]), "too many"),
            (lambda: self.model.solver(["leg"]), "has no coordinate 'leg'"),
        ):
            with self.assertRaisesRegex(ValueError, says):
                call()
        with self.assertRaises(TypeError):
            solver.close("home")
        with self.assertRaises(TypeError):
            solver.inverse_dynamics(home, loads=[3])

    def test_unreachable_poses_are_exceptions(self):
        model = mbverify.load("four_bar")
        solver = model.solver([model.outputs[0] + ".x"])
        with self.assertRaises(mbverify.UnreachableError):
            solver.close(solver.home + 100)
        self.assertEqual(len(solver.close(solver.home).drives), 1)

    def test_a_solver_outlives_its_model(self):
        solver = mbverify.load("four_bar").solver()
        gc.collect()
        forces = solver.inverse_dynamics(solver.home)
        drives = forces.drives
        del forces
        gc.collect()
        self.assertTrue(np.isfinite(drives).all())

    def test_threads_may_have_solvers_of_their_own(self):
        expected = self.solver.inverse_dynamics(self.solver.home).drives
        found, model = [], self.model

        def work():
            solver = model.solver()
            rows = np.tile(solver.home, (300, 1))
            found.append(solver.inverse_dynamics(rows, threads=2)[-1])

        threads = [threading.Thread(target=work) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(found), 4)
        for forces in found:
            np.testing.assert_allclose(forces, expected, rtol=1e-10)

    def test_ctrl_c_ends_a_batch(self):
        rows = np.tile(self.solver.home, (2_000_000, 1)) + 1e-3
        timer = threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        start = time.monotonic()
        with self.assertRaises(KeyboardInterrupt):
            self.solver.inverse_dynamics(rows)
        self.assertLess(time.monotonic() - start, 20)

    def test_memory_stays_flat(self):
        home = self.solver.home

        def calls():
            for _ in range(3000):
                self.solver.inverse_dynamics(home + 1e-4)
                self.solver.mass_matrix(home)

        calls()
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(4):
            calls()
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self.assertLess(after - before, 2048)  # [KiB]


class TheEquations(unittest.TestCase):
    def test_are_those_of_a_run(self):
        scenario = "stabilizing_platform/sea_state"
        equations = mbverify.PaperEquations(scenario)
        self.assertEqual(equations.commands[:3], ["roll", "pitch", "heave"])
        traces = mbverify.run(scenario).traces
        forces = equations.inverse_dynamics(*equations.motion(traces["time_s"]))
        for k, drive in enumerate(equations.drives):
            np.testing.assert_array_equal(forces[:, k], traces[f"{drive}.force.analytic"])

    def test_agree_with_the_solver(self):
        equations = mbverify.PaperEquations("spr_tripod/harmonic")
        q, v, a = equations.motion(np.linspace(0, equations.duration_s, 400))
        solver = mbverify.load("spr_tripod").solver(equations.commands)
        forces = equations.inverse_dynamics(q, v, a)
        np.testing.assert_allclose(forces, solver.inverse_dynamics(q, v, a), rtol=1e-9)
        np.testing.assert_array_equal(forces, equations.inverse_dynamics(q, v, a, threads=1))
        other = equations.inverse_dynamics(q + 1e-6, v, a)
        self.assertGreater(abs(other - forces).max(), 1e-7 * abs(forces).max())

    def test_say_where_there_are_none(self):
        for scenario, says in (
            ("four_bar/turn", "no closed form: switched off"),
            ("nowhere/at_all", ""),
        ):
            with self.assertRaisesRegex(mbverify.InputError, says):
                mbverify.PaperEquations(scenario)
        equations = mbverify.PaperEquations("spr_tripod/harmonic")
        with self.assertRaisesRegex(ValueError, "q has 2 × 2 values, not 2 × "):
            equations.inverse_dynamics(np.zeros((2, 2)))
        with self.assertRaisesRegex(ValueError, "not finite"):
            equations.motion([0, np.inf])


class Stubs(unittest.TestCase):
    def test_declare_what_there_is(self):
        file = pathlib.Path(mbverify.__file__).parent / "_native.pyi"
        for item in ast.parse(file.read_text()).body:
            if not isinstance(item, (ast.ClassDef, ast.FunctionDef)):
                continue
            found = getattr(mbverify, item.name)
            self.assertTrue(found.__doc__, item.name)
            if not isinstance(item, ast.ClassDef) or issubclass(found, Exception):
                continue
            declared = {m.name for m in item.body if isinstance(m, ast.FunctionDef)}
            there = {name for name in vars(found) if not name.startswith("_")}
            self.assertEqual(declared - {"__init__"}, there, item.name)


class Files(unittest.TestCase):
    def test_a_model_that_is_none_is_explained(self):
        with self.assertRaises(mbverify.InputError) as raised:
            mbverify.load("stewrat")
        self.assertIn("stewart", raised.exception.findings[0].hint)

    def test_findings_are_data(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "model.yaml"
            file.write_text("name: x\nbodies: 3\njoints: {}\n")
            with self.assertRaises(mbverify.InputError) as raised:
                mbverify.load(str(file))
        found = raised.exception.findings
        self.assertEqual(found[0].line, 2)
        self.assertTrue(found[0].is_error)
        self.assertIn("error", repr(found[0]))

    def test_hostile_files_end_in_exceptions(self):
        """Seeds of the fuzzers, whole, cut and with bytes changed."""
        generator = np.random.default_rng(5)
        tried = refused = 0
        with tempfile.TemporaryDirectory() as folder:
            for seed in sorted((SOURCE / "tests" / "fuzz" / "seeds").rglob("*")):
                if not seed.is_file() or seed.suffix not in (".xml", ".urdf", ".yaml"):
                    continue
                text = seed.read_bytes()
                changed = bytearray(text)
                for at in generator.integers(0, max(1, len(text)), 8):
                    if changed:
                        changed[at] = generator.integers(0, 256)
                for content in (text, text[: len(text) // 2], bytes(changed)):
                    file = pathlib.Path(folder) / ("hostile" + seed.suffix)
                    file.write_bytes(content)
                    tried += 1
                    try:
                        mbverify.load(str(file))
                    except mbverify.InputError as error:
                        refused += 1
                        self.assertTrue(error.findings)
        self.assertGreater(tried, 20)
        self.assertGreater(refused, tried // 3)


class Commands(unittest.TestCase):
    def test_a_run_is_the_programs(self):
        names = (
            "andrews_squeezer/benchmark belt_block/released bricard/turn cabin_robot/static "
            "four_bar/encoder four_bar/static four_bar/table_excel four_bar/turn_inverse "
            "geared_press/inverse machine_five_bar/draw_inverse n_four_bar/rock scara_robot/static "
            "scara_robot/stiffness slider_crank/press spr_tripod/leg_lengths spr_tripod/static "
            "spring_cart/swing stabilizing_platform/static stewart/static stewart/wave"
        ).split()
        for name in names:
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                subprocess.run(
                    [mbverify.program(), "run", name, "--no-pictures", "--out", folder + "/a"],
                    capture_output=True, check=True,
                )
                result = mbverify.run(name, out=folder + "/b")
                self.assertTrue(result.passed)
                theirs = pathlib.Path(folder) / "a" / name
                files = [f for f in ("traces.csv", "model.xml") if (theirs / f).exists()]
                for file in files:
                    self.assertEqual((theirs / file).read_bytes(), (result.folder / file).read_bytes())
                written = json.loads((result.folder / "summary.json").read_text())
                self.assertEqual(written["checks"], result.checks)
                self.assertEqual(json.loads((theirs / "summary.json").read_text())["checks"], result.checks)
                self.assertLessEqual(result.worst["value"], result.worst["limit"])
                self.assertIn("AGREE", result._repr_html_())
                if "traces.csv" in files:
                    for drive in result.summary["drives"]:
                        self.assertIn(f"{drive}.force.simulated", list(result.traces))

    def test_traces_are_a_data_frame(self):
        if not importlib.util.find_spec("pandas"):
            self.skipTest("python3-pandas is not installed")
        result = mbverify.run("four_bar/static")
        frame = result.to_pandas()
        self.assertEqual(frame.index.name, "time_s")
        np.testing.assert_array_equal(
            frame["motor.force.reference"], result.traces["motor.force.reference"]
        )

    def test_a_study_is_the_programs(self):
        study = SOURCE / "scenarios" / "spr_tripod" / "study_one_at_a_time.yaml"
        result = mbverify.study(study, jobs=2)
        self.assertEqual(result.summary["points"], 9)
        self.assertTrue(result.quantities)
        self.assertTrue((result.folder / "points.csv").is_file())
        with self.assertRaises(mbverify.InputError):
            mbverify.study(study, count=-1)

    def test_a_workspace_is_the_programs(self):
        result = mbverify.workspace(
            "friction_five_bar", {"x_mm": (-200, 200), "y_mm": (150, 500)}, resolution=40, jobs=2
        )
        self.assertTrue(result.agrees)
        self.assertEqual(result.coordinates, ["tool.x", "tool.y"])
        value, error = result.measure
        # A mean over the lattice's poses, as the program has it; the area by its boundary's nodes.
        cells, condition = result.cells, result.quality["condition"]
        inside = cells["inside"] == 1
        self.assertAlmostEqual(np.nanmean(cells["condition"][inside]), condition["mean"], delta=1e-6)
        self.assertNotAlmostEqual(
            np.nanmean(1.001 * cells["condition"][inside]), condition["mean"], delta=1e-6
        )
        x, y = result.boundary["tool.x_m"], result.boundary["tool.y_m"]
        self.assertAlmostEqual(x.max(), 0.2, delta=1e-11)
        self.assertIn("box tool.x = 0.2", result.boundary["bound"])
        area = 0.5 * abs(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))
        self.assertAlmostEqual(area, value, delta=5e-3 * value)
        self.assertLess(error, 1e-6 * value)
        some = mbverify.workspace("spr_tripod", ["x"], at={"y": 0}, for_some={"z_mm": (560, 580)})
        self.assertGreater(some.measure[0], 0.1)
        with self.assertRaises(mbverify.InputError):
            mbverify.workspace("four_bar", ["x", "qq"])

    def test_the_best_design_is_the_programs(self):
        result = mbverify.best_design(
            "friction_five_bar",
            ["x", "y"],
            {"upper_mm": (230, 260)},
            evaluations=8,
            resolution=60,
            jobs=2,
        )
        self.assertTrue(result.agrees)
        value, error = result.measure
        traced = np.array(result.designs["way"]) == "boundary"
        areas = result.designs["measure"][traced]
        self.assertAlmostEqual(areas.max(), value, delta=1e-6 * value)
        upper = result.parameters["upper"]
        self.assertTrue(0.23 <= upper <= 0.26)
        # The set of this design, and of one beside it.
        own = mbverify.workspace("friction_five_bar", ["x", "y"], set=result.parameters, resolution=60)
        self.assertAlmostEqual(own.measure[0], value, delta=1e-6 * value)
        beside = mbverify.workspace(
            "friction_five_bar", ["x", "y"], set={"upper": upper - 0.005}, resolution=60
        )
        self.assertLess(beside.measure[0], value - error)
        with self.assertRaises(mbverify.InputError):
            mbverify.best_design("friction_five_bar", ["x", "y"], {"uper": (0.2, 0.3)})

    def test_a_workspaces_surface_is_closed(self):
        result = mbverify.workspace(
            "spr_tripod",
            {"x_mm": (-20, 20), "y_mm": (-20, 20), "z_mm": (560, 600)},
            resolution=12,
        )
        vertices, triangles = result.surface
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
        flooded = result.summary["set"]["flooded"]
        self.assertAlmostEqual(volume, flooded["value"], delta=1e-6 * 6.4e-5)
        self.assertAlmostEqual(volume, 6.4e-5, delta=flooded["error"])
        self.assertLess(flooded["error"], 0.1 * 6.4e-5)

    def test_derivatives_are_those_of_the_solver(self):
        result = mbverify.linearise("stewart", at={"leg1.length_mm": 620}, rates={"leg2.length": 0.3})
        self.assertTrue(result.agrees)
        self.assertEqual(len(result.frequencies), result.shapes.shape[1])
        summary = result.summary
        solver = mbverify.load("stewart").solver(result.coordinates)
        q, v, a = (np.array(summary[key]) for key in ("position", "rate", "acceleration"))
        for name, matrix in zip(("f_q", "f_v", "f_a"), solver.force_derivatives(q, v, a)):
            scale = np.abs(matrix).max()
            self.assertLess(np.abs(result.matrix(name) - matrix).max(), 1e-9 * scale)
        # A difference of forces, and what a wrong one would be.
        h = 1e-5 * np.eye(len(q))[2]
        force = lambda at: np.array(solver.mass_matrix(at) @ a + solver.bias(at, v))
        slope = (force(q + h) - force(q - h)) / 2e-5
        mine = result.matrix("f_q")[:, 2]
        self.assertLess(np.abs(slope - mine).max(), 1e-6 * np.abs(mine).max())
        self.assertGreater(np.abs(slope - 1.001 * mine).max(), 1e-6 * np.abs(mine).max())
        with self.assertRaises(mbverify.InputError):
            mbverify.linearise("stewart", at={"leg9": 1})

    def test_derivatives_of_forces_have_a_row_per_channel(self):
        result = mbverify.linearise("spr_tripod/tool_load", time=0.5, data=["mat"])
        self.assertTrue(result.agrees)
        self.assertTrue((result.folder / "linearise.mat").is_file())
        channels = result.force_channels
        drives = [f"{name}.force" for name in result.summary["drives"]]
        self.assertEqual(channels[-len(drives) :], drives)
        self.assertIn(".reaction.", channels[0])
        forces = result.matrix("force_q")
        self.assertEqual(forces.shape, (len(channels), len(result.coordinates)))
        # Drives are the coordinates: their forces' derivatives are those of f.
        f_q = result.matrix("f_q")
        self.assertLess(np.abs(forces[-len(drives) :] - f_q).max(), 1e-9 * np.abs(f_q).max())

    def test_a_wrong_number_is_a_verdict(self):
        result = mbverify.run("four_bar/static", set={"simulation.parameters": "{rho: 2.1}"})
        self.assertEqual(result.verdict, "disagree")
        self.assertFalse(result.passed)
        self.assertGreater(result.worst["value"], result.worst["limit"])

    def test_bad_input_is_an_exception(self):
        with self.assertRaises(mbverify.InputError) as raised:
            mbverify.run("four_bar/static", set={"motion.duratoin_s": 1})
        self.assertTrue(raised.exception.findings)
        self.assertIn("duration_s", str(raised.exception))
        with self.assertRaises(mbverify.InputError):
            mbverify.run("no_such/scenario")

    def test_what_cannot_run_is_a_result(self):
        scenario = SOURCE / "scenarios" / "four_bar" / "must_fail"
        found = [f for f in sorted(scenario.glob("*.yaml")) if "not_run" in f.read_text()]
        self.assertTrue(found)
        self.assertEqual(mbverify.run(found[0]).verdict, "not_run")

    def test_a_results_files_live_as_long_as_it(self):
        result = mbverify.run("four_bar/static")
        folder = result.folder
        self.assertTrue((folder / "report.html").is_file())
        del result
        gc.collect()
        self.assertFalse(folder.exists())

    def test_a_card_shows_verdict_checks_and_forces(self):
        result = mbverify.run("stewart/wave")
        card = result._repr_html_()
        self.assertIn("AGREE", card)
        for check in result.checks:
            self.assertIn(check["name"], card)
        drawn = re.search("data:image/png;base64,([^']*)'", card)
        width, height = struct.unpack(">II", base64.b64decode(drawn.group(1))[16:24])
        self.assertGreater(min(width, height), 200)
        other = mbverify.run("stewart/wave", set={"parameters": "{m_platform: 14}"})._repr_html_()
        self.assertNotEqual(re.search("base64,([^']*)'", other).group(1), drawn.group(1))
        # Where nothing ran, there is nothing to draw.
        stopped = mbverify.run("four_bar/must_fail/out_of_reach")
        self.assertEqual(stopped.verdict, "not_run")
        self.assertNotIn("<img", stopped._repr_html_())

    def test_audit_gives_each_equation(self):
        document = mbverify.audit("spr_tripod")
        self.assertEqual(document["schema"].split("/")[0], "mbverify.audit")

    def test_figures_are_files(self):
        with tempfile.TemporaryDirectory() as folder:
            files = mbverify.figures("four_bar/static", out=folder, formats=("svg",))
            self.assertTrue(files)
            for file in files:
                self.assertTrue(file.is_file(), file)

    def test_a_program_that_is_killed_is_an_exception(self):
        with tempfile.TemporaryDirectory() as folder:
            fake = pathlib.Path(folder) / "mbverify"
            fake.write_text("#!/bin/sh\nkill -9 $$\n")
            fake.chmod(0o755)
            os.environ["MBVERIFY"] = str(fake)
            try:
                with self.assertRaises(mbverify.ProgramError) as raised:
                    mbverify.run("four_bar/static")
            finally:
                del os.environ["MBVERIFY"]
            self.assertIn("signal 9", str(raised.exception))


class Wheel(unittest.TestCase):
    def test_brings_program_and_models(self):
        """Installed elsewhere it runs its own program on its own models."""
        if not importlib.util.find_spec("pip"):
            self.skipTest("python3-pip is not installed")
        build = pathlib.Path(mbverify.__file__).parents[2]
        wheel = subprocess.run(
            [sys.executable, SOURCE / "scripts" / "wheel", build],
            capture_output=True, text=True, check=True,
        ).stdout.strip()
        asks = (
            "import mbverify, os; print(mbverify.program()); print(os.path.abspath(mbverify.load('stewart').file));"
            "print(mbverify.run('four_bar/static').verdict)"
        )
        with tempfile.TemporaryDirectory() as prefix:
            subprocess.run(
                [sys.executable, "-m", "pip", "install", "-q", "--no-index", "--no-deps",
                 "--break-system-packages", "--prefix", prefix, wheel],
                capture_output=True, check=True,
            )
            site = next(pathlib.Path(prefix).rglob("mbverify/_program.py")).parents[1]
            said = subprocess.run(
                [sys.executable, "-c", asks], env={"PYTHONPATH": str(site), "PATH": "/usr/bin:/bin"},
                cwd="/", capture_output=True, text=True, check=True,
            ).stdout.splitlines()
            self.assertTrue(said[0].startswith(prefix), said)
            self.assertTrue(said[1].startswith(prefix), said)
            self.assertEqual(said[2], "agree")


if __name__ == "__main__":
    unittest.main()
