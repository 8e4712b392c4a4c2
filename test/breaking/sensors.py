"""Sensors and motors that are wrong: Fig. 5 on the virtual clock, with faults that a seed draws."""

import copy
import logging
import math
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import numpy as np
from support.paper.full_control import Nodes

from solfer.components.odometry.messages import stamped_pose
from solfer.demo.waving import Waving
from solfer.errors import SolferError
from solfer.middleware.memory import MemoryMiddleware
from solfer.numerics.rotations import quaternion_product
from solfer.plugins import PluginState
from solfer.transport.messages import FieldsMessage

MOTIONS = {"stands": (0.0, 0.0), "drives": (0.2, 0.0), "turns": (0.1, 0.3)}
"""Velocities of the base, ahead and about z [m/s, rad/s]."""

BEFORE, AFTER, PERIOD = 2.5, 5.0, 0.02
"""Time before a fault begins, and for which it lasts, and period of those who command [s]."""

SENSORS = ("joint_states", "imu")
"""Topics of what the robot measures."""

FRICTION, JAMMED = 3.0, 500.0
"""Friction torques of the gear of a motor without current, and of what jams [Nm]."""

LEGS, ARMS, WHEELS = "hip knee ankle", "arm", "wheel"
"""Parts of the names of joints."""

Change = Callable[[Any, float], None]
"""Changes a message; `time` is that since the fault began [s]."""


@dataclass
class Outcome:
    """What the robot did after a fault.

    Attributes:
        joint: Largest speed of a joint, as a share of its limit.
        base: Largest speed of the base [m/s].
        turn: Largest rate of its heading [rad/s].
        wheel: Largest speed of a wheel [rad/s].
        tilt: Largest tilt [rad].
        rest: Mean speed of the base in the last second [m/s].
        pause: Smallest mean speed of the base over a second [m/s].
        stopped: Plugins that do not run in the end.
        named: Warnings, with the time since the fault [s], and in the end why plugins were aborted.
        complaints: What may not be.
    """

    joint: float = 0.0
    base: float = 0.0
    turn: float = 0.0
    wheel: float = 0.0
    tilt: float = 0.0
    rest: float = 0.0
    pause: float = 0.0
    stopped: list[str] = field(default_factory=list)
    named: list[tuple[float, str]] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)


class Saying(logging.Handler):
    """Keeps warnings and errors, with their time."""

    def __init__(self, clock: Callable[[], float]):
        super().__init__(logging.WARNING)
        self._clock, self.said = clock, []

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append((self._clock(), record.getMessage()))


@contextmanager
def logged(handler: logging.Handler) -> Iterator[None]:
    """Let a handler receive what is logged meanwhile."""
    logger = logging.getLogger("solfer")
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)


