"""Commands of the program, with their results as objects."""

import base64
import csv
import functools
import html
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import weakref

import numpy

from . import _native


class ProgramError(RuntimeError):
    """The program ended in a way that its results do not report; `exit_code`, `text`."""

    def __init__(self, message, exit_code, text):
        super().__init__(message)
        self.exit_code = exit_code
        self.text = text


def program():
    """The path of the program `mbverify`: $MBVERIFY, the one that this package was built or
    installed with, or the one on PATH."""
    stated = os.environ.get("MBVERIFY")
    if stated:
        return stated
    for folder in pathlib.Path(__file__).resolve().parents[1:]:
        for candidate in (folder / "mbverify", folder / "bin" / "mbverify"):
            if candidate.is_file() and os.access(candidate, os.X_OK):
                return str(candidate)
    found = shutil.which("mbverify")
    if found:
        return found
    raise FileNotFoundError("the program mbverify is neither beside this package nor on PATH")


def _findings_of(document):
    """All findings of a command's JSON, wherever they are."""
    found = []
    if isinstance(document, dict):
        found += [f for f in document.get("findings", []) if isinstance(f, dict)]
        for key, value in document.items():
            if key != "findings":
                found += _findings_of(value)
    elif isinstance(document, list):
        for value in document:
            found += _findings_of(value)
    return found


def _call(*arguments, allowed=(0, 1, 3), progress=False):
    """Runs `mbverify ARGUMENTS… --json FILE`; its document, exit code and text."""
    with tempfile.TemporaryDirectory(prefix="mbverify_") as folder:
        file = os.path.join(folder, "result.json")
        done = subprocess.run(
            [program(), *map(str, arguments), "--json", file],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=None if progress else subprocess.PIPE,
            check=False,
        )
        text = ((done.stderr or b"") + done.stdout).decode("utf-8", "replace")
        document = None
        if os.path.exists(file):
            with open(file, encoding="utf-8") as stream:
                document = json.load(stream)
    if done.returncode == 2:
        error = _native.InputError(text.strip())
        error.findings = [
            _native.Finding(
                f["severity"] == "error", f["file"], f["line"], f["column"], f["message"], f["hint"]
            )
            for f in _findings_of(document)
        ]
        raise error
    if document is None or done.returncode not in allowed:
        how = f"signal {-done.returncode}" if done.returncode < 0 else f"code {done.returncode}"
        raise ProgramError(f"mbverify ended with {how}: {text.strip()}", done.returncode, text)
    return document, done.returncode, text


class _Folder:
    """Where results go: the caller's folder, or one that lives as long as this."""

    def __init__(self, out):
        self.path = pathlib.Path(out or tempfile.mkdtemp(prefix="mbverify_"))
        if not out:
            weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)


def _set(values):
    arguments = []
    for key, value in (values or {}).items():
        arguments += ["--set", f"{key}={value}"]
    return arguments


class _Result:
    def __init__(self, summary, folder, keep, text):
        self.summary = summary
        self.folder = folder
        self.text = text
        self._keep = keep


