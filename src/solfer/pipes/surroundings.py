"""What a pipe is made for, and what the makers of all kinds of pipes need."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from solfer.components.port import Port
from solfer.config import CalibrationRecord
from solfer.config.pipes import InterfaceRecord, PipeRecord
from solfer.errors import PipeError
from solfer.model import State
from solfer.numerics.filters import LowPass
from solfer.pipes.channel import INTERFACES
from solfer.pipes.endpoints import Silent, Writer
from solfer.pipes.joint import MakeFilter
from solfer.pipes.messages import canonical
from solfer.pipes.middleware import Middleware
from solfer.robot import Robot


@dataclass(frozen=True)
class Surroundings:
    """What the pipes of one plugin have in common.

    Attributes:
        robot: The Robot.
        middleware: The way to the outside.
        calibrations: Calibrations of the hardware by name.
        rate: Control cycles a second [Hz]; the filters make one step in each.
        inputs: The component's ports that hear Robot Points, by name.
        outputs: Those that tell them.
        silent: Whether nothing is told to other plugins.
        idle: Whether nothing is sent to the lower level.
    """

    robot: Robot
    middleware: Middleware
    calibrations: Mapping[str, CalibrationRecord]
    rate: float
    inputs: Mapping[str, Port] = field(default_factory=dict)
    outputs: Mapping[str, Port] = field(default_factory=dict)
    silent: bool = False
    idle: bool = False

    def state(self, function: str) -> State:
        """The Robot's State that the tag `function` means: `state` and `motor` are measured, `reference` is desired."""
        robot = self.robot
        return {"state": robot.state, "motor": robot.motor, "reference": robot.command}[function]

    def writer(self, topic: str, message: str) -> Writer:
        """Where pipes to other plugins write: to a topic, or nowhere if the plugin is silent."""
        return Silent(topic) if self.silent else self.middleware.writer(topic, message)

    def commander(self, topic: str, message: str) -> Writer:
        """Where pipes to the lower level write: to a topic, or nowhere if the plugin is idle."""
        return Silent(topic) if self.idle else self.middleware.writer(topic, message)

    def low_pass(self, record: PipeRecord) -> MakeFilter | None:
        """What makes the filters that a pipe asks for, None if it does not.

        Raises:
            ConfigError: The cut-off is at or above half of the rate.
        """
        wanted = record.filter
        if wanted is None or not wanted.run:
            return None
        where = wanted.where("frequency")

        def make(size: int) -> LowPass:
            return LowPass(size, wanted.frequency, wanted.damping, self.rate, where)

        make(0)  # the faults of a filter are found here, whether or not one is made
        return make


def fields_of(interface: InterfaceRecord, pipe: str) -> tuple[str, ...]:
    """The interfaces that a pipe carries.

    Raises:
        PipeError: There is none.
    """
    fields = tuple(field for field in INTERFACES if getattr(interface, field))
    if not fields:
        raise PipeError(f"pipe '{pipe}' carries no interface", where=interface.where(), expected="at least one true")
    return fields


def message_of(record: PipeRecord, default: str, known: Iterable[str], what: str) -> str:
    """Canonical name of a pipe's message, one of `known`; `what` is what these carry.

    Raises:
        PipeError: The message carries something else.
        UnknownName: There is no such message.
    """
    where = record.where("message")
    message, known = canonical(record.message or default, where), tuple(known)
    if message not in known:
        raise PipeError(f"{message} carries no {what}", where=where, expected=" or ".join(known))
    return message