class SensorTrial:
    """A robot that is driven and waves, and one fault.

    Args:
        motion: One of MOTIONS.
        fault: Name of a fault, see `FAULTS`; empty: none.
        seed: Seed of what the fault draws.
        amount: Size of the fault; None: it is drawn as well.
        silent: Time after the fault from which no sensor measures anything, so that the robot comes to rest [s].

    Attributes:
        falls: Joints without a motor, whose speeds do not count.
    """

    def __init__(self, motion: str, fault: str, seed: int, amount: float | None = None, silent: float = AFTER):
        self.motion, self.fault, self.draw = motion, fault, np.random.default_rng(seed)
        self.seed, self.size, self._amount, self._silent = seed, "", amount, silent
        self.falls: list[int] = []

    def run(self) -> Outcome:
        """Run it."""
        with closing(Nodes(None)) as self.world:
            self.saying = Saying(lambda: self.world.bus.time)
            with logged(self.saying):
                return self._run()

    def start(self, world: Nodes) -> None:
        """Let those who command the robot begin."""
        self.world, kinematics = world, world.simulation.kinematics
        self.joints = list(kinematics.dofs[6:])
        self.limits = kinematics.velocity_limit[6:]
        self.wheels = [index for index, name in enumerate(self.joints) if WHEELS in name]
        self.stick = MemoryMiddleware(world.bus, "stick").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
        world.run(1.5)
        self.waving = Waving(MemoryMiddleware(world.bus, "waving"), "hands", world.hands())
        self.begin = world.bus.time

    def _run(self) -> Outcome:
        world, self.outcome = self.world, Outcome()
        outcome = self.outcome
        self.start(world)
        rest: list[float] = []
        world.bus.every(0.002, lambda: rest.append(self._look()))
        self.go(BEFORE)
        outcome.__init__()
        fault_begin = self.begin_of_fault = world.bus.time
        self.saying.said.clear()
        if self.fault:
            FAULTS[self.fault](self)
        self.go(self._silent)
        for topic in SENSORS if self._silent < AFTER else ():
            self.world.bus._topics[topic].publish = lambda message, sender, now: None
        self.go(AFTER - self._silent)
        seconds = [float(np.mean(rest[end - 500 : end])) for end in range(len(rest), len(rest) - 2000, -50)]
        outcome.rest = seconds[0]
        outcome.pause = min(seconds)
        running = PluginState.RUNNING
        outcome.stopped = [name for name, plugin in world.plugins.items() if plugin.life is not running]
        outcome.named = [(time - fault_begin, text) for time, text in self.saying.said]
        outcome.named += [(AFTER, managed.reason) for managed in world.together.plugins if managed.reason]
        return outcome

    def _look(self) -> float:
        """Note the largest figures; return the speed of the base [m/s]."""
        v, now, outcome = self.world.simulation.v, self.world.simulation.state.now, self.outcome
        speeds = np.abs(v[6:])
        shares = speeds / self.limits
        shares[self.falls] = 0.0
        outcome.joint = max(outcome.joint, float(shares.max()))
        outcome.wheel = max(outcome.wheel, float(speeds[self.wheels].max()))
        speed = math.hypot(v[0], v[1])
        outcome.base, outcome.turn = max(outcome.base, speed), max(outcome.turn, abs(float(v[5])))
        outcome.tilt = max(outcome.tilt, math.acos(min(1.0, max(-1.0, now.rotation("pelvis")[2, 2]))))
        return speed

    def go(self, duration: float) -> None:
        """Command for a while [s]."""
        speed, rate = MOTIONS[self.motion]
        linear, angular = {"x": speed, "y": 0.0, "z": 0.0}, {"x": 0.0, "y": 0.0, "z": rate}
        for _ in range(round(duration / PERIOD)):
            self.stick.write(FieldsMessage({"linear": linear, "angular": angular}))
            self.waving.send(self.world.bus.time - self.begin)
            self.world.run(PERIOD)

    def joint(self, part: str) -> str:
        """Draw a joint with one of these words in its name."""
        return str(self.draw.choice([name for name in self.joints if any(word in name for word in part.split())]))

    def either(self) -> float:
        """Draw a sign."""
        return float(self.draw.choice((-1.0, 1.0)))

    def amount(self, drawn: float) -> float:
        """Return the size of the fault: that of the trial, or else the one that was drawn."""
        return drawn if self._amount is None else self._amount

    def spoil(self, topic: str, change: Change) -> None:
        """Change the messages of a topic from now on."""
        line = self.world.bus._topics[topic]
        publish = line.publish

        def changed(message: Any, sender: str, now: float) -> None:
            spoiled = copy.deepcopy(message)
            change(spoiled, now - self.begin_of_fault)
            publish(spoiled, sender, now)

        line.publish = changed


def about(axis: str, angle: float) -> np.ndarray:
    """Return the quaternion of a turn about an axis."""
    numbers = np.zeros(4)
    numbers["xyz".index(axis)], numbers[3] = math.sin(0.5 * angle), math.cos(0.5 * angle)
    return numbers


def _turned(trial: SensorTrial, turn: Callable[[float], np.ndarray]) -> None:
    def change(message: Any, time: float) -> None:
        message.orientation = np.array(quaternion_product(turn(time), message.orientation))

    trial.spoil("imu", change)


def imu_jump(trial: SensorTrial) -> None:
    """Let the orientation jump about z."""
    angle = trial.either() * trial.amount(trial.draw.uniform(0.2, 3.0))
    trial.size = f"{angle:.2f} rad"
    _turned(trial, lambda time: about("z", angle))


