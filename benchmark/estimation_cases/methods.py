"""Plugins of estimators, fed with measurements on a bus in virtual time."""

import math
import re
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from estimation_cases.figures import normalised
from estimation_cases.log import PERIOD, ROBOT
from estimation_cases.measurements import Sample

from solfer.config import load
from solfer.middleware.memory import Bus, FaultsRecord, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation.bundle import load_bundle
from solfer.transport.messages import ImuMessage, JointMessage

CONFIG = ROBOT.parents[1]
OWN = ("filter", "geometric")
JOINTS, IMU = "sensor_msgs/JointState", "sensor_msgs/Imu"
BEFORE, AFTER = 0.003, 0.001
"""Time from a measurement to the cycles that work on it, and from these on in which nothing else happens [s]."""
GYROSCOPE, BIAS, WALK = 9e-5, 5e-3, 1e-6  # [rad/s/sqrt(Hz)], [rad/s], [rad/s/sqrt(s)]
RADIUS, TILT = 0.003 / math.sqrt(3.0), 0.3  # share, [deg]


class Plugins:
    """The methods of `odometry` and `ground_forces`, as plugins on a bus whose clock is that of the measurements.

    They begin once both sensors have measured, and work 3 ms after each measurement.

    Args:
        folder: Where their configuration is written.
        names: Methods of `odometry`; `ground_forces` works on the base of the first one.
        radii: Radii of the wheels that they believe, shape (4,) [m].
        noise: Factor of the errors, which the tags of the filter set.
        faults: What goes wrong between the sensors and them; None: nothing.

    Attributes:
        contacts: File of the contacts, with these radii.
        plugins: The plugins by their methods; empty before they begin.
        costs: Times of the cycles of each method [s].
    """

    def __init__(
        self, folder: Path, names: tuple[str, ...], radii: np.ndarray, noise: float, faults: FaultsRecord | None = None
    ):
        self._bus = Bus(parameters(), faults)
        robot = MemoryMiddleware(self._bus, "robot")
        self._joints = robot.writer("joint_states", JOINTS)
        self._imu = robot.writer("imu", IMU)
        self._file, self.contacts = configuration(folder, names, radii, noise), folder / "contacts.yaml"
        self._names, self._forces, self._sample = names, None, None
        self.plugins: dict[str, Plugin] = {}
        self.costs: dict[str, list[float]] = {}

    def publish(self, sample: Sample) -> None:
        """Publish what has been measured, and go on to the time at which the plugins work on it."""
        bus = self._bus
        bus.run_until(sample.time - BEFORE)
        self._joints.write(sample.joints)
        self._imu.write(sample.imu)
        self._sample = sample
        bus.run_until(sample.time)

    @property
    def running(self) -> bool:
        """Whether all methods of `odometry` have begun."""
        return all(plugin.running for plugin in self.plugins.values())

    @property
    def received(self) -> Sample | None:
        """The newest sample with the measurements that have arrived; None: one of the sensors has not measured yet."""
        joints, imu = (self._bus.topic(*each).newest for each in (("joint_states", JOINTS), ("imu", IMU)))
        return None if joints is None or imu is None else self._sample._replace(joints=joints, imu=imu)

    def begin(self) -> None:
        """Make the plugins, which work from now on."""
        for name in self._names:
            self.plugins[name] = plugin_on(self._bus, self._file, f"odometry_{name}")
            self.loop(name, self.plugins[name].cycle)
        self._forces = plugin_on(self._bus, self._file, "ground_forces", "ground_forces")
        self._bus.every(PERIOD, self._forces.cycle, self._sample.time, cycles=True)

    def check(self, faults: FaultsRecord) -> None:
        """Check that faults are of topics that there are, once the plugins have begun.

        Raises:
            UnknownName: Nobody publishes or receives one of them. SolferErrors: Several of them.
        """
        self._bus.faults = faults
        self._bus.check_faults()

    def loop(self, name: str, cycle: Callable[[], None]) -> None:
        """Let a method work on each measurement from now on, after those that do so already."""
        costs = self.costs[name] = []

        def timed() -> None:
            begun = time.thread_time()  # the machine may be busy with others
            cycle()
            costs.append(time.thread_time() - begun)

        self._bus.every(PERIOD, timed, self._sample.time, cycles=True)

    def cycle(self) -> None:
        """Let all methods work on what has arrived."""
        self._bus.run_until(self._sample.time + AFTER)

    def pose(self, name: str) -> np.ndarray:
        """Return x, y, z and heading, shape (4,) [m, rad]."""
        law = self.plugins[name].component.law
        return np.append(law.position, law.heading)

    @property
    def forces(self) -> np.ndarray:
        """Forces of the ground on the wheels along the vertical, as `ground_forces` knows them, shape (4,) [N]."""
        return np.array([contact.force[2] for contact in self._forces.component.contacts])

    @property
    def touching(self) -> np.ndarray:
        """Which wheels touch the ground, as `ground_forces` knows it, shape (4,)."""
        return np.asarray(self._forces.component.touch.touching) > 0.5

    @property
    def weight(self) -> float:
        """Weight of the robot [N]."""
        return 9.81 * self._forces.robot.kinematics.mass

    def honesty(self, sample: Sample) -> tuple[float, float]:
        """Return squared errors of tilt and velocity of the filter by their covariances, for each dimension."""
        plugin, truth = self.plugins["filter"], sample.truth
        pose, twist = np.zeros((2, 6, 6))
        plugin.component.law.write_covariance(pose, twist)
        estimate = plugin.robot.kinematics.base.to_rotation(plugin.robot.state.position[:6])
        # headings differ: only what the vertical is to the base counts
        difference = estimate @ (estimate[2] - truth.rotation[2])
        tilt = np.array((-difference[1], difference[0]))
        true = truth.rotation
        cosine, sine = (function(math.atan2(true[1, 0], true[0, 0])) for function in (math.cos, math.sin))
        x, y, z = truth.velocity[:3]
        velocity = plugin.component.law.velocity - (cosine * x + sine * y, cosine * y - sine * x, z)
        return (
            normalised(tilt, pose[3:5, 3:5]),
            normalised(velocity, twist[:3, :3] + 1e-12 * np.eye(3)),
        )

    def covariance(self) -> np.ndarray:
        """Return the covariance of x, y, z and heading of the filter, shape (4, 4)."""
        return np.array(self.plugins["filter"].component.law.kalman.covariance[:4, :4])


