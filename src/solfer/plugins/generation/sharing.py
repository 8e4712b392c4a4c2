"""Shared measurements of the plugins of one process: read once and computed once.

Each plugin keeps a Robot of its own, with a desired State that no other plugin writes. Plugins with the same
configuration of Robot and measured feedbacks read the messages together, into measured States on the same memory, and
share one Kinematics: the first plugin of a cycle computes it, and the others find it up to date.
"""

import logging
from dataclasses import dataclass, field
from typing import cast

from solfer.config import Configuration, FeedbackRecord
from solfer.model import State
from solfer.pipes import PipeContext, StateFeedbackPipe, factory
from solfer.pipes.shared_feedback import SharedFeedbackPipe, Source, Turns
from solfer.robot import Robot

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Apart(PipeContext):
    """Context of the shared pipes, which write measured States of the group.

    Attributes:
        states: The States that the pipes write, by their `function`.
    """

    states: dict[str, State] = field(default_factory=dict)

    def state(self, function: str) -> State:
        """See `PipeContext.state`."""
        return self.states[function]


class SharingGroup:
    """Plugins that measure the same.

    Args:
        configuration: That of its first plugin.
        turns: Counts the cycles of the process.

    Attributes:
        first: The Robot that was built first; None before.
    """

    def __init__(self, configuration: Configuration, turns: Turns):
        self.first: Robot | None = None
        self._description, self._turns = _described(configuration), turns
        self._sources: dict[str, Source] = {}
        self._states: dict[str, State] = {}
        self._members: list[str] = []

    def admits(self, configuration: Configuration) -> bool:
        """Return whether a plugin of this configuration measures the same as the group."""
        return _described(configuration) == self._description

    def join(self, name: str, robot: Robot) -> bool:
        """Add a plugin by its `name` and new `robot`; return whether it belongs to the group."""
        if self.first is None:
            self.first = robot
            self._states = {"state": robot.state.window(), "motor": robot.motor.window()}
        elif robot.kinematics is not self.first.kinematics:
            return False
        else:
            logger.info("'%s' measures its robot together with '%s'", name, "', '".join(self._members))
        self._members.append(name)
        return True

    def feedback(self, record: FeedbackRecord, context: PipeContext) -> SharedFeedbackPipe:
        """Make a pipe of one plugin that reads the source shared by all; see `factory.feedback`."""
        source = self._sources.get(record.name)
        if source is None:
            apart = _Apart(context.robot, context.middleware, context.calibrations, context.rate, states=self._states)
            source = self._sources[record.name] = Source(cast(StateFeedbackPipe, factory.feedback(record, apart)))
        state = context.state(record.function or "state")
        return SharedFeedbackPipe(source, self._turns, state, source.pipe.required)


class Sharing:
    """The groups of a process.

    Attributes:
        turns: Counts its cycles: the loop that runs the plugins calls `turns.next` before each round.
    """

    def __init__(self) -> None:
        self.turns = Turns()
        self._groups: list[SharingGroup] = []

    def group(self, configuration: Configuration) -> SharingGroup | None:
        """Find or make the group of a plugin; None for one that has to measure alone.

        These are plugins that change the State that they read, which would change it for others, plugins with
        filters or alignments, which begin anew with each start of their plugin, and those that measure an interface
        that they have added: added interfaces are a State's own.
        """
        received = _measured(configuration)
        if not received or configuration.module.model_change:
            return None
        if any(record.calibrate or (record.filter is not None and record.filter.run) for record in received):
            return None
        if any(not record.interface.measurable for record in received):
            return None
        for group in self._groups:
            if group.admits(configuration):
                return group
        self._groups.append(SharingGroup(configuration, self.turns))
        return self._groups[-1]


def measures(record: FeedbackRecord) -> bool:
    """Return whether a feedback measures part of the Robot's measured States."""
    return record.space in ("JOINT", "OPERATIONAL") and record.function != "reference"


def _measured(configuration: Configuration) -> tuple[FeedbackRecord, ...]:
    return tuple(record for record in configuration.feedbacks if measures(record))


def _described(configuration: Configuration) -> tuple[object, ...]:
    """Return all settings that determine what a plugin measures, and on which model."""
    return (
        configuration.file,
        configuration.system,
        configuration.rate,
        configuration.sources,
        configuration.mappings,
        configuration.calibrations,
        _measured(configuration),
    )
