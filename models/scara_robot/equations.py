"""The equations of the SCARA robot's paper, as printed and as they should be.

Zhu W., Guo Q., Ma Z., Shen H., Wu G.: Stiffness and dynamics analysis of SCARA parallel mechanism.
Transactions of the Chinese Society for Agricultural Machinery 50 (10), 2019.

X = (x, y, z, φ) of the platform, φ its yaw; θ_i of the motors. u_i along the arm, n_i = ν_i × u_i
with the motor's axis ν_i; η_i along the rods: v_i of limbs 1, 2, w_i of limbs 3, 4; s_i from P to
B_i, k_i its derivative by φ; V_i = η_i·n_i. The bars are massless, as in the paper. The stiffness,
(11)–(21), is audited elsewhere.
"""

from mbverify.equations import (
    Mat, Vec, atan, cos, cross, diag, dot, equation, identity, linear_solve, motion, pi, rot_z, sin,
    skew, sqrt, states,
)

FORCE, MOMENT_Z = [3, -2, -5], 0.1  # on the platform at P

states(
    "scara_robot",
    coordinates=["platform.x", "platform.y", "platform.z", "platform.yaw"],
    ranges={"platform.x": [-0.07, -0.04], "platform.y": [-0.068, -0.032],
            "platform.z": [-0.175, -0.135], "platform.yaw": [-0.2, 0.3]},
    rates={"platform.x": 0.58, "platform.y": 0.52, "platform.z": 0.68, "platform.yaw": 6},
    accelerations={"platform.x": 22, "platform.y": 15, "platform.z": 23, "platform.yaw": 140},
    parameters={"ball_mass": 0, "pivot_mass": 0},
    loads=[{"body": "platform", "point": [0, 0, 0], "force": FORCE, "moment": [0, 0, MOMENT_Z]}],
)

LIMBS, FIRST, LAST = {"i": [1, 2, 3, 4]}, {"i": [1, 2]}, {"i": [3, 4]}
RODS = {**FIRST, "rod": ["rod_a", "rod_b"]}  # of limbs 1, 2; limbs 3, 4 have one rod
XYZ, PHI = {"k": [1, 2, 3]}, {"k": [4]}  # components of X
THETA = {f"t{i}": f"limb{i}.drive" for i in LIMBS["i"]}
THETA_D = {f"t{i}_d": f"limb{i}.drive.velocity" for i in LIMBS["i"]}
THETA_DD = {f"t{i}_dd": f"limb{i}.drive.acceleration" for i in LIMBS["i"]}

# What the paper defines.


def alpha(i):
    return (i - 1) * pi / 2


def radial(i):
    return Vec(cos(alpha(i)), sin(alpha(i)), 0.0)


def nu(i):
    """Axis of motor i."""
    return Vec(-sin(alpha(i)), cos(alpha(i)), 0.0)


class Limb:
    """Vectors of one limb, corrected."""

    def __init__(self, p, i, x, y, z, yaw, theta):
        self.L = p.l2 if i <= 2 else p.l3
        self.s = p.r * Vec(cos(yaw + alpha(i)), sin(yaw + alpha(i)), 0.0)
        self.k = p.r * Vec(-sin(yaw + alpha(i)), cos(yaw + alpha(i)), 0.0)
        self.u = cos(theta) * radial(i) - Vec(0.0, 0.0, sin(theta))
        self.n = cross(nu(i), self.u)
        self.e = Vec(0.0, 0.0, -p.e if i <= 2 else 0.0)
        self.eta = (Vec(x, y, z) + self.s - p.R * radial(i) - p.l1 * self.u - self.e) / self.L
        self.V = dot(self.eta, self.n)


class Robot:
    """All limbs, J_θ, J_x, J = J_x⁻¹ J_θ and J⁻¹ of (28); lists count from 0."""

    def __init__(self, p, x, y, z, yaw, *theta):
        self.limbs = [Limb(p, i, x, y, z, yaw, theta[i - 1]) for i in LIMBS["i"]]
        self.J_theta = Mat([[*b.eta, dot(b.eta, b.k)] for b in self.limbs])
        self.J_x = diag([p.l1 * b.V for b in self.limbs])
        self.J_inverse = linear_solve(self.J_theta, self.J_x)

    def J(self):
        return linear_solve(self.J_x, self.J_theta)

    def J_B(self, i):
        """(35), corrected."""
        rows = self.J_inverse
        return Mat(rows[:3]) + outer(self.limbs[i - 1].k, rows[3])

    def J_i1(self, p, i):
        """(31), corrected."""
        return p.l1 / 2 * outer(self.limbs[i - 1].n, unit(i))

    def J_i2(self, p, i):
        """(34), (36), corrected."""
        return 0.5 * (2 * self.J_i1(p, i) + self.J_B(i))

    def J_omega(self, p, i):
        """(37), (38), corrected."""
        b = self.limbs[i - 1]
        return skew(b.eta) @ (self.J_B(i) - 2 * self.J_i1(p, i)) / b.L


def outer(a, b):
    return Mat([[x * y for y in b] for x in a])


def unit(i):
    """Φ_i."""
    return Vec(1.0 if k == i else 0.0 for k in LIMBS["i"])


class Links:
    """Motion of one limb's links: centres of arm and rods, rotation of the rods with its spin."""

    def __init__(self, p, i, X, X_d, X_dd, theta, theta_d, theta_dd):
        b, a = Limb(p, i, *X, theta[i - 1]), nu(i)
        t_d, t_dd, f_d, f_dd = theta_d[i - 1], theta_dd[i - 1], X_d[3], X_dd[3]
        v_C, a_C = p.l1 * t_d * b.n, p.l1 * (t_dd * b.n - t_d**2 * b.u)
        v_B = Vec(X_d[:3]) + f_d * b.k
        a_B = Vec(X_dd[:3]) + f_dd * b.k - f_d**2 * b.s
        self.v1, self.a1 = v_C / 2, a_C / 2
        self.v2, self.a2 = (v_C + v_B) / 2, (a_C + a_B) / 2
        eta_d, eta_dd = (v_B - v_C) / b.L, (a_B - a_C) / b.L
        self.thin, self.thin_d = cross(b.eta, eta_d), cross(b.eta, eta_dd)
        slant, slant_d = dot(b.eta, a), dot(eta_d, a)
        psi_d = dot(eta_d, cross(a, b.eta)) / (1 - slant**2)
        psi_dd = (dot(eta_dd, cross(a, b.eta)) + 2 * slant * slant_d * psi_d) / (1 - slant**2)
        self.omega = self.thin + slant * psi_d * b.eta
        self.omega_d = (self.thin_d + slant * psi_d * eta_d
                        + (slant_d * psi_d + slant * psi_dd) * b.eta)
        self.eta = b.eta
        self.spin = slant / (1 - slant**2) * outer(b.eta, cross(a, b.eta))  # of η̇


