"""The equations of the cabin robot's paper, as printed and as they should be.

Liu Y., Yao J., Guo Y., Yi W., Zhao Y.: Design and analysis of hybrid cabin assembly attitude
adjustment robot system. Journal of National University of Defense Technology 47 (2), 2025, 131–145.

α is the angle of AB, β and ε are the interior angles at D and F (the joints' are π − β and π − ε),
γ is the tilt of the platform; V0 = Ẋ1, V2 = Ẋ3 − Ẋ1 (slider F), V3 = Ẋ2 − Ẋ1 (slider D). The
section on the wrist has symbols of its own: θ1, θ2, d2, θ3, a1, a2, d3 for th3, th4, d5, th6, a3,
a4, d6. The stiffness, (54)–(75), is audited elsewhere.
"""

from functools import lru_cache

from mbverify.equations import (
    Mat, Vec, acos, asin, atan2, cos, cross, dot, equation, hypot, jacobian, motion,
    pi, rot_x, rot_z, sin, sqrt, states, unreachable, vee,
)

FORCE, MOMENT = [60, -80, 100], [5, -4, 3]  # on the end effector, at its origin
DRIVES = ["d1", "X1", "X2", "X3", "th3", "th4", "d5", "th6"]

states(
    "cabin_robot",
    coordinates=DRIVES,
    ranges={
        "d1": [0.1, 0.9], "X1": [-0.63, -0.57], "X2": [0.55, 0.60], "X3": [-0.20, -0.16],
        "th3": [-1.8, 1.8], "th4": [-1.45, 0.25], "d5": [-0.5, 0.0], "th6": [-3.1, 3.1],
    },
    rates={"d1": 0.3, "X1": 0.2, "X2": 0.2, "X3": 0.2, "th3": 0.5, "th4": 0.5, "d5": 0.5,
           "th6": 0.5},
    accelerations={"d1": 0.5, "X1": 0.5, "X2": 0.5, "X3": 0.5, "th3": 0.5, "th4": 0.5, "d5": 0.5,
                   "th6": 0.5},
    loads=[{"body": "slewing", "point": [0, 0, 0], "force": FORCE, "moment": MOMENT}],
)


def of(names, quantities):
    """Those of the quantities that are named."""
    return {name: quantities[name] for name in names.split()}


# Planar linkage, position.

Y_GAMMA = {"Y": "platform.y", "gamma": "platform.yaw"}
ANGLES = {"A": "A", "D": "D", "F": "F", "gamma": "platform.yaw"}  # α, π − β, π − ε, γ
SPANS = {"AF": "sliderF.position from sliderA[1]", "AD": "sliderD.position from sliderA[1]"}


@equation("(1) α", gives="A", given=Y_GAMMA, unit="rad",
          printed="α = asin(s_B/L1), s_B = Y − (L2/2) sin γ")
def eq1_alpha(p, Y, gamma):
    s_B = Y - p.L2 / 2 * sin(gamma)
    return asin(s_B / p.L1)


@equation("(1) ε", gives="F", given=Y_GAMMA, unit="rad",
          printed="ε = asin(s_B/(2 L4)), s_B = Y − (L2/2) sin γ", note="the joint's angle is π − ε")
def eq1_epsilon(p, Y, gamma):
    s_B = Y - p.L2 / 2 * sin(gamma)
    epsilon = asin(s_B / (2 * p.L4))
    return pi - epsilon


@equation("(1) AF", gives="sliderF.position from sliderA[1]", given=of("A F", ANGLES), unit="m",
          printed="AF = (L1/2) cos α + L4 cos ε")
def eq1_AF(p, A, F):
    alpha, epsilon = A, pi - F
    return p.L1 / 2 * cos(alpha) + p.L4 * cos(epsilon)


@equation("(2) β", gives="D", given=Y_GAMMA, unit="rad",
          printed="β = asin(s_C/L3), s_C = Y + (L2/2) sin γ", note="the joint's angle is π − β")
def eq2_beta(p, Y, gamma):
    s_C = Y + p.L2 / 2 * sin(gamma)
    beta = asin(s_C / p.L3)
    return pi - beta


@equation("(2) AD", gives="sliderD.position from sliderA[1]", unit="m",
          given={"X_C": "CD.C.position[1]", "D": "D"},
          printed="AD = X_C + L3 cos β", corrected="AD = X_C − X1 + L3 cos β",
          note="right only with the origin at A; not used afterwards")
def eq2_AD(p, X_C, X1, D):
    beta = pi - D
    return X_C + p.L3 * cos(beta)


@eq2_AD.corrected
def _(p, X_C, X1, D):
    beta = pi - D
    return X_C - X1 + p.L3 * cos(beta)


@equation("(3), (4) X1", gives="X1", given={"X": "platform.x", **of("A gamma", ANGLES)}, unit="m",
          printed="X1 = X_B − AH")
def eq3_X1(p, X, gamma, A):
    alpha = A
    X_B = X - p.L2 / 2 * cos(gamma)
    return X_B - p.L1 * cos(alpha)


@equation("(3), (4) X2", gives="X2", given={"X": "platform.x", **of("D gamma", ANGLES)}, unit="m",
          printed="X2 = X_C + KD")
def eq3_X2(p, X, gamma, D):
    beta = pi - D
    X_C = X + p.L2 / 2 * cos(gamma)
    return X_C + p.L3 * cos(beta)


@equation("(3), (4) X3", gives="X3", given=of("A F", ANGLES), unit="m", printed="X3 = X1 + AF")
def eq3_X3(p, X1, A, F):
    alpha, epsilon = A, pi - F
    AF = p.L1 / 2 * cos(alpha) + p.L4 * cos(epsilon)
    return X1 + AF


@equation("(9) α", gives="A", given={"AF": SPANS["AF"]}, unit="rad",
          printed="cos α = (L1²/4 + AF² − L4²)/(L1 AF)", note="X1, X2 of (9) read as AF and AD")
def eq9_alpha(p, AF):
    return acos((p.L1**2 / 4 + AF**2 - p.L4**2) / (p.L1 * AF))


@equation("(9) β1, β2, γ", gives="platform.yaw", given={"AD": SPANS["AD"], "A": "A"}, unit="rad",
          printed="sin β2 = L1 sin α/BD; cos β1 = (L3² + BD² − L2²)/(2 L3 BD); "
          "sin γ = (L3 sin β − L1 sin α)/L2", note="with β = β1 + β2")
