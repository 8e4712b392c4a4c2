"""What keeps a task from its reference."""

import numpy as np

from solfer.model.state import State
from solfer.numerics.bounds.velocity import VelocityBounds
from solfer.tasks import Task


def obstacles(task: Task, command: State, bounds: VelocityBounds, moved: np.ndarray) -> str:
    """Describe what keeps a task from its reference, and what to try.

    The error e pulls the joints by J^T e. What is left of this pull, without the joints that it presses against the
    ends of their ranges, is small where they hardly bring the point nearer: a limb is stretched or folded.

    Args:
        task: The task, updated.
        command: Where the joints are commanded to be.
        bounds: Ends of the joints' ranges.
        moved: DoFs that may move, shape (m,).
    """
    error = task.error.value[task.selected]
    jacobian = (task.point.jacobian * task.mask)[task.selected]
    length = float(np.linalg.norm(error))
    pull = jacobian.T @ error
    reach = np.linalg.norm(jacobian, axis=0) * length
    near = 5e-3  # [rad, m] from the end of a range, at which a joint counts as there
    pressing = 0.01 * reach  # from here on, the error presses a joint against the end of its range
    is_low = (command.position - bounds.lower_position < near) & (pull < -pressing)
    is_high = (bounds.upper_position - command.position < near) & (pull > pressing)
    ends = [(dof, "lower", bounds.lower_position) for dof in moved if is_low[dof]]
    ends += [(dof, "upper", bounds.upper_position) for dof in moved if is_high[dof]]
    free = [dof for dof in moved if not is_low[dof] and not is_high[dof]]
    found = []
    tries = []
    if ends:
        found += [f"{command.dofs[dof]} is at its {side} limit ({limits[dof]:.4g})" for dof, side, limits in ends]
        tries.append("another posture to begin from")
    across = 0.35  # of the largest pull, below which joints move a point mostly across the way left; the mean is 0.58
    if np.linalg.norm(pull[free]) <= across * float(np.linalg.norm(jacobian[:, free])) * length:
        found.append("it is near a singularity: the other joints move the point across the way that is left")
        tries.append("a reference that is nearer, or beside the stretched or folded limb")
    elif not ends:
        found.append("tasks beside it or above it, or limits, keep it there")
        tries.append("a larger weight, or a level further up")
    return f"{', '.join(found)}; try {', or '.join(tries)}"
