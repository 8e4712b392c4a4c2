"""A trace of what plugins read, compute and publish in each cycle, in order; it costs nothing while it is off."""

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from solfer.model.observation import End, observed
from solfer.pipes import CommandPipe, FeedbackPipe, StateFeedbackPipe
from solfer.pipes.sharing.cached_feedback import CachedFeedbackPipe
from solfer.pipes.sharing.local_topic import LocalFeedbackPipe
from solfer.plugins.plugin import Plugin
from solfer.transport.endpoints import NEW, MessageStatus

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class TraceEvent:
    """One step of a cycle.

    Attributes:
        cycle: Number of the cycle, from 1 on; 0: before the first one.
        plugin: Name of the plugin in whose turn it happened.
        does: `reads`: it receives a new message; `computes` a quantity of its Robot; `writes` the State that it reads;
            or `publishes` a message.
        what: Name of the pipe, or of the quantity; empty for `writes`.
        robot: Names of the plugins that share the Robot.
        because: `computes`: feedbacks and plugins that changed the State since the same quantity was computed last.
    """

    cycle: int
    plugin: str
    does: str
    what: str = ""
    robot: tuple[str, ...] = ()
    because: tuple[str, ...] = ()

    def __str__(self) -> str:
        because = f" because of {', '.join(self.because)}" if self.because else ""
        return f"{self.cycle} {self.plugin} {self.does} {self.what}".rstrip() + because


class _TracedRobot:
    """A Robot of some plugins, and what has changed it since each of its quantities was computed."""

    def __init__(self, plugin: Plugin):
        self.robot = plugin.robot
        self.plugins: tuple[str, ...] = (plugin.name,)
        self._changes: list[str] = []
        self._known: dict[str, int] = {}

    def change(self, by: str) -> None:
        """Note what has changed the State."""
        self._changes.append(by)

    def causes(self, quantity: str) -> tuple[str, ...]:
        """Return what has changed the State since `quantity` was computed last; it is up to date from now on."""
        new = self._changes[self._known.get(quantity, 0) :]
        self._known[quantity] = len(self._changes)
        return tuple(dict.fromkeys(new))


class CycleTrace:
    """Records the events of some plugins' cycles until `close`.

    Args:
        plugins: The plugins of one process, in the order of their cycles.

    Attributes:
        events: What has happened, in order.
        cycle: Number of the present cycle: it begins with the first plugin's.
    """

    def __init__(self, plugins: Sequence[Plugin]):
        self.events: list[TraceEvent] = []
        self.cycle = 0
        self._plugin = ""
        self._before = b""
        self._ends: list[End] = []
        self._robots: list[_TracedRobot] = []
        traced: list[FeedbackPipe] = []
        for plugin in plugins:
            robot = self._robot_of(plugin)
            self._ends.append(observed(plugin, "cycle", before=partial(self._begin, plugin, plugin is plugins[0])))
            for feedback in plugin.feedbacks:
                pipe = feedback.source.pipe if isinstance(feedback, CachedFeedbackPipe) else feedback
                if not isinstance(pipe, LocalFeedbackPipe) and not any(pipe is each for each in traced):
                    traced.append(pipe)
                    self._ends.append(observed(pipe, "run", partial(self._read, robot, pipe)))
            self._ends += self._observed_component(plugin, robot)
            for command, _ in plugin.outputs.controllers:
                self._ends.append(observed(command, "send", partial(self._publish, robot, command)))

    def of(self, cycle: int) -> list[str]:
        """Return the lines of one cycle, without its number."""
        return [str(event).partition(" ")[2] for event in self.events if event.cycle == cycle]

    def close(self) -> None:
        """End the trace: what was observed is as it was before."""
        while self._ends:
            self._ends.pop()()

    def _robot_of(self, plugin: Plugin) -> _TracedRobot:
        """Return the Robot that a plugin shares with earlier ones, or observe its own."""
        for traced in self._robots:
            if traced.robot.shares_measurement(plugin.robot):
                traced.plugins = (*traced.plugins, plugin.name)
                return traced
        traced = _TracedRobot(plugin)
        self._robots.append(traced)
        self._ends += plugin.robot.observe(partial(self._compute, traced))
        return traced

    def _observed_component(self, plugin: Plugin, robot: _TracedRobot) -> list[End]:
        """Observe whether a component changes the measured State."""
        component = plugin.component
        state = plugin.robot.state

        def before() -> None:
            self._before = state.position.tobytes() + state.velocity.tobytes()

        def after(_: Any) -> None:
            if state.position.tobytes() + state.velocity.tobytes() != self._before:
                robot.change(plugin.name)
                self._add("writes", "", robot)

        return [observed(component, method, after, before=before) for method in ("init", "update", "send")]

    def _begin(self, plugin: Plugin, first: bool) -> None:
        self._plugin = plugin.name
        self.cycle += first

    def _read(self, robot: _TracedRobot, pipe: FeedbackPipe, status: MessageStatus) -> None:
        if status is NEW:
            if isinstance(pipe, StateFeedbackPipe) and pipe.measures:
                robot.change(pipe.name)
            self._add("reads", pipe.name, robot)

    def _compute(self, robot: _TracedRobot, quantity: str) -> None:
        self._add("computes", quantity, robot, because=robot.causes(quantity))

    def _publish(self, robot: _TracedRobot, pipe: CommandPipe, _: None, __: float) -> None:
        self._add("publishes", pipe.name, robot)

    def _add(self, does: str, what: str, robot: _TracedRobot, because: tuple[str, ...] = ()) -> None:
        self.events.append(TraceEvent(self.cycle, self._plugin, does, what=what, robot=robot.plugins, because=because))


def cycles(text: str) -> int:
    """Read a number of cycles from a command line; a ValueError if it is none."""
    if not text.isdecimal():
        raise ValueError(text)
    return int(text)


class TraceLog:
    """Logs the first cycles in which all of some plugins run; that allocates, so those cycles take longer.

    Args:
        plugins: The plugins of one process, in the order of their cycles.
        cycles: Number of cycles.
    """

    def __init__(self, plugins: Sequence[Plugin], cycles: int):
        self._plugins = tuple(plugins)
        self._left = cycles
        self._trace: CycleTrace | None = None

    def poll(self) -> None:
        """Begin the trace, go on, or log it; to be called at the beginning of each cycle."""
        if not self._left:
            return
        if self._trace is None:
            if all(plugin.running for plugin in self._plugins):
                self._trace = CycleTrace(self._plugins)
        elif self._trace.cycle == self._left:
            self._trace.close()
            for event in self._trace.events:
                logger.info("cycle %s", event)
            self._left = 0
