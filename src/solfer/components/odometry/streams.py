"""Joints and IMU as one sequence of measurements: both at one time, whenever and however their messages arrive."""

import math
from collections.abc import Iterator

import numpy as np

from solfer.components.odometry.samples import SortedSamples
from solfer.components.odometry.stamps import StampCheck
from solfer.model.history import History
from solfer.numerics.base_chart import BaseChart
from solfer.robot import Robot

LAG = 0.03
"""Longest time for which joints wait for what the IMU measures at their time [s]."""

KEPT = 0.1
"""Time for which samples of the IMU are kept, for others that come late [s]."""

AHEAD = 0.1
"""Longest time for which the base goes on with its velocity while no joints arrive [s]."""

MOVING = 0.05
"""Speed above which joints that stay where they were measure nothing: they are frozen [rad/s]."""

CAPACITY = 256
"""Samples that are kept of each sensor: half a second of an IMU at 500 Hz."""

ANGLES, RATES, TURNED = slice(0, 3), slice(3, 6), slice(6, 9)
"""Numbers of a sample of the IMU: angles of the base, their rates, and the integral of the rates."""


class Streams:
    """Measurements of joints and base, each of one time, from two streams of messages.

    Each message of the joints is a measurement at its stamp. What the IMU measured then lies between its samples before
    and after; joints wait for the latter, for `LAG` at most. A sensor that is silent is no measurement. Where the State
    has no histories of both, what it has in each cycle is a measurement of that cycle.

    Args:
        robot: The Robot. Measurements are written into its State, one after the other.
        offset: Time by which the IMU's stamps are behind those of the joints [s].

    Attributes:
        elapsed: Time from the measurement before to this one [s].
        measured: Whether the IMU has measured the base in the meantime.
        ahead: Time from the last measurement to the newest sample of any sensor [s].
        joint_stamps: Check of the joints' stamps.
        imu_stamps: Check of the IMU's stamps.
    """

    def __init__(self, robot: Robot, offset: float = 0.0):
        self._robot = robot
        self._state = robot.state
        self._offset = offset
        self._chart = robot.kinematics.base or BaseChart()
        self._joints: SensorHistory | None = None
        self._imu: SensorHistory | None = None
        self.elapsed = self.ahead = 0.0
        self.measured = True
        self.joint_stamps = StampCheck()
        self.imu_stamps = StampCheck(self.joint_stamps, offset)
        width = robot.size - 6
        self._waiting, self._samples = SortedSamples(CAPACITY, 2 * width), SortedSamples(CAPACITY, 9)
        self._newest, self._before = np.zeros((2, 2, width))
        self._written = np.zeros((2, 3))
        self._turned = np.zeros(3)
        self._angles, self._angles_before = np.zeros((2, 3))
        self._base = np.zeros(6)
        self._time = self._measured_at = math.nan
        self._begin = math.nan
        self._waited = self._period = 0.0
        self._is_due = False

    @property
    def synchronizes(self) -> bool:
        """Whether there are histories of both."""
        return self._joints is not None and self._imu is not None

    def start(self) -> None:
        """Begin with what the State has; pipes and their histories exist by now."""
        self._joints, self._imu = (
            SensorHistory.find(self._robot, dofs) for dofs in (range(6, self._robot.size), range(3, 6))
        )
        self._waiting.count = self._samples.count = 0
        self._time = self._measured_at = self._begin = math.nan
        self._waited = self.ahead = 0.0
        self._before[:] = math.nan
        self.joint_stamps.start()
        self.imu_stamps.start()
        if self._joints is not None and self._imu is not None:
            self._receive(self._joints, self._imu)
            if self._waiting.count:
                self._time = self._waiting.newest
            self._waiting.count = 0
            self._begin = self._time
        self.written()

    def read(self, passed: float) -> None:
        """Take what has arrived since the cycle before, `passed` [s] ago."""
        self._period = passed
        self._is_due = True
        self._newest[0] = self._state.position[6:]
        self._newest[1] = self._state.velocity[6:]
        if self._joints is not None and self._imu is not None:
            self._waited = self._waited + passed if self._waiting.count else 0.0
            self._receive(self._joints, self._imu)

    def next(self) -> bool:
        """Write the next measurement into the State; return whether there was one."""
        if self._joints is None or self._imu is None:
            return self._next_of_cycle()
        waiting = self._waiting
        samples = self._samples
        state = self._state
        while waiting.count and self._is_frozen(waiting.rows[0]):
            waiting.drop(1)
        if not waiting.count:
            return False
        time = float(waiting.stamps[0])
        is_covered = samples.newest >= time
        if not is_covered and self._waited < LAG and waiting.newest - time < LAG:
            return False
        self.elapsed = self._period if math.isnan(self._time) else time - self._time
        self._time = time
        self._waited = 0.0
        self.measured = is_covered and self._measure(time)
        self._before[:] = waiting.rows[0].reshape(2, -1)
        state.position[6:], state.velocity[6:] = self._before
        waiting.drop(1)
        return True

    def finish(self) -> None:
        """Write the newest joints into the State again, after the last measurement of a cycle."""
        if self._joints is None or self._imu is None or math.isnan(self._time):
            return
        self._state.position[6:], self._state.velocity[6:] = self._newest
        self.ahead = min(max(self._waiting.newest, self._samples.newest, self._time) - self._time, AHEAD)

    def turned_since(self) -> np.ndarray | None:
        """Return how the base has turned since the last measurement, in its axes, shape (3, 3); None: not known."""
        samples = self._samples
        base = self._base
        if self._measured_at != self._time or not samples.newest > self._time:
            return None
        base[3:] = self._angles
        before = self._chart.to_rotation(base)
        base[3:] = samples.rows[samples.count - 1, ANGLES]
        return before.T @ self._chart.to_rotation(base)

    def written(self) -> None:
        """Note what an estimator has written into the State: only what differs from it is measured."""
        self._written[0] = self._state.position[3:6]
        self._written[1] = self._state.velocity[3:6]

    def _next_of_cycle(self) -> bool:
        """Take what the State has, once in a cycle."""
        if not self._is_due:
            return False
        self._is_due = False
        self._waited += self._period
        if self._is_frozen(self._newest.ravel()):
            self.ahead = min(self._waited, AHEAD)
            return False
        base = [self._state.position[3:6].tolist(), self._state.velocity[3:6].tolist()]
        self._before[:] = self._newest
        self.elapsed = self._waited
        self.measured = base != self._written.tolist()
        self._waited = self.ahead = 0.0
        return True

    def _is_frozen(self, row: np.ndarray) -> bool:
        """Return whether joints that move, all positions and then all velocities, are where they were before."""
        if row.tobytes() != self._before.tobytes():  # a tenth of the time of a comparison by numpy
            return False
        return float(np.abs(row[len(row) // 2 :]).max()) > MOVING

    def _receive(self, joints: "SensorHistory", imu: "SensorHistory") -> None:
        """Sort all messages in: joints that wait, and samples of the IMU with the integral of the rates up to each."""
        waiting = self._waiting
        samples = self._samples
        begin = -math.inf if math.isnan(self._begin) else self._begin
        after = -math.inf if math.isnan(self._time) or self._time == begin else self._time
        self.joint_stamps.begin_cycle()
        for index, stamp in joints.accepted(self.joint_stamps, after):
            row = waiting.insert(stamp) if stamp > begin else -1  # what came before the start is known
            if row >= 0:
                waiting.rows[row] = self._newest.ravel()  # which counts where a message lacks joints
                joints.copy(index, waiting.rows[row])
        for index, stamp in imu.accepted(self.imu_stamps, -math.inf):
            row = samples.insert(stamp + self._offset)
            if row < 0:
                continue
            imu.copy(index, samples.rows[row, :6])
            for later in range(max(row, 1), samples.count):
                samples.rows[later, TURNED] = self._turned_at(later - 1, later, 1.0)

    def _measure(self, time: float) -> bool:
        """Write the base's angles at a time [s], and the mean of their rates since they were measured the last time.

        Returns:
            Whether a sample of the IMU is at that time, or samples are on both sides of it.
        """
        samples = self._samples
        state = self._state
        after = int(np.searchsorted(samples.stamps[: samples.count], time))
        before = after if samples.stamps[after] == time else after - 1
        if before < 0:
            return False
        first = samples.rows[before]
        second = samples.rows[after]
        span = float(samples.stamps[after] - samples.stamps[before])
        share = (time - float(samples.stamps[before])) / span if span else 0.0
        self._angles_before[:] = self._angles
        for axis in range(3):
            turn = math.remainder(second[axis] - first[axis], 2.0 * math.pi)
            self._angles[axis] = first[axis] + share * turn
        state.position[3:6] = self._angles
        turned = self._turned_at(before, after, share)
        passed = time - self._measured_at
        if not passed > 0.0:
            state.velocity[3:6] = first[RATES]
        elif samples.stamps[0] <= self._measured_at:
            state.velocity[3:6] = (turned - self._turned) / passed
        else:  # the samples since then are gone, but for their angles
            turned_by = self._angles - self._angles_before
            state.velocity[3:6] = (turned_by - 2.0 * math.pi * np.round(turned_by / (2.0 * math.pi))) / passed
        self._turned[:] = turned
        self._measured_at = time
        samples.drop(max(0, int(np.searchsorted(samples.stamps[: samples.count], time - KEPT)) - 1))
        return True

    def _turned_at(self, before: int, after: int, share: float) -> np.ndarray:
        """Return the integral of the rates at a share of the time from one sample to the next, shape (3,) [rad]."""
        samples = self._samples
        first = samples.rows[before]
        second = samples.rows[after]
        span = samples.stamps[after] - samples.stamps[before]
        if span > LAG:  # too long for rates: angles do not drift in it
            turn = second[ANGLES] - first[ANGLES]
            return first[TURNED] + share * (turn - 2.0 * math.pi * np.round(turn / (2.0 * math.pi)))
        return first[TURNED] + share * span * (first[RATES] + 0.5 * share * (second[RATES] - first[RATES]))


class SensorHistory:
    """A history of positions and velocities of certain DoFs, in their order.

    Args:
        history: The history.
        first: The first of these DoFs, which follow each other.
    """

    def __init__(self, history: History, first: int):
        places = history.dofs - first
        self.history = history
        self._places = (places, len(places) + places)
        self._rows = [history.interfaces.index(name) for name in ("position", "velocity")]

    @classmethod
    def find(cls, robot: Robot, dofs: range) -> "SensorHistory | None":
        """Find the history of all DoFs of a range; None: no pipe has one."""
        for history in robot.state.histories:
            if {"position", "velocity"} <= set(history.interfaces) and sorted(history.dofs.tolist()) == list(dofs):
                return cls(history, dofs.start)
        return None

    def accepted(self, check: StampCheck, after: float) -> Iterator[tuple[int, float]]:
        """Iterate over the rows of this cycle whose stamps pass a check and are after a time [s]: row and stamp [s]."""
        history = self.history
        for index in range(history.count):
            stamp = round(float(history.stamps[index]), 6)  # whatever a transport has rounded: they are alike then
            if check.accepts(stamp, float(history.arrivals[index]), after, history.sender):
                yield index, stamp

    def copy(self, index: int, out: np.ndarray) -> None:
        """Copy a row: all positions, then all velocities; what it lacks stays as it is."""
        for row, places in zip(self._rows, self._places, strict=True):
            values = self.history.values[index, row]
            if math.isnan(values.sum()):
                known = ~np.isnan(values)
                out[places[known]] = values[known]
            else:
                out[places] = values
