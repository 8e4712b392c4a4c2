"""Joints and IMU as one sequence of measurements: both at one time, whenever and however their messages arrive."""

import math

import numpy as np

from solfer.components.odometry.sensing.imu_samples import CAPACITY, ImuSamples
from solfer.components.odometry.sensing.measured_base import VelocityChange
from solfer.components.odometry.sensing.samples import SensorHistory, SortedSamples
from solfer.components.odometry.sensing.samples_kernel import LONGEST_LAG
from solfer.components.odometry.sensing.stamps import StampCheck
from solfer.numerics.base_chart import BaseChart
from solfer.robot import Robot

LONGEST_EXTRAPOLATION = 0.1
"""Longest time for which the base goes on with its velocity while no joints arrive [s]."""


class SensorSilence:
    """Silence of all sensors: after a long one encoders may count from elsewhere, as those of a new robot do.

    Attributes:
        passed: Time since anything was measured [s].
        ended: Length of the long silence after which nothing has been estimated yet [s]; 0: there is none.
    """

    LONGEST_BRIDGED = 1.0
    """Longest silence over which an estimate goes on [s]."""

    def __init__(self) -> None:
        self.start()

    def start(self) -> None:
        """Begin with a measurement."""
        self.passed = self.ended = 0.0

    def end(self) -> bool:
        """Note a measurement; return whether a long silence has ended."""
        is_long = self.passed > self.LONGEST_BRIDGED
        if is_long:
            self.ended = self.passed
        self.passed = 0.0
        return is_long


