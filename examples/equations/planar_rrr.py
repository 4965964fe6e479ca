"""Drive angles and torques of a planar 3-RRR manipulator with all masses, by virtual work."""

from mbverify.equations import (Vec, acos, atan2, closed_form, cos, hypot, jacobian, linear_solve,
                                motion, sin)


def limbs(p, x, y, yaw):
    """Angle of the crank, of the coupler, and the elbow, of each limb."""
    found = []
    for k in (1, 2, 3):
        A = [p[f"A{k}_x"], p[f"A{k}_y"]]
        u, v = p[f"B{k}_x"], p[f"B{k}_y"]
        dx, dy = x + u * cos(yaw) - v * sin(yaw) - A[0], y + u * sin(yaw) + v * cos(yaw) - A[1]
        reach = hypot(dx, dy)
        crank = atan2(dy, dx) + acos((p.a**2 + reach**2 - p.b**2) / (2 * p.a * reach))
        elbow = Vec(A) + p.a * Vec(cos(crank), sin(crank))
        coupler = atan2(A[1] + dy - elbow[1], A[0] + dx - elbow[0])
        found.append((crank, coupler, elbow))
    return found


@closed_form("planar_rrr", commands=["platform.x", "platform.y", "platform.yaw"],
             covers="unchecked")
def drives(p, x, y, yaw):
    return [crank for crank, _, _ in limbs(p, x, y, yaw)]


@closed_form.forces
def forces(p, q, qd, qdd):
    def places(x, y, yaw):  # x, y and angle of the platform, of cranks and of couplers
        u, v = p.c_p_x, p.c_p_y
        found = [x + u * cos(yaw) - v * sin(yaw), y + u * sin(yaw) + v * cos(yaw), yaw]
        for k, (crank, coupler, elbow) in enumerate(limbs(p, x, y, yaw)):
            found += [*(elbow + (p.c_a - p.a) * Vec(cos(crank), sin(crank))), crank]
            found += [*(elbow + p.c_b * Vec(cos(coupler), sin(coupler))), coupler]
        return found

    inertia = [p.m_p, p.m_p, p.I_p] + 3 * [p.m_a, p.m_a, p.I_a, p.m_b, p.m_b, p.I_b]
    weight = [0, p.m_p, 0] + 3 * [0, p.m_a, 0, 0, p.m_b, 0]
    acceleration = motion(places, q, qd, qdd)[2]
    load = Vec(i * a + p.g * w for i, a, w in zip(inertia, acceleration, weight))
    along = jacobian(lambda *q: drives(p, *q), q)
    return linear_solve(along.T, jacobian(places, q).T @ load)