def bar(mass, radius, length):
    """Inertia of a round bar across and along it."""
    return mass * (3 * radius**2 + length**2) / 12, mass * radius**2 / 2


def rod_inertia(p, i, eta, share=1.0):
    across, along = bar(share * p.m_rods, p.rod_radius, p.l2 if i <= 2 else p.l3)
    return across * (identity() - outer(eta, eta)) + along * outer(eta, eta)


# Position.


@equation("M_pa", gives="platform.rotation",
          printed="platform: three translations, one rotation about its normal")
def m_pa(p, yaw):
    return rot_z(yaw)


@equation("(1)", gives="platform.limb{i}.B.position from platform", each=LIMBS, unit="m",
          printed="s_i = r [c(φ+α_i), s(φ+α_i), 0]")
def eq1(p, i, yaw):
    phi, a = yaw, (i - 1) * pi / 2
    return p.r * Vec(cos(phi + a), sin(phi + a), 0)


@equation("(2)", gives="limb{i}.arm.position", each=LIMBS, unit="m",
          printed="r_i = R [cα_i, sα_i, 0]")
def eq2(p, i):
    a = (i - 1) * pi / 2
    return p.R * Vec(cos(a), sin(a), 0)


@equation("(3), (5)", gives="platform.limb{i}.B.position", each=FIRST, unit="m",
          given={"theta": "limb{i}.drive", "R_rod": "limb{i}.rod_a.rotation"},
          printed="p + s_i = r_i + l1 u_i + l2 v_i + e_i, e_i = (0, 0, +e)",
          corrected="e_i = (0, 0, −e): D_i lies above B_i")
def eq5(p, i, theta, R_rod):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    v_i = R_rod @ Vec(1, 0, 0)
    e_i = Vec(0, 0, p.e)
    return p.R * radial(i) + p.l1 * u_i + p.l2 * v_i + e_i


@eq5.corrected
def _(p, i, theta, R_rod):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    v_i = R_rod @ Vec(1, 0, 0)
    e_i = Vec(0, 0, -p.e)
    return p.R * radial(i) + p.l1 * u_i + p.l2 * v_i + e_i


@equation("(4)", gives="limb{i}.arm.rotation[{k},1]", each={**LIMBS, "k": [1, 2, 3]},
          given={"theta": "limb{i}.drive"}, printed="u_i = [cθ_i cα_i, cθ_i sα_i, −sθ_i]")
def eq4(p, i, k, theta):
    a = (i - 1) * pi / 2
    return Vec(cos(theta) * cos(a), cos(theta) * sin(a), -sin(theta))[k - 1]


@equation("(6)", gives="platform.limb{i}.B.position", each=LAST, unit="m",
          given={"theta": "limb{i}.drive", "R_rod": "limb{i}.rod.rotation"},
          printed="p + s_i = r_i + l1 u_i + l3 w_i")
def eq6(p, i, theta, R_rod):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    w_i = R_rod @ Vec(1, 0, 0)
    return p.R * radial(i) + p.l1 * u_i + p.l3 * w_i


@equation("(7)", gives="0", each=FIRST, given={"theta": "limb{i}.drive"}, unit="m²",
          printed="(p + s_i − r_i − l1 u_i − e_i)² = l2²", note="right once e_i is, see (3)")
def eq7(p, i, x, y, z, yaw, theta):
    b = Limb(p, i, x, y, z, yaw, theta)
    gap = Vec(x, y, z) + b.s - p.R * radial(i) - p.l1 * b.u - b.e
    return dot(gap, gap) - p.l2**2


@equation("(8)", gives="0", each=LAST, given={"theta": "limb{i}.drive"}, unit="m²",
          printed="(p + s_i − r_i − l1 u_i)² = l3²")
def eq8(p, i, x, y, z, yaw, theta):
    b = Limb(p, i, x, y, z, yaw, theta)
    gap = Vec(x, y, z) + b.s - p.R * radial(i) - p.l1 * b.u
    return dot(gap, gap) - p.l3**2


@equation("(22)", gives="limb{i}.rod_a.rotation[{k},1]", each={**FIRST, "k": [1, 2, 3]},
          given={"theta": "limb{i}.drive"}, printed="v_i = (p + s_i − r_i − l1 u_i − e_i)/l2",
          note="right once e_i is, see (3)")
def eq22(p, i, k, x, y, z, yaw, theta):
    b = Limb(p, i, x, y, z, yaw, theta)
    return ((Vec(x, y, z) + b.s - p.R * radial(i) - p.l1 * b.u - b.e) / p.l2)[k - 1]


@equation("(23)", gives="limb{i}.rod.rotation[{k},1]", each={**LAST, "k": [1, 2, 3]},
          given={"theta": "limb{i}.drive"}, printed="w_i = (p + s_i − r_i − l1 u_i)/l3")
def eq23(p, i, k, x, y, z, yaw, theta):
    b = Limb(p, i, x, y, z, yaw, theta)
    return ((Vec(x, y, z) + b.s - p.R * radial(i) - p.l1 * b.u) / p.l3)[k - 1]


@equation("(9)", gives="0", each=LAST, given={"theta": "limb{i}.drive"}, unit="m²",
          printed="E sθ + F cθ + G = 0, F = +2 l1 q·(cα x̂ + sα ŷ)",
          corrected="F = −2 l1 q·(cα x̂ + sα ŷ)",
          note="limbs 3, 4, which have no e; E_1 = E_2 means one expression")
def eq9(p, i, x, y, z, yaw, theta):
    q = Vec(x, y, z) + Limb(p, i, x, y, z, yaw, theta).s - p.R * radial(i)
    E = 2 * p.l1 * q[2]
    F = 2 * p.l1 * (q[0] * cos(alpha(i)) + q[1] * sin(alpha(i)))
    G = dot(q, q) + p.l1**2 - p.l3**2
    return E * sin(theta) + F * cos(theta) + G


@eq9.corrected
def _(p, i, x, y, z, yaw, theta):
    q = Vec(x, y, z) + Limb(p, i, x, y, z, yaw, theta).s - p.R * radial(i)
    E = 2 * p.l1 * q[2]
    F = -2 * p.l1 * (q[0] * cos(alpha(i)) + q[1] * sin(alpha(i)))
    G = dot(q, q) + p.l1**2 - p.l3**2
    return E * sin(theta) + F * cos(theta) + G


@equation("(10)", gives="limb{i}.drive", each=LIMBS, unit="rad",
          printed="θ = 2 atan[(−E − √(E² + F² − G²))/(G − F)] with (3) and (9) as printed",
          corrected="the same with F and e corrected; minus is the outward branch",
          note="of some poses the printed root is not real")
