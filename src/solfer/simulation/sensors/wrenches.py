"""Force and torque sensors at the links that are meant to touch the ground."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from solfer.model.contacts import ContactRecord
from solfer.simulation.robot_body.contacts import ContactDetector
from solfer.transport.messages import WrenchMessage

if TYPE_CHECKING:
    from solfer.simulation.simulation import Simulation

WORLD = "world"
logger = logging.getLogger(__name__)


class ContactSensors:
    """The sum of all forces of the world on each contact's link, about the link's origin; zero in the air.

    Forces are those of the newest step, mean values over it; the pose of the link is that at the step's beginning,
    where they act. Links that are fixed to each other are one body, and each measures the sum for all of it.

    Args:
        simulation: The robot.
        contacts: Forces on the robot.
        records: The contacts; one on a link that the robot does not have is left out with a warning.

    Attributes:
        names: Names of the contacts.
    """

    def __init__(self, simulation: Simulation, contacts: ContactDetector, records: Sequence[ContactRecord]):
        self._simulation, self._contacts, self._kinematics = simulation, contacts, simulation.kinematics
        body = simulation.body
        present = [record for record in records if record.end_frame in body.owner]
        for record in records:
            if record not in present:
                logger.warning(
                    "%s: contact '%s' is left out: no link '%s'",
                    record.where("end_frame"),
                    record.name,
                    record.end_frame,
                )
        self.names = tuple(record.name for record in present)
        self._links = [record.end_frame for record in present]
        self._owners = [body.owner[link] for link in self._links]
        self._world = [WrenchMessage(WORLD) for _ in present]
        self._local = [WrenchMessage(link) for link in self._links]

    def measure(self) -> list[WrenchMessage]:
        """Take one sample: for each contact the wrench in the axes of the world, then that in the axes of its link.

        The messages are the same objects each time.
        """
        simulation, kinematics = self._simulation, self._kinematics
        points = self._contacts.points()
        kinematics.update(simulation.q_before)
        published: list[WrenchMessage] = []
        for link, owner, world, local in zip(self._links, self._owners, self._world, self._local, strict=True):
            world.stamp = local.stamp = simulation.time
            x, y, z = kinematics.position(link).tolist()
            force, torque = np.zeros(3), np.zeros(3)
            for point in points:
                if point.link == owner:
                    (px, py, pz), (fx, fy, fz) = point.position, point.force
                    rx, ry, rz = px - x, py - y, pz - z
                    force += fx, fy, fz
                    torque += ry * fz - rz * fy, rz * fx - rx * fz, rx * fy - ry * fx
            rotation = kinematics.rotation(link)
            world.force[:], world.torque[:] = force, torque
            local.force[:], local.torque[:] = force @ rotation, torque @ rotation
            published += (world, local)
        return published
