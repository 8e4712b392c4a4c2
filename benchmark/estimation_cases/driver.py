"""Drives CENTAURO along a course by steering and wheels, and logs what its sensors could measure exactly."""

import math
import re
from contextlib import closing

import numpy as np
from estimation_cases.courses import Course, Leg
from estimation_cases.log import PERIOD, ROBOT, Log, Rows

from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.robot import Robot
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.sensors.records import Rates
from solfer.transport.messages import JointMessage

STEP = 0.001  # [s]
RESTING = 13.0
"""Time at rest before the robot moves [s]: it drops onto the ground, which disturbs the IMU for ten of them."""
SPEED, TURN, ACCELERATION, STEERING_SPEED = 0.3, 0.4, 0.3, 0.8  # [m/s], [rad/s], [m/s^2], [rad/s]
RADIUS, RADII = 0.078, 0.003  # [m], share
WHEELS = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))
SIDES = np.array((1.0, -1.0, 1.0, -1.0))
AHEAD = 1.0
"""Way within which the robot comes back to its path [m]."""
MARGIN, HEIGHT, SHIFTING = 0.1, 0.06, 4.0
"""Margin of the centre of mass before a wheel is lifted, how high that is [m], and the time of each [s]."""


class Driver:
    """CENTAURO in the world of a course, whose wheels have radii that differ by up to 0.3 percent.

    It follows the course by where it truly is: nothing that is measured with errors has a part in it.

    Args:
        course: What is driven.
        seed: Draws the radii.
        spacing: Time from a row of the log to the next, which divides PERIOD [s].
    """

    def __init__(self, course: Course, seed: int, spacing: float = PERIOD):
        self._course, text = course, (ROBOT / "centauro.urdf").read_text()
        self._steps = round(spacing / STEP)
        self.radii = RADIUS * (1.0 + RADII * np.random.default_rng(seed).uniform(-1.0, 1.0, 4))
        self.simulation = Simulation.from_file(
            ROBOT / "robot.yaml", description_text=with_radii(text, self.radii), world=course.world
        )
        self._bus = Bus()
        middleware = MemoryMiddleware(self._bus, "simulator")
        slow = Rates(**dict.fromkeys(Rates.model_fields, 1.0))
        self._server = SimulationServer(self.simulation, middleware, rates=slow)
        commands = MemoryMiddleware(self._bus, "driver")
        self._position, self._velocity = (
            commands.writer(f"{name}_controller/command", "solfer/JointCommand") for name in ("position", "velocity")
        )
        robot = Robot.load(ROBOT / "centauro.urdf", ROBOT / "centauro.srdf")
        indices, values = robot.named_state("mammal_wide_straight")
        names = [robot.dofs[index] for index in indices]
        legs = [f"{joint}_{leg}" for leg in (1, 2, 3, 4) for joint in LEG]
        known = dict(zip(names, values.tolist(), strict=True))
        self._robot, self._joints = robot, tuple(legs)
        self._posture = np.array([known[joint] for joint in legs])
        self._straight = self._posture.reshape(4, -1)[:, -1].copy()
        self._yaw, self._backwards, self._roll = np.zeros(4), np.ones(4), np.zeros(4)
        self._robot.state.position[indices] = values
        self._grounded = np.ones(4)
        self.rows = Rows(self.simulation)

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()

    def drive(self) -> Log:
        """Drive all of the course; return what was measured.

        Raises:
            RuntimeError: The robot has fallen, or does not come to the end of a leg.
        """
        self._wait(RESTING)
        if self._course.lifted is not None:
            self._lift(self._course.lifted)
        for leg in self._course.legs:
            self._follow(leg)
        if self._course.pushed is not None:
            speed, duration = self._course.pushed
            self._roll[:] = speed
            self._wait(duration)
            self._roll[:] = 0.0
        if self._course.lifted is not None:
            self._steer(np.zeros(4))
            self._shift(self._lowered, 0.5 * SHIFTING)
            self._grounded[:] = 1.0
        self._wait(1.0)
        return self.rows.log(self.radii)

    def _cycle(self) -> None:
        """Command the joints for a period, and look what they do."""
        self._posture.reshape(4, -1)[:, -1] = self._straight - self._yaw
        self._position.write(JointMessage(self._joints, position=self._posture.copy()))
        roll = self._roll.copy()
        if self._course.spun is not None:
            speed, wheel = self._course.spun
            place = self.simulation.state.now.position(WHEELS[wheel])
            roll[wheel] += speed * self._course.on_patch(place[0], place[1])
        names = tuple(f"j_{wheel}" for wheel in WHEELS)
        self._velocity.write(JointMessage(names, velocity=SIDES * roll / RADIUS))
        for step in range(round(PERIOD / STEP)):
            self._server.cycle()
            self._bus.time += STEP
            if (step + 1) % self._steps == 0:
                self.rows.take()

    def _wait(self, duration: float) -> None:
        for _ in range(round(duration / PERIOD)):
            self._cycle()
        if self.simulation.state.now.rotation("pelvis")[2, 2] < 0.9:
            raise RuntimeError("the robot has fallen")

    def _pose(self) -> np.ndarray:
        now = self.simulation.state.now
        rotation = now.rotation("pelvis")
        return np.append(now.position("pelvis")[:2], math.atan2(rotation[1, 0], rotation[0, 0]))

    def _places(self) -> np.ndarray:
        """Return where wheels are, seen from the heading of the pelvis, shape (4, 2) [m]."""
        now, (x, y, heading) = self.simulation.state.now, self._pose().tolist()
        away = np.array([now.position(wheel)[:2] for wheel in WHEELS]) - (x, y)
        return _turned(away, -heading)

    def _steer(self, yaw: np.ndarray) -> None:
        """Steer on the spot to angles of the wheels against the heading [rad]."""
        while np.abs(change := yaw - self._yaw).max() > 0.0:
            self._yaw += np.clip(change, -STEERING_SPEED * PERIOD, STEERING_SPEED * PERIOD)
            self._cycle()
        self._wait(0.3)

    def _aim(self, twist: np.ndarray, places: np.ndarray, first: bool) -> np.ndarray:
        """Return angles of the wheels [rad] for a velocity (x, y, turn) of the base, and set the speeds of rolling."""
        x, y, turn = twist.tolist()
        velocity = np.stack((x - turn * places[:, 1], y + turn * places[:, 0]), axis=1)
        yaw = np.arctan2(velocity[:, 1], velocity[:, 0])
        if first:
            self._backwards = np.where(np.abs(yaw) > 0.5 * math.pi + 1e-6, -1.0, 1.0)
        yaw = np.where(self._backwards < 0.0, np.arctan2(-velocity[:, 1], -velocity[:, 0]), yaw)
        self._roll = self._backwards * np.linalg.norm(velocity, axis=1) * self._grounded
        return yaw

    def _follow(self, leg: Leg) -> None:
        """Steer, then follow a leg along its arc, and stop."""
        start, places, way = self._pose(), self._places(), math.hypot(leg.x, leg.y)
        # the way is that of the arc; what turns on the spot goes by the angle
        length, speed = (way, SPEED) if way else (abs(leg.turn), TURN)
        along = np.array((leg.x, leg.y, leg.turn)) / length
        self._steer(self._aim(along * 1e-3, places, first=True))
        gone = rate = 0.0
        limit = round(3.0 * (length / speed + 5.0) / PERIOD)
        while gone < length:
            rate = min(rate + ACCELERATION * PERIOD, speed, math.sqrt(2.0 * ACCELERATION * (length - gone)) + 1e-3)
            gone += rate * PERIOD
            self._yaw = self._aim(rate * (along + self._back(start, leg, gone, length)), places, first=False)
            self._cycle()
            limit -= 1
            if limit < 0:
                raise RuntimeError(f"{leg} was not driven to its end")
        self._roll[:] = 0.0
        self._wait(0.5)

    def _back(self, start: np.ndarray, leg: Leg, gone: float, length: float) -> np.ndarray:
        """Return what to add to the velocity, for each metre, to come back to the path: x, y, turn."""
        angle = leg.turn * gone / length
        # an arc: the mean of the direction over the way gone
        chord = math.sin(0.5 * angle) / (0.5 * angle) if abs(angle) > 1e-9 else 1.0
        place = _turned(np.array((leg.x, leg.y)) * (gone / length) * chord, 0.5 * angle)
        x, y, heading = self._pose().tolist()
        error = _turned(start[:2] + _turned(place, float(start[2])) - (x, y), -heading)
        turn = (float(start[2]) + angle - heading + math.pi) % (2.0 * math.pi) - math.pi
        limit = 0.1 if math.hypot(leg.x, leg.y) else 0.02
        return np.clip(np.array((*error, turn)) / AHEAD, -limit, limit)

    def _lift(self, wheel: int) -> None:
        """Shift the weight away from a wheel, and lift it."""
        places, center = self._places(), self._center()
        beside = np.delete(places, (wheel, 3 - wheel), axis=0)
        edge = beside[1] - beside[0]
        away = np.array((edge[1], -edge[0])) / np.linalg.norm(edge)
        away *= np.sign(away @ (beside[0] - places[wheel]))
        shift = max(0.0, MARGIN - float(away @ (center - beside[0]))) * away
        shifted = self._solved([np.append(-shift, 0.0)] * 4)
        self._shift(shifted, SHIFTING)
        self._lowered = shifted
        lifts = [np.append(-shift, HEIGHT * (each == wheel)) for each in range(4)]
        self._shift(self._solved(lifts), 0.5 * SHIFTING)
        self._grounded[wheel] = 0.0

    def _center(self) -> np.ndarray:
        """Return where the centre of mass is from the pelvis, seen from its heading [m]."""
        model = self.simulation.kinematics.twin()
        model.update(self.simulation.q)
        x, y, heading = self._pose().tolist()
        return _turned(model.center_of_mass[:2] - (x, y), -heading)

    def _solved(self, moves: list[np.ndarray]) -> np.ndarray:
        """Return the posture in which wheels are moved [m] against the pelvis, without a turn, shape (4, 5) [rad]."""
        robot, posture = self._robot, self._posture.reshape(4, -1).copy()
        for leg, move in enumerate(moves, 1):
            link, columns = f"ankle2_{leg}", [robot.dof(f"{joint}_{leg}") for joint in LEG]
            robot.state.position[columns] = posture[leg - 1]
            robot.update()
            goal, turn = robot.kinematics.position(WHEELS[leg - 1]) + move, robot.kinematics.rotation(link).copy()
            for _ in range(50):
                robot.update()
                jacobian = robot.kinematics.jacobian(WHEELS[leg - 1])[:, columns]
                off = turn @ robot.kinematics.rotation(link).T
                away = 0.5 * np.array((off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]))
                error = np.concatenate((goal - robot.kinematics.position(WHEELS[leg - 1]), away))
                step = np.linalg.solve(jacobian.T @ jacobian + 1e-8 * np.eye(len(LEG)), jacobian.T @ error)
                robot.state.position[columns] += step
            posture[leg - 1] = robot.state.position[columns]
            robot.state.position[columns] = self._posture.reshape(4, -1)[leg - 1]
        return posture

    def _shift(self, posture: np.ndarray, duration: float) -> None:
        """Move the legs to a posture, shape (4, 5) [rad]."""
        self._roll[:] = 0.0
        begin, count = self._posture.reshape(4, -1).copy(), round(duration / PERIOD)
        for cycle in range(1, count + 1):
            share = 0.5 - 0.5 * math.cos(math.pi * cycle / count)
            self._posture = (begin + share * (posture - begin)).ravel()
            self._straight = self._posture.reshape(4, -1)[:, -1] + self._yaw
            self._cycle()
        self._wait(0.5)


LEG = ("hip_yaw", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_yaw")


def _turned(places: np.ndarray, angle: float) -> np.ndarray:
    """Turn places, shape (..., 2), by an angle [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return places @ np.array(((cosine, sine), (-sine, cosine)))


def with_radii(urdf: str, radii: np.ndarray) -> str:
    """Return a URDF with other radii of the wheels, shape (4,) [m]."""
    for leg, radius in enumerate(radii, 1):
        pattern = rf'(<link name="wheel_{leg}".*?<sphere radius=)"[^"]*"'
        urdf, count = re.subn(pattern, rf'\1"{radius:.9g}"', urdf, count=1, flags=re.DOTALL)
        assert count == 1
    return urdf


def drive(course: Course, seed: int, spacing: float = PERIOD) -> Log:
    """Drive along a course; return its log, with rows that are `spacing` apart [s]."""
    with closing(Driver(course, seed, spacing)) as driver:
        return driver.drive()