def eq9_gamma(p, AD, A):
    alpha = A
    BD = hypot(p.L1 * sin(alpha), AD - p.L1 * cos(alpha))
    beta2 = asin(p.L1 * sin(alpha) / BD)
    beta1 = acos((p.L3**2 + BD**2 - p.L2**2) / (2 * p.L3 * BD))
    beta = beta1 + beta2
    return asin((p.L3 * sin(beta) - p.L1 * sin(alpha)) / p.L2)


@equation("(9) β", gives="D", given={"AD": SPANS["AD"], "A": "A"}, unit="rad",
          printed="not stated", corrected="β = β1 + β2", note="the joint's angle is π − β")
def eq9_beta(p, AD, A):
    unreachable("the paper does not say what β is")


@eq9_beta.corrected
def _(p, AD, A):
    alpha = A
    BD = hypot(p.L1 * sin(alpha), AD - p.L1 * cos(alpha))
    beta2 = asin(p.L1 * sin(alpha) / BD)
    beta1 = acos((p.L3**2 + BD**2 - p.L2**2) / (2 * p.L3 * BD))
    beta = beta1 + beta2
    return pi - beta


def BM_of(p, alpha, beta):
    return sqrt(p.L2**2 - (p.L3 * sin(beta) - p.L1 * sin(alpha))**2)


@equation("after (9): C", gives="CD.C.position[1]", given=of("A D", ANGLES), unit="m",
          printed="C = (L1 cos α + BM, L3 sin β)", corrected="with X1 added to the abscissa",
          note="right only with the origin at A")
def after9_C(p, X1, A, D):
    alpha, beta = A, pi - D
    return p.L1 * cos(alpha) + BM_of(p, alpha, beta)


@after9_C.corrected
def _(p, X1, A, D):
    alpha, beta = A, pi - D
    return X1 + p.L1 * cos(alpha) + BM_of(p, alpha, beta)


@equation("after (9): G", gives="platform.x", given=of("A D", ANGLES), unit="m",
          printed="G = (L1 cos α + BM/2, …)", corrected="with X1 added to the abscissa",
          note="right only with the origin at A")
def after9_G(p, X1, A, D):
    alpha, beta = A, pi - D
    return p.L1 * cos(alpha) + BM_of(p, alpha, beta) / 2


@after9_G.corrected
def _(p, X1, A, D):
    alpha, beta = A, pi - D
    return X1 + p.L1 * cos(alpha) + BM_of(p, alpha, beta) / 2


# Wrist, from {3} at th3 = 0 without d3: axes of platform.wrist, {2} turned by −90° about x.

BASE = rot_x(-pi / 2)
WRIST = {"R": "slewing.rotation in platform", "t": "slewing.position in platform from support"}


def wrist_columns(R, t):
    """n, o, a and p of the wrist's transform."""
    n, o, a = (BASE.T @ R).T
    return n, o, a, BASE.T @ t


@equation("(5), (6) rotation", gives="slewing.rotation in platform",
          printed="elements of the wrist's transform", note="turned into the platform's axes")
def eq6_rotation(p, th3, th4, th6):
    c1, s1, c2, s2, c3, s3 = cos(th3), sin(th3), cos(th4), sin(th4), cos(th6), sin(th6)
    return BASE @ Mat(
        [c1 * s2 * s3 - c3 * s1, s1 * s3 + c1 * c3 * s2, c1 * c2],
        [c1 * c3 + s1 * s2 * s3, c3 * s1 * s2 - c1 * s3, c2 * s1],
        [c2 * s3, c2 * c3, -s2],
    )


@equation("(5), (6) p", gives="slewing.position in platform from support", unit="m",
          printed="elements of the wrist's transform", note="turned into the platform's axes")
def eq6_p(p, th3, th4, d5):
    a1, a2, d2, d3 = p.a3, p.a4, d5, p.d6
    c1, s1, c2, s2 = cos(th3), sin(th3), cos(th4), sin(th4)
    return BASE @ Vec(
        a1 * c1 + a2 * c1 * c2 + c1 * c2 * d3 - c1 * d2 * s2,
        a1 * s1 + a2 * c2 * s1 + c2 * d3 * s1 - d2 * s1 * s2,
        -c2 * d2 - a2 * s2 - d3 * s2,
    )


@equation("(7) θ2", gives="th4", given=WRIST, unit="rad", printed="θ2 = asin(−a_z)")
def eq7_theta2(p, R, t):
    n, o, a, pos = wrist_columns(R, t)
    return asin(-a[2])


@equation("(7) d2", gives="d5", given=WRIST, unit="m",
          printed="d2 = −(p_z + (a2+d3) sin θ2)/cos θ2")
def eq7_d2(p, R, t, th4):
    a2, d3, theta2 = p.a4, p.d6, th4
    n, o, a, pos = wrist_columns(R, t)
    return -(pos[2] + (a2 + d3) * sin(theta2)) / cos(theta2)


@equation("(7) θ3", gives="th6", given=WRIST, unit="rad", printed="θ3 = asin(n_z/cos θ2)",
          corrected="θ3 = atan2(n_z, o_z)", note="wrong quadrant for |θ6| > 90°")
def eq7_theta3(p, R, t, th4):
    theta2 = th4
    n, o, a, pos = wrist_columns(R, t)
    return asin(n[2] / cos(theta2))


@eq7_theta3.corrected
def _(p, R, t, th4):
    n, o, a, pos = wrist_columns(R, t)
    return atan2(n[2], o[2])


@equation("(7) θ1", gives="th3", given=WRIST, unit="rad", printed="θ1 = acos(a_x/cos θ2)",
          corrected="θ1 = atan2(a_y, a_x)", note="wrong sign for θ1 < 0")
def eq7_theta1(p, R, t, th4):
    theta2 = th4
    n, o, a, pos = wrist_columns(R, t)
    return acos(a[0] / cos(theta2))


@eq7_theta1.corrected
def _(p, R, t, th4):
    n, o, a, pos = wrist_columns(R, t)
    return atan2(a[1], a[0])


# (12), (13): elements of the end effector's pose; α is here the platform's tilt.

ALPHA = {"alpha": "platform.yaw"}


@equation("(12), (13) n_x", gives="slewing.rotation[1,1]", given=ALPHA, printed="as printed")
def eq13_nx(p, alpha, th3, th4, th6):
    ca, sa, c3, s3 = cos(alpha), sin(alpha), cos(th3), sin(th3)
    c4, s4, c6, s6 = cos(th4), sin(th4), cos(th6), sin(th6)
    return -s6 * (c4 * sa - ca * c3 * s4) - c6 * ca * s3


