"""A plugin whose feedbacks time out, on the virtual clock and without a robot's body."""

import logging
import math

import numpy as np
import pytest
from support.unit.joint_pipes import RATE, received
from support.unit.watch import PERIOD, Stage, reads

from solfer.config.kinds.table import record_of
from solfer.config.records.pipes import FeedbackRecord
from solfer.errors import MiddlewareError, ReceiveTimeout
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.plugins.feedback_timeout import FeedbackTimeout
from solfer.transport.endpoints import MessageStatus


def test_safe_defaults():
    """Old measurements must stop a plugin, old references need not: the default depends on the function alone."""

    def from_record(**record):
        return record_of(FeedbackRecord, record["space"]).model_validate(
            {
                "name": "pipe",
                "dofs": {"chain": "all", "type": "all", "mapping": "RBDL"},
                "interface": {"position": True},
            }
            | record
        )

    assert from_record(space="JOINT", function="state").timeout_action == "hold"
    assert from_record(space="OPERATIONAL").timeout_action == "hold"
    assert from_record(space="JOINT", function="reference").timeout_action == "keep"
    assert from_record(space="OPERATIONAL", function="reference").timeout_action == "keep"
    assert from_record(space="JOINT", function="state", on_timeout="damp").timeout_action == "damp"


def test_strikes_in_a_row_time_a_feedback_out(caplog):
    stage = Stage(timeout=0.102, strikes=4, on_timeout="hold")
    stage.cycles(10, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING
    stage.cycles(20)  # 0.1 s old
    stage.cycles(3)  # up to 0.115 s: three strikes
    assert stage.plugin.life is PluginState.RUNNING and not stage.watch.timed_out
    stage.cycles(1)
    assert stage.plugin.life is PluginState.STARTING and stage.watch.timed_out
    assert "'pipe' (joints): nothing new for 0.1" in caplog.text
    assert stage.plugin.health() == (1, "holds and waits for feedback 'pipe' (joints)")
    stage.cycles(1, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING and stage.component.inits == 2


@pytest.mark.parametrize(("asleep", "stall"), [(0.22, None), (0.35, None), (3.0, None), (0.022, 0.02)])
def test_a_plugin_whose_loop_stood_still_begins_anew(caplog, asleep, stall):
    """It holds at once, refuses the waiting request, and starts with new messages only."""
    stage = Stage(stall=stall)
    stage.cycles(30, speaks=True)
    request = stage.plugin.inbox.submit(lambda: None)
    stage.sent.drain()
    stage.bus.run_until(stage.bus.time + asleep)
    stage.cycles(1, speaks=True)
    assert [message.velocity.any() for message in stage.sent.drain()] == [False]
    assert stage.plugin.life is PluginState.STARTING and stage.component.resets == 1
    with pytest.raises(MiddlewareError, match="after its own loop stood still for"):
        request.result(0.0)
    assert f"stood still for {asleep + PERIOD:.3f} s" in caplog.text
    stage.cycles(15, speaks=True)
    assert stage.component.inits == 1 and not stage.sent.drain()
    stage.cycles(10, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING and stage.component.inits == 2


@pytest.mark.parametrize(("asleep", "stall"), [(0.18, None), (0.15, 0.3)])
def test_a_short_delay_is_not_a_stall(asleep, stall):
    stage = Stage(stall=stall)
    stage.cycles(5, speaks=True)
    stage.bus.run_until(stage.bus.time + asleep)
    stage.cycles(5, speaks=True)
    assert stage.component.inits == 1


def test_a_stall_is_capped_at_the_shortest_timeout():
    stage = Stage(stall=2.0, timeout=0.1)
    stage.cycles(5, speaks=True)
    stage.bus.run_until(stage.bus.time + 0.11)
    stage.cycles(1, speaks=True)
    assert stage.plugin.life is PluginState.STARTING


def test_a_start_may_take_its_time():
    stage = Stage()
    stage.component.init = lambda: stage.bus.run_until(stage.bus.time + 1.0)
    stage.cycles(5, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING and stage.component.resets == 0


def test_keep_goes_on_with_the_last_message(caplog):
    stage = Stage(on_timeout="keep")
    stage.speak(0.25)
    stage.cycles(200)
    assert stage.component.updates == 200 and stage.sent.drain()[-1].position[-1] == 0.25
    assert stage.plugin.health() == (1, "goes on with the last message of feedback 'pipe' (joints)")
    assert caplog.text.count("the last message stays valid") == 1
    stage.cycles(2, speaks=True)
    assert stage.plugin.health() == (0, "running") and stage.component.inits == 1


def test_no_start_with_a_kept_message():
    stage = Stage(on_timeout="hold", desired={"on_timeout": "keep"})
    stage.cycles(20, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING
    stage.cycles(100)
    assert stage.watch.timed_out and stage.desired.timed_out
    for _ in range(10):
        stage.speak()
        stage.cycles(1)
    assert stage.plugin.life is PluginState.STARTING
    assert "for feedback 'desired' (desired)" in stage.plugin.inbox.refusal
    stage.cycles(2, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING


def test_hold_sends_zero_velocities_once():
    stage = Stage(on_timeout="hold")
    stage.cycles(3, speaks=True)
    stage.plugin.robot.command.velocity[:] = 2.0
    stage.cycles(100)
    sent = stage.sent.drain()
    assert stage.plugin.life is PluginState.STARTING and stage.component.updates < 60
    assert (sent[-2].velocity == 2.0).all() and not sent[-1].velocity.any()


def test_refused_messages_do_not_prevent_a_timeout():
    stage = Stage(on_timeout="hold")
    stage.cycles(3, speaks=True)
    for _ in range(60):
        stage.speak(np.nan)
        stage.cycles(1)
    assert stage.plugin.life is PluginState.STARTING and stage.plugin.figures()["pipe refused"] == 60


def test_a_required_pipe_names_its_missing_dofs():
    stage = Stage()
    stage.speak(names=stage.names[:-1])
    stage.cycles(1)
    assert stage.plugin.life is PluginState.STARTING
    assert stage.plugin.health()[1] == "holds and waits for feedback shoulder of 'pipe' (joints)"
    stage.speak(names=stage.names[-1:])
    stage.cycles(1)
    assert stage.plugin.life is PluginState.RUNNING


def test_the_wait_at_the_start_is_limited():
    stage = Stage()
    with pytest.raises(ReceiveTimeout, match="has waited 60 s for feedback 'pipe' .joints."):
        stage.cycles(int(61 * RATE))
    assert stage.component.inits == 0 and not stage.sent.drain()


def test_an_optional_feedback_may_time_out():
    stage = Stage(initialize=False, on_timeout="hold")
    stage.cycles(100)
    assert stage.component.updates == 100
    stage.cycles(5, speaks=True)
    stage.cycles(100)
    assert stage.plugin.life is PluginState.STARTING


def test_time_that_goes_back_starts_the_plugin_anew(caplog):
    """A restarted simulator: no command goes out before new feedback, and the component is reset once."""
    stage = Stage()
    stage.cycles(20, speaks=True)
    stage.plugin.robot.command.velocity[:] = 2.0
    stage.sent.drain()
    MemoryMiddleware(stage.bus, "simulator").publish_time(5.0)
    MemoryMiddleware(stage.bus, "simulator").publish_time(1.0)
    stage.cycles(10)
    assert stage.plugin.life is PluginState.STARTING and not stage.sent.drain()
    assert stage.component.resets == 1
    MemoryMiddleware(stage.bus, "simulator").publish_time(0.5)
    stage.cycles(10)
    assert stage.plugin.life is PluginState.STARTING  # nothing has been received since
    assert stage.component.resets == 1  # a component that does not run needs to forget nothing
    stage.cycles(25, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING and stage.component.inits == 2
    assert "after the simulated time went back" in caplog.text


def test_a_component_that_fails_to_reset_sends_nothing():
    def fail():
        raise ValueError("no way back")

    stage = Stage()
    stage.cycles(5, speaks=True)
    stage.sent.drain()
    stage.component.reset = fail
    MemoryMiddleware(stage.bus, "simulator").publish_time(1.0)
    MemoryMiddleware(stage.bus, "simulator").publish_time(0.0)
    with pytest.raises(ValueError, match="no way back"):
        stage.cycles(1, speaks=True)
    stage.plugin.abort()
    assert stage.plugin.life is PluginState.STOPPED and not stage.sent.drain()


def test_figures_show_age_counts_and_action():
    stage = Stage(on_timeout="keep")
    stage.cycles(1)
    assert stage.plugin.figures()["pipe"] == "waits for it" and "pipe age [ms]" not in stage.plugin.figures()
    stage.cycles(10, speaks=True)
    figures = stage.plugin.figures()
    assert (figures["pipe"], figures["pipe messages"], figures["pipe refused"]) == ("received", 10, 0)
    assert figures["pipe age [ms]"] == pytest.approx(5.0)
    stage.cycles(100)
    assert stage.plugin.figures()["pipe"] == "keep" and stage.plugin.figures()["pipe timeouts"] == 1


def test_two_senders_are_named_once_a_second(caplog):
    stage = Stage()
    with caplog.at_level(logging.WARNING):
        for position, sender in enumerate(("first", "second") * 20):
            stage.speak(float(position), sender)
            stage.cycles(1)
    assert caplog.text.count("first and second publish on joints at the same time") == 1
    assert stage.plugin.robot.command.position[-1] == 39.0  # the newest counts
    caplog.clear()
    stage.bus.run_until(stage.bus.time + 2.0)
    stage.speak(1.0, "second")
    stage.cycles(1)
    assert "publish on" not in caplog.text


@pytest.mark.parametrize(("first", "second"), [("hold", "stop"), ("stop", "hold")])
def test_the_gravest_of_two_timeouts_counts(first, second):
    stage = Stage(on_timeout=first, desired={"on_timeout": second})
    stage.cycles(3, speaks=True)
    names = "'pipe' .joints., 'desired' .desired."
    with pytest.raises(MiddlewareError, match=f"nothing new for feedback {names}, and its 'on_timeout' is 'stop'"):
        stage.cycles(100)
    assert stage.watch.timed_out and stage.desired.timed_out


@pytest.mark.parametrize(("rate", "tags", "timeout"), [
    (1000.0, {}, 0.2), (25.0, {}, 0.2), (10.0, {}, 0.5), (10.0, {"timeout": 0.3}, 0.3),
])  # fmt: skip
def test_a_timeout_is_no_shorter_than_five_periods(rate, tags, timeout):
    stage, record = Stage(), received(**tags)
    assert FeedbackTimeout.from_record(stage.watch.feedback, record, rate).timeout == pytest.approx(timeout)


def test_after_a_restart_an_old_message_starts_nothing():
    stage = Stage(on_timeout="hold")
    stage.speak()
    assert stage.served()
    stage.watch.restart()
    stage.speak()
    stage.bus.run_until(stage.bus.time + 1.0)
    assert not stage.served() and stage.watch.feedback.received
    stage.speak()
    assert stage.served()


def test_after_a_restart_nothing_times_out_before_it_came():
    """The age of what came before does not count."""
    stage = Stage(on_timeout="hold", strikes=3)
    stage.speak()
    stage.served()
    stage.bus.run_until(stage.bus.time + 1.0)
    for _ in range(3):
        stage.served()
    assert stage.watch.timed_out and stage.watch.missed(True)
    stage.watch.restart()
    assert not stage.watch.timed_out and not stage.watch.missed(True)
    for _ in range(10):
        assert not stage.served()
    assert not stage.watch.timed_out and stage.watch.timeouts == 1
    assert "pipe age [ms]" not in stage.watch.figures(stage.bus.time)


def test_a_restart_forgets_strikes():
    stage = Stage(strikes=3)
    stage.speak()
    stage.served()
    for _ in range(2):
        stage.served(1.0)
    stage.watch.restart()
    stage.speak()
    stage.served(1.0)
    assert not stage.watch.timed_out


class Frozen:
    """A feedback whose messages go on, while their numbers stay."""

    name, silent, measures, required, received, handovers = "joints", "", True, True, True, 0
    reader = type("Reader", (), {"topic": "joint_states"})

    def __init__(self):
        self.arrival = self.changed = self.stamp = 0.0

    def run(self):
        return MessageStatus.NEW

    def set_timeout(self, timeout, strikes):
        pass


@pytest.mark.parametrize(
    ("way", "pauses", "times_out"),
    [(0.0, False, False), (0.004, False, False), (0.02, True, False), (0.02, False, True)],
)
def test_numbers_that_stay_while_joints_are_to_move_are_silence(caplog, way, pauses, times_out):
    """A robot at rest may well send the same numbers for ever, and a simulation that pauses the same message."""
    feedback = Frozen()
    watch = FeedbackTimeout(feedback, 0.2, 3, "hold")
    for cycle in range(100):
        feedback.arrival = feedback.changed = feedback.stamp = cycle * PERIOD
        assert reads(watch, feedback.arrival, 0.01 * cycle)
    stays = feedback.changed
    read = []
    for cycle in range(1, 60):
        feedback.arrival = stays + cycle * PERIOD
        feedback.stamp = stays if pauses else feedback.arrival
        read.append(reads(watch, feedback.arrival, 0.99 + way * min(cycle / 10.0, 1.0)))
    assert read.count(False) in ((27, 28) if times_out else (0,))
    assert watch.timed_out is times_out and watch.serves(True) is not times_out
    assert ("no number has changed, though joints were commanded to move, for 0.1" in caplog.text) is times_out
    feedback.arrival = feedback.changed = feedback.stamp = feedback.arrival + PERIOD
    assert reads(watch, feedback.arrival, 2.0) and not watch.timed_out


def test_a_feedback_whose_changes_are_not_known_does_not_freeze():
    """One with a filter: its numbers go on for a while."""
    feedback = Frozen()
    feedback.changed = math.inf
    watch = FeedbackTimeout(feedback, 0.2, 3, "hold")
    for cycle in range(100):
        feedback.arrival = feedback.stamp = 1000.0 + cycle * PERIOD
        assert reads(watch, feedback.arrival, 0.1 * cycle)


def test_refusals_are_in_the_health_and_in_what_a_plugin_waits_for():
    """For half a second while others of its messages fit, then with the hold, also in the recording."""
    stage = Stage(timeout=0.1, strikes=4, on_timeout="hold")
    stage.plugin.requests.enabled = True
    stage.cycles(10, speaks=True)
    stage.speak(math.nan)
    stage.cycles(1)
    stage.cycles(1, speaks=True)
    refuses = f"refuses messages of speaker: a 'position' of joint '{stage.names[0]}' that is not a finite number"
    assert stage.plugin.health() == (1, f"feedback 'pipe' (joints) {refuses}")
    stage.cycles(round(0.6 / PERIOD), speaks=True)
    assert stage.plugin.health() == (0, "running")
    for _ in range(30):
        stage.speak(math.nan)
        stage.cycles(1)
    lacks = f"waits for feedback 'pipe' (joints), which {refuses}"
    assert stage.plugin.health() == (1, f"holds and {lacks}")
    assert ("reset", lacks) in stage.plugin.requests.notes
    stage.cycles(2, speaks=True)
    assert stage.plugin.life is PluginState.RUNNING
