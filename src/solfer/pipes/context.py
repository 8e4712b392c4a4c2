"""The context in which pipes are made, and helpers for the factories of all kinds of pipes."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from solfer.config import CalibrationRecord
from solfer.config.records.pipes import FeedbackRecord, InterfaceRecord, PipeRecord
from solfer.errors import PipeError
from solfer.interfaces.port import Port
from solfer.model import State
from solfer.numerics.filters import LowPass
from solfer.pipes.state_feedback_pipe import MakeFilter, Reception
from solfer.robot import Robot
from solfer.transport.endpoints import NullWriter, Writer
from solfer.transport.messages import canonical
from solfer.transport.middleware import Middleware


@dataclass(frozen=True)
class PipeContext:
    """Context shared by the pipes of one plugin.

    Attributes:
        robot: The Robot.
        middleware: The middleware of the topics.
        calibrations: Calibrations of the hardware by name.
        rate: Control cycles per second [Hz]; the filters make one step in each.
        inputs: The component's ports that receive Robot Points, by name.
        outputs: The component's ports that publish Robot Points, by name.
        silent: Whether nothing is published to other plugins.
        idle: Whether nothing is published to the lower level.
        component: Name of the component, which its commands carry: a node may have several.
    """

    robot: Robot
    middleware: Middleware
    calibrations: Mapping[str, CalibrationRecord]
    rate: float
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    silent: bool = False
    idle: bool = False
    component: str = ""

    def state(self, function: str) -> State:
        """Return the Robot's State for a tag `function`: `state` and `motor` are measured, `reference` is desired."""
        robot = self.robot
        return {"state": robot.state, "motor": robot.motor, "reference": robot.command}[function]

    def writer(self, topic: str, message: str) -> Writer:
        """Make the writer of a pipe to other plugins; it sends nothing if the plugin is `silent`."""
        return NullWriter(topic) if self.silent else self.middleware.writer(topic, message)

    def commander(self, topic: str, message: str) -> Writer:
        """Make the writer of a pipe to the lower level; it sends nothing if the plugin is idle."""
        return NullWriter(topic) if self.idle else self.middleware.writer(topic, message)

    def low_pass(self, record: PipeRecord) -> MakeFilter | None:
        """Return a function that makes the filters of a pipe; None if it has none.

        Raises:
            ConfigError: The cut-off is at or above half of the rate.
        """
        settings = record.filter
        if settings is None or not settings.run:
            return None
        where = settings.where("frequency")

        def make(size: int) -> LowPass:
            return LowPass(size, settings.frequency, settings.damping, rate=self.rate, where=where)

        make(0)  # raises for a wrong filter here, even if none is made later
        return make

    def reception(self, record: FeedbackRecord) -> Reception:
        """Return how a pipe to a State receives."""
        return Reception(
            record.initialize,
            low_pass=self.low_pass(record),
            measured=record.function != "reference",
            history=record.history or 0,
        )


def fields_of(interface: InterfaceRecord, pipe: str) -> tuple[str, ...]:
    """Return the interfaces that a pipe carries.

    Raises:
        PipeError: It carries none.
    """
    fields = interface.carried
    if not fields:
        raise PipeError(f"pipe '{pipe}' carries no interface", where=interface.where(), expected="at least one true")
    return fields


def message_of(record: PipeRecord, known: Iterable[str], what: str) -> str:
    """Return the canonical name of a pipe's message, one of `known`; `what` describes their content.

    Raises:
        PipeError: The message is not one of `known`.
        UnknownName: There is no such message.
    """
    where = record.where("message")
    message = canonical(record.travels_as, where)
    known = tuple(known)
    if message not in known:
        raise PipeError(f"{message} carries no {what}", where=where, expected=" or ".join(known))
    return message
