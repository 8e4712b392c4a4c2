"""Commands of a plugin: collected from its component, checked, blended in and sent; the last ones are kept to hold."""

from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import Any, NoReturn, cast

import numpy as np

from solfer.errors import NotFinite
from solfer.pipes import CommandPipe, JointCommandPipe
from solfer.plugins.outputs.command_gate import CommandGate
from solfer.plugins.outputs.following import JointFollowing
from solfer.plugins.outputs.sent_joints import SentJoints
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.plugins.outputs.start_requests import StartRequests
from solfer.robot import Robot
from solfer.transport.health import Health
from solfer.transport.middleware import HealthReport

_MOVED = attrgetter("moved")

Claim = tuple[str, str, str]
"""A number of a command: controller, field and joint."""


class Outputs:
    """The pipes out of a plugin.

    Args:
        controllers: The pipes, each with its gate, or None where it does not lead to the lower level.
        blend: Blends in the commands to the lower level at each start.
        robot: The Robot.
        period: Time of a control cycle [s].
        idle: Whether commands to the lower level are computed, but not sent.
        requests: Requests to the lower level at each start; None: there are none.
        following: Watches whether joints follow what is commanded; None: none are watched.

    Attributes:
        controllers: The pipes with their gates.
        commanding: Those that command the lower level.
        blend: See above.
        following: See above.
        joints: What is sent to joints.
        start_position: Where joints are at a start, shape (robot.size,) [rad, m]; live.
    """

    def __init__(
        self,
        controllers: Sequence[tuple[CommandPipe, CommandGate | None]],
        blend: StartBlend,
        robot: Robot,
        period: float,
        idle: bool = False,
        *,
        requests: StartRequests | None = None,
        following: JointFollowing | None = None,
    ):
        self._requests = requests
        self.controllers = tuple(controllers)
        self.blend = blend
        self._robot = robot
        self._idle = idle
        self._reported = [0] * len(self.controllers)
        guarded = [pipe for pipe, gate in self.controllers if gate is not None]
        self.commanding: tuple[JointCommandPipe, ...] = () if idle else tuple(cast(list[JointCommandPipe], guarded))
        joints = [pipe for pipe, _ in self.controllers if isinstance(pipe, JointCommandPipe)]
        self._others = tuple(pipe for pipe, _ in self.controllers if pipe not in joints)
        self.joints = SentJoints(joints, self._moves, period)
        self.following = following
        self.start_position = np.array(robot.state.position)

    def _moves(self, pipe: JointCommandPipe) -> bool:
        """Return whether joints move by what a pipe sends, if only through another plugin."""
        return not self._idle and bool(np.isin(pipe.dofs, self._robot.actuated).any())

    @property
    def claims(self) -> frozenset[Claim]:
        """What is commanded to the lower level."""
        return frozenset(
            (pipe.controller, field, joint)
            for pipe in self.commanding
            for field, _ in pipe.fields
            for joint in pipe.sent.names
        )

    @property
    def blending(self) -> bool:
        """Whether the start is not over yet."""
        return self.blend.active

    def start(self) -> None:
        """Start where the joints are, without earlier commands; to be called before the component starts."""
        self._find_start()
        self.joints.is_sent = False
        self.blend.start(self.start_position)
        if self.following is not None:
            self.following.start()
        if self._requests is not None:
            self._requests.send()
        for pipe, _ in self.controllers:
            pipe.reset()

    def forget(self) -> None:
        """Forget what was sent last: others move the joints now, or the robot is in another state."""
        self.joints.forget()

    def collect(self) -> None:
        """Collect the commands of the component, check them and blend them in.

        Raises:
            NotFinite: A value is NaN or infinite; nothing may be sent.
        """
        for pipe, gate in self.controllers:
            if pipe.collect():
                if gate is None:  # joints of other plugins: none of them shall follow what is not a number
                    _refuse(cast(JointCommandPipe, pipe))
                gate.check()
        if self.blend.active:
            self.blend.step()

    def send(self, stamp: float) -> None:
        """Send the collected commands, stamped with `stamp` [s]."""
        for pipe, _ in self.controllers:
            pipe.send(stamp)
        joints = self.joints
        if joints.is_sent:
            joints.distance += max(map(_MOVED, joints.pipes), default=0.0)
        joints.is_sent = joints.are_followed = True

    def rest(self, stamp: float) -> None:
        """Collect and send, but with all velocities at zero."""
        self._robot.command.velocity[:] = 0.0
        self.collect()
        self.joints.stop(self._robot.state.position)
        self.send(stamp)

    def hold(self, stamp: float) -> None:
        """Send the last positions and efforts of the joints again with zero velocity; nothing if none was sent yet."""
        if not self.joints.is_sent:
            return
        self._robot.command.velocity[:] = 0.0
        for pipe in self._others:
            pipe.collect()
        self.joints.restore()
        self.joints.stop(self._robot.state.position)
        self.send(stamp)

    def counts(self) -> dict[str, float | str]:
        """Count the values that the gates held back since the start, by kind."""
        counts: dict[str, Any] = {}
        for _, gate in self.controllers:
            for kind, count in gate.counts.items() if gate is not None else ():
                counts[f"gate: {kind}"] = counts.get(f"gate: {kind}", 0) + count
        return counts

    def reports(self, running: bool) -> Iterator[tuple[str, HealthReport]]:
        """Yield the name and the health of each pipe of a plugin that is `running` or not.

        Where numbers were held at a limit since the last call it is a warning.
        """
        for place, (pipe, gate) in enumerate(self.controllers):
            counts = {} if gate is None else gate.counts
            news = sum(counts.values()) - self._reported[place]
            self._reported[place] = sum(counts.values())
            state = "computed, not sent: idle" if self._idle and gate is not None else "sent" if running else "not sent"
            summary = f"{state}; {news} numbers were not finite, or held at a limit" if news else state
            yield pipe.name, HealthReport(Health.WARNING if news else Health.GOOD, summary, dict(counts))

    def _find_start(self) -> None:
        """Find where joints start: where they are measured, but those that follow what was sent last, there.

        A joint under a load stays away from its command. If it started where it is, it would yield once more, and
        again with each further start.
        """
        self.start_position[:] = self._robot.state.position
        self.joints.follow(self.start_position)


def _refuse(pipe: JointCommandPipe) -> NoReturn:
    field, values = next((field, values) for field, values in pipe.fields if not np.isfinite(values).all())
    joint = pipe.message.names[int(np.argmin(np.isfinite(values)))]
    raise NotFinite(
        f"a '{field}' of '{joint}' for other plugins that is not a finite number",
        where=f"pipe '{pipe.name}'",
        expected="a number in every cycle",
    )
