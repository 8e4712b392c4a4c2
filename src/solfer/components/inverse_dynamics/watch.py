"""What contradicts an inverse dynamics while the robot moves: torques that do not come, contacts that do not hold."""

import math

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.numerics.compilation import cached, part
from solfer.robot import Robot


class DynamicsWatch:
    """Compares what is measured with what the QP takes for granted.

    Joints without a measured torque, and contacts without a measured force, are not compared; where a contact moves is
    seen by the measured joints and base. A torque is right anywhere between the commanded one and what springs and
    dampers of the lower level add to it: how they are computed is not known here.

    Args:
        robot: The Robot.
        ground: Its contacts.
        efforts: DoFs that are moved by efforts, shape (m,).

    Attributes:
        fault: What was found wrong; empty: nothing.
    """

    def __init__(self, robot: Robot, ground: Ground, efforts: np.ndarray):
        self._robot, self._ground, self._efforts = robot, ground, efforts.astype(np.int64)
        count = len(ground.normals)
        # [Nm] friction of wrists is more than they carry: 3 cm times the weight
        self._limit = 0.03 * float(robot.kinematics.mass * np.linalg.norm(robot.gravity))
        contacts = robot.contacts
        self._tracked = np.array([contacts.names.index(name) for name in ground.names], dtype=np.int64)
        self._gains: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._springs, self._part = np.zeros((2, robot.size))
        self._sent, self._difference = np.zeros((2, robot.size))
        self._moved = np.zeros((count, 3))
        self._missing = np.zeros(count)
        self._is_point = np.array([contact.holds_a_point for contact in ground.contacts.values()], dtype=bool)
        self._time = 0.0
        self.fault = ""

    def start(self) -> None:
        """Begin with a robot of which nothing is known."""
        for numbers in (self._sent, self._difference, self._moved, self._missing):
            numbers[:] = 0.0
        self._time = 0.0
        self.fault = ""
        state = self._robot.state
        command = self._robot.command
        self._gains = [
            (command[gain], desired, measured)
            for gain, desired, measured in (
                ("stiffness", command.position, state.position),
                ("damping", command.velocity, state.velocity),
            )
            if gain in command
        ]

    def update(self, step: float, force: np.ndarray, slip: np.ndarray) -> None:
        """Find what is wrong; the Robot's command is that of the last cycle.

        Args:
            step: Time since the last cycle [s].
            force: Forces of contacts that belong to them, shape (k,) [N, Nm].
            slip: Velocities of the rows that contacts hold, shape (k,) [m/s, rad/s].
        """
        robot = self._robot
        ground = self._ground
        self._time += step
        self._add_springs()
        found = watch(
            step,
            self._time > 3.0,  # [s] in which commands blend in from those of before
            robot.command.torque,
            self._springs,
            robot.state.torque,
            self._efforts,
            self._limit,
            self._sent,
            self._difference,
            ground.normals,
            force,
            ground.fractions,
            ground.unit,
            robot.contacts.wrenches,
            self._tracked,
            self._missing,
            ground.starts,
            slip,
            self._is_point,
            self._moved,
        )
        if found >= 0:
            self.fault = self._text(found, ground.normals @ force)

    def _add_springs(self) -> None:
        """Write the torques of the last command's springs and dampers at the measured state."""
        self._springs[:] = 0.0
        for gain, desired, measured in self._gains:
            np.subtract(desired, measured, out=self._part)
            self._part *= gain
            self._springs += self._part

    def _text(self, found: int, forces: np.ndarray) -> str:
        """Return what has been found, by its number."""
        size = self._robot.size
        names = self._ground.names
        if found < size:
            sent = self._sent[found]
            gone = self._sent[found] + self._difference[found]
            return f"joint '{self._robot.dofs[found]}' has a torque of {gone:.1f} Nm instead of {sent:.1f} Nm"
        index = found - size
        if index < len(names):
            distance = float(np.linalg.norm(self._moved[index]))
            return f"contact '{names[index]}' slips: it has moved by {100.0 * distance:.1f} cm"
        index -= len(names)
        return f"contact '{names[index]}' touches nothing, and is to carry {forces[index]:.0f} N"


@part
def _lost(coefficient, torque, springs, measured, efforts, limit, sent, difference, is_calm):
    """Compare torques; return a DoF that has lost its own, or -1."""
    found = -1
    any_measured = False
    for dof in efforts:
        any_measured = any_measured or measured[dof] != 0.0
        sent[dof] += coefficient * (torque[dof] - sent[dof])
        lower = min(springs[dof], 0.0)
        upper = max(springs[dof], 0.0)
        away = measured[dof] - torque[dof]
        away -= min(max(away, lower), upper)
        difference[dof] += coefficient * (away - difference[dof])
        if abs(difference[dof]) > max(0.5 * abs(sent[dof]), limit) and found < 0:
            found = dof
    return found if any_measured and is_calm else -1


def _watch(
    step,
    is_calm,
    torque,
    springs,
    measured,
    efforts,
    limit,
    sent,
    difference,
    normals,
    force,
    fractions,
    unit,
    wrenches,
    tracked,
    missing,
    starts,
    slip,
    is_point,
    moved,
):
    """See `DynamicsWatch.update`; return the number of a DoF, of a contact that slips, or of one that is absent."""
    size = len(torque)
    count = len(tracked)
    smoothing_time = 0.2  # [s] motors swing, and take a while
    found = _lost(min(step / smoothing_time, 1.0), torque, springs, measured, efforts, limit, sent, difference, is_calm)
    if found >= 0:
        return found
    forgetting_time = 0.5  # [s] after which the displacement of a contact does not count
    are_measured = False
    for i in range(count):
        for k in range(3):
            are_measured = are_measured or wrenches[tracked[i], k] != 0.0
    for i in range(count):
        distance = 0.0
        for k in range(3 if is_point[i] or starts[i + 1] - starts[i] == 6 else 0):
            moved[i, k] += step * (slip[starts[i] + k] - moved[i, k] / forgetting_time)
            if fractions[i] < 1.0:
                moved[i, k] = 0.0
            distance += moved[i, k] ** 2
        if math.sqrt(distance) > 0.02:  # [m]
            return size + i
        pressed = 0.0
        computed = 0.0
        for k in range(3):
            pressed += wrenches[tracked[i], k] ** 2
        for k in range(len(force)):
            computed += normals[i, k] * force[k]
        is_absent = math.sqrt(pressed) < 0.05 * unit and computed > 0.3 * unit and fractions[i] == 1.0
        missing[i] = missing[i] + step if are_measured and is_absent else 0.0
        if missing[i] > 0.2:  # [s]
            return size + count + i
    return -1


_ROWS = "float64[:, ::1]"
_ROW = "float64[::1]"
_INDICES = "int64[::1]"
watch = cached(
    f"int64(float64, boolean, {_ROW}, {_ROW}, {_ROW}, {_INDICES}, float64, {_ROW}, {_ROW}, {_ROWS}, {_ROW}, {_ROW}, "
    f"float64, {_ROWS}, {_INDICES}, {_ROW}, {_INDICES}, {_ROW}, boolean[::1], {_ROWS})",
    _watch,
)
