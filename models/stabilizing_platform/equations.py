"""The equations of the stabilizing platform's paper, as printed and as they should be.

Li E., Zhao T., Wang C., Bian H., Hu Q., Ji W.: Dynamics of large-scale heavy-burden parallel
stabilizing cargo-receiving platform. Transactions of the Chinese Society for Agricultural Machinery
49 (3), 2018.

α, β, h are roll, pitch and heave of the ship, z0 the height of the level upper platform, γ its yaw.
The drives of a limb are equally long. Frames: {e} earth, {o} lower platform, {p} upper platform,
{A_i} limb plane: Y tangential, Z along A_i B_i, X = Y × Z. λ_i is the limb's tilt; q1, q2 of links
1 and 2 count from Y towards Z, those of links 1' and 2' from −Y. Twists are [ω; v] with v of the
body's point at the frame's origin.
"""

from mbverify.equations import (
    Mat, Vec, atan, cos, cross, dot, equation, hypot, identity, linear_solve, motion, norm,
    pi, rot_x, rot_y, rot_z, sin, sqrt, states, tan, unreachable, vee,
)

states(
    "stabilizing_platform",
    coordinates=["heave", "roll", "pitch", "platform.z", "platform.roll", "platform.pitch",
                 "limb1.drive - limb1.drive_p", "limb2.drive - limb2.drive_p",
                 "limb3.drive - limb3.drive_p"],
    ranges={
        "heave": [-1.2, 1.2], "roll": [-0.105, 0.105], "pitch": [-0.052, 0.052],
        "platform.z": [3.5, 3.5], "platform.roll": [0, 0], "platform.pitch": [0, 0],
        "limb1.drive - limb1.drive_p": [0, 0], "limb2.drive - limb2.drive_p": [0, 0],
        "limb3.drive - limb3.drive_p": [0, 0],
    },
    rates={"heave": 1.6, "roll": 0.11, "pitch": 0.082},
    accelerations={"heave": 1.6, "roll": 0.115, "pitch": 0.13},
)

LIMBS, SIDES = {"i": [1, 2, 3]}, {"side": ["", "_p"]}

SHIP = {"al": "roll", "be": "pitch", "h": "heave", "z0": "platform.z"}
SHIP_D = {"al_d": "roll.velocity", "be_d": "pitch.velocity", "h_d": "heave.velocity"}
SHIP_DD = {"al_dd": "roll.acceleration", "be_dd": "pitch.acceleration",
           "h_dd": "heave.acceleration"}
YAW = {"ga": "platform.yaw"}
YAW_D, YAW_DD = {"ga_d": "platform.yaw.velocity"}, {"ga_dd": "platform.yaw.acceleration"}


def of(names, quantities):
    """Those of the quantities that are named."""
    return {name: quantities[name] for name in names.split()}


# What the paper defines.


def azimuth(p, i):
    return [0.0, p.theta_1, p.theta_2][i - 1]


def e_r(p, i):
    return Vec(cos(azimuth(p, i)), sin(azimuth(p, i)), 0.0)


def e_t(p, i):
    return Vec(-sin(azimuth(p, i)), cos(azimuth(p, i)), 0.0)


def outer(a, b):
    return Mat([[x * y for y in b] for x in a])


def rotation_screw(s, r):
    return Vec(*s, *cross(r, s))


def bracket(V1, V2):
    """[V1, V2] = ad(V1) V2."""
    w1, v1, w2, v2 = Vec(V1[:3]), Vec(V1[3:]), Vec(V2[:3]), Vec(V2[3:])
    return Vec(*cross(w1, w2), *(cross(v1, w2) + cross(w1, v2)))


def Ad(R, r, V):
    """Ad(R, r) V."""
    w = R @ Vec(V[:3])
    return Vec(*w, *(R @ Vec(V[3:]) + cross(r, w)))


JOINTS = {"u": "limb{i}.U1{side}.1", "r": "limb{i}.R12{side}"}


def q1_q2(u, r):
    """q1 and q2 of either side, from the angle of link 1 over Y (blunt on the primed side) and the
    angle between the links."""
    return (u, u + r) if u < pi / 2 else (pi - u, pi - u - r)


# Screws of a limb, closure conditions.

TIP = {"tip": "limb{i}.link2.limb{i}.tip.position", "A": "lower_platform.limb{i}.A.position"}
TIP_IN_BASE = "limb{i}.link2.limb{i}.tip.position in lower_platform from lower_platform"
CHAIN = {
    "R_A": "lower_platform.limb{i}.A.rotation", "A": "lower_platform.limb{i}.A.position",
    "E": "limb{i}.link2.position", "lam": "limb{i}.U1.0", "lam_d": "limb{i}.U1.0.velocity",
    "q1_d": "limb{i}.U1.1.velocity", "q21_d": "limb{i}.R12.velocity",
    "w_o": "lower_platform.angular_velocity", "v_A": "lower_platform.limb{i}.A.velocity",
}


@equation("(1) $1, $2, $3: ω", gives="limb{i}.link2.angular_velocity", each=LIMBS, given=CHAIN,
          unit="rad/s", printed="R12 at (0, b2, c2): (1 0 0; 0 c2 −b2)",
          note="link 2 from tilt and joint rates")
def eq1_omega(p, R_A, A, E, lam, lam_d, q1_d, q21_d, w_o, v_A):
    axes = R_A @ rot_y(lam)
    s1, s2, s3 = Vec(1, 0, 0), Vec(0, 1, 0), Vec(1, 0, 0)
    return w_o + axes @ (q1_d * s1 + lam_d * s2 + q21_d * s3)


@equation("(1) $1, $2, $3: v", gives="limb{i}.link2.velocity", each=LIMBS, given=CHAIN, unit="m/s",
          printed="R12 at (0, b2, c2): (1 0 0; 0 c2 −b2)", note="link 2 from tilt and joint rates")
def eq1_v(p, R_A, A, E, lam, lam_d, q1_d, q21_d, w_o, v_A):
    axes = R_A @ rot_y(lam)
    at = axes.T @ (E - A)
    b1, b2, c2 = p.L5, at[1], at[2]
    S1, S2, S3 = Vec(1, 0, 0, 0, 0, b1), Vec(0, 1, 0, 0, 0, 0), Vec(1, 0, 0, 0, c2, -b2)
    V = q1_d * S1 + lam_d * S2 + q21_d * S3
    return v_A + cross(w_o, E - A) + axes @ (Vec(V[3:]) + cross(V[:3], at))


@equation("(1) R12'", gives="limb{i}.link2_p.position", each=LIMBS, unit="m",
          given={"R_A": CHAIN["R_A"], "A": CHAIN["A"], "E": CHAIN["E"], "lam": CHAIN["lam"]},
          printed="R12' at (0, −b2, −c2)",
          corrected="R12' at (0, −b2, +c2), as its screw (1 0 0; 0 c2 b2) says")
def eq1_place(p, R_A, A, E, lam):
    axes = R_A @ rot_y(lam)
    at = axes.T @ (E - A)
    b2, c2 = at[1], at[2]
    return A + axes @ Vec(0, -b2, -c2)


@eq1_place.corrected
def _(p, R_A, A, E, lam):
    axes = R_A @ rot_y(lam)
    at = axes.T @ (E - A)
    b2, c2 = at[1], at[2]
    return A + axes @ Vec(0, -b2, c2)


@equation("(2)", gives="0", each=LIMBS, unit="m/s",
          given={"R_o": "lower_platform.rotation", "o": "lower_platform.position",
                 "v_o": "lower_platform.velocity", "w_o": "lower_platform.angular_velocity",
                 "B": "platform.limb{i}.B.position", "v_B": "platform.limb{i}.B.velocity"},
          printed="equivalent RPS screws $e1 … $e5",
          note="part of the relative twist outside their span: the velocity of B along Y")
