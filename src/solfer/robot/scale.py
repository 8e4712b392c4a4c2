"""The scale of a robot, and numbers of a configuration that are far beyond it: most of them have another unit."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from solfer.config.records.robot_names import WrittenNumber
from solfer.errors import SolferError
from solfer.model.contacts import ContactRecord, read_contacts
from solfer.model.urdf.description import Description

Rule = Callable[["RobotScale", float], str]
"""Says what is odd about a number, beside a robot; an empty text: nothing."""

GRAVITY = 9.81  # [m/s^2]


@dataclass(frozen=True)
class RobotScale:
    """How large, fast and strong a robot is; zero and infinity are what is not known.

    Attributes:
        span: Length of the longest way along its links [m].
        speed: Largest speed limit of a joint that turns [rad/s].
        weight: Weight of all links [N].
        torque: Largest effort limit of a joint [Nm, N].
        wheel: Radius of its largest wheel, ring and tube [m].
        tube: Radius of its thickest wheel's tube [m].
        ring: Radius of its largest wheel's ring [m].
        rate: Rate of the control cycle [Hz].
    """

    span: float = math.inf
    speed: float = math.inf
    weight: float = math.inf
    torque: float = math.inf
    wheel: float = math.inf
    tube: float = math.inf
    ring: float = math.inf
    rate: float = 0.0

    @classmethod
    def of(cls, description: Description, contacts: tuple[ContactRecord, ...], rate: float) -> "RobotScale":
        """Measure a robot that has `contacts`, and a control cycle of `rate` [Hz]; zero: not known."""
        speeds = [joint.velocity for joint in description.moving_joints if joint.type != "prismatic"]
        efforts = [joint.effort for joint in description.moving_joints]
        wheels = [each for each in contacts if each.type == "wheel"]
        return cls(
            span=max(_span(description), 1.0),  # a URDF does not know how long the last links are
            speed=_largest(speeds),
            weight=_largest([GRAVITY * sum(link.mass or 0.0 for link in description.links.values())]),
            torque=_largest(efforts),
            wheel=_largest([(each.minor_axis or 0.0) + (each.major_axis or 0.0) for each in wheels]),
            tube=_largest([each.minor_axis for each in wheels]),
            ring=_largest([each.major_axis for each in wheels]),
            rate=rate,
        )


def oddity(number: WrittenNumber, scale: RobotScale) -> str:
    """Return what is odd about a number beside a robot; empty: nothing, or it has several units or none."""
    unit = number.units[0] if len(number.units) == 1 else ""
    rule = _RULES.get((unit, number.compared.size))
    what = "" if rule is None else rule(scale, number.value)
    return what or _beside_default(number, unit)


def _beside_default(number: WrittenNumber, unit: str) -> str:
    """Return that a number is far from the default of its field; empty: it is not, or there is none."""
    if number.default <= 0.0 or number.value <= 0.0 or (number.units and not unit) or number.compared.size == "nothing":
        return ""
    ratio = number.value / number.default
    # what has no unit, as weights and damping, may be as small as it likes
    much, little = _SLIPS.get(unit, (_THOUSAND, _THOUSANDTH if unit else 0.0))
    if number.compared.factor:
        much = number.compared.factor
        little = 0.0 if unit == "1/s" else 1.001 / much  # a gain may be as small as it likes, too
    if little < ratio < 0.999 * much:
        return ""
    other = _OTHER_UNITS.get(unit)
    is_nearer = other is not None and (other[1] > 1.0) == (ratio < 1.0)
    meant = f"; {number.value:g} {other[0]} are {other[1] * number.value:.4g} {unit}" if other and is_nearer else ""
    written = f"{number.value:g} {unit}".rstrip()
    usual = f"{number.default:g} {unit}".rstrip()
    what = "the usual" if number.compared.usual else "the default,"
    return f"{written} is {ratio:.4g} times {what} {usual}{meant}"


@lru_cache(maxsize=8)
def contacts_of(path: Path | None, robot: str) -> tuple[ContactRecord, ...]:
    """Read the contacts of a robot; none if there is no file, or if it has mistakes, which are reported elsewhere."""
    try:
        return () if path is None else read_contacts(path, robot)
    except SolferError:
        return ()


@cache
def scale_of(urdf: Path, contacts: tuple[ContactRecord, ...], rate: float) -> RobotScale:
    """Measure the robot of a URDF; see `RobotScale.of`."""
    return RobotScale.of(Description.from_file(urdf), contacts, rate)


def _largest(values: list[float | None]) -> float:
    """Return the largest value; infinity if one is not known, or zero."""
    return math.inf if not values or not all(values) else max(value for value in values if value is not None)


def _span(description: Description) -> float:
    """Return the length of the longest path between two links [m]."""
    longest = 0.0
    depths = dict.fromkeys(description.links, 0.0)  # length of the longest way from a link to one that it carries
    for name in reversed(description.subtree(description.root)):
        above = description.links[name].parent
        if above is None or description.joints[above].type == "floating":
            continue
        joint = description.joints[above]
        stroke = max(abs(joint.lower or 0.0), abs(joint.upper or 0.0)) if joint.type == "prismatic" else 0.0
        depth = depths[name] + math.hypot(*joint.xyz) + stroke
        longest = max(longest, depths[joint.parent] + depth)
        depths[joint.parent] = max(depths[joint.parent], depth)
    return longest


def _length(scale: RobotScale, value: float) -> str:
    if abs(value) <= scale.span:
        return ""
    return f"{value:g} m is longer than the robot, which spans {scale.span:.2g} m; {_smaller(value)}"


def _wheel(scale: RobotScale, value: float) -> str:
    if math.isinf(scale.wheel):
        return _length(scale, value)
    if value <= 3.0 * scale.wheel:
        return ""
    return f"{value:g} m, and the robot's wheels have a radius of {scale.wheel:.3g} m; {_smaller(value)}"


def _radius(scale: RobotScale, value: float) -> str:
    return _part_of_wheel(scale, value, scale.wheel, what="radius")


def _tube(scale: RobotScale, value: float) -> str:
    return _part_of_wheel(scale, value, scale.tube, what="tube")


def _ring(scale: RobotScale, value: float) -> str:
    return _part_of_wheel(scale, value, scale.ring, what="ring")


def _part_of_wheel(scale: RobotScale, value: float, expected: float, what: str) -> str:
    """Compare a length with the one of the robot's wheels, if that is known, or with the wheels [m]."""
    if math.isinf(expected):
        return _wheel(scale, value)
    if value <= 3.0 * expected <= 9.0 * value:
        return ""
    meant = f"; {_smaller(value)}" if value > expected else ""
    return f"{value:g} m, and the robot's wheels have a {what} of {expected:.3g} m{meant}"


