// The equations of examples/closed_form's slider-crank as a file in Python, up to the motor's
// torque: tests go on with what the function gives.
#pragma once

#include <string>

namespace mbv::test {

inline const std::string kCrankEquations = R"(
from mbverify.equations import closed_form, output, motion, jacobian, asin, sin, cos, Vec

def points(p, theta):
    phi = -asin(p.r / p.l * sin(theta))
    pin = p.r * Vec(cos(theta), sin(theta))
    return [pin / 2, pin + p.l / 2 * Vec(cos(phi), sin(phi)), p.r * cos(theta) + p.l * cos(phi),
            theta, phi]

@closed_form("planar_slider_crank", commands=["motor"])
def drives(p, theta):
    return [theta]

@closed_form.forces
def forces(p, q, qd, qdd):
    f = lambda theta: points(p, theta)
    crank, rod, slider, theta, phi = motion(f, q, qd, qdd)[2]
    weights = [p.m_crank] * 2 + [p.m_rod] * 2 + [p.m_slider, p.I_crank, p.I_rod]
    a = [crank[0], crank[1] + p.g, rod[0], rod[1] + p.g, slider, theta, phi]
    torque = sum(w * x * J[0] for w, x, J in zip(weights, a, jacobian(f, q)))
)";

}  // namespace mbv::test
