#!/usr/bin/env python3
"""Writes the tables of this folder: one turn of the four-bar linkage by a textbook's closed form.

Independent of mbverify: loop closure by the circle intersection, first and second kinematic
coefficients from the differentiated loop equation, and Eksergian's equation of motion
  torque = I(a) a'' + I'(a) a'^2 / 2 + V'(a)
with the generalised inertia I and the potential V of three slender bars under gravity -y.
The motion is a cycloid: a(t) = pi/2 + 2 pi (s - sin(2 pi s)/(2 pi)), s = t / 2 s.
"""
import math
import pathlib

CRANK, COUPLER, ROCKER, GROUND = 0.15, 0.35, 0.30, 0.40  # m
RHO, BAR, G = 2.0, 0.009, 9.81                            # kg/m, m (not needed: spin axis is z), m/s^2


def torque(a, w, acc):
    """Crank torque [N m] and rocker angle [rad]."""
    bx, by = CRANK * math.cos(a), CRANK * math.sin(a)
    d = math.hypot(GROUND - bx, by)
    to_d = math.atan2(-by, GROUND - bx)
    b = to_d + math.acos((COUPLER**2 + d**2 - ROCKER**2) / (2 * COUPLER * d))  # coupler angle
    cx, cy = bx + COUPLER * math.cos(b), by + COUPLER * math.sin(b)
    c = math.atan2(cy, cx - GROUND)                                            # rocker angle
    # crank + coupler - rocker - ground = 0, differentiated once and twice by the crank angle.
    det = COUPLER * ROCKER * math.sin(b - c)
    kb = CRANK * ROCKER * math.sin(c - a) / det
    kc = CRANK * COUPLER * math.sin(b - a) / det
    rx = CRANK * math.cos(a) + COUPLER * math.cos(b) * kb**2 - ROCKER * math.cos(c) * kc**2
    ry = CRANK * math.sin(a) + COUPLER * math.sin(b) * kb**2 - ROCKER * math.sin(c) * kc**2
    # -COUPLER sin b kb' + ROCKER sin c kc' = rx ;  COUPLER cos b kb' - ROCKER cos c kc' = ry
    lb = (-rx * math.cos(c) - ry * math.sin(c)) / (COUPLER * math.sin(b - c))
    lc = (-rx * math.cos(b) - ry * math.sin(b)) / (ROCKER * math.sin(b - c))
    m1, m2, m3 = RHO * CRANK, RHO * COUPLER, RHO * ROCKER
    j1, j2, j3 = m1 * CRANK**2 / 3, m2 * COUPLER**2 / 12, m3 * ROCKER**2 / 3
    # Centre of the coupler: first and second coefficients.
    ux = -CRANK * math.sin(a) - COUPLER / 2 * math.sin(b) * kb
    uy = CRANK * math.cos(a) + COUPLER / 2 * math.cos(b) * kb
    vx = -CRANK * math.cos(a) - COUPLER / 2 * (math.cos(b) * kb**2 + math.sin(b) * lb)
    vy = -CRANK * math.sin(a) + COUPLER / 2 * (-math.sin(b) * kb**2 + math.cos(b) * lb)
    inertia = j1 + m2 * (ux**2 + uy**2) + j2 * kb**2 + j3 * kc**2
    half_slope = m2 * (ux * vx + uy * vy) + j2 * kb * lb + j3 * kc * lc
    gravity = G * (m1 * CRANK / 2 * math.cos(a) + m2 * uy + m3 * ROCKER / 2 * math.cos(c) * kc)
    return inertia * acc + half_slope * w**2 + gravity, c


def motion(t):
    s = t / 2.0
    a = math.pi / 2 + 2 * math.pi * (s - math.sin(2 * math.pi * s) / (2 * math.pi))
    return a, math.pi * (1 - math.cos(2 * math.pi * s)), math.pi**2 * math.sin(2 * math.pi * s)


def rows(step):
    for i in range(round(2.0 / step) + 1):
        t = i * step
        a, w, acc = motion(t)
        yield (i, t, a, *torque(a, w, acc))


def rounds(n):
    """Angle and speed over one second: a turn with two harmonics."""
    for i in range(n + 1):
        p = 2 * math.pi * i / n
        yield (i, math.pi / 2 + p + 0.3 * math.sin(p) + 0.05 * math.cos(2 * p) - 0.05,
               2 * math.pi * (1 + 0.3 * math.cos(p) - 0.1 * math.sin(2 * p)))


def write(name, lines, end="\n"):
    here = pathlib.Path(__file__).parent
    (here / name).write_bytes((end.join(lines) + end).encode())


def noise(i):
    """Pseudo-random, uniform in -1 … 1; the same everywhere."""
    return ((i + 1) * 1103515245 * (i + 7) + 12345) % 65536 / 32767.5 - 1


def main():
    how = "# four-bar linkage, one turn; by tables/make_tables.py (Eksergian's equation), "
    # MATLAB's writetable: commas, quoted headings with units, six digits.
    write("matlab.csv", [how + "6 digits", '"t (s)","crank angle (deg)","torque (N*m)"'] +
          [f"{t:.6g},{math.degrees(a):.6g},{m:.6g}" for _, t, a, m, _ in rows(0.01)])
    # ADAMS: tabs, a unit row; torque on the ground instead of the crank; time from 0.5 s on, in ms.
    write("adams.tab", [how + "4 decimals", "TIME\tMOTION_1.TM\tJOINT_D.AZ",
                        "(msec)\t(newton-mm)\t(deg)"] +
          [f"{1000 * t + 500:.3f}\t{-1000 * m:.4f}\t{math.degrees(c):.4f}"
           for _, t, _, m, c in rows(0.02)])
    # A German Excel: semicolons, decimal commas, three decimals only, Windows line ends, BOM.
    write("excel.csv", ["\ufeffZeit;Moment", "s;N m"] +
          [f"{t:.2f};{m:.3f}".replace(".", ",") for _, t, _, m, _ in rows(0.02)], "\r\n")
    # A measurement: 5 mN m of noise.
    write("noisy.csv", [how + "noise of 5 mN m", "time_s,motor.force"] +
          [f"{t:.3f},{m + 5e-3 * noise(i):.5f}" for i, t, _, m, _ in rows(0.01)])
    # An encoder on the crank: ten bits more than a degree, 0.01 deg of noise, every 5 ms.
    write("encoder.csv", [how + "angles with noise of 0.01 deg", "time (ms);encoder (deg)"] +
          [f"{1000 * t:.0f};{math.degrees(a) + 0.01 * noise(i):.4f}"
           for i, t, a, _, _ in rows(0.005)])
    # One round of a crank that never stops, as a path planner exports it: angle and speed.
    write("round.csv", ["# one round of the crank; by tables/make_tables.py, 12 digits",
                        "t,angle (rad),speed (rad/s)"] +
          [f"{i / 40:.3f},{a:.12f},{w:.12f}" for i, a, w in rounds(40)])
    # As matlab.csv, one torque in 201 is 2 % off.
    write("one_wrong.csv", [how + "6 digits; the torque at 1.2 s is 2 % too large",
                            '"t (s)","torque (N*m)"'] +
          [f"{t:.6g},{m * (1.02 if i == 120 else 1.0):.6g}" for i, t, _, m, _ in rows(0.01)])


main()