def eq2(p, i, R_o, o, v_o, w_o, B, v_B):
    Y = R_o @ e_t(p, i)
    return dot(Y, v_B - v_o - cross(w_o, B - o))


@equation("(3)", gives="platform.position", each=LIMBS, unit="m",
          given=of("al be h R_ep r_oB", {**SHIP, "R_ep": "platform.rotation", "r_oB": TIP_IN_BASE}),
          printed="r_ep = r_es + R_es r_so + R_eo r_oB − R_ep r_pB",
          note="with the tips B_i of links 2")
def eq3(p, i, al, be, h, R_ep, r_oB):
    r_es, r_so, r_pB = Vec(0, 0, h), Vec(0, 0, p.s_r_so), p.r_b * e_r(p, i)
    R_es = R_eo = rot_x(al) @ rot_y(be)
    return r_es + R_es @ r_so + R_eo @ r_oB - R_ep @ r_pB


@equation("(4)", gives="0", unit="m",
          given={"B": "limb3.link2.limb3.tip.position in lower_platform from lower_platform"},
          printed="y_B/x_B = 0, tan θ1, tan θ2 with θ1 = θ2 = 120°", corrected="θ2 = 240°",
          note="distance of B_3 from the plane of limb 3")
def eq4(p, B):
    theta_2 = p.theta_1
    return -sin(theta_2) * B[0] + cos(theta_2) * B[1]


@eq4.corrected
def _(p, B):
    theta_2 = p.theta_2
    return -sin(theta_2) * B[0] + cos(theta_2) * B[1]


# Parasitic motion.


def u_of(t1, t2):
    u1 = sin(t1) * tan(t2) - sin(t2) * tan(t1)
    u2 = tan(t1) * tan(t2) * (sin(t1) - sin(t2))
    u3 = tan(t1) * (1 - cos(t2)) - tan(t2) * (1 - cos(t1))
    return u1, u2, u3


@equation("section 4 data, in (5)", gives="platform.yaw", given=of("al be", SHIP), unit="rad",
          printed="θ1 = θ2 = 120°: u1 = u2 = u3 = 0, γ = atan(0/0)", corrected="θ2 = 240°")
def data_in_5(p, al, be):
    u1, u2, u3 = u_of(p.theta_1, p.theta_1)
    return atan((u1 * (cos(be) - cos(al)) + u2 * sin(al) * sin(be))
                / (u3 * cos(al) + u2 * cos(be) - u1 * sin(al) * sin(be)))


@data_in_5.corrected
def _(p, al, be):
    u1, u2, u3 = u_of(p.theta_1, p.theta_2)
    return atan((u1 * (cos(be) - cos(al)) + u2 * sin(al) * sin(be))
                / (u3 * cos(al) + u2 * cos(be) - u1 * sin(al) * sin(be)))


@equation("(5) γ", gives="platform.yaw", given=of("al be", SHIP), unit="rad", printed="γ = atan[…]")
def eq5_gamma(p, al, be):
    t1, t2 = p.theta_1, p.theta_2
    u1 = sin(t1) * tan(t2) - sin(t2) * tan(t1)
    u2 = tan(t1) * tan(t2) * (sin(t1) - sin(t2))
    u3 = tan(t1) * (1 - cos(t2)) - tan(t2) * (1 - cos(t1))
    return atan((u1 * (cos(be) - cos(al)) + u2 * sin(al) * sin(be))
                / (u3 * cos(al) + u2 * cos(be) - u1 * sin(al) * sin(be)))


@equation("(5) y", gives="platform.y", given=of("al h z0 ga", {**SHIP, **YAW}), unit="m",
          printed="y = −tα (z0 − h) − r_b sγ")
def eq5_y(p, al, h, z0, ga):
    return -tan(al) * (z0 - h) - p.r_b * sin(ga)


@equation("(5) x", gives="platform.x", given={**SHIP, **YAW}, unit="m",
          printed="x = tβ/cα (z0 − h) − r_b cδ + r_b (cα − sα sβ tθ2)(sδ − sγ)/(cβ tθ2)")
def eq5_x(p, al, be, h, z0, ga):
    t2, delta = p.theta_2, ga + p.theta_2
    return (tan(be) / cos(al) * (z0 - h) - p.r_b * cos(delta)
            + p.r_b * (cos(al) - sin(al) * sin(be) * tan(t2)) * (sin(delta) - sin(ga))
            / (cos(be) * tan(t2)))


@equation("(6) γ'", gives="platform.yaw.velocity", given=of("al be al_d be_d", {**SHIP, **SHIP_D}),
          unit="rad/s", printed="w4 in U is not defined", corrected="w4 = u1² + u3²")
def eq6_gamma(p, al, be, al_d, be_d):
    unreachable("w4 is not defined")


@eq6_gamma.corrected
def _(p, al, be, al_d, be_d):
    u1, u2, u3 = u_of(p.theta_1, p.theta_2)
    w1, w2, w3, w4 = u1 * (u2 + u3), u1**2 + u2**2, u2 * u3 - u1**2, u1**2 + u3**2
    W1 = w1 * sin(al) * cos(be) + w2 * cos(al) * sin(be) * cos(be) + w3 * sin(be)
    W2 = -w1 * cos(al) * sin(be) + w2 * sin(al) + w3 * sin(al) * cos(al) * cos(be)
    U = (w2 * (1 - cos(al)**2 * sin(be)**2) + w4 * cos(al)**2 + 2 * w3 * cos(al) * cos(be)
         - 2 * w1 * sin(al) * cos(al) * sin(be))
    return (al_d * W1 + be_d * W2) / U


@equation("(6) y'", gives="platform.y.velocity", unit="m/s",
          given=of("al h z0 al_d h_d ga ga_d", {**SHIP, **SHIP_D, **YAW, **YAW_D}),
          printed="y' = −(1 + tα²)(z0 − h) α' + tα h' − r_b cγ γ'")
def eq6_y(p, al, h, z0, al_d, h_d, ga, ga_d):
    return -(1 + tan(al)**2) * (z0 - h) * al_d + tan(al) * h_d - p.r_b * cos(ga) * ga_d


@equation("(6) x', first term", gives="platform.x.velocity", unit="m/s",
          given={**SHIP, **SHIP_D, **YAW, **YAW_D}, printed="L α (the dot is missing)",
          corrected="L α'")
def eq6_dot(p, al, be, h, z0, al_d, be_d, h_d, ga, ga_d):
    L, M, N = sway(p, al, be, h, z0, ga)
    return L * al + M * be_d + N * ga_d - tan(be) * h_d / cos(al)


@eq6_dot.corrected
def _(p, al, be, h, z0, al_d, be_d, h_d, ga, ga_d):
    L, M, N = sway(p, al, be, h, z0, ga)
    return L * al_d + M * be_d + N * ga_d - tan(be) * h_d / cos(al)


def sway(p, al, be, h, z0, ga, sign=1.0):
    """L, M, N of (6); sign: of the term of M that the print has with −."""
    t2, de = p.theta_2, ga + p.theta_2
    L = (tan(al) * tan(be) * (z0 - h) / cos(al)
         + p.r_b * (sin(de) - sin(ga)) * (-sin(al) / (cos(be) * tan(t2)) - cos(al) * tan(be)))
    M = ((1 + tan(be)**2) / cos(al) * (z0 - h)
         + p.r_b * (sin(de) - sin(ga)) * (sign * cos(al) * tan(be) / (cos(be) * tan(t2))
                                          - (1 + tan(be)**2) * sin(al)))
    N = (p.r_b * sin(de)
         + p.r_b * (cos(de) - cos(ga)) * (cos(al) / (cos(be) * tan(t2)) - tan(be) * sin(al)))
    return L, M, N


