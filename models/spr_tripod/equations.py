"""The equations of the 3-SPR paper, as printed and as they should be, and an extension to forces.

Mei J., Gao B., Tan Y., Wang L.: Kinematic Analysis of 3-SPR Parallel Mechanism. Transactions of the
Chinese Society for Agricultural Machinery 43 (8), 2012, 215–220.

Names are the paper's: r, v of O_A; R = [u v w] of the platform; a_i from O_A to the hinge A_i, also
written r_i; b_i from O_B to the ball B_i; c_i the hinge's axis; w_i from B_i to A_i; q_i the leg's
length; world axes. The states are as on the page of the audit: centres of mass beside the axes,
inclined gravity, a load on the platform. The path's law, (21) and (22), and the workspace have no
states and are audited there.
"""

from mbverify.equations import (
    Mat, Vec, atan2, cos, cross, dot, hypot, identity, jacobian, linear_solve, norm, pi,
    rot_z, sin, skew, sqrt, states,
)
from mbverify.equations import equation

FORCE, MOMENT, POINT = [120, -80, -400], [3, -5, 8], [0.01, -0.02, 0.20]

states(
    "spr_tripod",
    coordinates=["platform.x", "platform.y", "platform.z"],
    ranges={"platform.x": [-0.13, 0.13], "platform.y": [-0.13, 0.13], "platform.z": [0.54, 0.61]},
    rates={"platform.x": 1.2, "platform.y": 1.2, "platform.z": 0.8},
    accelerations={"platform.x": 15, "platform.y": 15, "platform.z": 15},
    parameters={
        "c_platform_x": 0.03, "c_platform_y": -0.02, "I_platform_xx": 0.33, "c_cyl_x": 0.01,
        "c_cyl_y": -0.02, "I_cyl_yy": 0.075, "I_cyl_zz": 0.02, "c_rod_x": -0.015, "c_rod_y": 0.025,
        "I_rod_xx": 0.06, "I_rod_zz": 0.02,
    },
    gravity=[1.5, -2.0, 9.0],
    loads=[{"body": "platform", "point": POINT, "force": FORCE, "moment": MOMENT}],
)

LEGS = {"i": [1, 2, 3]}

# What the paper defines.


def f(p, i):
    """Direction of B_i from O_B, and of A_i from O_A in the platform."""
    return Vec(cos(p[f"phi_{i}"]), sin(p[f"phi_{i}"]), 0.0)


def c(p, i):
    """Axis of hinge i in the platform."""
    return Vec(cos(p[f"theta_{i}"]), sin(p[f"theta_{i}"]), 0.0)


def zxz(psi, theta, delta):
    """R of the paper, written out."""
    cp, sp, ct, st = cos(psi), sin(psi), cos(theta), sin(theta)
    cd, sd = cos(delta), sin(delta)
    return Mat(
        [cp * cd - sp * ct * sd, -cp * sd - sp * ct * cd, sp * st],
        [sp * cd + cp * ct * sd, -sp * sd + cp * ct * cd, -cp * st],
        [st * sd, st * cd, ct],
    )


def psi_of(R):
    return atan2(R[0][2], -R[1][2])


def theta_of(R):
    return atan2(hypot(R[0][2], R[1][2]), R[2][2])


class Pose:
    """a_i, b_i, c_i, w_i, q_i, d_i = a_i − q_i w_i for r and R; lists count from 0."""

    def __init__(self, p, r, R):
        self.a = [p.a * (R @ f(p, i)) for i in LEGS["i"]]
        self.b = [p.b * f(p, i) for i in LEGS["i"]]
        self.c = [R @ c(p, i) for i in LEGS["i"]]
        qw = [r + a - b for a, b in zip(self.a, self.b)]
        self.q = [norm(e) for e in qw]
        self.w = [e / norm(e) for e in qw]
        self.d = [a - e for a, e in zip(self.a, qw)]

    def J_c(self):
        """(12)."""
        return -linear_solve(Mat([cross(d, c) for d, c in zip(self.d, self.c)]), Mat(self.c))

    def J(self):
        """(14)."""
        return Mat(self.w) + Mat([cross(a, w) for a, w in zip(self.a, self.w)]) @ self.J_c()

    def J_d(self, i):
        """(20), corrected."""
        w, a, q = self.w[i], self.a[i], self.q[i]
        bracket = dot(w, a) * identity() - outer(a, w) + q * outer(w, w)
        return (skew(w) + bracket @ self.J_c()) / q


