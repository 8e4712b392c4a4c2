"""Feedback that is wrong, missing or late, in shared memory under the executor; on a virtual clock."""

import logging

import numpy as np
import pytest
from support.integration.fault_layer import (
    LARGEST_STEP,
    PLUGIN,
    RATE,
    RELAY,
    SAG,
    SPEED,
    WHEEL_SPEED,
    FaultLayer,
    Relay,
    relayed,
)
from support.plugins.plugin import WHEELS

from solfer.components.move_joints import MoveJoints
from solfer.plugins import PluginState

TIMEOUT, STRIKES = 0.02, 5
"""Tags of the feedback: a cycle is a strike when the newest message is older [s]."""

SAFE = TIMEOUT * RATE + STRIKES + 2
"""Cycles from the last good message until the robot holds, with the one that was under way."""

STANDS_STILL = 0.003  # [rad]


@pytest.fixture
def received(shared, tmp_path):
    return receive(shared, tmp_path)


def receive(world, folder, on_timeout="hold"):
    """Run a plugin, and the relay by which it receives the robot."""
    relay, file = Relay(world), relayed(folder, timeout=TIMEOUT, strikes=STRIKES, on_timeout=on_timeout)
    layer = FaultLayer(world, folder, [(PLUGIN, file)])
    layer.begin_with()
    return layer, relay


def not_finite(value):
    """Make a change of a number to NaN."""

    def bend(message):
        message.position[3] = value
        return message

    return bend


def renamed(*names):
    """Make a change of names at the beginning of a message."""

    def bend(message):
        message.names = (*names, *message.names[len(names) :])
        return message

    return bend


def shortened(message):
    """Leaves numbers out."""
    message.velocity, message.block = message.velocity[:-2], None
    return message


WRONG = {
    "nan": (not_finite(np.nan), "a 'position' of joint '{names[3]}' that is not a finite number"),
    "infinity": (not_finite(-np.inf), "a 'position' of joint '{names[3]}' that is not a finite number"),
    "size": (shortened, "{less} numbers in 'velocity' (expected: {size} numbers, one for each name)"),
    "unknown": (renamed("torso_jaw"), "unknown joint 'torso_jaw' (did you mean torso_yaw?)"),
    "twice": (renamed("torso_yaw", "torso_yaw"), "it has joints twice: torso_yaw"),
}
"""What is wrong with a message, and the warning."""


@pytest.fixture(params=WRONG)
def wrong(request):
    return WRONG[request.param]


def refusals(caplog, text, layer):
    """List the warnings that a message of the relay was refused for this reason."""
    names = layer[PLUGIN].plugin.feedbacks[0].reader.message.names
    published = f"refuses a message of {RELAY}: " + text.format(names=names, size=len(names), less=len(names) - 2)
    return [
        record for record in caplog.records if published in record.getMessage() and record.levelno == logging.WARNING
    ]


@pytest.mark.daily(1)
def test_a_wrong_message_is_refused_whole(received, wrong, caplog):
    """One wrong message costs no more than one report; a stream of them brings rest within the bound, and no jump."""
    layer, relay = received
    bend, text = wrong
    begin, wrong_one = layer.move(), relay.published + 20
    relay.bend = lambda message: bend(message) if relay.published == wrong_one else message
    layer.world.run(0.1)
    assert layer[PLUGIN].plugin.feedbacks[0].refused == len(refusals(caplog, text, layer)) == 1
    assert (layer[PLUGIN].state, layer[PLUGIN].starts, layer[PLUGIN].aborts) == (PluginState.RUNNING, 1, 0)
    moment, relay.bend = layer.now, bend
    layer.world.run(0.2)
    assert layer[PLUGIN].state is PluginState.STARTING and "link_side_online" in layer[PLUGIN].reason
    assert layer.cycles_until_rest(moment) <= SAFE
    assert layer.largest_step(begin) <= LARGEST_STEP
    relay.bend = lambda message: message
    layer.world.run(0.5)
    assert layer[PLUGIN].state is PluginState.RUNNING and not layer.turning()
    assert layer.largest_step(begin) <= SAG