M_PRINTED = "M = … + r_b (sδ − sγ)[− cα tβ/(cβ tθ2) − (1 + tβ²) sα]"
M_CORRECTED = "[+ cα tβ/(cβ tθ2) − …]"


@equation("(6) M in x'", gives="platform.x.velocity", unit="m/s",
          given={**SHIP, **SHIP_D, **YAW, **YAW_D}, printed=M_PRINTED, corrected=M_CORRECTED)
def eq6_x(p, al, be, h, z0, al_d, be_d, h_d, ga, ga_d):
    t2, de = p.theta_2, ga + p.theta_2
    L = (tan(al) * tan(be) * (z0 - h) / cos(al)
         + p.r_b * (sin(de) - sin(ga)) * (-sin(al) / (cos(be) * tan(t2)) - cos(al) * tan(be)))
    M = ((1 + tan(be)**2) / cos(al) * (z0 - h)
         + p.r_b * (sin(de) - sin(ga)) * (-cos(al) * tan(be) / (cos(be) * tan(t2))
                                          - (1 + tan(be)**2) * sin(al)))
    N = (p.r_b * sin(de)
         + p.r_b * (cos(de) - cos(ga)) * (cos(al) / (cos(be) * tan(t2)) - tan(be) * sin(al)))
    return L * al_d + M * be_d + N * ga_d - tan(be) * h_d / cos(al)


@eq6_x.corrected
def _(p, al, be, h, z0, al_d, be_d, h_d, ga, ga_d):
    L, M, N = sway(p, al, be, h, z0, ga)
    return L * al_d + M * be_d + N * ga_d - tan(be) * h_d / cos(al)


@equation("(7) γ''", gives="platform.yaw.acceleration",
          given=of("al be al_d be_d al_dd be_dd", {**SHIP, **SHIP_D, **SHIP_DD}),
          unit="rad/s²", printed="γ'' = […]/U² (with w4 as corrected)")
def eq7_gamma(p, al, be, al_d, be_d, al_dd, be_dd):
    u1, u2, u3 = u_of(p.theta_1, p.theta_2)
    w1, w2, w3, w4 = u1 * (u2 + u3), u1**2 + u2**2, u2 * u3 - u1**2, u1**2 + u3**2

    def terms(al, be):
        return [
            w1 * sin(al) * cos(be) + w2 * cos(al) * sin(be) * cos(be) + w3 * sin(be),
            -w1 * cos(al) * sin(be) + w2 * sin(al) + w3 * sin(al) * cos(al) * cos(be),
            w2 * (1 - cos(al)**2 * sin(be)**2) + w4 * cos(al)**2 + 2 * w3 * cos(al) * cos(be)
            - 2 * w1 * sin(al) * cos(al) * sin(be),
        ]

    (W1, W2, U), (W1_d, W2_d, U_d), _ = motion(terms, [al, be], [al_d, be_d], [0, 0])
    return ((al_dd * W1 + al_d * W1_d + be_dd * W2 + be_d * W2_d) * U
            - (al_d * W1 + be_d * W2) * U_d) / U**2


@equation("(7) y''", gives="platform.y.acceleration", unit="m/s²",
          given={**of("al h z0 al_d h_d al_dd h_dd", {**SHIP, **SHIP_D, **SHIP_DD}), **YAW, **YAW_D,
                 **YAW_DD},
          printed="y'' = −(1+tα²)(z0−h) α'' + tα h'' − r_b cγ γ'' − 2tα(1+tα²)(z0−h) α'² "
          "+ r_b sγ γ'² + 2(1+tα²) h' α'")
def eq7_y(p, al, h, z0, al_d, h_d, al_dd, h_dd, ga, ga_d, ga_dd):
    return (-(1 + tan(al)**2) * (z0 - h) * al_dd + tan(al) * h_dd - p.r_b * cos(ga) * ga_dd
            - 2 * tan(al) * (1 + tan(al)**2) * (z0 - h) * al_d**2 + p.r_b * sin(ga) * ga_d**2
            + 2 * (1 + tan(al)**2) * h_d * al_d)


@equation("(7) M, M' in x''", gives="platform.x.acceleration", unit="m/s²",
          given={**SHIP, **SHIP_D, **SHIP_DD, **YAW, **YAW_D, **YAW_DD}, printed=M_PRINTED,
          corrected=M_CORRECTED)
def eq7_x(p, al, be, h, z0, al_d, be_d, h_d, al_dd, be_dd, h_dd, ga, ga_d, ga_dd):
    def LMN(al, be, h, ga):
        t2, de = p.theta_2, ga + p.theta_2
        L = (tan(al) * tan(be) * (z0 - h) / cos(al)
             + p.r_b * (sin(de) - sin(ga)) * (-sin(al) / (cos(be) * tan(t2)) - cos(al) * tan(be)))
        M = ((1 + tan(be)**2) / cos(al) * (z0 - h)
             + p.r_b * (sin(de) - sin(ga)) * (-cos(al) * tan(be) / (cos(be) * tan(t2))
                                              - (1 + tan(be)**2) * sin(al)))
        N = (p.r_b * sin(de)
             + p.r_b * (cos(de) - cos(ga)) * (cos(al) / (cos(be) * tan(t2)) - tan(be) * sin(al)))
        return [L, M, N]

    (L, M, N), (L_d, M_d, N_d), _ = motion(LMN, [al, be, h, ga], [al_d, be_d, h_d, ga_d], [0] * 4)
    return (L * al_dd + L_d * al_d + M * be_dd + M_d * be_d + N * ga_dd + N_d * ga_d
            - tan(be) * h_dd / cos(al)
            - h_d * ((1 + tan(be)**2) * be_d + tan(al) * tan(be) * al_d) / cos(al))


@eq7_x.corrected
def _(p, al, be, h, z0, al_d, be_d, h_d, al_dd, be_dd, h_dd, ga, ga_d, ga_dd):
    def LMN(al, be, h, ga):
        return sway(p, al, be, h, z0, ga)

    (L, M, N), (L_d, M_d, N_d), _ = motion(LMN, [al, be, h, ga], [al_d, be_d, h_d, ga_d], [0] * 4)
    return (L * al_dd + L_d * al_d + M * be_dd + M_d * be_d + N * ga_dd + N_d * ga_d
            - tan(be) * h_dd / cos(al)
            - h_d * ((1 + tan(be)**2) * be_d + tan(al) * tan(be) * al_d) / cos(al))


# Twists of the platforms; each is measured where the body has another point.

UPPER = {"v_p": "platform.velocity", "r_ep": "platform.position",
         "B": "platform.limb{i}.B.position"}


@equation("(8)", gives="platform.limb{i}.B.velocity", each=LIMBS, given={**UPPER, **YAW_D},
          unit="m/s", printed="V_ep = [ω; v_p − ω × r_ep]")
def eq8(p, v_p, r_ep, B, ga_d):
    omega = Vec(0, 0, ga_d)
    v = v_p - cross(omega, r_ep)
    return v + cross(omega, B)


@equation("(9)", gives="platform.limb{i}.B.acceleration", each=LIMBS, unit="m/s²",
          given={**UPPER, **YAW_D, **YAW_DD, "a_p": "platform.acceleration",
                 "v_B": "platform.limb{i}.B.velocity"},
          printed="A_ep = [ε; a_p − ε × r_ep − ω × v_p]")
def eq9(p, v_p, r_ep, B, ga_d, ga_dd, a_p, v_B):
    omega, epsilon = Vec(0, 0, ga_d), Vec(0, 0, ga_dd)
    a = a_p - cross(epsilon, r_ep) - cross(omega, v_p)
    return a + cross(epsilon, B) + cross(omega, v_B)


@equation("(10) ω", gives="lower_platform.angular_velocity",
          given=of("al al_d be_d", {**SHIP, **SHIP_D}), unit="rad/s",
          printed="ω_eo = α' e_x + β' e_y'")
