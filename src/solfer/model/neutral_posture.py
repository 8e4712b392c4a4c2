"""The posture of a robot of which only the model is known."""

import numpy as np

from solfer.model.kinematics import Kinematics


def neutral_posture(kinematics: Kinematics) -> np.ndarray:
    """Compute positions of all DoFs, shape (kinematics.size,) [rad, m]: as near to zero as the joints' limits allow.

    Robots are drawn so that they balance with all joints at zero. A leg whose knee cannot be straight would carry its
    foot away from there: on a floating base the other joints of such a chain move, as little as possible, until its
    tip is vertically above or below where it would be with all joints at zero.
    """
    posture = np.clip(0.0, kinematics.lower_position, kinematics.upper_position)
    kinematics.followers.follow(posture)
    if kinematics.base is None or not posture.any():
        return posture
    tips, free = _bent_chains(kinematics, posture)
    if not tips or not free.any():
        return posture
    kinematics.update(np.zeros(kinematics.size))
    goal = _ground_plan(kinematics, tips)
    for _ in range(50):
        kinematics.update(posture)
        away = goal - _ground_plan(kinematics, tips)
        if np.abs(away).max() < 1e-9:  # [m]
            break
        jacobian = np.concatenate([kinematics.jacobian(tip)[:2, free] for tip in tips])
        posture[free] += np.linalg.lstsq(jacobian, away, rcond=1e-6)[0]
        np.clip(posture, kinematics.lower_position, kinematics.upper_position, out=posture)
        kinematics.followers.follow(posture)
    return posture


def _bent_chains(kinematics: Kinematics, posture: np.ndarray) -> tuple[list[str], np.ndarray]:
    """Find outermost links behind a joint that is not at zero, and the DoFs of the other joints along the chain."""
    description = kinematics.description
    dofs = kinematics.dofs
    parents = {joint.parent for joint in description.joints.values()}
    tips = []
    free = np.zeros(kinematics.size, dtype=bool)
    for link in description.subtree(kinematics.base_link):
        if link in parents:
            continue
        chain = [dofs.index(joint) for joint in _path(kinematics, link)]
        if posture[chain].any():
            tips.append(link)
            free[chain] = posture[chain] == 0.0
    return tips, free


def _path(kinematics: Kinematics, link: str) -> list[str]:
    """Return the moving joints between a link and the floating base."""
    description = kinematics.description
    path = []
    while link != kinematics.base_link:
        joint = description.joints[description.links[link].parent]
        if joint.moving:
            path.append(joint.name)
        link = joint.parent
    return path


def _ground_plan(kinematics: Kinematics, links: list[str]) -> np.ndarray:
    return np.concatenate([kinematics.position(link)[:2] for link in links])
