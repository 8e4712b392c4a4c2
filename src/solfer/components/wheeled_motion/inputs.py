"""What a component that drives receives, and what of it counts in a cycle."""

import logging

from solfer.components.wheeled_motion.drive import Drive
from solfer.components.wheeled_motion.references import References
from solfer.components.wheeled_motion.support.straight import StraightAhead
from solfer.components.wheeled_motion.tags import DrivingTags
from solfer.components.wheeled_motion.targets import STREAM_TIMEOUT, Targets
from solfer.components.wheeled_motion.wheels import DrivenWheels
from solfer.interfaces.support import BASE_PORT
from solfer.throttle import Throttle

log = logging.getLogger(__name__)


class ReferenceInputs:
    """Lets the references move as messages request; where these fall silent in a motion, it comes to rest.

    Args:
        name: Name of the component.
        tags: Its tags.
        references: What is moved.
        wheels: The wheels.

    Attributes:
        drive: Velocities of the base that others send.
        targets: Desired places of base and vertices.
        straight: Leaves out what wheels that nothing steers cannot do; None: they are steered, or the law is original.
    """

    def __init__(self, name: str, tags: DrivingTags, references: References, wheels: DrivenWheels):
        self._name = name
        self._references = references
        self._wheels = wheels
        self.drive = Drive(*tags.speeds[:2], *tags.accelerations[:2])
        self.targets = Targets(len(wheels.links), tags.speeds, tags.accelerations)
        self._settling = 0.0  # [s] for which references stay with a robot that still rolls on
        is_steered = len(wheels.steering) > 0
        self.straight = None if is_steered or tags.is_original else StraightAhead(wheels.links)
        self._throttle = Throttle(log)

    @property
    def ratio(self) -> float:
        """Factor that scales the velocities of others to their limits: one of base and vertices."""
        return min(self.drive.ratio, self.targets.ratio)

    @property
    def are_abandoned(self) -> bool:
        """Whether the motion ends since no velocities come any more, though the last ones were to go on."""
        return self.drive.is_abandoned or self.targets.is_abandoned

    def start(self) -> None:
        """Begin without anything that is desired."""
        self.drive.start()
        self.targets.start()
        self._settling = 0.0

    def update(self, step: float, gap: float) -> bool:
        """Write the received velocities and targets to the references; of the base the newest ones.

        Through a gap references go on at the mean of the velocities before and after it.

        Args:
            step: Time of the cycle [s].
            gap: Time before it in which nothing was commanded [s].

        Returns:
            Whether a motion that was abandoned has just come to rest, so that references stay with the robot.
        """
        if gap:
            self._references.step(0.5 * gap)
        if wrong := self.targets.read():
            self._throttle.warning("targets", "%s: %s, it is ignored", self._name, wrong)
        if self.targets.has_base:
            if self.targets.ports[BASE_PORT].fresh:
                self.drive.start()
            elif self.drive.is_active:
                self.targets.leave_base()
        if self.drive.is_active or self.targets.is_active:
            self._move(step + gap)
        self._settling -= step + gap
        is_at_rest = self._settling > 0.0 and not self._references.waits
        if gap and not is_at_rest:
            self._references.step(0.5 * gap)
        return is_at_rest

    def _move(self, passed: float) -> None:
        """Write the velocities of a cycle, `passed` [s] after the one before; see `update`."""
        drive = self.drive
        targets = self.targets
        were_abandoned = self.are_abandoned
        if were_abandoned:
            what = "position" if targets.are_places_abandoned else "velocity"
            self._throttle.warning(
                "silence", "%s: no %s for %.2f s, it comes to rest", self._name, what, STREAM_TIMEOUT
            )
        if drive.is_active:
            drive.update(self._references, self._wheels.offsets.heading, self.ratio, passed)
        targets.update(self._references, self.ratio, passed)
        if were_abandoned and not self.are_abandoned:
            self._settling = 0.5  # [s] in which the robot is at rest, too
        elif drive.is_active or targets.is_active:
            self._settling = 0.0

    def leave_out(self) -> None:
        """Leave out what wheels that nothing steers cannot do, until `restore`; called where `straight` is there."""
        if self._references.waits:
            return
        offsets = self._wheels.offsets
        if left := self.straight.update(self._references, offsets.directions[0], offsets.heading):
            self._throttle.warning("straight", "%s: %s", self._name, left)

    def restore(self) -> None:
        """Let be desired again what was left out."""
        if not self._references.waits:
            self.straight.restore(self._references)