def _distance(_: RobotScale, value: float) -> str:
    longest = 100.0  # [m] that robots go away
    return f"{value:g} m is far away for a robot; {_smaller(value)}" if abs(value) > longest else ""


def _smaller(value: float) -> str:
    return f"{value:g} mm are {value / 1000:.4g} m, {value:g} cm are {value / 100:.4g} m"


def _joint_speed(scale: RobotScale, value: float) -> str:
    if abs(value) <= scale.speed:
        return ""
    return (
        f"{value:g} rad/s is faster than the joints of the robot, up to {scale.speed:g} rad/s; "
        f"{value:g} deg/s are {math.radians(value):.4g} rad/s"
    )


def _degrees_a_second(scale: RobotScale, value: float) -> str:
    speed = math.degrees(scale.speed)
    if value <= speed:
        return ""
    return f"{value:g} deg/s is faster than the joints of the robot, up to {speed:.3g} deg/s"


def _speed(_: RobotScale, value: float) -> str:
    fastest = 10.0  # [m/s] at which legged robots run, and hands move
    if abs(value) <= fastest:
        return ""
    return f"{value:g} m/s is faster than robots move, {fastest:g} m/s; {value:g} cm/s are {value / 100:.4g} m/s"


def _rim_speed(scale: RobotScale, value: float) -> str:
    rim = scale.wheel * scale.speed
    if math.isinf(rim):
        return _speed(scale, value)
    if value <= rim:
        return ""
    return (
        f"{value:g} m/s is faster than the wheels roll, up to {rim:.2g} m/s; {value:g} cm/s are {value / 100:.4g} m/s"
    )


def _acceleration(_: RobotScale, value: float) -> str:
    if value <= 3.0 * GRAVITY:
        return ""
    return f"{value:g} m/s2 is more than three times gravity; {value:g} cm/s2 are {value / 100:.4g} m/s2"


def _turn_acceleration(scale: RobotScale, value: float) -> str:
    if value <= 20.0 * scale.speed:
        return ""
    return (
        f"{value:g} rad/s2 is the largest speed of the joints within {1000 * scale.speed / value:.2g} ms; "
        f"{value:g} deg/s2 are {math.radians(value):.4g} rad/s2"
    )


def _gain(scale: RobotScale, value: float) -> str:
    if not scale.rate or value <= scale.rate:
        return ""
    fate = "it diverges" if value > 2.0 * scale.rate else "it overshoots"
    return (
        f"{value:g} 1/s corrects {value / scale.rate:.3g} times the error in each cycle, so that {fate}; "
        f"expected below {scale.rate:g} 1/s at {scale.rate:g} Hz"
    )


