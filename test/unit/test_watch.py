"""What a plugin does when somebody whom it hears falls silent, on the virtual clock and without a robot's body."""

import logging

import numpy as np
import pytest
from test_joint_pipes import RATE, heard, make_robot, told

from solfer.components import Component
from solfer.config.pipes import FeedbackRecord
from solfer.errors import MiddlewareError, NotHeard
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import Inbox, JointMessage, Surroundings, factory
from solfer.plugins import Life, Plugin
from solfer.plugins.blend import Blend
from solfer.plugins.outputs import Outputs
from solfer.plugins.watch import Watch

PERIOD = 1.0 / RATE


class Counting(Component):
    """Counts its steps."""

    inits = updates = resets = 0

    def init(self):
        self.inits += 1

    def reset(self):
        self.resets += 1

    def update(self):
        self.updates += 1


class Stage:
    """A plugin that hears the topic `told`, and somebody who speaks there."""

    def __init__(self, start=0.0, **tags):
        self.bus = Bus()
        self.bus.run_until(start)
        self.middleware = MemoryMiddleware(self.bus, "cart")
        robot = make_robot()
        surroundings = Surroundings(robot, self.middleware, {}, RATE)
        record = heard(**({"initialize": True} | tags))
        self.watch = Watch.of(factory.feedback(record, surroundings), record, RATE)
        out = factory.controller(told(sink="out", interface={"position": True, "velocity": True}), surroundings)
        self.component = Counting(robot)
        outputs = Outputs([(out, None)], Blend("cart", (), robot, RATE), robot)
        self.plugin = Plugin(self.component, robot, [self.watch], outputs, Inbox(), RATE, self.middleware)
        self.sent = MemoryMiddleware(self.bus, "ear").queue("out", "solfer/JointCommand", 10000)
        self.names = robot.dofs

    def speak(self, position=0.0, sender="speaker", names=None):
        """One message."""
        names = self.names if names is None else names
        writer = MemoryMiddleware(self.bus, sender).writer("told", "solfer/JointCommand")
        writer.write(JointMessage(names, position=np.full(len(names), position)))

    def cycles(self, count, speaks=False):
        """Cycles of the plugin, each with a message before it or not."""
        for _ in range(count):
            if speaks:
                self.speak()
            self.plugin.cycle()
            self.bus.run_until(self.bus.time + PERIOD)


def test_safe_defaults():
    def of(**record):
        return FeedbackRecord.model_validate(
            {"name": "pipe", "dofs": {"chain": "all", "type": "all", "mapping": "RBDL"},
             "interface": {"position": True}} | record)

    assert of(space="JOINT", function="state").when_silent == "hold"
    assert of(space="OPERATIONAL").when_silent == "hold"
    assert of(space="JOINT", function="reference").when_silent == "keep"
    assert of(space="OPERATIONAL", function="reference").when_silent == "keep"
    assert of(space="JOINT", function="state", on_timeout="damp").when_silent == "damp"


def test_it_counts_strikes_above_the_age(caplog):
    stage = Stage(timeout=0.102, strikes=4, on_timeout="hold")
    stage.cycles(10, speaks=True)
    assert stage.plugin.life is Life.RUNNING
    stage.cycles(20)  # 0.1 s old
    stage.cycles(3)  # up to 0.115 s: three strikes
    assert stage.plugin.life is Life.RUNNING and not stage.watch.silent
    stage.cycles(1)
    assert stage.plugin.life is Life.WAITING and stage.watch.silent
    assert "'pipe' (told): nothing new for 0.1" in caplog.text
    assert stage.plugin.health() == (1, "holds and waits for feedback 'pipe' (told)")
    stage.cycles(1, speaks=True)
    assert stage.plugin.life is Life.RUNNING and stage.component.inits == 2


def test_a_plugin_that_was_asleep_itself_strikes_once_and_goes_on():
    stage = Stage(timeout=0.1, strikes=2, on_timeout="hold")
    stage.cycles(5, speaks=True)
    stage.bus.run_until(stage.bus.time + 3.0)
    stage.cycles(1)
    stage.cycles(50, speaks=True)
    assert stage.component.inits == 1 and stage.watch.silences == 0


def test_keep_goes_on_with_what_was_said_last(caplog):
    stage = Stage(on_timeout="keep")
    stage.speak(0.25)
    stage.cycles(200)
    assert stage.component.updates == 200 and stage.sent.drain()[-1].position[-1] == 0.25
    assert stage.plugin.health() == (1, "goes on with what was said last by feedback 'pipe' (told)")
    assert caplog.text.count("what was said last stays") == 1
    stage.cycles(2, speaks=True)
    assert stage.plugin.health() == (0, "running") and stage.component.inits == 1