class Result(_Result):
    """What `mbverify run` says of one scenario.

    `summary` is its summary.json (docs/reference/json.md), `folder` the folder with its files.
    """

    def __init__(self, summary, folder, keep, text, draw=lambda: None):
        super().__init__(summary, folder, keep, text)
        self._traces = None
        self._draw = functools.cache(draw)

    @property
    def verdict(self):
        """'agree', 'disagree' or 'not_run'."""
        return self.summary.get("verdict", "not_run")

    @property
    def passed(self):
        return self.verdict == "agree"

    @property
    def checks(self):
        """Each check: a dict with name, value, limit, pass, time_s, channel."""
        return self.summary.get("checks", [])

    @property
    def worst(self):
        """The check that is nearest to its limit, or farthest beyond it; None without checks."""
        ratio = lambda check: float("inf") if check["value"] is None else check["value"] / check["limit"]
        return max(self.checks, key=ratio, default=None)

    @property
    def traces(self):
        """The columns of traces.csv by name, as arrays; `time_s` is the first."""
        if self._traces is None:
            with open(self.folder / "traces.csv", encoding="utf-8", newline="") as stream:
                names = next(csv.reader(stream))
                values = numpy.loadtxt(stream, delimiter=",", ndmin=2)
            self._traces = {name: values[:, k] for k, name in enumerate(names)}
        return self._traces

    def to_pandas(self):
        """The traces as a pandas.DataFrame with time_s as its index."""
        import pandas

        return pandas.DataFrame(self.traces).set_index("time_s")

    def __repr__(self):
        name = f"{self.summary.get('mechanism', '')}/{self.summary.get('scenario', '')}"
        return f"<mbverify.Result {name}: {self.verdict}>"

    def _repr_html_(self):
        escape = lambda value: html.escape(str(value))
        name = f"{self.summary.get('mechanism', '')}/{self.summary.get('scenario', '')}"
        number = lambda value: "–" if value is None else f"{value:.3g}"
        rows = "".join(
            f"<tr><td>{'✓' if check['pass'] else '✗'}</td><td style='text-align:left'>"
            f"{escape(check['name'])}</td><td>{number(check['value'])}</td>"
            f"<td>{number(check['limit'])}</td><td style='text-align:left'>"
            f"{escape(check['channel'])}</td></tr>"
            for check in self.checks
        )
        caveats = "".join(f"<li>{escape(c['text'])}</li>" for c in self.summary.get("caveats", []))
        picture = self._draw()
        if picture:
            data = base64.b64encode(picture).decode("ascii")
            picture = f"<img alt='drive forces' style='max-width:36em' src='data:image/png;base64,{data}'>"
        colour = {"agree": "#1a7f37", "disagree": "#b42318"}.get(self.verdict, "#8a6d00")
        return (
            f"<div><b style='color:{colour}'>{escape(self.verdict.upper().replace('_', ' '))}</b> "
            f"{escape(name)}<table><tr><th></th><th>check</th><th>value</th><th>limit</th>"
            f"<th>where</th></tr>{rows}</table>"
            + (f"<ul>{caveats}</ul>" if caveats else "")
            + (picture or "")
            + "</div>"
        )


def run(scenario, *, set=None, out=None, pictures=False, trust=False, progress=False):
    """Runs a scenario, a robot's file (URDF, MJCF) or a stiffness file; its Result.

    `set`: other values, as `--set` takes them: {"simulation.step_s": 0.0005}. `out`: the folder for
    the results; without it they live as long as the Result. `trust`: programs that the scenario
    names may run. Raises InputError for bad input; a scenario that cannot run is a Result with
    verdict 'not_run'.
    """
    folder = _Folder(out)
    document, _, text = _call(
        "run",
        scenario,
        *_set(set),
        "--out",
        folder.path,
        *([] if pictures else ["--no-pictures"]),
        *(["--trust"] if trust else []),
        progress=progress,
    )
    results = document["results"]
    if len(results) != 1:
        raise ValueError(f"{scenario} names {len(results)} scenarios: run() takes one")
    summary = results[0]
    place = folder.path / summary["mechanism"] / summary["scenario"]
    return Result(summary, place, folder, text, lambda: _drive_forces(scenario, set, trust))


def _drive_forces(scenario, set, trust):
    """Their figure as PNG; None where there is none."""
    with tempfile.TemporaryDirectory(prefix="mbverify_") as folder:
        try:
            files = figures(
                scenario, out=folder, formats=["png"], only=["drive_forces"], set=set, trust=trust
            )
        except (_native.InputError, ProgramError):
            return None
        return files[0].read_bytes() if files else None


def audit(model=None):
    """Each equation of a paper as printed and as corrected: the document of `mbverify audit`."""
    return _call("audit", *([model] if model else []))[0]


