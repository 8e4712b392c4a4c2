"""Figures of the demonstration of Fig. 5: the true motion of the robot, against the desired one of its recording."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from solfer.recording.model import Channel, Recording
from solfer.robot import Robot
from solfer.transport import BodyMessage
from solfer.transport.middleware import HealthReport
from solfer_tools.demo.driving_record import DrivingRecorder
from solfer_tools.demo.report import LAYER, Row, layer, published
from solfer_tools.demo.waving import hands_of
from solfer_tools.navigation.course import heading_of

SAMPLE_PERIOD = 0.04
"""Period in which the motion of the robot is sampled [s]."""

RING_RADIUS = 0.01
"""Radius of a wheel's ring, to the centre of its tube [m]."""

TUBE_RADIUS = 0.068
"""Radius of a wheel's tube [m]."""

EXCESS_MARK = "  <-- more than "
"""Marks a figure that is larger than it may be."""

WHEEL_NAMES = tuple(f"wheel_{leg}" for leg in (1, 2, 3, 4))
PLUGINS = ("hands", "odometry", "ground_forces", "locomotion", "full_compensation")


@dataclass(frozen=True)
class Seen:
    """What the robot truly did; rows are looks, the base is seen from where it began.

    Attributes:
        time: Stamps [s], shape (k,).
        position: DoFs, shape (k, n).
        base: x, y, heading, shape (k, 3) [m, rad].
        tracked: Centre of mass of the legs in the world, x and y, shape (k, 2) [m].
        center: Centre of mass as seen from the heading of the base, shape (k, 3) [m].
        vertices: Lowest points of the wheels, as seen from there, x and y, shape (k, 4, 2) [m].
        hands: Hands as seen from the base, shape (k, 2, 3) [m].
    """

    time: np.ndarray
    position: np.ndarray
    base: np.ndarray
    tracked: np.ndarray
    center: np.ndarray
    vertices: np.ndarray
    hands: np.ndarray


@dataclass(frozen=True, eq=False)
class Tracked:
    """A measured quantity beside its desired one.

    Attributes:
        names: Names of the columns.
        desired: Shape (k, len(names)) [m].
        measured: Shape (k, len(names)) [m].
        width: Numbers of one place: columns of x and y, or of x, y and z.
    """

    names: tuple[str, ...]
    desired: np.ndarray
    measured: np.ndarray
    width: int

    @property
    def distances(self) -> np.ndarray:
        """Distance of each place from its desired one, shape (k, places) [m]."""
        errors = self.desired - self.measured
        return np.linalg.norm(errors.reshape(len(errors), -1, self.width), axis=2)


def tracked(recorder: DrivingRecorder, seen: Seen, recording: Recording) -> dict[str, Tracked]:
    """Return the measured places beside the desired ones of the recording: centre of mass, vertices and hands."""
    times = recorder.clocks["measured"].times(seen.time)
    count = len(times)
    vertices = tuple(f"{wheel}.{axis}" for wheel in WHEEL_NAMES for axis in "xy")
    hands = tuple(f"{hand}.{axis}" for hand in ("left", "right") for axis in "xyz")
    center = _at(recording["locomotion/log/base_reference"], times, ("x", "y"))
    desired = {
        "centre of mass of the legs, from its reference": center - center[0],
        "vertices": _at(recording["locomotion/log/vertex_reference"], times, vertices),
        "hands": _at(recording["hands/log/reference"], times, hands),
    }
    measured = (seen.tracked - seen.tracked[0], seen.vertices.reshape(count, -1), seen.hands.reshape(count, -1))
    names = (("x", "y"), vertices, hands)
    return {
        title: Tracked(columns, desired[title], places, width=width)
        for title, columns, places, width in zip(desired, names, measured, (2, 2, 3), strict=True)
    }


def see(robot: Robot, legs: Robot, recorder: DrivingRecorder) -> Seen:
    """Compute what the robot, and its legs, did from joints and the true base."""
    kinematics = robot.kinematics
    of_legs = [robot.dof(name) for name in legs.dofs]
    rows = []
    for base in _bases(robot, recorder):
        q = robot.state.position
        rotation = kinematics.rotation("pelvis")
        place = kinematics.position("pelvis")
        heading = math.atan2(rotation[1, 0], rotation[0, 0])
        cos = math.cos(heading)
        sin = math.sin(heading)
        yaw = np.array(((cos, -sin, 0.0), (sin, cos, 0.0), (0.0, 0.0, 1.0)))
        legs.kinematics.update(q[of_legs])
        tracked = legs.kinematics.center_of_mass[:2].copy()
        robot.center_of_mass.update()
        center = yaw.T @ (robot.center_of_mass.value - place)
        vertices = np.array([(_vertex(robot, wheel) - place) @ yaw for wheel in WHEEL_NAMES])[:, :2]
        hands = np.array(list(hands_of(robot).values()))
        rows.append((base.stamp, q.copy(), np.array((place[0], place[1], heading)), tracked, center, vertices, hands))
    time, position, bases, *others = (np.array(column) for column in zip(*rows, strict=True))
    return Seen(time, position, _from_begin(bases), *others)


