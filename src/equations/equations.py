"""Your own equations as a witness of mbverify: functions that also differentiate.

    from mbverify.equations import closed_form, output, cos, sin, sqrt

    @closed_form("planar_slider_crank", commands=["motor"])
    def drives(p, motor):              # parameters, commands: positions of all drives
        return [motor]

    @closed_form.forces
    def forces(p, q, qd, qdd):         # forces of all drives
        ...

    @output("slider.x")                # compared with the other witnesses' channel of this name
    def slider(p, motor):
        return p.r * cos(motor) + sqrt(p.l**2 - (p.r * sin(motor)) ** 2)

SI units and radians. Rates and accelerations of drives and outputs are those of the function itself
(truncated Taylor arithmetic, no differences). docs/how-to/equations.md has the rest. This module
needs Python's standard library alone; started as a program it answers mbverify's calls.
"""

import functools
import inspect
import json
import math
import os
import sys
import traceback
import types

__all__ = [
    "DomainError", "Mat", "Series", "Unreachable", "Vec", "abs_", "acos", "asin", "atan", "atan2",
    "closed_form", "cos", "cosh", "cross", "diag", "dot", "equation", "exp", "hypot", "identity",
    "jacobian", "linear_solve", "log", "motion", "norm", "output", "pi", "rot_x", "rot_y", "rot_z",
    "sin", "sinh", "skew", "solve", "sqrt", "states", "tan", "tanh", "unreachable", "value", "vee",
]

pi = math.pi


class Unreachable(ArithmeticError):
    """The equations have no pose there."""


class DomainError(Unreachable):
    """A root, logarithm or arc of a number that has none."""


def unreachable(why):
    """Ends the computation: no pose there, and why."""
    raise Unreachable(why)


# Truncated Taylor arithmetic.


class Series:
    """a + b τ + c τ² of one variable; coefficients may be series of another (lower level)."""

    __slots__ = ("a", "b", "c", "level")
    __array_priority__ = 100  # numpy leaves operators to us

    def __init__(self, a, b, c, level=1):
        self.a, self.b, self.c, self.level = a, b, c, level

    def __repr__(self):
        return f"Series({self.a!r}, {self.b!r}, {self.c!r})"

    def _pair(self, other):
        # Both as coefficients of the higher variable; None: the other is not a number.
        if isinstance(other, Series):
            if other.level == self.level:
                return self, other
            if other.level > self.level:
                return Series(self, 0.0, 0.0, other.level), other
        elif not _is_number(other):
            return None
        return self, Series(other, 0.0, 0.0, self.level)

    # Plain numbers, which are most, take the short way.

    def __add__(self, other):
        if type(other) is float or type(other) is int:
            return Series(self.a + other, self.b, self.c, self.level)
        pair = self._pair(other)
        if pair is None:
            return NotImplemented
        x, y = pair
        return Series(x.a + y.a, x.b + y.b, x.c + y.c, x.level)

    __radd__ = __add__

    def __neg__(self):
        return Series(-self.a, -self.b, -self.c, self.level)

    def __pos__(self):
        return self

    def __sub__(self, other):
        if type(other) is float or type(other) is int:
            return Series(self.a - other, self.b, self.c, self.level)
        pair = self._pair(other)
        if pair is None:
            return NotImplemented
        x, y = pair
        return Series(x.a - y.a, x.b - y.b, x.c - y.c, x.level)

    def __rsub__(self, other):
        return (-self) + other

    def __mul__(self, other):
        if type(other) is float or type(other) is int:
            return Series(self.a * other, self.b * other, self.c * other, self.level)
        pair = self._pair(other)
        if pair is None:
            return NotImplemented
        x, y = pair
        return Series(
            x.a * y.a, x.a * y.b + x.b * y.a, x.a * y.c + x.b * y.b + x.c * y.a, x.level
        )

    __rmul__ = __mul__

    def _inverse(self):
        r = 1.0 / self.a
        d = self.b * r
        return Series(r, -(d * r), r * (d * d - self.c * r), self.level)

    def __truediv__(self, other):
        if isinstance(other, Series):
            return self * other._inverse()
        if not _is_number(other):
            return NotImplemented
        return Series(self.a / other, self.b / other, self.c / other, self.level)

    def __rtruediv__(self, other):
        return self._inverse() * other

    def __pow__(self, n):
        if isinstance(n, Series):
            return exp(n * log(self))
        if n == int(n) and abs(n) <= 64:
            n = int(n)
            if n < 0:
                return (self ** (-n))._inverse()
            result = 1.0
            for bit in bin(n)[2:]:
                result = result * result
                if bit == "1":
                    result = result * self
            return result if isinstance(result, Series) else Series(result, 0.0, 0.0, self.level)
        if n == 0.5:
            return sqrt(self)
        f = self.a**n
        return self._apply(f, n * f / self.a, n * (n - 1) * f / (self.a * self.a))

    def __rpow__(self, base):
        return exp(self * log(base))

    def __abs__(self):
        return self if value(self) >= 0 else -self

    # Comparisons are those of the values.
    def __lt__(self, other):
        return value(self) < value(other)

    def __le__(self, other):
        return value(self) <= value(other)

    def __gt__(self, other):
        return value(self) > value(other)

    def __ge__(self, other):
        return value(self) >= value(other)

    def __eq__(self, other):
        return value(self) == value(other)

    def __ne__(self, other):
        return value(self) != value(other)

    __hash__ = None

    def __bool__(self):
        return bool(value(self))

    def __float__(self):
        raise TypeError(
            "a number that carries its derivatives would lose them here: use sin, cos, sqrt … of "
            "mbverify.equations instead of those of math"
        )

    def _apply(self, f, f1, f2):
        # A function of this with its two derivatives at a.
        return Series(f, f1 * self.b, f1 * self.c + 0.5 * f2 * (self.b * self.b), self.level)


