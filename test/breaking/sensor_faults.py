"""Sensors, motors and commands that are wrong: kinds of faults, of which a trial's seed draws the size."""

import math
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from itertools import permutations
from typing import TYPE_CHECKING, Any

import numpy as np

from solfer.components.odometry.messages import stamped_pose
from solfer.middleware.memory import MemoryMiddleware
from solfer.numerics.rotations import quaternion_product, rotated
from solfer.transport.messages import FieldsMessage, copied

if TYPE_CHECKING:
    from breaking.sensors import SensorTrial
    from solfer.simulation.robot_body.motors import DriveState

SENSORS = ("joint_states", "imu")
"""Topics of what the robot measures."""

PERIOD, LASTS = 0.02, 3.0
"""Period of those who command; how long a fault lasts that ends [s]."""

LEGS, ARMS, WHEELS = "hip knee ankle", "arm", "wheel"
"""Parts of the names of joints."""

NUMBERS = {"imu": ("orientation", "angular", "acceleration"), "joint_states": ("position", "velocity", "effort")}
"""What the messages of a topic contain."""

GRAVITY, DEGREES = 9.81, math.degrees(1.0)
"""Standard gravity [m/s^2], and degrees of a radian."""


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the quaternion of a turn about an axis of length 1, shape (3,), by an angle [rad]."""
    return np.array((*(math.sin(0.5 * angle) * axis), math.cos(0.5 * angle)))


def about(axis: str, angle: float) -> np.ndarray:
    """Return the quaternion of a turn about an axis that is named."""
    return turn_about(np.eye(3)["xyz".index(axis)], angle)


def _axis(trial: "SensorTrial") -> np.ndarray:
    """Draw an axis, shape (3,)."""
    axis = trial.draw.normal(size=3)
    return axis / np.linalg.norm(axis)


def turn_mounting(message: Any, parts: Sequence[str], axis: np.ndarray, angle: float, rate: float = 0.0) -> None:
    """Turn an IMU on its link by an angle [rad] about one of its axes, at a rate [rad/s], in some of its numbers."""
    turn = turn_about(axis, angle)
    back = turn * (-1.0, -1.0, -1.0, 1.0)
    if "orientation" in parts:
        message.orientation = np.array(quaternion_product(message.orientation, turn))
    if "angular" in parts:
        message.angular = np.array(rotated(message.angular, back)) + rate * axis
    if "acceleration" in parts:
        message.acceleration = np.array(rotated(message.acceleration, back))


def _hold(trial: "SensorTrial", topic: str, period: float, part: Sequence[str] = ()) -> None:
    """Repeat the numbers of a topic for a period each [s], those of some joints or all, with fresh stamps."""
    kept: dict[str, np.ndarray] = {}
    due = -math.inf

    def change(message: Any, time: float) -> None:
        nonlocal due
        where = [message.names.index(name) for name in part] if part else slice(None)
        is_due = time >= due
        due = time + period if is_due else due
        for name in NUMBERS[topic]:
            numbers = getattr(message, name)
            if is_due:
                kept[name] = numbers[where].copy()
            numbers[where] = kept[name]

    trial.spoil(topic, change)


def _scale(trial: "SensorTrial", topic: str, **factors: float) -> None:
    """Multiply fields of a topic by factors."""

    def change(message: Any, time: float) -> None:
        for name, factor in factors.items():
            setattr(message, name, factor * getattr(message, name))

    trial.spoil(topic, change)


def _turned(trial: "SensorTrial", turn: Callable[[float], np.ndarray]) -> None:
    def change(message: Any, time: float) -> None:
        message.orientation = np.array(quaternion_product(turn(time), message.orientation))

    trial.spoil("imu", change)


def imu_jump(trial: "SensorTrial") -> None:
    """Let the orientation jump about z."""
    angle = trial.either() * trial.amount(trial.draw.uniform(0.2, 3.0))
    trial.size = f"{angle:.2f} rad"
    _turned(trial, lambda time: about("z", angle))


def imu_drift(trial: "SensorTrial") -> None:
    """Let the orientation drift about an axis."""
    axis, rate = str(trial.draw.choice(list("xyz"))), trial.either() * trial.amount(trial.draw.uniform(0.01, 0.3))
    trial.size = f"{rate:.3f} rad/s about {axis}"
    _turned(trial, lambda time: about(axis, rate * time))


def imu_freeze(trial: "SensorTrial") -> None:
    """Freeze everything, with fresh stamps."""
    _hold(trial, "imu", math.inf)


def imu_upside_down(trial: "SensorTrial") -> None:
    """Mount it the other way round."""

    def change(message: Any, time: float) -> None:
        message.orientation = np.array(quaternion_product(message.orientation, (1.0, 0.0, 0.0, 0.0)))
        message.angular = message.angular * (1.0, -1.0, -1.0)
        message.acceleration = message.acceleration * (1.0, -1.0, -1.0)

    trial.spoil("imu", change)


def gyro_sign(trial: "SensorTrial") -> None:
    """Turn the sign of the gyroscope."""
    _scale(trial, "imu", angular=-1.0)


def gyro_scale(trial: "SensorTrial") -> None:
    """Give the gyroscope another scale."""
    scale = trial.amount(trial.draw.uniform(0.5, 2.0))
    trial.size = f"{scale:.2f}"
    _scale(trial, "imu", angular=scale)


def gyro_spikes(trial: "SensorTrial") -> None:
    """Add spikes to the gyroscope in some of the messages."""
    size = trial.amount(10.0 ** trial.draw.uniform(1.0, 6.0))
    trial.size = f"{size:.0f} rad/s"

    def change(message: Any, time: float) -> None:
        if trial.draw.random() < 0.05:
            message.angular = message.angular + size * trial.draw.choice((-1.0, 1.0), 3)

    trial.spoil("imu", change)


def accelerometer_jump(trial: "SensorTrial") -> None:
    """Add a specific force along an axis."""
    axis, size = int(trial.draw.integers(3)), trial.either() * trial.amount(trial.draw.uniform(0.5, 20.0))
    trial.size = f"{size:.2f} m/s^2 along {'xyz'[axis]}"

    def change(message: Any, time: float) -> None:
        message.acceleration = message.acceleration + size * np.eye(3)[axis]

    trial.spoil("imu", change)


def joints_freeze(trial: "SensorTrial") -> None:
    """Freeze all joints for a while, with fresh stamps."""
    trial.lasts = LASTS + 1.0  # after LASTS the references of hands, on circles, would be back where they were
    _hold(trial, "joint_states", math.inf)


def joints_swapped(trial: "SensorTrial") -> None:
    """Swap two joints of legs, or of arms."""
    part = str(trial.draw.choice((LEGS, ARMS)))
    first, second = trial.joint(part), trial.joint(part)
    trial.size = f"{first} and {second}"

    def change(message: Any, time: float) -> None:
        pair = [message.names.index(first), message.names.index(second)]
        for numbers in (message.position, message.velocity, message.effort):
            numbers[pair] = numbers[pair[::-1]]

    trial.spoil("joint_states", change)


def _joint(trial: "SensorTrial", change: Callable[[float, float, float], tuple[float, float]], part: str = "") -> None:
    """Change position and velocity of a joint that is drawn, of a leg or an arm."""
    name = trial.joint(part or str(trial.draw.choice((LEGS, ARMS))))
    trial.size = f"{name} {trial.size}"

    def changed(message: Any, time: float) -> None:
        place = message.names.index(name)
        numbers = change(message.position[place], message.velocity[place], time)
        message.position[place], message.velocity[place] = numbers

    trial.spoil("joint_states", changed)


def joint_jump(trial: "SensorTrial") -> None:
    """Shift the zero of a joint all of a sudden."""
    size = trial.either() * trial.amount(trial.draw.uniform(0.02, 1.0))
    trial.size = f"{size:.2f} rad"
    _joint(trial, lambda place, speed, time: (place + size, speed))


def joint_drift(trial: "SensorTrial") -> None:
    """Let the zero of a joint drift."""
    rate = trial.either() * trial.amount(trial.draw.uniform(0.01, 0.3))
    trial.size = f"{rate:.3f} rad/s"
    _joint(trial, lambda place, speed, time: (place + rate * time, speed))


def joint_sign(trial: "SensorTrial") -> None:
    """Turn the sign of a joint."""
    _joint(trial, lambda place, speed, time: (-place, -speed))


def joint_scale(trial: "SensorTrial") -> None:
    """Give a joint another scale."""
    scale = trial.amount(trial.draw.uniform(0.7, 1.4))
    trial.size = f"{scale:.2f}"
    _joint(trial, lambda place, speed, time: (scale * place, scale * speed))


def joint_spikes(trial: "SensorTrial") -> None:
    """Add spikes to a joint in some of the messages."""
    size = trial.amount(trial.draw.uniform(0.1, 3.0))
    trial.size = f"{size:.2f} rad"
    _joint(trial, lambda place, speed, time: (place + size * trial.either() * (trial.draw.random() < 0.05), speed))


def joint_stuck(trial: "SensorTrial") -> None:
    """Let the encoder of a joint stay where it was."""
    kept: list[float] = []

    def change(place: float, speed: float, time: float) -> tuple[float, float]:
        kept.append(place)
        return kept[0], 0.0

    _joint(trial, change)


def velocity_sign(trial: "SensorTrial") -> None:
    """Turn the sign of a joint's velocity alone."""
    _joint(trial, lambda place, speed, time: (place, -speed))


