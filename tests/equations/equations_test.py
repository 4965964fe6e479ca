"""Functions that differentiate, against differences and identities."""

import importlib.util
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2] / "src" / "equations" / "equations.py"
SPEC = importlib.util.spec_from_file_location("equations", SOURCE)
eq = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(eq)


def differences(function, x, h=1e-4):
    """First and second derivative by central differences of fourth order."""
    f = [function(x + k * h) for k in (-2, -1, 0, 1, 2)]
    first = (f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h)
    second = (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h * h)
    return first, second


FUNCTIONS = {
    "sin": eq.sin,
    "cos": eq.cos,
    "tan": eq.tan,
    "sqrt": eq.sqrt,
    "exp": eq.exp,
    "log": eq.log,
    "sinh": eq.sinh,
    "cosh": eq.cosh,
    "tanh": eq.tanh,
    "atan": eq.atan,
    "asin": eq.asin,
    "acos": eq.acos,
    "square": lambda x: x**2,
    "cube": lambda x: x**3,
    "inverse square": lambda x: x**-2,
    "root": lambda x: x**0.5,
    "odd power": lambda x: x**1.7,
    "power of it": lambda x: 2.0**x,
    "power by itself": lambda x: x**x,
    "quotient": lambda x: (1 + x) / (2 - x * x),
    "one over": lambda x: 3 / x,
    "difference": lambda x: 3 - x,
    "atan2": lambda x: eq.atan2(x, 1 - 2 * x),
    "atan2 behind": lambda x: eq.atan2(-x, x - 2),
    "atan2 steep": lambda x: eq.atan2(1 + x, 0.1 * x),
    "hypot": lambda x: eq.hypot(x, 1 - x),
    "abs": lambda x: abs(x - 2),
}


class Derivatives(unittest.TestCase):
    def test_of_functions(self):
        for name, function in FUNCTIONS.items():
            for x in (0.3, 0.55, 0.8):
                first, second = differences(function, x)
                s = function(eq.Series(x, 1.0, 0.0))
                with self.subTest(name, x=x):
                    self.assertAlmostEqual(s.a, function(x), delta=4e-16 * max(1, abs(s.a)) * 4)
                    self.assertAlmostEqual(s.b, first, delta=1e-9 * max(1, abs(first)))
                    self.assertAlmostEqual(2 * s.c, second, delta=1e-6 * max(1, abs(second)))

    def test_of_time(self):
        # q moves with rate and acceleration: the chain rule of both orders.
        q, qd, qdd = 0.4, -1.7, 2.3
        value, rate, acceleration = eq.motion(lambda x: eq.sin(x) * x, [q], [qd], [qdd])
        self.assertAlmostEqual(rate, (math.cos(q) * q + math.sin(q)) * qd, delta=1e-14)
        second = 2 * math.cos(q) - q * math.sin(q)
        first = math.cos(q) * q + math.sin(q)
        self.assertAlmostEqual(acceleration, second * qd * qd + first * qdd, delta=1e-14)

    def test_nested(self):
        # The motion of a derivative: no mixing of the two variables.
        def slope(x):
            return eq.jacobian(lambda y: y**3 + x * y, [x])[0][0]  # 3 x² + x

        value, rate, acceleration = eq.motion(slope, [0.5], [2.0], [1.0])
        self.assertAlmostEqual(value, 1.25, delta=1e-15)
        self.assertAlmostEqual(rate, (6 * 0.5 + 1) * 2.0, delta=1e-14)
        self.assertAlmostEqual(acceleration, 6 * 4.0 + (6 * 0.5 + 1) * 1.0, delta=1e-14)

    def test_of_a_root(self):
        # x³ + a x = 1: x' and x'' by a.
        def root(a):
            return eq.solve(lambda x: [x**3 + a * x - 1], [0.5])[0]

        for a in (0.7, 2.0):
            first, second = differences(lambda v: float(root(v)), a, 1e-3)
            s = root(eq.Series(a, 1.0, 0.0))
            self.assertAlmostEqual(s.a**3 + a * s.a, 1.0, delta=1e-15)
            self.assertAlmostEqual(s.b, first, delta=1e-10)
            self.assertAlmostEqual(2 * s.c, second, delta=1e-7)

    def test_a_root_is_not_kept_for_other_numbers(self):
        # The same function and start, a slightly different root.
        def root(a):
            return eq.solve(lambda x: [x * x - a], [1.0])[0]

        for a in (2.0, 2.0, 2.0 + 1e-13, 2.0 + 1e-12, 3.0, 2.0):
            self.assertAlmostEqual(root(a), math.sqrt(a), delta=5e-16)
        s = root(eq.Series(2.0, 1.0, 0.0))
        self.assertAlmostEqual(s.b, 0.5 / math.sqrt(2), delta=1e-15)

    def test_of_a_turning_frame(self):
        def R(a, b):
            return eq.rot_z(a) @ eq.rot_x(b)

        q, qd, qdd = [0.3, -0.8], [1.1, 0.7], [-0.4, 2.0]
        value, rate, acceleration = eq.motion(R, q, qd, qdd)
        omega = eq.vee(rate @ value.T)
        expected = eq.Vec(0, 0, qd[0]) + eq.rot_z(q[0]) @ eq.Vec(qd[1], 0, 0)
        for a, b in zip(omega, expected):
            self.assertAlmostEqual(a, b, delta=1e-15)
        alpha = eq.vee(acceleration @ value.T)
        h = 1e-5
        for k in range(3):
            at = []
            for t in (-h, h):
                moved = [a + b * t + 0.5 * c * t * t for a, b, c in zip(q, qd, qdd)]
                rates = [b + c * t for b, c in zip(qd, qdd)]
                v, r, _ = eq.motion(R, moved, rates, qdd)
                at.append(eq.vee(r @ v.T)[k])
            self.assertAlmostEqual(alpha[k], (at[1] - at[0]) / (2 * h), delta=1e-8)