@pytest.mark.daily(1)
@pytest.mark.parametrize(
    ("on_timeout", "stage"),
    [("hold", PluginState.STARTING), ("damp", PluginState.STARTING), ("stop", PluginState.ABORTED)],
)
def test_a_timeout_is_answered_as_configured(shared, tmp_path, on_timeout, stage):
    layer, relay = receive(shared, tmp_path, on_timeout=on_timeout)
    begin = layer.move()
    relay.bend = lambda _: None
    layer.world.run(0.5)
    assert layer[PLUGIN].state is stage and "link_side_online" in layer[PLUGIN].reason
    assert layer.cycles_until_rest(begin) <= SAFE
    assert layer.largest_step(begin) <= LARGEST_STEP
    assert bool(shared.simulation.lower_level.emergency) is (on_timeout == "damp")
    for _ in range(2):
        before = shared.simulation.q.copy()
        shared.run(0.2)
    if on_timeout != "damp":
        assert np.abs(shared.simulation.q - before)[layer.held].max() < STANDS_STILL


def test_a_value_that_is_kept_is_counted(shared, tmp_path):
    layer, relay = receive(shared, tmp_path, on_timeout="keep")
    begin = layer.move()
    relay.bend = lambda _: None
    shared.run(0.5)
    plugin = layer[PLUGIN].plugin
    figures, (level, summary) = plugin.figures(), plugin.health()
    assert layer[PLUGIN].state is PluginState.RUNNING and layer.largest_step(begin) <= LARGEST_STEP
    assert figures["link_side_online timeouts"] == 1 and figures["link_side_online"] == "keep"
    assert figures["link_side_online age [ms]"] == pytest.approx(500.0, abs=10.0)
    assert level == 1 and "the last message of feedback 'link_side_online'" in summary


def test_nothing_is_sent_before_required_feedback(shared, tmp_path):
    relay = Relay(shared)
    shared.run(0.1)  # the order of the joints is learnt from the first message
    layer = FaultLayer(shared, tmp_path, [(PLUGIN, relayed(tmp_path))])
    relay.close()
    layer.begin_with(until=PluginState.STARTING)
    assert "link_side_online" in layer[PLUGIN].plugin.health()[1]
    assert not shared.simulation.lower_level.claims.owners() and layer.largest_step() == 0.0
    Relay(shared)
    shared.run(0.5)
    assert layer[PLUGIN].state is PluginState.RUNNING and layer.largest_step() <= SAG


@pytest.fixture
def merged(shared, tmp_path):
    """Fig. 4: two plugins on the parts of the robot, and the one that merges them, which is there first."""
    layer = FaultLayer(shared, tmp_path, [("upper_body",), ("lower_body",), ("whole_body",)])
    layer.begin_with("whole_body", PluginState.STARTING)
    return layer


def test_a_merging_plugin_waits_for_its_components(merged):
    """`whole_body` moves nothing until both parts publish; afterwards one part may fall silent, the other may not.

    Each part's own rule for old references decides, and the wheels stop in three cycles.
    """
    layer, whole = merged, merged["whole_body"]
    assert all(name in whole.plugin.health()[1] for name in ("'upper_body'", "'lower_body'"))
    layer.begin_with("upper_body")
    layer.world.run(0.5)
    assert whole.state is PluginState.STARTING and layer.largest_step() == 0.0
    layer.begin_with("lower_body")
    layer.world.run(0.5)
    assert whole.state is PluginState.RUNNING
    begin = layer.now
    layer["upper_body"].plugin.component.trajectory(MoveJoints(joints=("torso_yaw",), positions=(0.4,), speed=SPEED))
    layer["lower_body"].plugin.component.trajectory(MoveJoints(joints=WHEELS, velocities=(WHEEL_SPEED,) * 4))
    layer.world.run(1.0)
    layer["upper_body"].stop()  # the last word stays, with its age
    layer.world.run(0.5)
    figures = whole.plugin.figures()
    assert whole.state is PluginState.RUNNING and layer.turning()
    assert figures["upper_body"] == "keep" and figures["upper_body timeouts"] == 1
    assert figures["upper_body age [ms]"] > 400.0
    moment = layer.now
    layer["lower_body"].stop()  # publishes zero, and then nothing any more
    layer.world.run(0.5)
    assert whole.state is PluginState.STARTING and "lower_body" in whole.reason and not layer.turning()
    assert layer.cycles_until_rest(moment) <= 3
    assert layer.largest_step(begin) <= 1.001 * SPEED / layer.executor.rate
