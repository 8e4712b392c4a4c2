"""What a plugin sends: what its component wants, checked and blended in, and what was sent last for a hold."""

from collections.abc import Sequence

import numpy as np

from solfer.pipes import Controller, JointController
from solfer.plugins.blend import Blend
from solfer.plugins.safety import Gate
from solfer.robot import Robot


class Outputs:
    """The pipes out of a plugin.

    Args:
        controllers: The pipes, each with its gate, or None where it does not go to the lower level.
        blend: Blends what goes to the lower level in at each start.
        robot: The Robot.
        idle: Whether what goes to the lower level is computed, but not sent: the pipes lead nowhere.

    Attributes:
        controllers: The pipes with their gates.
        commanding: Those that command the lower level.
        blend: See above.
    """

    def __init__(self, controllers: Sequence[tuple[Controller, Gate | None]], blend: Blend, robot: Robot,
                 idle: bool = False):
        self.controllers, self.blend, self._robot, self._sent = tuple(controllers), blend, robot, False
        guarded = [pipe for pipe, gate in self.controllers if gate is not None]
        self.commanding: tuple[JointController, ...] = () if idle else tuple(guarded)
        joints = [pipe for pipe, _ in self.controllers if isinstance(pipe, JointController)]
        self._others = tuple(pipe for pipe, _ in self.controllers if pipe not in joints)
        self._fields = [(values, np.zeros_like(values)) for pipe in joints for _, values in pipe.fields]
        """Of each field in joint space: what is about to be sent, and what was sent last."""
        self._velocities = [values for pipe in joints for field, values in pipe.fields if field == "velocity"]

    @property
    def blending(self) -> bool:
        """Whether the start is not over yet."""
        return self.blend.active

    def start(self) -> None:
        """Begin at the measured state, without a past."""
        self._sent = False
        self.blend.start()
        for pipe, _ in self.controllers:
            pipe.reset()

    def collect(self) -> None:
        """Take what the component wants, check it and blend it in.

        Raises:
            NotFinite: A number is none; nothing may be sent.
        """
        for pipe, gate in self.controllers:
            pipe.collect()
            if gate is not None:
                gate.check()
        self.blend.step()

    def send(self, stamp: float) -> None:
        """Send what was collected, stamped with `stamp` [s]."""
        for values, sent in self._fields:
            sent[...] = values
        self._sent = True
        for pipe, _ in self.controllers:
            pipe.send(stamp)

    def rest(self, stamp: float) -> None:
        """As `collect` and `send`, but without any velocity."""
        self._robot.command.velocity[:] = 0.0
        self.collect()
        for values in self._velocities:  # a filter goes on with the speed that was wanted before
            values.fill(0.0)
        self.send(stamp)

    def hold(self, stamp: float) -> None:
        """Send positions and efforts of joints as they were sent last, and no velocity; nothing before that."""
        if not self._sent:
            return
        self._robot.command.velocity[:] = 0.0
        for pipe in self._others:
            pipe.collect()
        for values, sent in self._fields:
            values[...] = sent
        for values in self._velocities:
            values.fill(0.0)
        self.send(stamp)

    def counts(self) -> dict[str, float | str]:
        """How many numbers the gates held back since the start, by their kind."""
        counts: dict[str, float | str] = {}
        for _, gate in self.controllers:
            for kind, count in gate.counts.items() if gate is not None else ():
                counts[f"gate: {kind}"] = counts.get(f"gate: {kind}", 0) + count
        return counts