def _is_number(x):
    # numpy's scalars included, without numpy.
    return isinstance(x, (int, float)) or (hasattr(x, "__float__") and not isinstance(x, Series))


def value(x):
    """The number without its derivatives; of vectors and lists, too."""
    while isinstance(x, Series):
        x = x.a
    return _like(x, [value(e) for e in x]) if isinstance(x, (tuple, list)) else x


def _like(x, elements):
    # Vectors and matrices stay what they are.
    return next((kind(elements) for kind in (Mat, Vec) if isinstance(x, kind)), elements)


def _function(name, real, derivatives):
    """A function of numbers and series: derivatives(a, f(a)) gives the first two."""

    def function(x):
        if isinstance(x, Series):
            f = function(x.a)
            return x._apply(f, *derivatives(x.a, f))
        try:
            return real(x)
        except ValueError:
            raise DomainError(f"{name} of {float(x):g}") from None

    function.__name__ = name
    function.__doc__ = f"{name} of a number, with derivatives."
    return function


def _sqrt_derivatives(a, f):
    if value(f) == 0:
        raise ZeroDivisionError("the root of 0 has no derivative")
    return 0.5 / f, -0.25 / (a * f)


sqrt = _function("sqrt", math.sqrt, _sqrt_derivatives)
exp = _function("exp", math.exp, lambda a, f: (f, f))
log = _function("log", math.log, lambda a, f: (1.0 / a, -1.0 / (a * a)))
sin = _function("sin", math.sin, lambda a, f: (cos(a), -f))
cos = _function("cos", math.cos, lambda a, f: (-sin(a), -f))
tan = _function("tan", math.tan, lambda a, f: (1.0 + f * f, 2.0 * f * (1.0 + f * f)))
sinh = _function("sinh", math.sinh, lambda a, f: (cosh(a), f))
cosh = _function("cosh", math.cosh, lambda a, f: (sinh(a), f))
tanh = _function("tanh", math.tanh, lambda a, f: (1.0 - f * f, -2.0 * f * (1.0 - f * f)))
atan = _function("atan", math.atan, lambda a, f: _arc(1.0 / (1.0 + a * a), a, -2.0))


def _arc(first, a, factor):
    return first, factor * a * first * first


def _asin_derivatives(sign):
    def derivatives(a, f):
        s = 1.0 - a * a
        if value(s) == 0:
            raise ZeroDivisionError("the arc of 1 has no derivative")
        first = sign / sqrt(s)
        return first, first * a / s

    return derivatives


asin = _function("asin", math.asin, _asin_derivatives(1.0))
acos = _function("acos", math.acos, _asin_derivatives(-1.0))


