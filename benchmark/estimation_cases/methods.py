"""Plugins of estimators, fed with measurements on a bus; they are cycled one after the other."""

import math
import re
import time
from pathlib import Path

import numpy as np
from estimation_cases.log import ROBOT
from estimation_cases.measurements import Sample

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, Registry, generate

CONFIG = ROBOT.parents[1]
OWN = ("filter", "geometric")
GYROSCOPE, BIAS, WALK = 9e-5, 5e-3, 1e-6  # [rad/s/sqrt(Hz)], [rad/s], [rad/s/sqrt(s)]
RADIUS, TILT = 0.003 / math.sqrt(3.0), 0.3  # share, [deg]


class Plugins:
    """The methods of `odometry` and `ground_forces`, as plugins.

    Args:
        folder: Where their configuration is written.
        names: Methods of `odometry`; `ground_forces` works on the base of the first one.
        radii: Radii of the wheels that they believe, shape (4,) [m].
        noise: Factor of the errors, which the tags of the filter tell it.
        sample: The first cycle.

    Attributes:
        contacts: File of the contacts, with these radii.
        costs: Times of the cycles of each method [s].
    """

    def __init__(self, folder: Path, names: tuple[str, ...], radii: np.ndarray, noise: float, sample: Sample):
        text = (ROBOT / "centauro.urdf").read_text()
        description = Description.from_text(text)
        parts = {f"/robot_{part}_body": cut(description, "torso_2", part) for part in ("lower", "upper")}
        srdf = (ROBOT / "centauro.srdf").read_text()
        self._bus = Bus({"/robot_description": text, "/robot_semantic_description": srdf, **parts})
        robot = MemoryMiddleware(self._bus, "robot")
        self._joints = robot.writer("joint_states", "sensor_msgs/JointState")
        self._imu = robot.writer("imu", "sensor_msgs/Imu")
        self._publish(sample)
        file, self.contacts = configuration(folder, names, radii, noise), folder / "contacts.yaml"
        self.plugins = {name: self._plugin(file, f"odometry_{name}", "odometry3") for name in names}
        self.costs: dict[str, list[float]] = {name: [] for name in names}
        self._forces = self._plugin(file, "ground_forces", "ground_forces")

    def _plugin(self, file: Path, name: str, plugin: str) -> Plugin:
        return generate(load(file, name), MemoryMiddleware(self._bus, name), Registry().find(plugin))

    def _publish(self, sample: Sample) -> None:
        self._bus.time = sample.time - 0.003
        self._joints.write(sample.joints)
        self._imu.write(sample.imu)
        self._bus.time = sample.time

    def cycle(self, sample: Sample) -> None:
        """Let all plugins work on what has been measured."""
        self._publish(sample)
        for name, plugin in self.plugins.items():
            begun = time.thread_time()  # the machine may be busy with others
            plugin.cycle()
            self.costs[name].append(time.thread_time() - begun)
        self._forces.cycle()

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
        told = plugin.robot.kinematics.base.to_rotation(plugin.robot.state.position[:6])
        # headings differ: only what the vertical is to the base counts
        lean = told @ (told[2] - truth.rotation[2])
        tilt = np.array((-lean[1], lean[0]))
        true = truth.rotation
        cosine, sine = (function(math.atan2(true[1, 0], true[0, 0])) for function in (math.cos, math.sin))
        x, y, z = truth.velocity[:3]
        velocity = plugin.component.law.velocity - (cosine * x + sine * y, cosine * y - sine * x, z)
        return (
            float(tilt @ np.linalg.solve(pose[3:5, 3:5], tilt)) / 2.0,
            float(velocity @ np.linalg.solve(twist[:3, :3] + 1e-12 * np.eye(3), velocity)) / 3.0,
        )

    def covariance(self) -> np.ndarray:
        """Return the covariance of x, y, z and heading of the filter, shape (4, 4)."""
        return np.array(self.plugins["filter"].component.law.kalman.covariance[:4, :4])


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
