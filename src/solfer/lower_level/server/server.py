"""Offers a lower level to plugins."""

import dataclasses
import logging
import math
from collections.abc import Iterable, Sequence

from solfer.errors import CommandRefused
from solfer.interfaces.declaration import Service
from solfer.lower_level.claims.refusals import concerns_claim
from solfer.lower_level.laws.controllers import LowerLevelController
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.server.services import controller_services, lower_level_services
from solfer.throttle import Throttle
from solfer.transport.endpoints import Queue
from solfer.transport.health import Health
from solfer.transport.inbox import Inbox
from solfer.transport.lower_level import ALL_OWNERS, LOWER_LEVEL, REFUSALS_TOPIC
from solfer.transport.messages import JOINT_FIELDS, REFUSALS, RefusalMessage
from solfer.transport.middleware import Middleware


class LowerLevelServer:
    """Receives the commands of the topics `<controller>/command`, and binds the services of a lower level.

    Publishes the senders of refused commands on the topic `lower_level/refusals`; also, for all plugins, that the robot
    was put into another state.

    Args:
        lower_level: The controllers.
        middleware: Connects the plugins.
        inbox: Queues calls; the loop of the lower level applies it between two cycles, after the commands.

    Attributes:
        most: The largest number of commands of a controller in a cycle.
    """

    def __init__(self, lower_level: LowerLevel, middleware: Middleware, inbox: Inbox):
        self._lower_level = lower_level
        self._middleware = middleware
        self._throttle = Throttle(logging.getLogger(__name__))
        self._refused = lower_level.refused
        self._starts = lower_level.starts
        self._queues: list[tuple[str, Queue]] = []
        self._writer = middleware.writer(REFUSALS_TOPIC, REFUSALS)
        self._published = -math.inf
        self._inbox = inbox
        self.most = 0
        self._ration = lower_level.ration
        self._serve(LOWER_LEVEL, lower_level_services(lower_level))
        for name, controller in lower_level.controllers.items():
            largest = self._ration.command or largest_command(controller)
            self._queues.append(
                (name, middleware.queue(f"{name}/command", "solfer/JointCommand", self._ration.waiting, largest))
            )
            self._serve(name, controller_services(controller, lower_level.folders, lower_level.robot))

    @property
    def dropped(self) -> int:
        """Number of commands that were dropped because they came too fast."""
        return sum(queue.dropped for _, queue in self._queues)

    def receive_commands(self) -> None:
        """Apply the received commands; refused ones are logged once a second with their sender."""
        for controller, queue in self._queues:
            messages = queue.take(self._lower_level.claims.nodes, self._ration.owners, self._ration.others)
            if len(messages) > self.most:
                self.most = len(messages)
            for message in messages:
                try:
                    self._lower_level.accept(controller, message)
                except CommandRefused as error:
                    self._throttle.warning(f"{controller} {message.claimant}", "refused: %s", error)
        self._publish_refusals()

    def report(self) -> None:
        """Publish the lower level's health: why it holds, the owners of joints, the senders of refused commands."""
        lower_level = self._lower_level
        news = lower_level.refused - self._refused
        self._refused = lower_level.refused
        held = lower_level.emergency.reason or lower_level.safeguard.reason
        level = Health.ERROR if held else Health.WARNING if news else Health.GOOD
        summary = held or (f"{news} commands refused" if news else "running")
        values: dict[str, float | str] = {
            "commands refused": lower_level.refused,
            "commands dropped": self.dropped,
            "commands of a cycle, at most": self.most,
            "requests refused": self._inbox.refused,
            "requests of a cycle, at most": self._inbox.most,
        }
        values |= {f"refused of {sender}": count for sender, count in lower_level.refusals.items()}
        for name, controller in lower_level.controllers.items():
            values[name] = (lower_level.claims.describe(name) or "free") if controller.running else "stopped"
        self._middleware.report(LOWER_LEVEL, level, summary, values)

    def _serve(self, owner: str, services: Sequence[Service]) -> None:
        """Offer services with a limit on the size of requests; urgent ones do not wait for the others."""
        largest = self._ration.request or largest_request(self._lower_level)
        for service in services:
            submit = self._inbox.submit_urgently if service.urgent else self._inbox.submit
            self._middleware.serve(owner, (dataclasses.replace(service, largest=largest),), submit)

    def _publish_refusals(self) -> None:
        now = self._middleware.now()
        if self._lower_level.starts != self._starts:
            self._starts = self._lower_level.starts
            self._writer.write(
                RefusalMessage((ALL_OWNERS,), (True,), ("the robot was put into another state",), stamp=now)
            )
        if now - self._published < 0.02:  # [s]
            return
        news = self._lower_level.refusals.news()
        if not news:
            return
        self._published = now
        self._writer.write(
            RefusalMessage(
                tuple(news),
                tuple(map(concerns_claim, news.values())),
                tuple(error.line for error in news.values()),
                stamp=now,
            )
        )


LENGTH_BYTES = 4
"""Bytes of a length in a message."""

NUMBER_BYTES = 8
"""Bytes of a number in a message."""

AMPLE = 2
"""Factor for room to spare: names of the hardware may be longer than those of the model."""


def largest_command(controller: LowerLevelController) -> int:
    """Compute the bytes of a command for all joints of a controller, with room to spare."""
    fields = len(JOINT_FIELDS) * (LENGTH_BYTES + NUMBER_BYTES * len(controller.joints))
    header = 1024  # bytes of everything but joints, such as the name of a frame
    return AMPLE * (_bytes(controller.joints) + fields) + header


def largest_request(lower_level: LowerLevel) -> int:
    """Compute the bytes of a request that names all joints, with room to spare."""
    joints = [controller.joints for controller in lower_level.controllers.values()]
    others = 4096  # bytes of the names of an owner, of controllers, or of a file
    return AMPLE * sum(_bytes(names) + NUMBER_BYTES * len(names) for names in joints) + others


def _bytes(names: Iterable[str]) -> int:
    return sum(LENGTH_BYTES + len(name.encode()) for name in names)
