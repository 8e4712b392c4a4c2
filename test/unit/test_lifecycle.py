"""The life of a plugin in the RT layer, with a plugin that does as it is told."""

import pytest

from solfer.middleware.xbot.lifecycle import Managed, Stage


class Obedient:
    """A plugin without a robot; raises in the method `fails`."""

    name, rate, commanding, stages = "obedient", 100.0, (), None
    fails = ""

    def __init__(self):
        self.calls, self.running, self.released, self.blending, self.outputs = [], False, True, False, self

    def _called(self, name):
        self.calls.append(name)
        if self.fails == name:
            raise RuntimeError(f"fails in {name}")

    def blend_in(self, duration):
        self.duration = duration

    def health(self):
        return 1, "waits for the robot"

    def cycle(self):
        self._called("cycle")

    def stop(self):
        self._called("stop")

    def abort(self):
        self._called("abort")

    def restart(self):
        self._called("restart")

    def close(self):
        self._called("close")


@pytest.fixture
def managed():
    managed = Managed(Obedient(), blend=1.5)
    managed.initialize()
    return managed


def running(managed):
    """Bring it there."""
    managed.start()
    managed.plugin.running = True
    managed.cycle()
    assert managed.stage is Stage.RUNNING
    managed.plugin.calls.clear()
    return managed


def test_it_is_parked_before_it_is_started(managed):
    assert managed.stage is Stage.INITIALIZED and managed.plugin.calls == ["stop"] and managed.plugin.duration == 1.5
    assert managed.at_rest and not managed.active


def test_it_starts_until_it_runs_and_is_blended_in(managed):
    managed.start()
    managed.cycle()
    assert managed.stage is Stage.STARTING  # waits for the robot
    managed.plugin.running = managed.plugin.blending = True
    managed.cycle()
    assert managed.stage is Stage.STARTING
    managed.plugin.blending = False
    managed.cycle()
    assert managed.stage is Stage.RUNNING and managed.starts == 1


def test_it_says_why_it_starts_anew(managed):
    running(managed).plugin.running = False
    managed.cycle()
    assert (managed.stage, managed.reason) == (Stage.STARTING, "waits for the robot")


def test_it_is_stopping_until_its_joints_are_free(managed):
    running(managed).plugin.released = False
    managed.stop()
    managed.cycle()
    assert managed.stage is Stage.STOPPING and not managed.at_rest
    managed.plugin.released = True
    managed.cycle()
    assert managed.stage is Stage.STOPPED and managed.at_rest


def test_it_waits_for_those_that_give_it_their_joints(managed):
    other = running(managed)
    other.plugin.released = False
    following = Managed(Obedient())
    following.initialize()
    following.start(after=[other])
    other.stop()
    following.cycle()
    assert following.plugin.calls == ["stop"] and following.stage is Stage.STARTING
    other.plugin.released = True
    other.cycle()
    following.cycle()
    assert following.plugin.calls == ["stop", "restart", "cycle"]


@pytest.mark.parametrize(("step", "does"), [("cycle", Managed.cycle), ("stop", Managed.stop)])
def test_a_failure_is_an_abort_with_its_reason(managed, step, does):
    running(managed).plugin.fails = step
    does(managed)
    assert managed.stage is Stage.ABORTED and managed.plugin.calls == [step, "abort"] and managed.aborts == 1
    assert managed.reason == f"RuntimeError: fails in {step}"


def test_who_fails_in_restart_is_aborted_too(managed):
    managed.plugin.fails = "restart"
    managed.start()
    assert managed.stage is Stage.ABORTED


def test_an_abort_that_fails_is_a_fault_that_tells_both(managed):
    running(managed).plugin.fails = "abort"
    managed.abort("too slow")
    assert managed.stage is Stage.FAULT
    assert managed.reason == "too slow; and it cannot hold: RuntimeError: fails in abort"


def test_close_stops_first(managed):
    running(managed).close()
    assert managed.plugin.calls == ["stop", "close"]


def test_each_change_is_told(managed):
    told = []
    managed.changed = lambda changed: told.append(changed.stage)
    running(managed).stop()
    managed.cycle()
    managed.cycle()
    assert told == [Stage.STARTING, Stage.RUNNING, Stage.STOPPING, Stage.STOPPED]
