"""The component `wheeled_motion`."""

import math
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.declaration import TopicIn
from solfer.components.wheeled_motion.bounded import BoundedDescent
from solfer.components.wheeled_motion.drive import Drive, Twist
from solfer.components.wheeled_motion.points import (
    PERIOD,
    ROUNDED,
    ROUNDED_TURN,
    BasePose,
    Camber,
    Caster,
    RollingOffsets,
    carrier_of,
    wrapped,
)
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.resteering import Resteering
from solfer.components.wheeled_motion.steering import Steering
from solfer.components.wheeled_motion.tags import (
    BASE,
    CAMBER,
    CASTER,
    POINTS,
    STEERING,
    VERTICES,
    WheeledMotionTags,
)
from solfer.errors import ComponentError, UnknownName
from solfer.model.contacts import ContactRecord
from solfer.numerics.solvers.damped_descent import DampedDescent
from solfer.points import CenterOfMass, Point, SpatialPoint, SupportVertex
from solfer.robot import Robot
from solfer.tasks.building.build import build_stack
from solfer.tasks.constraints import joint_bounds
from solfer.tasks.stack import Stack

SOFT = {STEERING: 0.1, CAMBER: 2.0, CASTER: 2.0}
"""Largest errors of angles [rad]: references farther away follow the wheel."""