def eq10(p, i, x, y, z, yaw):
    s_i = p.r * Vec(cos(yaw + alpha(i)), sin(yaw + alpha(i)), 0)
    e_i = Vec(0, 0, p.e if i <= 2 else 0)
    L = p.l2 if i <= 2 else p.l3
    q = Vec(x, y, z) + s_i - p.R * radial(i) - e_i
    E = 2 * p.l1 * q[2]
    F = 2 * p.l1 * (q[0] * cos(alpha(i)) + q[1] * sin(alpha(i)))
    G = dot(q, q) + p.l1**2 - L**2
    return 2 * atan((-E - sqrt(E**2 + F**2 - G**2)) / (G - F))


@eq10.corrected
def _(p, i, x, y, z, yaw):
    s_i = p.r * Vec(cos(yaw + alpha(i)), sin(yaw + alpha(i)), 0)
    e_i = Vec(0, 0, -p.e if i <= 2 else 0)
    L = p.l2 if i <= 2 else p.l3
    q = Vec(x, y, z) + s_i - p.R * radial(i) - e_i
    E = 2 * p.l1 * q[2]
    F = -2 * p.l1 * (q[0] * cos(alpha(i)) + q[1] * sin(alpha(i)))
    G = dot(q, q) + p.l1**2 - L**2
    return 2 * atan((-E - sqrt(E**2 + F**2 - G**2)) / (G - F))


# Velocities and accelerations.


@equation("(24)", gives="platform.limb{i}.B.velocity", each=FIRST, unit="m/s",
          given={"theta": "limb{i}.drive", "theta_d": "limb{i}.drive.velocity",
                 "epsilon": "limb{i}.rod_a.angular_velocity", "R_rod": "limb{i}.rod_a.rotation"},
          printed="ṗ + ṡ_i = l1 θ̇_i (ν_i u_i) + l2 ε_i v_i",
          note="the cross signs are lost in print")
def eq24(p, i, theta, theta_d, epsilon, R_rod):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    v_i = R_rod @ Vec(1, 0, 0)
    return p.l1 * theta_d * cross(nu(i), u_i) + p.l2 * cross(epsilon, v_i)


@equation("(25)", gives="platform.limb{i}.B.velocity", each=LAST, unit="m/s",
          given={"theta": "limb{i}.drive", "theta_d": "limb{i}.drive.velocity",
                 "omega": "limb{i}.rod.angular_velocity", "R_rod": "limb{i}.rod.rotation"},
          printed="ṗ + ṡ_i = l1 θ̇_i (ν_i u_i) + l3 ω_i w_i",
          note="the cross signs are lost in print")
def eq25(p, i, theta, theta_d, omega, R_rod):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    w_i = R_rod @ Vec(1, 0, 0)
    return p.l1 * theta_d * cross(nu(i), u_i) + p.l3 * cross(omega, w_i)


@equation("(26)", gives="platform.limb{i}.B.velocity in limb{i}.rod_a[1]", each=FIRST, unit="m/s",
          given={"theta": "limb{i}.drive", "theta_d": "limb{i}.drive.velocity"},
          printed="η_i·(ṗ + ṡ_i) = l1 θ_i η_i·(ν_i × u_i)", corrected="θ̇_i for θ_i",
          note="a lost dot; the next equation has it")
def eq26(p, i, x, y, z, yaw, theta, theta_d):
    b = Limb(p, i, x, y, z, yaw, theta)
    return p.l1 * theta * dot(b.eta, cross(nu(i), b.u))


@eq26.corrected
def _(p, i, x, y, z, yaw, theta, theta_d):
    b = Limb(p, i, x, y, z, yaw, theta)
    return p.l1 * theta_d * dot(b.eta, cross(nu(i), b.u))


@equation("(27)", gives="platform.limb{i}.B.velocity in limb{i}.rod[1]", each=LAST, unit="m/s",
          given={"theta": "limb{i}.drive", "theta_d": "limb{i}.drive.velocity"},
          printed="η_i·(ṗ + ṡ_i) = l1 θ_i η_i·(ν_i × u_i)", corrected="θ̇_i for θ_i",
          note="as (26)")
def eq27(p, i, x, y, z, yaw, theta, theta_d):
    b = Limb(p, i, x, y, z, yaw, theta)
    return p.l1 * theta * dot(b.eta, cross(nu(i), b.u))


@eq27.corrected
def _(p, i, x, y, z, yaw, theta, theta_d):
    b = Limb(p, i, x, y, z, yaw, theta)
    return p.l1 * theta_d * dot(b.eta, cross(nu(i), b.u))


@equation("(28) J", gives="limb{i}.drive.velocity", each=LIMBS, unit="rad/s",
          given={"theta": "limb{i}.drive"}, printed="θ̇ = J Ẋ, J = J_x⁻¹ J_θ",
          note="row i; J_x multiplies θ̇, unusual names")
def eq28_J(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d):
    b = Limb(p, i, x, y, z, yaw, theta)
    J_theta = Vec(*b.eta, dot(b.eta, b.k))
    J_x = p.l1 * dot(b.eta, cross(nu(i), b.u))
    return J_theta @ Vec(x_d, y_d, z_d, yaw_d) / J_x


@equation("(28) Ẋ", gives="platform.velocity[{k}]", each=XYZ, given={**THETA, **THETA_D},
          unit="m/s, rad/s", printed="Ẋ = J⁻¹ θ̇ = J⁻¹ J_x⁻¹ J_θ",
          corrected="Ẋ = J⁻¹ θ̇ = J_θ⁻¹ J_x θ̇",
          note="a matrix cannot equal a vector; read as J⁻¹ J_x⁻¹ J_θ θ̇")
