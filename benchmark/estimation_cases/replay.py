"""Replays measurements of a log to `odometry` over a transport with faults, each sensor at a rate of its own."""

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from estimation_cases.figures import from_start
from estimation_cases.log import PERIOD, Log
from estimation_cases.measurements import Measurements
from estimation_cases.methods import IMU, JOINTS, OWN, configuration, parameters, plugin_on

from solfer.middleware.memory import Bus, FaultsRecord, MemoryMiddleware
from solfer.transport.messages import ImuMessage, JointMessage

ROW = 0.001
"""Time from a row of a log to the next that is replayed [s]."""
JOINT_ROWS, IMU_ROWS = 5, 2
"""Rows from a message to the next: 200 Hz and 500 Hz."""
PHASE = 0.003
"""Time from a message of the joints to the cycle that works on it [s]."""


class Recorded(NamedTuple):
    """What sensors measured of a log.

    Attributes:
        begin: Time of its first row that counts [s].
        joints, imu: Messages.
        delay: Time from a measurement to its message [s].
        truth: Poses x y z heading of the base at each row that counts, shape (T, 4) [m, rad].
        radii: Radii of the wheels that are believed, shape (4,) [m].
        noise: Factor of the errors.
    """

    begin: float
    joints: Sequence[JointMessage]
    imu: Sequence[ImuMessage]
    delay: float
    truth: np.ndarray
    radii: np.ndarray
    noise: float


class Result(NamedTuple):
    """How far a method went astray.

    Attributes:
        heading: Error of the heading at the end [degrees].
        position: Error of the position at the end [% of the way].
        estimates: Poses x y z heading as seen from the first one, each `PERIOD`, shape (T, 4) [m, rad].
        truth: The same as they are.
    """

    heading: float
    position: float
    estimates: np.ndarray
    truth: np.ndarray


def measure(log: Log, seed: int, noise: float, begin: float) -> Recorded:
    """Measure a log with rows of 1 ms, with errors of a seed times a factor, for estimators that begin at a time [s].

    Sensors measure from the beginning of the log on, because the errors of the IMU have a history.
    """
    measurements = Measurements(log, seed, noise, IMU_ROWS * ROW)
    joints, imu, truth = [], [], []
    for row, time in enumerate(log.time.tolist()):
        is_joint, is_imu, counts = row % JOINT_ROWS == 0, row % IMU_ROWS == 0, time >= begin - 0.5 * ROW
        if is_joint or is_imu or counts:
            measurements.look(row)
        if is_imu:
            imu.append(measurements.imu())
        if is_joint:
            joints.append(measurements.joints())
        if counts:
            true = measurements.truth()
            truth.append(np.append(true.position, math.atan2(true.rotation[1, 0], true.rotation[0, 0])))
    delay = 0.002 if noise else 0.0
    kept = ([each for each in messages if each.stamp >= begin - 0.5 * ROW] for messages in (joints, imu))
    return Recorded(begin, *kept, delay, np.array(truth), measurements.radii, noise)


class _Sensor:
    """Writes messages when they are due.

    Args:
        bus: The bus.
        topic: The topic.
        message: Canonical name of its messages.
        messages: The messages.
        delay: Time from the stamp of a message until it is sent [s].
    """

    def __init__(self, bus: Bus, topic: str, message: str, messages: Sequence, delay: float):
        self._writer = MemoryMiddleware(bus, topic).writer(topic, message)
        self._bus, self._messages, self._delay, self._next = bus, messages, delay, 0

    def send(self) -> None:
        """Send what is due."""
        while self._next < len(self._messages):
            message = self._messages[self._next]
            if message.stamp + self._delay > self._bus.time + 0.1 * ROW:
                return
            self._writer.write(message)
            self._next += 1


def replay(recorded: Recorded, faults: FaultsRecord, methods: tuple[str, ...] = OWN) -> dict[str, Result]:
    """Let methods of `odometry` work on what sensors measured, over a transport with faults.

    Raises:
        UnknownName: The faults are of a topic that nobody publishes or receives. SolferErrors: Of several.
    """
    bus = Bus(parameters(), faults)
    bus.time = recorded.begin
    for topic, message, messages in (("joint_states", JOINTS, recorded.joints), ("imu", IMU, recorded.imu)):
        bus.every(ROW, _Sensor(bus, topic, message, messages, recorded.delay).send)
    estimates: dict[str, list[np.ndarray]] = {name: [] for name in methods}
    with tempfile.TemporaryDirectory() as folder:
        file = configuration(Path(folder), methods, recorded.radii, recorded.noise)
        # time passes where the first messages are late
        plugins = {name: plugin_on(bus, file, f"odometry_{name}") for name in methods}
    bus.check_faults()
    start = recorded.begin + PERIOD * math.ceil((bus.time - recorded.begin) / PERIOD) + PHASE
    for plugin in plugins.values():
        bus.every(PERIOD, plugin.cycle, start, cycles=True)

    def look() -> None:
        for name, poses in estimates.items():
            law = plugins[name].component.law
            if poses or plugins[name].running:
                poses.append(np.append(law.position, law.heading))

    bus.every(PERIOD, look, start)
    bus.run_until(recorded.begin + ROW * (len(recorded.truth) - 0.5))
    truth = recorded.truth[round((start - recorded.begin) / ROW) :: round(PERIOD / ROW)]
    return {name: _result(truth, np.array(poses)) for name, poses in estimates.items()}


def _result(truth: np.ndarray, estimates: np.ndarray) -> Result:
    """Compare poses x y z heading, shape (T, 4) [m, rad], each seen from its first one."""
    truth, estimates = from_start(truth[-len(estimates) :]), from_start(estimates)
    error = estimates[-1] - truth[-1]
    way = np.linalg.norm(np.diff(truth[:, :2], axis=0), axis=1).sum()
    return Result(math.degrees(error[3]), 100.0 * float(np.linalg.norm(error[:2])) / float(way), estimates, truth)
