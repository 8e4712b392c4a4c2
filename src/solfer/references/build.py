"""From the record of a reference to what generates it."""

import math
from collections.abc import Sequence

import numpy as np

from solfer.config.tasks.references import (
    CircleReferenceRecord,
    ReferenceRecord,
    SineReferenceRecord,
    WaypointReferenceRecord,
)
from solfer.config.yaml.files import located
from solfer.errors import ConfigError, SizeMismatch, UnknownName
from solfer.references.generator import QUANTITY_SIZES, LineReference, ReferenceGenerator, Swing
from solfer.references.table import joints_in, read_table, require_length
from solfer.references.timed import TimedReference

POSTURE = "posture"
"""The quantity of joints."""

_KINDS = {
    "position": ("circle", "line", "sine", "waypoints", "file"),
    "orientation": ("waypoints", "file"),
    "pose": ("circle", "line", "sine", "waypoints", "file"),
    POSTURE: ("sine", "waypoints", "file"),
}


def build_reference(record: ReferenceRecord, quantity: str, joints: Sequence[str] = ()) -> ReferenceGenerator:
    """Build a reference.

    Args:
        record: What it is.
        quantity: 'position', 'orientation', 'pose' or 'posture'.
        joints: Names of the joints of a posture.

    Raises:
        ConfigError: It does not fit the quantity, or its file is wrong.
        SizeMismatch: There are too few or too many numbers.
        UnknownName: There is no such joint.
    """
    if record.kind not in _KINDS[quantity]:
        raise ConfigError(
            f"there is no {record.kind} of this: it has {'joints' if quantity == POSTURE else 'no position'}",
            where=record.where(record.kind),
            expected=", ".join(_KINDS[quantity]),
        )
    size, rates = QUANTITY_SIZES.get(quantity, (len(joints), len(joints)))
    if record.circle is not None:
        return _circle(record.circle, size, rates)
    if record.line is not None:
        line = record.line
        return LineReference(
            size,
            rates,
            np.array(line.to),
            speed=line.speed,
            duration=line.duration,
            back=line.back,
            absolute=record.absolute,
        )
    if record.sine is not None:
        return _sine(record.sine, size, rates, joints=joints)
    columns = {
        "position": ("x", "y", "z"),
        "orientation": ("qx", "qy", "qz", "qw"),
        "pose": ("x", "y", "z", "qx", "qy", "qz", "qw"),
        POSTURE: tuple(joints),
    }[quantity]
    if record.waypoints is not None:
        times, values = _waypoints(record, record.waypoints, quantity, columns=columns)
    else:
        times, values = _table(record, quantity, columns)
    if record.absolute and times[0] == 0.0:
        raise ConfigError(
            "it would jump to its first values at 0 s",
            where=record.where(record.kind),
            expected="a first time above 0 s, in which it goes there, or no 'absolute'",
        )
    return TimedReference(rates, times, values, absolute=record.absolute)


def joints_of(record: ReferenceRecord) -> list[str]:
    """Return the joints that a reference names.

    Raises:
        ConfigError: It names none.
    """
    names: list[str] = []
    if record.sine is not None and isinstance(record.sine.amplitude, dict):
        names = list(record.sine.amplitude)
    elif record.waypoints is not None:
        names = list(dict.fromkeys(name for point in record.waypoints for name in point.joints or ()))
    elif record.file is not None:
        where = record.where("file")
        names = joints_in(located(record.file, record.folder("file"), where), where)
    if not names:
        raise ConfigError(
            "it names no joint",
            where=record.where(record.kind),
            expected="sine: amplitude by name; waypoints: joints by name; file: a first line with names",
        )
    return names


def _circle(record: CircleReferenceRecord, size: int, rates: int) -> Swing:
    axes = np.eye(3)
    if record.plane is not None:
        first, second = (axes["xyz".index(axis)] for axis in record.plane)
    else:
        normal = np.array(record.normal)
        normal /= np.linalg.norm(normal)
        first = axes[np.abs(normal).argmin()]
        first = first - first.dot(normal) * normal
        first /= np.linalg.norm(first)
        second = np.cross(normal, first)
    return Swing(
        size, rates, record.radius * first, sine=record.radius * second, period=record.period, turns=record.turns
    )


def _sine(record: SineReferenceRecord, size: int, rates: int, joints: Sequence[str]) -> Swing:
    count = len(joints) or 3
    amplitude = np.zeros(count)
    if isinstance(record.amplitude, tuple):
        if len(record.amplitude) != count:
            raise SizeMismatch(
                f"{len(record.amplitude)} amplitudes", where=record.where("amplitude"), expected=f"{count}"
            )
        amplitude[:] = record.amplitude
    else:
        for name, value in record.amplitude.items():
            amplitude[_index(joints, name, record.where("amplitude", name))] = value
    return Swing(size, rates, np.zeros(count), sine=amplitude, period=record.period, turns=record.turns)


def _index(joints: Sequence[str], name: str, where: str) -> int:
    if name not in joints:
        raise UnknownName("joint", name, joints, where=where)
    return joints.index(name)


def _waypoints(
    record: ReferenceRecord, waypoints: Sequence[WaypointReferenceRecord], quantity: str, columns: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of waypoints, shape (k,) and (k, n); what is left out is NaN before the first one."""
    keys = {"position": ("position",), "orientation": ("orientation",), "pose": ("position", "orientation")}
    allowed = keys.get(quantity, ("joints",))
    value = np.full(len(columns), math.nan if record.absolute else 0.0)
    if "orientation" in allowed and not record.absolute:
        value[-1] = 1.0
    times: list[float] = []
    rows: list[np.ndarray] = []
    for point in waypoints:
        for key in ("position", "orientation", "joints"):
            if key not in allowed and getattr(point, key) is not None:
                raise ConfigError(f"there is no '{key}' here", where=point.where(key), expected=", ".join(allowed))
        if times and point.time <= times[-1]:
            raise ConfigError(
                f"a time of {point.time:g} s after one of {times[-1]:g} s",
                where=point.where("time"),
                expected="times that increase",
            )
        if point.position is not None:
            value[:3] = point.position
        if point.orientation is not None:
            require_length(point.orientation, point.where("orientation"))
            value[-4:] = point.orientation
        for name, number in (point.joints or {}).items():
            value[_index(columns, name, point.where("joints", name))] = number
        times.append(point.time)
        rows.append(value.copy())
    if len(times) == 1 and times[0] == 0.0:
        raise ConfigError("there is no motion", where=waypoints[0].where("time"), expected="a time above 0 s")
    return np.array(times), np.array(rows)


def _table(record: ReferenceRecord, quantity: str, columns: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return times and values of a CSV file, shape (k,) and (k, n)."""
    where = record.where("file")
    path = located(record.file or "", record.folder("file"), where)
    times, numbers, found = read_table(path, columns, where, is_partial=quantity == POSTURE)
    if found == list(columns):
        return times, numbers
    values = np.full((len(times), len(columns)), math.nan if record.absolute else 0.0)
    values[:, [columns.index(name) for name in found]] = numbers
    return times, values
