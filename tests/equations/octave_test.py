"""Octave functions that differentiate, against differences and against the Python host."""

import json
import math
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import unittest

SOURCES = pathlib.Path(__file__).resolve().parents[2] / "src" / "equations"
OCTAVE = shutil.which("octave-cli")


def quoted(text):
    return "'" + str(text).replace("'", "''") + "'"


def answers(name, text, *calls, beside=None):
    """The host's answers about a file of that name and text, and what it printed."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / f"{name}.m"
        path.write_text(text, encoding="utf-8")
        for other, content in (beside or {}).items():
            (pathlib.Path(folder) / other).write_text(content, encoding="utf-8")
        with tempfile.TemporaryFile("w+", encoding="utf-8") as printed:
            host = subprocess.Popen(
                [OCTAVE, "--norc", "--quiet", "--no-history", "--no-gui", "--eval",
                 f"addpath({quoted(SOURCES / 'octave')}); mbverify_host({quoted(path)})"],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=printed, encoding="utf-8",
            )
            # Each call waits for the answer to the one before, as the program does.
            alarm = threading.Timer(120, host.kill)
            alarm.start()
            given = []
            for call in calls:
                host.stdin.write(json.dumps(call) + "\n")
                host.stdin.flush()
                line = host.stdout.readline()
                if not line:
                    break
                given.append(json.loads(line))
            host.stdin.close()
            rest = host.stdout.read()
            status = host.wait()
            host.stdout.close()
            alarm.cancel()
            printed.seek(0)
            errors = printed.read()
    if len(given) != len(calls) or status != 0 or rest:
        raise AssertionError(f"{len(given)} answers to {len(calls)} calls, {status}: {errors}")
    return given, errors


def python_answers(text, *calls):
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "my.py"
        path.write_text(text, encoding="utf-8")
        done = subprocess.run(
            [sys.executable, "-B", SOURCES / "equations.py", path],
            input="".join(json.dumps(call) + "\n" for call in calls),
            capture_output=True, text=True, timeout=60, check=True,
        )
    return [json.loads(line) for line in done.stdout.splitlines()]


# Each a function of one number, and what it is in Octave.
FUNCTIONS = [
    "sin(x)", "cos(x)", "tan(x)", "sqrt(x)", "exp(x)", "log(x)", "sinh(x)", "cosh(x)", "tanh(x)",
    "atan(x)", "asin(x)", "acos(x)", "log10(x)", "log2(x)", "asinh(x)", "acosh(1 + x)", "atanh(x)",
    "sec(x)", "csc(x)", "cot(x)", "sind(40*x)", "cosd(40*x)", "tand(40*x)", "deg2rad(x)",
    "x^2", "x^3", "x^0 * x", "x.^-2", "x^0.5", "x.^1.7", "2^x", "x^x", "x.^[1.5 2.5] * [1; 2]",
    "(1 + x)/(2 - x*x)", "3/x", "3\\x", "x\\3", "3 - x", "-x + (+x)*2", "x/4", "x./(1 + x)",
    "atan2(x, 1 - 2*x)", "atan2(-x, x - 2)", "atan2(1 + x, 0.1*x)", "atan2(x, 2)", "atan2(2, x)",
    "hypot(x, 1 - x)", "hypot(x, 2)", "abs(x - 2)", "max(x, 0.5)*2", "min(x, 0.5) + x",
    "mod(7*x, 1)", "rem(-7*x, 1)", "real(exp(1i*x))", "imag(exp(2i*x)*x)", "abs(1 + exp(1i*x))",
    "angle(2 + exp(1i*x))",
    "norm([x; 2; x^2])", "norm([x, 1])^2", "sum([x, x^2, 3])", "sum(sum([x 1; 2 x^2]))",
    "prod([x; 2; x])", "mean([x, x^2])", "sumsq([x; 2])", "dot([x; 1; 2], [3; x; x])",
    "dot([1 2 3], [x; x^2; 1])", "cross([1; x; 2], [x; 3; x^2])(2)", "cross([1 2 3], [x x x^2])(1)",
    "cross([x x x^2], [1 2 3])(3)", "[x; 2; 3]' * [1 2 x; 3 x 4; 5 6 7] * [1; x; 1]",
    "sum([x 1; 2 x] \\ [1; x])", "[1 0] * ([2 x; x 3] \\ [1; x])",
    "[1 0] * ([2 1; 1 3] \\ [1; x])", "[1 0] * ([2 x; x 3] \\ [1; 2])",
    "[1 x] / [2 x; x 3] * [1; 1]", "det([x 1; 2 x^2])", "det([x 1 2; 3 x 4; 5 6 x])",
    "det([x 1 2 0; 3 x 4 1; 5 6 x 2; 1 2 3 x])", "trace(inv([2 x; x^2 3]))",
    "trace([x 1; 2 3]^3)", "trace([3 x; x 2]^-2)",
    "[1 0] * ([1 x; x 2; 3 4] \\ [1; x; 2])", "norm([1 x 2; x 2 3] \\ [1; x])",
    "sum(diag([x; x^2])(:))", "sum(repmat(x, 1, 3))", "sum(kron([1 x], [x; 2])(:))",
    "reshape([x 1; 2 x^2], 4, 1)(4)", "[x 1; 2 x^2](2, 2)", "[x, x^2, 5](end - 1)",
    "[x, x^2; 5, x^3](:, end)' * [1; 2]", "transpose([x; 1])(1)", "filled(x)", "grown(x)",
    "in_zeros(x)", "in_eye(x)", "swapped(x)", "shorter(x)", "branch(x)", "held(x)", "applied(x)",
    "cumsum([x; x^2])(2)", "norm([x 1; 2 x], 'fro')", "norm(zeros(3, 1)) + x",
    "mbverify_value(x) * 0 + x", "realsqrt(x) + reallog(x) + realpow(x, 2)", "[x; 1](:)' * [1; 2]",
    "trace(blkdiag(x, [x 1; 2 x]))", "size([x x; x x], 1) * x + numel([x x]) + length([x; 1; 1])",
]

HELPERS = """
function s = filled(x), v(2) = x; v(3) = x^2; s = sum(v); end
function s = grown(x), v = x; v(end + 1) = x^2; v = [v, 1]; s = v * v'; end
function s = in_zeros(x), v = zeros(3, 1); v(1) = x; v(3) = x^2; s = v' * [1; 2; 3]; end
function s = in_eye(x)
  R = eye(3); R(1:2, 1:2) = [cos(x), -sin(x); sin(x), cos(x)]; s = [1 1 1] * R * [1; 2; 3];
