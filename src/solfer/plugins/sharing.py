"""What the plugins of one process have in common: what they measure of a robot is taken in and computed once.

Each plugin keeps a Robot of its own, with a desired State that nobody else writes. Plugins whose Robot and measured
feedbacks are described alike take the messages together, into measured States on the same memory, and have one object
for the kinematics: who comes first in a cycle computes it, and the others find what they need.
"""

import logging
from dataclasses import dataclass, field

from solfer.config import Configuration, FeedbackRecord
from solfer.model import State
from solfer.pipes import Surroundings, factory
from solfer.pipes.shared import SharedFeedback, Source, Turns
from solfer.robot import Robot

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Apart(Surroundings):
    """Surroundings of the sources.

    Attributes:
        states: What they write, by the `function` of the pipes.
    """

    states: dict[str, State] = field(default_factory=dict)

    def state(self, function: str) -> State:
        """See `Surroundings.state`."""
        return self.states[function]


class Group:
    """Plugins that measure the same.

    Args:
        configuration: That of the first of them.
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
        """Whether a plugin of this configuration measures what the group does."""
        return _described(configuration) == self._description

    def join(self, name: str, robot: Robot) -> bool:
        """A plugin of this name has built its Robot beside the first one; whether it belongs to the group."""
        if self.first is None:
            self.first = robot
            self._states = {"state": robot.state.window(), "motor": robot.motor.window()}
        elif robot.kinematics is not self.first.kinematics:
            return False
        else:
            logger.info("'%s' measures its robot together with '%s'", name, "', '".join(self._members))
        self._members.append(name)
        return True

    def feedback(self, record: FeedbackRecord, surroundings: Surroundings) -> SharedFeedback:
        """A pipe of one plugin, on the source of all; see `factory.feedback`."""
        source = self._sources.get(record.name)
        if source is None:
            apart = _Apart(surroundings.robot, surroundings.middleware, surroundings.calibrations, surroundings.rate,
                           states=self._states)
            source = self._sources[record.name] = Source(factory.feedback(record, apart))
        state = surroundings.state(record.function or "state")
        return SharedFeedback(source, self._turns, state, record.initialize)


class Sharing:
    """The groups of a process.

    Attributes:
        turns: Counts its cycles: who runs the plugins calls `turns.next` before each round.
    """

    def __init__(self) -> None:
        self.turns = Turns()
        self._groups: list[Group] = []

    def group(self, configuration: Configuration) -> Group | None:
        """The group of a plugin; None for one that has to measure alone.

        A plugin that changes the State which it reads would change the others'. Filters and alignments begin anew with
        a plugin, and a plugin must not do that for others.
        """
        heard = _measured(configuration)
        if not heard or configuration.module.model_change:
            return None
        if any(record.calibrate or (record.filter is not None and record.filter.run) for record in heard):
            return None
        for group in self._groups:
            if group.admits(configuration):
                return group
        self._groups.append(Group(configuration, self.turns))
        return self._groups[-1]


def measures(record: FeedbackRecord) -> bool:
    """Whether a feedback brings numbers of the measured States."""
    return record.space in ("JOINT", "OPERATIONAL") and record.function != "reference"


def _measured(configuration: Configuration) -> tuple[FeedbackRecord, ...]:
    return tuple(record for record in configuration.feedbacks if measures(record))


def _described(configuration: Configuration) -> tuple[object, ...]:
    """All that decides what a plugin measures, and on what model."""
    return (configuration.file, configuration.system, configuration.rate, configuration.sources,
            configuration.mappings, configuration.calibrations, _measured(configuration))
