#!/usr/bin/env python3
"""The smallest witness: one body on a driven revolute joint of the world (docs/how-to/external_solvers.md).

    torque = (a.I a + m |a x r|^2) qdd - a.(r x m g)

with the axis a, and r from the axis to the centre of mass, turned by q.
"""
import csv
import json
import math
import os


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def times(R, v):
    return [dot(row, v) for row in R]


def back(R, v):
    return times(list(zip(*R)), v)


def turned(v, axis, q):
    """Rodrigues' formula."""
    along, side = dot(axis, v), cross(axis, v)
    return [math.cos(q) * x + math.sin(q) * s + (1 - math.cos(q)) * along * a
            for x, s, a in zip(v, side, axis)]


def why_not(m):
    if len(m["bodies"]) != 2 or len(m["joints"]) != 1 or m["joints"][0]["kind"] != "revolute":
        return "it is not a body on one revolute joint"
    if m["springs"] or m["elements"] or os.path.exists("start.csv") or len(open("loads.csv").readlines()) > 1:
        return "springs, force elements, loads and free motions are not known"
    return ""


m = json.load(open("mechanism.json"))
answer = {"schema": "mbverify/witness/1", "program": "pendulum.py", "version": "1", "units": "SI",
          "declined": [{"what": "joint reactions", "why": "only the torque is computed"}]}
answer["refused"] = why_not(m)
if not answer["refused"]:
    joint, body, drive = m["joints"][0], m["bodies"][1], m["drives"][0]["name"]
    F, M, a = joint["parent"], joint["child"], joint["axis"]
    if M["body"] != body["name"]:  # turned the other way round
        F, M, a = M, F, [-x for x in a]
    r = back(M["R"], [c - p for c, p in zip(body["centre_of_mass"], M["p"])])
    g, axis = back(F["R"], m["gravity"]), times(M["R"], a)
    inertia = dot(axis, times(body["inertia"], axis)) + body["mass"] * dot(cross(a, r), cross(a, r))
    with open("motion.csv") as motion, open("traces.csv", "w") as traces:
        traces.write(f"time_s,{drive}.position,{drive}.force\n")
        for row in csv.DictReader(motion):
            q, qdd = float(row[drive + ".position"]), float(row[drive + ".acceleration"])
            weight = dot(a, cross(turned(r, a, q), [body["mass"] * x for x in g]))
            traces.write(f"{row['time_s']},{q!r},{inertia * qdd - weight!r}\n")
json.dump(answer, open("witness.json", "w"))
