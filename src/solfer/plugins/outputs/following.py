"""Watches whether joints follow their commands: one that is jammed, dead, or measured wrongly does not."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from solfer.errors import JointFault
from solfer.pipes import JointCommandPipe
from solfer.robot import Robot


class JointFollowing:
    """Compares what is commanded to the lower level with what is measured, once a cycle.

    - A joint with a position controller does not follow where it has been farther than 1 rad or m from its command
      for 0.5 s: springs under a load yield less; or 0.05 rad or m for 0.3 s, while its motor does all that it can.
      Without stiffness it is not watched.
    - A joint with a velocity controller does not follow where it lags by 0.5 rad or m: by what it is commanded to go
      in all the time in which it goes less than a fifth of that.

    Args:
        owner: Name of the plugin, for messages.
        pipes: The pipes to the lower level.
        robot: The Robot.
        measured: By interface, whether each DoF is measured, shape (robot.size,): others are not watched.

    Attributes:
        watched: How joints are compared, and with which arrays; empty: none are.
    """

    def __init__(self, owner: str, pipes: Sequence[JointCommandPipe], robot: Robot, measured: Mapping[str, np.ndarray]):
        # imported here: its compiler takes a while to load
        from solfer.numerics.checks.commands import find_astray, find_stuck

        self._owner = owner
        self._names = robot.dofs
        state = robot.state
        self.watched: list[tuple[Callable[..., int], tuple[np.ndarray, ...]]] = []
        for pipe in pipes:
            fields = dict(pipe.fields)
            interface = "position" if "position" in fields else "velocity"
            places = np.flatnonzero(measured[interface][pipe.dofs])
            if interface not in fields or not len(places):
                continue
            own = fields[interface], state[interface], np.array(pipe.dofs), places, np.zeros((2, len(pipe.dofs)))
            if interface == "position":
                stiffness = fields.get("stiffness", np.ones(len(pipe.dofs)))
                limits = np.where(measured["effort"], 0.98 * robot.kinematics.effort_limit, np.inf)[pipe.dofs]
                self.watched.append((find_astray, (*own, stiffness, state["torque"], limits)))
            else:
                self.watched.append((find_stuck, own))

    def start(self) -> None:
        """Forget what was before."""
        for _, given in self.watched:
            given[4].fill(0.0)

    def check(self, passed: float) -> JointFault | None:
        """Compare the commands of a cycle, `passed` [s] after the one before; of a longer gap nothing is known.

        Returns:
            The error that a joint does not follow; None: all do.
        """
        for find, given in self.watched:
            place = find(*given, passed)
            if place >= 0:
                return self._fault(given, place)
        return None

    def _fault(self, given: Sequence[np.ndarray], place: int) -> JointFault:
        desired, measured, dofs, _, record = given[:5]
        dof = dofs[place]
        if len(given) > 5:
            force = f", with {given[6][dof]:.0f} Nm" if record[1, place] else ""
            what = f"it is at {measured[dof]:.3f} instead of {desired[place]:.3f} rad{force}"
        else:
            what = f"it has turned by {record[1, place]:.2f} rad, and lags by {record[0, place]:.2f} rad"
        return JointFault(
            f"joint '{self._names[dof]}' does not follow '{self._owner}': {what}",
            expected="a joint that is neither jammed nor dead, and its own measurements",
        )
