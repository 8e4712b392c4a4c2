"""The improved law of wheeled motion in plain NumPy, one wheel and one equation after the other.

It is written from the equations of docs/reference/wheeled_motion.md, with its own constants, and takes nothing from
the component but its tags: state, references and Jacobians are given in each cycle. Vectors in the plane are complex
numbers. The guard and the pace are not part of it; the pace is an input.
"""

import cmath
import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from driving_cases.levels import dense_within
from driving_cases.original import OriginalSteering
from scipy.spatial.transform import Rotation

REST_ERROR, REST_DISTANCE, WAKE_DISTANCE, WAKE_TIME = 2e-3, 2.5e-3, 4e-3, 0.3  # where wheels rest [m], and [s]
RELAXATION_LENGTH = 1e-3  # within which the direction of a wheel follows [m]
LONGER_WAY, END_MARGIN = 0.35, 0.1  # where a wheel turns the other way [rad]


class Measured(NamedTuple):
    """What is measured in one cycle, of m wheels and n DoFs, in the world.

    Attributes:
        pose: Pose of the base's link, position, then quaternion (x, y, z, w), shape (7,) [m].
        place: Position that the task `BASE` tracks, shape (3,) [m].
        vertices: Vertices, shape (m, 3) [m].
        rolling: Directions in which wheels roll, shape (m, 2).
        camber, caster: Angles of the wheels, shape (m,) [rad].
        position: Positions of the DoFs, shape (n,) [rad, m].
        jacobian: Jacobian of all tasks by priority, shape (rows, n).
    """

    pose: np.ndarray
    place: np.ndarray
    vertices: np.ndarray
    rolling: np.ndarray
    camber: np.ndarray
    caster: np.ndarray
    position: np.ndarray
    jacobian: np.ndarray


class Bounds(NamedTuple):
    """Bounds of the joint velocities, and the ranges of the joints, each of shape (n,)."""

    lower_position: np.ndarray
    upper_position: np.ndarray
    speed: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


def bounds_at(position: np.ndarray, kinematics: Any, period: float) -> Bounds:
    """Return the bounds with which no joint leaves its range within a period."""
    lower, upper, speed = kinematics.lower_position, kinematics.upper_position, kinematics.velocity_limit
    down, up = np.minimum(lower - position, 0.0) / period, np.maximum(upper - position, 0.0) / period
    return Bounds(lower, upper, speed, np.maximum(down, -speed), np.minimum(up, speed))


def measured(component: Any) -> Measured:
    """Return what the Points of a component have measured at their last update."""
    points: dict[str, Any] = {task.name: task.point for task in component.stack.tasks}
    base, vertices = points["BASE"], points["CONTACT_POINTS"]
    places = np.array([vertex.value for vertex in vertices.vertices])
    angles = points["CAMBER"].value, points["CASTER"].value
    position = component.model.state.position
    return Measured(
        base.pose.value, base.value[3:], places, vertices.directions, *angles, position, component.stack.jacobian
    )


def nearest(angle: float, other: float) -> float:
    """Return the angle nearest to another one among those that differ by half turns."""
    return angle - math.pi * math.ceil((angle - other) / math.pi - 0.5)


class Merged:
    """The original's steering of one wheel, that rests with small errors where nothing is to move.

    Args:
        tags: Tags of the component.
        period: Period of the control cycle [s].
    """

    turn = 0.0

    def __init__(self, tags: Any, period: float):
        self._wheel, self._rests = OriginalSteering(tags.steering_record(), period), tags.rests

    def point(self, angle: float) -> None:
        """Begin with a direction [rad], at rest."""
        self._wheel.point(angle)

    def update(self, desired: complex, error: complex, base_speed: float) -> float:
        """Return the direction of this cycle [rad].

        Args:
            desired: Velocity of the vertex in the motion of the base [m/s].
            error: Its error [m].
            base_speed: Speed of the wheel by the motion of the base in the last cycle [m/s].
        """
        if self._rests and not desired and abs(error) < REST_ERROR:
            return self._wheel.angle
        return self._wheel.update(desired, error, base_speed)