def require_topics(faults: FaultsRecord) -> None:
    """Check that faults are of topics of these plugins; raises what `Plugins.check` does."""
    names = tuple(load_bundle(ROBOT / "robot.yaml").kinematics.dofs[6:])
    joints = JointMessage(names, *np.zeros((3, len(names))))
    with tempfile.TemporaryDirectory() as folder:
        made = Plugins(Path(folder), OWN, np.full(4, 0.078), 1.0)
        made.publish(Sample(1.0, joints, ImuMessage("imu_link"), None, np.zeros((4, 3))))
        made.begin()
        made.check(faults)


def parameters() -> dict[str, str]:
    """Return the parameters of CENTAURO with its parts."""
    text = (ROBOT / "centauro.urdf").read_text()
    description = Description.from_text(text)
    parts = {f"/robot_{part}_body": cut(description, "torso_2", part) for part in ("lower", "upper")}
    srdf = (ROBOT / "centauro.srdf").read_text()
    return {"/robot_description": text, "/robot_semantic_description": srdf, **parts}


def plugin_on(bus: Bus, file: Path, name: str, plugin: str = "odometry3") -> Plugin:
    """Make the plugin of a configuration's entry `name` on a bus."""
    return generate(load(file, name), MemoryMiddleware(bus, name), Registry().find(plugin))


def configuration(folder: Path, names: tuple[str, ...], radii: np.ndarray, noise: float) -> Path:
    """Write the shipped configuration with an odometry for each method and radii of the wheels [m]; return its file."""
    text = re.sub(r"file: (support|robots)/", rf"file: {CONFIG}/\1/", (CONFIG / "centauro.yaml").read_text())
    contacts = folder / "contacts.yaml"
    contacts.write_text(_contacts(radii))
    text = text.replace(f"{ROBOT}/contacts.yaml", str(contacts))
    factor = max(noise, 1e-3)
    tags = {
        "gyro_noise": factor * GYROSCOPE,
        "gyro_bias": factor * BIAS,
        "gyro_walk": factor * WALK,
        "radius_share": factor * RADIUS,
        "tilt_deviation": factor * TILT,
    }
    for method in names:
        output = "[odometry]" if method == names[0] else "empty"
        text += f"""
    odometry_{method}:
      class: solfer.components.odometry:Odometry
      layer: NRT
      robot: odometry
      controller: {output}
      secondary_file: {{file: {CONFIG}/support/odometry.yaml}}
      mode: full
      kinematics: true
      dynamics: false
      model_change: true
      chain: wheels
      method: {method}
"""
        text += "".join(f"      {tag}: {value:.9f}\n" for tag, value in tags.items())
    path = folder / "main.yaml"
    path.write_text(text)
    return path


def _contacts(radii: np.ndarray) -> str:
    """Return the shipped contacts with other radii of the wheels, shape (4,) [m]."""
    left = iter(radii.tolist())

    def wheel(found: re.Match) -> str:
        radius = next(left)
        made = re.sub(r"offset: \[.*\]", f"offset: [0.0, 0.0, {-radius:.9f}]", found[0])
        return re.sub(r"minor_axis: .*", f"minor_axis: {radius - 0.01:.9f}", made)

    pattern = r"end_frame: wheel_\d(?:\n(?!    contact).*)*?minor_axis: .*"
    return re.sub(pattern, wheel, (ROBOT / "contacts.yaml").read_text())