class WheeledMotion(Component):
    """Drives on steered wheels at the ends of legs: base and support polygon follow references.

    Joint velocities of a stack of tasks by null spaces, integrated, are commanded: no wheel slips, the base goes where
    it is wanted, wheels steer to where their vertices have to go, and roll there, camber and caster stay.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        references: What is wanted.
        stack: The tasks.

    Raises:
        SolferError: A tag does not fit the robot.
        SolferErrors: Several of these.
    """

    Tags = WheeledMotionTags

    def __init__(self, robot: Robot, tags: WheeledMotionTags, name: str = "wheeled_motion"):
        super().__init__(robot, tags, name)
        robot.update()
        self._wheels = self._find_wheels()
        links = [wheel.end_frame for wheel in self._wheels]
        self._pose = SpatialPoint(robot.kinematics.base_link, robot)
        self._points = self._make_points(links)
        record = tags.stack_record()
        self._moved = self._movable()
        configured = build_stack(record, robot, self._points)
        configured.confine(self._moved)
        self.stack = Stack(configured.levels)
        self._rows = self._find_rows(record.levels)
        self.references = References(len(links))
        self._frames = (
            [configured.tasks[f"{STEERING}/{link}"].point for link in links] if STEERING in self._rows else []
        )
        self._turning = np.array([self._steered_by(link) for link in links])
        kinematics = robot.kinematics
        self._resteering = Resteering(
            kinematics.lower_position[self._turning], kinematics.upper_position[self._turning]
        )
        self._gain = np.zeros(len(self.stack.velocity))
        self._gain[:] = np.concatenate([task.gain for task in self.stack.tasks])
        self._error, self._place = np.zeros_like(self._gain), np.zeros(3)
        self._position, self._velocity = np.zeros((2, robot.size))
        self._wanted = np.zeros(len(links))
        self.steering_angles, self._is_first = np.zeros(len(links)), True
        self._feeds_forward, self._is_limited = tags.is_mended("feed_forward"), tags.is_mended("limits")
        self.drive = Drive(tags.acceleration, tags.turn_acceleration)

    def set_rate(self, rate: float) -> None:
        """Set the rate of the control cycle [Hz], and make what depends on it; see `Component.set_rate`."""
        super().set_rate(rate)
        if not self.kinematics:
            raise ComponentError(f"'{self.name}' without kinematics", expected="kinematics: true")
        tags, stack = self.tags, self.stack
        rests = tags.is_mended("rest")
        self._steering = Steering(tags.steering_record(), self.period, len(self._wheels), tags.faithful, rests)
        self._descent = BoundedDescent(DampedDescent(stack.ends, stack.size, self._moved), self._moved)
        self._bounds = joint_bounds(self.model, self.period)
        self.drive.set_period(self.period)

    def init(self) -> None:
        """Start from where the robot is, at rest."""
        self._position[:], self._velocity[:] = self.model.state.position, 0.0
        self.stack.update()
        pose, offsets, references = self._pose.value, self._offsets, self.references
        offsets.start()
        place = np.array(self._points[POINTS[BASE]].value[3:])
        if self.tags.base == "link" and not self.tags.is_mended("start_in_place"):
            place[:2] = self.model.center_of_mass.value[:2]
        references.start(place, offsets.heading, pose[3:])
        references.vertices[:] = offsets.reference
        references.camber[:] = self._points[POINTS[CAMBER]].value
        references.caster[:] = self._points[POINTS[CASTER]].value
        if self.tags.faithful:
            references.caster[references.caster <= -ROUNDED] += ROUNDED_TURN - 2.0 * ROUNDED
        self._steering.start((float(pose[0]), float(pose[1])), offsets.heading)
        if self.tags.is_mended("start_in_place"):
            self._measure_steering()
            for wheel, angle in zip(self._steering.wheels, self.steering_angles.tolist(), strict=True):
                wheel.start(angle - offsets.heading)
        self._resteering.start()
        self.drive.start()
        self._is_first = True

    def update(self) -> None:
        """Compute one cycle."""
        references, offsets = self.references, self._offsets
        self.drive.update(references, offsets.heading)
        references.step(self.period)
        offsets.reference[:] = references.vertices
        self.stack.update()
        self._steer()
        self._find_errors()
        rates = self.stack.velocity
        np.multiply(self._gain, self._error, out=rates)
        if self._feeds_forward:
            self._feed_forward(rates)
        self._bounds.update(self._position)
        self._descent.update(self.stack, self._bounds if self._is_limited else None)
        self._integrate()
        offsets.remember()
        self._is_first = False

    def send(self) -> None:
        """Write positions and velocities of the DoFs that it moves."""
        command, moved = self.model.command, self._moved
        command.position[moved], command.velocity[moved] = self._position[moved], self._velocity[moved]

    def stop(self) -> None:
        """Hold the joints where they are wanted, and the wheels still."""
        self._velocity[:] = 0.0
        self.model.command.velocity[self._moved] = 0.0

    def reset(self) -> None:
        """Forget what was wanted."""
        self.drive.start()

    def topics(self) -> tuple[TopicIn, ...]:
        """Receive velocities of the base, seen from its heading, on `<name>/cmd_vel`."""
        return (TopicIn("cmd_vel", "geometry_msgs/Twist", Twist, self.drive.receive),)

    def start_log(self, logger: Any) -> None:
        """Declare references, vertices, steering and errors."""
        names = [wheel.end_frame for wheel in self._wheels]
        places = [f"{name}.{axis}" for name in names for axis in "xyz"]
        logger.add("base_reference", self.references.position, list("xyz"), "m", "world")
        logger.add("vertex_reference", self.references.vertices, places, "m")
        logger.add("vertices", self._offsets.states, places, "m")
        logger.add("steering_reference", self._steering.angles, names, "rad")
        logger.add("steering", self.steering_angles, names, "rad")
        logger.add("velocity", self._velocity, self.model.dofs)

    @property
    def _offsets(self) -> RollingOffsets:
        return self._points[POINTS[VERTICES]]  # type: ignore[return-value]

    def _find_wheels(self) -> tuple[ContactRecord, ...]:
        """Return the contacts of the tracked wheels, in the order of the group."""
        robot, tags = self.model, self.tags
        if robot.kinematics.base_link is None:
            raise ComponentError(f"'{robot.name}' has a fixed base", where=tags.where(), expected="a floating base")
        records = {one.end_frame: one for one in robot.contact_records if one.type == "wheel"}
        try:
            links = robot.links(tags.track)
        except UnknownName as error:
            raise error.at(tags.where("track")) from None
        for link in links:
            if link not in records:
                raise UnknownName("wheel among the robot's contacts", link, records, where=tags.where("track"))
        if not links:
            raise ComponentError(f"no wheel in '{tags.track}'", where=tags.where("track"), expected="links of wheels")
        return tuple(records[link] for link in links)

    def _make_points(self, links: list[str]) -> dict[str, Point]:
        robot, tags = self.model, self.tags
        axles = np.array([self._axle(wheel) for wheel in self._wheels])
        vertices = [
            SupportVertex(
                wheel.end_frame,
                robot,
                _first(tags.major_axis, wheel.major_axis),
                _first(tags.minor_axis, wheel.minor_axis),
                axle,
                wheel.position,
            )
            for wheel, axle in zip(self._wheels, axles, strict=True)
        ]
        poses = [SpatialPoint(link, robot) for link in links]
        carriers = [carrier_of(robot, link) for link in links]
        carried = np.array([self._carried_axle(*each) for each in zip(carriers, links, axles, strict=True)])
        center = CenterOfMass(robot) if tags.base == "center_of_mass" else None
        return {
            POINTS[BASE]: BasePose(robot, self._pose, center),
            POINTS[VERTICES]: RollingOffsets(robot, vertices, axles, self._pose, not tags.is_mended("prompt")),
            POINTS[CAMBER]: Camber(robot, poses, axles),
            POINTS[CASTER]: Caster(robot, [SpatialPoint(link, robot) for link in carriers], carried),
        }

    def _axle(self, wheel: ContactRecord) -> np.ndarray:
        axis = self.tags.reference_axis.get(wheel.end_frame, wheel.reference_axis)
        if axis is None or not any((axis.x, axis.y, axis.z)):
            raise ComponentError(
                f"no axle of the wheel '{wheel.end_frame}'",
                where=self.tags.where("reference_axis"),
                expected="`reference_axis` of its contact, or here",
            )
        return _unit(axis.x, axis.y, axis.z)

    def _carried_axle(self, carrier: str, link: str, axle: np.ndarray) -> np.ndarray:
        """Return the axle of a wheel in the frame of the link that carries it."""
        given = self.tags.reference_axis.get(carrier)
        if given is not None:
            return _unit(given.x, given.y, given.z)
        kinematics = self.model.kinematics
        return kinematics.rotation(carrier).T @ kinematics.rotation(link) @ axle

    def _movable(self) -> np.ndarray:
        """Return the DoFs that it moves: those of the chain."""
        chain = self.tags.chain
        if chain is None:
            return np.arange(self.model.size)
        try:
            return np.sort(self.model.selectors[chain].indices)
        except UnknownName as error:
            raise error.at(self.tags.where("chain")) from None

    def _steered_by(self, wheel: str) -> int:
        """Return the DoF that steers a wheel: that of the link that carries it."""
        description = self.model.description
        joint = description.links[carrier_of(self.model, wheel)].parent
        if joint not in self.model.dofs:
            raise ComponentError(
                f"nothing steers the wheel '{wheel}'", where=self.tags.where("track"), expected="a joint that does"
            )
        return self.model.dof(joint)

    def _find_rows(self, levels: tuple[tuple[str, ...], ...]) -> dict[str, slice]:
        """Return the rows of each task of the configuration."""
        ends = self.stack.ends.tolist()
        return {names[0]: slice(*rows) for names, rows in zip(levels, zip(ends, ends[1:], strict=False), strict=True)}

    def _steer(self) -> None:
        """Compute where wheels are to point."""
        references, offsets, pose = self.references, self._offsets, self._pose.value
        errors = offsets.errors
        if self._is_first and not self.tags.is_mended("prompt"):
            errors[:] = 0.0
        vx, vy, _ = references.velocity.tolist()
        self._steering.update(
            offsets.states,
            errors,
            references.vertex_velocity,
            (float(pose[0]), float(pose[1])),
            offsets.heading,
            (vx, vy, float(references.turn[2])),
        )
        self._measure_steering()

    def _measure_steering(self) -> None:
        for index, (x, y) in enumerate(self._offsets.directions.tolist()):
            self.steering_angles[index] = math.atan2(y, x)

    def _find_errors(self) -> None:
        """Write the errors of all tasks."""
        points, references = self._points, self.references
        for name, rows in self._rows.items():
            if name == BASE:
                self._find_error_of_base(self._error[rows])
            elif name == VERTICES:
                np.negative(self._offsets.value, out=self._error[rows])
            elif name == STEERING:
                self._wanted[:] = self._steering.angles
                if self._is_limited:
                    self._stay_in_range(rows)
                self._find_soft(name, self.steering_angles, self._wanted)
            elif name in (CAMBER, CASTER):
                self._find_soft(name, points[POINTS[name]].value, getattr(references, name.lower()))

    def _feed_forward(self, rates: np.ndarray) -> None:
        """Add the velocities that are wanted of base and vertices."""
        references, offsets = self.references, self._offsets
        if BASE in self._rows:
            rows = rates[self._rows[BASE]]
            rows[:3] += references.turn
            rows[3:] += references.velocity
        if VERTICES in self._rows:
            cos, sin = math.cos(offsets.heading), math.sin(offsets.heading)
            rows = rates[self._rows[VERTICES]]
            for index, (vx, vy, _) in enumerate(references.vertex_velocity.tolist()):
                fx, fy = offsets.directions[index].tolist()
                rows[index] += fx * (cos * vx - sin * vy) + fy * (sin * vx + cos * vy)

    def _find_soft(self, name: str, angles: np.ndarray, wanted: np.ndarray) -> None:
        """Write the errors of angles of any number of half turns; references that are too far follow."""
        error, half = self._error[self._rows[name]], ROUNDED if self.tags.faithful else PERIOD
        for index, (angle, reference) in enumerate(zip(angles.tolist(), wanted.tolist(), strict=True)):
            error[index] = min(max(wrapped(reference - angle, half), -SOFT[name]), SOFT[name])
            wanted[index] = angle + error[index]

    def _stay_in_range(self, rows: slice) -> None:
        """Turn wheels the other way round where their joints would leave their ranges."""
        angles, wanted = self.steering_angles.tolist(), self._wanted.tolist()
        for index, dof in enumerate(self._turning.tolist()):
            error = wrapped(wanted[index] - angles[index])
            slope = self.stack.jacobian[rows.start + index, dof]
            end = self._position[dof] + error * slope
            if not self._bounds.lower_position[dof] < end < self._bounds.upper_position[dof]:
                error -= math.copysign(PERIOD, error)
                # half a turn away is not to be taken for no way at all
                limit = SOFT[STEERING]
                self._wanted[index] = angles[index] + min(max(error, -limit), limit)

    def _find_error_of_base(self, error: np.ndarray) -> None:
        """Write the error of the base: the vector part of the quaternion that turns it to its reference, and metres."""
        x, y, z, w = self._pose.value[3:].tolist()
        rx, ry, rz, rw = self.references.orientation.tolist()
        turn = (
            w * rx - rw * x - ry * z + rz * y,
            w * ry - rw * y - rz * x + rx * z,
            w * rz - rw * z - rx * y + ry * x,
        )
        # q and -q are the same orientation
        sign = 1.0 if w * rw + x * rx + y * ry + z * rz >= 0.0 else -1.0
        error[:3] = turn
        error[:3] *= sign
        np.subtract(self.references.position, self._points[POINTS[BASE]].value[3:], out=error[3:])

    def _integrate(self) -> None:
        """Write what is commanded."""
        moved, turning = self._moved, self._turning
        self._velocity[moved] = self._descent.velocity[moved]
        self._position[moved] += self.period * self._velocity[moved]
        if self._is_limited:
            return
        commanded = self._position[turning]
        self._resteering.update(self.model.state.position[turning], commanded)
        self._position[turning] = commanded


def _first(value: float | None, other: float | None) -> float:
    return other if value is None else value  # type: ignore[return-value]


def _unit(*axis: float) -> np.ndarray:
    vector = np.array(axis)
    return vector / np.linalg.norm(vector)
