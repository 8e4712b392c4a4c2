"""What sensors measure is written in time, or later where it is delayed."""

import numpy as np
import pytest

from solfer.errors import SimulationError
from solfer.simulation.delay_line import steps_of
from solfer.simulation.server.publications import Publication
from solfer.transport.messages import VectorMessage


class Written:
    """Keeps the first number of each message, and when it was written."""

    def __init__(self):
        self.step, self.kept = 0, []

    def write(self, message):
        self.kept.append((self.step, message.values[0]))


def publish(delay, steps=12):
    writer, message = Written(), VectorMessage("world", np.zeros(3))

    def measure():
        message.values[0] = writer.step
        return (message,)

    publication = Publication(5, [writer], measure, delay)
    for writer.step in range(1, steps):
        publication.step(writer.step)
    return writer.kept


def test_measurements_are_written_in_their_step():
    assert publish(0) == [(5, 5.0), (10, 10.0)]


@pytest.mark.parametrize("delay", [1, 6])
def test_delayed_messages_keep_what_was_measured(delay):
    assert publish(delay, 18) == [(step + delay, float(step)) for step in (5, 10, 15) if step + delay < 18]


def test_a_delay_is_a_number_of_steps():
    assert steps_of(0.002, "here") == 2
    with pytest.raises(SimulationError, match="0.0015 s") as caught:
        steps_of(0.0015, "file.yaml:3:4")
    assert caught.value.where == "file.yaml:3:4"