def outer(a, b):
    return Mat([[x * y for y in b] for x in a])


# Position.

R_r = {"r": "platform.position", "R": "platform.rotation"}


@equation("R (z-x-z)", gives="platform.rotation", given={"R": "platform.rotation"},
          printed="Rot(z,ψ) Rot(x,θ) Rot(z,δ), written out",
          note="at the angles of the reference's rotation")
def rotation(p, R):
    psi, theta, delta = psi_of(R), theta_of(R), atan2(R[2][0], R[2][1])
    cp, sp, ct, st = cos(psi), sin(psi), cos(theta), sin(theta)
    cd, sd = cos(delta), sin(delta)
    return Mat(
        [cp * cd - sp * ct * sd, -cp * sd - sp * ct * cd, sp * st],
        [sp * cd + cp * ct * sd, -sp * sd + cp * ct * cd, -cp * st],
        [st * sd, st * cd, ct],
    )


@equation("(1)", gives="platform.position", each=LEGS, unit="m",
          given={"R": "platform.rotation", "q": "leg{i}", "w": "leg{i}.P.axis"},
          printed="r = b_i + q_i w_i − a_i")
def eq1(p, i, R, q, w):
    return p.b * f(p, i) + q * w - p.a * (R @ f(p, i))


@equation("(2)", gives="0", each=LEGS, unit="m",
          given={"R": "platform.rotation", "q": "leg{i}", "w": "leg{i}.P.axis"},
          printed="q_i w_i·c_i = 0, c_i = R (cos θ_i, sin θ_i, 0)")
def eq2(p, i, R, q, w):
    theta = p[f"theta_{i}"]
    return q * dot(w, R @ Vec(cos(theta), sin(theta), 0))


@equation("(3) B_i", gives="leg{i}.cyl.position", each=LEGS, unit="m", printed="B_i = b f_i")
def eq3b(p, i):
    return p.b * f(p, i)


@equation("(3) A_i", gives="leg{i}.rod.position", each=LEGS, given=R_r, unit="m",
          printed="A_i = a R f_i + r")
def eq3a(p, i, r, R):
    return p.a * (R @ f(p, i)) + r


@equation("(4)", gives="leg{i}", each=LEGS, unit="m",
          given={"A": "leg{i}.rod.position", "B": "leg{i}.cyl.position"},
          printed="q_i² = |A_i − B_i|²")
def eq4(p, A, B):
    return sqrt(dot(A - B, A - B))


@equation("(5)", gives="leg{i}.P.axis", each=LEGS,
          given={"A": "leg{i}.rod.position", "B": "leg{i}.cyl.position", "q": "leg{i}"},
          printed="q_i w_i = A_i − B_i")
def eq5(p, A, B, q):
    return (A - B) / q


@equation("(8)", gives="leg{i}.P.axis", each=LEGS, given={**R_r, "q": "leg{i}"},
          printed="w_i = (r + a_i − b_i)/q_i")
def eq8(p, i, r, R, q):
    a_i, b_i = p.a * (R @ f(p, i)), p.b * f(p, i)
    return (r + a_i - b_i) / q


@equation("(9)", gives="leg{i}", each=LEGS, given=R_r, unit="m",
          printed="q_i² = (r + a_i − b_i)ᵀ(r + a_i − b_i)")
def eq9(p, i, r, R):
    a_i, b_i = p.a * (R @ f(p, i)), p.b * f(p, i)
    return sqrt(dot(r + a_i - b_i, r + a_i - b_i))


@equation("(6) x0", gives="platform.x", given={"R": "platform.rotation"}, unit="m",
          printed="x0 = [b u_y (3v_y − u_x) + 2 z0 w_x]/(2w_z)",
          corrected="x0 = {b [v_y (v_y − u_x) − 2u_y v_x] + 2 z0 w_x}/(2w_z)",
          note="the print mixes two frames, see below")
def eq6x(p, R, z):
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    return (p.b * uy * (3 * vy - ux) + 2 * z * wx) / (2 * wz)


@eq6x.corrected
def _(p, R, z):
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    return (p.b * (vy * (vy - ux) - 2 * uy * vx) + 2 * z * wx) / (2 * wz)