def velocities_swapped(trial: "SensorTrial") -> None:
    """Swap the velocities alone of two joints."""
    first, second = trial.joint(f"{LEGS} {ARMS}"), trial.joint(f"{LEGS} {ARMS}")
    trial.size = f"{first} and {second}"

    def change(message: Any, time: float) -> None:
        pair = [message.names.index(first), message.names.index(second)]
        message.velocity[pair] = message.velocity[pair[::-1]]

    trial.spoil("joint_states", change)


def _contacts(trial: "SensorTrial", change: Callable[[np.ndarray, float], np.ndarray]) -> None:
    """Change the forces of all contacts."""
    for topic in [name for name in trial.world.bus._topics if name.startswith("contacts/")]:
        trial.spoil(topic, lambda message, time: setattr(message, "force", change(message.force, time)))


def contacts_jump(trial: "SensorTrial") -> None:
    """Add a force to all contacts."""
    size = trial.amount(10.0 ** trial.draw.uniform(1.0, 4.0)) * trial.draw.choice((-1.0, 1.0), 3)
    trial.size = f"{size} N"
    _contacts(trial, lambda force, time: force + size)


def contacts_sign(trial: "SensorTrial") -> None:
    """Turn the sign of all contacts."""
    _contacts(trial, lambda force, time: -force)


