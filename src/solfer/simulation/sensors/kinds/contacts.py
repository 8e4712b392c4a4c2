"""Force and torque sensors at the links that are meant to touch the ground."""

import logging
from collections.abc import Sequence

import numpy as np

from solfer.model.contacts import ContactRecord
from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.sensor import Sensor
from solfer.simulation.state import SimulationState
from solfer.transport.messages import WrenchMessage

logger = logging.getLogger(__name__)


class ContactSensors(Sensor):
    """The sum of all forces of the world on each contact's link, about the link's origin; zero in the air.

    Forces are those of the newest step, mean values over it; the pose of the link is that at the step's beginning,
    where they act. Links that are fixed to each other are one body, and each measures the sum for all of it.

    Args:
        state: What the robot does.
        records: The contacts; one on a link that the robot does not have is left out with a warning.

    Attributes:
        names: Names of the contacts.
        topics: For each contact that of the wrench in the axes of the world, then that in the axes of its link.
    """

    name = "contacts"
    message = "geometry_msgs/WrenchStamped"
    what = "wrenches of the contacts"

    def __init__(self, state: SimulationState, records: Sequence[ContactRecord]):
        super().__init__(state)
        present = [record for record in records if record.end_frame in state.owner]
        for record in records:
            if record not in present:
                logger.warning(
                    "%s: contact '%s' is left out: no link '%s'",
                    record.where("end_frame"),
                    record.name,
                    record.end_frame,
                )
        self.names = tuple(record.name for record in present)
        self.topics = [f"contacts/{name}{axes}" for name in self.names for axes in ("", "/link")]
        self._links = [record.end_frame for record in present]
        self._owners = [state.owner[link] for link in self._links]
        self._world = [WrenchMessage("world") for _ in present]
        self._local = [WrenchMessage(link) for link in self._links]

    @classmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "ContactSensors | None":
        """See `Sensor.of`."""
        sensors = cls(state, equipment.contacts)
        return sensors if sensors.names else None

    def messages(self) -> Sequence[WrenchMessage]:
        """See `Sensor.messages`."""
        time = self.state.time
        points = self.state.contact_points()
        before = self.state.before
        published: list[WrenchMessage] = []
        for link, owner, world, local in zip(self._links, self._owners, self._world, self._local, strict=True):
            world.stamp = local.stamp = time
            x, y, z = before.position(link).tolist()
            force_x = force_y = force_z = 0.0
            torque_x = torque_y = torque_z = 0.0
            for point in points:
                if point.link == owner:
                    (px, py, pz), (fx, fy, fz) = point.position, point.force
                    rx = px - x
                    ry = py - y
                    rz = pz - z
                    force_x += fx
                    force_y += fy
                    force_z += fz
                    torque_x += ry * fz - rz * fy
                    torque_y += rz * fx - rx * fz
                    torque_z += rx * fy - ry * fx
            rotation = before.rotation(link)
            world.force[:], world.torque[:] = (force_x, force_y, force_z), (torque_x, torque_y, torque_z)
            np.matmul(world.force, rotation, out=local.force)
            np.matmul(world.torque, rotation, out=local.torque)
            published += (world, local)
        return published