def atan2(y, x):
    """The angle of (x, y), with derivatives."""
    if not isinstance(y, Series) and not isinstance(x, Series):
        return math.atan2(y, x)
    # Of the quotient that is in order, moved to the angle's branch.
    if abs(value(x)) >= abs(value(y)):
        angle = atan(y / x)
    else:
        angle = 0.5 * pi - atan(x / y)
    return angle + pi * round((math.atan2(value(y), value(x)) - value(angle)) / pi)


def hypot(x, y):
    """√(x² + y²), with derivatives."""
    if not isinstance(y, Series) and not isinstance(x, Series):
        return math.hypot(x, y)
    return sqrt(x * x + y * y)


def abs_(x):
    """|x|, with derivatives."""
    return abs(x)


# What numpy calls of the elements of an array of objects.
for _name, _function_of in (
    ("sin", sin), ("cos", cos), ("tan", tan), ("sqrt", sqrt), ("exp", exp), ("log", log),
    ("arcsin", asin), ("arccos", acos), ("arctan", atan), ("arctan2", atan2), ("hypot", hypot),
):
    setattr(Series, _name, _function_of)


# Vectors and matrices of such numbers.


class Vec(tuple):
    """A vector: + − by element, * and / by a number, @ with a vector (dot product)."""

    __array_priority__ = 100

    def __new__(cls, *elements):
        if len(elements) == 1 and not _is_scalar(elements[0]):
            elements = elements[0]
        return super().__new__(cls, elements)

    def __repr__(self):
        return f"Vec({', '.join(map(repr, self))})"

    def _with(self, other, operation):
        if not isinstance(other, (tuple, list)) or len(other) != len(self):
            raise TypeError(f"a vector of {len(self)} does not go with {_shape(other)}")
        return Vec(map(operation, self, other))

    def __add__(self, other):
        return self._with(other, lambda a, b: a + b)

    __radd__ = __add__

    def __sub__(self, other):
        return self._with(other, lambda a, b: a - b)

    def __rsub__(self, other):
        return self._with(other, lambda a, b: b - a)

    def __neg__(self):
        return Vec(-e for e in self)

    def __mul__(self, factor):
        if not _is_scalar(factor):
            raise TypeError("* takes a number; @ is the dot product, cross() the vector product")
        return Vec(e * factor for e in self)

    __rmul__ = __mul__

    def __truediv__(self, divisor):
        return Vec(e / divisor for e in self)

    def __matmul__(self, other):
        if isinstance(other, Mat):
            return Vec(self @ column for column in other.T)
        return _sum(self._with(other, lambda a, b: a * b))

    def cross(self, other):
        return cross(self, other)


class Mat(tuple):
    """A matrix, by rows: + − by element, * and / by a number, @ with a vector or a matrix, .T."""

    __array_priority__ = 100

    def __new__(cls, *rows):
        if len(rows) == 1 and not (isinstance(rows[0], (tuple, list)) and _is_row(rows[0])):
            rows = rows[0]
        return super().__new__(cls, (Vec(row) for row in rows))

    def __repr__(self):
        return f"Mat({', '.join(repr(list(row)) for row in self)})"

    @property
    def T(self):
        return Mat(list(zip(*self)))

    def _with(self, other, operation):
        if not isinstance(other, (tuple, list)) or len(other) != len(self):
            raise TypeError(f"{_shape(self)} does not go with {_shape(other)}")
        return Mat([operation(a, Vec(b)) for a, b in zip(self, other)])

    def __add__(self, other):
        return self._with(other, lambda a, b: a + b)

    def __sub__(self, other):
        return self._with(other, lambda a, b: a - b)

    def __neg__(self):
        return Mat([-row for row in self])

    def __mul__(self, factor):
        if not _is_scalar(factor):
            raise TypeError("* takes a number; @ is the product of matrices")
        return Mat([row * factor for row in self])

    __rmul__ = __mul__

    def __truediv__(self, divisor):
        return Mat([row / divisor for row in self])

    def __matmul__(self, other):
        if len(other) != len(self[0]):
            raise TypeError(f"{_shape(self)} does not go with {_shape(other)}")
        if isinstance(other, Mat):
            columns = other.T
            return Mat([[row @ column for column in columns] for row in self])
        return Vec(row @ other for row in self)


