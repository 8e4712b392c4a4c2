"""The topics that a simulated robot publishes, their rates, and its parameters, where these are not set already."""

from collections.abc import Sequence

from solfer.model.documents import read_text
from solfer.model.urdf.cut import cut
from solfer.model.urdf.description import Description
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.delay_line import DelayLine, steps_of
from solfer.simulation.sensors import Rates
from solfer.simulation.sensors.sensor import Sensor
from solfer.simulation.server.rates import every
from solfer.simulation.simulation import Simulation
from solfer.transport.endpoints import Writer
from solfer.transport.messages import Message, copied
from solfer.transport.middleware import SEED, Middleware


class Publication:
    """Messages of a sensor, which are measured again and again and written a little later.

    Args:
        steps: Steps from one measurement to the next.
        writers: One for each message.
        sensor: Measures.
        delay: Steps from a measurement to its messages.

    Attributes:
        next: Number of steps after which it has something to do.
    """

    def __init__(self, steps: int, writers: Sequence[Writer], sensor: Sensor, delay: int = 0):
        self._steps = steps
        self._writers = writers
        self._sensor = sensor
        self._delay = delay
        self._newest: Sequence[Message] = ()
        self.next = 0.0
        self._forget()

    def step(self, done: int) -> None:
        """Measure and write what is due after a number of steps."""
        if self._restarts != self._sensor.restarts:
            self._forget()
        if done % self._steps == 0:
            measured = self._sensor.messages()
            self._newest = [copied(message) for message in measured] if self._delay else measured
            self._line.put(done, self._newest)
        for messages in self._line.due(done):
            self._write(messages)
        self.next = min(done - done % self._steps + self._steps, self._line.next)

    def repeat(self) -> None:
        """Write the newest measurement at once: simulated time stands still, and no noise goes by."""
        if self._restarts != self._sensor.restarts or not self._newest:
            self._write(self._sensor.peek())
            self._forget()
        else:
            self._write(self._newest)

    def _forget(self) -> None:
        """Forget what was measured before the sensor was restarted."""
        self._restarts = self._sensor.restarts
        self._line: DelayLine[Sequence[Message]] = DelayLine(self._delay)
        self._newest = ()

    def _write(self, messages: Sequence[Message]) -> None:
        for writer, message in zip(self._writers, messages, strict=True):
            writer.write(message)


def publications(simulation: Simulation, middleware: Middleware, rates: Rates) -> list[Publication]:
    """List all that a simulated robot publishes; the truth is not delayed.

    Raises:
        SimulationError: A rate is not the rate of the steps divided by a whole number, or the delay is not whole steps.
    """
    sensors = simulation.sensors.record
    delay = steps_of(sensors.delay, sensors.where("delay"))
    return [
        Publication(
            every(getattr(rates, name), rates.where(name)),
            [middleware.writer(topic, sensor.message) for topic in sensor.topics],
            sensor,
            delay=0 if sensor.truth else delay,
        )
        for name, sensor in simulation.sensors.items()
    ]


def robot_parameters(bundle: BundleRecord) -> dict[str, str]:
    """Read the model, groups and partial models of a robot and the seed of its noise, by the names of their parameters.

    Raises:
        ModelError, ConfigError: A file of the bundle is wrong.
    """
    description = Description.from_file(bundle.urdf.location).with_base(bundle.floating_base)
    found = {"/robot_description": description.text, SEED: str(bundle.sensors.seed)}
    if bundle.srdf is not None:
        found["/robot_semantic_description"] = read_text(bundle.srdf.location, "SRDF")
    return found | {f"/robot_{name}": cut(description, part.at, part.keep) for name, part in bundle.parts.items()}