@equation("(12), (13) n_y", gives="slewing.rotation[2,1]", given=ALPHA, printed="as printed")
def eq13_ny(p, alpha, th3, th4, th6):
    ca, sa, c3, s3 = cos(alpha), sin(alpha), cos(th3), sin(th3)
    c4, s4, c6, s6 = cos(th4), sin(th4), cos(th6), sin(th6)
    return s6 * (c4 * ca + sa * c3 * s4) - c6 * sa * s3


@equation("(12), (13) n_z", gives="slewing.rotation[3,1]", printed="−c3c6 − s4s6 − s3",
          corrected="−c3c6 − s3s4s6")
def eq13_nz(p, th3, th4, th6):
    c3, s3, c4, s4, c6, s6 = cos(th3), sin(th3), cos(th4), sin(th4), cos(th6), sin(th6)
    return -c3 * c6 - s4 * s6 - s3


@eq13_nz.corrected
def _(p, th3, th4, th6):
    c3, s3, c4, s4, c6, s6 = cos(th3), sin(th3), cos(th4), sin(th4), cos(th6), sin(th6)
    return -c3 * c6 - s3 * s4 * s6


@equation("(12), (13) o_x", gives="slewing.rotation[1,2]", given=ALPHA,
          printed="cosα s6s3 − sinα c6c4 − cosα c3c4",
          corrected="s3s6 cosα − c4c6 sinα + c3s4c6 cosα")
def eq13_ox(p, alpha, th3, th4, th6):
    ca, sa, c3, s3 = cos(alpha), sin(alpha), cos(th3), sin(th3)
    c4, s4, c6, s6 = cos(th4), sin(th4), cos(th6), sin(th6)
    return ca * s6 * s3 - sa * c6 * c4 - ca * c3 * c4


@eq13_ox.corrected
def _(p, alpha, th3, th4, th6):
    ca, sa, c3, s3 = cos(alpha), sin(alpha), cos(th3), sin(th3)
    c4, s4, c6, s6 = cos(th4), sin(th4), cos(th6), sin(th6)
    return s3 * s6 * ca - c4 * c6 * sa + c3 * s4 * c6 * ca


@equation("(12), (13) o_y", gives="slewing.rotation[2,2]", given=ALPHA, printed="as printed")
def eq13_oy(p, alpha, th3, th4, th6):
    ca, sa, c3, s3 = cos(alpha), sin(alpha), cos(th3), sin(th3)
    c4, s4, c6, s6 = cos(th4), sin(th4), cos(th6), sin(th6)
    return c6 * (ca * c4 + c3 * s4 * sa) + sa * s3 * s6


@equation("(12), (13) o_z", gives="slewing.rotation[3,2]", printed="as printed")
def eq13_oz(p, th3, th4, th6):
    c3, s3, s4, c6, s6 = cos(th3), sin(th3), sin(th4), cos(th6), sin(th6)
    return c3 * s6 - s3 * c6 * s4


@equation("(12), (13) a_x", gives="slewing.rotation[1,3]", given=ALPHA, printed="as printed")
def eq13_ax(p, alpha, th3, th4):
    ca, sa, c3, c4, s4 = cos(alpha), sin(alpha), cos(th3), cos(th4), sin(th4)
    return s4 * sa + ca * c3 * c4


@equation("(12), (13) a_y", gives="slewing.rotation[2,3]", given=ALPHA, printed="as printed")
def eq13_ay(p, alpha, th3, th4):
    ca, sa, c3, c4, s4 = cos(alpha), sin(alpha), cos(th3), cos(th4), sin(th4)
    return c4 * c3 * sa - ca * s4


@equation("(12), (13) a_z", gives="slewing.rotation[3,3]", printed="as printed")
def eq13_az(p, th3, th4):
    s3, c4 = sin(th3), cos(th4)
    return -s3 * c4


@equation("(12), (13) p_x", gives="slewing.position[1]", unit="m",
          given={**ALPHA, "X": "platform.x"}, printed="as printed")
def eq13_px(p, alpha, X, th3, th4, d5):
    a2, d3, a3, a4, d6 = p.a2, p.d3, p.a3, p.a4, p.d6
    ca, sa, c3, c4, s4 = cos(alpha), sin(alpha), cos(th3), cos(th4), sin(th4)
    return (X + a2 * ca - d3 * sa + a4 * (s4 * sa + ca * c3 * c4) + d6 * (s4 * sa + ca * c3 * c4)
            + d5 * (c4 * sa - ca * c3 * s4) + a3 * ca * c3)


@equation("(12), (13) p_y", gives="slewing.position[2]", unit="m",
          given={**ALPHA, "Y": "platform.y"},
          printed="… − a4[s4cosα − sinα c3s4] − d6[s4cosα + sinα c3c4] …",
          corrected="… − (a4 + d6)[s4cosα − sinα c3c4] …")
def eq13_py(p, alpha, Y, th3, th4, d5):
    a2, d3, a3, a4, d6 = p.a2, p.d3, p.a3, p.a4, p.d6
    ca, sa, c3, c4, s4 = cos(alpha), sin(alpha), cos(th3), cos(th4), sin(th4)
    return (Y + d3 * ca + a2 * sa - d5 * (c4 * ca + sa * c3 * s4) + a3 * sa * c3
            - a4 * (s4 * ca - sa * c3 * s4) - d6 * (s4 * ca + sa * c3 * c4))


@eq13_py.corrected
def _(p, alpha, Y, th3, th4, d5):
    a2, d3, a3, a4, d6 = p.a2, p.d3, p.a3, p.a4, p.d6
    ca, sa, c3, c4, s4 = cos(alpha), sin(alpha), cos(th3), cos(th4), sin(th4)
    return (Y + d3 * ca + a2 * sa - d5 * (c4 * ca + sa * c3 * s4) + a3 * sa * c3
            - a4 * (s4 * ca - sa * c3 * c4) - d6 * (s4 * ca - sa * c3 * c4))


@equation("(12), (13) p_z", gives="slewing.position[3]", unit="m", printed="as printed")
def eq13_pz(p, d1, th3, th4, d5):
    a3, a4, d6 = p.a3, p.a4, p.d6
    s3, c4, s4 = sin(th3), cos(th4), sin(th4)
    return d1 - a3 * s3 - (a4 + d6) * s3 * c4 + s3 * d5 * s4


