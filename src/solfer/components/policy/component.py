"""The component `policy`."""

import logging
import math
from typing import Any

import numpy as np

from solfer.components.base import Component
from solfer.components.policy.contract import BASE_TERMS, agree
from solfer.components.policy.network import PolicyNetwork
from solfer.components.policy.observations import Observations
from solfer.components.policy.tags import PolicyTags
from solfer.config.yaml.files import check_file, located
from solfer.errors import ComponentError, NotFinite
from solfer.interfaces.declaration import TopicIn
from solfer.interfaces.geometry import Twist
from solfer.robot import Robot

log = logging.getLogger(__name__)

COMMAND_TIMEOUT = 0.5
"""Time after which a commanded velocity without another one is zero [s]."""


class Policy(Component):
    """Moves joints as a trained network decides at its own rate; its commands hold in between.

    DoFs that the network does not move stay where they are at a start. The robot is held, with the gains that its
    joints had before, and until the next start, where a joint is too far from the default pose at a start, where the
    base tilts too far, and where the network computes something else than numbers.

    Args:
        robot: The Robot.
        tags: Tags of the configuration.
        name: Name of the configuration.

    Attributes:
        network: The network.
        contract: What its numbers mean.
        fault: Why the robot is held; empty: it is not.
        steps: How often the network has run since the last start.

    Raises:
        MissingDependency: onnxruntime is not installed.
        SolferError: The file is no network, or does not fit tags and robot.
    """

    Tags = PolicyTags

    def __init__(self, robot: Robot, tags: PolicyTags, name: str = "policy"):
        super().__init__(robot, tags, name)
        self.kinematics = False
        self.network = self.make_network()
        self.contract = agree(tags, self.network, robot)
        self._observations = Observations(robot, self.contract, self.network.observations)
        self._stiffness = self._own_springs()
        sent = {gain: numbers.copy() for gain, numbers in self.contract.gains.items()}
        if self._stiffness is not None:
            sent["stiffness"][:] = 0.0
        self._gains = [(robot.command.add(gain), numbers) for gain, numbers in sent.items()]
        self._standing: list[np.ndarray] = []
        self._clocks = _Clocks(self.contract.rate)
        self._target, self._torque = np.zeros((2, len(self.contract.joints)))
        self._finite = np.zeros(len(self.contract.joints), dtype=bool)
        self._held = np.zeros(robot.size)
        self.fault = ""
        self.steps = 0
        if self.contract.action.kind == "torque" or self._stiffness is not None:
            self.efforts = self.contract.dofs.astype(np.int64)

    def make_network(self) -> PolicyNetwork:
        """Load the network of the tags; training, which has none yet, replaces it."""
        tags = self.tags
        where = tags.where("file")
        path = located(tags.file, tags.folder("file"), where)
        check_file(path, where)
        return PolicyNetwork(path, where)

    def _own_springs(self) -> np.ndarray | None:
        """Return the stiffness of springs that the plugin computes, shape (m,); those of the lower level get none."""
        action = self.contract.action
        if action.kind != "position" or action.springs != "plugin":
            return None
        stiffness = self.contract.gains.get("stiffness")
        if stiffness is None:
            what = "the plugin computes torques of springs, and there is no stiffness"
            raise ComponentError(what, where=self.tags.where("action", "springs"), expected="`gains: {stiffness: ...}`")
        return stiffness

    def set_rate(self, rate: float) -> None:
        """See `Component.set_rate`; the network's rate is no higher."""
        if self.contract.rate > rate * (1.0 + 1e-9):
            what = f"'{self.name}' runs at {rate:g} Hz, and its network at {self.contract.rate:g} Hz"
            raise ComponentError(what, where=self.tags.where("rate"), expected="a plugin that is at least as fast")
        super().set_rate(rate)

    def needs_base(self) -> bool:
        """See `Component.needs_base`; the network may observe joints alone."""
        return any(term.term in BASE_TERMS for term in self.contract.terms)

    def init(self) -> None:
        """Start with what the network observes now, unless a joint is too far from the default pose."""
        command = self.model.command
        if not self._standing:
            self._standing = [values.copy() for values, _ in self._gains]
        self._forget()
        self.fault = ""
        self._held[:] = self.start_position
        command.position[:] = self.start_position
        command.velocity[:] = 0.0
        command.torque[:] = 0.0
        away = self.model.state.position[self.contract.dofs] - self.contract.default
        worst = int(np.abs(away).argmax())
        if abs(away[worst]) > self.tags.start_tolerance:
            what = f"'{self.contract.joints[worst]}' is {away[worst]:+.3f} from the default pose"
            self._hold(f"{what}, and may be {self.tags.start_tolerance:g}")

    def update(self) -> None:
        """Run the network if its time has come."""
        if self.observe():
            self.network.run()
            self.act()

    def observe(self) -> bool:
        """Let a cycle pass; write the observations and return True where the network's time has come."""
        clocks = self._clocks
        clocks.advance(self.passed, self.time_lost)
        if self.fault:
            return False
        observations = self._observations
        if self.model.kinematics.base is not None:
            observations.measure_base()
            if observations.tilt > self.tags.largest_tilt:
                self._hold(f"the base tilts by {observations.tilt:.2f} rad")
                return False
        if not clocks.is_due(0.5 * self.period):
            return False
        if clocks.silence > COMMAND_TIMEOUT:
            observations.commands[:] = 0.0
        observations.update(clocks.time)
        return True

    def act(self) -> None:
        """Make targets of what the network has computed."""
        self.steps += 1
        action = self._observations.last_action
        action[:] = self.network.actions
        if not np.isfinite(action, out=self._finite).all():
            joint = self.contract.joints[int(self._finite.argmin())]
            self._hold(f"the network's action of '{joint}' is not finite")
            return
        contract = self.contract
        clip = contract.action.clip
        np.minimum(action, clip, out=action)
        np.maximum(action, -clip, out=action)
        np.multiply(action, contract.scale, out=self._target)
        if contract.action.kind == "position":
            self._target += contract.default
        np.maximum(self._target, contract.bounds[0], out=self._target)
        np.minimum(self._target, contract.bounds[1], out=self._target)

    def send(self) -> None:
        """Write what the network commands, with its gains; where the robot is held, its posture."""
        command = self.model.command
        if self.fault:
            command.position[:] = self._held
            command.velocity[:] = 0.0
            command.torque[:] = 0.0
            for (values, _), standing in zip(self._gains, self._standing, strict=True):
                np.copyto(values, standing)
            return
        dofs = self.contract.dofs
        if self._stiffness is None:
            command[self.contract.action.kind][dofs] = self._target
        else:
            np.take(self.model.state.position, dofs, out=self._torque, mode="clip")
            command.position[dofs] = self._torque
            np.subtract(self._target, self._torque, out=self._torque)
            self._torque *= self._stiffness
            command.torque[dofs] = self._torque
        for values, numbers in self._gains:
            values[dofs] = numbers

    def reset(self) -> None:
        """Forget the last action, histories, the network's states, and the commanded velocity."""
        self._forget()

    def stop(self) -> None:
        """Hold the joints where they are."""
        if not self.fault:
            self._held[:] = self.model.state.position
            self.fault = "it has stopped"

    def topics(self) -> tuple[TopicIn, ...]:
        """Receive the desired velocity of the base on `<name>/cmd_vel`, if the network observes it."""
        if all(term.term != "commands" for term in self.contract.terms):
            return ()
        return (TopicIn("cmd_vel", "geometry_msgs/Twist", Twist, handler=self.receive, stream="velocities"),)

    def receive(self, message: Twist) -> None:
        """Take over a velocity of the base in its own axes: x, y and the yaw rate count, in their ranges, for 0.5 s.

        Raises:
            NotFinite: A number is NaN or infinite.
        """
        desired = message.linear.x, message.linear.y, message.angular.z
        if not all(map(math.isfinite, desired)):
            raise NotFinite(f"a velocity of {desired}", where="cmd_vel", expected="finite numbers")
        lower, upper = self.contract.commands
        np.clip(desired, lower, upper, out=self._observations.commands)
        self._clocks.silence = 0.0

    def start_log(self, logger: Any) -> None:
        """Declare commands of the base, actions, and what they mean to the joints."""
        logger.add("commands", self._observations.commands, ("x", "y", "yaw"))
        logger.add("action", self._observations.last_action, self.contract.joints)
        logger.add("target", self._target, self.contract.joints)

    def _forget(self) -> None:
        self._observations.reset()
        self.network.reset()
        self._clocks.start()
        self.steps = 0

    def _hold(self, fault: str) -> None:
        """Hold the robot where it is until the next start."""
        self._held[:] = self.model.state.position
        self.fault = fault
        log.error("%s: %s; it holds until it is started again", self.name, fault)


class _Clocks:
    """Times of a network that runs at its own rate in a faster loop.

    Args:
        rate: The network's rate [Hz].

    Attributes:
        time: Time since the start [s].
        silence: Time since the last commanded velocity [s].
    """

    def __init__(self, rate: float):
        self._step = 1.0 / rate
        self.start()

    def start(self) -> None:
        """Begin: the network is due at once."""
        self.time = self._left = 0.0
        self._is_first = True
        self.silence = math.inf

    def advance(self, passed: float, lost: float) -> None:
        """Let time pass for the robot, and beside it [s]."""
        self.silence += passed + lost
        if not self._is_first:
            self.time += passed
            self._left -= passed
        self._is_first = False

    def is_due(self, tolerance: float) -> bool:
        """Return whether the network runs now; then the next time is a step later. Steps that were missed are lost."""
        if self._left > tolerance:
            return False
        self._left += self._step
        if self._left < 0.5 * self._step:
            self._left = self._step
        return True