def imu_drift(trial: SensorTrial) -> None:
    """Let the orientation drift about an axis."""
    axis, rate = str(trial.draw.choice(list("xyz"))), trial.either() * trial.amount(trial.draw.uniform(0.01, 0.3))
    trial.size = f"{rate:.3f} rad/s about {axis}"
    _turned(trial, lambda time: about(axis, rate * time))


def imu_freeze(trial: SensorTrial) -> None:
    """Freeze everything, with fresh stamps."""
    kept: dict[str, np.ndarray] = {}

    def change(message: Any, time: float) -> None:
        for name in ("orientation", "angular", "acceleration"):
            setattr(message, name, kept.setdefault(name, getattr(message, name)).copy())

    trial.spoil("imu", change)


def imu_upside_down(trial: SensorTrial) -> None:
    """Mount it the other way round."""

    def change(message: Any, time: float) -> None:
        message.orientation = np.array(quaternion_product(message.orientation, (1.0, 0.0, 0.0, 0.0)))
        message.angular = message.angular * (1.0, -1.0, -1.0)
        message.acceleration = message.acceleration * (1.0, -1.0, -1.0)

    trial.spoil("imu", change)


def gyro_sign(trial: SensorTrial) -> None:
    """Turn the sign of the gyroscope."""
    trial.spoil("imu", lambda message, time: setattr(message, "angular", -message.angular))


def gyro_scale(trial: SensorTrial) -> None:
    """Give the gyroscope another scale."""
    scale = trial.amount(trial.draw.uniform(0.5, 2.0))
    trial.size = f"{scale:.2f}"
    trial.spoil("imu", lambda message, time: setattr(message, "angular", scale * message.angular))


def gyro_spikes(trial: SensorTrial) -> None:
    """Add spikes to the gyroscope in some of the messages."""
    size = trial.amount(10.0 ** trial.draw.uniform(1.0, 6.0))
    trial.size = f"{size:.0f} rad/s"

    def change(message: Any, time: float) -> None:
        if trial.draw.random() < 0.05:
            message.angular = message.angular + size * trial.draw.choice((-1.0, 1.0), 3)

    trial.spoil("imu", change)


def accelerometer_jump(trial: SensorTrial) -> None:
    """Add a specific force along an axis."""
    axis, size = int(trial.draw.integers(3)), trial.either() * trial.amount(trial.draw.uniform(0.5, 20.0))
    trial.size = f"{size:.2f} m/s^2 along {'xyz'[axis]}"

    def change(message: Any, time: float) -> None:
        message.acceleration = message.acceleration + size * np.eye(3)[axis]

    trial.spoil("imu", change)


def joints_freeze(trial: SensorTrial) -> None:
    """Freeze all joints for 3 s, with fresh stamps."""
    kept: dict[str, np.ndarray] = {}

    def change(message: Any, time: float) -> None:
        for name in ("position", "velocity", "effort") if time < 3.0 else ():
            setattr(message, name, kept.setdefault(name, getattr(message, name)).copy())

    trial.spoil("joint_states", change)


def joints_swapped(trial: SensorTrial) -> None:
    """Swap two joints of legs, or of arms."""
    part = str(trial.draw.choice((LEGS, ARMS)))
    first, second = trial.joint(part), trial.joint(part)
    trial.size = f"{first} and {second}"

    def change(message: Any, time: float) -> None:
        pair = [message.names.index(first), message.names.index(second)]
        for numbers in (message.position, message.velocity, message.effort):
            numbers[pair] = numbers[pair[::-1]]

    trial.spoil("joint_states", change)


def _joint(trial: SensorTrial, change: Callable[[float, float, float], tuple[float, float]], part: str = "") -> None:
    """Change position and velocity of a joint that is drawn, of a leg or an arm."""
    name = trial.joint(part or str(trial.draw.choice((LEGS, ARMS))))
    trial.size = f"{name} {trial.size}"

    def changed(message: Any, time: float) -> None:
        place = message.names.index(name)
        numbers = change(message.position[place], message.velocity[place], time)
        message.position[place], message.velocity[place] = numbers

    trial.spoil("joint_states", changed)


def joint_jump(trial: SensorTrial) -> None:
    """Shift the zero of a joint all of a sudden."""
    size = trial.either() * trial.amount(trial.draw.uniform(0.02, 1.0))
    trial.size = f"{size:.2f} rad"
    _joint(trial, lambda place, speed, time: (place + size, speed))


