"""What touches what, and with which friction."""

from collections.abc import Iterator
from enum import IntEnum
from typing import Any

import numpy as np

from solfer.simulation.physics import ContactPoint

ROBOT = "robot:"
"""Begin of the names of a robot's bodies and joints."""

LINK = "link:"
"""Begin of the names of its links."""

BODY = ROBOT + LINK
"""Begin of the names of its bodies."""


class Touching(IntEnum):
    """What a shape belongs to: parts of a robot do not touch each other."""

    ROBOT = 1
    WORLD = 2

    def prepare(self, shape: Any) -> None:
        """Let a shape of a specification touch the world, with friction along two directions."""
        shape.contype = self
        shape.conaffinity = Touching.WORLD if self == Touching.ROBOT else Touching.ROBOT | Touching.WORLD
        shape.condim = 3
        shape.priority = 1 if self == Touching.ROBOT else 0
        # Measured on CENTAURO, docs/measurements/engines.md: it sinks in by 0.2 mm. Wheels that roll leave the ground,
        # at 51 Hz, with 0.93 or more in place of 0.9, and where friction is stiffer than the normal force; with less
        # they creep sideways.
        shape.solref[:] = 0.004, 1.0
        shape.solimp[:] = 0.9, 0.9, 0.001, 0.5, 2.0


class Frictions:
    """Multiplies the friction coefficients of what touches. MuJoCo itself takes that of the robot.

    Constraints are made again only where a part of the world has another coefficient than 1.

    Args:
        mujoco: The module.
        model: The model.

    Attributes:
        are_mixed: Whether a part of the world has another coefficient than 1.
    """

    def __init__(self, mujoco: Any, model: Any):
        self._corrections = (
            mujoco.mj_makeConstraint,
            mujoco.mj_island,
            mujoco.mj_projectConstraint,
            mujoco.mj_referenceConstraint,
        )
        self._model = model
        self._coefficients = np.ones(model.ngeom)
        self.are_mixed = False

    def set(self, body: str, coefficient: float) -> None:
        """Change the coefficient of a body."""
        model = self._model
        shapes = model.geom_bodyid == model.body(body).id
        self._coefficients[shapes] = model.geom_friction[shapes, 0] = coefficient
        of_world = model.geom_contype == Touching.WORLD
        self.are_mixed = bool(np.any(self._coefficients[of_world] != 1.0))

    def mix(self, data: Any) -> None:
        """Correct the constraints of a step, after these are made."""
        contact = data.contact
        if not len(contact.geom):
            return
        lowest = 1e-5  # MuJoCo takes nothing smaller
        product = np.maximum(self._coefficients[contact.geom].prod(axis=1), lowest)
        if np.array_equal(product, contact.friction[:, 0]):
            return
        contact.friction[:, :2] = product[:, None]
        for correct in self._corrections:
            correct(self._model, data)


def contact_points(mujoco: Any, model: Any, data: Any) -> Iterator[ContactPoint]:
    """Find where the world pushes robots, after a step."""
    contact = data.contact
    wrench = np.empty(6)
    for index, pair in enumerate(contact.geom.tolist()):
        if contact.efc_address[index] < 0:
            continue
        mujoco.mj_contactForce(model, data, index, wrench)
        if wrench[0] <= 0.0:
            continue
        frame = contact.frame[index].reshape(3, 3)  # its first row is the normal, from the first shape to the second
        force = wrench[:3] @ frame
        to_surface = 0.5 * contact.dist[index] * frame[0]
        for shape, sign in zip(pair, (-1.0, 1.0), strict=True):
            if model.geom_contype[shape] == Touching.ROBOT:
                link = model.body(model.geom_bodyid[shape]).name.removeprefix(BODY)
                x, y, z = (contact.pos[index] + sign * to_surface).tolist()
                fx, fy, fz = (sign * force).tolist()
                yield ContactPoint(link, (x, y, z), (fx, fy, fz))