class StudyResult(_Result):
    """What `mbverify study` says: `summary` is its summary.json, `folder` has its files."""

    @property
    def quantities(self):
        return self.summary.get("quantities", [])

    def to_pandas(self):
        """The points, one a row, as a pandas.DataFrame."""
        import pandas

        return pandas.read_csv(self.folder / "points.csv")


def study(file, *, count=None, seed=None, jobs=None, out=None, progress=False):
    """Runs a study; its StudyResult. `count` and `seed` instead of the file's, `jobs` processes
    (all cores). Raises InputError for bad input."""
    folder = _Folder(out)
    options = []
    for name, value in (("--count", count), ("--seed", seed), ("--jobs", jobs)):
        if value is not None:
            options += [name, value]
    document, _, text = _call("study", file, *options, "--out", folder.path, progress=progress)
    return StudyResult(document, folder.path / document["study"], folder, text)


class WorkspaceResult(_Result):
    """What `mbverify workspace` says of a reachable set: `summary` is its JSON, `folder` has its
    files. SI units and radians."""

    @property
    def agrees(self):
        """Whether all ways to the measure agree."""
        return self.summary["agree"]

    @property
    def measure(self):
        """Length, area or volume by the traced boundary, and its error."""
        traced = self.summary["set"]["traced"]
        return traced["value"], traced["error"]

    @property
    def coordinates(self):
        """The names of the free ones."""
        return [over["name"] for over in self.summary["set"]["over"]]

    @property
    def quality(self):
        """Each index by name: unit, mean with its error, least and most and where."""
        return {index["name"]: index for index in self.summary["set"]["quality"]}

    @functools.cached_property
    def boundary(self):
        """Columns of reachable_boundary.csv: section, loop, arc, coordinates with their units,
        bound and kind of what ends the set there (strings)."""
        return _columns(self.folder / "reachable_boundary.csv")

    @functools.cached_property
    def cells(self):
        """Columns of reachable_poses.csv, the corners of the lattice: coordinates with their units,
        inside (0 or 1), bound, and each quality; NaN where it is not defined."""
        return _columns(self.folder / "reachable_poses.csv")

    @property
    def surface(self):
        """Of three coordinates: corners (n × 3) and triangles (m × 3) of the boundary."""
        with open(self.folder / "reachable.ply", encoding="utf-8") as stream:
            counts = []
            for line in stream:
                words = line.split()
                if words[0] == "element":
                    counts.append(int(words[2]))
                if words[0] == "end_header":
                    break
            rows = [line.split() for line in stream]
        vertices = numpy.array([row[:3] for row in rows[: counts[0]]], dtype=float)
        triangles = numpy.array([row[1:4] for row in rows[counts[0] : sum(counts)]], dtype=int)
        return vertices, triangles

    def __repr__(self):
        value, error = self.measure
        how = "agree" if self.agrees else "disagree"
        return f"<mbverify.WorkspaceResult {value:.6g} ± {error:.1g} {self.summary['set']['unit']}: {how}>"


def _columns(file, text=("bound", "kind")):
    """A CSV file's columns by name: those of `text` as strings, else numbers, NaN where empty."""
    with open(file, encoding="utf-8", newline="") as stream:
        rows = list(csv.reader(stream))
    columns = {}
    for k, name in enumerate(rows[0]):
        values = [row[k] for row in rows[1:]]
        if name in text:
            columns[name] = values
        else:
            columns[name] = numpy.array([float(value or "nan") for value in values])
    return columns


