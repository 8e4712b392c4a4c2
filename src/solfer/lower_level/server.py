"""Offers a lower level to plugins."""

import logging
import math

from solfer.errors import CommandRefused
from solfer.logs import Throttle
from solfer.lower_level.lower_level import LowerLevel
from solfer.lower_level.refusals import concerns_claim
from solfer.lower_level.services import controller_services, lower_level_services
from solfer.pipes.endpoints import Queue
from solfer.pipes.inbox import Inbox
from solfer.pipes.lower_level import EVERYBODY, LOWER_LEVEL, REFUSED
from solfer.pipes.messages import REFUSALS, JointMessage, RefusalMessage
from solfer.pipes.middleware import Middleware

PERIOD = 0.02
"""Shortest time between two messages about refused commands [s]."""


class LowerLevelServer:
    """Takes the commands of the topics `<controller>/command`, and binds the services of a lower level.

    Whose commands it refuses it says on the topic `lower_level/refusals`; and all that the robot was put into another
    state.

    Args:
        lower_level: The controllers.
        middleware: The way to the plugins.
        inbox: Takes calls; whoever runs the lower level applies it between two cycles, after the commands.
    """

    def __init__(self, lower_level: LowerLevel, middleware: Middleware, inbox: Inbox):
        self._lower_level, self._middleware = lower_level, middleware
        self._throttle, self._refused = Throttle(logging.getLogger(__name__)), lower_level.refused
        self._starts = lower_level.starts
        self._queues: list[tuple[str, Queue]] = []
        self._writer, self._told = middleware.writer(REFUSED, REFUSALS), -math.inf
        middleware.serve(LOWER_LEVEL, lower_level_services(lower_level), inbox.submit)
        for name, controller in lower_level.controllers.items():
            self._queues.append((name, middleware.queue(f"{name}/command", "solfer/JointCommand")))
            middleware.serve(name, controller_services(controller, lower_level.robot), inbox.submit)

    @property
    def dropped(self) -> int:
        """Commands that came faster than they were taken."""
        return sum(queue.dropped for _, queue in self._queues)

    def take_commands(self) -> None:
        """Apply the commands that have come; what is refused is named once a second with its sender."""
        for controller, queue in self._queues:
            for message in queue.drain():
                self._accept(controller, message)
        self._tell_refusals()

    def report(self) -> None:
        """Publish the lower level's health: the emergency stop, who commands what, whose commands were refused."""
        lower_level = self._lower_level
        news = lower_level.refused - self._refused
        self._refused = lower_level.refused
        level, summary = (2, lower_level.emergency.reason) if lower_level.emergency else (
            (1, f"{news} commands refused") if news else (0, "running"))
        values: dict[str, float | str] = {"commands refused": lower_level.refused, "commands dropped": self.dropped}
        values |= {f"refused of {sender}": count for sender, count in lower_level.refusals.items()}
        for name, controller in lower_level.controllers.items():
            values[name] = (lower_level.claims.describe(name) or "free") if controller.running else "stopped"
        self._middleware.report(LOWER_LEVEL, level, summary, values)

    def _accept(self, controller: str, message: JointMessage) -> None:
        try:
            self._lower_level.accept(controller, message)
        except CommandRefused as error:
            self._throttle.warning(f"{controller} {message.sender}", "refused: %s", error)

    def _tell_refusals(self) -> None:
        now = self._middleware.now()
        if self._lower_level.starts != self._starts:
            self._starts = self._lower_level.starts
            self._writer.write(RefusalMessage((EVERYBODY,), (True,), ("the robot was put into another state",), now))
        if now - self._told < PERIOD:
            return
        news = self._lower_level.refusals.news()
        if not news:
            return
        self._told = now
        self._writer.write(RefusalMessage(tuple(news), tuple(map(concerns_claim, news.values())),
                                          tuple(error.line for error in news.values()), now))
