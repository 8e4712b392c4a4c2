"""What sensors measure is written in time, or later where it is delayed."""

import numpy as np
import pytest

from solfer.errors import SimulationError
from solfer.simulation.delay_line import steps_of
from solfer.simulation.sensors.sensor import SingleSensor
from solfer.simulation.server.publications import Publication
from solfer.transport.messages import VectorMessage


class Written:
    """Keeps the first number of each message, and when it was written."""

    def __init__(self):
        self.step, self.kept = 0, []

    def write(self, message):
        self.kept.append((self.step, message.values[0]))


class StepSensor(SingleSensor):
    """Measures the step of a writer, and how many samples it has taken."""

    name, message, topic = "counter", "solfer/Vector", "counter"

    def __init__(self, writer):
        super().__init__(None)
        self._writer, self._message = writer, VectorMessage("world", np.zeros(3))
        self.taken = 0

    @classmethod
    def of(cls, state, equipment):
        return None

    def restart(self, seed=None):
        super().restart(seed)
        self.taken = 0

    def measure(self):
        self.taken += 1
        self._message.values[:2] = self._writer.step, self.taken
        return self._message


def publish(delay, steps=12):
    writer = Written()
    publication = Publication(5, [writer], StepSensor(writer), delay)
    for writer.step in range(1, steps):
        publication.step(writer.step)
    return writer.kept


def test_measurements_are_written_in_their_step():
    assert publish(0) == [(5, 5.0), (10, 10.0)]


@pytest.mark.parametrize("delay", [1, 6])
def test_delayed_messages_keep_what_was_measured(delay):
    assert publish(delay, 18) == [(step + delay, float(step)) for step in (5, 10, 15) if step + delay < 18]


@pytest.mark.parametrize("delay", [0, 2])
def test_a_pause_takes_no_samples(delay):
    """Noise goes on as if there had been no pause, before the first sample, after others, and after a reset."""
    writer = Written()
    sensor = StepSensor(writer)
    publication = Publication(5, [writer], sensor, delay)
    publication.repeat()
    assert writer.kept == [(0, 0.0)] and sensor.taken == 0
    for writer.step in range(1, 7):
        publication.step(writer.step)
    publication.repeat()
    assert writer.kept[-1] == (6, 5.0) and sensor.taken == 1
    sensor.restart()
    publication.repeat()
    publication.repeat()
    assert writer.kept[-2:] == [(6, 6.0)] * 2 and sensor.taken == 0
    for writer.step in range(7, 13):
        publication.step(writer.step)
    assert writer.kept[-1] == (10 + delay, 10.0)  # what was measured before the reset is not written after it


def test_a_delay_is_a_number_of_steps():
    assert steps_of(0.002, "here") == 2
    with pytest.raises(SimulationError, match="0.0015 s") as caught:
        steps_of(0.0015, "file.yaml:3:4")
    assert caught.value.where == "file.yaml:3:4"