class _JointSamples:
    """Measurements of the joints: positions, then velocities, shape (2, width) each.

    Args:
        width: Number of joints.

    Attributes:
        stamps: Check of their stamps.
        waiting: Those that are not taken yet.
        newest: What the State has in this cycle.
        before: The measurement that was taken last.
    """

    def __init__(self, width: int):
        self.stamps = StampCheck()
        self.waiting = SortedSamples(CAPACITY, 2 * width)
        self.newest = np.zeros((2, width))
        self.before = np.zeros((2, width))

    def start(self) -> None:
        """Begin without measurements."""
        self.stamps.start()
        self.waiting.clear()
        self.before[:] = math.nan

    def receive(self, history: SensorHistory, begin: float, after: float) -> None:
        """Sort the messages of a cycle in that are after two times [s]; what came before the first is known."""
        known = self.newest.ravel()
        values = history.history.values
        for index, stamp in history.accepted(self.stamps, after):
            if stamp > begin:
                self.waiting.insert(stamp, known, values[index], history.rows, places=history.places)

    def is_frozen(self, row: np.ndarray) -> bool:
        """Return whether joints that move, all positions and then all velocities, are where they were before."""
        if row.tobytes() != self.before.tobytes():  # a tenth of the time of a comparison by numpy
            return False
        return float(np.abs(row[len(row) // 2 :]).max()) > 0.05  # [rad/s]


class _JointsAtRest:
    """Whether joints have stayed within 0.02 rad for 0.5 s, by what their pipe receives: also while nothing reads it.

    Args:
        history: That of all joints.
        joints: Which of them count, shape (width,).
    """

    def __init__(self, history: SensorHistory, joints: np.ndarray):
        self._messages = history
        self._joints = joints
        self._still = np.full(len(joints), math.inf)
        self._since = math.nan
        self._row = np.zeros(2 * len(joints))

    def __call__(self) -> bool:
        """Return whether they rest, by the messages of this cycle."""
        history = self._messages.history
        for index in range(history.count):
            self._messages.copy(index, self._row)
            positions = self._row[: len(self._still)]
            if np.abs(positions - self._still)[self._joints].max() > 0.02:  # [rad]
                self._still[:] = positions
                self._since = float(history.arrivals[index])
        return bool(history.count and history.arrivals[history.count - 1] - self._since > 0.5)  # [s]


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
        imu: Samples of the IMU.
        silence: Of joints and IMU together.
        stamp_checks: Checks of the stamps of joints and IMU.
    """

    def __init__(self, robot: Robot, offset: float = 0.0):
        self._robot = robot
        self._histories: tuple[SensorHistory, SensorHistory] | None = None  # of joints and IMU
        self.elapsed = self.ahead = 0.0
        self.measured = True
        self.silence = SensorSilence()
        self._measurements = _JointSamples(robot.size - 6)
        imu_check = StampCheck(self._measurements.stamps, offset)
        chart = robot.kinematics.base or BaseChart()
        self.imu = ImuSamples(offset, imu_check, np.ascontiguousarray(chart.rotation))
        self.stamp_checks = self._measurements.stamps, imu_check
        self._written = np.zeros((2, 3))
        self._time = math.nan
        self._begin = math.nan
        self._waited = self._period = 0.0
        self._is_due = False

    @property
    def synchronizes(self) -> bool:
        """Whether there are histories of both."""
        return self._histories is not None

    @property
    def velocity_change(self) -> VelocityChange:
        """What the accelerometer measures; known from `start` on."""
        place = np.zeros(3) if self._histories is None else self._histories[1].history.place
        return VelocityChange(self.imu.pushed, place)

    def start(self) -> None:
        """Begin with what the State has; pipes and their histories exist by now."""
        joints = SensorHistory.find(self._robot, range(6, self._robot.size))
        imu = SensorHistory.find(self._robot, range(3, 6))
        self._histories = None if joints is None or imu is None else (joints, imu)
        self._time = self._begin = math.nan
        self._waited = self.ahead = 0.0
        self.silence.start()
        self._measurements.start()
        self.imu.start()
        if self._histories is not None:
            self._receive(*self._histories)
            waiting = self._measurements.waiting
            if waiting.count:
                self._time = waiting.newest
            waiting.clear()
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
        if self._histories is not None:
            self._waited = self._waited + passed if self._measurements.waiting.count else 0.0
            self.silence.passed += passed
            self._receive(*self._histories)

    def next(self) -> bool:
        """Write the next measurement into the State; return whether there was one."""
        if self._histories is None:
            return self._next_of_cycle()
        measurements = self._measurements
        waiting = measurements.waiting
        state = self._robot.state
        while waiting.count and measurements.is_frozen(waiting.rows[0]):
            waiting.drop(1)
        if not waiting.count:
            return False
        time = float(waiting.stamps[0])
        is_covered = self.imu.sorted.newest >= time
        if not is_covered and self._waited < LONGEST_LAG and waiting.newest - time < LONGEST_LAG:
            return False
        self.elapsed = self._period if math.isnan(self._time) else time - self._time
        self._time = time
        self._waited = 0.0
        self.measured = is_covered and self.imu.measure(time, state)
        measurements.before[:] = waiting.rows[0].reshape(2, -1)
        state.position[6:], state.velocity[6:] = measurements.before
        waiting.drop(1)
        return True

    def finish(self) -> None:
        """Write the newest joints into the State again, after the last measurement of a cycle."""
        if self._histories is None or math.isnan(self._time):
            return
        state = self._robot.state
        state.position[6:], state.velocity[6:] = self._measurements.newest
        self.ahead = min(
            max(self._measurements.waiting.newest, self.imu.sorted.newest, self._time) - self._time,
            LONGEST_EXTRAPOLATION,
        )
        self.imu.turned = self.imu.turned_since(self._time) if self.ahead else None

    def distrust(self, reason: str, legs: np.ndarray) -> bool:
        """Let the pipe of the IMU refuse it until it and legs rest; return whether there is one that can.

        Args:
            reason: Why it is wrong.
            legs: Which joints are those of legs, shape (joints,).
        """
        if self._histories is None:
            return False
        joints, imu = self._histories
        if not imu.history.contradiction:
            imu.history.contradiction = reason
            imu.history.others_rest = _JointsAtRest(joints, legs)
        return True

    def written(self) -> None:
        """Note what an estimator has written into the State, without histories: only what differs is measured."""
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

    def _receive(self, joints: SensorHistory, imu: SensorHistory) -> None:
        """Sort all messages in: joints that wait, and samples of the IMU with the integral of the rates up to each."""
        begin = -math.inf if math.isnan(self._begin) else self._begin
        after = -math.inf if math.isnan(self._time) or self._time == begin else self._time
        joint_check, imu_check = self.stamp_checks
        joint_check.before = joint_check.newest
        newest = imu_check.newest
        if joints.history.count:
            self._measurements.receive(joints, begin, after)
        if imu.history.count:
            self.imu.receive(imu)
        is_measured = joint_check.newest != joint_check.before or imu_check.newest != newest
        if is_measured and self.silence.end():
            self.imu.forget_until(newest)
