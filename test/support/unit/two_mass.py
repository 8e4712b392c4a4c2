"""A link on the spring of a drive, without a simulator, and how it swings."""

import math

import numpy as np

from solfer.lower_level.laws.springs import Springs, resolved
from solfer.lower_level.laws.two_mass import TwoMassImpedance

DT = 0.001  # [s]
ROTOR, LINK = 1.3, 0.6  # [kg m^2]
NO_LIMIT = np.array([np.inf])


class Link:
    """Free bodies of constant inertia, which move as a simulator moves them: speeds first, then positions."""

    def __init__(self, *inertia):
        self.size, self._inertia = len(inertia), np.diag(np.array(inertia, dtype=float))
        self.q, self.v, self.outside, self.weight = np.zeros((4, self.size))

    def inertia(self, q):
        """See Dynamics."""
        return self._inertia

    def bias(self, q, v):
        """See Dynamics."""
        return self.weight

    def step(self, law):
        """Let DT pass."""
        torque = law.update(self.q, self.v, DT)
        self.v += DT * (torque + self.outside - self.weight) / np.diag(self._inertia)
        self.q += DT * self.v


def joint(stiffness, damping=0.0, friction=0.0, rotor=ROTOR, link=LINK, limit=NO_LIMIT):
    """Make a link and the law of its drive."""
    body = Link(link)
    return body, TwoMassImpedance(
        body, (limit, NO_LIMIT), springs(body, [stiffness], [damping], [rotor], [friction]), np.zeros(1), DT
    )


def springs(body, *values):
    """Make the springs of a body, by stiffness, damping, rotors and friction."""
    stiffness, damping, rotor, friction = np.array(values, dtype=float)
    return Springs(
        stiffness, damping, rotor, friction, resolved(body.inertia(np.zeros(body.size)), stiffness, rotor, DT)
    )


def swing(body, law, steps):
    """Return the deflection of the spring, which begins stretched by 0.01 rad, at each step."""
    law.motor_position[:] = 0.01
    deflection = [0.01]
    for _ in range(steps):
        body.step(law)
        deflection.append(float(law.motor_position[0] - body.q[0]))
    return np.array(deflection)


def fit(deflection):
    """Return angular frequency [rad/s] and damping ratio of a decaying oscillation, from its recursion.

    x[n+1] = 2 r cos(w) x[n] - r^2 x[n-1]
    """
    columns = np.column_stack((deflection[1:-1], deflection[:-2]))
    (first, second), *_ = np.linalg.lstsq(columns, deflection[2:], rcond=None)
    pole = np.log(np.roots([1.0, -first, -second])[0]) / DT
    return abs(pole), -pole.real / abs(pole)


def response_errors(stiffness, ratio):
    """Stretch a spring of a damping ratio and let it go; the relative errors of its frequency and its damping."""
    mobility = 1.0 / ROTOR + 1.0 / LINK
    natural = math.sqrt(stiffness * mobility)
    frequency, damping = fit(swing(*joint(stiffness, damping=2.0 * ratio * natural / mobility), 200))
    return abs(frequency / natural - 1.0), abs(damping / ratio - 1.0)