@equation("(6) y0", gives="platform.y", given={"R": "platform.rotation"}, unit="m",
          printed="y0 = [b u_x (u_x − v_y) − 2b v_x u_y + 2 z0 w_y]/(2w_z)",
          corrected="y0 = {b v_x (3u_x − v_y) + 2 z0 w_y}/(2w_z)",
          note="the print mixes two frames, see below")
def eq6y(p, R, z):
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    return (p.b * ux * (ux - vy) - 2 * p.b * vx * uy + 2 * z * wy) / (2 * wz)


@eq6y.corrected
def _(p, R, z):
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    return (p.b * vx * (3 * ux - vy) + 2 * z * wy) / (2 * wz)


@equation("(6) δ", gives="platform.rotation", given={"R": "platform.rotation"},
          printed="δ = ψ", corrected="δ = −ψ",
          note="the rotation at ψ, θ of the reference; its torsion δ + ψ is zero")
def eq6delta(p, R):
    psi, theta = psi_of(R), theta_of(R)
    delta = psi
    return zxz(psi, theta, delta)


@eq6delta.corrected
def _(p, R):
    psi, theta = psi_of(R), theta_of(R)
    delta = -psi
    return zxz(psi, theta, delta)


def best_position(p, R, z):
    """x0, y0 that meet (2) of the three legs best, by least squares, with z0."""
    hinges = [R @ c(p, i) for i in LEGS["i"]]
    rows = Mat([c_i[:2] for c_i in hinges])
    right = [dot(c_i, p.b * f(p, i)) - c_i[2] * z for i, c_i in zip(LEGS["i"], hinges)]
    return Vec(*linear_solve(rows.T @ rows, rows.T @ Vec(right)), z)


@equation("(6) δ in (2)", gives="platform.position", given={"R": "platform.rotation"}, unit="m",
          printed="constraints (2) at δ = ψ, x0 and y0 fitted best", corrected="at δ = −ψ",
          note="with the printed torsion no position meets the constraints")
def eq6constraints(p, R, z):
    psi, theta = psi_of(R), theta_of(R)
    delta = psi
    return best_position(p, zxz(psi, theta, delta), z)


@eq6constraints.corrected
def _(p, R, z):
    psi, theta = psi_of(R), theta_of(R)
    delta = -psi
    return best_position(p, zxz(psi, theta, delta), z)


@equation("(7) q1", gives="leg1", given={"R": "platform.rotation"}, unit="m",
          printed="q1² = s + b y0 − √3 b x0 − 2ab u_x + 2√3 ab v_x",
          corrected="q1² = s + b x0 − √3 b y0 − 2ab v_y + 2√3 ab v_x",
          note="s = a² + b² + |r|²")
def eq7q1(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s + b * y - sqrt(3) * b * x - 2 * a * b * ux + 2 * sqrt(3) * a * b * vx)


@eq7q1.corrected
def _(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s + b * x - sqrt(3) * b * y - 2 * a * b * vy + 2 * sqrt(3) * a * b * vx)


@equation("(7) q2", gives="leg2", given={"R": "platform.rotation"}, unit="m",
          printed="q2² = s − 2b y0 − 3ab v_y + ab u_x",
          corrected="q2² = s + b x0 + √3 b y0 − 2ab v_y − 2√3 ab v_x")
def eq7q2(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s - 2 * b * y - 3 * a * b * vy + a * b * ux)


@eq7q2.corrected
def _(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s + b * x + sqrt(3) * b * y - 2 * a * b * vy - 2 * sqrt(3) * a * b * vx)


@equation("(7) q3", gives="leg3", given={"R": "platform.rotation"}, unit="m",
          printed="q3² = s + b y0 + √3 b x0 − 2ab u_x − 2√3 ab v_x",
          corrected="q3² = s − 2b x0 − 3ab u_x + ab v_y")
def eq7q3(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s + b * y + sqrt(3) * b * x - 2 * a * b * ux - 2 * sqrt(3) * a * b * vx)


@eq7q3.corrected
def _(p, R, x, y, z):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    s = a**2 + b**2 + x**2 + y**2 + z**2
    return sqrt(s - 2 * b * x - 3 * a * b * ux + a * b * vy)


@equation("(10) x1", gives="platform.x", given={"R": "platform.rotation"}, unit="m",
          printed="(6) with indices 1, 2, 3 for x, y, z", corrected="as (6)")