class Kept:
    """Steering along v + K (1 - d / |e|) e, which is followed within a way; resting wheels stay until errors are large.

    Args:
        gain: Gain K of errors across the wheels [1/s].
        period: Period of the control cycle [s].

    Attributes:
        turn: Rate of the direction of v, of which the opposite one is the same [rad/s].
    """

    def __init__(self, gain: float, period: float):
        self._gain, self._period, self._rest = gain, period, 0.0
        self.turn, self._before = 0.0, 0j
        self.point(0.0)

    def point(self, angle: float) -> None:
        """Begin with a direction [rad]."""
        self.angle = angle

    def update(self, desired: complex, error: complex, _base_speed: float) -> float:
        """Return the direction of this cycle [rad]; see `Merged.update`."""
        is_known = desired and self._before
        self.turn = cmath.phase((desired / self._before) ** 2) / 2.0 / self._period if is_known else 0.0
        self._before, distance = desired, abs(error)
        if desired:
            self._rest = 0.0
        elif distance < (WAKE_DISTANCE if self._rest else REST_DISTANCE):
            self._rest = WAKE_TIME
        else:
            self._rest = max(self._rest - self._period, 0.0)
        if not self._rest:
            velocity = desired + self._gain * error * max(0.0, 1.0 - REST_ERROR / max(distance, 1e-300))
            aim = nearest(cmath.phase(velocity), self.angle)
            way = abs(velocity) * self._period
            self.angle += (1.0 - math.exp(-way / RELAXATION_LENGTH)) * (aim - self.angle)
        return self.angle


