"""Defaults of every Robot: limits of its DoFs as States, and its maps (section 1.1 of the paper)."""

import numpy as np

from solfer.model import Actuators, BidirectionalMap, Group, Kinematics, Maps, Semantics, State, UnidirectionalMap


def joint_limits(kinematics: Kinematics) -> tuple[State, State]:
    """Read lower and upper limits of the URDF: -inf and inf where it has none, as for every acceleration."""
    lower = State(kinematics.dofs)
    upper = State(kinematics.dofs)
    lower.position = kinematics.lower_position
    upper.position = kinematics.upper_position
    lower.velocity = -kinematics.velocity_limit
    upper.velocity = kinematics.velocity_limit
    lower.torque = -kinematics.effort_limit
    upper.torque = kinematics.effort_limit
    unlimited = np.full(kinematics.size, np.inf)
    lower.acceleration = -unlimited
    upper.acceleration = unlimited
    return lower, upper


ALL = "all"
"""Name of the selector of all DoFs."""

MODEL_MAPS = ("RBDL", "MODEL")
"""Names of the identity map: the paper's, and a plain one."""

ACTUATED = "ACTUATED"
"""Name of the map to the DoFs that have a drive."""


def undescribed(kinematics: Kinematics) -> Actuators:
    """Return the actuators of a robot that no file describes.

    Every joint has a drive but those that follow others; a floating base has none.
    """
    base = kinematics.dofs[: 0 if kinematics.base is None else 6]
    return Actuators(kinematics.dofs, passive=(*base, *kinematics.followers.names))


def actuated_dofs(kinematics: Kinematics, actuators: Actuators) -> np.ndarray:
    """Return the indices of the DoFs that have a drive, none of them of a floating base, shape (m,)."""
    driven = actuators.driven.copy()
    driven[: 0 if kinematics.base is None else 6] = False
    return np.flatnonzero(driven)


def default_maps(kinematics: Kinematics, actuated: np.ndarray) -> Maps[BidirectionalMap]:
    """Make the identity by both its names, and `ACTUATED`."""
    maps: Maps[BidirectionalMap] = Maps("map", kinematics.dofs)
    identity = BidirectionalMap(MODEL_MAPS[0], kinematics.dofs, kinematics.dofs)
    for name in MODEL_MAPS:
        maps.add(identity, name)
    maps.add(identity.select(actuated, ACTUATED))
    return maps


def group_selectors(kinematics: Kinematics, semantics: Semantics) -> Maps[UnidirectionalMap]:
    """Make `all`, and one selector for each group."""
    selectors: Maps[UnidirectionalMap] = Maps("group", kinematics.dofs)
    selectors.add(UnidirectionalMap(ALL, kinematics.dofs, kinematics.dofs))
    for group in semantics.groups.values():
        if group.name != ALL:
            selectors.add(UnidirectionalMap(group.name, kinematics.dofs, _dofs_of(group, kinematics)))
    return selectors


def _dofs_of(group: Group, kinematics: Kinematics) -> list[str]:
    """List the DoFs of a group; the floating joint, or a root that got a base, has the six DoFs of the base."""
    base = list(kinematics.dofs[:6]) if kinematics.base is not None else []
    floating = kinematics.description.floating
    dofs: dict[str, None] = {}
    for joint in group.joints:
        expanded = base if floating is not None and joint == floating.name else [joint]
        dofs |= dict.fromkeys(dof for dof in expanded if dof in kinematics.dofs)
    if base and floating is None and kinematics.base_link in group.links:
        dofs |= dict.fromkeys(base)
    return list(dofs)
