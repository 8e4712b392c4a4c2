"""The component `policy` without a network: its actions come from a program that trains one."""

import numpy as np

from solfer.components.policy.component import Policy
from solfer.components.policy.contract import widths
from solfer.components.policy.network import PolicyNetwork
from solfer.components.policy.tags import PolicyTags
from solfer.interfaces.geometry import Twist, Vector
from solfer.robot import Robot


class Learner(Policy):
    """A policy whose network is still to be trained: `network.actions` are written between `observe` and `act`.

    Its file is read only if the tags leave joints or observations to it.
    """

    Tags = PolicyTags

    def __init__(self, robot: Robot, tags: PolicyTags, name: str = "policy"):
        super().__init__(robot, tags, name)
        self._start = np.zeros(robot.size)

    def make_network(self) -> PolicyNetwork:
        """See `Policy.make_network`."""
        joints = self.tags.joints
        terms = self.tags.observations
        if joints is None or terms is None:
            return super().make_network()
        return _Actions(sum(size for _, size in widths(terms, len(joints))), len(joints))

    @property
    def commanded(self) -> tuple[str, ...]:
        """Fields of commands that move joints, and gains.

        Velocities that are always zero are none, nor are positions of springs whose stiffness is zero.
        """
        action = self.tags.action
        moved = {"position": ("position",), "velocity": ("position", "velocity"), "torque": ("position", "effort")}
        fields = moved[action.kind]
        if action.kind == "position" and action.springs == "plugin":
            fields = ("effort",) if len(self.contract.joints) == len(self.model.actuated) else ("position", "effort")
        return (*fields, *self.contract.gains)

    def begin(self) -> None:
        """Start where the joints are now."""
        np.copyto(self._start, self.model.state.position)
        self.start_position = self._start
        self.init()

    def command_base(self, velocity: np.ndarray) -> None:
        """Command a velocity of the base in its own axes: x, y [m/s] and yaw rate [rad/s], shape (3,)."""
        x, y, yaw_rate = velocity.tolist()
        self.receive(Twist(Vector(x, y, 0.0), Vector(0.0, 0.0, yaw_rate)))


class _Actions(PolicyNetwork):
    """Sizes of a network that is not there yet.

    Args:
        observations: Number of observations.
        actions: Number of actions.
    """

    def __init__(self, observations: int, actions: int):
        self.observations = np.zeros(observations, dtype=np.float32)
        self.actions = np.zeros(actions, dtype=np.float32)
        self.metadata = {}
        self.states = ()
        self._fed = []