def _is_scalar(x):
    return isinstance(x, Series) or _is_number(x)


def _is_row(x):
    return all(_is_scalar(e) for e in x)


def _shape(x):
    if isinstance(x, Mat):
        return f"a matrix of {len(x)} × {len(x[0])}"
    if isinstance(x, (tuple, list)):
        return f"a vector of {len(x)}"
    return f"a {type(x).__name__}"


def _sum(terms):
    total = 0.0
    for term in terms:
        total = total + term
    return total


def dot(a, b):
    """Scalar product of two vectors."""
    return Vec(a) @ Vec(b)


def cross(a, b):
    """Vector product of two vectors of three."""
    return Vec(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(a):
    """Length of a vector."""
    return sqrt(_sum(e * e for e in a))


def skew(a):
    """The matrix with skew(a) @ b = a × b."""
    return Mat([0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0])


def vee(M):
    """The vector of a matrix' skew part: vee(skew(a)) = a."""
    return 0.5 * Vec(M[2][1] - M[1][2], M[0][2] - M[2][0], M[1][0] - M[0][1])


def diag(*elements):
    """A diagonal matrix."""
    elements = Vec(*elements)
    return Mat([[e if i == k else 0.0 for k in range(len(elements))]
                for i, e in enumerate(elements)])


def identity(n=3):
    """The unit matrix."""
    return diag([1.0] * n)


def rot_x(angle):
    """Rotation about x: takes components in the turned frame to those in the other."""
    c, s = cos(angle), sin(angle)
    return Mat([1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c])


def rot_y(angle):
    """Rotation about y."""
    c, s = cos(angle), sin(angle)
    return Mat([c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c])


def rot_z(angle):
    """Rotation about z."""
    c, s = cos(angle), sin(angle)
    return Mat([c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0])


def linear_solve(A, b):
    """x with A x = b (a vector, or a matrix column by column), by elimination with pivots."""
    if isinstance(b, Mat):
        return Mat([linear_solve(A, column) for column in b.T]).T
    n = len(A)
    rows = [list(row) + [e] for row, e in zip(A, b)]
    if any(len(row) != n + 1 for row in rows) or len(b) != n:
        raise TypeError(f"linear_solve: {_shape(Mat(A))} does not go with {_shape(b)}")
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(value(rows[i][k])))
        if value(rows[best][k]) == 0:
            raise ZeroDivisionError("linear_solve: the matrix is singular")
        rows[k], rows[best] = rows[best], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] = rows[i][j] - factor * rows[k][j]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - _sum(rows[i][j] * x[j] for j in range(i + 1, n))) / rows[i][i]
    return Vec(x)


# Derivatives inside of equations.


def _level(x):
    if isinstance(x, Series):
        return x.level
    if isinstance(x, (tuple, list)):
        return max((_level(e) for e in x), default=0)
    return 0


_depth = 1  # level of the derivatives that are being taken; 1 is that of Series(…) itself


def _at_depth(arguments, call):
    global _depth
    before = _depth
    level = _depth = max(_depth, _level(arguments)) + 1
    try:
        return call(level)
    finally:
        _depth = before


def _coefficient(x, level, which):
    if isinstance(x, Series) and x.level == level:
        return (x.a, x.b, 2.0 * x.c)[which]
    if isinstance(x, (tuple, list)):
        return _like(x, [_coefficient(e, level, which) for e in x])
    return x if which == 0 else 0.0


def _flat(x):
    if isinstance(x, (tuple, list)):
        return [e for row in x for e in _flat(row)]
    return [x]


def motion(function, q, qd, qdd):
    """Value, rate and acceleration of function(*q) where q moves with qd and qdd."""

    def call(level):
        arguments = [Series(a, b, 0.5 * c, level) for a, b, c in zip(q, qd, qdd)]
        result = function(*arguments)
        return tuple(_coefficient(result, level, k) for k in range(3))

    return _at_depth([q, qd, qdd], call)


def jacobian(function, q):
    """Matrix of the derivatives of function(*q): a row per element that it gives (vectors and lists
    one after the other), a column per element of q."""

    def call(level):
        columns = []
        for k in range(len(q)):
            arguments = [Series(e, 1.0 if i == k else 0.0, 0.0, level) for i, e in enumerate(q)]
            columns.append(_flat(_coefficient(function(*arguments), level, 1)))
        return Mat(columns).T

    return _at_depth(q, call)