def eq10_omega(p, al, al_d, be_d):
    e_x, e_y = Vec(1, 0, 0), Vec(0, cos(al), sin(al))
    return al_d * e_x + be_d * e_y


@equation("(10) v", gives="lower_platform.limb{i}.A.velocity", each=LIMBS, unit="m/s",
          given={**of("al be h", SHIP), **SHIP_D, "A": "lower_platform.limb{i}.A.position"},
          printed="V_eo = [ω; v_o − ω × r_eo]")
def eq10_v(p, al, be, h, al_d, be_d, h_d, A):
    omega = al_d * Vec(1, 0, 0) + be_d * Vec(0, cos(al), sin(al))
    r_so = rot_x(al) @ rot_y(be) @ Vec(0, 0, p.s_r_so)
    v_o = Vec(0, 0, h_d) + cross(omega, r_so)
    v = v_o - cross(omega, Vec(0, 0, h) + r_so)
    return v + cross(omega, A)


@equation("(11) ε", gives="lower_platform.angular_acceleration", unit="rad/s²",
          given=of("al al_d be_d al_dd be_dd", {**SHIP, **SHIP_D, **SHIP_DD}),
          printed="ε_eo = α'' e_x + β'' e_y' + α'β' e_x × e_y'",
          note="e_y once without its prime, read as e_y'")
def eq11_epsilon(p, al, al_d, be_d, al_dd, be_dd):
    e_x, e_y = Vec(1, 0, 0), Vec(0, cos(al), sin(al))
    return al_dd * e_x + be_dd * e_y + al_d * be_d * cross(e_x, e_y)


@equation("(11) a", gives="lower_platform.limb{i}.A.acceleration", each=LIMBS, unit="m/s²",
          given={**of("al be h", SHIP), **SHIP_D, **SHIP_DD,
                 "A": "lower_platform.limb{i}.A.position",
                 "v_A": "lower_platform.limb{i}.A.velocity"},
          printed="A_eo = [ε; a_o − ε × r_eo − ω × v_o]")
def eq11_a(p, al, be, h, al_d, be_d, h_d, al_dd, be_dd, h_dd, A, v_A):
    e_x, e_y = Vec(1, 0, 0), Vec(0, cos(al), sin(al))
    omega = al_d * e_x + be_d * e_y
    epsilon = al_dd * e_x + be_dd * e_y + al_d * be_d * cross(e_x, e_y)
    r_so = rot_x(al) @ rot_y(be) @ Vec(0, 0, p.s_r_so)
    r_eo = Vec(0, 0, h) + r_so
    v_o = Vec(0, 0, h_d) + cross(omega, r_so)
    a_o = Vec(0, 0, h_dd) + cross(epsilon, r_so) + cross(omega, cross(omega, r_so))
    a = a_o - cross(epsilon, r_eo) - cross(omega, v_o)
    return a + cross(epsilon, A) + cross(omega, v_A)


# The upper platform against the lower one: pose in {o} and its rates.
POSES = ["x", "y", "z", "roll", "pitch", "yaw"]
RELATIVE_D = {
    **{f"o_{c}": f"platform_in_base.{c}" for c in POSES},
    **{f"o_{c}_d": f"platform_in_base.{c}.velocity" for c in POSES},
}
RELATIVE = {**RELATIVE_D, **{f"o_{c}_dd": f"platform_in_base.{c}.acceleration" for c in POSES}}
LOWER = {"w_o": "lower_platform.angular_velocity", "v_o": "lower_platform.velocity",
         "r_eo": "lower_platform.position", "R_eo": "lower_platform.rotation"}
LOWER_DD = {"e_o": "lower_platform.angular_acceleration", "a_o": "lower_platform.acceleration"}


def relative_twist(q, q_d, q_dd):
    """°V_op and °A_op, its rate, from the pose of {p} in {o} (x, y, z, roll, pitch, yaw)."""

    def pose(x, y, z, roll, pitch, yaw):
        return [list(row) for row in rot_z(yaw) @ rot_y(pitch) @ rot_x(roll)]

    R, R_d, R_dd = (Mat(e) for e in motion(pose, q, q_d, q_dd))
    omega, epsilon = vee(R_d @ R.T), vee(R_dd @ R.T)
    r, r_d, r_dd = Vec(q[:3]), Vec(q_d[:3]), Vec(q_dd[:3])
    return (Vec(*omega, *(r_d - cross(omega, r))),
            Vec(*epsilon, *(r_dd - cross(epsilon, r) - cross(omega, r_d))))


@equation("(12) ω", gives="platform.angular_velocity", given={**RELATIVE_D, **LOWER},
          unit="rad/s", printed="V_ep = V_eo + Ad(g_eo) °V_op")
def eq12_omega(p, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d,
               o_yaw_d, w_o, v_o, r_eo, R_eo):
    q = [o_x, o_y, o_z, o_roll, o_pitch, o_yaw]
    V_op, _ = relative_twist(q, [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d], [0] * 6)
    V_eo = Vec(*w_o, *(v_o - cross(w_o, r_eo)))
    V_ep = V_eo + Ad(R_eo, r_eo, V_op)
    return Vec(V_ep[:3])


@equation("(12) v", gives="platform.velocity", unit="m/s",
          given={**RELATIVE_D, **LOWER, "r_ep": "platform.position"},
          printed="V_ep = V_eo + Ad(g_eo) °V_op")
def eq12_v(p, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d,
           o_yaw_d, w_o, v_o, r_eo, R_eo, r_ep):
    q = [o_x, o_y, o_z, o_roll, o_pitch, o_yaw]
    V_op, _ = relative_twist(q, [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d], [0] * 6)
    V_eo = Vec(*w_o, *(v_o - cross(w_o, r_eo)))
    V_ep = V_eo + Ad(R_eo, r_eo, V_op)
    return Vec(V_ep[3:]) + cross(V_ep[:3], r_ep)


@equation("(13) ε", gives="platform.angular_acceleration", unit="rad/s²",
          given={**RELATIVE, **LOWER, **LOWER_DD},
          printed="A_ep = A_eo + Ad(g_eo) °A_op + [V_eo, V_op]")
def eq13_epsilon(p, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d, o_roll_d,
                 o_pitch_d, o_yaw_d, o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd,
                 w_o, v_o, r_eo, R_eo, e_o, a_o):
    V_op, A_op = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                                [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d],
                                [o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd])
    V_eo = Vec(*w_o, *(v_o - cross(w_o, r_eo)))
    A_eo = Vec(*e_o, *(a_o - cross(e_o, r_eo) - cross(w_o, v_o)))
    A_ep = A_eo + Ad(R_eo, r_eo, A_op) + bracket(V_eo, Ad(R_eo, r_eo, V_op))
    return Vec(A_ep[:3])


@equation("(13) a", gives="platform.acceleration", unit="m/s²",
          given={**RELATIVE, **LOWER, **LOWER_DD, "r_ep": "platform.position"},
          printed="A_ep = A_eo + Ad(g_eo) °A_op + [V_eo, V_op]")
def eq13_a(p, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d,
           o_yaw_d, o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd, w_o, v_o, r_eo, R_eo,
           e_o, a_o, r_ep):
    V_op, A_op = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                                [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d],
                                [o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd])
    V_eo = Vec(*w_o, *(v_o - cross(w_o, r_eo)))
    A_eo = Vec(*e_o, *(a_o - cross(e_o, r_eo) - cross(w_o, v_o)))
    A_ep = A_eo + Ad(R_eo, r_eo, A_op) + bracket(V_eo, Ad(R_eo, r_eo, V_op))
    V_ep = V_eo + Ad(R_eo, r_eo, V_op)
    v_p = Vec(V_ep[3:]) + cross(V_ep[:3], r_ep)
    return Vec(A_ep[3:]) + cross(A_ep[:3], r_ep) + cross(V_ep[:3], v_p)


