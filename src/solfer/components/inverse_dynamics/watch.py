"""What contradicts an inverse dynamics while the robot moves: torques that do not come, contacts that do not hold."""

import math

import numpy as np

from solfer.components.inverse_dynamics.ground import Ground
from solfer.numerics.blocks import BlockLayout, MemoryBlock
from solfer.numerics.compilation import cached, part
from solfer.robot import Robot

WATCH = BlockLayout(
    "Watch",
    dofs=int,
    effort_count=int,
    efforts=(int, "effort_count"),
    # torques: the commanded ones, what springs add to them, the measured ones, and both smoothed
    torque=(float, "dofs"),
    springs=(float, "dofs"),
    measured=(float, "dofs"),
    sent=(float, "dofs"),
    difference=(float, "dofs"),
    limits=(float, "dofs"),
    # contacts: computed and measured forces, which of all contacts they are, and how they move
    count=int,
    force_count=int,
    normals=(float, "count", "force_count"),
    force=(float, "force_count"),
    fractions=(float, "count"),
    unit=float,
    contact_count=int,
    wrenches=(float, "contact_count", 6),
    tracked=(int, "count"),
    missing=(float, "count"),
    starts=(int, "count + 1"),
    slip=(float, "force_count"),
    is_point=(bool, "count"),
    moved=(float, "count", 3),
)
"""What `watch` reads and writes."""

_watch_at = WATCH.at


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
        self._robot = robot
        self._ground = ground
        self._efforts = efforts.astype(np.int64)
        count = len(ground.normals)
        # [Nm] friction of wrists is more than they carry: 3 cm times the weight, or a part of what the motor can do
        kinematics = robot.kinematics
        weight = float(kinematics.mass * np.linalg.norm(robot.gravity))
        self._limits = np.minimum(0.03 * weight, 0.4 * kinematics.effort_limit)
        self._gains: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self._springs, self._part = np.zeros((2, robot.size))
        self._sent, self._difference = np.zeros((2, robot.size))
        self._moved = np.zeros((count, 3))
        self._missing = np.zeros(count)
        self._time = 0.0
        self.fault = ""

    def connect(self, force: np.ndarray, slip: np.ndarray) -> None:
        """Bind what is compared.

        Args:
            force: Forces of contacts that belong to the commands, shape (k,) [N, Nm]; live.
            slip: Velocities of the rows that contacts hold, shape (k,) [m/s, rad/s]; live.
        """
        ground = self._ground
        contacts = self._robot.contacts
        self._force = force
        self._block = MemoryBlock(
            WATCH,
            dofs=self._robot.size,
            effort_count=len(self._efforts),
            efforts=self._efforts,
            torque=self._robot.command.torque,
            springs=self._springs,
            measured=self._robot.state.torque,
            sent=self._sent,
            difference=self._difference,
            limits=self._limits,
            count=len(ground.normals),
            force_count=len(force),
            normals=ground.normals,
            force=force,
            fractions=ground.fractions,
            unit=ground.unit,
            contact_count=len(contacts.wrenches),
            wrenches=contacts.wrenches,
            tracked=np.array([contacts.names.index(name) for name in ground.names], dtype=np.int64),
            missing=self._missing,
            starts=ground.starts,
            slip=slip,
            is_point=np.array([contact.holds_a_point for contact in ground.contacts.values()], dtype=bool),
            moved=self._moved,
        )

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

    def update(self, step: float) -> None:
        """Find what is wrong, after `step` [s]; the Robot's command is that of the last cycle."""
        self._time += step
        self._add_springs()
        # commands blend in from those of before for 3 s
        found = watch(self._block.address, step, self._time > 3.0)
        if found >= 0:
            self.fault = self._text(found, self._ground.normals @ self._force)

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
def _lost(block, coefficient, is_calm):
    """Compare torques; return a DoF that has lost its own, or -1."""
    found = -1
    any_measured = False
    for dof in block.efforts:
        any_measured = any_measured or block.measured[dof] != 0.0
        block.sent[dof] += coefficient * (block.torque[dof] - block.sent[dof])
        lower = min(block.springs[dof], 0.0)
        upper = max(block.springs[dof], 0.0)
        away = block.measured[dof] - block.torque[dof]
        away -= min(max(away, lower), upper)
        block.difference[dof] += coefficient * (away - block.difference[dof])
        if abs(block.difference[dof]) > max(0.5 * abs(block.sent[dof]), block.limits[dof]) and found < 0:
            found = dof
    return found if any_measured and is_calm else -1


def _watch(start, step, is_calm):
    """See `DynamicsWatch.update`; return the number of a DoF, of a contact that slips, or of one that is absent."""
    block = _watch_at(start)
    moved = block.moved
    smoothing_time = 0.2  # [s] motors swing, and take a while
    found = _lost(block, min(step / smoothing_time, 1.0), is_calm)
    if found >= 0:
        return found
    forgetting_time = 0.5  # [s] after which the displacement of a contact does not count
    are_measured = False
    for i in range(block.count):
        for k in range(3):
            are_measured = are_measured or block.wrenches[block.tracked[i], k] != 0.0
    for i in range(block.count):
        first = block.starts[i]
        distance = 0.0
        for k in range(3 if block.is_point[i] or block.starts[i + 1] - first == 6 else 0):
            moved[i, k] += step * (block.slip[first + k] - moved[i, k] / forgetting_time)
            if block.fractions[i] < 1.0:
                moved[i, k] = 0.0
            distance += moved[i, k] ** 2
        if math.sqrt(distance) > 0.02:  # [m]
            return block.dofs + i
        pressed = 0.0
        computed = 0.0
        for k in range(3):
            pressed += block.wrenches[block.tracked[i], k] ** 2
        for k in range(block.force_count):
            computed += block.normals[i, k] * block.force[k]
        is_light = math.sqrt(pressed) < 0.05 * block.unit
        is_absent = is_light and computed > 0.3 * block.unit and block.fractions[i] == 1.0
        block.missing[i] = block.missing[i] + step if are_measured and is_absent else 0.0
        if block.missing[i] > 0.2:  # [s]
            return block.dofs + block.count + i
    return -1


watch = cached("int64(int64, float64, boolean)", _watch)
