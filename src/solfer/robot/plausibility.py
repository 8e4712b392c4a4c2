"""Values of a robot and of its configuration that can be used, and hardly be meant: warnings of a check."""

import math
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any

from solfer.config import Problems, Record
from solfer.config.yaml.nodes import Key, Mark
from solfer.model.documents import PlacedElement, parse_robot, read_text
from solfer.model.urdf.description import Description
from solfer.model.urdf.unfit import unfit_parts
from solfer.robot.description.shipped import RobotFiles

LARGEST_ANGLE = 2.0 * math.pi + 1e-3
"""Angle beyond which a value looks like degrees [rad]; URDFs round a revolution."""


def check_plausibility(files: RobotFiles, records: Iterable[Record | None], problems: Problems) -> None:
    """Warn of joints and links with which a robot cannot work, and of angles beyond a revolution.

    Args:
        files: The robot's files.
        records: Parts of the configuration with tags of angles.
        problems: Receives the warnings.
    """
    for mark, what in _of_robot(files):
        problems.warn(mark, what)
    for record in records:
        for mark, value in () if record is None else _angles(record):
            problems.warn(mark, f"the angle {_degrees(value)}")


def _degrees(value: float) -> str:
    return f"looks like degrees: {value:g} rad is more than a turn, {value:g} degrees are {math.radians(value):.4g} rad"


@cache
def _of_robot(files: RobotFiles) -> tuple[tuple[Mark, str], ...]:
    """Find what is hardly meant in a URDF and an SRDF."""
    description = Description.from_file(files.urdf)
    floating = description.floating is not None if files.floating_base is None else files.floating_base
    unfit = ((Mark.read(where), what) for where, what in unfit_parts(description, floating))
    return (
        *((mark, what) for mark, what in unfit if mark is not None),
        *_of_limits(description),
        *_of_states(files, description),
    )


def _of_limits(description: Description) -> Iterator[tuple[Mark, str]]:
    for joint in description.moving_joints:
        mark = Mark.read(joint.where)
        if mark is None or joint.lower is None or joint.upper is None or joint.type == "continuous":
            continue
        if joint.type == "revolute" and max(-joint.lower, joint.upper) > LARGEST_ANGLE:
            limit = joint.upper if joint.upper > LARGEST_ANGLE else joint.lower
            yield mark, f"joint '{joint.name}' has a limit that {_degrees(limit)}"


def _of_states(files: RobotFiles, description: Description) -> Iterator[tuple[Mark, str]]:
    if files.srdf is None:
        return
    _, robot = parse_robot(read_text(files.srdf, "SRDF"), str(files.srdf), "SRDF")
    for element in robot.iterfind("group_state/joint"):
        joint = description.joints.get(element.get("name", ""))
        value = element.get("value", "").split()
        if (
            joint is not None
            and joint.type in ("revolute", "continuous")
            and value
            and abs(float(value[0])) > LARGEST_ANGLE
        ):
            assert isinstance(element, PlacedElement)
            mark = Mark(str(files.srdf), element.line, element.column)
            yield mark, f"joint '{joint.name}' has a value in a state that {_degrees(float(value[0]))}"


def _angles(record: Record) -> Iterator[tuple[Mark, float]]:
    """Yield the places and values of angles beyond a revolution that a file gives to a record."""
    for field, info in type(record).model_fields.items():
        if field in record.model_fields_set:
            is_angle = "[rad]" in (info.description or "") or "[rad, m]" in (info.description or "")
            yield from _inside(record, (info.alias or field,), record.__dict__[field], is_angle=is_angle)


def _inside(record: Record, path: tuple[Key, ...], value: Any, is_angle: bool) -> Iterator[tuple[Mark, float]]:
    if isinstance(value, Record):
        yield from _angles(value)
    elif isinstance(value, dict | tuple):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _inside(record, (*path, key), item, is_angle=is_angle)
    elif is_angle and isinstance(value, float) and abs(value) > LARGEST_ANGLE:
        mark = record.place(*path)
        if mark is not None:
            yield mark, value