def joint_drift(trial: SensorTrial) -> None:
    """Let the zero of a joint drift."""
    rate = trial.either() * trial.amount(trial.draw.uniform(0.01, 0.3))
    trial.size = f"{rate:.3f} rad/s"
    _joint(trial, lambda place, speed, time: (place + rate * time, speed))


def joint_sign(trial: SensorTrial) -> None:
    """Turn the sign of a joint."""
    _joint(trial, lambda place, speed, time: (-place, -speed))


def joint_scale(trial: SensorTrial) -> None:
    """Give a joint another scale."""
    scale = trial.amount(trial.draw.uniform(0.7, 1.4))
    trial.size = f"{scale:.2f}"
    _joint(trial, lambda place, speed, time: (scale * place, scale * speed))


def joint_spikes(trial: SensorTrial) -> None:
    """Add spikes to a joint in some of the messages."""
    size = trial.amount(trial.draw.uniform(0.1, 3.0))
    trial.size = f"{size:.2f} rad"
    _joint(trial, lambda place, speed, time: (place + size * trial.either() * (trial.draw.random() < 0.05), speed))


def joint_stuck(trial: SensorTrial) -> None:
    """Let the encoder of a joint stay where it was."""
    kept: list[float] = []

    def change(place: float, speed: float, time: float) -> tuple[float, float]:
        kept.append(place)
        return kept[0], 0.0

    _joint(trial, change)


def velocity_sign(trial: SensorTrial) -> None:
    """Turn the sign of a joint's velocity alone."""
    _joint(trial, lambda place, speed, time: (place, -speed))


def velocities_swapped(trial: SensorTrial) -> None:
    """Swap the velocities alone of two joints."""
    first, second = trial.joint(f"{LEGS} {ARMS}"), trial.joint(f"{LEGS} {ARMS}")
    trial.size = f"{first} and {second}"

    def change(message: Any, time: float) -> None:
        pair = [message.names.index(first), message.names.index(second)]
        message.velocity[pair] = message.velocity[pair[::-1]]

    trial.spoil("joint_states", change)


def _contacts(trial: SensorTrial, change: Callable[[np.ndarray, float], np.ndarray]) -> None:
    """Change the forces of all contacts."""
    for topic in [name for name in trial.world.bus._topics if name.startswith("contacts/")]:
        trial.spoil(topic, lambda message, time: setattr(message, "force", change(message.force, time)))


def contacts_jump(trial: SensorTrial) -> None:
    """Add a force to all contacts."""
    size = trial.amount(10.0 ** trial.draw.uniform(1.0, 4.0)) * trial.draw.choice((-1.0, 1.0), 3)
    trial.size = f"{size} N"
    _contacts(trial, lambda force, time: force + size)


def contacts_sign(trial: SensorTrial) -> None:
    """Turn the sign of all contacts."""
    _contacts(trial, lambda force, time: -force)


def contacts_spikes(trial: SensorTrial) -> None:
    """Add spikes to the forces in some of the messages."""
    size = trial.amount(10.0 ** trial.draw.uniform(2.0, 6.0))
    trial.size = f"{size:.0f} N"
    _contacts(trial, lambda force, time: force + size * (trial.draw.random() < 0.05))


def contacts_lost(trial: SensorTrial) -> None:
    """Let all forces be zero."""
    _contacts(trial, lambda force, time: 0.0 * force)


def base_jump(trial: SensorTrial) -> None:
    """Put the base elsewhere."""
    x, y, heading = trial.draw.uniform((-6.0, -6.0, -3.0), (6.0, 6.0, 3.0))
    trial.size = f"({x:.1f}, {y:.1f}) m, {heading:.1f} rad"
    odometry = trial.world.plugins["odometry"].component
    odometry.set_pose(stamped_pose("odom", np.array((x, y, 0.0)), about("z", heading), 1e-4 * np.eye(6)))


def command_spikes(trial: SensorTrial) -> None:
    """Send velocities far beyond what the base may do."""
    size = trial.amount(10.0 ** trial.draw.uniform(0.0, 4.0))
    trial.size = f"{size:.0f} m/s"

    def change(message: Any, time: float) -> None:
        if trial.draw.random() < 0.2:
            message.fields["linear"] = {**message.fields["linear"], "x": size * trial.either()}

    trial.spoil("locomotion/cmd_vel", change)


