"""The original program's wheeled motion in plain NumPy, as a third party: its equations, one after the other.

Nothing of the component is used. A Robot gives poses and Jacobians of links; points, tasks, null spaces, references and
steering are computed here. n is the normal of the ground, R(psi) the turn about it by the heading psi of the base.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from driving_cases.levels import inverse
from scipy.spatial.transform import Rotation

from solfer import Robot

NORMAL = np.array((0.0, 0.0, 1.0))
CIRCLE, CELL, QUARTER = 6.28318531, 3.14159265, 1.57079632  # rounded as in the original
TASKS = ("CONSTRAINTS", "BASE", "STEERING", "CONTACT_POINTS", "CAMBER", "CASTER")
LEGS = (1, 2, 3, 4)
HYSTERESIS = math.radians(100.0)
RING, TUBE = 0.01, 0.068  # radii of the wheels [m]


def cross(vector: np.ndarray) -> np.ndarray:
    """Return the matrix [v]x of a vector, shape (3, 3)."""
    x, y, z = vector
    return np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))


def heading_of(rotation: np.ndarray) -> float:
    """Return the twist of a rotation matrix about n [rad]."""
    _, _, z, w = Rotation.from_matrix(rotation).as_quat()
    return math.remainder(2.0 * math.atan2(z, w), 2.0 * math.pi)


def branch(angle: float, other: float, reach: float) -> tuple[float, float]:
    """Return the branch of an angle in the cell of half a turn of another one, or the next one beyond `reach` [rad].

    Returns:
        The angle [rad], and the sign of its direction: -1 after an odd number of half turns.
    """
    flips = (other + QUARTER) // CELL - (angle + QUARTER) // CELL
    angle += flips * CELL
    if angle - other > reach:
        angle, flips = angle - math.pi, flips - 1
    elif other - angle > reach:
        angle, flips = angle + math.pi, flips + 1
    return angle, -1.0 if flips % 2 else 1.0


class Direction:
    """A direction with a speed, low-passed the more, the slower it is.

    Args:
        margin: Speed of the low-pass filter [m/s].
    """

    def __init__(self, margin: float):
        self._margin, self.angle, self.speed = margin, 0.0, 0.0

    def update(self, angle: float, speed: float, last: float) -> None:
        """Take over a direction of this cycle; `last` is the last one of the wheel [rad]."""
        angle, sign = branch(angle, self.angle, math.pi / 2.0)
        share = math.tanh(speed / self._margin)
        angle = self.angle + share * (angle - self.angle)
        speed = self.speed + share * (sign * speed - self.speed)
        self.angle, sign = branch(angle, last, HYSTERESIS)
        self.speed = sign * speed


class OriginalSteering:
    """The direction of one wheel, merged of those of the base's motion and of the error of its contact point.

    Args:
        gains: `icm`, `sp`, `tracking`, `damp_icm`, `damp_sp` and `damp` of the configuration.
        period: Period of the control cycle [s].
    """

    def __init__(self, gains: Any, period: float):
        self._gains, self._period, self.angle = gains, period, 0.0
        self.by_motion, self.by_error = (Direction(each / period) for each in (gains.damp_icm, gains.damp_sp))
        self._margin = gains.damp / period * (gains.damp_icm + gains.damp_sp) / period

    def point(self, angle: float) -> None:
        """Begin with a direction [rad], at rest."""
        self.angle = angle
        for direction in (self.by_motion, self.by_error):
            direction.angle, direction.speed = angle, 0.0

    def update(self, velocity: complex, error: complex, reactive: float) -> float:
        """Return the direction of this cycle, seen from the heading [rad].

        Args:
            velocity: Velocity of the contact point in the desired motion of the base, seen from the heading [m/s].
            error: Error of the contact point, seen from the heading [m].
            reactive: Speed of the wheel by the motion of the base since the last cycle [m/s].
        """
        gains, motion, tracking = self._gains, self.by_motion, self.by_error
        motion.update(math.atan2(velocity.imag, velocity.real), abs(velocity), self.angle)
        tracking.update(math.atan2(error.imag, error.real), gains.tracking * abs(error), self.angle)
        scale = 1.0
        if reactive < 0.1 and abs(tracking.speed * self._period) < 2e-4:
            scale = 1000.0 * reactive + abs(tracking.speed)
        trust = scale + 1000.0 * abs(motion.speed) if abs(motion.speed) < 0.1 and scale < 1.0 else 1.0
        a = gains.icm * motion.speed * np.exp(1j * motion.angle)
        b = gains.sp * tracking.speed * np.exp(1j * tracking.angle)
        merged = a + scale * b
        angle = math.atan2(merged.imag, merged.real)
        while angle - self.angle > math.pi / 2.0:
            angle -= math.pi
        while self.angle - angle > math.pi / 2.0:
            angle += math.pi
        self.angle += math.tanh(abs(a + b) * trust / self._margin) * (angle - self.angle)
        return self.angle


class Resteer:
    """A wheel's joint of steering that turns back from the ends of its range.

    Args:
        lower, upper: The ends [rad].
    """

    def __init__(self, lower: float, upper: float):
        self._lower, self._upper, self._count, self._start, self._side = lower, upper, 0, 0.0, 0.0

    def update(self, state: float, command: float) -> float:
        """Return the position that is commanded in place of another one [rad]."""
        if self._side and abs(state - self._start) >= 2.8:
            self._side = 0.0
        if not self._side:
            is_low = command < self._lower - 0.005 and state < self._lower + 0.005
            is_high = command > self._upper + 0.005 and state > self._upper - 0.005
            self._count = self._count + 1 if is_low or is_high else 0
            if self._count == 20:
                self._side, self._start, self._count = (1.0 if is_low else -1.0), state, 0
        return state + self._side * math.radians(5.0) if self._side else command


class Desired(NamedTuple):
    """What is desired of base and wheels.

    Attributes:
        velocity: Velocity of the base in the world, shape (3,) [m/s].
        angular: Its angular velocity, of which z counts, shape (3,) [rad/s].
        vertex_velocity: Velocities of the contact points, seen from the heading, shape (wheels, 3) [m/s].
        camber: Camber of the wheels, shape (wheels,) [rad].
        caster: The same of their caster.
    """

    velocity: np.ndarray
    angular: np.ndarray
    vertex_velocity: np.ndarray
    camber: np.ndarray
    caster: np.ndarray


class OriginalLaw:
    """Positions that the original commands, for a robot that does what it is commanded.

    Args:
        robot: CENTAURO at its start, the legs alone or the whole robot.
        tags: Tags of the configuration: gains, dampings, and those of the steering.
        period: Period of the control cycle [s].
        is_centred: Whether the base is to be below the centre of mass at once, or where it is.
        has_contacts: Whether the wheels' contacts have Jacobians.

    Attributes:
        desired: What is desired in the cycles from now on.
        steering: Steering of each wheel.
    """

    def __init__(self, robot: Robot, tags: Any, period: float, is_centred: bool = False, has_contacts: bool = True):
        robot.update()
        kinematics = robot.kinematics
        self._robot, self._period, self._has_contacts = robot, period, has_contacts
        self._steered, self._moved = [robot.dof(f"ankle_yaw_{leg}") for leg in LEGS], np.arange(6 + 6 * len(LEGS))
        self._wheels = {f"wheel_{leg}": (1.0 if leg % 2 else -1.0) * NORMAL for leg in LEGS}
        turned = {f"ankle2_{leg}": kinematics.rotation(f"ankle2_{leg}").T for leg in LEGS}
        axles = [kinematics.rotation(wheel) @ axle for wheel, axle in self._wheels.items()]
        self._carriers = {link: turn @ axle for (link, turn), axle in zip(turned.items(), axles, strict=True)}
        tuning = tags.tunnings[tags.tunning]
        self._gains = {task: np.atleast_1d(tuning[task]) for task in TASKS}
        self._dampings = {task: tuning.get(f"{task}_DAMP", tuning["damping"]) for task in TASKS}
        self._base_link = str(kinematics.base_link)
        self.steering = [OriginalSteering(tags.steerings[tags.steering], period) for _ in LEGS]
        self._resteer = [
            Resteer(kinematics.lower_position[dof], kinematics.upper_position[dof]) for dof in self._steered
        ]
        place, rotation = self._base()
        self._heading, self._tilt = heading_of(rotation), Rotation.from_matrix(rotation)
        self._tilt = Rotation.from_rotvec(-self._heading * NORMAL) * self._tilt
        self._place = place.copy()
        if is_centred:
            self._place[:2] = robot.center_of_mass.value[:2]
        seen = Rotation.from_rotvec(-self._heading * NORMAL)
        self._footprint = np.array([seen.apply(self._contact(wheel)[0] - place * (1, 1, 0)) for wheel in self._wheels])
        camber = np.array([self._camber(wheel)[0] for wheel in self._wheels])
        caster = np.array([self._caster(carrier)[0] for carrier in self._carriers])
        caster -= CIRCLE * np.floor((caster + CELL) / CIRCLE)
        self.desired = Desired(np.zeros(3), np.zeros(3), np.zeros((len(LEGS), 3)), camber, caster)
        self._before, self._before_rows = (place.copy(), abs(self._heading)), np.zeros((2, robot.size))
        self._is_first = True

    def update(self) -> np.ndarray:
        """Compute a cycle, move the Robot there, and return the positions of its DoFs, shape (n,) [rad, m]."""
        robot, period = self._robot, self._period
        self._footprint += period * self.desired.vertex_velocity
        self._place += period * self.desired.velocity
        self._heading = math.remainder(self._heading + period * self.desired.angular[2], 2.0 * math.pi)
        robot.update()
        errors, jacobians = self._tasks()
        rates = self._descend(errors, jacobians)
        position = robot.state.position.copy()
        position[self._moved] += period * rates
        for dof, resteer in zip(self._steered, self._resteer, strict=True):
            position[dof] = resteer.update(float(robot.state.position[dof]), float(position[dof]))
        robot.state.position[:], robot.state.velocity[self._moved] = position, rates
        return position

    def _descend(self, errors: dict[str, np.ndarray], jacobians: dict[str, np.ndarray]) -> np.ndarray:
        """Return the joint velocities by null spaces, shape (moved,)."""
        projector, rates = np.eye(len(self._moved)), np.zeros(len(self._moved))
        for task in TASKS:
            jacobian, gain = jacobians[task][:, self._moved], self._gains[task]
            residual = gain * errors[task] - jacobian @ rates
            projected = jacobian @ projector
            damped = projected @ projected.T + self._dampings[task] ** 2 * np.eye(len(projected))
            found = projected.T @ inverse(damped)
            rates = rates + found @ residual
            projector = projector - found @ projected
        return rates

    def _tasks(self) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Return errors and Jacobians of all tasks."""
        place, rotation = self._base()
        heading, base = heading_of(rotation), self._robot.kinematics.jacobian(self._base_link)
        linear, angular = base[:3], base[3:]
        wish, base_velocity = self.desired, complex(*self.desired.velocity[:2])
        late, to_world = self._before[0], Rotation.from_rotvec(heading * NORMAL)
        steered = abs(heading)  # the angle of a quaternion, which has no sign
        step = complex(*(place - late)[:2]) * np.exp(-1j * steered) / self._period
        rate = math.remainder(steered - self._before[1], 2.0 * math.pi) / self._period
        desired = Rotation.from_rotvec(self._heading * NORMAL) * self._tilt
        turn = desired * Rotation.from_matrix(rotation).inv()
        errors = {"BASE": np.append(turn.as_quat(canonical=True)[:3], self._place - place)}
        rows: dict[str, list[np.ndarray]] = {task: [] for task in TASKS}
        rows["BASE"] = [angular, linear]
        found: dict[str, list[float]] = {task: [] for task in TASKS}
        for index, (wheel, carrier) in enumerate(zip(self._wheels, self._carriers, strict=True)):
            point, forward, material, geometric, heading_row = self._contact(wheel)
            arm = complex(*(point - place)[:2]) * np.exp(-1j * heading)
            offset = to_world.apply(self._footprint[index])
            error = complex(*(offset - point + late)[:2])
            seen = 0j if self._is_first else error * np.exp(-1j * heading)
            velocity = base_velocity * np.exp(-1j * steered) + 1j * wish.angular[2] * arm
            velocity += complex(*wish.vertex_velocity[index, :2])
            aim = self.steering[index].update(velocity, seen, abs(step + 1j * rate * seen)) + steered
            rows["CONSTRAINTS"].append(material if self._has_contacts else 0.0 * material)
            rows["STEERING"].append(heading_row)
            angle = math.atan2(forward[1], forward[0])
            found["STEERING"].append(soft(aim, angle, 0.1))
            found["CONTACT_POINTS"].append(forward[0] * error.real + forward[1] * error.imag)
            moved = geometric - np.vstack((self._before_rows, np.zeros_like(linear[2])))
            rows["CONTACT_POINTS"].append(forward @ moved - forward @ np.cross(NORMAL, offset) * angular[2])
            for task, (value, row), desired in (
                ("CAMBER", self._camber(wheel), wish.camber),
                ("CASTER", self._caster(carrier), wish.caster),
            ):
                found[task].append(soft(desired[index], value, 2.0))
                desired[index] = value + found[task][-1]
                rows[task].append(row)
        self._before, self._before_rows, self._is_first = (place.copy(), steered), linear[:2].copy(), False
        errors["CONSTRAINTS"] = np.zeros(3 * len(self._wheels))
        errors |= {task: np.array(values) for task, values in found.items() if values}
        return errors, {task: np.vstack(each) for task, each in rows.items()}

    def _base(self) -> tuple[np.ndarray, np.ndarray]:
        kinematics = self._robot.kinematics
        return kinematics.position(self._base_link), kinematics.rotation(self._base_link)

    def _contact(self, wheel: str) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return contact point, direction of rolling, and Jacobians: material, geometric, of the direction."""
        kinematics = self._robot.kinematics
        center, jacobian = kinematics.position(wheel), kinematics.jacobian(wheel)
        axle = kinematics.rotation(wheel) @ self._wheels[wheel]
        upright = NORMAL - axle * axle[2]
        size = np.linalg.norm(upright)
        radial = upright / size
        point = center - RING * radial - TUBE * NORMAL
        material = jacobian[:3] - cross(point - center) @ jacobian[3:]
        turned = -cross(axle) @ jacobian[3:]  # rate of the axle
        along = (np.eye(3) - np.outer(radial, radial)) / size
        geometric = jacobian[:3] + RING * along @ (axle[2] * turned + np.outer(axle, turned[2]))
        forward = np.cross(axle, NORMAL) / size
        heading = (axle[0] * turned[1] - axle[1] * turned[0]) / size**2
        return point, forward, material, geometric, heading

    def _camber(self, wheel: str) -> tuple[float, np.ndarray]:
        kinematics = self._robot.kinematics
        axle = kinematics.rotation(wheel) @ self._wheels[wheel]
        turned = -cross(axle) @ kinematics.jacobian(wheel)[3:]
        return -math.asin(axle[2]), -turned[2] / math.sqrt(1.0 - axle[2] ** 2)

    def _caster(self, carrier: str) -> tuple[float, np.ndarray]:
        kinematics = self._robot.kinematics
        rotation, angular = kinematics.rotation(carrier), kinematics.jacobian(carrier)[3:]
        axle, up = rotation @ self._carriers[carrier], rotation @ NORMAL
        side = np.cross(axle, up)
        sin, cos = side[2], up[2] - up @ axle * axle[2]
        sin_row = -(cross(side) @ angular)[2]
        cos_row = -(cross(up) @ angular)[2] + up @ axle * (cross(axle) @ angular)[2]
        return math.atan2(sin, cos), (cos * sin_row - sin * cos_row) / (sin**2 + cos**2)


def soft(desired: float, angle: float, most: float) -> float:
    """Return the error of an angle of any number of half turns, `most` at most [rad]."""
    away = desired - angle
    away -= CELL * math.floor((away + QUARTER) / CELL)
    return min(max(away, -most), most)