def contacts_spikes(trial: "SensorTrial") -> None:
    """Add spikes to the forces in some of the messages."""
    size = trial.amount(10.0 ** trial.draw.uniform(2.0, 6.0))
    trial.size = f"{size:.0f} N"
    _contacts(trial, lambda force, time: force + size * (trial.draw.random() < 0.05))


def contacts_lost(trial: "SensorTrial") -> None:
    """Let all forces be zero."""
    _contacts(trial, lambda force, time: 0.0 * force)


def base_jump(trial: "SensorTrial") -> None:
    """Put the base elsewhere."""
    x, y, heading = trial.draw.uniform((-6.0, -6.0, -3.0), (6.0, 6.0, 3.0))
    trial.size = f"({x:.1f}, {y:.1f}) m, {heading:.1f} rad"
    odometry = trial.world.plugins["odometry"].component
    odometry.set_pose(stamped_pose("odom", np.array((x, y, 0.0)), about("z", heading), 1e-4 * np.eye(6)))


def command_spikes(trial: "SensorTrial") -> None:
    """Send velocities far beyond what the base may do."""
    size = trial.amount(10.0 ** trial.draw.uniform(0.0, 4.0))
    trial.size = f"{size:.0f} m/s"

    def change(message: Any, time: float) -> None:
        if trial.draw.random() < 0.2:
            message.fields["linear"] = {**message.fields["linear"], "x": size * trial.either()}

    trial.spoil("locomotion/cmd_vel", change)