_last_roots = {}  # by function and start: what is asked for again at once is known


def solve(function, start, iterations=50):
    """x with function(*x) = 0, by Newton's method from `start` (numbers); with the derivatives of x
    by whatever the function depends on."""
    start = tuple(float(value(e)) for e in start)
    key = (function.__code__, start) if hasattr(function, "__code__") else None
    known = _last_roots.get(key)
    if known is None or not _is_root(function, *known):
        known = _newton(function, start, iterations)
        if len(_last_roots) > 100:
            _last_roots.clear()
        _last_roots[key] = known
    x, J = known
    # Each step with the same matrix gives one more coefficient of the series.
    order = 2 * _level(function(*x))
    for _ in range(order):
        x = [a - b for a, b in zip(x, linear_solve(J, _flat(function(*x))))]
    return Vec(x)


def _is_root(function, x, J):
    # The same function may depend on other numbers by now.
    step = linear_solve(J, [value(e) for e in _flat(function(*x))])
    size = max(abs(e) for e in x)
    return all(abs(e) <= 1e-15 * size for e in step)


def _newton(function, start, iterations):
    """The root, and the derivatives of the function by its arguments there: numbers."""
    x = list(start)
    size, largest = 1e-300, math.inf
    for _ in range(iterations):
        residual = [value(e) for e in _flat(function(*x))]
        if largest > 1e-4 * size:  # else the matrix is near enough
            J = value(jacobian(function, x))
        try:
            step = linear_solve(J, residual)
        except ZeroDivisionError:
            raise Unreachable("solve: singular on the way to a root") from None
        x = [a - b for a, b in zip(x, step)]
        largest = max(abs(e) for e in step)
        if not math.isfinite(largest):
            break
        size = max([size] + [abs(e) for e in x])
        if largest <= 1e-14 * size:  # the next step is round-off
            return x, value(jacobian(function, x))
    raise Unreachable(f"solve: no root after {iterations} steps from {list(start)}")


# What a file declares.


class _Form:
    def __init__(self, name, function, commands, covers):
        self.name, self.function, self.commands = name, function, commands
        self.unchecked = covers == "unchecked"
        self.parts = {}
        self.outputs = []


class _Declared:
    def __init__(self):
        self.forms = []
        self.equations = []
        self.states = {}


_declared = _Declared()


def _arguments(function):
    return [
        parameter.name
        for parameter in inspect.signature(function).parameters.values()
        if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.POSITIONAL_OR_KEYWORD)
    ]


class _ClosedForm:
    """Decorator of the function that gives the drives' positions; its attributes add to it."""

    def __call__(self, mechanism, commands=None, covers=None):
        """`mechanism`: the name in model.yaml. `commands`: of the scenario, in the order of the
        function's arguments; without it the arguments' names are theirs. `covers="unchecked"`: what
        the equations take for granted is not stated."""
        if callable(mechanism):
            raise TypeError('write @closed_form("name of the mechanism")')

        def declare(function):
            names = list(commands) if commands is not None else _arguments(function)[1:]
            _declared.forms.append(_Form(mechanism, function, names, covers))
            return function

        return declare

    @staticmethod
    def _part(name):
        def declare(function):
            if not _declared.forms:
                raise TypeError(f"@closed_form.{name} comes before any @closed_form(…)")
            _declared.forms[-1].parts[name] = function
            return function

        return staticmethod(declare)

    forces = _part("forces")
    rates = _part("rates")
    jacobian = _part("jacobian")
    covers = _part("covers")


for _name in ("forces", "rates", "jacobian", "covers"):
    setattr(_ClosedForm, _name, _ClosedForm._part(_name))
closed_form = _ClosedForm()


def output(channel, unit=""):
    """Decorator: a function of parameters and commands that gives the channel's value."""

    def declare(function):
        if not _declared.forms:
            raise TypeError("@output comes before any @closed_form(…)")
        _declared.forms[-1].outputs.append((channel, unit, function))
        return function

    return declare