# Serial Jacobian, in the tool's frame: [v; ω] of its origin per unit rate of th3, th4, d5, th6.

ROWS = {"row": [1, 2, 3, 4, 5, 6]}  # of the reference's [ω; v]


def reordered(column):
    """[v; ω] as [ω; v]."""
    return column[3:] + column[:3]


@equation("(28), (29)", gives="slewing.jacobian in slewing[{row},5]", each=ROWS,
          printed="(p×n)_z = c2c3(d3+a2) + a1c3, (p×o)_z = −c2s3(d3+a2) + a1s3",
          corrected="c3 H, −s3 H with H = a1 + c2(a2+d3) − d2 s2")
def eq28(p, row, th4, d5, th6):
    a1, a2, d3, d2 = p.a3, p.a4, p.d6, d5
    c2, s2, c3, s3 = cos(th4), sin(th4), cos(th6), sin(th6)
    pn = c2 * c3 * (d3 + a2) + a1 * c3
    po = -c2 * s3 * (d3 + a2) + a1 * s3
    return reordered([pn, po, 0.0, s3 * c2, c3 * c2, -s2])[row - 1]


@eq28.corrected
def _(p, row, th4, d5, th6):
    a1, a2, d3, d2 = p.a3, p.a4, p.d6, d5
    c2, s2, c3, s3 = cos(th4), sin(th4), cos(th6), sin(th6)
    H = a1 + c2 * (a2 + d3) - d2 * s2
    return reordered([c3 * H, -s3 * H, 0.0, s3 * c2, c3 * c2, -s2])[row - 1]


@equation("(30)", gives="slewing.jacobian in slewing[{row},6]", each=ROWS,
          printed="[−s3(d3+a2), −c3(d3+a2), 0, c2, −s3, 0]", corrected="third −d2, fourth c3")
def eq30(p, row, th4, d5, th6):
    a2, d3, d2 = p.a4, p.d6, d5
    c2, c3, s3 = cos(th4), cos(th6), sin(th6)
    return reordered([-s3 * (d3 + a2), -c3 * (d3 + a2), 0.0, c2, -s3, 0.0])[row - 1]


@eq30.corrected
def _(p, row, th4, d5, th6):
    a2, d3, d2 = p.a4, p.d6, d5
    c3, s3 = cos(th6), sin(th6)
    return reordered([-s3 * (d3 + a2), -c3 * (d3 + a2), -d2, c3, -s3, 0.0])[row - 1]


@equation("(31)", gives="slewing.jacobian in slewing[{row},7]", each=ROWS,
          printed="[−s3, −c3, 0, 0, 0, 0]")
def eq31(p, row, th6):
    c3, s3 = cos(th6), sin(th6)
    return reordered([-s3, -c3, 0.0, 0.0, 0.0, 0.0])[row - 1]


def J2(p, th4, d5, th6):
    """(32), corrected; rows [v; ω]."""
    a1, a2, d3, d2 = p.a3, p.a4, p.d6, d5
    c2, s2, c3, s3 = cos(th4), sin(th4), cos(th6), sin(th6)
    H = a1 + c2 * (a2 + d3) - d2 * s2
    return Mat(
        [c3 * H, -s3 * (d3 + a2), -s3, 0.0],
        [-s3 * H, -c3 * (d3 + a2), -c3, 0.0],
        [0.0, -d2, 0.0, 0.0],
        [s3 * c2, c3, 0.0, 0.0],
        [c3 * c2, -s3, 0.0, 0.0],
        [-s2, 0.0, 0.0, 1.0],
    )


@equation("(26), (27), (32)", gives="slewing.jacobian in slewing[{row},{column}]",
          each={**ROWS, "column": [5, 6, 7, 8]}, printed="J2 with the columns (28)–(31)",
          corrected="J2 with corrected columns", note="inherits the errors of (29) and (30)")
def eq32(p, row, column, th4, d5, th6):
    a1, a2, d3, d2 = p.a3, p.a4, p.d6, d5
    c2, s2, c3, s3 = cos(th4), sin(th4), cos(th6), sin(th6)
    J = Mat(
        [c2 * c3 * (d3 + a2) + a1 * c3, -s3 * (d3 + a2), -s3, 0.0],
        [-c2 * s3 * (d3 + a2) + a1 * s3, -c3 * (d3 + a2), -c3, 0.0],
        [0.0, 0.0, 0.0, 0.0],
        [s3 * c2, c2, 0.0, 0.0],
        [c3 * c2, -s3, 0.0, 0.0],
        [-s2, 0.0, 0.0, 1.0],
    )
    return reordered(list(J))[row - 1][column - 5]


@eq32.corrected
def _(p, row, column, th4, d5, th6):
    return reordered(list(J2(p, th4, d5, th6)))[row - 1][column - 5]


# Hybrid Jacobian and accelerations.

PLANE = {"V": "platform.velocity", "W": "platform.angular_velocity[3]"}


@equation("(33), (34) v", gives="slewing.velocity", unit="m/s",
          given={**PLANE, "R": "slewing.rotation", "r": "slewing.position from platform"},
          printed="J1 and J2 stacked (shapes do not fit; no rail, no rotation)",
          corrected="v = ḋ1 e_z + (V_X, V_Y, 0) + W_γ e_z×r + R06 J2v q̇",
          note="print read as v = (V_X, V_Y, 0) + J2v q̇")
def eq33_v(p, V, W, R, r, th4, d5, th6, d1_d, th3_d, th4_d, d5_d, th6_d):
    J2v = Mat(J2(p, th4, d5, th6)[:3])
    return Vec(V[0], V[1], 0) + J2v @ Vec(th3_d, th4_d, d5_d, th6_d)


@eq33_v.corrected
def _(p, V, W, R, r, th4, d5, th6, d1_d, th3_d, th4_d, d5_d, th6_d):
    J2v = Mat(J2(p, th4, d5, th6)[:3])
    return (Vec(V[0], V[1], d1_d) + cross([0, 0, W], r)
            + R @ (J2v @ Vec(th3_d, th4_d, d5_d, th6_d)))


@equation("(33), (34) ω", gives="slewing.angular_velocity", unit="rad/s",
          given={"W": PLANE["W"], "R": "slewing.rotation"},
          printed="J1 and J2 stacked (shapes do not fit; no rail, no rotation)",
          corrected="ω = W_γ e_z + R06 J2ω q̇", note="print read as ω = W_γ e_z + J2ω q̇")