# Limb lengths.

IN_BASE = {"r_op": "platform.position in lower_platform from lower_platform",
           "R_op": "platform.rotation in lower_platform"}


@equation("(14)", gives="0", each=LIMBS, given={**IN_BASE, **TIP}, unit="m",
          printed="l_i = |°r_op + R_op r_pB − r_oA|", note="less foot to tip of link 2")
def eq14(p, i, r_op, R_op, tip, A):
    r_pB, r_oA = p.r_b * e_r(p, i), p.r_a * e_r(p, i)
    l_i = norm(r_op + R_op @ r_pB - r_oA)
    return l_i - norm(tip - A)


def virtual_limb(p, i, r_op, R_op):
    """(15): $1 … $6 as columns."""
    A, B = p.r_a * e_r(p, i), r_op + R_op @ (p.r_b * e_r(p, i))
    u = (B - A) / norm(B - A)
    return Mat(
        rotation_screw(e_r(p, i), A), rotation_screw(e_t(p, i), A), Vec(0, 0, 0, *u),
        rotation_screw([1, 0, 0], B), rotation_screw([0, 1, 0], B), rotation_screw([0, 0, 1], B),
    ).T



@equation("(15) virtual joint", gives="0", each=LIMBS, given={**IN_BASE, **RELATIVE_D},
          unit="rad/s", printed="$1 … $6 of the virtual limb", note="J⁻¹ °V_op: it is at rest")
def eq15_rest(p, i, r_op, R_op, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d,
              o_roll_d, o_pitch_d, o_yaw_d):
    V_op, _ = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                             [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d], [0] * 6)
    return linear_solve(virtual_limb(p, i, r_op, R_op), V_op)[0]


@equation("(15)", gives="limb{i}.U1.0.velocity", each=LIMBS, given={**IN_BASE, **RELATIVE_D},
          unit="rad/s", printed="$1 … $6 of the virtual limb", note="J⁻¹ °V_op: the tilt's rate")
def eq15(p, i, r_op, R_op, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d, o_roll_d,
         o_pitch_d, o_yaw_d):
    V_op, _ = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                             [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d], [0] * 6)
    A, B = p.r_a * e_r(p, i), r_op + R_op @ (p.r_b * e_r(p, i))
    u = (B - A) / norm(B - A)
    S1, S2, S3 = rotation_screw(e_r(p, i), A), rotation_screw(e_t(p, i), A), Vec(0, 0, 0, *u)
    S4, S5, S6 = (rotation_screw(e, B) for e in identity())
    return linear_solve(Mat(S1, S2, S3, S4, S5, S6).T, V_op)[1]


def influence(p, r_op, R_op):
    """G and H of (16)."""
    J = [virtual_limb(p, i, r_op, R_op) for i in LIMBS["i"]]
    inverse = [linear_solve(j, identity(6)) for j in J]
    G = Mat([e[2] for e in inverse] + [e[0] for e in inverse])
    G_inverse = linear_solve(G, identity(6))
    H = [None] * 6
    for i in range(3):
        T, columns = inverse[i] @ G_inverse, J[i].T
        H_l = H_phi = identity(6) * 0.0
        for j in range(6):
            for k in range(j + 1, 6):
                b = inverse[i] @ bracket(columns[j], columns[k])
                H_l, H_phi = H_l + b[2] * outer(T[j], T[k]), H_phi + b[0] * outer(T[j], T[k])
        H[i], H[3 + i] = H_l, H_phi
    return G, H


SPAN = {**TIP, "v_t": "limb{i}.link2.limb{i}.tip.velocity",
        "v_A": "lower_platform.limb{i}.A.velocity"}
SPAN_DD = {"a_t": "limb{i}.link2.limb{i}.tip.acceleration",
           "a_A": "lower_platform.limb{i}.A.acceleration"}


def length_rates(d, v, a):
    """Rates of |d|."""
    l = norm(d)
    l_d = dot(d, v) / l
    return l, l_d, (dot(v, v) + dot(d, a) - l_d**2) / l


@equation("(16) l'", gives="0", each=LIMBS, given={**IN_BASE, **RELATIVE_D, **SPAN}, unit="m/s",
          printed="q' = G V", note="less the speed of the tip from the foot")
def eq16_rate(p, i, r_op, R_op, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d,
              o_roll_d, o_pitch_d, o_yaw_d, tip, A, v_t, v_A):
    V_op, _ = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                             [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d], [0] * 6)
    G, H = influence(p, r_op, R_op)
    q_d = G @ V_op
    return q_d[i - 1] - length_rates(tip - A, v_t - v_A, Vec(0, 0, 0))[1]


@equation("(16) l''", gives="0", each=LIMBS, given={**IN_BASE, **RELATIVE, **SPAN, **SPAN_DD},
          unit="m/s²", printed="q'' = G A − q'ᵀ H q'",
          note="less the acceleration of the tip from the foot")
def eq16_acceleration(p, i, r_op, R_op, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d,
                      o_z_d, o_roll_d, o_pitch_d, o_yaw_d, o_x_dd, o_y_dd, o_z_dd, o_roll_dd,
                      o_pitch_dd, o_yaw_dd, tip, A, v_t, v_A, a_t, a_A):
    V_op, A_op = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                                [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d],
                                [o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd])
    G, H = influence(p, r_op, R_op)
    q_d = G @ V_op
    q_dd = (G @ A_op)[i - 1] - dot(q_d, H[i - 1] @ q_d)
    return q_dd - length_rates(tip - A, v_t - v_A, a_t - a_A)[2]


@equation("(16) φ''", gives="0", each=LIMBS, given={**IN_BASE, **RELATIVE}, unit="rad/s²",
          printed="q'' = G A − q'ᵀ H q'", note="the virtual joints stay at rest")
def eq16_rest(p, i, r_op, R_op, o_x, o_y, o_z, o_roll, o_pitch, o_yaw, o_x_d, o_y_d, o_z_d,
              o_roll_d, o_pitch_d, o_yaw_d, o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd,
              o_yaw_dd):
    V_op, A_op = relative_twist([o_x, o_y, o_z, o_roll, o_pitch, o_yaw],
                                [o_x_d, o_y_d, o_z_d, o_roll_d, o_pitch_d, o_yaw_d],
                                [o_x_dd, o_y_dd, o_z_dd, o_roll_dd, o_pitch_dd, o_yaw_dd])
    G, H = influence(p, r_op, R_op)
    q_d = G @ V_op
    return (G @ A_op)[2 + i] - dot(q_d, H[2 + i] @ q_d)


# Angles and drives of a limb.


@equation("(17)", gives="limb{i}.U1.0", each=LIMBS, unit="rad",
          given={"B": TIP_IN_BASE},
          printed="λ_i = atan[(x_B − x_A)/(z_B − z_A)], x of {o}",
          corrected="λ_i = atan[e_r · (B − A)/(z_B − z_A)]", note="the print holds for limb 1 only")
def eq17(p, i, B):
    A = p.r_a * e_r(p, i)
    return atan((B[0] - A[0]) / (B[2] - A[2]))


@eq17.corrected
def _(p, i, B):
    A = p.r_a * e_r(p, i)
    return atan(dot(e_r(p, i), B - A) / (B[2] - A[2]))


@equation("(18)", gives="0", each={**LIMBS, **SIDES, "row": [1, 2]}, given={**JOINTS, **TIP},
          unit="m", printed="foot – A – tip = foot – elbow – tip")
def eq18(p, row, u, r, tip, A):
    (q1, q2), l = q1_q2(u, r), norm(tip - A)
    return [p.L1 * cos(q1) + p.L3 * cos(q2) - p.L5,
            p.L1 * sin(q1) + p.L3 * sin(q2) - l][row - 1]