class Vectors(unittest.TestCase):
    def test_algebra(self):
        random.seed(3)
        a, b, c = (eq.Vec([random.gauss(0, 1) for _ in range(3)]) for _ in range(3))
        self.assertAlmostEqual(a @ (b.cross(c)), b @ (c.cross(a)), delta=1e-14)
        for x, y in zip(eq.skew(a) @ b, a.cross(b)):
            self.assertAlmostEqual(x, y, delta=1e-15)
        A = eq.Mat([list(a), list(b), list(c)])
        for x, y in zip(A @ eq.linear_solve(A, eq.Vec(1, 2, 3)), (1, 2, 3)):
            self.assertAlmostEqual(x, y, delta=1e-13)
        self.assertEqual((A @ eq.identity()).T.T, A)
        self.assertEqual(eq.vee(eq.skew(a)), a)

    def test_wrong_shapes_are_refused(self):
        for wrong in (
            lambda: eq.Vec(1, 2) + eq.Vec(1, 2, 3),
            lambda: eq.Vec(1, 2) * eq.Vec(1, 2),
            lambda: eq.identity(2) @ eq.Vec(1, 2, 3),
            lambda: math.sin(eq.Series(1.0, 1.0, 0.0)),
        ):
            with self.assertRaises(TypeError):
                wrong()
        with self.assertRaises(eq.DomainError):
            eq.sqrt(-1.0)
        with self.assertRaises(eq.Unreachable):
            eq.solve(lambda x: [x * x + 1], [1.0])
        with self.assertRaises(ZeroDivisionError):
            eq.sqrt(eq.Series(0.0, 1.0, 0.0))