def states(model, coordinates, ranges=None, rates=None, accelerations=None, parameters=None,
           gravity=None, loads=(), samples=40):
    """Where the file's equations are audited: at random states of a model in independent coordinates
    within `ranges` ({coordinate: [from, to]}; without one: of the drives' own range), with rates and
    accelerations up to the given ones ({coordinate: size}). `loads`: [{"body", "point" (in the body's
    frame), "force", "moment"}] in world axes. `gravity` in place of the model's own."""
    _declared.states = dict(model=model, coordinates=list(coordinates), ranges=dict(ranges or {}),
                            rates=dict(rates or {}), accelerations=dict(accelerations or {}),
                            parameters=dict(parameters or {}),
                            gravity=list(gravity) if gravity is not None else None,
                            loads=[dict(load) for load in loads], samples=samples)


class _Equation:
    def __init__(self, number, gives, function, options):
        self.number, self.gives, self.function, self.options = number, gives, function, options
        self.right = None

    def corrected(self, function):
        """Decorator: the same equation as it should be."""
        self.right = function
        return self

    def __call__(self, *arguments):
        return self.function(*arguments)


def equation(number, gives, given=None, each=None, printed="", corrected="", note="", unit="",
             approximation=0.0, erratum=""):
    """Decorator: a numbered equation, as printed. `gives`: the quantity that it claims to be, `given`:
    the quantity that each argument is (docs/how-to/equations.md, Quantities)."""

    def declare(function):
        entry = _Equation(number, gives, function,
                          dict(given=dict(given or {}), each=dict(each or {}), printed=printed,
                               corrected=corrected, note=note, unit=unit, erratum=erratum,
                               approximation=approximation))
        _declared.equations.append(entry)
        return entry

    return declare


# The program's side: a file is loaded and its functions are called, one JSON text a line.


class _Parameters:
    """The model's parameters, as attributes; knows which were read."""

    def __init__(self, values):
        self.__dict__["_values"] = values
        self.__dict__["_read"] = set()

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        try:
            number = self._values[name]
        except KeyError:
            raise AttributeError(f"the model has no parameter '{name}'") from None
        self._read.add(name)
        return number

    __getitem__ = __getattr__

    def __setattr__(self, name, number):
        raise AttributeError("parameters are the model's; they cannot be set")


class _Coordinates(Vec):
    """Values of the commands, also by the names of the function's arguments."""

    def __new__(cls, names, elements):
        self = super().__new__(cls, list(elements))
        self.names = names
        return self

    def __getattr__(self, name):
        if name in self.__dict__.get("names", ()):
            return self[self.names.index(name)]
        raise AttributeError(f"there is no command '{name}'")


def _number(x):
    if isinstance(x, Series):
        numbers = [x.a, x.b, x.c]
    else:
        numbers = [x, 0.0, 0.0]
    for number in numbers:
        if not _is_number(number) or isinstance(number, bool):
            raise TypeError(f"gave a {type(number).__name__} where a number is wanted")
    numbers = [float(number) for number in numbers]
    return [number if math.isfinite(number) else None for number in numbers]


def _numbers(x):
    """What a function gave, as a flat list of numbers with two derivatives."""
    if hasattr(x, "tolist") and not isinstance(x, (float, int)):
        x = x.tolist()
    if isinstance(x, (tuple, list)):
        return [e for row in x for e in _numbers(row)]
    if x is None:
        raise TypeError("gave None: is there a return?")
    return [_number(x)]