def second_stick(trial: "SensorTrial") -> None:
    """Let another node send another velocity."""
    writer = MemoryMiddleware(trial.world.bus, "other").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    velocity = FieldsMessage({"linear": {**zero, "x": -0.2}, "angular": {**zero, "z": -0.3}})
    trial.world.bus.every(PERIOD, lambda: writer.write(velocity))


def _break_drive(trial: "SensorTrial", part: str, state: "DriveState") -> None:
    """Break the drive of a joint; what hangs on one without power turns it."""
    trial.size = trial.joint(part)
    if state == "free":
        trial.falls = [trial.joints.index(trial.size)]
    trial.world.simulation.set_drive(trial.size, state)


def dead_arm(trial: "SensorTrial") -> None:
    """Take the power from the motor of an arm's joint."""
    _break_drive(trial, ARMS, "free")


def jammed_wheel(trial: "SensorTrial") -> None:
    """Jam a wheel."""
    _break_drive(trial, WHEELS, "stuck")


def imu_tilt_drift(trial: "SensorTrial") -> None:
    """Let an IMU turn on its link for a while, as some of its numbers say, which agree with each other."""
    trial.lasts = LASTS
    numbers = NUMBERS["imu"]
    parts = trial.draw.permutation(numbers)[: trial.draw.integers(1, len(numbers) + 1)]
    axis, rate = _axis(trial), trial.amount(trial.draw.uniform(0.03, 0.3))
    trial.size = f"{rate:.3f} rad/s about {axis.round(2)} in {' and '.join(sorted(parts))}"
    trial.spoil("imu", lambda message, time: turn_mounting(message, parts, axis, rate * time, rate=rate))


def gyro_warms(trial: "SensorTrial") -> None:
    """Let the bias of the gyroscope grow, which the orientation integrates."""
    axis, growth = _axis(trial), trial.amount(trial.draw.uniform(0.02, 0.1))
    trial.size = f"{growth:.3f} rad/s^2 about {axis.round(2)}"
    kept: list[tuple[float, np.ndarray]] = []

    def change(message: Any, time: float) -> None:
        message.angular = message.angular + growth * time * axis
        before, orientation = kept.pop() if kept else (time, message.orientation)
        angle = (time - before) * float(np.linalg.norm(message.angular))
        turn = turn_about(message.angular / np.linalg.norm(message.angular), angle)
        message.orientation = np.array(quaternion_product(orientation, turn))
        kept.append((time, message.orientation))

    trial.spoil("imu", change)


def second_imu(trial: "SensorTrial") -> None:
    """Let another IMU, mounted otherwise, publish for a while on the same topic, under its own name or the same."""
    trial.lasts = LASTS
    name, axis, angle = str(trial.draw.choice(("", "other"))), _axis(trial), trial.draw.uniform(0.3, math.pi)
    trial.size = f"{angle:.2f} rad about {axis.round(2)}, {name or 'the same'} sender"
    line = trial.world.bus._topics["imu"]
    publish = line.publish
    newest: deque[Any] = deque(maxlen=1)
    trial.spoil("imu", lambda message, time: newest.append(message))

    def publish_other() -> None:
        if newest and trial.world.bus.time - trial.begin_of_fault < trial.lasts:
            message = copied(newest[0])
            message.stamp = message.stamp + SHIFT
            message.sender = name or message.sender
            turn_mounting(message, NUMBERS["imu"], axis, angle)
            publish(message, message.sender, trial.world.bus.time)

    trial.world.bus.every(2.0 * SHIFT, publish_other, start=trial.world.bus.time + SHIFT)


SHIFT = 0.001
"""Time from the message of an IMU to that of another one [s]."""