def second_stick(trial: SensorTrial) -> None:
    """Let another node send another velocity."""
    writer = MemoryMiddleware(trial.world.bus, "other").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    velocity = FieldsMessage({"linear": {**zero, "x": -0.2}, "angular": {**zero, "z": -0.3}})
    trial.world.bus.every(PERIOD, lambda: writer.write(velocity))


def _braked(trial: SensorTrial, name: str, torque: float, is_driven: bool) -> None:
    """Hold a joint by a friction torque [Nm], beside its motor or instead of it."""
    body, dof = trial.world.simulation.body, 6 + trial.joints.index(name)
    trial.size = name
    bullet, apply = body._bullet, body.apply
    count = bullet.getNumJoints(body.id, physicsClientId=body._client)
    joints = {
        bullet.getJointInfo(body.id, each, physicsClientId=body._client)[1].decode(): each for each in range(count)
    }

    def applied(torques: np.ndarray, speeds: np.ndarray) -> None:
        driven = np.array(torques)
        driven[dof] *= is_driven
        apply(driven, speeds)
        bullet.setJointMotorControl2(
            body.id,
            joints[name],
            bullet.VELOCITY_CONTROL,
            targetVelocity=0.0,
            force=torque,
            physicsClientId=body._client,
        )

    body.apply = applied


def dead_arm(trial: SensorTrial) -> None:
    """Take the current from the motor of an arm's joint: what hangs on it turns it against the friction of its gear."""
    name = trial.joint(ARMS)
    trial.falls = [trial.joints.index(name)]
    _braked(trial, name, FRICTION, is_driven=False)


def jammed_wheel(trial: SensorTrial) -> None:
    """Jam a wheel."""
    _braked(trial, trial.joint(WHEELS), JAMMED, is_driven=True)


FAULTS: dict[str, Callable[[SensorTrial], None]] = {
    each.__name__: each
    for each in (
        *(imu_jump, imu_drift, imu_freeze, imu_upside_down, gyro_sign, gyro_scale, gyro_spikes),
        *(accelerometer_jump, velocity_sign, velocities_swapped),
        *(contacts_jump, contacts_sign, contacts_spikes, contacts_lost),
        *(joints_freeze, joints_swapped, joint_jump, joint_drift, joint_sign, joint_scale, joint_spikes, joint_stuck),
        *(base_jump, command_spikes, second_stick, dead_arm, jammed_wheel),
    )
}
"""What may be wrong, by name."""

MECHANICAL = {"dead_arm", "jammed_wheel"}
"""Faults that move the robot by themselves."""

SIZES: dict[str, tuple[float, float, str]] = {
    "imu_drift": (0.01, 10.0, "rad/s"),
    "gyro_scale": (1.05, 30.0, ""),
    "gyro_spikes": (1.0, 1e3, "rad/s"),
    "accelerometer_jump": (0.1, 100.0, "m/s^2"),
    "joint_jump": (0.01, 3.0, "rad"),
    "joint_drift": (0.01, 10.0, "rad/s"),
    "joint_scale": (1.01, 10.0, ""),
    "joint_spikes": (0.01, 3.0, "rad"),
}
"""Faults that the feedback pipes name, sizes between which the smallest one lies that they name soon, and units."""

SOON, EARLIER, HALVINGS = 0.5, 1.5, 8
"""Time within which a fault is to be named, and for which pipes get messages before it [s]; how often the interval of
its size is divided."""


