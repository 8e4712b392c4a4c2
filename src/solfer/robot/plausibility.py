"""Values of a robot and of its configuration that can be used, and hardly be meant: warnings of a check."""

import math
from collections.abc import Iterator
from functools import cache

from solfer.config import Configuration, Problems, Record
from solfer.config.records.robot_names import WrittenNumber, numbers_in
from solfer.config.yaml.nodes import Mark
from solfer.model.documents import PlacedElement, parse_robot, read_text
from solfer.model.urdf.description import Description
from solfer.model.urdf.unfit import unfit_parts
from solfer.robot.description.shipped import RobotFiles
from solfer.robot.scale import RobotScale, contacts_of, oddity, scale_of

LARGEST_ANGLE = 2.0 * math.pi + 1e-3
"""Angle beyond which a value looks like degrees [rad]; URDFs round a revolution."""


def check_plausibility(
    files: RobotFiles, configuration: Configuration, tags: Record | None, problems: Problems
) -> None:
    """Warn of joints and links with which a robot cannot work, and of numbers that are far beyond the robot.

    Args:
        files: The robot's files.
        configuration: One module; parts of it may be missing because of other mistakes.
        tags: The component's own tags.
        problems: Receives the warnings.
    """
    for mark, what in _of_robot(files):
        problems.warn(mark, what)
    source = configuration.sources.contacts if configuration.sources else None
    path = (source.location if source else None) or files.contacts
    contacts = contacts_of(path, configuration.robot.name if configuration.robot else "")
    scale = scale_of(files.urdf, contacts, configuration.rate or 0.0)
    pipes = (*configuration.feedbacks, *configuration.controllers)
    used = {pipe.calibration for pipe in pipes}
    calibrations = (record for name, record in configuration.calibrations.items() if name in used)
    for record in (tags, configuration.module, *pipes, *calibrations, *contacts):
        for mark, what in () if record is None else _odd_numbers(record, scale):
            problems.warn(mark, what)


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
        *_of_sizes(description),
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


def _of_sizes(description: Description) -> Iterator[tuple[Mark, str]]:
    """Find lengths, masses and speeds that no robot has: those of millimetres, grams and degrees."""
    longest = 50.0  # [m]
    heaviest = 5000.0  # [kg]
    fastest = 500.0  # [rad/s]
    for joint in description.joints.values():
        if (mark := Mark.read(joint.where)) is None:
            continue
        length = math.hypot(*joint.xyz)
        if length > longest:
            yield mark, f"joint '{joint.name}' is {length:.4g} m from the one before: are these millimetres?"
        if joint.type in ("revolute", "continuous") and (joint.velocity or 0.0) > fastest:
            yield mark, f"joint '{joint.name}' has a velocity limit of {joint.velocity:g} rad/s: are these degrees?"
    for link in description.links.values():
        if (link.mass or 0.0) > heaviest and (mark := Mark.read(link.where)) is not None:
            yield mark, f"link '{link.name}' has a mass of {link.mass:g} kg: are these grams?"


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


def _odd_numbers(record: Record, scale: RobotScale) -> Iterator[tuple[Mark, str]]:
    """Yield the places of numbers that a file gives to a record and that can hardly be meant, and why."""
    for number in numbers_in(record):
        what = _angle(number) if {"rad", "rad, m"}.intersection(number.units) else ""
        what = what or oddity(number, scale)
        if what:
            yield number.mark, what


def _angle(number: WrittenNumber) -> str:
    value = number.value
    if abs(value) <= LARGEST_ANGLE:
        return ""
    if "m" in number.units and isinstance(number.mark.path[-1], int):  # a list of joints or of coordinates
        return f"{value:g} is more than a turn [rad] and far for a robot [m]; {value:g} mm are {value / 1000:.4g} m"
    return f"the angle {_degrees(value)}"