def eq10x(p, R, z):
    (u1, v1, w1), (u2, v2, w2), (u3, v3, w3) = R
    return (p.b * u2 * (3 * v2 - u1) + 2 * z * w1) / (2 * w3)


@eq10x.corrected
def _(p, R, z):
    (u1, v1, w1), (u2, v2, w2), (u3, v3, w3) = R
    return (p.b * (v2 * (v2 - u1) - 2 * u2 * v1) + 2 * z * w1) / (2 * w3)


@equation("(10) x2", gives="platform.y", given={"R": "platform.rotation"}, unit="m",
          printed="(6) with indices 1, 2, 3 for x, y, z", corrected="as (6)")
def eq10y(p, R, z):
    (u1, v1, w1), (u2, v2, w2), (u3, v3, w3) = R
    return (p.b * u1 * (u1 - v2) - 2 * p.b * v1 * u2 + 2 * z * w2) / (2 * w3)


@eq10y.corrected
def _(p, R, z):
    (u1, v1, w1), (u2, v2, w2), (u3, v3, w3) = R
    return (p.b * v1 * (3 * u1 - v2) + 2 * z * w2) / (2 * w3)


TURN = rot_z(5 * pi / 6)  # frames turned by +150° against the text's


@equation("(6) in a turned frame", gives="platform.position", given={"R": "platform.rotation"},
          unit="m", printed="x0 = [b u_y (3v_y − u_x) + 2 z0 w_x]/(2w_z), "
          "y0 = [b u_x (u_x − v_y) − 2b v_x u_y + 2 z0 w_y]/(2w_z)",
          note="holds as printed, with δ = −ψ, in base and platform frames turned by +150° about z")
def eq6turned(p, R, z):
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = TURN.T @ R @ TURN
    x0 = (p.b * uy * (3 * vy - ux) + 2 * z * wx) / (2 * wz)
    y0 = (p.b * ux * (ux - vy) - 2 * p.b * vx * uy + 2 * z * wy) / (2 * wz)
    return TURN @ Vec(x0, y0, z)


@equation("(7) in a turned frame", gives="leg{i}", given=R_r, each=LEGS, unit="m",
          printed="q1² = s + b y0 − √3 b x0 − 2ab u_x + 2√3 ab v_x, "
          "q2² = s − 2b y0 − 3ab v_y + ab u_x, q3² = s + b y0 + √3 b x0 − 2ab u_x − 2√3 ab v_x",
          note="as above")
def eq7turned(p, i, r, R):
    a, b = p.a, p.b
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = TURN.T @ R @ TURN
    x, y, z = TURN.T @ r
    s = a**2 + b**2 + x**2 + y**2 + z**2
    squares = [
        s + b * y - sqrt(3) * b * x - 2 * a * b * ux + 2 * sqrt(3) * a * b * vx,
        s - 2 * b * y - 3 * a * b * vy + a * b * ux,
        s + b * y + sqrt(3) * b * x - 2 * a * b * ux - 2 * sqrt(3) * a * b * vx,
    ]
    return sqrt(squares[i - 1])


def centre(p, R, z):
    """(6) as corrected."""
    (ux, vx, wx), (uy, vy, wy), (uz, vz, wz) = R
    return Vec((p.b * (vy * (vy - ux) - 2 * uy * vx) + 2 * z * wx) / (2 * wz),
               (p.b * vx * (3 * ux - vy) + 2 * z * wy) / (2 * wz), z)


def newton_steps(function, x, steps):
    for _ in range(steps):
        x = x - linear_solve(jacobian(function, x), function(*x))
    return x


@equation("G(ψ, θ, z0) = 0", gives="platform.position",
          given={"q1": "leg1", "q2": "leg2", "q3": "leg3"}, unit="m",
          printed="Newton in (ψ, θ, z0), here from θ = 0.1",
          corrected="Newton in (tan(θ/2) cos ψ, tan(θ/2) sin ψ, z0) from θ = 0",
          note="after 5 steps; at θ = 0 the printed unknowns are singular")
def forward(p, q1, q2, q3):
    def G(psi, theta, z0):
        R = zxz(psi, theta, -psi)
        pose = Pose(p, centre(p, R, z0), R)
        return [pose.q[0]**2 - q1**2, pose.q[1]**2 - q2**2, pose.q[2]**2 - q3**2]

    z_start = sqrt(((q1 + q2 + q3) / 3)**2 - (p.b - p.a)**2)
    psi, theta, z0 = newton_steps(G, Vec(0.0, 0.1, z_start), 5)
    return centre(p, zxz(psi, theta, -psi), z0)