class Messages:
    """The messages of the sensors in a motion without a fault, and the pipes that receive them.

    Args:
        motion: One of MOTIONS.
    """

    def __init__(self, motion: str):
        self._trial = SensorTrial(motion, "", 0)
        self._world = Nodes(None)
        self._heard: list[tuple[str, Any]] = []
        pipes = {}
        for plugin in self._world.plugins.values():
            for feedback in plugin.feedbacks:
                pipes[feedback.reader.topic] = getattr(feedback, "_pipe", feedback)
        self._pipes = {topic: pipes[topic] for topic in ("imu", "joint_states")}
        for topic in self._pipes:
            self._listen(topic)
        self._trial.start(self._world)
        self._trial.go(BEFORE)
        self._begin = self._world.bus.time
        self._trial.go(SOON)
        self._heard = [each for each in self._heard if each[1].stamp > self._begin - EARLIER]
        for pipe in self._pipes.values():
            pipe.reader = SimpleNamespace(arrival=0.0)

    def close(self) -> None:
        """End the simulation."""
        self._world.close()

    def smallest(self, fault: str, seed: int) -> tuple[float, float, str]:
        """Find the smallest size that is named soon; return it, a smaller one that is not, and the reason.

        Where the largest one is not named, the size is infinite.
        """
        below, named, _ = SIZES[fault]
        reason = self._named(fault, seed, named)
        if not reason:
            return math.inf, named, "not named"
        for _ in range(HALVINGS):
            middle = math.sqrt(below * named)
            text = self._named(fault, seed, middle)
            below, named, reason = (below, middle, text) if text else (middle, named, reason)
        return named, below, reason

    def _listen(self, topic: str) -> None:
        line = self._world.bus._topics[topic]
        publish = line.publish

        def published(message: Any, sender: str, now: float) -> None:
            self._heard.append((topic, copy.deepcopy(message)))
            publish(message, sender, now)

        line.publish = published

    def _named(self, fault: str, seed: int, amount: float) -> str:
        """Return why a message is refused soon after a fault began; empty: none is."""
        trial = SensorTrial(self._trial.motion, fault, seed, amount)
        trial.world, trial.joints = self._world, self._trial.joints
        changes: dict[str, Change] = {}
        trial.spoil = changes.__setitem__  # type: ignore[method-assign]
        FAULTS[fault](trial)
        for pipe in self._pipes.values():
            pipe.restart()
        for topic, message in self._heard:
            spoiled, time, pipe = message, message.stamp - self._begin, self._pipes[topic]
            if time > 0.0 and topic in changes:
                spoiled = copy.deepcopy(message)
                changes[topic](spoiled, time)
            pipe.reader.arrival = message.stamp
            try:
                pipe._decode(spoiled)
            except SolferError as error:
                return error.line
        return ""


_compared: dict[tuple, Outcome] = {}


def _run(motion: str, fault: str, seed: int, silent: float = AFTER) -> Outcome:
    """Return what a robot does that others are compared with; each runs once."""
    key = motion, fault, seed, silent
    if key not in _compared:
        _compared[key] = SensorTrial(motion, fault, seed, silent=silent).run()
    return _compared[key]


def judge(trial: SensorTrial, outcome: Outcome) -> Outcome:
    """Add what the robot may not do.

    It is compared with what it does without a fault, and where it moves by itself (hands that stop let it sway, an arm
    without a motor falls, a wheel that jams turns it) with what it does while it comes to rest: without sensors, from
    the moment on at which the fault was named, or in which it began if it moves the robot.
    """
    usual = rests = _run(trial.motion, "", 0)
    if trial.fault in MECHANICAL:
        rests = _run(trial.motion, trial.fault, trial.seed, silent=0.0)
    elif outcome.named:
        rests = _run(trial.motion, "", 0, silent=round(min(outcome.named[0][0], AFTER), 1))
    bounds = {
        "joint": max(1.0, usual.joint, 1.2 * rests.joint),
        "base": 1.2 * max(usual.base, rests.base) + 0.03,
        "turn": 1.2 * max(usual.turn, rests.turn) + 0.1,
        "wheel": 1.2 * usual.wheel + 0.5,
        "tilt": usual.tilt + math.radians(5.0),
    }
    for name, bound in bounds.items():
        value = getattr(outcome, name)
        if not value <= bound:
            outcome.complaints.append(f"{name} {value:.3f}, {bound:.3f} at most")
    if "locomotion" in outcome.stopped and outcome.rest > 0.02:
        outcome.complaints.append(f"it stopped, and still moves by {outcome.rest:.3f} m/s")
    return outcome


def drawn(seed: int) -> SensorTrial:
    """Draw motion and fault of a trial."""
    draw = np.random.default_rng(seed)
    return SensorTrial(str(draw.choice(list(MOTIONS))), str(draw.choice(list(FAULTS))), seed)