def _frequency(scale: RobotScale, value: float) -> str:
    if not scale.rate or value < 0.5 * scale.rate:
        return ""
    return f"{value:g} Hz has no effect at {scale.rate:g} Hz; expected below half of that"


def _time(scale: RobotScale, value: float) -> str:
    longest = 60.0  # [s] that controllers wait
    if value > longest:
        return f"{value:g} s is long for a robot, above {longest:g} s; {value:g} ms are {value / 1000:.4g} s"
    if scale.rate and 0.0 < value * scale.rate < 0.999:
        return f"{value:g} s is shorter than a control cycle, {1.0 / scale.rate:.4g} s at {scale.rate:g} Hz"
    return ""


def _force(scale: RobotScale, value: float) -> str:
    return f"{value:g} N is more than the robot weighs, {scale.weight:.3g} N" if value > scale.weight else ""


def _torque(scale: RobotScale, value: float) -> str:
    if value <= scale.torque:
        return ""
    return f"{value:g} Nm is more than a joint of the robot can give, {scale.torque:g} Nm"


def _effort(scale: RobotScale, value: float) -> str:
    strongest = max(scale.weight, scale.torque)
    if value <= strongest:
        return ""
    return f"{value:g} is more than the robot can give or weighs, {strongest:.3g} N or Nm"


def _stiffness(scale: RobotScale, value: float) -> str:
    """Compare a spring with one that gives all torque of the strongest joint for a hundredth of its unit."""
    stiffest = 100.0 * scale.torque
    if value <= stiffest:
        return ""
    return f"{value:g} gives {scale.torque:g} Nm, as the strongest joint, below 0.01 rad; expected {stiffest:g} at most"


def _damping(scale: RobotScale, value: float) -> str:
    """Compare a damper with one that takes all torque of the strongest joint at a thirtieth of the largest speed."""
    largest = 30.0 * scale.torque / scale.speed if math.isfinite(scale.speed) else math.inf
    if value <= largest:
        return ""
    return (
        f"{value:g} takes {scale.torque:g} Nm, as the strongest joint gives, below {scale.speed / 30.0:.2g} rad/s; "
        f"expected {largest:.0f} at most"
    )


def _slope(_: RobotScale, value: float) -> str:
    return f"{value:g} deg is more than a turn" if value > 360.0 else ""


_THOUSAND = 1000.0  # of who writes thousandths of a unit
_THOUSANDTH = 1.001 / _THOUSAND  # rounded up
_SLIPS: dict[str, tuple[float, float]] = {
    "deg": (_THOUSAND, 1.0 / 30.0),  # of who writes radians
    "rad": (30.0, _THOUSANDTH),
    "rad/s": (30.0, _THOUSANDTH),  # of who writes degrees
    "rad/s2": (30.0, _THOUSANDTH),
    "s": (100.0, 0.0),
}
"""How many times the default of its field a number hardly is, by its unit: from, and up to."""

_OTHER_UNITS: dict[str, tuple[str, float]] = {
    "deg": ("rad", math.degrees(1.0)),
    "rad": ("deg", math.radians(1.0)),
    "rad/s": ("deg/s", math.radians(1.0)),
    "rad/s2": ("deg/s2", math.radians(1.0)),
    "s": ("ms", 1e-3),
}
"""What may have been written instead of a unit, and how much of it that is."""

_RULES: dict[tuple[str, str], Rule] = {
    ("m", ""): _length,
    ("m", "wheel"): _wheel,
    ("m", "radius"): _radius,
    ("m", "tube"): _tube,
    ("m", "ring"): _ring,
    ("m", "world"): _distance,
    ("rad/s", ""): _joint_speed,
    ("deg/s", ""): _degrees_a_second,
    ("m/s", ""): _speed,
    ("m/s", "wheel"): _rim_speed,
    ("m/s2", ""): _acceleration,
    ("m/s^2", ""): _acceleration,
    ("rad/s2", ""): _turn_acceleration,
    ("1/s", ""): _gain,
    ("Hz", ""): _frequency,
    ("s", ""): _time,
    ("N", ""): _force,
    ("Nm", ""): _torque,
    ("N, Nm", ""): _effort,
    ("Nm, N", ""): _effort,
    ("deg", ""): _slope,
    ("Nm/rad, N/m", ""): _stiffness,
    ("Nms/rad, Ns/m", ""): _damping,
}
"""Rules by the unit of a number and what it is compared with."""