def _workspace(model, folder, over, values, more, progress):
    """The document and text of `mbverify workspace` for the arguments of workspace()."""
    options = []
    boxes = over if isinstance(over, dict) else {name: None for name in over}
    cones = {
        f"{joint}_deg": numpy.degrees(angle) for joint, angle in (values["cones"] or {}).items()
    }
    for option, named in (
        ("--over", boxes),
        ("--at", values["at"]),
        ("--from", values["start"]),
        ("--range", values["ranges"]),
        ("--for-all", values["for_all"]),
        ("--for-some", values["for_some"]),
        ("--cone", cones),
    ):
        for name, value in (named or {}).items():
            if value is not None:
                ends = value if isinstance(value, (tuple, list)) else (value,)
                name += "=" + ":".join(repr(float(end)) for end in ends)
            options += [option, name]
    for option, value in (
        ("--output", values["output"]),
        ("--resolution", values["resolution"]),
        ("--jobs", values["jobs"]),
    ):
        if value is not None:
            options += [option, value]
    if values["cross_singularities"]:
        options.append("--cross-singularities")
    document, _, text = _call(
        "workspace",
        model,
        *options,
        *more,
        *_set(values["set"]),
        "--no-pictures",
        "--out",
        folder.path,
        allowed=(0, 1),
        progress=progress,
    )
    return document, folder.path / document["mechanism"] / "workspace", text


def workspace(
    model,
    over,
    *,
    at=None,
    start=None,
    ranges=None,
    for_all=None,
    for_some=None,
    cones=None,
    output=None,
    resolution=None,
    cross_singularities=False,
    set=None,
    jobs=None,
    out=None,
    progress=False,
):
    """Where a model reaches over one to three coordinates; its WorkspaceResult.

    `over`: names, or {name: (low, high)} with a box (None: without). `at` and `start` (--from):
    {name: value}. `ranges`, `for_all` and `for_some`: {name: (low, high)}; `cones`: {joint: angle}
    [rad]. Names may end in _mm or _deg. Raises InputError for bad input.
    """
    values = dict(locals())
    folder = _Folder(out)
    document, place, text = _workspace(model, folder, over, values, (), progress)
    return WorkspaceResult(document, place, folder, text)


class BestDesign(_Result):
    """What `mbverify workspace --maximise volume` says: `summary` is its JSON, `folder` has its
    files. SI units and radians."""

    @property
    def agrees(self):
        """Whether the lattice measures the best design's set as its boundary does, and no design
        that it looked at is larger."""
        return self.summary["agree"]

    @property
    def parameters(self):
        """{name: value} of the best design, as workspace(…, set=…) takes them."""
        return {p["name"]: p["best"] for p in self.summary["best_design"]["parameters"]}

    @property
    def measure(self):
        """The best design's length or area by its boundary, and its error."""
        traced = self.summary["best_design"]["traced"]
        return traced["value"], traced["error"]

    @property
    def designs(self):
        """Columns of designs.csv, one row per design that was measured."""
        return _columns(self.folder / "designs.csv", ("way", "why_none"))

    def __repr__(self):
        how = "agree" if self.agrees else "disagree"
        return f"<mbverify.BestDesign of {self.summary['mechanism']}: {how}>"


def best_design(
    model,
    over,
    parameters,
    *,
    local=False,
    evaluations=None,
    seed=None,
    at=None,
    start=None,
    ranges=None,
    for_all=None,
    for_some=None,
    cones=None,
    output=None,
    resolution=None,
    cross_singularities=False,
    set=None,
    jobs=None,
    out=None,
    progress=False,
):
    """The design whose set over one or two coordinates is largest; its BestDesign.

    `parameters`: {name: (low, high)} of the model, whose names may end in _mm or _deg; `local`
    searches from the model's own values alone. All others as of workspace().
    """
    values = dict(locals())
    folder = _Folder(out)
    more = ["--maximise", "volume"]
    for name, (low, high) in parameters.items():
        more += ["--over-parameters", f"{name}={float(low)!r}:{float(high)!r}"]
    if local:
        more.append("--local")
    for option, value in (("--evaluations", evaluations), ("--seed", seed)):
        if value is not None:
            more += [option, value]
    document, place, text = _workspace(model, folder, over, values, more, progress)
    return BestDesign(document, place, folder, text)