@equation("(19)", gives="limb{i}.drive{side}", each={**LIMBS, **SIDES}, given=JOINTS, unit="m",
          printed="foot – base ball – rod ball = foot – rod ball")
def eq19(p, u, r):
    q1, q2 = q1_q2(u, r)
    q12 = q1 + p.theta_3
    return hypot(p.L2 * cos(q12) - p.L5 - p.L4, p.L2 * sin(q12))


@equation("(20) q1", gives="limb{i}.U1.1", each=LIMBS, given=TIP, unit="rad",
          printed="2 atan[(A ± √(A² + B² − C²))/(B − C)], read with +, A, B not given",
          corrected="A = l, B = L5, root with −",
          note="the crossing assembly; the paper leaves the choice to the reader")
def eq20_q1(p, tip, A):
    l = norm(tip - A)
    a, b, c = l, p.L5, -(p.L5**2 + p.L1**2 + l**2 - p.L3**2) / (2 * p.L1)
    return 2 * atan((a + sqrt(a**2 + b**2 - c**2)) / (b - c))


@eq20_q1.corrected
def _(p, tip, A):
    l = norm(tip - A)
    a, b, c = l, p.L5, -(p.L5**2 + p.L1**2 + l**2 - p.L3**2) / (2 * p.L1)
    return 2 * atan((a - sqrt(a**2 + b**2 - c**2)) / (b - c))


@equation("(20) R", gives="limb{i}.drive{side}", each={**LIMBS, **SIDES}, given=JOINTS, unit="m",
          printed="R = √[(L1 C1 − L2 − L2)² + (L2 S2)²]",
          corrected="R = √[(L2 C2 − L5 − L4)² + (L2 S2)²]",
          note="subscripts damaged in the print; C2, S2 of q1 + θ3")
def eq20_R(p, u, r):
    q1, q2 = q1_q2(u, r)
    C1, S2 = cos(q1), sin(q1 + p.theta_3)
    return sqrt((p.L1 * C1 - p.L2 - p.L2)**2 + (p.L2 * S2)**2)


@eq20_R.corrected
def _(p, u, r):
    q1, q2 = q1_q2(u, r)
    C2, S2 = cos(q1 + p.theta_3), sin(q1 + p.theta_3)
    return sqrt((p.L2 * C2 - p.L5 - p.L4)**2 + (p.L2 * S2)**2)


@equation("derivatives of (18), (19): R'", gives="limb{i}.drive{side}.velocity", unit="m/s",
          each={**LIMBS, **SIDES}, given={**JOINTS, **SPAN, "R": "limb{i}.drive{side}"},
          printed="four linear systems, not written out", note="solved in closed form")
def R_rate(p, u, r, tip, A, v_t, v_A, R):
    (q1, q2), l_d = q1_q2(u, r), length_rates(tip - A, v_t - v_A, Vec(0, 0, 0))[1]
    q1_d = sin(q2) * l_d / (p.L1 * sin(q2 - q1))
    return p.L2 * (p.L4 + p.L5) * sin(q1 + p.theta_3) * q1_d / R


@equation("derivatives of (18), (19): R''", gives="limb{i}.drive{side}.acceleration",
          each={**LIMBS, **SIDES}, unit="m/s²",
          given={**JOINTS, **SPAN, **SPAN_DD, "R": "limb{i}.drive{side}"},
          printed="four linear systems, not written out", note="solved in closed form")
def R_acceleration(p, u, r, tip, A, v_t, v_A, a_t, a_A, R):
    q1, q2 = q1_q2(u, r)
    l, l_d, l_dd = length_rates(tip - A, v_t - v_A, a_t - a_A)
    q1_d = sin(q2) * l_d / (p.L1 * sin(q2 - q1))
    q2_d = -sin(q1) * l_d / (p.L3 * sin(q2 - q1))
    a_y = p.L1 * q1_d**2 * cos(q1) + p.L3 * q2_d**2 * cos(q2)
    a_z = l_dd + p.L1 * q1_d**2 * sin(q1) + p.L3 * q2_d**2 * sin(q2)
    q1_dd = (cos(q2) * a_y + sin(q2) * a_z) / (p.L1 * sin(q2 - q1))
    q12, k = q1 + p.theta_3, p.L2 * (p.L4 + p.L5)
    R_d = k * sin(q12) * q1_d / R
    return (k * (cos(q12) * q1_d**2 + sin(q12) * q1_dd) - R_d**2) / R


# Forces.

PLATFORM = {
    "R_eo": "lower_platform.rotation", "r_eo": "lower_platform.position",
    "r_ep": "platform.position", "R_ep": "platform.rotation", "v_p": "platform.velocity",
    "a_p": "platform.acceleration", "w_p": "platform.angular_velocity",
    "e_p": "platform.angular_acceleration",
}


def inertia_wrench(p, R_eo, r_eo, r_ep, R_ep, v_p, a_p, w_p, e_p):
    """W^I of (22) about the origin of {o}, in {o}, and r_c."""
    R_oe, R_op = R_eo.T, R_eo.T @ R_ep
    omega, v = R_oe @ w_p, R_oe @ (v_p - cross(w_p, r_ep - r_eo))
    epsilon, a = R_oe @ e_p, R_oe @ (a_p - cross(e_p, r_ep - r_eo) - cross(w_p, v_p))
    r_c = R_oe @ (r_ep - r_eo)
    I = R_op @ Mat([p.I_p_x, 0, 0], [0, p.I_p_y, 0], [0, 0, p.I_p_z]) @ R_op.T

    def N(w, v):
        f = p.m_p * (v + cross(w, r_c))
        return Vec(*(I @ w + cross(r_c, f)), *f)

    momentum = N(omega, v)
    m, f = Vec(momentum[:3]), Vec(momentum[3:])
    ad_transposed = -Vec(*(cross(omega, m) + cross(v, f)), *cross(omega, f))
    return -(N(epsilon, a) - ad_transposed), r_c


@equation("(22) force", gives="platform.inertia_force in lower_platform", given=PLATFORM, unit="N",
          printed="W^I = −(N A − ad(V)ᵀ N V)", note="one V carries a stray T in print")
def eq22_force(p, R_eo, r_eo, r_ep, R_ep, v_p, a_p, w_p, e_p):
    W, r_c = inertia_wrench(p, R_eo, r_eo, r_ep, R_ep, v_p, a_p, w_p, e_p)
    return Vec(W[3:])


@equation("(22) moment", gives="platform.inertia_moment in lower_platform", given=PLATFORM,
          unit="N m", printed="W^I = −(N A − ad(V)ᵀ N V)",
          note="moved from the origin of {o} to the centre of mass")
def eq22_moment(p, R_eo, r_eo, r_ep, R_ep, v_p, a_p, w_p, e_p):
    W, r_c = inertia_wrench(p, R_eo, r_eo, r_ep, R_ep, v_p, a_p, w_p, e_p)
    return Vec(W[:3]) - cross(r_c, W[3:])


@equation("(22) weight", gives="platform.weight in lower_platform", unit="N",
          given={"R_eo": "lower_platform.rotation"}, printed="W^G = (r × m g; m g)")
def eq22_weight(p, R_eo):
    g = R_eo.T @ Vec(0, 0, -p.g)
    return p.m_p * g


def limb_axes(p, i, R_eo, lam):
    """X, Y, Z of {A_i} in the earth's axes."""
    X, Y, Z = (R_eo @ Mat(e_r(p, i), e_t(p, i), [0, 0, 1]).T @ rot_y(lam)).T
    return X, Y, Z