def eq28_X(p, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    theta_d = Vec(t1_d, t2_d, t3_d, t4_d)
    X_d = linear_solve(at.J(), linear_solve(at.J_x, at.J_theta @ theta_d))
    return X_d[k - 1]


@eq28_X.corrected
def _(p, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    theta_d = Vec(t1_d, t2_d, t3_d, t4_d)
    X_d = linear_solve(at.J_theta, at.J_x @ theta_d)
    return X_d[k - 1]


eq28_phi = equation(
    "(28) φ̇", gives="platform.yaw.velocity", each=PHI, given={**THETA, **THETA_D}, unit="rad/s",
    printed="Ẋ = J⁻¹ θ̇ = J⁻¹ J_x⁻¹ J_θ", corrected="Ẋ = J⁻¹ θ̇ = J_θ⁻¹ J_x θ̇", note="as (28) Ẋ",
)(eq28_X.function).corrected(eq28_X.right)


C44 = diag(0, 0, 0, 1)


def theta_form(p, b):
    """Θ_i of (30), corrected."""
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(b.n, b.eta) / b.V
    R_eta = R_i.T @ b.eta
    return (-p.l1 * dot(b.eta, b.s) * C44 + dot(b.eta, b.u) / b.V**2 * outer(R_eta, R_eta)
            + p.l1 / b.L * (R_i.T @ P.T @ P @ R_i)) / b.V


@equation("(29)", gives="limb{i}.drive.acceleration", each=LIMBS, unit="rad/s²",
          given={"theta": "limb{i}.drive"}, printed="f_i = Ẋᵀ Θ_i Ẋᵀ / l_i²",
          corrected="f_i = Ẋᵀ Θ_i Ẋ / l1² for every limb",
          note="θ̈ = J Ẍ + f with the corrected (30); l_i read as L_i")
def eq29(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    b = Limb(p, i, x, y, z, yaw, theta)
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    f_i = X_d @ (theta_form(p, b) @ X_d) / b.L**2
    return Vec(*b.eta, dot(b.eta, b.k)) @ X_dd / (p.l1 * b.V) + f_i


@eq29.corrected
def _(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    b = Limb(p, i, x, y, z, yaw, theta)
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    f_i = X_d @ (theta_form(p, b) @ X_d) / p.l1**2
    return Vec(*b.eta, dot(b.eta, b.k)) @ X_dd / (p.l1 * b.V) + f_i


@equation("(29) Ẍ", gives="platform.acceleration[{k}]", each=XYZ,
          given={**THETA, **THETA_DD}, unit="m/s², rad/s²", printed="Ẍ = J⁻¹ θ̈ − J⁻¹ f(Ẋ)",
          note="with the corrected f")
def eq29_X(p, k, x, y, z, yaw, t1, t2, t3, t4, x_d, y_d, z_d, yaw_d, t1_dd, t2_dd, t3_dd, t4_dd):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    X_d, theta_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    f = Vec(X_d @ (theta_form(p, b) @ X_d) / p.l1**2 for b in at.limbs)
    X_dd = at.J_inverse @ theta_dd - at.J_inverse @ f
    return X_dd[k - 1]


eq29_phi = equation(
    "(29) φ̈", gives="platform.yaw.acceleration", each=PHI, given={**THETA, **THETA_DD},
    unit="rad/s²", printed="Ẍ = J⁻¹ θ̈ − J⁻¹ f(Ẋ)", note="as (29) Ẍ",
)(eq29_X.function)


def drive_acceleration(p, b, form, X_d, X_dd):
    """θ̈_i = J Ẍ + f with a form Θ_i."""
    return Vec(*b.eta, dot(b.eta, b.k)) @ X_dd / (p.l1 * b.V) + X_d @ (form @ X_d) / p.l1**2


ROD_RATE = {**THETA, **THETA_D}


def rod_rate(p, i, X, X_d, t, t_d):
    """The rod's angular velocity."""
    return Links(p, i, X, X_d, Vec(0, 0, 0, 0), t, t_d, Vec(0, 0, 0, 0)).omega


@equation("(30)", gives="limb{i}.drive.acceleration", each=LIMBS, given=ROD_RATE, unit="rad/s²",
          printed="with all three errors below and misplaced transposes of R_i",
          corrected="Θ_i = (1/V)[−l1 (η·s) C + (η·u)/V² Rᵀηηᵀ R + (l1/L) RᵀPᵀP R], P = E − n ηᵀ/V",
          note="effect on θ̈; the transposes of R_i are corrected, else shapes do not fit")
def eq30(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd,
         t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, [t1, t2, t3, t4][i - 1])
    sigma = rod_rate(p, i, [x, y, z, yaw], X_d, [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d])
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(cross(sigma, b.u), b.eta) / b.V
    form = (p.l1 * dot(b.eta, b.k) * C44
            + dot(cross(sigma, b.u), cross(sigma, b.eta)) / b.V**2
            * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / p.l2 * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@eq30.corrected
def _(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, [t1, t2, t3, t4][i - 1])
    return drive_acceleration(p, b, theta_form(p, b), X_d, X_dd)


@equation("(30) first term", gives="limb{i}.drive.acceleration", each=LIMBS, unit="rad/s²",
          given={"theta": "limb{i}.drive"}, printed="+l1 (η·k_i) C", corrected="−l1 (η·s_i) C",
          note="∂k_i/∂φ = −s_i; the other terms corrected")
def eq30_first(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, theta)
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(b.n, b.eta) / b.V
    form = (p.l1 * dot(b.eta, b.k) * C44
            + dot(b.eta, b.u) / b.V**2 * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / b.L * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@eq30_first.corrected
def _(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, theta)
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(b.n, b.eta) / b.V
    form = (-p.l1 * dot(b.eta, b.s) * C44
            + dot(b.eta, b.u) / b.V**2 * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / b.L * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@equation("(30) σ_i", gives="limb{i}.drive.acceleration", each=LIMBS, given=ROD_RATE,
          unit="rad/s²", printed="σ_i = angular velocity of the rod",
          corrected="σ_i = ν_i, the motor axis: (σ × u)·(σ × η) = u·η",
          note="the other terms corrected")
def eq30_sigma(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd,
               t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, [t1, t2, t3, t4][i - 1])
    sigma = rod_rate(p, i, [x, y, z, yaw], X_d, [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d])
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(cross(sigma, b.u), b.eta) / b.V
    form = (-p.l1 * dot(b.eta, b.s) * C44
            + dot(cross(sigma, b.u), cross(sigma, b.eta)) / b.V**2
            * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / b.L * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@eq30_sigma.corrected
def _(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, [t1, t2, t3, t4][i - 1])
    sigma = nu(i)
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(cross(sigma, b.u), b.eta) / b.V
    form = (-p.l1 * dot(b.eta, b.s) * C44
            + dot(cross(sigma, b.u), cross(sigma, b.eta)) / b.V**2
            * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / b.L * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@equation("(30) l1/l2", gives="limb{i}.drive.acceleration", each=LIMBS, unit="rad/s²",
          given={"theta": "limb{i}.drive"}, printed="l1/l2 for every limb",
          corrected="l1/l3 for limbs 3, 4", note="the other terms corrected")
def eq30_ratio(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, theta)
    R_i = Mat([[*row, k] for row, k in zip(identity(), b.k)])
    P = identity() - outer(b.n, b.eta) / b.V
    form = (-p.l1 * dot(b.eta, b.s) * C44
            + dot(b.eta, b.u) / b.V**2 * outer(R_i.T @ b.eta, R_i.T @ b.eta)
            + p.l1 / p.l2 * (R_i.T @ P.T @ P @ R_i)) / b.V
    return drive_acceleration(p, b, form, X_d, X_dd)


@eq30_ratio.corrected
def _(p, i, x, y, z, yaw, theta, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd):
    X_d, X_dd = Vec(x_d, y_d, z_d, yaw_d), Vec(x_dd, y_dd, z_dd, yaw_dd)
    b = Limb(p, i, x, y, z, yaw, theta)
    return drive_acceleration(p, b, theta_form(p, b), X_d, X_dd)


# Links.

ARM = {"theta": "limb{i}.drive", "theta_d": "limb{i}.drive.velocity"}


@equation("(31) v_i1", gives="limb{i}.arm.com.velocity", each=LIMBS, given=ARM, unit="m/s",
          printed="v_i1 = ½ l1 θ̇_i (ν_i u_i)", note="lost cross")
def eq31_v(p, i, theta, theta_d):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    return p.l1 * theta_d * cross(nu(i), u_i) / 2


@equation("(31) J_i1", gives="limb{i}.arm.com.velocity", each=LIMBS, given={**ARM, **THETA_D},
          unit="m/s", printed="J_i1 = [½ l1 θ̇_i (ν_i × u_i)ᵀ 0]ᵀ Φ_i",
          corrected="J_i1 = ½ l1 (ν_i × u_i) Φ_iᵀ",
          note="contains θ̇_i, so that J_i1 θ̇ is quadratic in the rates; shapes corrected")
def eq31_J(p, i, theta, theta_d, t1_d, t2_d, t3_d, t4_d):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    J_i1 = outer(p.l1 * theta_d * cross(nu(i), u_i) / 2, unit(i))
    return J_i1 @ Vec(t1_d, t2_d, t3_d, t4_d)


@eq31_J.corrected
def _(p, i, theta, theta_d, t1_d, t2_d, t3_d, t4_d):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    J_i1 = outer(p.l1 * cross(nu(i), u_i) / 2, unit(i))
    return J_i1 @ Vec(t1_d, t2_d, t3_d, t4_d)


@equation("(32)", gives="limb{i}.arm.limb{i}.C.velocity", each=LIMBS, unit="m/s",
          given={"v_i1": "limb{i}.arm.com.velocity"}, printed="v_C = v_i1",
          corrected="v_C = 2 v_i1", note="the tip moves twice as fast as the middle")
def eq32(p, v_i1):
    return v_i1


@eq32.corrected
def _(p, v_i1):
    return 2 * v_i1


@equation("(33)", gives="platform.limb{i}.B.velocity", each=FIRST, unit="m/s",
          given={"v_D": "platform.limb{i}.D.velocity"}, printed="v_B = v_D",
          note="holds for i = 1, 2; the sentence before it says i = 3, 4")
def eq33(p, v_D):
    return v_D


# The middle of limbs 1, 2 is the mean of their rods'.

MIDDLE = {"v_C": "limb{i}.arm.limb{i}.C.velocity", "v_B": "platform.limb{i}.B.velocity"}


@equation("(34) v_i2", gives="limb{i}.rod_a.limb{i}.middle.velocity", each=FIRST, unit="m/s",
          given={**MIDDLE, "v_b": "limb{i}.rod_b.limb{i}.middle.velocity"},
          printed="v_i2 = ½ (v_C + v_D)",
          note="mean of both rods, less that of rod b; v_C corrected")
def eq34_v(p, v_C, v_B, v_b):
    v_D = v_B
    v_i2 = (v_C + v_D) / 2
    return 2 * v_i2 - v_b


@equation("(36) v_i2", gives="limb{i}.rod.com.velocity", each=LAST, given=MIDDLE, unit="m/s",
          printed="v_i2 = ½ (v_C + v_B)", note="with the corrected v_C")
def eq36_v(p, v_C, v_B):
    return (v_C + v_B) / 2


POSE_RATES = {**THETA, **THETA_D}


@equation("(34) J_i2", gives="limb{i}.rod_a.limb{i}.middle.velocity", each=FIRST, unit="m/s",
          given={**POSE_RATES, "v_b": "limb{i}.rod_b.limb{i}.middle.velocity"},
          printed="J_i2 = ½ (J_i1 + J_B)", corrected="J_i2 = ½ (2 J_i1 + J_B)",
          note="v_C is 2 v_i1; mean of both rods, less that of rod b")
def eq34_J(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, v_b):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    J_i1, J_B = at.J_i1(p, i), at.J_B(i)
    J_i2 = (J_i1 + J_B) / 2
    return 2 * (J_i2 @ Vec(t1_d, t2_d, t3_d, t4_d)) - v_b


@eq34_J.corrected
def _(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, v_b):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    J_i1, J_B = at.J_i1(p, i), at.J_B(i)
    J_i2 = (2 * J_i1 + J_B) / 2
    return 2 * (J_i2 @ Vec(t1_d, t2_d, t3_d, t4_d)) - v_b


@equation("(36) J_i2", gives="limb{i}.rod.com.velocity", each=LAST, given=POSE_RATES, unit="m/s",
          printed="J_i2 = ½ (J_i1 + J_B)", corrected="J_i2 = ½ (2 J_i1 + J_B)",
          note="v_C is 2 v_i1")
def eq36_J(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    J_i1, J_B = at.J_i1(p, i), at.J_B(i)
    J_i2 = (J_i1 + J_B) / 2
    return J_i2 @ Vec(t1_d, t2_d, t3_d, t4_d)


@eq36_J.corrected
def _(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    J_i1, J_B = at.J_i1(p, i), at.J_B(i)
    J_i2 = (2 * J_i1 + J_B) / 2
    return J_i2 @ Vec(t1_d, t2_d, t3_d, t4_d)


@equation("(35)", gives="platform.limb{i}.B.velocity", each=LIMBS, given=POSE_RATES, unit="m/s",
          printed="J_B = J⁻¹ + [k_1 k_2 k_3 k_4]", corrected="J_B = [E₃ k_i] J⁻¹",
          note="J⁻¹ has four rows; read as its top three")
def eq35(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    k_1, k_2, k_3, k_4 = (b.k for b in at.limbs)
    J_B = Mat(at.J_inverse[:3]) + Mat(k_1, k_2, k_3, k_4).T
    return J_B @ Vec(t1_d, t2_d, t3_d, t4_d)


@eq35.corrected
def _(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    E_k = Mat([[*row, k] for row, k in zip(identity(), at.limbs[i - 1].k)])
    return E_k @ at.J_inverse @ Vec(t1_d, t2_d, t3_d, t4_d)


ACROSS = {"k": [2, 3]}  # y and z of the rod


@equation("(37)", gives="limb{i}.{rod}.angular_velocity in limb{i}.{rod}[{k}]", unit="rad/s",
          each={**RODS, **ACROSS},
          given={**POSE_RATES, "R_rod": "limb{i}.{rod}.rotation"},
          printed="ε_i = (1/l2) U_i (J_B − 2 J_i1) θ̇, the part across the rod",
          note="with (35) corrected; both rods of a limb turn alike")
def eq37(p, i, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, R_rod):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    U_i = skew(at.limbs[i - 1].eta)
    epsilon = U_i @ (at.J_B(i) - 2 * at.J_i1(p, i)) @ Vec(t1_d, t2_d, t3_d, t4_d) / p.l2
    return (R_rod.T @ epsilon)[k - 1]


@equation("(37) whole", gives="limb{i}.{rod}.angular_velocity", each=RODS, given=POSE_RATES,
          unit="rad/s", printed="ε_i without spin",
          corrected="ε_i = η × η̇ + b ψ̇ η, b = η·a, ψ̇ = η̇·(a × η)/(1 − b²)",
          note="the rods turn about their own axes too; 1e-5 of the torque, rods thin")
def eq37_whole(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    b, theta_d = at.limbs[i - 1], Vec(t1_d, t2_d, t3_d, t4_d)
    eta_d = (at.J_B(i) - 2 * at.J_i1(p, i)) @ theta_d / b.L
    return cross(b.eta, eta_d)


@eq37_whole.corrected
def _(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    b, theta_d, a = at.limbs[i - 1], Vec(t1_d, t2_d, t3_d, t4_d), nu(i)
    eta_d = (at.J_B(i) - 2 * at.J_i1(p, i)) @ theta_d / b.L
    slant = dot(b.eta, a)
    psi_d = dot(eta_d, cross(a, b.eta)) / (1 - slant**2)
    return cross(b.eta, eta_d) + slant * psi_d * b.eta


eq37_whole_last = equation(
    "(37) whole, limbs 3, 4", gives="limb{i}.rod.angular_velocity", each=LAST, given=POSE_RATES,
    unit="rad/s", printed="ε_i without spin",
    corrected="ε_i = η × η̇ + b ψ̇ η, b = η·a, ψ̇ = η̇·(a × η)/(1 − b²)",
)(eq37_whole.function).corrected(eq37_whole.right)


@equation("(38)", gives="limb{i}.rod.angular_velocity in limb{i}.rod[{k}]", each={**LAST, **ACROSS},
          given={**POSE_RATES, "R_rod": "limb{i}.rod.rotation"}, unit="rad/s",
          printed="ω_i = (1/l2) U_i (…) θ̇", corrected="1/l3",
          note="limbs 3, 4, the part across the rod")
def eq38(p, i, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, R_rod):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    U_i = skew(at.limbs[i - 1].eta)
    omega = U_i @ (at.J_B(i) - 2 * at.J_i1(p, i)) @ Vec(t1_d, t2_d, t3_d, t4_d) / p.l2
    return (R_rod.T @ omega)[k - 1]


@eq38.corrected
def _(p, i, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, R_rod):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    U_i = skew(at.limbs[i - 1].eta)
    omega = U_i @ (at.J_B(i) - 2 * at.J_i1(p, i)) @ Vec(t1_d, t2_d, t3_d, t4_d) / p.l3
    return (R_rod.T @ omega)[k - 1]


MOTION = {**THETA, **THETA_D, **THETA_DD}


def with_rate(p, jacobian_at, X, X_d, t, t_d):
    """A Jacobian of Robot and its rate."""
    J, J_d, _ = motion(lambda *q: jacobian_at(Robot(p, *q)), [*X, *t], [*X_d, *t_d], [0] * 8)
    return J, J_d


def across_the_rod(epsilon_d, R_rod, w):
    """Less the spin's part: the rod's axis turns while the rod spins about it."""
    eta = R_rod @ Vec(1, 0, 0)
    return R_rod.T @ (epsilon_d + dot(w, eta) * cross(w, eta))


@equation("(39)", gives="limb{i}.rod_a.angular_acceleration in limb{i}.rod_a[{k}]", unit="rad/s²",
          each={**FIRST, **ACROSS},
          given={**MOTION, "R_rod": "limb{i}.rod_a.rotation",
                 "w": "limb{i}.rod_a.angular_velocity"},
          printed="ε̇_i = J̇_εi θ̇ + J_εi θ̈",
          note="two dots on the left are a misprint; without spin, across the rod")
def eq39(p, i, k, x, y, z, yaw, x_d, y_d, z_d, yaw_d, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d,
         t1_dd, t2_dd, t3_dd, t4_dd, R_rod, w):
    theta, theta_d = [t1, t2, t3, t4], Vec(t1_d, t2_d, t3_d, t4_d)
    J_e, J_e_d = with_rate(p, lambda at: at.J_omega(p, i), [x, y, z, yaw], [x_d, y_d, z_d, yaw_d],
                           theta, theta_d)
    epsilon_d = J_e_d @ theta_d + J_e @ Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    return across_the_rod(epsilon_d, R_rod, w)[k - 1]


@equation("(40)", gives="limb{i}.rod.angular_acceleration in limb{i}.rod[{k}]", unit="rad/s²",
          each={**LAST, **ACROSS},
          given={**MOTION, "R_rod": "limb{i}.rod.rotation", "w": "limb{i}.rod.angular_velocity"},
          printed="ω̇_i = J̇_εi θ̇ + J_εi θ̈", corrected="J_ωi, with 1/l3",
          note="the Jacobian of limbs 1, 2, with 1/l2; without spin, across the rod")
def eq40(p, i, k, x, y, z, yaw, x_d, y_d, z_d, yaw_d, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d,
         t1_dd, t2_dd, t3_dd, t4_dd, R_rod, w):
    def J_epsilon(at):
        return skew(at.limbs[i - 1].eta) @ (at.J_B(i) - 2 * at.J_i1(p, i)) / p.l2

    theta, theta_d = [t1, t2, t3, t4], Vec(t1_d, t2_d, t3_d, t4_d)
    J_e, J_e_d = with_rate(p, J_epsilon, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], theta, theta_d)
    omega_d = J_e_d @ theta_d + J_e @ Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    return across_the_rod(omega_d, R_rod, w)[k - 1]


@eq40.corrected
def _(p, i, k, x, y, z, yaw, x_d, y_d, z_d, yaw_d, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d,
      t1_dd, t2_dd, t3_dd, t4_dd, R_rod, w):
    def J_omega(at):
        return skew(at.limbs[i - 1].eta) @ (at.J_B(i) - 2 * at.J_i1(p, i)) / p.l3

    theta, theta_d = [t1, t2, t3, t4], Vec(t1_d, t2_d, t3_d, t4_d)
    J_w, J_w_d = with_rate(p, J_omega, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], theta, theta_d)
    omega_d = J_w_d @ theta_d + J_w @ Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    return across_the_rod(omega_d, R_rod, w)[k - 1]


@equation("(41)", gives="limb{i}.{rod}.com.acceleration", each=RODS, given=MOTION, unit="m/s²",
          printed="v̇_i2 = J̇_i2 θ̇ + J_i2 θ̈",
          note="with J_i2 corrected; both rods of a limb move alike")
def eq41(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d,
         t1_dd, t2_dd, t3_dd, t4_dd):
    theta, theta_d = [t1, t2, t3, t4], Vec(t1_d, t2_d, t3_d, t4_d)
    J, J_d = with_rate(p, lambda at: at.J_i2(p, i), [x, y, z, yaw], [x_d, y_d, z_d, yaw_d],
                       theta, theta_d)
    return J_d @ theta_d + J @ Vec(t1_dd, t2_dd, t3_dd, t4_dd)


eq41_last = equation(
    "(41) limbs 3, 4", gives="limb{i}.rod.com.acceleration", each=LAST, given=MOTION, unit="m/s²",
    printed="v̇_i2 = J̇_i2 θ̇ + J_i2 θ̈", note="with J_i2 corrected",
)(eq41.function)


# Forces. Q contains the weight, which the reference's inertia forces do not.


def without_weight(p, m, Q):
    return Q + Vec(0.0, 0.0, m * p.g)


@equation("(42)", gives="platform.inertia_force", unit="N",
          printed="Q = m_p g ẑ − m_p p̈", corrected="Q = −m_p g ẑ − m_p p̈, z up",
          note="the printed weight lifts the platform")
def eq42(p, x_dd, y_dd, z_dd):
    Q = p.m_p * p.g * Vec(0, 0, 1) - p.m_p * Vec(x_dd, y_dd, z_dd)
    return without_weight(p, p.m_p, Q)


@eq42.corrected
def _(p, x_dd, y_dd, z_dd):
    Q = -p.m_p * p.g * Vec(0, 0, 1) - p.m_p * Vec(x_dd, y_dd, z_dd)
    return without_weight(p, p.m_p, Q)


@equation("(42) moment", gives="platform.inertia_moment[3]", unit="N m",
          printed="no moment of inertia", corrected="−I_pz φ̈ about z",
          note="I_pz is not printed either; a square plate is assumed")
def eq42_moment(p, yaw_dd):
    return 0.0


@eq42_moment.corrected
def _(p, yaw_dd):
    return -p.I_p_z * yaw_dd


ARM_MOTION = {**ARM, "theta_dd": "limb{i}.drive.acceleration"}


@equation("(43) Q_i1", gives="limb{i}.arm.inertia_force", each=LIMBS, unit="N",
          given=ARM_MOTION, printed="Q_i1 = m_i1 (g − v̇_i1)")
def eq43_Q(p, i, theta, theta_d, theta_dd):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    v_d = p.l1 / 2 * (theta_dd * cross(nu(i), u_i) - theta_d**2 * u_i)
    Q = p.m_arm * (Vec(0, 0, -p.g) - v_d)
    return without_weight(p, p.m_arm, Q)


@equation("(43) T_i1", gives="limb{i}.arm.inertia_moment", each=LIMBS, given=ARM_MOTION, unit="N m",
          printed="T_i1 = −θ̈_i I ν_i − θ̇_i² ν_i (I ν_i)",
          note="read with the lost cross and the dots on θ")
def eq43_T(p, i, theta, theta_d, theta_dd):
    u_i = cos(theta) * radial(i) - Vec(0, 0, sin(theta))
    across, along = bar(p.m_arm, p.arm_radius, p.l1)
    I = across * (identity() - outer(u_i, u_i)) + along * outer(u_i, u_i)
    return -theta_dd * (I @ nu(i)) - theta_d**2 * cross(nu(i), I @ nu(i))


@equation("(44), (45) Q_i2", gives="limb{i}.{rod}.inertia_force", each=RODS, unit="N",
          given=MOTION, printed="Q_i2 = m_i2 (g − v̇_i2)",
          note="per rod")
def eq44_Q(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd,
           t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd):
    links = Links(p, i, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                  [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d], [t1_dd, t2_dd, t3_dd, t4_dd])
    m = p.m_rods / 2 if i <= 2 else p.m_rods
    Q = m * (Vec(0, 0, -p.g) - links.a2)
    return without_weight(p, m, Q)


eq45_Q = equation(
    "(44), (45) Q_i2, limbs 3, 4", gives="limb{i}.rod.inertia_force", each=LAST, unit="N",
    given=MOTION, printed="Q_i2 = m_i2 (g − v̇_i2)",
)(eq44_Q.function)


@equation("(44), (45) T_i2", gives="limb{i}.{rod}.inertia_moment", each=RODS, given=MOTION,
          unit="N m", printed="T_i2 = −I ε̇_i − ε_i (I ε_i)",
          note="per rod; read with the lost dot and cross; ε with spin")
def eq44_T(p, i, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd,
           t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd):
    links = Links(p, i, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                  [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d], [t1_dd, t2_dd, t3_dd, t4_dd])
    I = rod_inertia(p, i, links.eta, 0.5 if i <= 2 else 1.0)
    return -(I @ links.omega_d) - cross(links.omega, I @ links.omega)


eq45_T = equation(
    "(44), (45) T_i2, limbs 3, 4", gives="limb{i}.rod.inertia_moment", each=LAST, given=MOTION,
    unit="N m", printed="T_i2 = −I ε̇_i − ε_i (I ε_i)",
    note="read with the lost dot and cross; ε with spin",
)(eq44_T.function)


def links_of(p, X, X_d, X_dd, t, t_d, t_dd):
    return [(i, Links(p, i, X, X_d, X_dd, t, t_d, t_dd)) for i in LIMBS["i"]]


def link_power(p, X, X_d, X_dd, t, t_d, t_dd):
    """Σ (Qᵀδx + Tᵀδϑ) of the links with the motion as virtual motion."""
    g, power = Vec(0.0, 0.0, -p.g), 0.0
    arm = bar(p.m_arm, p.arm_radius, p.l1)[0]
    for i, b in links_of(p, X, X_d, X_dd, t, t_d, t_dd):
        I = rod_inertia(p, i, b.eta)
        T = -(I @ b.omega_d) - cross(b.omega, I @ b.omega)
        power += (p.m_arm * dot(g - b.a1, b.v1) - arm * t_dd[i - 1] * t_d[i - 1]
                  + p.m_rods * dot(g - b.a2, b.v2) + dot(T, b.omega))
    return power


TORQUES = {f"M{i}": f"limb{i}.drive.force" for i in LIMBS["i"]}


@equation("(46)", gives="0", given={**MOTION, **TORQUES}, unit="W",
          printed="Mᵀδθ + Fᵀδ(x, y, z) + Qᵀδ(x, y, z) + Σ(Qᵀδx + Tᵀδϑ) = 0",
          corrected="δX = (δx, δy, δz, δφ), with M_z − I_pz φ̈ about z and (42) corrected",
          note="the motion as virtual motion; as printed δX has three components, but is "
          "multiplied with 4-column matrices")
def eq46(p, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4,
         t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd, M1, M2, M3, M4):
    theta, theta_d = Vec(t1, t2, t3, t4), Vec(t1_d, t2_d, t3_d, t4_d)
    v, M, F = Vec(x_d, y_d, z_d), Vec(M1, M2, M3, M4), Vec(FORCE)
    Q = p.m_p * p.g * Vec(0, 0, 1) - p.m_p * Vec(x_dd, y_dd, z_dd)
    links = link_power(p, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                       theta, theta_d, Vec(t1_dd, t2_dd, t3_dd, t4_dd))
    return dot(M, theta_d) + dot(F, v) + dot(Q, v) + links


@eq46.corrected
def _(p, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4,
      t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd, M1, M2, M3, M4):
    theta, theta_d = Vec(t1, t2, t3, t4), Vec(t1_d, t2_d, t3_d, t4_d)
    v, M, F = Vec(x_d, y_d, z_d), Vec(M1, M2, M3, M4), Vec(FORCE)
    Q = -p.m_p * p.g * Vec(0, 0, 1) - p.m_p * Vec(x_dd, y_dd, z_dd)
    links = link_power(p, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                       theta, theta_d, Vec(t1_dd, t2_dd, t3_dd, t4_dd))
    return (dot(M, theta_d) + dot(F, v) + dot(Q, v) + (MOMENT_Z - p.I_p_z * yaw_dd) * yaw_d
            + links)


@equation("(47) δX", gives="platform.velocity[{k}]", each=XYZ, given=POSE_RATES,
          unit="m/s, rad/s", printed="δX = J δθ", corrected="δX = J⁻¹ δθ",
          note="J maps Ẋ to θ̇; with θ̇ as δθ")
def eq47_X(p, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    dX = at.J() @ Vec(t1_d, t2_d, t3_d, t4_d)
    return dX[k - 1]


@eq47_X.corrected
def _(p, k, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    dX = linear_solve(at.J(), Vec(t1_d, t2_d, t3_d, t4_d))
    return dX[k - 1]


eq47_phi = equation(
    "(47) δφ", gives="platform.yaw.velocity", each=PHI, given=POSE_RATES, unit="rad/s",
    printed="δX = J δθ", corrected="δX = J⁻¹ δθ", note="as (47) δX",
)(eq47_X.function).corrected(eq47_X.right)


@equation("(47) δϑ_i1", gives="limb{i}.arm.angular_velocity", each=LIMBS, given=POSE_RATES,
          unit="rad/s", printed="δϑ_i1 = J_εi δθ",
          corrected="δϑ_i1 = ν_i Φ_iᵀ δθ (arm), δϑ_i2 = J_ωi δθ (rods)",
          note="the rods' rotation under the arms' name; the arms' is missing")
def eq47_arm(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    J_epsilon = Robot(p, x, y, z, yaw, t1, t2, t3, t4).J_omega(p, i)
    return J_epsilon @ Vec(t1_d, t2_d, t3_d, t4_d)


@eq47_arm.corrected
def _(p, i, x, y, z, yaw, t1, t2, t3, t4, t1_d, t2_d, t3_d, t4_d):
    return outer(nu(i), unit(i)) @ Vec(t1_d, t2_d, t3_d, t4_d)


@equation("(48)", gives="limb{j}.drive.force", each={"j": [1, 2, 3, 4]}, given=MOTION, unit="N m",
          printed="M = (Σ m_ij J_ijᵀ − m_p Jᵀ ẑ) g + […] Ẋ + […] Ẍ",
          corrected="M = J⁻ᵀ{[m_p (p̈ − g); I_pz φ̈] − [F; M_z]} + Σ{J_i1ᵀ m_i1 (v̇_i1 − g) + "
          "I θ̈_i Φ_i + J_i2ᵀ m_i2 (v̇_i2 − g) + J_ωiᵀ [I ω̇ + ω × I ω]}",
          note="printed in its most generous reading (J⁻¹ for J, no factor θ_i): no external "
          "force, no inertia of the platform, weights of links and platform against each other, "
          "arms' inertia with the wrong sign, no ω × Iω")
def eq48(p, j, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4,
         t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    theta_dd = Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    up = Vec(0, 0, 1)
    arm = bar(p.m_arm, p.arm_radius, p.l1)[0]
    M = -p.m_p * p.g * at.J_inverse[2]
    for i, b in links_of(p, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                         [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d], theta_dd):
        J_1, J_2, J_w = at.J_i1(p, i), at.J_i2(p, i), at.J_omega(p, i)
        rod = bar(p.m_rods, p.rod_radius, at.limbs[i - 1].L)[0]
        M = M + p.g * (p.m_arm * (J_1.T @ up) + p.m_rods * (J_2.T @ up))
        M = M - p.m_arm * (J_1.T @ b.a1) + arm * theta_dd[i - 1] * unit(i)
        M = M + p.m_rods * (J_2.T @ b.a2) + rod * (J_w.T @ b.thin_d)
    return M[j - 1]


@eq48.corrected
def _(p, j, x, y, z, yaw, x_d, y_d, z_d, yaw_d, x_dd, y_dd, z_dd, yaw_dd, t1, t2, t3, t4,
      t1_d, t2_d, t3_d, t4_d, t1_dd, t2_dd, t3_dd, t4_dd):
    at = Robot(p, x, y, z, yaw, t1, t2, t3, t4)
    theta_dd = Vec(t1_dd, t2_dd, t3_dd, t4_dd)
    g = Vec(0, 0, -p.g)
    arm = bar(p.m_arm, p.arm_radius, p.l1)[0]
    f = p.m_p * (Vec(x_dd, y_dd, z_dd) - g) - Vec(FORCE)
    M = at.J_inverse.T @ Vec(*f, p.I_p_z * yaw_dd - MOMENT_Z)
    for i, b in links_of(p, [x, y, z, yaw], [x_d, y_d, z_d, yaw_d], [x_dd, y_dd, z_dd, yaw_dd],
                         [t1, t2, t3, t4], [t1_d, t2_d, t3_d, t4_d], theta_dd):
        J_1, J_2 = at.J_i1(p, i), at.J_i2(p, i)
        J_w = at.J_omega(p, i) + b.spin @ (at.J_B(i) - 2 * J_1) / at.limbs[i - 1].L
        I = rod_inertia(p, i, b.eta)
        M = M + p.m_arm * (J_1.T @ (b.a1 - g)) + arm * theta_dd[i - 1] * unit(i)
        M = M + p.m_rods * (J_2.T @ (b.a2 - g))
        M = M + J_w.T @ (I @ b.omega_d + cross(b.omega, I @ b.omega))
    return M[j - 1]