class _Host:
    """Answers calls about one file."""

    def __init__(self, path):
        self.path = os.path.abspath(path)
        self.parameters = _Parameters({})
        self.module = None

    def load(self, source=None):
        """Runs the file, or other text in its place."""
        if source is None:
            with open(self.path, encoding="utf-8") as stream:
                source = stream.read()
        _declared.__init__()
        module = types.ModuleType("equations_of_a_file")
        module.__file__ = self.path
        sys.modules[module.__name__] = module
        self.module = module
        exec(compile(source, self.path, "exec"), module.__dict__)
        return {
            "forms": [
                {
                    "mechanism": form.name,
                    "commands": form.commands,
                    "line": form.function.__code__.co_firstlineno,
                    "unchecked": form.unchecked,
                    "parts": sorted(form.parts),
                    "takes_loads": "forces" in form.parts
                    and len(_arguments(form.parts["forces"])) > 4,
                    "outputs": [{"channel": c, "unit": u} for c, u, _ in form.outputs],
                }
                for form in _declared.forms
            ],
            "states": _declared.states,
            "equations": [
                {
                    "number": entry.number,
                    "gives": entry.gives,
                    "line": entry.function.__code__.co_firstlineno,
                    "end": _last_line(entry.function),
                    "corrected_line": entry.right.__code__.co_firstlineno if entry.right else 0,
                    "corrected_end": _last_line(entry.right) if entry.right else 0,
                    "arguments": list(dict.fromkeys(
                        name for function in (entry.function, entry.right) if function
                        for name in _arguments(function)[1:])),
                    "has_corrected": entry.right is not None,
                    **entry.options,
                }
                for entry in _declared.equations
            ],
        }

    def set(self, parameters):
        self.parameters = _Parameters(parameters)
        return {}

    def read(self):
        """Parameters that were read since they were set."""
        return {"names": sorted(self.parameters._read)}

    def covers(self, form):
        """What the form states about the mechanism."""
        function = _declared.forms[form].parts.get("covers")
        stated = function(self.parameters) if function else {}
        if not isinstance(stated, dict):
            raise TypeError(f"covers gave a {type(stated).__name__}, not a dictionary")
        return {
            "stated": {
                str(key): [None if e is None else float(e) for e in _flat(entry)]
                if isinstance(entry, (tuple, list))
                else [None if entry is None else float(entry)]
                for key, entry in stated.items()
            }
        }

    def drives(self, form, q, qd, qdd):
        """Drives' positions with their derivatives by time."""
        function = _declared.forms[form].function
        arguments = [Series(a, b, 0.5 * c) for a, b, c in zip(q, qd, qdd)]
        given = function(self.parameters, *arguments)
        if isinstance(given, dict):
            return {"named": {str(name): _numbers(x)[0] for name, x in given.items()}}
        return {"values": _numbers(given)}

    def _own(self, form, part, *vectors):
        function = _declared.forms[form].parts[part]
        names = _arguments(_declared.forms[form].function)[1:]
        given = function(self.parameters, *[_Coordinates(names, v) for v in vectors])
        return [numbers[0] for numbers in _numbers(given)]

    def sample(self, form, q, qd, qdd, load=()):
        """Everything at one instant."""
        declared = _declared.forms[form]
        answer = self.drives(form, q, qd, qdd)
        names = _arguments(declared.function)[1:]
        if "rates" in declared.parts:
            answer["rates"] = self._own(form, "rates", q, qd)
        if "jacobian" in declared.parts:
            function = declared.parts["jacobian"]
            rows = Mat(function(self.parameters, *q))
            answer["jacobian_rates"] = [row @ Vec(qd) for row in rows]
        if "forces" in declared.parts:
            function = declared.parts["forces"]
            arguments = [_Coordinates(names, v) for v in (q, qd, qdd)]
            if len(_arguments(function)) > 4:
                arguments.append([_Load(entry) for entry in load])
            given = function(self.parameters, *arguments)
            if isinstance(given, dict):
                answer["named_forces"] = {str(n): _numbers(x)[0][0] for n, x in given.items()}
            else:
                answer["forces"] = [numbers[0] for numbers in _numbers(given)]
        if declared.outputs:
            series = [Series(a, b, 0.5 * c) for a, b, c in zip(q, qd, qdd)]
            answer["outputs"] = [
                _numbers(function(self.parameters, *series))[0] for _, _, function in declared.outputs
            ]
        return answer

    def equation(self, index, rows, corrected=False, known=None):
        """One equation at many states: what it gave at each. `known`: where to put all that rows
        have."""
        entry = _declared.equations[index]
        function = entry.right if corrected else entry.function
        names = _arguments(function)[1:]
        values = []
        for row in rows:
            if known is not None:
                known.update((name, _shaped(x)) for name, x in row.items())
            arguments = [_shaped(row[name]) for name in names]
            values.append([numbers[0] for numbers in _numbers(function(self.parameters, *arguments))])
        return {"rows": values}

    def try_form(self, source, form, part, rows, drives):
        """Drives' positions or forces of an edited file at many states; errors are part of the
        answer. The file stays as it was loaded."""
        before = dict(_declared.__dict__), self.module
        try:
            self.load(source)
            values = []
            for row in rows:
                answer = (self.drives if part == "drives" else self.sample)(form, **row)
                key = "values" if part == "drives" else "forces"
                named = answer.get("named" if part == "drives" else "named_forces")
                given = [named[name] for name in drives] if named is not None else answer[key]
                values.append([x[0] if isinstance(x, list) else x for x in given])
            return {"rows": values}
        except BaseException as error:  # an edited text may do anything
            if isinstance(error, KeyboardInterrupt):
                raise
            return {"failed": f"{type(error).__name__}: {error}"}
        finally:
            _declared.__dict__.update(before[0])
            self.module = before[1]

    def try_source(self, source, index, rows, corrected=False):
        """The same of a text that is edited inside of this equation alone; errors are part of the
        answer. The file stays as it was loaded."""
        entry = _declared.equations[index]
        function, right = entry.function, entry.right
        edited = right if corrected else function
        first = edited.__code__.co_firstlineno
        lines = source.split("\n")[first - 1 : _last_line(edited)]
        count = len(_declared.equations)
        try:
            # The function alone, in the file's names, at its own lines. It may name whatever this
            # module has, and all that is known of the state.
            names = {name: globals()[name] for name in __all__}
            names.update(self.module.__dict__)
            code = compile("\n" * (first - 1) + "\n".join(lines), self.path, "exec")
            exec(code, names)
            if not corrected:
                _declared.equations[index] = _declared.equations.pop()
            return self.equation(index, rows, corrected, names)
        except BaseException as error:  # an edited text may do anything
            if isinstance(error, KeyboardInterrupt):
                raise
            return {"failed": f"{type(error).__name__}: {error}"}
        finally:
            del _declared.equations[count:]
            _declared.equations[index] = entry
            entry.right = right