STAMPS: dict[str, tuple[float, float, Callable[[float, float, float, float], float]]] = {
    "stamps_jitter": (0.005, 0.08, lambda stamp, time, size, chance: stamp + chance * size),
    "stamps_late": (0.005, 0.06, lambda stamp, time, size, chance: stamp - size),
    "stamps_late_at_random": (0.005, 0.06, lambda stamp, time, size, chance: stamp - abs(chance) * size),
    "stamps_slope": (0.5, 2.0, lambda stamp, time, size, chance: stamp + (size - 1.0) * time),
    "stamps_step_ahead": (0.05, 3600.0, lambda stamp, time, size, chance: stamp + size),
    "stamps_step_back": (0.05, 3600.0, lambda stamp, time, size, chance: stamp - size),
    "stamps_zero": (1.0, 1.0, lambda stamp, time, size, chance: 0.0),
    "stamps_backwards": (1.0, 1.0, lambda stamp, time, size, chance: stamp - 2.0 * time),
}
"""Smallest and largest size of faults of stamps [s, of the slope 1], and the stamp of the stamp, the time since the
fault began, the size, and a number from -1 to 1 that is drawn for each message."""


def _stamps(trial: "SensorTrial", kind: str) -> None:
    """Give messages of joints, IMU or both wrong stamps for a while."""
    trial.lasts = LASTS
    smallest, largest, change = STAMPS[kind]
    topics = [SENSORS, *((topic,) for topic in SENSORS)][trial.draw.integers(3)]
    size = trial.amount(math.exp(trial.draw.uniform(math.log(smallest), math.log(largest))))
    trial.size = f"{size:.3g} of {' and '.join(topics)}"

    def changed(message: Any, time: float) -> None:
        message.stamp = change(message.stamp, time, size, trial.draw.uniform(-1.0, 1.0))

    for topic in topics:
        trial.spoil(topic, changed)


def _held(trial: "SensorTrial", topic: str) -> None:
    """Sample and hold a topic for a while, slower than it is published."""
    trial.lasts = LASTS
    rate = trial.amount(trial.draw.uniform(10.0, 50.0))
    trial.size = f"{rate:.0f} Hz"
    _hold(trial, topic, 1.0 / rate)


def _frozen(trial: "SensorTrial", legs: int) -> None:
    """Freeze the joints of some legs for a while, with fresh stamps."""
    trial.lasts = LASTS
    chosen = sorted(trial.draw.permutation(list("1234"))[:legs])
    trial.size = f"leg {' '.join(chosen)}"
    parts = f"{LEGS} {WHEELS}".split()
    names = [name for name in trial.joints if name[-1] in chosen and any(part in name for part in parts)]
    _hold(trial, "joint_states", math.inf, names)


def velocities_zero(trial: "SensorTrial") -> None:
    """Let all velocities of joints be zero for a while."""
    trial.lasts = LASTS
    _scale(trial, "joint_states", velocity=0.0)


def velocities_lag(trial: "SensorTrial") -> None:
    """Let all velocities of joints be those of 0.2 s ago for a while."""
    trial.lasts = LASTS
    received: deque[tuple[float, np.ndarray]] = deque()

    def change(message: Any, time: float) -> None:
        received.append((time, message.velocity))
        while received[0][0] < time - LAG:
            received.popleft()
        message.velocity = received[0][1].copy()

    trial.spoil("joint_states", change)


LAG = 0.2
"""Age of velocities that lag [s]."""


def imu_without_gravity(trial: "SensorTrial") -> None:
    """Let the accelerometer measure the acceleration instead of the specific force."""

    def change(message: Any, time: float) -> None:
        weight = rotated((0.0, 0.0, GRAVITY), message.orientation * (-1.0, -1.0, -1.0, 1.0))
        message.acceleration = message.acceleration - weight

    trial.spoil("imu", change)