def eq33_omega(p, W, R, th4, d5, th6, th3_d, th4_d, d5_d, th6_d):
    J2w = Mat(J2(p, th4, d5, th6)[3:])
    return Vec(0, 0, W) + J2w @ Vec(th3_d, th4_d, d5_d, th6_d)


@eq33_omega.corrected
def _(p, W, R, th4, d5, th6, th3_d, th4_d, d5_d, th6_d):
    J2w = Mat(J2(p, th4, d5, th6)[3:])
    return Vec(0, 0, W) + R @ (J2w @ Vec(th3_d, th4_d, d5_d, th6_d))


CARRIED = {
    "R": "slewing.rotation", "r": "slewing.position from platform", "v": "slewing.velocity",
    "v_K": "platform.velocity", "a_K": "platform.acceleration",
    "w_K": "platform.angular_velocity", "e_K": "platform.angular_acceleration",
}


def carried(R, r, v, v_K, a_K, w_K, e_K):
    """What the moving platform adds to the wrist's own acceleration, in the tool's axes."""
    relative = v - v_K - cross(w_K, r)
    return R.T @ (a_K + cross(e_K, r) + cross(w_K, cross(w_K, r)) + 2 * cross(w_K, relative))


@equation("(41)–(46)", gives="slewing.acceleration in slewing", given=CARRIED, unit="m/s²",
          printed="J̇2 (θ1, θ2, d1, θ3) + J2 (θ̇1, θ̇2, ḋ1, θ̇3)",
          corrected="J̇2 q̇ + J2 q̈ + ω_tool × v_tool (translation)",
          note="positions for rates, rates for accelerations; the platform's motion is added")
def eq41(p, th3, th4, d5, th6, th3_d, th4_d, d5_d, th6_d, th3_dd, th4_dd, d5_dd, th6_dd,
         R, r, v, v_K, a_K, w_K, e_K):
    J, J_d, _ = motion(lambda *q: J2(p, *q), [th4, d5, th6], [th4_d, d5_d, th6_d], [0, 0, 0])
    q, q_d = Vec(th3, th4, d5, th6), Vec(th3_d, th4_d, d5_d, th6_d)
    A = J_d @ q + J @ q_d
    return Vec(A[:3]) + carried(R, r, v, v_K, a_K, w_K, e_K)


@eq41.corrected
def _(p, th3, th4, d5, th6, th3_d, th4_d, d5_d, th6_d, th3_dd, th4_dd, d5_dd, th6_dd,
      R, r, v, v_K, a_K, w_K, e_K):
    J, J_d, _ = motion(lambda *q: J2(p, *q), [th4, d5, th6], [th4_d, d5_d, th6_d], [0, 0, 0])
    q_d, q_dd = Vec(th3_d, th4_d, d5_d, th6_d), Vec(th3_dd, th4_dd, d5_dd, th6_dd)
    A, V = J_d @ q_d + J @ q_dd, J @ q_d
    return Vec(A[:3]) + cross(V[3:], V[:3]) + carried(R, r, v, v_K, a_K, w_K, e_K)


# Planar velocities are relative to slider A; the reference's contain V0.


@equation("(14)", gives="F", given=of("A", ANGLES), unit="rad", printed="ε = asin(L1 sin α/(2 L4))",
          note="the joint's angle is π − ε")
def eq14(p, A):
    alpha = A
    epsilon = asin(p.L1 * sin(alpha) / (2 * p.L4))
    return pi - epsilon


@equation("(15)", gives="AB.E.velocity in EF[1]", given=of("F", ANGLES), unit="m/s",
          printed="V_EF = V2 cos ε",
          note="along FE, with slider A; V2 is the speed of F relative to A")
def eq15(p, F, X1_d, X3_d):
    epsilon, V0, V2 = pi - F, X1_d, X3_d - X1_d
    V_EF = V2 * cos(epsilon)
    return -V_EF - V0 * cos(epsilon)


@equation("(16)", gives="AB.E.velocity in AB[2]", given=of("A D F", ANGLES), unit="m/s",
          printed="V_E = V_EF/cos δ, δ = α + β − 90°", corrected="δ = α + ε − 90°",
          note="wrong index; across AB, with slider A")
def eq16(p, A, D, F, X1_d, X3_d):
    alpha, beta, epsilon, V0, V2 = A, pi - D, pi - F, X1_d, X3_d - X1_d
    V_EF = V2 * cos(epsilon)
    delta = alpha + beta - pi / 2
    V_E = V_EF / cos(delta)
    return -V_E - V0 * sin(alpha)


@eq16.corrected
def _(p, A, D, F, X1_d, X3_d):
    alpha, epsilon, V0, V2 = A, pi - F, X1_d, X3_d - X1_d
    V_EF = V2 * cos(epsilon)
    delta = alpha + epsilon - pi / 2
    V_E = V_EF / cos(delta)
    return -V_E - V0 * sin(alpha)


@equation("(17)", gives="AB.B.velocity in AB[2]", given=of("A F", ANGLES), unit="m/s",
          printed="V_E = V2 cos ε/sin(α+ε), V_B = 2 V_E", note="across AB, with slider A")
def eq17(p, A, F, X1_d, X3_d):
    alpha, epsilon, V0, V2 = A, pi - F, X1_d, X3_d - X1_d
    V_E = V2 * cos(epsilon) / sin(alpha + epsilon)
    V_B = 2 * V_E
    return -V_B - V0 * sin(alpha)


V_B_GIVEN = {"A": "A", "gamma": "platform.yaw", "v_B": "AB.B.velocity in AB[2]"}


def V_B_of(alpha, v_B, V0):
    return -v_B - V0 * sin(alpha)


@equation("(18)", gives="platform.B.velocity in platform[1]", given=V_B_GIVEN, unit="m/s",
          printed="V_BC^n = V_B sin(α−γ)", note="along BC, with slider A")
def eq18(p, A, gamma, v_B, X1_d):
    alpha, V0 = A, X1_d
    V_B = V_B_of(alpha, v_B, V0)
    V_BCn = V_B * sin(alpha - gamma)
    return V_BCn + V0 * cos(gamma)


@equation("(19)", gives="platform.B.velocity in platform[2]", given=V_B_GIVEN, unit="m/s",
          printed="V_BC^t = V_B cos(α−γ)", note="across BC, with slider A")
def eq19(p, A, gamma, v_B, X1_d):
    alpha, V0 = A, X1_d
    V_B = V_B_of(alpha, v_B, V0)
    V_BCt = V_B * cos(alpha - gamma)
    return -V_BCt - V0 * sin(gamma)


