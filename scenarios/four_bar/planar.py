#!/usr/bin/env python3
"""An external solver: planar mechanisms of bars and sliders, without any library.

mbverify calls it in a folder with mechanism.json, motion.csv and loads.csv (docs/how-to/external_solvers.md); it
leaves witness.json and traces.csv there. Every body has three coordinates (x, y, angle from home) in
the plane of motion. Joints and drives are rows Phi(q, t) = 0; per sample Newton's method finds q, and

    Phi_q qd = Phi_d',   Phi_q qdd = Phi_d'' - bias,   Phi_q^T f = M qdd - Q

give rates, accelerations and the forces f of the rows: those of the drives' rows are their forces.
"""
import csv
import json
import math
import os

PLAIN = ("revolute", "prismatic", "fixed")


class NotApplicable(Exception):
    pass


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(R, v):
    return [dot(row, v) for row in R]


def perp(v):
    return [-v[1], v[0]]


def turned(v, angle):
    c, s = math.cos(angle), math.sin(angle)
    return [c * v[0] - s * v[1], s * v[0] + c * v[1]]


def solve(A, b):
    """Gaussian elimination with pivots."""
    n = len(b)
    rows = [list(A[i]) + [b[i]] for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        if abs(rows[pivot][k]) < 1e-12:
            raise NotApplicable("the rows of joints and drives are singular")
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(k + 1, n):
            factor = rows[i][k] / rows[k][k]
            for j in range(k, n + 1):
                rows[i][j] -= factor * rows[k][j]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (rows[i][n] - dot(rows[i][i + 1:n], x[i + 1:])) / rows[i][i]
    return x


class Planar:
    def __init__(self, mechanism):
        self.m = mechanism
        for what in ("springs", "couplings", "bushings", "elements", "prescribed"):
            if mechanism[what]:
                raise NotApplicable(f"it has {what}")
        self.bodies = {body["name"]: body for body in mechanism["bodies"]}
        self.index = {body["name"]: k - 1 for k, body in enumerate(mechanism["bodies"])}
        self.joints = {joint["name"]: joint for joint in mechanism["joints"]}
        self.find_plane()
        self.rows = []  # (function of the state, drive or None)
        for joint in mechanism["joints"]:
            self.add_joint(joint)
        for drive in mechanism["drives"]:
            self.add_drive(drive)
        if len(self.rows) != 3 * (len(self.bodies) - 1):
            raise NotApplicable(f"{len(self.rows)} rows of joints and drives for "
                           f"{3 * (len(self.bodies) - 1)} coordinates")

    # --- the plane -----------------------------------------------------------------------------
    def axis_at_home(self, joint):
        parent = joint["parent"]
        return times(self.bodies[parent["body"]]["home"]["R"], times(parent["R"], joint["axis"]))

    def find_plane(self):
        turns = [self.axis_at_home(j) for j in self.joints.values() if j["kind"] == "revolute"]
        if not turns or any(j["kind"] not in PLAIN for j in self.joints.values()):
            raise NotApplicable("only revolute, prismatic and fixed joints are known")
        self.n = turns[0]
        slides = [self.axis_at_home(j) for j in self.joints.values() if j["kind"] == "prismatic"]
        if (any(math.hypot(*cross(self.n, a)) > 1e-9 for a in turns)
                or any(abs(dot(self.n, a)) > 1e-9 for a in slides)):
            raise NotApplicable("it does not move in a plane")
        away = min(([1, 0, 0], [0, 1, 0], [0, 0, 1]), key=lambda e: abs(dot(e, self.n)))
        e1 = cross(away, self.n)
        self.e1 = [x / math.hypot(*e1) for x in e1]
        self.e2 = cross(self.n, self.e1)

    def flat(self, v):
        return [dot(self.e1, v), dot(self.e2, v)]

    def arm(self, body, p_B):
        """A point of a body from its origin, at home, in the plane."""
        return self.flat(times(self.bodies[body]["home"]["R"], p_B))

    # --- rows: each gives (residual, {coordinate: derivative}, bias) -----------------------------
    def point(self, body, arm, q, qd):
        """Position, derivative by the angle and bias of a point."""
        k = 3 * self.index[body]
        home = self.flat(self.bodies[body]["home"]["p"])
        if k < 0:
            return [home[i] + arm[i] for i in (0, 1)], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], k
        r = turned(arm, q[k + 2])
        rate = qd[k + 2]
        return ([home[i] + q[k + i] + r[i] for i in (0, 1)], perp(r),
                [qd[k + i] + rate * perp(r)[i] for i in (0, 1)],
                [-rate * rate * r[i] for i in (0, 1)], k)

    def along(self, t, a, b):
        """Derivative of t . (b - a) by the coordinates of both points."""
        row = {}
        for (_, turn, _, _, k), sign in ((a, -1.0), (b, 1.0)):
            if k >= 0:
                for i, entry in ((0, t[0]), (1, t[1]), (2, dot(t, turn))):
                    row[k + i] = row.get(k + i, 0.0) + sign * entry
        return row

    def meet(self, i, ends):
        def row(q, qd):
            a, b = (self.point(body, arm, q, qd) for body, arm in ends)
            t = [1.0 - i, float(i)]
            return b[0][i] - a[0][i], self.along(t, a, b), b[3][i] - a[3][i]
        return row

    def slide(self, t_home, ends):
        """t . (b - a) with a direction t that turns with the first body."""
        def row(q, qd):
            a, b = (self.point(body, arm, q, qd) for body, arm in ends)
            k = a[4]
            angle, rate = (q[k + 2], qd[k + 2]) if k >= 0 else (0.0, 0.0)
            t = turned(t_home, angle)
            d, v, c = ([b[j][i] - a[j][i] for i in (0, 1)] for j in (0, 2, 3))
            entries = self.along(t, a, b)
            if k >= 0:
                entries[k + 2] += dot(perp(t), d)
            return dot(t, d), entries, dot(t, c) + 2 * rate * dot(perp(t), v) - rate * rate * dot(t, d)
        return row

    def distance(self, ends):
        def row(q, qd):
            a, b = (self.point(body, arm, q, qd) for body, arm in ends)
            d, v, c = ([b[j][i] - a[j][i] for i in (0, 1)] for j in (0, 2, 3))
            length = math.hypot(*d)
            u = [x / length for x in d]
            return length, self.along(u, a, b), dot(u, c) + (dot(v, v) - dot(u, v) ** 2) / length
        return row

    def angle(self, parent, child, factor=1.0, offset=0.0):
        def row(q, qd):
            entries, value = {}, offset
            for body, sign in ((parent, -factor), (child, factor)):
                k = 3 * self.index[body]
                if k >= 0:
                    entries[k + 2] = sign
                    value += sign * q[k + 2]
            return value, entries, 0.0
        return row

    def ends(self, joint):
        return [(joint[side]["body"], self.arm(joint[side]["body"], joint[side]["p"]))
                for side in ("parent", "child")]

    def add_joint(self, joint):
        ends = self.ends(joint)
        parent, child = ends[0][0], ends[1][0]
        if joint["kind"] in ("revolute", "fixed"):
            self.rows += [(self.meet(i, ends), None) for i in (0, 1)]
        else:
            self.rows.append((self.slide(perp(self.flat(self.axis_at_home(joint))), ends), None))
        if joint["kind"] != "revolute":
            self.rows.append((self.angle(parent, child), None))

    def add_drive(self, drive):
        if "between" in drive:
            ends = [(end["body"], self.arm(end["body"], end["p"])) for end in drive["between"]]
            row = self.distance(ends)
        else:
            joint = self.joints[drive["on"]["joint"]]
            if joint["kind"] == "revolute":
                row = self.angle(joint["parent"]["body"], joint["child"]["body"],
                                 dot(self.axis_at_home(joint), self.n), joint["home"][0])
            else:
                row = self.slide(self.flat(self.axis_at_home(joint)), self.ends(joint))
        self.rows.append((row, drive["name"]))

    # --- one sample ------------------------------------------------------------------------------
    def evaluate(self, q, qd):
        residual, matrix, bias = [], [], []
        for row, _ in self.rows:
            value, entries, rest = row(q, qd)
            residual.append(value)
            matrix.append([entries.get(k, 0.0) for k in range(len(self.rows))])
            bias.append(rest)
        return residual, matrix, bias

    def driven(self, sample, what):
        return [0.0 if drive is None else sample[f"{drive}.{what}"] for _, drive in self.rows]

    def forces(self, q, qdd, loads):
        """M qdd - Q about the bodies' origins."""
        out = [0.0] * len(q)
        for name, body in self.bodies.items():
            k = 3 * self.index[name]
            if k < 0:
                continue
            c = turned(self.arm(name, body["centre_of_mass"]), q[k + 2])
            rate = self.qd[k + 2]
            g = self.flat(self.m["gravity"])
            f = [body["mass"] * (qdd[k + i] + qdd[k + 2] * perp(c)[i] - rate * rate * c[i] - g[i])
                 for i in (0, 1)]
            R = body["home"]["R"]
            n_B = [sum(R[i][j] * self.n[i] for i in range(3)) for j in range(3)]
            inertia = dot(n_B, times(body["inertia"], n_B))
            for i, entry in enumerate((f[0], f[1], dot(perp(c), f) + inertia * qdd[k + 2])):
                out[k + i] += entry
        for load in loads:
            k = 3 * self.index[load["body"]]
            if k < 0:
                continue
            f, m = ([float(load[s + x]) for x in "xyz"] for s in "fm")
            if load["axes"] == "body":
                R = self.bodies[load["body"]]["home"]["R"]
                f, m = turned(self.flat(times(R, f)), q[k + 2]), dot(self.n, times(R, m))
            else:
                f, m = self.flat(f), dot(self.n, m)
            r = turned(self.arm(load["body"], [float(load["p" + x]) for x in "xyz"]), q[k + 2])
            for i, entry in enumerate((f[0], f[1], m + dot(perp(r), f))):
                out[k + i] -= entry
        return out

    def sample(self, motion, loads, q):
        zero = [0.0] * len(q)
        for _ in range(50):
            residual, J, _ = self.evaluate(q, zero)
            step = solve(J, [want - is_ for want, is_ in zip(self.driven(motion, "position"), residual)])
            q = [x + dx for x, dx in zip(q, step)]
            if max(map(abs, step)) < 1e-13:
                break
        else:
            raise NotApplicable(f"no closed loops at t = {motion['time_s']} s")
        self.qd = solve(J, self.driven(motion, "velocity"))
        residual, J, bias = self.evaluate(q, self.qd)
        qdd = solve(J, [a - b for a, b in zip(self.driven(motion, "acceleration"), bias)])
        transposed = [list(column) for column in zip(*J)]
        f = solve(transposed, self.forces(q, qdd, loads))
        record = {"time_s": motion["time_s"]}
        for k, (_, drive) in enumerate(self.rows):
            if drive is not None:
                for what, values in (("position", residual),
                                     ("velocity", [dot(row, self.qd) for row in J])):
                    record[f"{drive}.{what}"] = values[k]
                record[f"{drive}.force"] = f[k]
        return q, record


def main():
    answer = {"schema": "mbverify/witness/1", "program": "planar.py", "version": "1", "units": "SI",
              "method": "planar bodies in absolute coordinates, Lagrange multipliers",
              "declined": [{"what": "joint reactions", "why": "only drive forces are computed"}]}
    try:
        if os.path.exists("start.csv"):
            raise NotApplicable("free motions need an integrator, which it has not")
        with open("mechanism.json") as file:
            planar = Planar(json.load(file))
        with open("motion.csv") as file:
            motion = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file)]
        loads = {}
        with open("loads.csv") as file:
            for row in csv.DictReader(file):
                loads.setdefault(float(row["time_s"]), []).append(row)
        q, records = [0.0] * len(planar.rows), []
        for sample in motion:
            q, record = planar.sample(sample, loads.get(sample["time_s"], []), q)
            records.append(record)
        with open("traces.csv", "w") as file:
            writer = csv.DictWriter(file, records[0].keys(), lineterminator="\n")
            writer.writeheader()
            for record in records:
                writer.writerow({k: repr(v) for k, v in record.items()})
    except NotApplicable as why:
        answer["refused"] = str(why)
    with open("witness.json", "w") as file:
        json.dump(answer, file, indent=1)


if __name__ == "__main__":
    main()
