"""Robots without a decision about their base: it stays where it is, right only for a fixed base."""

import logging

from solfer.model.urdf.description import Description

logger = logging.getLogger(__name__)


def warn_of_fixed_base(description: Description, floating_base: bool | None) -> None:
    """Log that the base is held, unless `floating_base` decides it, or a floating joint or the link `world` does.

    By convention that link is the ground: what is fixed to it is fixed on purpose.
    """
    ground = "world"
    if floating_base is None and description.floating is None and description.root != ground and _has_mass(description):
        logger.warning(
            "%s: the base, link '%s', is fixed: the URDF has neither a floating joint nor a link '%s'; "
            "`floating_base: true` lets it float, `floating_base: false` says that it is meant so",
            description.where,
            description.root,
            ground,
        )


def _has_mass(description: Description) -> bool:
    """Return whether the root, or a link that is fixed to it, has a mass."""
    fixed = [description.root]
    for link in fixed:  # grows while it is walked
        joints = [description.joints[name] for name in description.links[link].children]
        fixed += [joint.child for joint in joints if joint.type == "fixed"]
    return any(description.links[link].mass for link in fixed)
