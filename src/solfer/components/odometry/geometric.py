"""Where the base is, from wheels that all roll on flat ground, as in the paper."""

import itertools
import math

import numpy as np

from solfer.components.odometry.sensing.measured_base import MeasuredBase, about_vertical, rotation_vector
from solfer.components.odometry.wheels import Wheels
from solfer.errors import ComponentError
from solfer.numerics.filters import LowPass
from solfer.numerics.rotations import cross
from solfer.robot import Robot


class TiltedWheels:
    """The wheels with the tilt of the base, without its heading.

    Args:
        robot: The Robot.
        wheels: Its wheels.

    Attributes:
        centers: Their centres from the base, shape (k, 3) [m]; live.
    """

    _normal = np.array((0.0, 0.0, 1.0))
    """Normal of the ground."""

    def __init__(self, robot: Robot, wheels: Wheels):
        self._robot = robot
        self._links = wheels.links
        self._radii = wheels.radii
        self._dofs = np.array([robot.kinematics.attachment(link).columns[-1] for link in wheels.links])
        self._before = np.zeros(len(wheels))
        self.centers = np.zeros((len(wheels), 3))

    def update(self, rotation: np.ndarray) -> None:
        """Find centres, axes and velocities by the Robot's kinematics, turned by a rotation, shape (3, 3)."""
        kinematics = self._robot.kinematics
        origin = kinematics.position(kinematics.base_link or "")
        self.centers[:] = [rotation @ (kinematics.position(link) - origin) for link in self._links]
        self._axes = [rotation @ kinematics.rotation(link)[:, 2] for link in self._links]
        joints = self._robot.state.velocity[6:]
        moving = [kinematics.jacobian(link)[:, 6:] @ joints for link in self._links]
        self._moving = [np.concatenate((rotation @ each[:3], rotation @ each[3:])) for each in moving]

    def start(self) -> None:
        """Let displacements begin where the wheels are."""
        self._before[:] = self._robot.state.position[self._dofs]

    def displacements(self) -> list[np.ndarray]:
        """Return how far each wheel has rolled along the ground since the last call, shape (3,) each [m]."""
        turned = self._robot.state.position[self._dofs]
        found = []
        for index, (axis, radius) in enumerate(zip(self._axes, self._radii, strict=True)):
            along = cross(axis, self._normal)
            along *= radius * (turned[index] - self._before[index]) / np.linalg.norm(along)
            found.append(along)
        self._before[:] = turned
        return found

    def rows(self, tilting: np.ndarray, axis: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
        """Return w and u of each wheel, which measures v + rate w = u of the base's velocity v, shape (3,) each.

        Args:
            tilting: Angular velocity of the base without its yaw rate, shape (3,) [rad/s].
            axis: Axis of the yaw rate, shape (3,).
        """
        found = []
        for center, moving, radius in zip(self.centers, self._moving, self._radii, strict=True):
            rolled = cross(tilting + moving[3:], radius * self._normal)
            found.append((cross(axis, center), rolled - cross(tilting, center) - moving[:3]))
        return found


class GeometricOdometry:
    """The base's pose by the steps of the wheels, each of which measures a pose, and by the IMU's tilt.

    With the centre c_i of a wheel from the base, its axis a_i and its rotation dt_i, it has gone (a_i x n) / |a_i x n|
    r dt_i along the ground with the normal n. From where each wheel was, each measures the base; what disagrees is
    left out (`middle`). The yaw rate about n and the base's velocity solve the velocities of each pair of wheels, for
    which the wheels' material rests at the ground, by least squares; pairs that disagree are left out alike. The yaw
    rate is integrated. All wheels count at all times. Wheels are where the tilt of the cycle before puts them, and the
    IMU's rotation keeps the axes of the IMU's world, as in the paper's own program: its poses are these.

    Args:
        robot: The Robot.
        wheels: Its wheels.
        base: What the IMU measures.

    Attributes:
        position: Position of the base's origin in the world, shape (3,) [m]; live. It begins at the origin.
        heading: Angle about the vertical from the world to the base's x axis [rad].
        velocity: Velocity of the base's origin, axes of the world turned by the heading, shape (3,) [m/s]; live.
        angular: Angular velocity of the base, the same axes, shape (3,) [rad/s]; live.
        candidates: Position of the base by each wheel, shape (k, 3) [m]; live.
        filter: Filter of the angular velocity that the IMU measures, three numbers, or None.
        smoothing: Filter of the velocity and of the yaw rate, four numbers, or None.
    """

    def __init__(self, robot: Robot, wheels: Wheels, base: MeasuredBase):
        if len(wheels) < 2:
            raise ComponentError(
                f"one wheel of '{robot.name}' measures no turn", expected="two, or the method `filter`"
            )
        self._base = base
        self._wheels = TiltedWheels(robot, wheels)
        self.position, self.velocity, self.angular = np.zeros((3, 3))
        self.candidates, self._places = np.zeros((2, len(wheels), 3))
        self.heading = self._yaw = self._rate = 0.0
        self._known = np.eye(3)
        self._measured = np.zeros(3)
        self._tilted = np.eye(3)
        self.filter: LowPass | None = None
        self.smoothing: LowPass | None = None

    def start(self) -> None:
        """Begin at the origin, with the heading of the IMU."""
        self._base.start()
        self.position[:] = 0.0
        self._rate = 0.0
        self._yaw = twist(self._base.rotation)
        self._known = self._base.rotation
        for low_pass in (self.filter, self.smoothing):
            if low_pass is not None:
                low_pass.reset()
        self._tilt()
        self._wheels.update(self._tilted @ self._base.rotation.T)
        self._wheels.start()
        self._places[:] = [about_vertical(center, self._yaw) for center in self._wheels.centers]
        self._solve(1.0)
        self._finish()

    def resume(self) -> None:
        """Begin again at the last place and heading: nothing is known of the time since the last measurement."""
        x, y, z = self.position.tolist()
        heading = self.heading
        self.start()
        self.place(x, y, heading)
        self.position[2] = z
        self._places[:, 2] += z

    def place(self, x: float, y: float, heading: float) -> None:
        """Put the base somewhere else on the ground [m], with another heading [rad]."""
        yaw = heading - self.heading
        shifted = [about_vertical(place - self.position, yaw) for place in self._places]
        self.position[:2] = x, y
        self._places[:] = shifted + self.position
        self._yaw += yaw
        self.heading = heading

    def update(self, period: float, measured: bool) -> None:
        """Follow what has been measured within a cycle of `period` [s]."""
        self._base.read(measured)
        wheels = self._wheels
        wheels.update(self._tilted @ self._base.rotation.T)
        self._yaw += self._rate * period
        for index, along in enumerate(wheels.displacements()):
            center = about_vertical(wheels.centers[index], self._yaw)
            self._places[index] += about_vertical(along, self._yaw)
            self.candidates[index] = self._places[index] - center
        self.position[:] = middle(self.candidates)
        for index, center in enumerate(wheels.centers):
            self._places[index] = self.position + about_vertical(center, self._yaw)
        self._solve(period)
        self._tilt()
        self._finish()

    def _tilt(self) -> None:
        """Take the tilt of the base from the IMU, without its heading."""
        yaw = -twist(self._base.rotation)
        self._tilted = np.column_stack([about_vertical(column, yaw) for column in self._base.rotation.T])

    def _solve(self, period: float) -> None:
        """Solve for the base's velocity and its yaw rate; that of the IMU is not used."""
        if self._base.fresh:
            turned = rotation_vector(self._base.rotation @ self._known.T) / period
            self._known = self._base.rotation
            if self.filter is not None:
                self.filter.step(turned)
            self._measured = turned
        tilting = self._measured * (1.0, 1.0, 0.0)
        axis = self._tilted[:, 2]
        rows = self._wheels.rows(tilting, axis)
        solved = middle(np.array([_solution(one, other) for one, other in itertools.combinations(rows, 2)]))
        if self.smoothing is not None:
            self.smoothing.step(solved)
        self._rate = float(solved[3])
        self.velocity[:] = solved[:3]
        self.angular[:] = tilting + self._rate * axis

    def _finish(self) -> None:
        """Turn what is known without a heading to the base's x axis."""
        tilt = math.atan2(self._tilted[1, 0], self._tilted[0, 0])
        self.heading = self._yaw + tilt
        self.velocity[:] = about_vertical(self.velocity, -tilt)
        self.angular[:] = about_vertical(self.angular, -tilt)


def _solution(first: tuple[np.ndarray, np.ndarray], second: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Solve v + rate w = u of two wheels for v and the rate, shape (4,), by least squares."""
    (w, u), (x, y) = first, second
    apart = w - x
    difference = u - y
    square = float(apart @ apart)
    rate = float(apart @ difference) / square if square > 0.0 else 0.0
    return np.append(0.5 * (u + y - rate * (w + x)), rate)


def middle(candidates: np.ndarray) -> np.ndarray:
    """Return what candidates agree on, shape (m,): those furthest from all others are left out, until three are left.

    Of three it is the one closest to the others, of two their mean. Shape (k, m).
    """
    left = list(range(len(candidates)))
    while True:
        chosen = candidates[left]
        if len(left) < 3:
            return chosen.mean(axis=0)
        distances = np.linalg.norm(chosen[:, None] - chosen[None], axis=2).sum(axis=1)
        if len(left) == 3:
            return chosen[int(np.argmin(distances))]
        del left[int(np.argmax(distances))]


def twist(rotation: np.ndarray) -> float:
    """Return the angle of a rotation's part about the vertical, behind its tilt [rad]."""
    return math.atan2(rotation[1, 0] - rotation[0, 1], rotation[0, 0] + rotation[1, 1])