end
function s = swapped(x), v = [x; x^2; 1]; v([1 2]) = v([2 1]); v(3) = 5; s = v' * [1; 2; 3]; end
function s = shorter(x), v = [x; x^2; x^3]; v(2) = []; s = v(1) * 2 + v(2); end
function s = branch(x), if x < 0.5 && ~(x == 7), s = x^2; else, s = x^3; end, end
function s = held(x), c = {x, 2}; t.a = c{1} * [1; 2]; s = t.a(2) * c{2}; end
function s = applied(x), f = @(y) x * y^2; s = f(x); end
"""


@unittest.skipUnless(OCTAVE, "there is no octave-cli")
class Derivatives(unittest.TestCase):
    """One file whose drives are the functions."""

    def drives(self, functions, points, helpers=HELPERS):
        body = "; ...\n".join(f"    one(@() {f})" for f in functions)
        text = ("function eq = my_functions()\n  eq.mechanism = 'm';\n  eq.drives = @drives;\nend\n"
                f"function d = drives(p, x)\n  d = [ ...\n{body}];\nend\n"
                "function y = one(f), y = f(); end\n" + helpers)
        calls = [{"do": "load"}, {"do": "set", "parameters": {}}]
        calls += [{"do": "drives", "form": 0, "q": [x], "qd": [qd], "qdd": [qdd]}
                  for x, qd, qdd in points]
        given, _ = answers("my_functions", text, *calls)
        for answer in given:
            self.assertNotIn("error", answer)
        return [answer["values"] for answer in given[2:]]

    def test_of_functions(self):
        h = 1e-4
        middles = (0.3, 0.55, 0.8)
        points = [(x + k * h, 1.0, 0.0) for x in middles for k in (-2, -1, 0, 1, 2)]
        given = self.drives(FUNCTIONS, points)
        self.assertEqual(len(given[0]), len(FUNCTIONS))
        for m, x in enumerate(middles):
            for i, name in enumerate(FUNCTIONS):
                f = [given[5 * m + k][i][0] for k in range(5)]
                first = (f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h)
                second = (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h * h)
                _, b, c = given[5 * m + 2][i]
                with self.subTest(name, x=x):
                    size = max(1, abs(f[2]), abs(first), abs(second))
                    self.assertAlmostEqual(b, first, delta=1e-10 * size)
                    self.assertAlmostEqual(2 * c, second, delta=3e-6 * size)

    def test_of_time(self):
        # The chain rule of both orders: the functions along q(t) with rate and acceleration.
        rate, acceleration = -1.7, 2.3
        slope, along = self.drives(FUNCTIONS, [(0.4, 1.0, 0.0), (0.4, rate, acceleration)])
        for name, s, a in zip(FUNCTIONS, slope, along):
            with self.subTest(name):
                size = 1e-13 * max(1, *map(abs, s), *map(abs, a))
                self.assertAlmostEqual(a[0], s[0], delta=size)
                self.assertAlmostEqual(a[1], s[1] * rate, delta=size)
                expected = s[2] * rate * rate + 0.5 * s[1] * acceleration
                self.assertAlmostEqual(a[2], expected, delta=10 * size)

    def test_of_several_variables(self):
        # Value, rate, acceleration and both columns of the derivatives of f(u v), taken together.
        body = "; ...\n".join(f"    one(@() {f})" for f in FUNCTIONS)
        text = ("function eq = my_functions()\n  eq.mechanism = 'm';\n"
                "  eq.drives = @(p, x) all_of(x);\n  eq.forces = @forces;\nend\n"
                "function f = forces(p, q, qd, qdd)\n"
                "  g = @(u, v) all_of(u * v);\n  at = [2; q / 2];\n"
                "  [a, b, c, J] = mbverify_motion(g, at, [qd; 0.25], [0; qdd]);\n"
                "  K = mbverify_jacobian(g, at);\n"
                "  f = [a, b, c, J, K];\nend\n"
                f"function d = all_of(x)\n  d = [ ...\n{body}];\nend\n"
                "function y = one(f), y = f(); end\n" + HELPERS)
        x, qd, qdd = 0.4, 1.5, -0.7
        state = {"do": "sample", "form": 0, "q": [x], "qd": [qd], "qdd": [qdd]}
        slope = {"do": "drives", "form": 0, "q": [x], "qd": [1.0], "qdd": [0.0]}
        (_, _, sample, slopes), _ = answers(
            "my_functions", text, {"do": "load"}, {"do": "set", "parameters": {}}, state, slope)
        self.assertNotIn("error", sample)
        u, v = 2, x / 2
        rate, second = qd * v + 0.25 * u, 2 * qd * 0.25 + u * qdd
        for k, name in enumerate(FUNCTIONS):
            f, f1, half = slopes["values"][k]
            given = sample["forces"][7 * k : 7 * k + 7]
            expected = [f, f1 * rate, 2 * half * rate**2 + f1 * second, f1 * v, f1 * u, f1 * v, f1 * u]
            with self.subTest(name):
                size = 1e-12 * max(1, *map(abs, expected))
                for a, b in zip(given, expected):
                    self.assertAlmostEqual(a, b, delta=size)

    def test_nested(self):
        helpers = """
