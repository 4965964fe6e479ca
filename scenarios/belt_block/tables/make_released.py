"""A block with friction released beside its rest, for released.yaml: the published benchmark SDND100
(EDF, Code_Aster, validation manual V5.01.100; k = 10 000 N/m, m = 1 kg, g = 10 m/s2, mu = 0.1,
r_0 = 0.85 mm). With w = sqrt(k/m) and F = mu m g the motion turns round at t_n = n pi/w,
  r(t) = (-1)^n (F/k) + (r(t_n) - (-1)^n F/k) cos w (t - t_n)   in t_n <= t <= t_(n+1),
  r(t_n) = (-1)^n (r_0 - 2 n F/k) = 0.85, -0.65, 0.45, -0.25, 0.05 mm,
and it stops for good where |r(t_n)| < F/k: at 0.05 mm, t_4 = 0.1257 s.
"""

from math import cos, pi, sin, sqrt

K, M, F, R_0 = 1e4, 1.0, 0.1 * 1.0 * 10.0, 0.85e-3
W = sqrt(K / M)


def block(t):
    """r and its rate."""
    n = int(W * t / pi)
    start, sign = R_0, 1.0
    for _ in range(n):
        if abs(start) < F / K:
            break
        start, sign = -start + 2.0 * sign * F / K, -sign
    if abs(start) < F / K:
        return start, 0.0
    phase = W * t - n * pi
    swing = start - sign * F / K
    return sign * F / K + swing * cos(phase), -W * swing * sin(phase)


with open("released.csv", "w", encoding="utf-8") as out:
    print("time_s,block.x,slip.velocity", file=out)
    for i in range(201):
        r, rate = block(0.001 * i)
        print(f"{0.001 * i:.3f},{r:.15e},{rate:.15e}", file=out)