def _last_line(function):
    lines = [line for _, _, line in function.__code__.co_lines() if line is not None]
    return max(lines, default=function.__code__.co_firstlineno)


def _shaped(x):
    # Numbers as they come from the program: a number, a vector, a matrix.
    if isinstance(x, list):
        return Mat(x) if x and isinstance(x[0], list) else Vec(x)
    return x


class _Load:
    """A force and a moment on a body: .name, .body, .point (in the body's frame), .axes ("world" or
    "body"), .force, .moment (about the point)."""

    def __init__(self, entry):
        self.name, self.body, self.axes = entry["name"], entry["body"], entry["axes"]
        self.point, self.force = Vec(entry["point"]), Vec(entry["force"])
        self.moment = Vec(entry["moment"])


def _where(error, path):
    """File, line and function of the user's code in which an exception came up."""
    if isinstance(error, SyntaxError) and error.filename:
        return error.filename, error.lineno or 0, ""
    place = (path, 0, "")
    for frame, line in traceback.walk_tb(error.__traceback__):
        if frame.f_code.co_filename != __file__ and not frame.f_code.co_filename.startswith("<"):
            place = (frame.f_code.co_filename, line, frame.f_code.co_name)
    return place


def _kind(error):
    if isinstance(error, Unreachable):
        return "unreachable"
    if isinstance(error, ZeroDivisionError):
        return "singular"
    return "exception"


def _serve(path):
    """Answers on what was standard output; whatever the file prints goes to standard error, and
    there is nothing for it to read."""
    calls = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.dup2(2, 1)
    sys.stdin = open(nothing, encoding="utf-8")
    sys.stdout = sys.stderr
    folder = os.path.dirname(os.path.abspath(path))
    sys.path.insert(0, folder)
    # The file's own equations, and nothing else of mbverify: a witness asks no other one.
    package = types.ModuleType("mbverify")
    package.__path__ = []
    package.equations = sys.modules[__name__]
    sys.modules["mbverify"] = package
    sys.modules["mbverify.equations"] = sys.modules[__name__]
    host = _Host(path)
    for line in calls:
        call = json.loads(line)
        name = call.pop("do")
        try:
            answer = getattr(host, name)(**call)
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                raise
            file, at, function = _where(error, path)
            message = str(error) if isinstance(error, (Unreachable, SyntaxError)) else (
                f"{type(error).__name__}: {error}" if str(error) else type(error).__name__)
            if isinstance(error, SyntaxError):
                message = f"SyntaxError: {error.msg}"
            answer = {"error": {"kind": _kind(error), "message": message, "file": file, "line": at,
                                "function": function}}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    _serve(sys.argv[1])
