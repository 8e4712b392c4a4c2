"""Maps that every Robot has: the identity, its DoFs with a drive, the groups of its SRDF (1.1.3 of the paper)."""

import numpy as np

from solfer.model import BidirectionalMap, Group, Kinematics, Maps, Semantics, UnidirectionalMap

ALL = "all"
"""Name of the selector of all DoFs."""

MODEL_MAPS = ("RBDL", "MODEL")
"""Names of the identity map: the paper's, and what it means."""

ACTUATED = "ACTUATED"
"""Name of the map to the DoFs that have a drive."""


def actuated_dofs(kinematics: Kinematics) -> np.ndarray:
    """Indices of the DoFs that have a drive: all but those of a floating base, shape (m,)."""
    return np.arange(0 if kinematics.base is None else 6, kinematics.size)


def default_maps(kinematics: Kinematics) -> Maps[BidirectionalMap]:
    """The identity by both its names, and `ACTUATED`."""
    maps: Maps[BidirectionalMap] = Maps("map", kinematics.dofs)
    identity = BidirectionalMap(MODEL_MAPS[0], kinematics.dofs, kinematics.dofs)
    for name in MODEL_MAPS:
        maps.add(identity, name)
    maps.add(identity.select(actuated_dofs(kinematics), ACTUATED))
    return maps


def group_selectors(kinematics: Kinematics, semantics: Semantics) -> Maps[UnidirectionalMap]:
    """`all`, and one for each group."""
    selectors: Maps[UnidirectionalMap] = Maps("group", kinematics.dofs)
    selectors.add(UnidirectionalMap(ALL, kinematics.dofs, kinematics.dofs))
    for group in semantics.groups.values():
        if group.name != ALL:
            selectors.add(UnidirectionalMap(group.name, kinematics.dofs, _dofs_of(group, kinematics)))
    return selectors


def _dofs_of(group: Group, kinematics: Kinematics) -> list[str]:
    """DoFs of a group; the joint that floats, and a root that got a base, stand for the six DoFs of the base."""
    base = list(kinematics.dofs[:6]) if kinematics.base is not None else []
    floating = kinematics.description.floating
    dofs: dict[str, None] = {}
    for joint in group.joints:
        expanded = base if floating is not None and joint == floating.name else [joint]
        dofs |= dict.fromkeys(dof for dof in expanded if dof in kinematics.dofs)
    if base and floating is None and kinematics.base_link in group.links:
        dofs |= dict.fromkeys(base)
    return list(dofs)
