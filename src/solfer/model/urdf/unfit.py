"""Links and joints with which a robot cannot work: they are reported once, with all names."""

import logging
from collections.abc import Iterator

from solfer.errors import ModelError
from solfer.model.urdf.description import Description

logger = logging.getLogger(__name__)


def unfit_parts(description: Description, floating: bool) -> Iterator[tuple[str, str]]:
    """Yield which joints cannot be driven by their limits, and which links move without mass, each with a place.

    Joints that follow others have no limits of their own.

    Args:
        description: The robot.
        floating: Whether its base floats.
    """
    own = [joint for joint in description.moving_joints if joint.name not in description.mimics]
    unfit = {
        "effort limit 0, so that nothing holds them": [joint for joint in own if joint.effort == 0.0],
        "velocity limit 0, so that nothing may move them": [joint for joint in own if joint.velocity == 0.0],
        "equal lower and upper limits, so that they are locked": [
            joint for joint in own if joint.lower is not None and joint.lower == joint.upper
        ],
    }
    for what, joints in unfit.items():
        if joints:
            names = ", ".join(joint.name for joint in joints)
            yield joints[0].where, f"joints with {what}: {names}; correct their <limit>"
    massless = _massless(description, floating)
    if massless:
        names = ", ".join(massless)
        yield description.links[massless[0]].where, f"links that move without mass: {names}; give each an <inertial>"


def warn_of_unfit(description: Description, floating: bool) -> None:
    """Log all `unfit_parts` in one message."""
    found = [what for _, what in unfit_parts(description, floating)]
    if found:
        logger.warning("%s: %s", description.where, "; ".join(found))


def check_masses(description: Description, floating: bool) -> None:
    """Check that all links that move have a mass, or are fixed to one that has.

    Args:
        description: The robot.
        floating: Whether its base floats.

    Raises:
        ModelError: Links have none; it names all of them.
    """
    massless = _massless(description, floating)
    if massless:
        raise ModelError(
            f"links move and have no mass: {', '.join(massless)}",
            where=description.where,
            expected="an <inertial> with a mass in each, or joints of type fixed",
        )


def _massless(description: Description, floating: bool) -> list[str]:
    base = description.floating.child if floating and description.floating else description.root
    owner = {base: base}
    masses = {base: description.links[base].mass or 0.0}
    for name in description.subtree(base)[1:]:
        link = description.links[name]
        joint = description.joints[link.parent]
        own = owner[name] = name if joint.moving else owner[joint.parent]
        masses[own] = masses.get(own, 0.0) + (link.mass or 0.0)
    return [name for name, mass in masses.items() if mass <= 0.0 and (floating or name != base)]
