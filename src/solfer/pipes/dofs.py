"""The DoFs that a pipe carries: chain, type and map of a record, on a Robot."""

import numpy as np

from solfer.config.records.pipes import DofsRecord, FeedbackRecord
from solfer.errors import PipeError, UnknownName
from solfer.model import BidirectionalMap
from solfer.robot import Robot
from solfer.robot.names import UNACTUATED
from solfer.robot.selection import chain_of, select


def joint_map(dofs: DofsRecord, name: str, robot: Robot, pipe: str) -> BidirectionalMap:
    """Restrict the map `name` to the DoFs of a pipe in joint space.

    Raises:
        PipeError: No DoF is left.
        UnknownName: An unknown chain, type or map.
    """
    selected = select(dofs, robot)
    mapping = robot.maps.get(name, dofs.where("mapping")).select(selected)
    if not len(mapping.robot_indices):
        raise PipeError(
            f"pipe '{pipe}' carries no DoF: none of chain '{dofs.chain}', type '{dofs.type}' is in map '{name}'",
            where=dofs.where("chain"),
            expected="a model with a floating base" if not len(selected) and dofs.type == UNACTUATED else "",
        )
    return mapping


def require_base(record: FeedbackRecord, robot: Robot) -> str:
    """Return the link of a pipe in operational space that measures the six DoFs of the floating base.

    Raises:
        PipeError: The record has no link, the robot has no floating base, or chain or map are without it.
        UnknownName: An unknown link, chain or map.
    """
    dofs = record.dofs
    pipe = record.name
    link = require_link(dofs, robot)
    if record.reads_sensor:
        link = _known_link(record.sensor, robot, record.where("sensor"))
    if robot.kinematics.base is None:
        raise PipeError(
            f"pipe '{pipe}' carries a floating base, but '{robot.name}' has none",
            where=dofs.where(),
            expected="a URDF with a floating joint",
        )
    base = np.arange(6)
    if not np.isin(base, chain_of(dofs, robot)).all():
        raise PipeError(
            f"the chain '{dofs.chain}' lacks DoFs of the floating base",
            where=dofs.where("chain"),
            expected="'all', or a group with the floating joint",
        )
    if not np.isin(base, robot.maps.get(dofs.mapping, dofs.where("mapping")).robot_indices).all():
        raise PipeError(
            f"the map '{dofs.mapping}' lacks DoFs of the floating base",
            where=dofs.where("mapping"),
            expected="a map with all DoFs, such as 'RBDL'",
        )
    return link


def require_link(dofs: DofsRecord, robot: Robot) -> str:
    """Return the link of a pipe in operational space.

    Raises:
        PipeError: The record has no link.
        UnknownName: An unknown link.
    """
    if dofs.type != "body" or dofs.name is None:
        raise PipeError(
            f"type '{dofs.type}' in operational space",
            where=dofs.where("type"),
            expected="type: body, with the key 'name', a link",
        )
    return _known_link(dofs.name, robot, dofs.where("name"))


def _known_link(link: str, robot: Robot, where: str) -> str:
    if link not in robot.description.links:
        raise UnknownName("link", link, robot.description.links, where=where)
    return link