def imu_axes_swapped(trial: "SensorTrial") -> None:
    """Swap axes of gyroscope and accelerometer."""
    order = list(list(permutations(range(3)))[trial.draw.integers(1, 6)])
    trial.size = "".join("xyz"[each] for each in order)

    def change(message: Any, time: float) -> None:
        message.angular = message.angular[order]
        message.acceleration = message.acceleration[order]

    trial.spoil("imu", change)


def imu_wxyz(trial: "SensorTrial") -> None:
    """Publish the quaternion in another order."""
    trial.spoil("imu", lambda message, time: setattr(message, "orientation", np.roll(message.orientation, 1)))


def wheel_scale(trial: "SensorTrial") -> None:
    """Give the encoder of a wheel another scale from now on: its position goes on where it is."""
    scale = trial.amount(trial.draw.choice((0.48, 1.94)))
    trial.size = f"{scale:.2f}"
    first: list[float] = []

    def change(place: float, speed: float, time: float) -> tuple[float, float]:
        first.append(place)
        return first[0] + scale * (place - first[0]), scale * speed

    _joint(trial, change, WHEELS)


def legs_drift(trial: "SensorTrial") -> None:
    """Let several encoders of legs drift together for a while, in position and velocity."""
    trial.lasts = LASTS
    names = [name for name in trial.joints if any(part in name for part in LEGS.split())]
    drifting = trial.draw.permutation(names)[: trial.draw.integers(2, len(names) + 1)]
    rates = trial.amount(trial.draw.uniform(0.15, 0.25)) * trial.draw.choice((-1.0, 1.0), len(drifting))
    trial.size = f"{abs(rates[0]):.3f} rad/s of {len(drifting)} joints"

    def change(message: Any, time: float) -> None:
        places = [message.names.index(name) for name in drifting]
        message.position[places] += rates * time
        message.velocity[places] += rates

    trial.spoil("joint_states", change)


FAULTS: dict[str, Callable[["SensorTrial"], None]] = {
    each.__name__: each
    for each in (
        *(imu_jump, imu_drift, imu_freeze, imu_upside_down, gyro_sign, gyro_scale, gyro_spikes),
        *(accelerometer_jump, velocity_sign, velocities_swapped),
        *(contacts_jump, contacts_sign, contacts_spikes, contacts_lost),
        *(joints_freeze, joints_swapped, joint_jump, joint_drift, joint_sign, joint_scale, joint_spikes, joint_stuck),
        *(base_jump, command_spikes, second_stick, dead_arm, jammed_wheel),
        *(imu_tilt_drift, gyro_warms, second_imu, imu_without_gravity, imu_axes_swapped, imu_wxyz),
        *(velocities_zero, velocities_lag, wheel_scale, legs_drift),
    )
}
FAULTS |= {kind: partial(_stamps, kind=kind) for kind in STAMPS}
FAULTS |= {
    "joints_held": partial(_held, topic="joint_states"),
    "imu_held": partial(_held, topic="imu"),
    "leg_frozen": partial(_frozen, legs=1),
    "legs_frozen": partial(_frozen, legs=4),
    "imu_in_g": partial(_scale, topic="imu", acceleration=1.0 / GRAVITY),
    "gyro_in_degrees": partial(_scale, topic="imu", angular=DEGREES),
    "joints_in_degrees": partial(_scale, topic="joint_states", position=DEGREES, velocity=DEGREES),
    "effort_sign": partial(_scale, topic="joint_states", effort=-1.0),
    "effort_hundredfold": partial(_scale, topic="joint_states", effort=100.0),
}
"""What may be wrong, by name."""

DRIVES = {
    f"{state}_{name}": partial(_break_drive, part=part, state=state)
    for name, part in (("wheel", WHEELS), ("steering", "ankle_yaw"), ("leg", "hip knee ankle_pitch"), ("arm", ARMS))
    for state in ("free", "stuck")
}
"""Drives that break, by name."""

MECHANICAL = {"dead_arm", "jammed_wheel", *DRIVES}
"""Faults that move the robot by themselves."""

COMMANDS = {"command_spikes"}
"""Faults that the robot obeys as far as it may: nobody has to name them."""
