"""Stick and slip of the block on the belt in closed form, for closed_form.yaml.

A block of mass m on a belt with the speed v, held by a spring k; friction is at most F_s at rest
and F_c while it slides (F_c < F_s). x counts from where the spring is free, w = sqrt(k/m),
D = (F_s - F_c)/k:
  stick  x = x_0 + v t until x = F_s/k
  slip   x = F_c/k + D cos w t + v/w sin w t until x' = v again, at
         t = (2/w) (pi - atan(w D/v)), x = F_c/k - D
so that every period after the first start takes T = 2 D/v + (2/w) (pi - atan(w D/v)).
"""

from math import atan, cos, pi, sin, sqrt

M, K, V, F_S, F_C = 1.0, 1.0, 0.2, 1.0, 0.5
W, D = sqrt(K / M), (F_S - F_C) / K
SLIP = 2 / W * (pi - atan(W * D / V))
STICK = 2 * D / V
FIRST = F_S / K / V


def block(t):
    """x and its rate."""
    if t <= FIRST:
        return V * t, V
    t = (t - FIRST) % (SLIP + STICK)
    if t < SLIP:
        return (F_C / K + D * cos(W * t) + V / W * sin(W * t),
                -W * D * sin(W * t) + V * cos(W * t))
    return F_C / K - D + V * (t - SLIP), V


with open("closed_form.csv", "w", encoding="utf-8") as out:
    print("time_s,block.x,slip.position,slip.velocity", file=out)
    for i in range(1001):
        t = 0.03 * i
        x, rate = block(t)
        print(f"{t:.2f},{x:.15f},{x - V * t:.15f},{rate - V:.15f}", file=out)
