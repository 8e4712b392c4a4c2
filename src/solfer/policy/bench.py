"""A simulated robot with one plugin's commands, without the plugin's messages."""

from typing import Any

import numpy as np

from solfer.config import Configuration
from solfer.errors import UnknownName
from solfer.lower_level.laws.controllers import LowerLevelController
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.pipes.state_field import interface_of
from solfer.robot import Robot, build
from solfer.robot.selection import commanded_dofs
from solfer.simulation.simulation import Simulation
from solfer.transport.messages import GAINS, JOINT_FIELDS


class Bench:
    """Measures a Robot in a simulation, and applies its commands, with the numbers that its plugin would transport.

    Messages, claims, the blend of a start and delays of sensors are left out. Where sensors are perfect the truth is
    measured.

    Args:
        configuration: The plugin's configuration.
        simulation: The simulated robot.
        parameters: Texts by the names of their parameters, as `robot_parameters` reads them.
        senses: Whether sensors with their errors measure joints and the base's orientation and angular velocity.

    Attributes:
        robot: The plugin's Robot.
        simulation: See above; may be replaced by another one of the same robot.
    """

    def __init__(self, configuration: Configuration, simulation: Simulation, parameters: dict[str, str], senses: bool):
        self.robot = build(configuration, _SimulatedRobot(simulation, parameters))
        self.simulation = simulation
        self._configuration = configuration
        self._senses = senses
        known = {name: place for place, name in enumerate(simulation.kinematics.dofs)}
        shared = [(dof, known[name]) for dof, name in enumerate(self.robot.dofs) if name in known]
        self._dofs, self._places = np.array(shared, dtype=np.intp).T.copy()
        self._is_whole = bool(np.array_equal(self._dofs, self._places)) and len(shared) == self.robot.size

    def connect(self, fields: tuple[str, ...]) -> None:
        """Find where commands go; `fields` are those that the component commands, gains among them."""
        lower_level = self.simulation.lower_level
        self._commands = []
        for record in self._configuration.controllers:
            if not record.lower_level:
                continue
            controller = lower_level.controller(record.leads_to)
            dofs = commanded_dofs(record, self.robot)
            carried = [
                field
                for field in JOINT_FIELDS
                if field in fields and getattr(record.interface, field) and field in controller.FIELDS
            ]
            self._commands.append(_Commands(self.robot, controller, dofs, carried))

    def begin(self) -> None:
        """Measure, and let the commanded gains be in force at once, as they are when the blend of a start is over."""
        self.measure()
        for command in self._commands:
            command.begin()

    def measure(self) -> None:
        """Write what is measured into the Robot's state."""
        state = self.robot.state
        simulation = self.simulation
        if self._is_whole:
            np.copyto(state.position, simulation.q)
            np.copyto(state.velocity, simulation.v)
        else:
            state.position[self._dofs] = simulation.q[self._places]
            state.velocity[self._dofs] = simulation.v[self._places]
        if self._senses:
            self._sense()

    def command(self) -> None:
        """Apply the Robot's commands within their limits."""
        for command in self._commands:
            command.apply()

    def _sense(self) -> None:
        """Replace what the robot's sensors measure: joints, and how the base is turned and turns."""
        state = self.robot.state
        simulation = self.simulation
        count = len(simulation.state.joints)
        of_joints = self._dofs[self._places >= len(simulation.q) - count]
        joints = simulation.sensors["joints"].measure()
        picked = self._places[self._places >= len(simulation.q) - count] - (len(simulation.q) - count)
        state.position[of_joints] = joints.position[picked]
        state.velocity[of_joints] = joints.velocity[picked]
        record = simulation.sensors.record.imu
        chart = self.robot.kinematics.base
        base = simulation.state.base
        if record is None or chart is None or base is None:
            return
        now = simulation.state.now
        message = simulation.sensors["imu"].measure()
        turned = rotation_from_quaternion(message.orientation)
        mounted = now.rotation(base.link).T @ now.rotation(record.link)
        if record.offset_orientation is not None:
            mounted = mounted @ record.offset_orientation.matrix()
        chart.from_rotation(base.position, turned @ mounted.T, state.position[:6])
        chart.rates_from_twist(state.position[:6], base.linear, turned @ message.angular, state.velocity[:6])


class _Commands:
    """Commands of one pipe to a controller of the lower level; gains, which stay, are applied at the begin alone."""

    def __init__(self, robot: Robot, controller: LowerLevelController, dofs: np.ndarray, fields: list[str]):
        self._controller = controller
        self._dofs = dofs
        places = {name: place for place, name in enumerate(controller.joints)}
        self._indices = np.array([places[robot.dofs[dof]] for dof in dofs], dtype=np.intp)
        self._given = {field: np.zeros(len(dofs)) for field in fields if field not in GAINS}
        self._gains = {field: robot.command[field] for field in fields if field in GAINS}
        for field, values in self._gains.items():
            values[dofs] = getattr(controller, field)[self._indices]
        self._fields = []
        for field, out in self._given.items():
            interface = interface_of(field)
            bounds = robot.lower_limits[interface][dofs], robot.upper_limits[interface][dofs]
            self._fields.append((robot.command[interface], out, *bounds))

    def begin(self) -> None:
        """Let gains be in force."""
        gains = {field: values[self._dofs] for field, values in self._gains.items()}
        self._controller.apply(self._indices, gains)
        self._controller.advance(1.0)  # [s], longer than a gain takes

    def apply(self) -> None:
        """Apply them."""
        for values, out, lower, upper in self._fields:
            np.take(values, self._dofs, out=out, mode="clip")
            np.maximum(out, lower, out=out)
            np.minimum(out, upper, out=out)
        self._controller.apply(self._indices, self._given)


class _SimulatedRobot:
    """The outside for the builder of a Robot: a simulated robot."""

    def __init__(self, simulation: Simulation, parameters: dict[str, str]):
        self._simulation = simulation
        self._parameters = parameters

    def parameter(self, name: str, where: str = "") -> Any:
        """See `Middleware.parameter`."""
        if name not in self._parameters:
            raise UnknownName("parameter", name, self._parameters, where=where)
        return self._parameters[name]

    def joint_order(self, topic: str, message: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.joint_order`."""
        return self._simulation.state.joints

    def controller_joints(self, controller: str, timeout: float, where: str = "") -> tuple[str, ...]:
        """See `Middleware.controller_joints`."""
        return self._simulation.lower_level.controller(controller).joints

    def is_received(self, topic: str, message: str) -> bool:
        """See `Middleware.is_received`."""
        return True
