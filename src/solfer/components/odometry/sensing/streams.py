"""Joints and IMU as one sequence of measurements: both at one time, whenever and however their messages arrive."""

import math

import numpy as np

from solfer.components.odometry.sensing.imu_samples import CAPACITY, LONGEST_LAG, ImuSamples
from solfer.components.odometry.sensing.samples import SensorHistory, SortedSamples
from solfer.components.odometry.sensing.stamps import StampCheck
from solfer.numerics.base_chart import BaseChart
from solfer.robot import Robot

LONGEST_EXTRAPOLATION = 0.1
"""Longest time for which the base goes on with its velocity while no joints arrive [s]."""


class _JointSamples:
    """Measurements of the joints: positions, then velocities, shape (2, width) each.

    Args:
        width: Number of joints.

    Attributes:
        waiting: Those that are not taken yet.
        newest: What the State has in this cycle.
        before: The measurement that was taken last.
    """

    def __init__(self, width: int):
        self.waiting = SortedSamples(CAPACITY, 2 * width)
        self.newest = np.zeros((2, width))
        self.before = np.zeros((2, width))

    def start(self) -> None:
        """Begin without measurements."""
        self.waiting.count = 0
        self.before[:] = math.nan

    def receive(self, history: SensorHistory, check: StampCheck, begin: float, after: float) -> None:
        """Sort the messages of a cycle in that are after two times [s]; what came before the first is known."""
        waiting = self.waiting
        for index, stamp in history.accepted(check, after):
            row = waiting.insert(stamp) if stamp > begin else -1
            if row >= 0:
                waiting.rows[row] = self.newest.ravel()  # which counts where a message lacks joints
                history.copy(index, waiting.rows[row])

    def is_frozen(self, row: np.ndarray) -> bool:
        """Return whether joints that move, all positions and then all velocities, are where they were before."""
        if row.tobytes() != self.before.tobytes():  # a tenth of the time of a comparison by numpy
            return False
        return float(np.abs(row[len(row) // 2 :]).max()) > 0.05  # [rad/s]


class Streams:
    """Measurements of joints and base, each of one time, from two streams of messages.

    Each message of the joints is a measurement at its stamp. What the IMU measured then lies between its samples before
    and after; joints wait for the latter, for `LONGEST_LAG` at most. A sensor that is silent is no measurement. Where
    the State has no histories of both, what it has in each cycle is a measurement of that cycle.

    Args:
        robot: The Robot. Measurements are written into its State, one after the other.
        offset: Time by which the IMU's stamps are behind those of the joints [s].

    Attributes:
        elapsed: Time from the measurement before to this one [s].
        measured: Whether the IMU has measured the base in the meantime.
        ahead: Time from the last measurement to the newest sample of any sensor [s].
        silence: For how long neither joints nor IMU were measured before, if longer than 1 s [s]; 0 after
            a measurement of both.
        joint_stamps: Check of the joints' stamps.
    """

    def __init__(self, robot: Robot, offset: float = 0.0):
        self._robot = robot
        self._joints: SensorHistory | None = None
        self._imu: SensorHistory | None = None
        self.elapsed = self.ahead = 0.0
        self.measured = True
        self.joint_stamps = StampCheck()
        self._samples = ImuSamples(robot.kinematics.base or BaseChart(), offset, StampCheck(self.joint_stamps, offset))
        self._measurements = _JointSamples(robot.size - 6)
        self._written = np.zeros((2, 3))
        self._time = math.nan
        self._begin = math.nan
        self._waited = self._period = self._silent = self.silence = 0.0
        self._is_due = False

    @property
    def imu_stamps(self) -> StampCheck:
        """Check of the IMU's stamps."""
        return self._samples.stamps

    @property
    def synchronizes(self) -> bool:
        """Whether there are histories of both."""
        return self._joints is not None and self._imu is not None

    def start(self) -> None:
        """Begin with what the State has; pipes and their histories exist by now."""
        self._joints, self._imu = (
            SensorHistory.find(self._robot, dofs) for dofs in (range(6, self._robot.size), range(3, 6))
        )
        self._time = self._begin = math.nan
        self._waited = self.ahead = self._silent = self.silence = 0.0
        self._measurements.start()
        self.joint_stamps.start()
        self._samples.start()
        if self._joints is not None and self._imu is not None:
            self._receive(self._joints, self._imu)
            waiting = self._measurements.waiting
            if waiting.count:
                self._time = waiting.newest
            waiting.count = 0
            self._begin = self._time
        self.written()

    def read(self, passed: float) -> None:
        """Take what has arrived since the cycle before, `passed` [s] ago."""
        self._period = passed
        self._is_due = True
        state = self._robot.state
        newest = self._measurements.newest
        newest[0] = state.position[6:]
        newest[1] = state.velocity[6:]
        if self._joints is not None and self._imu is not None:
            self._waited = self._waited + passed if self._measurements.waiting.count else 0.0
            self._silent += passed
            self._receive(self._joints, self._imu)

    def next(self) -> bool:
        """Write the next measurement into the State; return whether there was one."""
        if self._joints is None or self._imu is None:
            return self._next_of_cycle()
        measurements = self._measurements
        waiting = measurements.waiting
        state = self._robot.state
        while waiting.count and measurements.is_frozen(waiting.rows[0]):
            waiting.drop(1)
        if not waiting.count:
            return False
        time = float(waiting.stamps[0])
        is_covered = self._samples.newest >= time
        if not is_covered and self._waited < LONGEST_LAG and waiting.newest - time < LONGEST_LAG:
            return False
        self.elapsed = self._period if math.isnan(self._time) else time - self._time
        self._time = time
        self._waited = 0.0
        self.measured = is_covered and self._samples.measure(time, state)
        measurements.before[:] = waiting.rows[0].reshape(2, -1)
        state.position[6:], state.velocity[6:] = measurements.before
        waiting.drop(1)
        return True

    def finish(self) -> None:
        """Write the newest joints into the State again, after the last measurement of a cycle."""
        if self._joints is None or self._imu is None or math.isnan(self._time):
            return
        state = self._robot.state
        state.position[6:], state.velocity[6:] = self._measurements.newest
        self.ahead = min(
            max(self._measurements.waiting.newest, self._samples.newest, self._time) - self._time, LONGEST_EXTRAPOLATION
        )

    def turned_since(self) -> np.ndarray | None:
        """Return how the base has turned since the last measurement, in its axes, shape (3, 3); None: not known."""
        return self._samples.turned_since(self._time)

    def written(self) -> None:
        """Note what an estimator has written into the State: only what differs from it is measured."""
        self._written[0] = self._robot.state.position[3:6]
        self._written[1] = self._robot.state.velocity[3:6]

    def _next_of_cycle(self) -> bool:
        """Take what the State has, once in a cycle."""
        if not self._is_due:
            return False
        self._is_due = False
        self._waited += self._period
        measurements = self._measurements
        if measurements.is_frozen(measurements.newest.ravel()):
            self.ahead = min(self._waited, LONGEST_EXTRAPOLATION)
            return False
        state = self._robot.state
        base = [state.position[3:6].tolist(), state.velocity[3:6].tolist()]
        measurements.before[:] = measurements.newest
        self.elapsed = self._waited
        self.measured = base != self._written.tolist()
        self._waited = self.ahead = 0.0
        return True

    def _receive(self, joints: "SensorHistory", imu: "SensorHistory") -> None:
        """Sort all messages in: joints that wait, and samples of the IMU with the integral of the rates up to each."""
        begin = -math.inf if math.isnan(self._begin) else self._begin
        after = -math.inf if math.isnan(self._time) or self._time == begin else self._time
        check = self.joint_stamps
        check.begin_cycle()
        newest = self._samples.newest
        self._measurements.receive(joints, check, begin, after=after)
        self._samples.receive(imu)
        if check.newest != check.before or self._samples.newest != newest:
            if self._silent > 1.0:  # [s] encoders may count from elsewhere, and the estimate does not go on
                self.silence = self._silent
                self._samples.forget_until(newest)
            self._silent = 0.0
