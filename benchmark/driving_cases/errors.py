"""Robots that are not quite what their controller knows."""

import re
from typing import Any

import numpy as np

MASS, CENTER = 0.2, 0.02
"""Largest errors of masses and inertias, as shares, and of centres of mass [m]."""

FRICTION = 0.4, 1.0
"""Friction of the wheels on the ground is between these."""

DELAY = 3e-3
"""Time from a measurement of the joints to its message [s]."""

_INERTIAL = re.compile(r"<inertial>.*?</inertial>", re.DOTALL)
_ATTRIBUTE = re.compile(r'\b(xyz|value|i[xyz]{2})="([^"]*)"')


def wrong_robot(seed: int, urdf: str) -> dict[str, Any]:
    """Return options of a `World` whose robot, a URDF, is wrong; of seed 0 it is right."""
    if not seed:
        return {}
    random = np.random.default_rng(seed)

    def change(inertial: re.Match) -> str:
        """Change mass and inertia of a link by one factor each, and move its centre of mass."""
        mass, spin = 1.0 + random.uniform(-MASS, MASS, 2)
        shift = random.uniform(-CENTER, CENTER, 3)

        def number(found: re.Match) -> str:
            name, numbers = found[1], np.array(found[2].split(), dtype=float)
            numbers = numbers + shift if name == "xyz" else numbers * (mass if name == "value" else spin)
            return f'{name}="{" ".join(f"{each:.9g}" for each in numbers)}"'

        return _ATTRIBUTE.sub(number, inertial[0])

    return {"urdf": _INERTIAL.sub(change, urdf), "friction": float(random.uniform(*FRICTION)), "delay": DELAY}