class Calls(unittest.TestCase):
    """The program's side, over pipes as mbverify uses it."""

    def answers(self, text, *calls):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "my.py"
            path.write_text(text)
            done = subprocess.run(
                [sys.executable, "-B", SOURCE, path],
                input="".join(json.dumps(call) + "\n" for call in calls),
                capture_output=True,
                text=True,
                timeout=30,
                check=True,
            )
        return [json.loads(line) for line in done.stdout.splitlines()]

    FILE = """
from mbverify.equations import closed_form, output, sin
print("noise")

@closed_form("arm", commands=["motor"])
def drives(p, theta):
    return [p.ratio * sin(theta)]

@closed_form.forces
def forces(p, q, qd, qdd, load):
    return [p.mass * qdd.theta + sum(l.force[0] for l in load)]

@output("tip.x", "m")
def tip(p, theta):
    return p.wrong
"""

    def test_a_sample(self):
        loads = [{"name": "a", "body": "b", "axes": "world", "point": [0, 0, 0],
                  "force": [7, 0, 0], "moment": [0, 0, 0]}]
        text = self.FILE.replace("p.wrong", "p.mass * theta")
        info, _, sample, read = self.answers(
            text,
            {"do": "load"},
            {"do": "set", "parameters": {"ratio": 2.0, "mass": 3.0, "unread": 1.0}},
            {"do": "sample", "form": 0, "q": [0.5], "qd": [0.25], "qdd": [4.0], "load": loads},
            {"do": "read"},
        )
        self.assertEqual(info["forms"][0]["commands"], ["motor"])
        self.assertEqual(info["forms"][0]["line"], 5)
        self.assertTrue(info["forms"][0]["takes_loads"])
        a, b, c = sample["values"][0]
        self.assertEqual(a, 2 * math.sin(0.5))
        self.assertEqual(b, 2 * math.cos(0.5) * 0.25)
        self.assertAlmostEqual(2 * c, 2 * (math.cos(0.5) * 4 - math.sin(0.5) / 16), delta=1e-14)
        self.assertEqual(sample["forces"], [19.0])
        self.assertEqual(sample["outputs"], [[1.5, 0.75, 6.0]])
        self.assertEqual(read["names"], ["mass", "ratio"])

    def test_edited_closed_forms(self):
        text = self.FILE.replace("p.wrong", "p.mass * theta")
        rows = [{"q": [0.5], "qd": [0.25], "qdd": [4.0], "load": []}]

        def edited(source, part):
            kept = rows if part == "forces" else [
                {k: v for k, v in row.items() if k != "load"} for row in rows]
            return {"do": "try_form", "source": source, "form": 0, "part": part, "rows": kept,
                    "drives": ["motor"]}

        given = self.answers(
            text,
            {"do": "load"},
            {"do": "set", "parameters": {"ratio": 2.0, "mass": 3.0}},
            edited(text.replace("p.ratio * sin", "-p.ratio * sin"), "drives"),
            edited(text.replace("[p.mass * qdd.theta", "[2 * p.mass * qdd.theta"), "forces"),
            edited(text.replace("[p.mass", "{'motor': p.mass * 5} or [p.mass"), "forces"),
            edited(text.replace("p.mass * qdd", "nothing"), "forces"),
            {"do": "drives", "form": 0, "q": [0.5], "qd": [0.25], "qdd": [4.0]},
        )
        self.assertEqual(given[2], {"rows": [[-2 * math.sin(0.5)]]})
        self.assertEqual(given[3], {"rows": [[24.0]]})
        self.assertEqual(given[4], {"rows": [[15.0]]})
        self.assertIn("NameError", given[5]["failed"])
        self.assertEqual(given[6]["values"][0][0], 2 * math.sin(0.5))

    def test_errors_have_a_place(self):
        _, _, sample = self.answers(
            self.FILE,
            {"do": "load"},
            {"do": "set", "parameters": {"ratio": 2.0, "mass": 3.0}},
            {"do": "sample", "form": 0, "q": [0.5], "qd": [0.25], "qdd": [4.0]},
        )
        self.assertEqual(sample["error"]["line"], 15)
        self.assertEqual(sample["error"]["function"], "tip")
        self.assertIn("no parameter 'wrong'", sample["error"]["message"])
        for text, kind, words in (
            ("def f(:\n", "exception", "SyntaxError"),
            ("import no_such_module\n", "exception", "ModuleNotFoundError"),
            ("raise SystemExit(3)\n", "exception", "SystemExit"),
            ("x = input()\n", "exception", "EOFError"),
            ("import os\nif not os.read(0, 10): raise ValueError('nothing')\n", "exception",
             "nothing"),
            ("import mbverify\nmbverify.load('stewart')\n", "exception", "AttributeError"),
        ):
            (answer,) = self.answers(text, {"do": "load"})
            self.assertEqual(answer["error"]["kind"], kind)
            self.assertIn(words, answer["error"]["message"])
            self.assertGreater(answer["error"]["line"], 0)


if __name__ == "__main__":
    unittest.main()
