"""A lower level holds when the heartbeat of the commanding process is missing."""

import pytest
from support.unit.cart import DT, advance, bend, claim, make, turn

from solfer.errors import Suspended
from solfer.lower_level.server.heartbeat_monitor import HeartbeatMonitor


class BeatingProcess:
    """A process with a heartbeat each millisecond, and a cart that it commands."""

    period = 0.001

    def __init__(self, beats=0):
        self.newest = beats
        self.cart = make()
        self.supervision = HeartbeatMonitor(self.cart, self)

    def beats(self):
        """See `HeartbeatSource.beats`."""
        return self.newest

    def run(self, steps, beats=True):
        """Run steps of the lower level, each with a beat or without."""
        for _ in range(steps):
            if beats:
                self.newest += 1
            advance(self.cart, DT)
            self.supervision.advance(DT)

    @property
    def speed(self):
        """Commanded speed of the wheel."""
        return self.cart.controllers["wheel"].velocity[0]


@pytest.fixture
def process():
    made = BeatingProcess()
    claim(made.cart, "/plugin", ("wheel", "arm"))
    turn(made.cart, "/plugin", 2.0)
    bend(made.cart, "/plugin", position=0.5)
    return made


def test_a_heartbeat_keeps_the_claim(process):
    process.run(100)
    assert process.speed == 2.0
    assert not process.supervision.lost


def test_the_robot_holds_after_the_limit(process):
    process.run(5)
    process.run(19, beats=False)
    assert process.speed == 2.0
    process.run(2, beats=False)
    assert process.speed == 0.0
    assert process.cart.controllers["arm"].position[0] == 0.5
    assert process.supervision.lost
    assert process.cart.claims.owners() == ()


def test_later_commands_need_a_new_claim(process):
    process.run(30, beats=False)
    with pytest.raises(Suspended, match="no heartbeat of the commanding process for 2. ms"):
        turn(process.cart, "/plugin", 2.0)
    process.run(5)
    assert not process.supervision.lost
    with pytest.raises(Suspended):
        turn(process.cart, "/plugin", 2.0)
    claim(process.cart, "/plugin", ("wheel",))
    turn(process.cart, "/plugin", 1.0)
    assert process.speed == 1.0


def test_cycles_are_those_of_the_process(process):
    process.period = 0.002
    process.run(5)
    process.run(39, beats=False)
    assert process.speed == 2.0
    process.run(2, beats=False)
    assert process.speed == 0.0


def test_every_loss_is_counted_once(process):
    for _ in range(3):
        process.run(2)
        process.run(60, beats=False)
    assert process.supervision.losses == 3


def test_before_the_first_beat_nothing_is_lost():
    process = BeatingProcess(beats=None)
    turn(process.cart, "/other", 2.0)
    process.run(100, beats=False)
    assert process.speed == 2.0
    assert not process.supervision.lost


def test_a_process_that_is_gone_is_lost(process):
    process.run(5)
    process.newest = None
    process.run(21, beats=False)
    assert process.speed == 0.0