@equation("(20) V_CD^n", gives="CD.C.velocity in CD[1]", given=of("D", ANGLES), unit="m/s",
          printed="V_CD^n = V3 cos β", note="along CD, with slider A")
def eq20n(p, D, X1_d, X2_d):
    beta, V0, V3 = pi - D, X1_d, X2_d - X1_d
    V_CDn = V3 * cos(beta)
    return -V_CDn - V0 * cos(beta)


@equation("(20) V_CD^t", gives="CD.velocity in CD[2]", given=of("D", ANGLES), unit="m/s",
          printed="V_CD^t = V3 sin β", note="of D across CD, with slider A")
def eq20t(p, D, X1_d, X2_d):
    beta, V0, V3 = pi - D, X1_d, X2_d - X1_d
    V_CDt = V3 * sin(beta)
    return -V_CDt - V0 * sin(beta)


# V_BC^n, V_BC^t and m of the reference.
ALONG_ACROSS = {"v_B": "platform.B.velocity in platform", "v_C": "platform.C.velocity in platform",
                "gamma": "platform.yaw"}


def V_BC_of(gamma, v_B, V0):
    return v_B[0] - V0 * cos(gamma), -v_B[1] - V0 * sin(gamma)


def m_of(gamma, v_C, V0):
    return -v_C[1] - V0 * sin(gamma)


@equation("below (20): m", gives="CD.C.velocity", given=ALONG_ACROSS, unit="m/s",
          printed="m⃗ = (m sin γ, m cos γ)", corrected="m⃗ = (m sin γ, −m cos γ)",
          note="the printed vector is not normal to BC; (21) uses the corrected one")