BALANCE = {
    "R_eo": "lower_platform.rotation", "r_eo": "lower_platform.position",
    **{f"B{k}": f"platform.limb{k}.B.position" for k in LIMBS["i"]},
    **{f"lam{k}": f"limb{k}.U1.0" for k in LIMBS["i"]},
    **{f"fx{k}": f"limb{k}.S.reaction.force[1]" for k in LIMBS["i"]},
    "r_c": "platform.com.position", "F": "platform.inertia_force", "N": "platform.inertia_moment",
    "G": "platform.weight",
}


def limb_forces(p, R_eo, r_eo, B, lam, f_X, r_c, F, N, G):
    """(21) with forces along X: f_1 … f_6."""
    columns, rest = [], Vec(*(N + cross(r_c - r_eo, F + G)), *(F + G))
    for turn in (2, 1):
        for i in LIMBS["i"]:
            axis = limb_axes(p, i, R_eo, lam[i - 1])[turn]
            columns.append(Vec(*cross(B[i - 1] - r_eo, axis), *axis))
    for i in LIMBS["i"]:
        X = limb_axes(p, i, R_eo, lam[i - 1])[0]
        rest = rest + f_X[i - 1] * Vec(*cross(B[i - 1] - r_eo, X), *X)
    return linear_solve(Mat(columns).T, -rest)


@equation("(21), links with mass", gives="limb{i}.S.reaction.force[{k}]", unit="N",
          each={**LIMBS, "k": [2, 3]}, given={**BALANCE, "R_2": "limb{i}.link2.rotation"},
          printed="[S1 … S6] f = −W^G − W^I", corrected="… − Σ f_X,i (B_i × X_i; X_i)",
          note="f_1 … f_6 turned into the axes of link 2; a limb with mass also loads along X")
def eq21(p, i, k, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, fx1, fx2, fx3, r_c, F, N, G, R_2):
    lam, f_X = [lam1, lam2, lam3], [0, 0, 0]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    X, Y, Z = limb_axes(p, i, R_eo, lam[i - 1])
    return (R_2.T @ (f[i - 1] * Z + f[2 + i] * Y))[k - 1]


@eq21.corrected
def _(p, i, k, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, fx1, fx2, fx3, r_c, F, N, G, R_2):
    lam, f_X = [lam1, lam2, lam3], [fx1, fx2, fx3]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    X, Y, Z = limb_axes(p, i, R_eo, lam[i - 1])
    return (R_2.T @ (f[i - 1] * Z + f[2 + i] * Y))[k - 1]


LINKS = ["link1", "link1_p", "link2", "link2_p"]
LIMB_LINKS = {
    f"{letter}_{name}": f"limb{{i}}.{name}.{quantity}" for name in LINKS
    for letter, quantity in {"G": "com.position", "F": "inertia_force", "N": "inertia_moment",
                             "W": "weight"}.items()
}


@equation("(21), f_X", gives="limb{i}.S.reaction.force[1]", each=LIMBS, unit="N",
          given={**TIP, **LIMB_LINKS, "R_eo": "lower_platform.rotation"},
          printed="0 (not in the equation)", corrected="f_X,i = −Σ M_Y,i/l_i")
def eq21_fX(p, tip, A):
    return 0.0


