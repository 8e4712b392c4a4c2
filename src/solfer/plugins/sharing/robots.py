"""Robots that the plugins of one process share: what is measured is read once and computed once.

Each plugin has a companion of the Robot that its group shares, with a desired State that no other plugin writes.
"""

import logging
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from solfer.config import Configuration, ControllerRecord, FeedbackRecord
from solfer.config.kinds.contact import ContactTags
from solfer.pipes import CommandPipe, FeedbackPipe, PipeContext, StateFeedbackPipe, factory
from solfer.pipes.sharing.cached_feedback import CachedFeedback, CycleCount
from solfer.pipes.sharing.local_topic import LocalFeedbackPipe, LocalReader, LocalTopic, LocalWriter
from solfer.plugins.sharing.groups import (
    MeasuredSources,
    Number,
    Writing,
    apart,
    extent,
    longest_history,
    origin,
    robot_groups,
    writing_of,
)
from solfer.robot import Robot

logger = logging.getLogger(__name__)


class SharedRobot:
    """A Robot that several plugins share, and the feedbacks that measure it.

    Args:
        group: Configurations of the plugins.
        turns: Counts the cycles of the process.
        guarded: Whether to keep what a failing component writes away from the others: they may write the Robot.

    Attributes:
        first: The Robot that was built first; None before.
        guarded: See above.
    """

    def __init__(self, group: Sequence[Configuration], turns: CycleCount, guarded: bool):
        self.first: Robot | None = None
        self.guarded = guarded
        self._group, self._turns, self._sources = group, turns, MeasuredSources(group)
        self._read: list[tuple[dict[str, Any], CachedFeedback]] = []
        self._written: dict[Writing, LocalTopic] = {}

    def feedback(self, record: FeedbackRecord, configuration: Configuration, context: PipeContext) -> FeedbackPipe:
        """Make a plugin's pipe for a feedback that measures the Robot; see `factory.feedback`.

        Raises:
            SolferError: The pipe cannot be made, or another plugin measures the same by another source.
        """
        writing = writing_of(record, configuration, self._group)
        if writing is not None:
            reader = LocalReader(record.source or "", self._topic(writing), context.middleware.now)
            return LocalFeedbackPipe(record.name, reader, record.initialize)
        key = origin(record, configuration) | extent(record) | {"order": _order(record, context.robot)}
        source = next((source for settings, source in self._read if settings == key), None)
        if source is None:
            longest = longest_history(record, configuration, self._group)
            source = CachedFeedback(
                factory.feedback(record.model_copy(update={"history": longest}), context), self._turns
            )
            self._read.append((key, source))
        self._sources.add(record, configuration, _numbers(source.pipe, record, context.robot))
        return source.share(record)

    def command(self, record: ControllerRecord, plugin: str, pipe: CommandPipe, now: Callable[[], float]) -> None:
        """Take note of what a plugin publishes by a command pipe, if others need not receive it."""
        writing = Writing(plugin, record.name)
        readers = ((each, feedback) for each in self._group for feedback in each.feedbacks)
        if any(writing_of(feedback, each, self._group) == writing for each, feedback in readers):
            pipe.writer = LocalWriter(pipe.writer, self._topic(writing), now)

    def _topic(self, writing: Writing) -> LocalTopic:
        return self._written.setdefault(writing, LocalTopic(writing.plugin))


class Sharing:
    """The Robots of a process.

    Args:
        configurations: All its plugins, in the order of their cycles.
        together: Names of the shared plugins that list them; see `robot_groups`.

    Attributes:
        turns: Counts its cycles: the loop that runs the plugins calls `turns.next` before each round.
    """

    def __init__(self, configurations: Sequence[Configuration], together: Sequence[str] | None = None):
        self.turns, groups = CycleCount(), robot_groups(configurations, together)
        alone = {each.module.name for each, shared in zip(configurations, together or (), strict=False) if not shared}
        self._robots: dict[str, SharedRobot] = {}
        for group in groups:
            if len(group) > 1:
                robot = SharedRobot(group, self.turns, group[0].module.name not in alone)
                self._robots |= dict.fromkeys((each.module.name for each in group), robot)
        for line in described(groups):
            logger.info("%s", line)

    def robot(self, configuration: Configuration) -> SharedRobot | None:
        """Return what a plugin shares; None: it has a Robot of its own."""
        return self._robots.get(configuration.module.name)


def described(groups: Sequence[Sequence[Configuration]]) -> Iterator[str]:
    """Yield a line for each Robot of a process: the plugins that share it, or why it is another one than the first."""
    for group in groups:
        names = "', '".join(each.module.name for each in group)
        shares = f"'{names}' share one Robot" if len(group) > 1 else f"'{names}' has a Robot of its own"
        differs = ", ".join(apart(groups[0][0], group[0]))
        yield f"{shares}: another {differs} than '{groups[0][0].module.name}'" if differs else shares


def _order(record: FeedbackRecord, robot: Robot) -> tuple[str, ...] | None:
    """Return the order of the DoFs at the other end of a feedback: plugins may have different maps of one name."""
    name = record.dofs.mapping if record.dofs else ""
    return robot.maps[name].external if name in robot.maps else None


def _numbers(pipe: FeedbackPipe, record: FeedbackRecord, robot: Robot) -> Iterator[Number]:
    """Yield what a feedback feeds."""
    if isinstance(pipe, StateFeedbackPipe):
        for state_field in pipe.state_fields:
            for dof in state_field.dofs:
                yield record.function or "state", state_field.interface, robot.dofs[dof]
    if isinstance(record, ContactTags):
        yield from (("contact", "wrench", name) for name in record.contacts or robot.contacts.names)