def _bases(robot: Robot, recorder: DrivingRecorder) -> Iterator[BodyMessage]:
    """Yield the true base once each `SAMPLE_PERIOD`, and let the Robot be as it was measured then."""
    joints = recorder.messages["measured"]
    times = np.array([each.stamp for each in joints])
    dofs = [robot.dof(name) for name in joints[0].names]
    q = robot.state.position
    v = robot.state.velocity
    last = -math.inf
    for base in recorder.messages["base"]:
        if base.stamp - last < SAMPLE_PERIOD or base.stamp > times[-1]:
            continue
        last = base.stamp
        near = joints[min(int(np.searchsorted(times, last)), len(joints) - 1)]
        q[dofs], v[dofs] = near.position, near.velocity
        robot.kinematics.base.from_pose(base.position, base.orientation, q[:6])
        v[:6] = 0.0
        robot.update()
        yield base


def _vertex(robot: Robot, wheel: str) -> np.ndarray:
    """Return the lowest point of a wheel in the world [m]."""
    axle = robot.kinematics.rotation(wheel)[:, 2]
    down = np.array((0.0, 0.0, 1.0)) - axle * axle[2]
    return robot.kinematics.position(wheel) - RING_RADIUS * down / np.linalg.norm(down) - (0.0, 0.0, TUBE_RADIUS)


def _from_begin(base: np.ndarray) -> np.ndarray:
    """Return places and headings as seen from the first one, shape (k, 3) [m, rad]."""
    x, y, heading = base[0]
    cos = math.cos(heading)
    sin = math.sin(heading)
    dx = base[:, 0] - x
    dy = base[:, 1] - y
    return np.stack((cos * dx + sin * dy, cos * dy - sin * dx, np.unwrap(base[:, 2]) - heading), axis=1)


def _at(channel: Channel, times: np.ndarray, columns: tuple[str, ...]) -> np.ndarray:
    """Interpolate columns of a channel, shape (len(times), len(columns))."""
    return np.stack([np.interp(times, channel.times, channel.column(name)) for name in columns], axis=1)


def _size(errors: np.ndarray) -> str:
    """Format RMS and largest of distances [m]."""
    return f"{1e3 * math.sqrt(float(np.mean(errors**2))):.1f} mm RMS, {1e3 * float(errors.max()):.1f} mm at most"


def table(
    robot: Robot,
    recorder: DrivingRecorder,
    seen: Seen,
    places: Mapping[str, Tracked],
    reports: Mapping[str, HealthReport],
    *,
    waited: bool = False,
) -> list[Row]:
    """Build the closing table.

    Args:
        robot: The Robot, for its weight.
        recorder: What was seen.
        seen: What the robot did.
        places: Measured beside desired, see `tracked`.
        reports: Health of the nodes.
        waited: Whether the simulation waited for the plugins, which is no loss of time.
    """
    distance = float(np.linalg.norm(np.diff(seen.base[:, :2], axis=0), axis=1).sum())
    turned = math.degrees(float(seen.base[-1, 2]))
    moved = np.linalg.norm(seen.center - seen.center[0], axis=1)
    width = seen.vertices[:, 0, 1] - seen.vertices[:, 1, 1]
    tilt = math.degrees(float(np.abs(seen.position[:, 3:5]).max()))
    driven = f"{distance:.2f} m, turned by {turned:.0f} degrees"
    rows = [
        ("driven", driven + bounded(tilt, 30.0, "degrees of tilt: it fell")),
        ("narrowest, widest stance", f"{width.min():.3f} m, {width.max():.3f} m"),
        *((title, _size(each.distances)) for title, each in places.items() if title != "hands"),
        ("hands", _size(off := places["hands"].distances) + bounded(1e3 * float(off.max()), 50.0, "mm")),
        ("centre of mass, moved by the arms", f"{1e3 * float(moved.max()):.1f} mm at most"),
        ("odometry against truth", _drift(recorder, seen, distance)),
        ("slip, fraction of the way of wheels", f"{_slip(robot, recorder):.1e}"),
        ("forces of the ground", _forces(robot, recorder)),
    ]
    return rows + _health(reports, waited) + layer(reports)