@forward.corrected
def _(p, q1, q2, q3):
    def tilted(X, Y):
        D = 1 + X**2 + Y**2
        return Mat([1 + X**2 - Y**2, 2 * X * Y, 2 * Y], [2 * X * Y, 1 - X**2 + Y**2, -2 * X],
                   [-2 * Y, 2 * X, 1 - X**2 - Y**2]) / D

    def G(X, Y, z0):
        pose = Pose(p, centre(p, tilted(X, Y), z0), tilted(X, Y))
        return [pose.q[0]**2 - q1**2, pose.q[1]**2 - q2**2, pose.q[2]**2 - q3**2]

    z_start = sqrt(((q1 + q2 + q3) / 3)**2 - (p.b - p.a)**2)
    X, Y, z0 = newton_steps(G, Vec(0.0, 0.0, z_start), 5)
    return centre(p, tilted(X, Y), z0)


# Velocities. a: r_i of the paper; Ω, ω_i of leg i.

twist = {"v": "platform.velocity", "omega": "platform.angular_velocity"}
a_w = {"a": "leg{i}.rod.position from platform", "w": "leg{i}.P.axis"}


@equation("(11)", gives="leg{i}.rod.velocity", each=LEGS, unit="m/s",
          given={"Omega": "leg{i}.cyl.angular_velocity", "q": "leg{i}", "qd": "leg{i}.velocity",
                 "w": "leg{i}.P.axis"},
          printed="v_Bi = v_Ai + Ω × r_BiAi + v_rel = 0", note="solved for v_Ai")
def eq11(p, Omega, q, qd, w):
    r_BA = -q * w
    v_rel = -qd * w
    return -(cross(Omega, r_BA) + v_rel)


@equation("(12)", gives="platform.angular_velocity", unit="rad/s",
          given={"v": "platform.velocity", "R": "platform.rotation",
                 "a1": "leg1.rod.position from platform", "q1": "leg1", "w1": "leg1.P.axis",
                 "a2": "leg2.rod.position from platform", "q2": "leg2", "w2": "leg2.P.axis",
                 "a3": "leg3.rod.position from platform", "q3": "leg3", "w3": "leg3.P.axis"},
          printed="ω = J_c v, J_c = −{[(r_i − q_i w_i) × c_i]ᵀ}⁻¹ c_iᵀ", note="r_i means a_i")
def eq12(p, v, R, a1, q1, w1, a2, q2, w2, a3, q3, w3):
    c1, c2, c3 = R @ c(p, 1), R @ c(p, 2), R @ c(p, 3)
    rows = Mat(cross(a1 - q1 * w1, c1), cross(a2 - q2 * w2, c2), cross(a3 - q3 * w3, c3))
    J_c = -linear_solve(rows, Mat(c1, c2, c3))
    return J_c @ v


@equation("(13)", gives="leg{i}.rod.velocity", each=LEGS, given={**twist, "a": a_w["a"]},
          unit="m/s", printed="v_Ai = v + ω × r_i")
def eq13(p, v, omega, a):
    return v + cross(omega, a)


@equation("(14) first form", gives="leg{i}.velocity", each=LEGS, unit="m/s",
          given={"v_A": "leg{i}.rod.velocity", "v_B": "leg{i}.cyl.velocity", "w": "leg{i}.P.axis"},
          printed="q̇_i = v_Bi·w_i", corrected="q̇_i = v_Ai·w_i",
          note="v_Bi is zero; and J v is the vector of all q̇, not one q̇_i")
def eq14(p, v_A, v_B, w):
    return dot(v_B, w)


@eq14.corrected
def _(p, v_A, v_B, w):
    return dot(v_A, w)


@equation("(14) J", gives="leg{i}.jacobian", each=LEGS, given={**R_r, **a_w},
          printed="J = [w_iᵀ] + [(r_i × w_i)ᵀ] J_c", note="row i")
def eq14J(p, r, R, a, w):
    J_c = Pose(p, r, R).J_c()
    return w + cross(a, w) @ J_c


