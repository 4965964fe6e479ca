"""Drive angles and torques of a delta robot, by virtual work.

Arm i turns about y of its frame, whose x axis points outwards at an azimuth, by the angle theta
below the horizontal. Both rods of a pair point along n, as the platform does not turn.
"""

from mbverify.equations import (Vec, acos, atan2, closed_form, cos, dot, hypot, jacobian,
                                linear_solve, motion, pi, rot_z, sin)

FRAMES = [rot_z(azimuth) for azimuth in (0.0, 2 * pi / 3, -2 * pi / 3)]


@closed_form("delta", commands=["platform.x", "platform.y", "platform.z"], covers="unchecked")
def drives(p, x, y, z):
    angles = []
    for frame in FRAMES:
        d = frame.T @ Vec(x, y, z) - Vec(p.R - p.r, 0, 0)  # motor to wrist, in the limb's frame
        reach = hypot(d[0], d[2])
        cosine = (dot(d, d) + p.L**2 - p.l**2) / (2 * p.L * reach)
        angles.append(atan2(-d[2], d[0]) - acos(cosine))
    return angles


@closed_form.forces
def forces(p, q, qd, qdd):
    def places(x, y, z):  # the platform; of each limb the arm's and rods' centres, n
        found = [Vec(x, y, z)]
        for frame, theta in zip(FRAMES, drives(p, x, y, z)):
            arm = frame @ Vec(cos(theta), 0, -sin(theta))
            motor, wrist = p.R * frame @ Vec(1, 0, 0), Vec(x, y, z) + p.r * frame @ Vec(1, 0, 0)
            elbow = motor + p.L * arm
            found += [motor + p.c_arm * arm, (elbow + wrist) / 2, (wrist - elbow) / p.l]
        return found

    inertia = [p.m_platform] + 3 * [p.m_arm, 2 * p.m_rod, 2 * p.I_rod]
    gravity = Vec(0, 0, p.g)
    weight = [p.m_platform * gravity] + 3 * [p.m_arm * gravity, 2 * p.m_rod * gravity, 0 * gravity]
    acceleration = motion(places, q, qd, qdd)[2]
    load = [e for i, a, w in zip(inertia, acceleration, weight) for e in i * a + w]
    along = jacobian(lambda *q: drives(p, *q), q)
    turning = Vec(motion(lambda *q: drives(p, *q), q, qd, qdd)[2])
    return linear_solve(along.T, jacobian(places, q).T @ Vec(load)) + p.I_arm * turning
