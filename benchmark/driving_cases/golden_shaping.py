"""Recorded motions of the original's support shaping, with the forces that it has computed."""

import math
from typing import Any

import numpy as np

from solfer import Robot
from solfer.components.filter_tags import FilterTags
from solfer.components.gravity_compensation import GravityCompensation, GravityTags
from solfer.components.ground_forces import GroundForces
from solfer.components.ground_forces.tags import FiltersTags, GroundForcesTags
from solfer.components.support_shaping import SupportShaping
from solfer.components.support_shaping.rolling import vertex_map
from solfer.config import Record

EFFORT, SPEED = (200.0, 200.0, 200.0, 98.0, 23.0, 23.0), 1.0
"""Limits of the joints of a leg in the original's URDF [Nm], [rad/s]."""

MARGINS, WORKSPACES = (0.5, 0.3, 0.3, 0.6), (0.65, 0.65, 0.65, 0.65)
"""Tags of the original's configuration [m]."""

RING = 0.01
"""Radius of the wheels' rings [m]."""

CUT_OFF = 400.0 * math.atan(0.5)
"""Cut-off of the filter of torques, 200 rad/s at 200 Hz without bending it beforehand [rad/s]."""


def shaping_tags(tags: Any) -> Record:
    """Return the record of the tags of a recorded motion, from those of `wheeled_motion`."""
    own = {"margins": MARGINS, "workspaces": WORKSPACES, "margin_gain": 50.0, "workspace_gain": 120.0}
    fields = {name: getattr(tags, name) for name, field in type(tags).model_fields.items() if field.deprecated is None}
    record = SupportShaping.Tags.model_construct(**{**fields, **own, "law": "original"})
    return record.placed_as(tags)


def limit(robot: Robot) -> None:
    """Give the legs the limits of the original's URDF."""
    legs = slice(6, 30)
    robot.upper_limits.torque[legs], robot.lower_limits.torque[legs] = EFFORT * 4, -np.array(EFFORT * 4)
    robot.upper_limits.velocity[legs] = SPEED


class OriginalForces:
    """The ground's forces for the torques that carry the robot, as the original has computed them.

    Torques are those of the gravity compensation, low-passed. The original leaves out that the vertex moves around a
    wheel whose camber changes: the acceleration w x dr/dt with the wheel's angular velocity w and the way r from its
    centre to the vertex.

    Args:
        robot: The Robot.
        rate: Rate of the control cycle [Hz].
    """

    def __init__(self, robot: Robot, rate: float):
        self._robot = robot
        self._carrying = GravityCompensation(robot.companion(), GravityTags(track="wheels"))
        torque = FilterTags(cut_off_frequency=CUT_OFF, damping=4.0)
        filters = GroundForcesTags(track="wheels", filter=FiltersTags(torque=torque))
        self._forces = GroundForces(robot.companion(), filters)
        for component in (self._carrying, self._forces):
            component.set_rate(rate)
        self._carry(start=True)
        self._forces.init()

    def update(self) -> None:
        """Write the wrenches of the contacts at the last update of the Robot."""
        self._carry()
        self._forces.update()
        robot, names = self._robot, self._forces.names
        contacts = [robot.contacts[name] for name in names]
        jacobian = np.concatenate([contact.jacobian[:3] for contact in contacts])
        missing = []
        for record in (each for each in robot.contact_records if each.name in names):
            axis = record.reference_axis
            turning = robot.kinematics.jacobian(record.end_frame)[3:] @ robot.state.velocity
            world = robot.kinematics.rotation(record.end_frame) @ (axis.x, axis.y, axis.z)
            missing.append(np.cross(turning, vertex_map(world, RING) @ turning))
        inertia = jacobian @ np.linalg.solve(robot.dynamics.inertia, jacobian.T)
        forces = np.linalg.solve(inertia, np.concatenate(missing)).reshape(-1, 3)
        for contact, force in zip(contacts, forces, strict=True):
            contact.wrench[:3] += force

    def _carry(self, start: bool = False) -> None:
        self._robot.dynamics.update()
        if start:
            self._carrying.init()
        self._carrying.update()
        self._carrying.send()
        self._robot.state.torque[:] = self._carrying.model.command.torque


def play_shaping(content: dict[str, Any], robot: Robot, tags: Any) -> tuple[np.ndarray, np.ndarray]:
    """Run a recorded motion, open loop; return the positions of its rows, and those that were recorded [rad, m]."""
    period, columns = float(content["dt"]), {name: index for index, name in enumerate(content["columns"])}
    rows = np.array(content["rows"], dtype=float)
    cycles = {round(time / period): index for index, time in enumerate(rows[:, columns["t"]])}
    joints = [index for name, index in columns.items() if name.startswith("q.")]
    robot.state.position[:], robot.state.velocity[:] = content["q0"], 0.0
    limit(robot)
    robot.update()
    component = SupportShaping(robot.companion(), shaping_tags(tags), "support_shaping")
    component.set_rate(1.0 / period)
    forces = OriginalForces(robot, 1.0 / period)
    component.init()
    moved, found, velocity = len(joints), np.zeros((len(cycles), len(joints))), component.references.velocity
    command, state = component.model.command, robot.state
    for cycle in range(content["cycles"]):
        robot.update()
        forces.update()
        velocity[:2] = rows[cycles.get(cycle, 0), [columns["ref_vx"], columns["ref_vy"]]]
        component.update()
        component.send()
        if cycle in cycles:
            found[cycles[cycle]] = command.position[:moved]
        state.position[:moved], state.velocity[:moved] = command.position[:moved], command.velocity[:moved]
    return found, rows[:, joints]