def test_hold_sends_zero_velocities_once_and_starts_anew():
    stage = Stage(on_timeout="hold")
    stage.cycles(3, speaks=True)
    stage.plugin.robot.command.velocity[:] = 2.0
    stage.cycles(100)
    sent = stage.sent.drain()
    assert stage.plugin.life is Life.WAITING and stage.component.updates < 60
    assert (sent[-2].velocity == 2.0).all() and not sent[-1].velocity.any()


def test_stop_ends_the_plugin():
    stage = Stage(on_timeout="stop")
    stage.cycles(3, speaks=True)
    with pytest.raises(MiddlewareError, match="nothing new for feedback 'pipe' .told., and its 'on_timeout' is 'stop'"):
        stage.cycles(100)


def test_messages_that_are_refused_do_not_keep_a_pipe_alive():
    stage = Stage(on_timeout="hold")
    stage.cycles(3, speaks=True)
    for _ in range(60):
        stage.speak(np.nan)
        stage.cycles(1)
    assert stage.plugin.life is Life.WAITING and stage.plugin.figures()["pipe refused"] == 60


def test_a_required_pipe_waits_for_every_dof_and_says_which_are_missing():
    stage = Stage()
    stage.speak(names=stage.names[:-1])
    stage.cycles(1)
    assert stage.plugin.life is Life.WAITING
    assert stage.plugin.health()[1] == "holds and waits for feedback shoulder of 'pipe' (told)"
    stage.speak(names=stage.names[-1:])
    stage.cycles(1)
    assert stage.plugin.life is Life.RUNNING


def test_it_does_not_wait_for_ever_at_the_start():
    stage = Stage()
    with pytest.raises(NotHeard, match="has waited 60 s for feedback 'pipe' .told."):
        stage.cycles(int(61 * RATE))
    assert stage.component.inits == 0 and not stage.sent.drain()


def test_a_pipe_that_nobody_waits_for_may_never_come_but_not_fall_silent():
    stage = Stage(initialize=False, on_timeout="hold")
    stage.cycles(100)
    assert stage.component.updates == 100
    stage.cycles(5, speaks=True)
    stage.cycles(100)
    assert stage.plugin.life is Life.WAITING


def test_time_that_goes_back_starts_the_plugin_anew_without_a_command(caplog):
    stage = Stage()
    stage.cycles(20, speaks=True)
    stage.plugin.robot.command.velocity[:] = 2.0
    stage.sent.drain()
    MemoryMiddleware(stage.bus, "simulator").tell_time(5.0)
    MemoryMiddleware(stage.bus, "simulator").tell_time(1.0)
    stage.cycles(10)
    assert stage.plugin.life is Life.WAITING and not stage.sent.drain()
    assert stage.component.resets == 1
    MemoryMiddleware(stage.bus, "simulator").tell_time(0.5)
    stage.cycles(10)
    assert stage.plugin.life is Life.WAITING  # nothing has been heard since
    assert stage.component.resets == 1  # a component that does not run needs to forget nothing
    stage.cycles(25, speaks=True)
    assert stage.plugin.life is Life.RUNNING and stage.component.inits == 2
    assert "after the simulated time went back" in caplog.text


def test_a_component_that_fails_to_forget_sends_nothing_either():
    def fail():
        raise ValueError("no way back")

    stage = Stage()
    stage.cycles(5, speaks=True)
    stage.sent.drain()
    stage.component.reset = fail
    MemoryMiddleware(stage.bus, "simulator").tell_time(1.0)
    MemoryMiddleware(stage.bus, "simulator").tell_time(0.0)
    with pytest.raises(ValueError, match="no way back"):
        stage.cycles(1, speaks=True)
    stage.plugin.abort()
    assert stage.plugin.life is Life.STOPPED and not stage.sent.drain()


def test_figures_tell_age_counts_and_what_is_done():
    stage = Stage(on_timeout="keep")
    stage.cycles(1)
    assert stage.plugin.figures()["pipe"] == "waits for it" and "pipe age [ms]" not in stage.plugin.figures()
    stage.cycles(10, speaks=True)
    figures = stage.plugin.figures()
    assert (figures["pipe"], figures["pipe messages"], figures["pipe refused"]) == ("heard", 10, 0)
    assert figures["pipe age [ms]"] == pytest.approx(5.0)
    stage.cycles(100)
    assert stage.plugin.figures()["pipe"] == "keep" and stage.plugin.figures()["pipe silences"] == 1


def test_two_senders_are_named_once_a_second(caplog):
    stage = Stage()
    with caplog.at_level(logging.WARNING):
        for position, sender in enumerate(("first", "second") * 20):
            stage.speak(float(position), sender)
            stage.cycles(1)
    assert caplog.text.count("first and second speak on told at the same time") == 1
    assert stage.plugin.robot.command.position[-1] == 39.0  # the newest counts
    caplog.clear()
    stage.bus.run_until(stage.bus.time + 2.0)
    stage.speak(1.0, "second")
    stage.cycles(1)
    assert "speak on" not in caplog.text