class Linearisation(_Result):
    """What `mbverify linearise` says of a mechanism about a state: `summary` is its JSON, `folder`
    has its files. SI units and radians."""

    @property
    def agrees(self):
        """Whether all ways to the derivatives agree."""
        return self.summary["agree"]

    @property
    def coordinates(self):
        """Their names: the order of rows and columns."""
        return self.summary["coordinates"]

    def matrix(self, name):
        """`A`, `B`, `M`, `K`, `D`, `J_d`, `f_q`, `f_v` or `f_a` as an array; `force_q`, `force_v`
        or `force_a`: derivatives of drive forces and reactions, a row per force_channels."""
        if name in self._OF_FORCES:
            rows = self.summary["forces"][self._OF_FORCES[name]]
            return numpy.array(rows, dtype=float).reshape(len(rows), len(self.coordinates))
        return numpy.array(self.summary[name], dtype=float)

    _OF_FORCES = {"force_q": "by_position", "force_v": "by_velocity", "force_a": "by_acceleration"}

    @property
    def force_channels(self):
        """Drive forces and those reactions that are unique, named as in traces."""
        return self.summary["forces"]["channels"]

    @property
    def eigenvalues(self):
        """One per mode, with imaginary parts of at least 0 [1/s]."""
        return numpy.array([complex(*mode["eigenvalue"]) for mode in self.summary["modes"]])

    @property
    def frequencies(self):
        """Of the modes [Hz]."""
        return numpy.array([mode["frequency_hz"] for mode in self.summary["modes"]])

    @property
    def shapes(self):
        """Columns: the modes in the coordinates (complex)."""
        return numpy.array(
            [
                numpy.array(mode["shape_real"]) + 1j * numpy.array(mode["shape_imaginary"])
                for mode in self.summary["modes"]
            ]
        ).T

    def __repr__(self):
        how = "agree" if self.agrees else "disagree"
        return f"<mbverify.Linearisation of {self.summary['mechanism']}: {how}>"


def linearise(
    model,
    *,
    coordinates=(),
    at=None,
    rates=None,
    forces=None,
    no_forces=False,
    equilibrium=False,
    servos=False,
    time=None,
    data=(),
    set=None,
    out=None,
):
    """A mechanism about a state; its Linearisation.

    `at`, `rates` and `forces` (of drives): {name: value}; names of `at` and `rates` may end in _mm
    or _deg. With `time` [s] `model` is a scenario, whose motion and loads at this instant are the
    state. `data=["mat"]` also writes linearise.mat. Raises InputError for bad input.
    """
    folder = _Folder(out)
    options = []
    for option, values in (("--at", at), ("--rate", rates), ("--force", forces)):
        for name, value in (values or {}).items():
            options += [option, f"{name}={float(value)!r}"]
    for name in coordinates:
        options += ["--coordinates", name]
    for option, wanted in (
        ("--no-forces", no_forces),
        ("--equilibrium", equilibrium),
        ("--servos", servos),
    ):
        if wanted:
            options.append(option)
    if time is not None:
        options += ["--time", repr(float(time))]
    for word in data:
        options += ["--data", word]
    document, _, text = _call(
        "linearise", model, *options, *_set(set), "--out", folder.path, allowed=(0, 1)
    )
    place = folder.path / document["mechanism"] / "linearise"
    return Linearisation(document, place, folder, text)


def figures(
    scenario, *, out, formats=("pdf", "svg"), style=None, only=(), set=None, trust=False
):
    """Figures for a paper of a scenario, in the folder `out`: the paths of the files. `set` and
    `trust` as of run()."""
    document, _, _ = _call(
        "figures",
        scenario,
        "--out",
        out,
        "--formats",
        ",".join(formats),
        *(["--style", style] if style else []),
        *(["--only", *only] if only else []),
        *_set(set),
        *(["--trust"] if trust else []),
    )
    return [
        pathlib.Path(result["folder"]) / file
        for result in document["results"]
        for figure in result["figures"]
        for file in figure["files"]
    ]