@eq21_fX.corrected
def _(p, i, tip, A, R_eo, G_link1, F_link1, N_link1, W_link1, G_link1_p, F_link1_p, N_link1_p,
      W_link1_p, G_link2, F_link2, N_link2, W_link2, G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    l, Y = norm(tip - A), R_eo @ e_t(p, i)
    required = (
        -N_link1 - cross(G_link1 - A, F_link1 + W_link1)
        - N_link1_p - cross(G_link1_p - A, F_link1_p + W_link1_p)
        - N_link2 - cross(G_link2 - A, F_link2 + W_link2)
        - N_link2_p - cross(G_link2_p - A, F_link2_p + W_link2_p)
    )
    M_Y = dot(Y, required)
    return -M_Y / l


# The 30 equations of a limb. In {A_i}, moments about A_i.


class LimbPlane:
    """Points of a limb in {A_i}; lists by side."""

    def __init__(self, p, q1, q2, l, R):
        self.l, self.B = l, Vec(0.0, 0.0, l)
        self.U, self.E, self.rod, self.thrust, self.q2 = [], [], [], [], q2
        for k, s in enumerate((1.0, -1.0)):
            U = Vec(0.0, -s * p.L5, 0.0)
            q12 = q1[k] + p.theta_3
            rod = U + p.L2 * Vec(0.0, s * cos(q12), sin(q12))
            self.U.append(U)
            self.E.append(U + p.L1 * Vec(0.0, s * cos(q1[k]), sin(q1[k])))
            self.rod.append(rod)
            self.thrust.append((rod - Vec(0.0, s * p.L4, 0.0)) / R[k])


def planar(a, b):
    return a[1] * b[2] - a[2] * b[1]


def drives_of(plane, first, second, f_Y, f_Z):
    """Both drive forces; first, second: required [m; f] of links 1, 2 per side, about A_i."""
    u = [plane.B - E for E in plane.E]
    c = [w[0] - planar(E, w[3:]) for w, E in zip(second, plane.E)]
    on_platform = Vec(0.0, f_Y, f_Z)
    P = ((c[1] + planar(u[1], on_platform)) * u[0] + c[0] * u[1]) / planar(u[0], u[1])
    P = [P, -on_platform - P]
    drives = []
    for k in range(2):
        both = first[k] + second[k]
        moment = both[0] - planar(plane.U[k], both[3:]) - planar(plane.B - plane.U[k], P[k])
        drives.append(moment / planar(plane.rod[k] - plane.U[k], plane.thrust[k]))
    return drives


def required_wrench(axes, A, G, F, N, W):
    """What a link needs, [m; f] about A_i in {A_i}."""
    return -Vec(*(axes @ (N + cross(G - A, F + W))), *(axes @ (F + W)))


LIMB = {**TIP, "u": "limb{i}.U1.1", "r": "limb{i}.R12", "u_p": "limb{i}.U1_p.1",
        "r_p": "limb{i}.R12_p", "R": "limb{i}.drive", "R_p": "limb{i}.drive_p"}


def plane_of(p, tip, A, u, r, u_p, r_p, R, R_p):
    (q1, q2), (q1_p, q2_p) = q1_q2(u, r), q1_q2(u_p, r_p)
    return LimbPlane(p, [q1, q1_p], [q2, q2_p], norm(tip - A), [R, R_p])


def limb_matrix(plane):
    """30 × 30: rows cross, 2, 2', 1, 1' with [m; f] each; columns cross–2, cross–2', 2–1, 2'–1'
    (F, M_Y, M_Z), 1–base, 1'–base (F, M_Z), drives. As corrected, R22' is a ball, and the platform
    acts on the cross along and about X: in place of M_Y, M_Z of cross–2'."""
    rows = [[0.0] * 30 for _ in range(30)]
    X, Y, Z = identity()

    def add(body, column, sign, moment, force):
        for k in range(3):
            rows[6 * body + k][column] += sign * moment[k]
            rows[6 * body + 3 + k][column] += sign * force[k]

    def joint(column, at, outer_body, inner_body, moments):
        for body, sign in ((outer_body, 1.0), (inner_body, -1.0)):
            if body is None:
                continue
            for k, axis in enumerate((X, Y, Z)):
                add(body, column + k, sign, cross(at, axis), axis)
            for k, axis in enumerate(moments):
                add(body, column + 3 + k, sign, axis, Vec(0, 0, 0))

    joint(0, plane.B, 1, 0, (Y, Z))
    joint(5, plane.B, 2, 0, ())
    add(0, 8, -1.0, cross(plane.B, X), X)
    add(0, 9, 1.0, X, Vec(0, 0, 0))
    for k in range(2):
        joint(10 + 5 * k, plane.E[k], 1 + k, 3 + k, (Y, Z))
        joint(20 + 4 * k, plane.U[k], 3 + k, None, (Z,))
        add(3 + k, 28 + k, 1.0, cross(plane.rod[k], plane.thrust[k]), plane.thrust[k])
    return rows


@equation("30 equations, solvable", gives="0", each=LIMBS, unit="N m",
          given={**TIP, **LIMB_LINKS, "R_eo": "lower_platform.rotation",
                 "f_X": "limb{i}.S.reaction.force[1]"},
          printed="30 unknowns, 30 equations",
          corrected="R22' as a spherical joint; platform acts on the cross along and about X",
          note="sum of all moments about Y of the base: nothing else holds the limb's tilt")
def solvable30(p, i, tip, A, R_eo, f_X, G_link1, F_link1, N_link1, W_link1,
               G_link1_p, F_link1_p, N_link1_p, W_link1_p, G_link2, F_link2, N_link2, W_link2,
               G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    l, Y = norm(tip - A), R_eo @ e_t(p, i)
    required = (
        -N_link1 - cross(G_link1 - A, F_link1 + W_link1)
        - N_link1_p - cross(G_link1_p - A, F_link1_p + W_link1_p)
        - N_link2 - cross(G_link2 - A, F_link2 + W_link2)
        - N_link2_p - cross(G_link2_p - A, F_link2_p + W_link2_p)
    )
    M_Y = dot(Y, required)
    return M_Y


@solvable30.corrected
def _(p, i, tip, A, R_eo, f_X, G_link1, F_link1, N_link1, W_link1,
      G_link1_p, F_link1_p, N_link1_p, W_link1_p, G_link2, F_link2, N_link2, W_link2,
      G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    l, Y = norm(tip - A), R_eo @ e_t(p, i)
    required = (
        -N_link1 - cross(G_link1 - A, F_link1 + W_link1)
        - N_link1_p - cross(G_link1_p - A, F_link1_p + W_link1_p)
        - N_link2 - cross(G_link2 - A, F_link2 + W_link2)
        - N_link2_p - cross(G_link2_p - A, F_link2_p + W_link2_p)
    )
    M_Y = dot(Y, required)
    return M_Y + l * f_X


def drive_forces(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam, f_Y, f_Z, links):
    plane = plane_of(p, tip, A, u, r, u_p, r_p, R, R_p)
    axes = Mat(limb_axes(p, i, R_eo, lam))
    first, first_p, second, second_p = (required_wrench(axes, A, *link) for link in links)
    return drives_of(plane, [first, first_p], [second, second_p], f_Y, f_Z)


def drives_by_30(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam, f_Y, f_Z, links):
    plane = plane_of(p, tip, A, u, r, u_p, r_p, R, R_p)
    axes = Mat(limb_axes(p, i, R_eo, lam))
    first, first_p, second, second_p = (required_wrench(axes, A, *link) for link in links)
    on_cross = Vec(0.0, f_Y, f_Z)
    right = [*cross(plane.B, on_cross), *on_cross, *second, *second_p, *first, *first_p]
    return linear_solve(Mat(limb_matrix(plane)), right)[28:]


FOOT = "lower_platform.limb{i}.U1{side}.position in lower_platform from lower_platform"
DRIVES = {**BALANCE, **LIMB, **LIMB_LINKS, "foot": FOOT}


def side_of(p, i, foot):
    """0: unprimed, with the foot at −L5 along Y; 1: primed."""
    return 0 if dot(e_t(p, i), foot) < 0 else 1


@equation("30 equations, drives", gives="limb{i}.drive{side}.force", each={**LIMBS, **SIDES},
          given=DRIVES, unit="N",
          printed="(21) without f_X, then the links in the limb plane only",
          corrected="corrected (21) and 30 equations")
def drives30(p, i, foot, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, fx1, fx2, fx3, r_c, F, N, G,
             tip, A, u, r, u_p, r_p, R, R_p,
             G_link1, F_link1, N_link1, W_link1, G_link1_p, F_link1_p, N_link1_p, W_link1_p,
             G_link2, F_link2, N_link2, W_link2, G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    lam, f_X = [lam1, lam2, lam3], [0, 0, 0]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    links = [(G_link1, F_link1, N_link1, W_link1), (G_link1_p, F_link1_p, N_link1_p, W_link1_p),
             (G_link2, F_link2, N_link2, W_link2), (G_link2_p, F_link2_p, N_link2_p, W_link2_p)]
    drives = drive_forces(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam[i - 1], f[2 + i],
                          f[i - 1], links)
    return drives[side_of(p, i, foot)]


@drives30.corrected
def _(p, i, foot, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, fx1, fx2, fx3, r_c, F, N, G,
      tip, A, u, r, u_p, r_p, R, R_p,
      G_link1, F_link1, N_link1, W_link1, G_link1_p, F_link1_p, N_link1_p, W_link1_p,
      G_link2, F_link2, N_link2, W_link2, G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    lam, f_X = [lam1, lam2, lam3], [fx1, fx2, fx3]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    links = [(G_link1, F_link1, N_link1, W_link1), (G_link1_p, F_link1_p, N_link1_p, W_link1_p),
             (G_link2, F_link2, N_link2, W_link2), (G_link2_p, F_link2_p, N_link2_p, W_link2_p)]
    drives = drives_by_30(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam[i - 1], f[2 + i],
                          f[i - 1], links)
    return drives[side_of(p, i, foot)]


# What the paper states about validation and figures.


@equation("section 4, Figs. 11 and 13", gives="limb{i}.drive{side}.force", each={**LIMBS, **SIDES},
          given=DRIVES, unit="N",
          printed="massless program and simulation with link masses agree to 0.1 kN",
          corrected="equal masses in both agree",
          note="the reference, with link masses, against massless equations")
def figures(p, i, foot, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, r_c, F, N, G,
            tip, A, u, r, u_p, r_p, R, R_p):
    lam, f_X = [lam1, lam2, lam3], [0, 0, 0]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    nothing = (Vec(0, 0, 0),) * 4
    drives = drive_forces(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam[i - 1], f[2 + i],
                          f[i - 1], [nothing] * 4)
    return drives[side_of(p, i, foot)]


@figures.corrected
def _(p, i, foot, R_eo, r_eo, B1, B2, B3, lam1, lam2, lam3, fx1, fx2, fx3, r_c, F, N, G,
      tip, A, u, r, u_p, r_p, R, R_p,
      G_link1, F_link1, N_link1, W_link1, G_link1_p, F_link1_p, N_link1_p, W_link1_p,
      G_link2, F_link2, N_link2, W_link2, G_link2_p, F_link2_p, N_link2_p, W_link2_p):
    lam, f_X = [lam1, lam2, lam3], [fx1, fx2, fx3]
    f = limb_forces(p, R_eo, r_eo, [B1, B2, B3], lam, f_X, r_c, F, N, G)
    links = [(G_link1, F_link1, N_link1, W_link1), (G_link1_p, F_link1_p, N_link1_p, W_link1_p),
             (G_link2, F_link2, N_link2, W_link2), (G_link2_p, F_link2_p, N_link2_p, W_link2_p)]
    drives = drive_forces(p, i, tip, A, u, r, u_p, r_p, R, R_p, R_eo, lam[i - 1], f[2 + i],
                          f[i - 1], links)
    return drives[side_of(p, i, foot)]


@equation("text to Fig. 7", gives="platform.limb{i}.B.position", each={**LIMBS, **SIDES}, unit="m",
          given={"E1": "limb{i}.link1{side}.limb{i}.elbow.position",
                 "R_2": "limb{i}.link2{side}.rotation", "E2": "limb{i}.link2{side}.position"},
          printed="links 1 and 1' load the cross", corrected="links 2 and 2' load the cross",
          note="place of the link's end")
def figure7(p, E1):
    return E1


@figure7.corrected
def _(p, R_2, E2):
    return E2 + R_2 @ Vec(0, p.L3, 0)
