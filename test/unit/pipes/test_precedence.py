"""Several publishers on the topic of a measured State, on the virtual clock: the first counts until its timeout."""

import logging

import numpy as np
import pytest
from support.unit.watch import PERIOD, Stage

from solfer.plugins import PluginState

DISPUTE = "'pipe' (joints), where first and second publish the same DoFs: end one of them"


class Measured(Stage):
    """A plugin that measures its robot by the topic `published`."""

    def __init__(self, **tags):
        super().__init__(**({"function": "state"} | tags))

    def cycles(self, count, *recent_senders):
        """Run cycles, before each of which senders publish `(sender, position)` or `(sender, position, names)`."""
        for _ in range(count):
            for sender, position, *names in recent_senders:
                self.speak(position, sender, *names)
            self.plugin.cycle()
            self.bus.run_until(self.bus.time + PERIOD)

    def taken(self, *recent_senders):
        """Run a cycle as `cycles` does; return the measured position."""
        self.cycles(1, *recent_senders)
        return float(self.measured[0])

    @property
    def running(self):
        return self.plugin.life is PluginState.RUNNING

    @property
    def measured(self):
        return self.plugin.robot.state.position


ONE, TWO = ("first", 1.0), ("second", 2.0)


@pytest.mark.parametrize("order", [(ONE, TWO), (TWO, ONE)])
def test_nothing_starts_while_two_publish_the_same(order, caplog):
    stage = Measured()
    with caplog.at_level(logging.WARNING):
        stage.cycles(100, *order)
    assert not stage.running and stage.component.inits == 0 and not stage.sent.drain()
    assert caplog.text.count(f"holds and waits for feedback {DISPUTE}") == 1
    assert stage.plugin.health() == (1, f"holds and waits for feedback {DISPUTE}")
    assert stage.plugin.inbox.refusal.endswith(f"waits for feedback {DISPUTE}")
    stage.cycles(220, ONE)  # 1.1 s
    assert stage.running and (stage.measured == 1.0).all()


@pytest.mark.slow
def test_a_dispute_may_last(caplog):
    stage = Measured()
    for _ in range(700):  # 70 s
        stage.bus.run_until(stage.bus.time + 0.095)
        stage.cycles(1, ONE, TWO)
    stage.cycles(220, ONE)
    assert stage.running


def test_the_first_counts_while_the_plugin_runs(caplog):
    stage = Measured()
    stage.cycles(5, ONE)
    assert stage.running
    with caplog.at_level(logging.WARNING):
        for _ in range(100):  # also where the second one publishes alone in a cycle
            stage.cycles(1, TWO)
            stage.cycles(1, TWO, ONE)
            assert (stage.measured == 1.0).all()
    assert stage.running and stage.component.inits == 1
    assert caplog.text.count("messages of second were ignored") == 1
    assert stage.plugin.figures()["pipe ignored"] == 200
    assert stage.plugin.health() == (1, f"feedback {DISPUTE}")
    stage.cycles(220, ONE)
    assert stage.plugin.health() == (0, "running")


def test_a_handover_restarts_the_plugin(caplog):
    stage = Measured(timeout=0.1, strikes=4)
    stage.cycles(5, ONE)
    stage.cycles(19, TWO)  # 0.095 s
    assert stage.running and (stage.measured == 1.0).all()
    stage.cycles(8, TWO)
    assert not stage.running and (stage.measured == 2.0).all()
    assert "second counts from now on" in caplog.text
    stage.cycles(170, TWO)  # the first one published less than 1 s ago
    assert not stage.running
    stage.cycles(20, TWO)
    assert stage.running and stage.component.inits == 2
    stage.cycles(10, ONE, TWO)
    assert stage.running and (stage.measured == 2.0).all()


def test_a_handover_takes_all_strikes():
    stage = Measured(timeout=0.1, strikes=4)
    stage.cycles(5, ONE)
    stage.cycles(30)  # 0.15 s
    assert [stage.taken(TWO) for _ in range(5)] == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert stage.plugin.feedbacks[0].handovers == 1


def test_a_stalled_plugin_does_not_start_by_two():
    """It begins anew, and by then there is another publisher."""
    stage = Measured()
    stage.cycles(50, ONE)
    stage.bus.run_until(stage.bus.time + 0.5)
    stage.cycles(3, TWO)  # the first one's messages are still on their way
    stage.cycles(100, TWO, ONE)
    assert not stage.running and stage.component.inits == 1
    assert "publish the same DoFs" in stage.plugin.health()[1]
    stage.cycles(220, ONE)
    assert stage.running and (stage.measured == 1.0).all()


def test_publishers_of_different_joints_complete_each_other():
    stage = Measured()
    base, arms = stage.names[:6], stage.names[6:]
    for _ in range(20):
        stage.cycles(1, ("first", 1.0, base), ("second", 2.0, arms))
        assert stage.component.updates == 0 or (stage.measured[6:] == 2.0).all()
    assert stage.running and (stage.measured[:6] == 1.0).all()
    assert stage.plugin.health() == (0, "running") and stage.plugin.figures()["pipe ignored"] == 0
    stage.cycles(5, ("first", 3.0, base), ("third", 4.0, arms), ("second", 2.0, arms))
    assert np.array_equal(stage.measured, [3.0] * 6 + [2.0] * 2)
    assert "where second and third publish the same DoFs" in stage.plugin.health()[1]


def test_a_restarted_publisher_is_the_same():
    stage = Measured()
    stage.cycles(50, ONE)
    stage.cycles(10)
    stage.cycles(50, ONE)
    assert stage.running and stage.component.inits == 1 and not stage.plugin.feedbacks[0].handovers


def test_the_newest_reference_counts():
    stage = Measured(function="reference")
    stage.cycles(5, ONE)
    assert stage.running
    stage.cycles(1, TWO)
    assert (stage.plugin.robot.command.position == 2.0).all()