class WheeledLaw:
    """Joint velocities of the tasks BASE, STEERING, CONTACT_POINTS, CAMBER and CASTER above which no wheel slips.

    Args:
        component: The component whose tags, gains, damping and robot count, after its `init`.
    """

    def __init__(self, component: Any):
        robot, stack = component.model, component.stack
        self._tags, self._period, self._moved = component.tags, component.period, component.moved
        self._gain = np.concatenate([task.gain for task in stack.tasks])
        self._damping, self._ends = stack.numbers[:, 3].copy(), stack.ends
        self._rows = {name: slice(*ends) for name, ends in zip(self._tags.ik, pairwise(self._ends), strict=True)}
        self._turning = [robot.dof(link.replace("wheel", "ankle_yaw")) for link in robot.links(self._tags.track)]
        self._kinematics = robot.kinematics
        self._most = {"STEERING": 0.2 if self._tags.is_paced else 0.1, "CAMBER": 2.0, "CASTER": 2.0}  # [rad]
        self._start(measured(component))

    def _start(self, state: Measured) -> None:
        """Begin at rest."""
        tags, period, rolling = self._tags, self._period, state.rolling @ (1.0, 1j)
        across = tags.gain_across
        self._wheels = [Kept(across, period) if across else Merged(tags, period) for _ in rolling]
        self._before = complex(*state.pose[:2]), cmath.exp(1j * heading_of(state))
        for wheel, direction in zip(self._wheels, np.angle(rolling) - heading_of(state), strict=True):
            wheel.point(float(direction))
        self._ways = np.zeros(len(rolling))
        self.position, self.velocity = state.position.copy(), np.zeros(len(state.position))

    def update(self, state: Measured, references: Any) -> np.ndarray:
        """Return the joint velocities of one cycle, shape (n,) [rad/s, m/s]; references have gone on already."""
        jacobian, rows = state.jacobian.copy(), self._rows["STEERING"]
        jacobian[rows][references.lifted] = 0.0
        place, turn = complex(*state.pose[:2]), cmath.exp(1j * heading_of(state))
        desired = references.vertices[:, :2] @ (1.0, 1j)
        errors = turn * desired - (state.vertices[:, :2] @ (1.0, 1j) - place)
        aims = self._steer(state, references, errors / turn)
        error = self._errors(state, references, errors, self._within(state, jacobian, aims))
        rates = self._rates(state, references, error, jacobian)
        bounds = bounds_at(self.position, self._kinematics, self._period)
        given = jacobian, rates, self._damping, self._ends, self._moved
        velocity = dense_within(*given, bounds=bounds, rigid=self._ends[1])[0]
        self.velocity[self._moved] = velocity[self._moved]
        self.position += self._period * self.velocity
        self._before = place, turn
        return self.velocity

    def _steer(self, state: Measured, references: Any, errors: np.ndarray) -> np.ndarray:
        """Return the directions in which wheels are to roll in the world [rad], from errors seen from the heading."""
        place, turn, heading = complex(*state.pose[:2]), cmath.exp(1j * heading_of(state)), heading_of(state)
        moved = (place - self._before[0]) / turn / self._period
        rate = cmath.phase(turn / self._before[1]) / self._period
        share = 0.0 if references.waits else references.limits
        base, angular = share * complex(*references.velocity[:2]) / turn, 1j * share * references.angular[2]
        aims = np.zeros(len(errors))
        for index, wheel in enumerate(self._wheels):
            arm = (complex(*state.vertices[index, :2]) - complex(*state.place[:2])) / turn
            velocity = base + angular * arm + share * complex(*references.vertex_velocity[index, :2])
            error = complex(errors[index])
            aims[index] = wheel.update(velocity, error, abs(moved + 1j * rate * error)) + heading
            if references.lifted[index]:
                aims[index] = math.atan2(state.rolling[index, 1], state.rolling[index, 0])
                wheel.turn = 0.0
                wheel.point(aims[index] - heading)
        return aims

    def _within(self, state: Measured, jacobian: np.ndarray, aims: np.ndarray) -> np.ndarray:
        """Return aims within the ranges of the joints that steer; a wheel keeps the way that it has begun [rad]."""
        found, most, ranges = np.zeros(len(aims)), self._most["STEERING"], self._kinematics
        for index, dof in enumerate(self._turning):
            row = jacobian[self._rows["STEERING"].start + index, dof]
            lower, upper, begun = ranges.lower_position[dof], ranges.upper_position[dof], self._ways[index]
            angle = math.atan2(state.rolling[index, 1], state.rolling[index, 0])
            way = begun + soft(aims[index], angle + begun, math.pi, math.pi)
            end, step = state.position[dof] + row * way, 4.0 * self._period * self.velocity[dof]
            is_inside = lower < end < upper
            is_next_inside = lower < self.position[dof] + step < upper
            other = way - math.copysign(math.pi, step * row if is_inside and not is_next_inside else way)
            is_short = abs(way) <= math.pi / 2.0 + LONGER_WAY
            is_free = lower + END_MARGIN < state.position[dof] + row * other < upper - END_MARGIN
            if not (is_short and is_inside and is_next_inside) and is_free:
                way = other
            self._ways[index], found[index] = way, angle + np.clip(way, -most, most)
        return found

    def _errors(self, state: Measured, references: Any, errors: np.ndarray, aims: np.ndarray) -> np.ndarray:
        """Return the errors of all tasks; those of vertices are given, in the world."""
        turn = Rotation.from_quat(references.orientation) * Rotation.from_quat(state.pose[3:]).inv()
        along = errors / (state.rolling @ (1.0, 1j))
        up = references.vertices[:, 2] - state.vertices[:, 2]
        found = {
            "BASE": np.concatenate((turn.as_quat(canonical=True)[:3], references.position - state.place)),
            "CONTACT_POINTS": np.concatenate((along.real, references.lifted * along.imag, references.lifted * up)),
        }
        pairs = {
            "STEERING": (aims, np.angle(state.rolling @ (1.0, 1j))),
            "CAMBER": (references.camber, state.camber),
            "CASTER": (references.caster, state.caster),
        }
        found |= {name: soft(*pair, math.pi, self._most[name]) for name, pair in pairs.items()}
        error = np.zeros(len(self._gain))
        for name, values in found.items():
            error[self._rows[name]] = values
        return error

    def _rates(self, state: Measured, references: Any, error: np.ndarray, jacobian: np.ndarray) -> np.ndarray:
        """Return the rates of all tasks: K e, bounded with a pace, and at the pace the desired ones."""
        tags, rows, rates = self._tags, self._rows, self._gain * error
        is_paced, steer = tags.is_paced, rows["STEERING"]
        if references.lifted.any():
            rates[rows["BASE"]][3:] *= 0.25
        if is_paced:
            base = np.repeat((tags.turn_correction, tags.correction), 3)
            for name, most in (("BASE", base), ("CONTACT_POINTS", tags.vertex_speed)):
                rates[rows[name]] = np.clip(rates[rows[name]], -most, most)
        turn, free = cmath.exp(1j * heading_of(state)), references.lifted
        along = turn * (references.vertex_velocity[:, :2] @ (1.0, 1j)) / (state.rolling @ (1.0, 1j))
        up, pace = references.vertex_velocity[:, 2], references.pace
        rates[rows["BASE"]] += pace * np.concatenate((references.angular, references.velocity))
        rates[rows["CONTACT_POINTS"]] += pace * np.concatenate((along.real, free * along.imag, free * up))
        with_base = pace * references.angular[2]
        rates[steer] += with_base
        if not is_paced:
            return rates
        for index, dof in enumerate(self._turning):
            row, most = steer.start + index, self._most["STEERING"]
            if abs(error[row]) < (1.0 - 1e-9) * most:
                limit = most * self._gain[row]
                rates[row] = np.clip(rates[row] + self._wheels[index].turn, -limit, limit)
            limits = np.array((self._kinematics.lower_position[dof], self._kinematics.upper_position[dof]))
            ends = jacobian[row, dof] * (limits - self.position[dof]) / self._period
            rates[row] = np.clip(rates[row], ends.min() + with_base, ends.max() + with_base)
        return rates


def heading_of(state: Measured) -> float:
    """Return the heading of the base, the twist of its quaternion about z [rad]."""
    return math.remainder(2.0 * math.atan2(state.pose[5], state.pose[6]), 2.0 * math.pi)


def soft(desired: Any, angles: Any, half: float, most: float) -> Any:
    """Return errors of angles of any number of half turns, `most` at most [rad]."""
    away = desired - angles
    return np.clip(away - half * np.floor(away / half + 0.5), -most, most)
