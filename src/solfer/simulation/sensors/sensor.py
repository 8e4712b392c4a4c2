"""What every sensor of a simulated robot is."""

import abc
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from solfer.simulation.sensors.equipment import Equipment
from solfer.simulation.sensors.noise import Noise
from solfer.simulation.state import SimulationState
from solfer.transport.messages import Message


class Sensor(abc.ABC):
    """A sensor of a simulated robot. Each class in a module of `kinds` is one that a robot can have.

    Args:
        state: What the robot does.
        seed: Seed of the noise.

    Attributes:
        name: Its name, the key of its rate below `sensors: rates`, and that of its noise.
        message: Canonical name of its messages.
        what: What it measures, for the documentation of its rate.
        rate: Rate of publication by default [Hz].
        tags: Its keys below `sensors`, with their types and fields, as `pydantic.create_model` takes them.
        truth: Whether it reports what no sensor of a real robot could measure; a mock of hardware leaves it out.
        topics: Topics of its messages.
        restarts: Number of its restarts.
    """

    name: ClassVar[str]
    message: ClassVar[str]
    what: ClassVar[str]
    rate: ClassVar[float] = 200.0
    tags: ClassVar[Mapping[str, tuple[Any, Any]]] = {}
    truth: ClassVar[bool] = False
    topics: Sequence[str]

    def __init__(self, state: SimulationState, seed: int = 0):
        self.state, self.noise = state, Noise(seed, self.name)
        self.restarts = 0
        self._seed: int | None = None

    @classmethod
    @abc.abstractmethod
    def of(cls, state: SimulationState, equipment: Equipment) -> "Sensor | None":
        """Make the sensor of a robot; None: it has none.

        Raises:
            UnknownName: It sits on a link that the robot does not have.
        """

    def restart(self, seed: int | None = None) -> None:
        """Begin the noise again, or that of another seed."""
        self.noise.restart(seed)
        self.restarts += 1
        self._seed = seed

    def peek(self) -> Sequence[Message]:
        """Take a sample before the first one, and restart as if it had not been taken."""
        messages = self.messages()
        self.restart(self._seed)
        return messages

    @abc.abstractmethod
    def messages(self) -> Sequence[Message]:
        """Take one sample: a message for each of `topics`. They are the same objects each time."""


class SingleSensor(Sensor):
    """A sensor with one topic, by default its name."""

    topic: ClassVar[str] = ""

    @property
    def topics(self) -> Sequence[str]:
        """See `Sensor`."""
        return (self.topic or self.name,)

    def messages(self) -> Sequence[Message]:
        """See `Sensor.messages`."""
        return (self.measure(),)

    @abc.abstractmethod
    def measure(self) -> Message:
        """Take one sample; the message is the same object each time."""
