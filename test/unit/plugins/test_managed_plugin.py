"""The life of a plugin, with a plugin that a test controls."""

import pytest

from solfer.plugins import PluginState
from solfer.plugins.life.managed_plugin import ManagedPlugin


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

    @property
    def life(self):
        return PluginState.RUNNING if self.running else PluginState.STARTING

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
    managed = ManagedPlugin(Obedient(), blend=1.5)
    managed.initialize()
    return managed


def running(managed):
    """Bring a plugin to RUNNING."""
    managed.start()
    managed.plugin.running = True
    managed.cycle()
    assert managed.state is PluginState.RUNNING
    managed.plugin.calls.clear()
    return managed


def test_a_plugin_is_initialized_before_its_start(managed):
    assert (
        managed.state is PluginState.INITIALIZED and managed.plugin.calls == ["stop"] and managed.plugin.duration == 1.5
    )
    assert managed.at_rest and not managed.active


def test_a_plugin_starts_until_it_is_blended_in(managed):
    managed.start()
    managed.cycle()
    assert managed.state is PluginState.STARTING  # waits for the robot
    managed.plugin.running = managed.plugin.blending = True
    managed.cycle()
    assert managed.state is PluginState.STARTING
    managed.plugin.blending = False
    managed.cycle()
    assert managed.state is PluginState.RUNNING and managed.starts == 1


def test_a_plugin_has_a_reason_to_start_anew(managed):
    running(managed).plugin.running = False
    managed.cycle()
    assert (managed.state, managed.reason) == (PluginState.STARTING, "waits for the robot")


def test_a_stopping_plugin_waits_for_the_release(managed):
    running(managed).plugin.released = False
    managed.stop()
    managed.cycle()
    assert managed.state is PluginState.STOPPING and not managed.at_rest
    managed.plugin.released = True
    managed.cycle()
    assert managed.state is PluginState.STOPPED and managed.at_rest


def test_a_start_waits_for_plugins_that_release_joints(managed):
    other = running(managed)
    other.plugin.released = False
    following = ManagedPlugin(Obedient())
    following.initialize()
    following.start(after=[other])
    other.stop()
    following.cycle()
    assert following.plugin.calls == ["stop"] and following.state is PluginState.STARTING
    other.plugin.released = True
    other.cycle()
    following.cycle()
    assert following.plugin.calls == ["stop", "restart", "cycle"]


def test_it_waits_for_the_last_of_two_that_give_it_their_joints(managed):
    slow = ManagedPlugin(Obedient())
    slow.initialize()
    running(slow).plugin.released = False
    following = ManagedPlugin(Obedient())
    following.initialize()
    following.start(after=[managed, slow])
    slow.stop()
    following.cycle()
    assert managed.at_rest and not slow.at_rest
    assert following.plugin.calls == ["stop"]


@pytest.mark.parametrize(("step", "does"), [("cycle", ManagedPlugin.cycle), ("stop", ManagedPlugin.stop)])
def test_a_failure_is_an_abort_with_its_reason(managed, step, does):
    running(managed).plugin.fails = step
    does(managed)
    assert managed.state is PluginState.ABORTED and managed.plugin.calls == [step, "abort"] and managed.aborts == 1
    assert managed.reason.startswith(f"RuntimeError: fails in {step} (at {__file__}:")


def test_a_failure_in_restart_is_an_abort(managed):
    managed.plugin.fails = "restart"
    managed.start()
    assert managed.state is PluginState.ABORTED


def test_a_failed_abort_names_both_reasons(managed):
    running(managed).plugin.fails = "abort"
    managed.abort("too slow")
    assert managed.state is PluginState.FAULT
    assert managed.reason == "too slow; and it cannot hold: RuntimeError: fails in abort"


def test_close_stops_first(managed):
    running(managed).close()
    assert managed.plugin.calls == ["stop", "close"]


def test_each_change_is_reported(managed):
    published = []
    managed.changed = lambda changed: published.append(changed.state)
    running(managed).stop()
    managed.cycle()
    managed.cycle()
    assert published == [PluginState.STARTING, PluginState.RUNNING, PluginState.STOPPING, PluginState.STOPPED]