@equation("(15)", gives="leg{i}.rod.velocity", each=LEGS, unit="m/s",
          given={"v_A": "leg{i}.rod.velocity", "v_B": "leg{i}.cyl.velocity", "w": "leg{i}.P.axis",
                 "q": "leg{i}", "omega_i": "leg{i}.rod.angular_velocity"},
          printed="v_Ai = v_Bi + ω_i × r_AiBi + (v_Ai·w_i) w_i")
def eq15(p, v_A, v_B, w, q, omega_i):
    r_AB = q * w
    return v_B + cross(omega_i, r_AB) + dot(v_A, w) * w


@equation("(16)", gives="leg{i}.rod.angular_velocity in leg{i}.rod[{k}]", unit="rad/s",
          each={**LEGS, "k": [1, 2]},
          given={**twist, **a_w, "q": "leg{i}", "R_i": "leg{i}.rod.rotation"},
          printed="ω_ixy = [w_i × v + (w_iᵀr_i) ω − r_i (w_iᵀω)]/q_i",
          note="the part of ω_i across w_i: its components in the leg's x and y")
def eq16(p, k, v, omega, a, w, q, R_i):
    omega_xy = (cross(w, v) + dot(w, a) * omega - a * dot(w, omega)) / q
    return (R_i.T @ omega_xy)[k - 1]


@equation("(17)", gives="0", each={**LEGS, "k": [1, 2, 3]}, unit="m/s",
          given={**twist, "a": a_w["a"], "R": "platform.rotation", "v_A": "leg{i}.rod.velocity",
                 "omega_i": "leg{i}.rod.angular_velocity"},
          printed="v_Ci = v + ω × (r_i + c_i)", note="less the point C_i of the reference's rods")
def eq17(p, i, k, v, omega, a, R, v_A, omega_i):
    c_i = R @ c(p, i)
    v_C = v + cross(omega, a + c_i)
    return (v_C - (v_A + cross(omega_i, c_i)))[k - 1]


@equation("(18) second form", gives="0", each={**LEGS, "k": [1, 2, 3]}, unit="m/s",
          given={**twist, "a": a_w["a"], "R": "platform.rotation",
                 "omega_i": "leg{i}.rod.angular_velocity"},
          printed="v_Ci = v + ω × r_i + ω_i × c_i",
          note="less the point C_i of the reference's platform")
def eq18(p, i, k, v, omega, a, R, omega_i):
    c_i = R @ c(p, i)
    v_C = v + cross(omega, a) + cross(omega_i, c_i)
    return (v_C - (v + cross(omega, a + c_i)))[k - 1]


@equation("(19)", gives="leg{i}.rod.angular_velocity in leg{i}.rod[3]", each=LEGS, unit="rad/s",
          given={"omega": "platform.angular_velocity", "w": "leg{i}.P.axis",
                 "R_i": "leg{i}.rod.rotation"},
          printed="ω_iz = (w_iᵀω) w_i", note="the part of ω_i along w_i")
def eq19(p, omega, w, R_i):
    omega_z = dot(w, omega) * w
    return (R_i.T @ omega_z)[2]


@equation("(20)", gives="leg{i}.rod.angular_velocity", each=LEGS, unit="rad/s",
          given={**R_r, **a_w, "v": "platform.velocity", "q": "leg{i}"},
          printed="J_di = (1/q_i)[[w_i×] + ((w_iᵀr_i) E − r_i w_iᵀ) + q_i w_i w_iᵀ] J_c",
          corrected="J_di = (1/q_i){[w_i×] + [(w_iᵀr_i) E − r_i w_iᵀ + q_i w_i w_iᵀ] J_c}",
          note="ω_i = J_di v; [w_i×] acts on v itself, J_c belongs to the terms with ω")
def eq20(p, r, R, a, w, v, q):
    E, J_c = identity(), Pose(p, r, R).J_c()
    J_d = (skew(w) + (dot(w, a) * E - outer(a, w)) + q * outer(w, w)) @ J_c / q
    return J_d @ v


@eq20.corrected
def _(p, r, R, a, w, v, q):
    E, J_c = identity(), Pose(p, r, R).J_c()
    J_d = (skew(w) + (dot(w, a) * E - outer(a, w) + q * outer(w, w)) @ J_c) / q
    return J_d @ v


# Accelerations and forces; not in the paper.