def _drift(recorder: DrivingRecorder, seen: Seen, distance: float) -> str:
    """Report how far the estimate of the base is off at the end; the robot rests there, so that stamps do not count."""
    poses = np.array([(*each.position[:2], heading_of(each.orientation)) for each in recorder.messages["odometry"]])
    x, y, heading = _from_begin(poses)[-1] - seen.base[-1]
    off = math.hypot(x, y)
    turned = math.degrees(math.remainder(heading, math.tau))
    percent = 100.0 * off / distance if distance > 0.1 else 0.0
    of_distance = f", {percent:.2f} % of the way" if percent else ""
    figure = f"{1e3 * off:.1f} mm{of_distance}, {turned:.2f} degrees at the end"
    return figure + bounded(percent, 0.3, "%") + bounded(abs(turned), 0.8, "degrees")


def bounded(value: float, most: float, unit: str) -> str:
    """Return what marks a figure: nothing where it is no larger than it may be."""
    return "" if value <= most else f"{EXCESS_MARK}{most:g} {unit}"


def _slip(robot: Robot, recorder: DrivingRecorder) -> float:
    """Compute the displacement of the wheels' material over the ground, as a fraction of the path of their centres."""
    kinematics = robot.kinematics
    slid = gone = 0.0
    for base in _bases(robot, recorder):
        place = kinematics.position("pelvis")
        for wheel in WHEEL_NAMES:
            rates = kinematics.jacobian(wheel) @ robot.state.velocity
            center = rates[:3] + base.linear + np.cross(base.angular, kinematics.position(wheel) - place)
            spin = rates[3:] + base.angular
            material = center + np.cross(spin, (0.0, 0.0, -RING_RADIUS - TUBE_RADIUS))
            slid += float(np.linalg.norm(material[:2]))
            gone += float(np.linalg.norm(center[:2]))
    return slid / gone if gone else 0.0


def _forces(robot: Robot, recorder: DrivingRecorder) -> str:
    """Report how much of the weight the estimated forces carry."""
    weight = 9.81 * robot.kinematics.mass
    sums = np.array([each.values[:, 2].sum() for each in recorder.messages["forces"]]) / weight
    return f"carry {100.0 * float(sums.mean()):.1f} % of the weight, {100.0 * float(sums.std()):.1f} % RMS about it"


def _health(reports: Mapping[str, HealthReport], waited: bool) -> list[Row]:
    """List times of cycles, ages of feedbacks, counts and the real-time factor."""
    rows: list[Row] = []
    for name in PLUGINS:
        values = reports[name].values if name in reports else {}
        if "cycle median [ms]" in values:
            median, most = (float(values[f"cycle {each} [ms]"]) for each in ("median", "p99"))
            rows.append((f"cycle of {name}", f"{median:.2f} ms median, {most:.2f} ms 99 %"))
    if "full_compensation" in reports:
        rows += published(reports["full_compensation"].values)
    simulation = reports["simulation"].values if "simulation" in reports else {}
    factor = simulation.get("real-time factor")
    if factor is None:
        return [*rows, ("real-time factor", "not reported")]
    lost = "" if waited else f", {float(simulation.get('time lost [s]', 0.0)):.1f} s lost"
    return [*rows, ("real-time factor", f"{float(factor):.2f} lately{lost}")]


def warning(reports: Mapping[str, HealthReport], seen: Seen, taken: float, waited: bool = False) -> str:
    """Return the remark about a run that did not hold real time; empty: it did.

    Args:
        reports: Health of the nodes.
        seen: What the robot did.
        taken: Time that passed for third parties meanwhile [s].
        waited: Whether the simulation waited for the plugins: then it lost nothing.
    """
    if waited:
        return ""
    lowest_factor = 0.95
    factor = float(seen.time[-1] - seen.time[0]) / taken if taken > 0.0 else 1.0
    lost = float(reports["simulation"].values.get("time lost [s]", 0.0)) if "simulation" in reports else 0.0
    reasons = []
    if factor < lowest_factor or lost > (1.0 - lowest_factor) * taken:
        reasons.append(f"{lost:.1f} s of simulated time were lost")
    for name in (*PLUGINS, LAYER):
        values = reports[name].values if name in reports else {}
        skipped, cycles = (float(values.get(key, 0.0)) for key in ("skipped periods", "cycles"))
        if skipped > 0.1 * (skipped + cycles):
            reasons.append(f"{name} left out {100.0 * skipped / (skipped + cycles):.0f} % of its periods")
    if not reasons:
        return ""
    return (
        f"warning: real time was not held, {', '.join(reasons)}: the figures below suffer; "
        "./run demo --lockstep lets the simulation wait for the plugins"
    )