def below20(p, gamma, v_B, v_C, X1_d, d1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    across = Vec(m * sin(gamma), m * cos(gamma), 0)
    return Vec(V0, 0, d1_d) + V_BCn * Vec(cos(gamma), sin(gamma), 0) + across


@below20.corrected
def _(p, gamma, v_B, v_C, X1_d, d1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    across = Vec(m * sin(gamma), -m * cos(gamma), 0)
    return Vec(V0, 0, d1_d) + V_BCn * Vec(cos(gamma), sin(gamma), 0) + across


@equation("(21), (22)", gives="platform.C.velocity in platform[2]", given={**V_B_GIVEN, "D": "D"},
          unit="m/s",
          printed="m = −V_B sin(α−γ) cot(β+γ) + V3 cos β/sin(β+γ)",
          note="across BC, with slider A")
def eq22(p, A, D, gamma, v_B, X1_d, X2_d):
    alpha, beta, V0, V3 = A, pi - D, X1_d, X2_d - X1_d
    V_B = V_B_of(alpha, v_B, V0)
    m = (-V_B * sin(alpha - gamma) * cos(beta + gamma) / sin(beta + gamma)
         + V3 * cos(beta) / sin(beta + gamma))
    return -m - V0 * sin(gamma)


@equation("(23) V_X", gives="platform.velocity[1]", given=ALONG_ACROSS, unit="m/s",
          printed="½ (m sin γ + V_BC^n cos γ) + V0",
          corrected="V0 + V_BC^n cos γ + ½ (m + V_BC^t) sin γ",
          note="half of the velocity of C instead of the mean of B and C")
def eq23_X(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return (m * sin(gamma) + V_BCn * cos(gamma)) / 2 + V0


@eq23_X.corrected
def _(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return V0 + V_BCn * cos(gamma) + (m + V_BCt) * sin(gamma) / 2


@equation("(23) V_Y", gives="platform.velocity[2]", given=ALONG_ACROSS, unit="m/s",
          printed="½ (V_BC^n sin γ − m cos γ)",
          corrected="V_BC^n sin γ − ½ (m + V_BC^t) cos γ")
def eq23_Y(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return (V_BCn * sin(gamma) - m * cos(gamma)) / 2


@eq23_Y.corrected
def _(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return V_BCn * sin(gamma) - (m + V_BCt) * cos(gamma) / 2


@equation("(23) W_γ", gives="platform.angular_velocity[3]", given=ALONG_ACROSS, unit="rad/s",
          printed="(m − V_BC^t)/L2", corrected="(V_BC^t − m)/L2", note="wrong sense of rotation")
def eq23_W(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return (m - V_BCt) / p.L2


@eq23_W.corrected
def _(p, gamma, v_B, v_C, X1_d):
    V0 = X1_d
    (V_BCn, V_BCt), m = V_BC_of(gamma, v_B, V0), m_of(gamma, v_C, V0)
    return (V_BCt - m) / p.L2


# (24), (25): of V_X, V_Y, W_γ by V0, V2, V3. V2 moves slider F alone (X3), V3 slider D alone (X2).


@equation("(24), (25) J11", gives="0",
          given={"a": "platform.jacobian[4,2]", "b": "platform.jacobian[4,3]",
                 "c": "platform.jacobian[4,4]"},
          printed="1", note="less what all three sliders together give; needs V2, V3 relative to A")
def eq25_11(p, a, b, c):
    return 1 - (a + b + c)


@equation("(25) J12", gives="platform.jacobian[4,4]", given=ANGLES,
          printed="cos ε sin(α−γ) [cos λ − cot(γ+β) sin γ]/sin(α+β), λ undefined",
          corrected="cos ε/sin(α+ε) · [sin α + sin(α−γ) sin β/sin(β+γ)]",
          note="print read with λ = γ; half of V_B is missing")
def eq25_12(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    lambda_ = gamma
    cot = cos(gamma + beta) / sin(gamma + beta)
    return (cos(epsilon) * sin(alpha - gamma) * (cos(lambda_) - cot * sin(gamma))
            / sin(alpha + beta))


@eq25_12.corrected
def _(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    return (cos(epsilon) / sin(alpha + epsilon)
            * (sin(alpha) + sin(alpha - gamma) * sin(beta) / sin(beta + gamma)))


@equation("(25) J13", gives="platform.jacobian[4,3]", given=of("D gamma", ANGLES),
          printed="cos β sin γ/sin(γ+β)", corrected="half of it", note="factor 1/2 missing")
def eq25_13(p, D, gamma):
    beta = pi - D
    return cos(beta) * sin(gamma) / sin(gamma + beta)


@eq25_13.corrected
def _(p, D, gamma):
    beta = pi - D
    return cos(beta) * sin(gamma) / (2 * sin(gamma + beta))


@equation("(25) J22", gives="platform.jacobian[5,4]", given=ANGLES,
          printed="−cos β cos γ/(2 sin(γ+β))",
          corrected="cos ε/sin(α+ε) · [−cos α + sin(α−γ) cos β/sin(β+γ)]",
          note="J22 and J23 are interchanged")
def eq25_22(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    return -cos(beta) * cos(gamma) / (2 * sin(gamma + beta))


@eq25_22.corrected
def _(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    return (cos(epsilon) / sin(alpha + epsilon)
            * (-cos(alpha) + sin(alpha - gamma) * cos(beta) / sin(beta + gamma)))


@equation("(25) J23", gives="platform.jacobian[5,3]", given=ANGLES,
          printed="cos ε sin(α−γ)[sin γ + cos γ cot(γ+β)]/sin(α+ε)",
          corrected="−cos β cos γ/(2 sin(β+γ))", note="J22 and J23 are interchanged")
def eq25_23(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    cot = cos(gamma + beta) / sin(gamma + beta)
    return (cos(epsilon) * sin(alpha - gamma) * (sin(gamma) + cos(gamma) * cot)
            / sin(alpha + epsilon))


@eq25_23.corrected
def _(p, A, D, F, gamma):
    beta = pi - D
    return -cos(beta) * cos(gamma) / (2 * sin(beta + gamma))


@equation("(25) J32", gives="platform.jacobian[3,4]", given=ANGLES, unit="1/m",
          printed="2 cos ε [cos(α−γ) − sin(α−γ) cot(β+γ)]/(L2 sin(α+ε))",
          corrected="the same with + in the bracket", note="sign")
def eq25_32(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    cot = cos(beta + gamma) / sin(beta + gamma)
    return (2 * cos(epsilon) * (cos(alpha - gamma) - sin(alpha - gamma) * cot)
            / (p.L2 * sin(alpha + epsilon)))


@eq25_32.corrected
def _(p, A, D, F, gamma):
    alpha, beta, epsilon = A, pi - D, pi - F
    cot = cos(beta + gamma) / sin(beta + gamma)
    return (2 * cos(epsilon) * (cos(alpha - gamma) + sin(alpha - gamma) * cot)
            / (p.L2 * sin(alpha + epsilon)))


@equation("(25) J33", gives="platform.jacobian[3,3]", given=of("D gamma", ANGLES), unit="1/m",
          printed="cos β/(L2 sin(γ+β))", corrected="−cos β/(L2 sin(β+γ))",
          note="sense of rotation opposite to γ")
def eq25_33(p, D, gamma):
    beta = pi - D
    return cos(beta) / (p.L2 * sin(gamma + beta))


@eq25_33.corrected
def _(p, D, gamma):
    beta = pi - D
    return -cos(beta) / (p.L2 * sin(gamma + beta))


def J1(p, alpha, beta, epsilon, gamma):
    """(25), corrected."""
    k, S, C = cos(epsilon) / sin(alpha + epsilon), sin(beta + gamma), sin(alpha - gamma)
    return Mat(
        [1.0, k * (sin(alpha) + C * sin(beta) / S), cos(beta) * sin(gamma) / (2 * S)],
        [0.0, k * (-cos(alpha) + C * cos(beta) / S), -cos(beta) * cos(gamma) / (2 * S)],
        [0.0, 2 * k * sin(alpha + beta) / (p.L2 * S), -cos(beta) / (p.L2 * S)],
    )


RATES = {**ANGLES, "A_d": "A.velocity", "D_d": "D.velocity", "F_d": "F.velocity",
         "gamma_d": "platform.yaw.velocity"}


def plane_acceleration(p, A, D, F, gamma, A_d, D_d, F_d, gamma_d, V, V_d):
    angles, rates = [A, pi - D, pi - F, gamma], [A_d, -D_d, -F_d, gamma_d]
    J, J_d, _ = motion(lambda *q: J1(p, *q), angles, rates, [0, 0, 0, 0])
    return J_d @ V + J @ V_d


@equation("(35), (36) X, Y", gives="platform.acceleration[{k}]", each={"k": [1, 2]}, given=RATES,
          unit="m/s²", printed="A = J̇ V + J V̇ = q̇ᵀ H q̇ + G q̈",
          note="form, with the corrected J")
def eq35(p, k, A, D, F, gamma, A_d, D_d, F_d, gamma_d, X1_d, X2_d, X3_d, X1_dd, X2_dd, X3_dd):
    V, V_d = Vec(X1_d, X3_d - X1_d, X2_d - X1_d), Vec(X1_dd, X3_dd - X1_dd, X2_dd - X1_dd)
    return plane_acceleration(p, A, D, F, gamma, A_d, D_d, F_d, gamma_d, V, V_d)[k - 1]


@equation("(35), (36) γ", gives="platform.angular_acceleration[3]", given=RATES, unit="rad/s²",
          printed="A = J̇ V + J V̇ = q̇ᵀ H q̇ + G q̈", note="form, with the corrected J")
def eq35_gamma(p, A, D, F, gamma, A_d, D_d, F_d, gamma_d, X1_d, X2_d, X3_d, X1_dd, X2_dd, X3_dd):
    V, V_d = Vec(X1_d, X3_d - X1_d, X2_d - X1_d), Vec(X1_dd, X3_dd - X1_dd, X2_dd - X1_dd)
    return plane_acceleration(p, A, D, F, gamma, A_d, D_d, F_d, gamma_d, V, V_d)[2]


# Dynamics. e: the drive's row in the coordinates, which are the drives.

PLANAR = ["platform", "sliderA", "AB", "sliderD", "CD", "sliderF", "EF"]
WRIST_BODIES = ["support", "flip", "table", "slewing"]


def frames(p, d1, X1, X2, X3, th3, th4, d5, th6):
    """Axes and origin of all bodies, by (9) and the chain (10)."""
    AF, AD = X3 - X1, X2 - X1
    alpha = acos((p.L1**2 / 4 + AF**2 - p.L4**2) / (p.L1 * AF))
    epsilon = asin(p.L1 * sin(alpha) / (2 * p.L4))
    BD = hypot(p.L1 * sin(alpha), AD - p.L1 * cos(alpha))
    beta = (acos((p.L3**2 + BD**2 - p.L2**2) / (2 * p.L3 * BD))
            + atan2(p.L1 * sin(alpha), AD - p.L1 * cos(alpha)))
    gamma = asin((p.L3 * sin(beta) - p.L1 * sin(alpha)) / p.L2)
    upright = rot_z(0.0)
    A, D, F = Vec(X1, 0.0, d1), Vec(X2, 0.0, d1), Vec(X3, 0.0, d1)
    of = {"carriage": (upright, Vec(0.0, 0.0, d1)), "sliderA": (upright, A),
          "sliderD": (upright, D), "sliderF": (upright, F), "AB": (rot_z(alpha), A),
          "CD": (rot_z(pi - beta), D), "EF": (rot_z(pi - epsilon), F)}
    R = rot_z(gamma)
    K = A + p.L1 * Vec(cos(alpha), sin(alpha), 0.0) + p.L2 / 2 * Vec(cos(gamma), sin(gamma), 0.0)
    of["platform"] = R, K
    turn = rot_x(-pi / 2)
    at = K + R @ Vec(p.a2, p.d3, 0.0)
    R = R @ turn @ rot_z(th3)
    of["support"] = R, at
    at = at + R @ Vec(p.a3, 0.0, 0.0)
    R = R @ turn @ rot_z(th4)
    of["flip"] = R, at
    at = at + R @ Vec(p.a4, d5, 0.0)
    R = R @ turn @ rot_z(-pi / 2)
    of["table"] = R, at
    at = at + R @ Vec(0.0, p.d6, 0.0)
    R = R @ turn @ rot_z(th6)
    of["slewing"] = of["payload"] = R, at
    return of


@lru_cache(maxsize=200)
def virtual_work(p, bodies, q, q_d, q_dd):
    """Drive forces by d/dt ∂T/∂q̇ − ∂T/∂q + ∂U/∂q, summed over bodies."""

    def poses(*at):
        of = frames(p, *at)
        return [[*(of[b][1] + of[b][0] @ Vec(p[f"c_{b}_x"], p[f"c_{b}_y"], p[f"c_{b}_z"])),
                 *of[b][0][0], *of[b][0][1], *of[b][0][2]] for b in bodies]

    def matrix(pose):
        return Mat(pose[3:6], pose[6:9], pose[9:])

    now, rate, second = motion(poses, q, q_d, q_dd)
    columns = jacobian(poses, q).T
    force = [0.0] * len(q)
    for k, b in enumerate(bodies):
        R, R_d, R_dd = matrix(now[k]), matrix(rate[k]), matrix(second[k])
        omega, omega_d = vee(R_d @ R.T), vee(R_dd @ R.T)
        I = [p[f"I_{b}_x"], p[f"I_{b}_y"], p[f"I_{b}_z"]]
        turned = lambda a: R @ Vec([i * e for i, e in zip(I, R.T @ a)])
        f = p[f"m_{b}"] * (Vec(second[k][:3]) + Vec(0.0, p.g, 0.0))
        n = turned(omega_d) + cross(omega, turned(omega))
        for j in range(len(q)):
            column = columns[j][12 * k:12 * k + 12]
            force[j] += dot(f, column[:3]) + dot(n, vee(matrix(column) @ R.T))
    return force


@equation("(47)", gives="{drive}.force", each={"drive": DRIVES}, unit="N, N m",
          given={"J": "slewing.jacobian", "e": "{drive}.jacobian"},
          printed="T, U over platform, three drive branches and four wrist bodies",
          corrected="carriage and payload added; branches are slider + link",
          note="the masses are assumptions, and with them how much the print leaves out")
def eq47(p, e, J, d1, X1, X2, X3, th3, th4, d5, th6,
         d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d,
         d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd):
    q = (d1, X1, X2, X3, th3, th4, d5, th6)
    q_d = (d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d)
    q_dd = (d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd)
    tau = virtual_work(p, (*PLANAR, *WRIST_BODIES), q, q_d, q_dd)
    return dot(e, tau) - dot(e, J.T @ Vec(MOMENT + FORCE))


@eq47.corrected
def _(p, e, J, d1, X1, X2, X3, th3, th4, d5, th6,
      d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d,
      d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd):
    q = (d1, X1, X2, X3, th3, th4, d5, th6)
    q_d = (d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d)
    q_dd = (d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd)
    tau = virtual_work(p, ("carriage", *PLANAR, *WRIST_BODIES, "payload"), q, q_d, q_dd)
    return dot(e, tau) - dot(e, J.T @ Vec(MOMENT + FORCE))


@equation("(48), (50)–(52)", gives="{drive}.force", each={"drive": DRIVES}, unit="N, N m",
          given={"J": "slewing.jacobian", "e": "{drive}.jacobian"},
          printed="Lagrange's equation and virtual work",
          note="with a wrench on the end effector")
def eq48(p, e, J, d1, X1, X2, X3, th3, th4, d5, th6,
         d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d,
         d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd):
    q = (d1, X1, X2, X3, th3, th4, d5, th6)
    q_d = (d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d)
    q_dd = (d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd)
    tau = virtual_work(p, ("carriage", *PLANAR, *WRIST_BODIES, "payload"), q, q_d, q_dd)
    return dot(e, tau) - dot(e, J.T @ Vec(MOMENT + FORCE))


@equation("(53)", gives="{drive}.force", each={"drive": DRIVES}, unit="N, N m",
          given={"J": "slewing.jacobian", "e": "{drive}.jacobian"}, printed="τ = JᵀQ",
          corrected="τ = −JᵀW for a wrench W acting on the end effector",
          note="right for Q exerted by the end effector; added to the forces without the wrench")
def eq53(p, e, J, d1, X1, X2, X3, th3, th4, d5, th6,
         d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d,
         d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd):
    q = (d1, X1, X2, X3, th3, th4, d5, th6)
    q_d = (d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d)
    q_dd = (d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd)
    tau = virtual_work(p, ("carriage", *PLANAR, *WRIST_BODIES, "payload"), q, q_d, q_dd)
    return dot(e, tau) + dot(e, J.T @ Vec(MOMENT + FORCE))


@eq53.corrected
def _(p, e, J, d1, X1, X2, X3, th3, th4, d5, th6,
      d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d,
      d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd):
    q = (d1, X1, X2, X3, th3, th4, d5, th6)
    q_d = (d1_d, X1_d, X2_d, X3_d, th3_d, th4_d, d5_d, th6_d)
    q_dd = (d1_dd, X1_dd, X2_dd, X3_dd, th3_dd, th4_dd, d5_dd, th6_dd)
    tau = virtual_work(p, ("carriage", *PLANAR, *WRIST_BODIES, "payload"), q, q_d, q_dd)
    return dot(e, tau) - dot(e, J.T @ Vec(MOMENT + FORCE))
