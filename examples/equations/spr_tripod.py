"""Leg lengths and forces of the 3-SPR tripod with the masses of all seven bodies, by virtual work.

The platform's orientation follows from its position: the leg from the ball B_i to A_i stays across
the hinge c_i, which is fixed in the platform. A body with the centre of mass at s, axes e_k and
principal moments I_k resists like masses (I_1 + I_2 + I_3)/2 - I_k at the tips of its axes.
"""

from mbverify.equations import (Mat, Vec, asin, atan2, closed_form, cos, cross, dot, jacobian,
                                linear_solve, motion, norm, output, rot_x, rot_y, rot_z, sin, solve)


def legs(p, x, y, z):
    """Orientation of the platform; of each leg A, B and the hinge c."""
    parts = []
    for phi, theta in ((p.phi_1, p.theta_1), (p.phi_2, p.theta_2), (p.phi_3, p.theta_3)):
        radial = Vec(cos(phi), sin(phi), 0)
        parts.append((p.a * radial, p.b * radial, Vec(cos(theta), sin(theta), 0)))

    def turned(roll, pitch, yaw):
        R = rot_z(yaw) @ rot_y(pitch) @ rot_x(roll)
        return R, [(Vec(x, y, z) + R @ A, B, R @ c) for A, B, c in parts]

    angles = solve(lambda *angles: [dot(A - B, c) for A, B, c in turned(*angles)[1]], [0, 0, 0])
    return turned(*angles)


@closed_form("spr_tripod", commands=["platform.x", "platform.y", "platform.z"],
             covers="unchecked")
def drives(p, x, y, z):
    return [norm(A - B) for A, B, _ in legs(p, x, y, z)[1]]


@closed_form.forces
def forces(p, q, qd, qdd):
    masses = []

    def places(x, y, z):  # centres of mass and tips of axes
        masses.clear()
        found = []

        def body(name, origin, R):
            m, I = p["m_" + name], [p[f"I_{name}_{k}"] for k in ("xx", "yy", "zz")]
            masses.extend([(m, m)] + [(sum(I) / 2 - e, 0) for e in I])
            found.extend([origin + R @ Vec(p[f"c_{name}_{k}"] for k in "xyz"), *R.T])

        R, of_legs = legs(p, x, y, z)
        body("platform", Vec(x, y, z), R)
        for A, B, c in of_legs:
            w = (A - B) / norm(A - B)
            leg = Mat(c, cross(w, c), w).T
            body("cyl", B, leg)
            body("rod", A, leg)
        return found

    acceleration = motion(places, q, qd, qdd)[2]
    load = [e for (i, m), a in zip(masses, acceleration) for e in i * a - Vec(0, 0, p.g * m)]
    along = jacobian(lambda *q: drives(p, *q), q)
    return linear_solve(along.T, jacobian(places, q).T @ Vec(load))


@output("platform.roll", "rad")
def roll(p, x, y, z):
    R, _ = legs(p, x, y, z)
    return atan2(R[2][1], R[2][2])


@output("platform.pitch", "rad")
def pitch(p, x, y, z):
    return asin(-legs(p, x, y, z)[0][2][0])
