"""The DoFs that a record of the configuration selects."""

import numpy as np

from solfer.config.records.pipes import ControllerRecord, DofsRecord
from solfer.errors import PipeError, SolferError, UnknownName
from solfer.robot.names import DOF_TYPES, LOWER_LEVEL_MAPS, UNACTUATED, controller_map
from solfer.robot.robot import Robot


def select(dofs: DofsRecord, robot: Robot) -> np.ndarray:
    """Select the Robot's DoFs of a chain that are of a type, in joint space.

    Args:
        dofs: The record; its `type` is `all`, `actuated`, `unactuated`, or the name of a map: the DoFs in that map.
        robot: The Robot.

    Raises:
        PipeError: The type is `body`, which does not belong to joint space.
        UnknownName: An unknown chain, type or map.
    """
    chain = chain_of(dofs, robot)
    if dofs.type == "all":
        return chain
    if dofs.type in ("actuated", UNACTUATED):
        return np.intersect1d(chain, robot.actuated) if dofs.type == "actuated" else np.setdiff1d(chain, robot.actuated)
    if dofs.type == "body":
        raise PipeError("type 'body' in joint space", where=dofs.where("type"), expected="space: OPERATIONAL")
    if dofs.type not in robot.maps:
        raise UnknownName("type of DoFs", dofs.type, (*DOF_TYPES, *robot.maps), where=dofs.where("type"))
    return np.intersect1d(chain, robot.maps[dofs.type].robot_indices)


def chain_of(dofs: DofsRecord, robot: Robot) -> np.ndarray:
    """Return the DoFs of a record's chain.

    Raises:
        UnknownName: An unknown chain.
    """
    return robot.selectors.get(dofs.chain, dofs.where("chain")).indices


def commanded_dofs(record: ControllerRecord, robot: Robot) -> np.ndarray:
    """Select the DoFs that a pipe to the lower level commands and that have to be measured: not those in open loop.

    A joint that follows another one is measured with it. Where a map of the record is not there (yet) it is empty.
    """
    if record.open_loop or not record.lower_level:
        return np.zeros(0, dtype=np.intp)
    mapping = controller_map(record.leads_to) if record.dofs.mapping in LOWER_LEVEL_MAPS else record.dofs.mapping
    try:
        selected = robot.maps.get(mapping).select(select(record.dofs, robot)).robot_indices
    except SolferError:
        return np.zeros(0, dtype=np.intp)
    return np.setdiff1d(np.intersect1d(selected, robot.actuated), robot.kinematics.followers.dofs)