function s = slope(x), s = mbverify_jacobian(@(y) y^3 + x*y, x); end
function s = slopes(x)
  J = mbverify_jacobian(@(a, b) [a*b*x; sin(a) + x^2], [x; 2]);
  s = [1 2] * J * [3; 4];
end
function s = whole(x), s = sum(mbverify_jacobian(@(v) v' * v * x, [x; 1; x])); end
function s = second(x)
  s = mbverify_jacobian(@(y) mbverify_jacobian(@(z) z^4 * y, y), x);
end
function s = inner(x)
  [a, b, c] = mbverify_motion(@(u) x * u^3, x, 2, 3);
  s = a + b + c;
end
function s = filled(x)
  function v = two(y), v = zeros(2, 1); v(1) = x*y^2; v(2) = 3*y; end
  s = sum(mbverify_jacobian(@(y) two(y), x));
end
function s = two(y, x), s = zeros(2, 1); s(1) = x*y^2; s(2) = 3*y; end
function s = constant(x), s = sum(mbverify_jacobian(@(y) [1; 2], x)) + x; end
function s = root(x), s = mbverify_solve(@(y) y^3 + x*y - 1, 0.5); end
function s = roots2(x)
  y = mbverify_solve(@(a, b) [a^2 + b^2 - 4*x; a - b*x], [1; 1]); s = y(1) + 2*y(2);
end
function s = motions(x)
  [a, b, c, J] = mbverify_motion(@(u, v) [u * v * x; v^2], [x; 2], [1; 0], [0; 0]);
  s = [1 1] * (a + b + c + J * [1; 1]);
end
function s = deep(x)
  s = mbverify_jacobian(@(u) mbverify_solve(@(y) y^3 + u*y - 1, 0.5), x);
end
"""
        helpers = helpers.replace(
            "  function v = two(y), v = zeros(2, 1); v(1) = x*y^2; v(2) = 3*y; end\n", ""
        ).replace("@(y) two(y), x", "@(y) two(y, x), x")
        # In sympy's terms: value, first and second derivative by x.
        x = 0.5
        r = 0.7
        y = 0.5
        for _ in range(60):
            y -= (y**3 + r * y - 1) / (3 * y * y + r)
        d = 3 * y * y + r
        y1 = -y / d
        y2 = -(2 * y1 + 6 * y * y1 * y1) / d
        y3 = -(3 * y2 + 18 * y * y1 * y2 + 6 * y1**3) / d
        expected = {
            "slope(x)": (3 * x * x + x, 6 * x + 1, 6),
            # J = [2x, x²; cos x, 0]
            "slopes(x)": (6 * x + 4 * x * x + 6 * math.cos(x), 6 + 8 * x - 6 * math.sin(x),
                          8 - 6 * math.cos(x)),
            "whole(x)": (4 * x * x + 2 * x, 8 * x + 2, 8),
            "second(x)": (16 * x**3, 48 * x * x, 96 * x),  # d/dy (4 y³ y)
            # x u³ at u = x: x⁴, 3x³·2, and 3x³·3 + 6x²·4
            "inner(x)": (x**4 + 15 * x**3 + 24 * x * x, 4 * x**3 + 45 * x * x + 48 * x,
                         12 * x * x + 90 * x + 48),
            "filled(x)": (2 * x * x + 3, 4 * x, 4),
            "constant(x)": (x, 1, 0),
            # 2x² + 4, then 2x, 0, and [2x, x²; 0, 4] [1; 1]
            "motions(x)": (3 * x * x + 4 * x + 8, 6 * x + 4, 6),
            "roots2(x)": None,
        }
        (given,) = self.drives(list(expected), [(x, 1.0, 0.0)], helpers)
        for (name, values), (a, b, c) in zip(expected.items(), given):
            if values is None:
                continue
            with self.subTest(name):
                self.assertAlmostEqual(a, values[0], delta=1e-14 * 20)
                self.assertAlmostEqual(b, values[1], delta=1e-14 * 100)
                self.assertAlmostEqual(2 * c, values[2], delta=1e-14 * 400)
        (given,) = self.drives(["root(x)", "deep(x)"], [(r, 1.0, 0.0)], helpers)
        for (a, b, c), values in zip(given, ((y, y1, y2), (y1, y2, y3))):
            self.assertAlmostEqual(a, values[0], delta=1e-14)
            self.assertAlmostEqual(b, values[1], delta=1e-14)
            self.assertAlmostEqual(2 * c, values[2], delta=1e-13)
        h = 1e-3
        points = [(r + k * h, 1.0, 0.0) for k in (-2, -1, 0, 1, 2)]
        given = self.drives(["roots2(x)"], points, helpers)
        f = [values[0][0] for values in given]
        _, b, c = given[2][0]
        self.assertAlmostEqual(b, (f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h), delta=1e-10)
        self.assertAlmostEqual(
            2 * c, (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h * h), delta=1e-7)


OCTAVE_FILE = """function eq = my_arm()
  disp('noise');
  eq.mechanism = 'arm';
  eq.commands = {'motor', 'slide'};
  eq.drives = @drives;
  eq.forces = @forces;
  eq.rates = @rates;
  eq.jacobian = @jac;
  eq.covers = @covers;
  eq.outputs = {'tip.x', 'm', @tip; 'tip.y', '', @(p, a, b) b * p.ratio};
  eq.states = struct('model', 'full', 'coordinates', {{'motor', 'slide'}}, ...
                     'ranges', {{'motor', [-1, 1.5]}}, 'gravity', [0 0 -9.81], 'samples', 7, ...
                     'loads', struct('body', 'arm', 'point', [0 0 1], 'force', [1 2 3], ...
                                     'moment', [0 0 0]));
  eq.equations = {struct('number', '(3)', 'gives', 'arm.leg', 'function', @eq3, 'unit', 'm', ...
                         'given', struct('u', 'arm.x', 'M', 'arm.R'), ...
                         'printed', 'x \\ y "z"', 'note', 'ä', 'corrected', @eq3c, ...
                         'corrected_text', 'right', 'approximation', 1e-3), ...
                  struct('number', '(4)', 'gives', 'w', 'function', ...
                         @(p, u) p.ratio * u, 'each', struct('i', [1 2]))};
end

function d = drives(p, a, b)
  d = [p.ratio * sin(a) * b; b / p.ratio];
end

function f = forces(p, q, qd, qdd, load)
  f = p.mass * qdd;
  for k = 1:numel(load)
    f(1) = f(1) + load(k).force(1) * strcmp(load(k).axes, 'world') + load(k).point(2);
  end
end

function v = rates(p, q, qd)
  v = [p.ratio * cos(q(1)) * q(2) * qd(1) + p.ratio * sin(q(1)) * qd(2); qd(2) / p.ratio];
end

function J = jac(p, a, b)
  J = [p.ratio * cos(a) * b, p.ratio * sin(a); 0, 1 / p.ratio];
end

function c = covers(p)
  c = {'arm.mass', p.mass; 'arm.com', [0, NaN, p.ratio]; 'arm.any', []};
end

function x = tip(p, a, b)
  x = p.mass * a * b;
end

% An equation.
function y = eq3(p, u, M)
  y = p.ratio * (M * u);
end

function y = eq3c(p, u, M)
  y = -p.ratio * (M * u);

  % Its end.
end
"""

PYTHON_FILE = """
from mbverify.equations import closed_form, cos, equation, output, sin, states
print("noise")

@closed_form("arm", commands=["motor", "slide"])
def drives(p, a, b):
    return [p.ratio * sin(a) * b, b / p.ratio]

@closed_form.forces
def forces(p, q, qd, qdd, load):
    f = [p.mass * e for e in qdd]
    for l in load:
        f[0] = f[0] + l.force[0] * (l.axes == "world") + l.point[1]
    return f

@closed_form.rates
def rates(p, q, qd):
    return [p.ratio * cos(q.a) * q.b * qd.a + p.ratio * sin(q.a) * qd.b, qd.b / p.ratio]

@closed_form.jacobian
def jac(p, a, b):
    return [[p.ratio * cos(a) * b, p.ratio * sin(a)], [0, 1 / p.ratio]]

@closed_form.covers
def covers(p):
    return {"arm.mass": p.mass, "arm.com": [0, None, p.ratio], "arm.any": None}

@output("tip.x", "m")
def tip(p, a, b):
    return p.mass * a * b

@output("tip.y")
def tip_y(p, a, b):
    return b * p.ratio

states("full", ["motor", "slide"], ranges={"motor": [-1, 1.5]}, gravity=[0, 0, -9.81], samples=7,
       loads=[{"body": "arm", "point": [0, 0, 1], "force": [1, 2, 3], "moment": [0, 0, 0]}])

@equation("(3)", "arm.leg", given={"u": "arm.x", "M": "arm.R"}, printed='x \\\\ y "z"', note="ä",
          corrected="right", approximation=1e-3, unit="m")
def eq3(p, u, M):
    return p.ratio * (M @ u)

@eq3.corrected
def eq3c(p, u, M):
    return -p.ratio * (M @ u)

@equation("(4)", "w", each={"i": [1, 2]})
def eq4(p, u):
    return p.ratio * u
"""


@unittest.skipUnless(OCTAVE, "there is no octave-cli")
class Calls(unittest.TestCase):
    """The program's side, over pipes as mbverify uses it."""

    def assert_same(self, a, b, where=""):
        if isinstance(a, dict) and isinstance(b, dict):
            places = {"line", "end", "corrected_line", "corrected_end", "file"}
            self.assertEqual(sorted(set(a) - places), sorted(set(b) - places), where)
            for key in set(a) - places:
                self.assert_same(a[key], b[key], f"{where}.{key}")
        elif isinstance(a, list) and isinstance(b, list):
            self.assertEqual(len(a), len(b), where)
            for k, (x, y) in enumerate(zip(a, b)):
                self.assert_same(x, y, f"{where}[{k}]")
        elif isinstance(a, (int, float)) and not isinstance(a, bool):
            self.assertIsInstance(b, (int, float), where)
            self.assertAlmostEqual(a, b, delta=1e-14 * max(1, abs(a)), msg=where)
        else:
            self.assertEqual(a, b, where)

    def test_the_same_as_python(self):
        random.seed(5)
        load = {"name": "a", "body": "b", "axes": "world", "point": [0, 0.25, 0],
                "force": [7, 0, 0], "moment": [0, 0, 0]}
        calls = [{"do": "load"}, {"do": "set", "parameters": {"ratio": 0.7, "mass": 3.0, "un": 1}},
                 {"do": "read"}, {"do": "covers", "form": 0}]
        for k in range(12):
            state = {key: [random.gauss(0, 1), random.gauss(0, 1)] for key in ("q", "qd", "qdd")}
            calls.append({"do": "drives", "form": 0, **state})
            calls.append({"do": "sample", "form": 0, **state,
                          "load": [load] * (k % 3) + [dict(load, axes="body")] * (k % 2)})
        rows = [{"u": [random.gauss(0, 1) for _ in range(3)],
                 "M": [[random.gauss(0, 1) for _ in range(3)] for _ in range(3)]} for _ in range(4)]
        calls += [{"do": "equation", "index": 0, "rows": rows},
                  {"do": "equation", "index": 0, "rows": rows, "corrected": True},
                  {"do": "equation", "index": 0, "rows": rows[:1]},
                  {"do": "equation", "index": 1, "rows": [{"u": 0.25}, {"u": -3}]},
                  {"do": "read"}]
        octave, printed = answers("my_arm", OCTAVE_FILE, *calls)
        python = python_answers(PYTHON_FILE, *calls)
        self.assertIn("noise", printed)
        for call, a, b in zip(calls, python, octave):
            self.assertNotIn("error", a)
            self.assert_same(a, b, call["do"])
        lines = OCTAVE_FILE.split("\n")
        form, (third, fourth) = octave[0]["forms"][0], octave[0]["equations"]
        self.assertIn("drives(p, a, b)", lines[form["line"] - 1])
        self.assertIn("eq3(p, u, M)", lines[third["line"] - 1])
        self.assertEqual(third["end"], third["line"] + 2)
        self.assertIn("eq3c(p, u, M)", lines[third["corrected_line"] - 1])
        self.assertEqual(third["corrected_end"], third["corrected_line"] + 4)
        self.assertIn("'(4)'", lines[fourth["line"] - 1])
        self.assertIn("'each'", lines[fourth["end"] - 1])

    def test_of_edited_closed_forms(self):
        rows = [{"q": [0.5, 2.0], "qd": [1, 1], "qdd": [3, 4], "load": []},
                {"q": [0.0, 1.0], "qd": [1, 1], "qdd": [-1, 0], "load": []}]

        def edited(text, part):
            kept = [{k: v for k, v in row.items() if part == "forces" or k != "load"}
                    for row in rows]
            return {"do": "try_form", "source": text, "form": 0, "part": part, "rows": kept,
                    "drives": ["one", "two"]}

        given, _ = answers(
            "my_arm", OCTAVE_FILE,
            {"do": "load"}, {"do": "set", "parameters": {"ratio": 2.0, "mass": 3.0}},
            edited(OCTAVE_FILE.replace("sin(a) * b;", "cos(a) * b;"), "drives"),
            edited(OCTAVE_FILE.replace("f = p.mass * qdd;", "f = -p.mass * qdd;"), "forces"),
            edited(OCTAVE_FILE.replace("f = p.mass * qdd;", "f = nothing;"), "forces"),
            edited(OCTAVE_FILE, "drives"),
            {"do": "drives", "form": 0, "q": [0.5, 2.0], "qd": [1, 1], "qdd": [3, 4]},
        )
        for x, y in zip(sum(given[2]["rows"], []), [4 * math.cos(0.5), 1, 2, 0.5]):
            self.assertAlmostEqual(x, y, delta=1e-14)
        self.assertEqual(given[3], {"rows": [[-9, -12], [3, 0]]})
        self.assertIn("nothing", given[4]["failed"])
        # The file stays as it was loaded.
        self.assertAlmostEqual(given[5]["rows"][0][0], 4 * math.sin(0.5), delta=1e-14)
        self.assertAlmostEqual(given[6]["values"][0][0], 4 * math.sin(0.5), delta=1e-14)

    def test_of_edited_texts(self):
        rows = [{"u": [1, 2, 3], "M": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "other": 5}]

        def edited(text):
            return {"do": "try_source", "source": text, "index": 0, "rows": rows}

        right = "y = p.ratio * (M * u);"
        given, _ = answers(
            "my_arm", OCTAVE_FILE,
            {"do": "load"}, {"do": "set", "parameters": {"ratio": 2.0, "mass": 3.0}},
            edited(OCTAVE_FILE.replace(right, "y = p.ratio * (M * u) + 1;")),
            edited(OCTAVE_FILE.replace(right, "y = p.ratio - (M * u);")),
            edited(OCTAVE_FILE.replace(right, "y = p.ratio * ;")),
            edited(OCTAVE_FILE.replace(right, "y = nothing(u);")),
            {"do": "equation", "index": 0, "rows": rows},
            edited(OCTAVE_FILE),
            edited(OCTAVE_FILE.replace(right, "y = other * u;")),
            {**edited(OCTAVE_FILE.replace("y = -p.ratio", "y = -other * p.ratio")),
             "corrected": True},
        )
        self.assertEqual(given[2], {"rows": [[3, 5, 7]]})
        self.assertEqual(given[3], {"rows": [[1, 0, -1]]})
        self.assertIn("parse error", given[4]["failed"])
        self.assertIn("nothing", given[5]["failed"])
        self.assertEqual(given[6], {"rows": [[2, 4, 6]]})
        self.assertEqual(given[7], {"rows": [[2, 4, 6]]})
        self.assertEqual(given[8], {"rows": [[5, 10, 15]]})
        self.assertEqual(given[9], {"rows": [[-10, -20, -30]]})

    FILE = """function eq = my_try()
  eq.mechanism = 'm';
  eq.drives = @drives;
  eq.forces = @forces;
end
function d = drives(p, x)
  DRIVES
end
function f = forces(p, q, qd, qdd)
  FORCES
end
"""

    def sample(self, drives="d = x;", forces="f = q;", x=0.25, beside=None, times=1):
        state = {"do": "sample", "form": 0, "q": [x], "qd": [1.0], "qdd": [0.0]}
        text = self.FILE.replace("DRIVES", drives).replace("FORCES", forces)
        given, printed = answers("my_try", text, {"do": "load"},
                                 {"do": "set", "parameters": {"r": 2.0}}, *[state] * times,
                                 beside=beside)
        return given[-1], printed

    def test_errors_have_a_kind_and_a_place(self):
        cases = [
            ("d = sqrt(x - 1);", "", "unreachable", "sqrt of -0.75", 7, "drives"),
            ("d = asin(x + 1);", "", "unreachable", "arc of 1.25", 7, "drives"),
            ("d = acos(-x - 1);", "", "unreachable", "arc of -1.25", 7, "drives"),
            ("d = log(x - 0.25);", "", "unreachable", "log of 0", 7, "drives"),
            ("d = (x - 1)^0.5;", "", "unreachable", "sqrt of -0.75", 7, "drives"),
            ("d = (x - 1)^1.5;", "", "unreachable", "negative", 7, "drives"),
            ("d = 1i * x;", "", "unreachable", "complex", 0, ""),
            ("mbverify_unreachable('the rod is short');", "", "unreachable", "the rod is short", 7,
             "drives"),
            ("d = mbverify_solve(@(y) y^2 + 1 + x, 1);", "", "unreachable", "solve:", 7, "drives"),
            ("d = 1 / (x - 0.25);", "", "singular", "division by zero", 7, "drives"),
            ("d = x / 0;", "", "singular", "division by zero", 7, "drives"),
            ("d = [1 x; 4*x 4*x^2] \\ [1; 2];", "", "singular", "singular", 7, "drives"),
            ("d = sqrt(x - 0.25);", "", "singular", "root of 0", 7, "drives"),
            ("d = asin(4*x);", "", "singular", "arc of 1", 7, "drives"),
            ("d = atan2(x - 0.25, 0);", "", "singular", "atan2", 7, "drives"),
            ("d = p.missing;", "", "exception", "no parameter 'missing'", 7, "drives"),
            ("d = double(x);", "", "exception", "lose", 7, "drives"),
            ("v = [1; 2]; v(1) = x; d = v;", "", "exception", "zeros(", 7, "drives"),
            ("d = undefined_one(x);", "", "exception", "undefined_one", 7, "drives"),
            ("d = [x; 1] + [1; 2; 3];", "", "exception", "nonconformant", 7, "drives"),
            ("d = 'text';", "", "exception", "a char", 0, ""),
            ("", "f = sqrt(q - 1);", "unreachable", "sqrt of -0.75", 10, "forces"),
            ("", "f = (q - 1)^0.5;", "unreachable", "complex", 0, ""),
            ("", "f = acos(q + 1);", "unreachable", "acos of 1.25", 10, "forces"),
            ("", "f = log(-q);", "unreachable", "log of -0.25", 10, "forces"),
            ("", "f = [1 1; 1 1] \\ [q; 1];", "singular", "singular", 10, "forces"),
            ("", "f = inv([1 1; 1 1]) * q;", "singular", "singular", 10, "forces"),
            ("", "f = q; error('my own');", "exception", "my own", 10, "forces"),
            ("", "f = mbverify_jacobian(@(y) sqrt(y - 1), q);", "unreachable", "sqrt", 10,
             "forces"),
        ]
        for drives, forces, kind, words, line, function in cases:
            with self.subTest(drives or forces):
                answer, _ = self.sample(drives or "d = x;", forces or "f = q;")
                error = answer["error"]
                self.assertEqual(error["kind"], kind)
                self.assertIn(words, error["message"])
                self.assertEqual(error["line"], line)
                self.assertIn(function, error["function"])
                self.assertTrue(error["file"].endswith("my_try.m"))

    def test_files_that_do_not_load(self):
        for text, words, line in (
            ("function eq = my_try()\n  eq = (1;\nend\n", "parse error", 2),
            ("function eq = my_try()\n  eq = no_such_function();\nend\n", "no_such_function", 2),
            ("function eq = my_try()\n  eq = 3;\nend\n", "a structure is wanted", 0),
            ("function eq = my_try()\n  eq.drives = @d;\nend\nfunction x = d(p, y), x = y; end\n",
             "no field 'mechanism'", 0),
            ("function eq = my_try()\n  eq.mechanism = 'm'; eq.drives = @d; eq.force = @d;\nend\n"
             "function x = d(p, y), x = y; end\n", "no field 'force'", 0),
        ):
            (answer,), _ = answers("my_try", text, {"do": "load"})
            self.assertEqual(answer["error"]["kind"], "exception")
            self.assertIn(words, answer["error"]["message"])
            self.assertEqual(answer["error"]["line"], line)

    def test_ways_to_write_a_file(self):
        text = ("% A comment, and no end of functions.\n"
                "function eq = my_way()\n"
                "eq.mechanism = 'm';\neq.drives = @drives;\n"
                "eq.outputs = {'a.x', 'm', @(p, left, right) left};\n"
                "eq.equations = struct('number', {'(1)', '(2)'}, 'gives', 'g', ...\n"
                "                      'function', {@first, @second});\n\n"
                "function d = drives(p, left, ...  the one\n  right)\nd = {left, right};\n\n"
                "% No argument but p.\nfunction x = first(p)\nx = 1;\n"
                "function x = second(p, r)\nx = r;\n")
        state = {"do": "drives", "form": 0, "q": [1, 2], "qd": [3, 4], "qdd": [6, 8]}
        rows = [{"r": [1, 2]}, {"r": [3, 4]}]
        for ends in ("\n", "\r\n"):
            with self.subTest(ends=ends):
                given, _ = answers(
                    "my_way", text.replace("\n", ends), {"do": "load"},
                    {"do": "set", "parameters": {}}, state,
                    {"do": "equation", "index": 1, "rows": rows},
                    {"do": "equation", "index": 0, "rows": [{}, {}]},
                    {"do": "equation", "index": 1, "rows": [{}]})
                form, (one, two) = given[0]["forms"][0], given[0]["equations"]
                self.assertEqual(form["commands"], ["left", "right"])
                self.assertEqual((form["line"], one["line"], one["end"]), (9, 14, 15))
                self.assertEqual((two["line"], two["end"], two["arguments"]), (16, 17, ["r"]))
                self.assertEqual(given[2], {"values": [[1, 3, 3], [2, 4, 4]]})
                self.assertEqual(given[3], {"rows": [[1, 2], [3, 4]]})
                self.assertEqual(given[4], {"rows": [[1], [1]]})
                self.assertIn("'r'", given[5]["error"]["message"])

    def test_several_forms(self):
        text = ("function eqs = my_forms()\n  a.mechanism = 'm'; a.commands = {'x.y'};\n"
                "  a.drives = @(p, x) x;\n  b = a; b.commands = {'w'}; b.drives = @(p, w) 2 * w;\n"
                "  eqs = {a, b};\nend\n")
        given, _ = answers("my_forms", text, {"do": "load"}, {"do": "set", "parameters": {}},
                           {"do": "drives", "form": 1, "q": [1], "qd": [0], "qdd": [0]})
        self.assertEqual([form["commands"] for form in given[0]["forms"]], [["x.y"], ["w"]])
        self.assertEqual(given[2], {"values": [[2, 0, 0]]})

    def test_prints_do_not_disturb(self):
        answer, printed = self.sample(
            "disp(x); printf('one'); fprintf(1, 'two'); fdisp(stdout, 3); x, d = x;",
            "puts('four'); system('echo five'); f = q; warning('six');")
        self.assertEqual(answer, {"values": [[0.25, 1, 0]], "forces": [0.25]})
        for word in ("one", "two", "four", "five", "six"):
            self.assertIn(word, printed)

    def test_what_is_not_finite(self):
        answer, _ = self.sample("d = [x; NaN; 2];", "f = [Inf; -Inf; 1] * 1;")
        self.assertEqual(answer["values"], [[0.25, 1, 0], [None, 0, 0], [2, 0, 0]])
        self.assertEqual(answer["forces"], [None, None, 1])

    def test_files_beside(self):
        answer, _ = self.sample("d = my_helper(p, x);", "f = my_helper(p, q);",
                                beside={"my_helper.m": "function y = my_helper(p, x)\n"
                                        "  y = zeros(1, 1); y(1) = p.r * x;\nend\n"}, times=12)
        self.assertEqual(answer, {"values": [[0.5, 2, 0]], "forces": [0.5]})

    def test_parameters_are_a_structure(self):
        text = self.FILE.replace("DRIVES", "p.k = 2 * p.r; q.p = p; d = half(q) * x;").replace(
            "FORCES", "f = q * getfield(p, 'r') + isstruct(p) + isfield(p, 'none') + p.('r');")
        text += "function k = half(q), k = q.p.k / 2; end\n"
        state = {"do": "sample", "form": 0, "q": [0.25], "qd": [1.0], "qdd": [0.0]}
        given, _ = answers("my_try", text, {"do": "load"},
                           {"do": "set", "parameters": {"r": 2.0, "s": 1.0}}, {"do": "read"},
                           *[state] * 12, {"do": "read"}, {"do": "set", "parameters": {"r": 3}},
                           state, {"do": "set", "parameters": {}}, {"do": "read"})
        self.assertEqual(given[2], {"names": []})
        for answer in given[3:15]:
            self.assertEqual(answer, {"values": [[0.5, 2, 0]], "forces": [3.5]})
        self.assertEqual(given[15], {"names": ["r"]})
        self.assertEqual(given[17], {"values": [[0.75, 3, 0]], "forces": [4.75]})
        self.assertEqual(given[19], {"names": []})

    def test_names_of_drives(self):
        answer, _ = self.sample("d.left = x^2; d.right = 3;", "f.left = q; f.right = 2*q;")
        self.assertEqual(answer, {"named": {"left": [0.0625, 0.5, 1], "right": [3, 0, 0]},
                                  "named_forces": {"left": 0.25, "right": 0.5}})



@unittest.skipUnless(OCTAVE, "there is no octave-cli")
class Examples(unittest.TestCase):
    """What is written in both languages is the same."""

    FOLDER = SOURCES.parents[1] / "examples" / "equations"

    def check(self, name, parameters, middle, size):
        random.seed(7)
        calls = [{"do": "load"}, {"do": "set", "parameters": parameters}, {"do": "covers", "form": 0}]
        for _ in range(20):
            calls.append({"do": "sample", "form": 0, "load": [],
                          "q": [m + size * random.uniform(-1, 1) for m in middle],
                          "qd": [random.gauss(0, 1) for _ in middle],
                          "qdd": [random.gauss(0, 5) for _ in middle]})
        octave, _ = answers(name, (self.FOLDER / f"{name}.m").read_text(encoding="utf-8"), *calls)
        python = python_answers((self.FOLDER / f"{name}.py").read_text(encoding="utf-8"), *calls)
        for a, b in zip(python[2:], octave[2:]):
            self.assertNotIn("error", a)
            self.assertEqual(sorted(a), sorted(b))
            for key in a:
                if key == "stated":
                    self.assertEqual(a[key], b[key])
                    continue
                x, y = ([e for row in t[key] for e in (row if isinstance(row, list) else [row])]
                        for t in (a, b))
                self.assertEqual(len(x), len(y))
                for u, v in zip(x, y):
                    self.assertAlmostEqual(u, v, delta=1e-13 * max(1, *map(abs, x)))

    def test_slider_crank(self):
        self.check("planar_slider_crank",
                   {"r": 0.1, "l": 0.35, "m_crank": 0.8, "m_rod": 1.2, "m_slider": 2.5,
                    "I_crank": 0.0009, "I_rod": 0.0125, "g": 9.81}, [0], 3)

    def test_delta(self):
        self.check("delta",
                   {"R": 0.2, "r": 0.06, "L": 0.3, "l": 0.7, "m_arm": 0.65, "c_arm": 0.12,
                    "I_arm": 0.0062, "m_rod": 0.11, "I_rod": 0.0051, "m_platform": 0.9, "g": 9.81},
                   [0, 0, -0.7], 0.1)


if __name__ == "__main__":
    unittest.main()