@equation("(D1)", gives="platform.angular_acceleration", unit="rad/s²",
          given={**R_r, **twist, "vd": "platform.acceleration"},
          printed="(d_i × c_i)ᵀ ω̇ = −c_iᵀ v̇ + 2c_iᵀ(ω × v) − (ω × d_i)ᵀ(ω × c_i)",
          note="not in the paper: (12) differentiated")
def eqD1(p, r, R, v, omega, vd):
    s = Pose(p, r, R)
    rows = Mat([cross(d, c) for d, c in zip(s.d, s.c)])
    rhs = [-dot(c, vd) + 2 * dot(c, cross(omega, v)) - dot(cross(omega, d), cross(omega, c))
           for d, c in zip(s.d, s.c)]
    return linear_solve(rows, rhs)


@equation("(D3)", gives="leg{i}.acceleration", each=LEGS, unit="m/s²",
          given={"v_A": "leg{i}.rod.velocity", "a_A": "leg{i}.rod.acceleration",
                 "w": "leg{i}.P.axis", "q": "leg{i}", "qd": "leg{i}.velocity"},
          printed="q̈_i = a_Ai·w_i + |v_Ai − q̇_i w_i|²/q_i", note="not in the paper")
def eqD3(p, v_A, a_A, w, q, qd):
    across = v_A - qd * w
    return dot(a_A, w) + dot(across, across) / q


@equation("(D6)", gives="leg{i}.rod.angular_acceleration", each=LEGS, unit="rad/s²",
          given={"v_A": "leg{i}.rod.velocity", "a_A": "leg{i}.rod.acceleration",
                 "w": "leg{i}.P.axis", "q": "leg{i}", "qd": "leg{i}.velocity",
                 "omega": "platform.angular_velocity", "omega_d": "platform.angular_acceleration"},
          printed="ω̇_i = [w_i × a_Ai − 2q̇_i ω_ixy]/q_i + d/dt ω_iz", note="not in the paper")
def eqD6(p, v_A, a_A, w, q, qd, omega, omega_d):
    omega_xy = cross(w, v_A) / q
    wd = (v_A - qd * w) / q
    spin_d = (dot(omega_d, w) + dot(omega, wd)) * w + dot(omega, w) * wd
    return (cross(w, a_A) - 2 * qd * omega_xy) / q + spin_d


def of_bodies(names, quantities):
    """given= of each body: letters + name."""
    return {letter + name.replace(".", "_"): f"{name}.{quantity}"
            for name in names for letter, quantity in quantities.items()}


BODIES = ["platform"] + [f"leg{i}.{part}" for i in LEGS["i"] for part in ("cyl", "rod")]
DEMANDS = {"G_": "com.position", "F_": "inertia_force", "N_": "inertia_moment", "W_": "weight"}


@equation("(D9)", gives="leg{i}.force", each=LEGS, unit="N",
          given={**R_r, **of_bodies(BODIES, DEMANDS)},
          printed="f = J⁻ᵀ Σ (VᵀF + WᵀN)", note="not in the paper")
def eqD9(p, i, r, R, G_platform, F_platform, N_platform, W_platform,
         G_leg1_cyl, F_leg1_cyl, N_leg1_cyl, W_leg1_cyl,
         G_leg1_rod, F_leg1_rod, N_leg1_rod, W_leg1_rod,
         G_leg2_cyl, F_leg2_cyl, N_leg2_cyl, W_leg2_cyl,
         G_leg2_rod, F_leg2_rod, N_leg2_rod, W_leg2_rod,
         G_leg3_cyl, F_leg3_cyl, N_leg3_cyl, W_leg3_cyl,
         G_leg3_rod, F_leg3_rod, N_leg3_rod, W_leg3_rod):
    s = Pose(p, r, R)
    J_c = s.J_c()
    V = identity() - skew(G_platform - r) @ J_c
    Q = -(V.T @ (F_platform + W_platform) + J_c.T @ N_platform)
    cylinders = [(G_leg1_cyl, F_leg1_cyl + W_leg1_cyl, N_leg1_cyl),
                 (G_leg2_cyl, F_leg2_cyl + W_leg2_cyl, N_leg2_cyl),
                 (G_leg3_cyl, F_leg3_cyl + W_leg3_cyl, N_leg3_cyl)]
    rods = [(G_leg1_rod, F_leg1_rod + W_leg1_rod, N_leg1_rod),
            (G_leg2_rod, F_leg2_rod + W_leg2_rod, N_leg2_rod),
            (G_leg3_rod, F_leg3_rod + W_leg3_rod, N_leg3_rod)]
    for k in range(3):
        W = s.J_d(k)
        G, F, N = cylinders[k]
        V = -skew(G - s.b[k]) @ W
        Q = Q - (V.T @ F + W.T @ N)
        G, F, N = rods[k]
        V = identity() - skew(s.a[k]) @ J_c - skew(G - r - s.a[k]) @ W
        Q = Q - (V.T @ F + W.T @ N)
    V = identity() - skew(R @ Vec(POINT)) @ J_c
    Q = Q - (V.T @ Vec(FORCE) + J_c.T @ Vec(MOMENT))
    return linear_solve(s.J().T, Q)[i - 1]


