"""Motor torque of a planar slider-crank, by virtual work.

        rod, l
     .--------__            motor: crank angle    phi: rod angle, sin phi = -(r/l) sin motor
  r /            ‾‾[slider]
   o--------------------→ x
"""

from mbverify.equations import asin, closed_form, cos, jacobian, motion, output, sin, sqrt


@closed_form("planar_slider_crank", commands=["motor"])
def drives(p, motor):
    return [motor]


@closed_form.forces
def forces(p, q, qd, qdd):
    def places(motor):  # of whatever has mass, and what turns
        phi = -asin(p.r / p.l * sin(motor))
        x, y = p.r * cos(motor), p.r * sin(motor)
        return [x / 2, y / 2, motor, x + p.l / 2 * cos(phi), y / 2, phi, x + p.l * cos(phi)]

    inertia = [p.m_crank, p.m_crank, p.I_crank, p.m_rod, p.m_rod, p.I_rod, p.m_slider]
    weight = [0, p.m_crank * p.g, 0, 0, p.m_rod * p.g, 0, 0]
    along = jacobian(places, q)
    acceleration = motion(places, q, qd, qdd)[2]
    return [sum(k[0] * (i * a + w) for k, i, a, w in zip(along, inertia, acceleration, weight))]


@closed_form.covers
def covers(p):  # what the equations take for granted; None: of no influence
    return {
        "gravity": [0, -p.g, None],
        "crank.mass": p.m_crank, "crank.com": [p.r / 2, 0, None],
        "crank.inertia": [None, None, p.I_crank],
        "rod.mass": p.m_rod, "rod.com": [p.l / 2, 0, None], "rod.inertia": [None, None, p.I_rod],
        "slider.mass": p.m_slider,
        "motor.on_parent": [0, 0, 0], "pin.on_parent": [p.r, 0, 0], "wrist.on_parent": [p.l, 0, 0],
        "guide.on_parent": [0, 0, 0], "guide.axis": [1, 0, 0],
    }


@output("slider.x", "m")
def slider(p, motor):
    return p.r * cos(motor) + sqrt(p.l**2 - (p.r * sin(motor)) ** 2)
