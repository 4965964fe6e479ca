"""Leg lengths and forces of the 3-SPR tripod with the masses of all seven bodies, by virtual work.

The platform's orientation follows from its position: the leg from the ball B_i to A_i stays across
the hinge c_i, which is fixed in the platform. A body with the centre of mass at s, axes e_k and
principal moments I_k resists like masses (I_1 + I_2 + I_3)/2 - I_k at the tips of its axes.
"""

from mbverify.equations import (Mat, Vec, closed_form, cos, cross, dot, jacobian, linear_solve,
                                motion, norm, rot_x, rot_y, rot_z, sin, solve)


def legs(p, r):
    """Orientation of the platform at r; of each leg A, B and the hinge c."""
    def turned(roll, pitch, yaw):
        R = rot_z(yaw) @ rot_y(pitch) @ rot_x(roll)
        found = []
        for phi, theta in ((p.phi_1, p.theta_1), (p.phi_2, p.theta_2), (p.phi_3, p.theta_3)):
            u, c = Vec(cos(phi), sin(phi), 0), Vec(cos(theta), sin(theta), 0)
            found.append((r + p.a * R @ u, p.b * u, R @ c))
        return R, found

    def across(*angles):
        return [dot(A - B, c) for A, B, c in turned(*angles)[1]]

    return turned(*solve(across, [0, 0, 0]))


@closed_form("spr_tripod", commands=["platform.x", "platform.y", "platform.z"],
             covers="unchecked")
def drives(p, *r):
    return [norm(A - B) for A, B, _ in legs(p, Vec(r))[1]]


@closed_form.forces
def forces(p, q, qd, qdd):
    def bodies(*r):  # of each body its name, centre of mass and axes
        R, of_legs = legs(p, Vec(r))
        found = [("platform", Vec(r), R)]
        for A, B, c in of_legs:
            w = (A - B) / norm(A - B)
            leg = Mat(c, cross(w, c), w).T
            found += [("cyl", B, leg), ("rod", A, leg)]
        return [(name, at + R @ Vec(p[f"c_{name}_{k}"] for k in "xyz"), R) for name, at, R in found]

    def places(*r):
        return [e for _, centre, R in bodies(*r) for e in (centre, *R.T)]

    load = []
    acceleration = iter(motion(places, q, qd, qdd)[2])
    for name in ["platform"] + 3 * ["cyl", "rod"]:
        I = [p[f"I_{name}_{k}"] for k in ("xx", "yy", "zz")]
        load += [*(p["m_" + name] * (next(acceleration) - Vec(0, 0, p.g)))]
        load += [e for k in range(3) for e in (sum(I) / 2 - I[k]) * next(acceleration)]
    along = jacobian(lambda *r: drives(p, *r), q)
    return linear_solve(along.T, jacobian(places, q).T @ Vec(load))
