#!/usr/bin/env python3
"""Writes pose.csv: a platform that rolls, pitches and heaves, as a tracker exports it: mm and quaternions."""
import math
import pathlib


def quaternion(roll, pitch, yaw):
    """w, x, y, z of Rz(yaw) Ry(pitch) Rx(roll)."""
    (sr, cr), (sp, cp), (sy, cy) = [(math.sin(a / 2), math.cos(a / 2)) for a in (roll, pitch, yaw)]
    return (cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy)


def rows():
    for i in range(101):
        t = i / 50
        p = math.pi * t
        q = quaternion(0.10 * math.sin(p), 0.06 * math.sin(2 * p), 0.15 * (1 - math.cos(p)))
        yield t, 10 * math.sin(p), 5 * math.sin(2 * p), 20 * (1 - math.cos(p)), q


lines = ["# by tables/make_pose.py", "t (s),x (mm),y (mm),z (mm),qw,qx,qy,qz"]
lines += [f"{t:.2f},{x:.9f},{y:.9f},{z:.9f}," + ",".join(f"{c:.12f}" for c in q)
          for t, x, y, z, q in rows()]
pathlib.Path(__file__).with_name("pose.csv").write_text("\n".join(lines) + "\n")