def at_ball(p, i, force):
    """A force in the world, in the axes of the ball's frame on the base."""
    x = c(p, i)
    z = (p.a - p.b) * f(p, i) + Vec(0.0, 0.0, sqrt(p.q_home**2 - (p.b - p.a)**2))
    z = z / norm(z)
    return Mat(x, cross(z, x), z) @ force


@equation("(D11)", gives="leg{i}.S.reaction.force", each=LEGS, unit="N",
          given={**R_r, **of_bodies(BODIES, DEMANDS)},
          printed="S_i from the balances of force, moment and each leg's revolute joint",
          note="not in the paper")
def eqD11(p, i, r, R, G_platform, F_platform, N_platform, W_platform,
          G_leg1_cyl, F_leg1_cyl, N_leg1_cyl, W_leg1_cyl,
          G_leg1_rod, F_leg1_rod, N_leg1_rod, W_leg1_rod,
          G_leg2_cyl, F_leg2_cyl, N_leg2_cyl, W_leg2_cyl,
          G_leg2_rod, F_leg2_rod, N_leg2_rod, W_leg2_rod,
          G_leg3_cyl, F_leg3_cyl, N_leg3_cyl, W_leg3_cyl,
          G_leg3_rod, F_leg3_rod, N_leg3_rod, W_leg3_rod):
    s = Pose(p, r, R)
    legs = [
        [(G_leg1_cyl, F_leg1_cyl + W_leg1_cyl, N_leg1_cyl),
         (G_leg1_rod, F_leg1_rod + W_leg1_rod, N_leg1_rod)],
        [(G_leg2_cyl, F_leg2_cyl + W_leg2_cyl, N_leg2_cyl),
         (G_leg2_rod, F_leg2_rod + W_leg2_rod, N_leg2_rod)],
        [(G_leg3_cyl, F_leg3_cyl + W_leg3_cyl, N_leg3_cyl),
         (G_leg3_rod, F_leg3_rod + W_leg3_rod, N_leg3_rod)],
    ]
    point = r + R @ Vec(POINT)
    force = -(F_platform + W_platform + Vec(FORCE))
    moment = -(cross(G_platform, F_platform + W_platform) + N_platform
               + cross(point, Vec(FORCE)) + Vec(MOMENT))
    rows, rhs = [], []
    for k in range(3):
        A = r + s.a[k]
        hinge = 0.0
        for G, F, N in legs[k]:
            force = force - F
            moment = moment - cross(G, F) - N
            hinge = hinge - dot(s.c[k], cross(G - A, F) + N)
        row = cross(s.c[k], s.b[k] - A)  # c·[(B − A) × S]
        rows.append([0.0] * (3 * k) + list(row) + [0.0] * (6 - 3 * k))
        rhs.append(hinge)
    moments = [skew(b) for b in s.b]
    for m in range(3):
        rows.append([e for k in range(3) for e in identity()[m]])
        rows.append([e for k in range(3) for e in moments[k][m]])
        rhs += [force[m], moment[m]]
    S = linear_solve(Mat(rows), rhs)
    return at_ball(p, i, Vec(S[3 * i - 3:3 * i]))


@equation("(D12)", gives="leg{i}.force", each=LEGS, unit="N",
          given={"S": "leg{i}.S.reaction.force", "F": "leg{i}.cyl.inertia_force",
                 "G": "leg{i}.cyl.weight", "w": "leg{i}.P.axis"},
          printed="f_i = (S_i − F_cyl,i)·w_i", note="not in the paper")
def eqD12(p, i, S, F, G, w):
    F_cyl = -(F + G)
    return dot(S - at_ball(p, i, F_cyl), at_ball(p, i, w))
