"""Messages from outside that are wrong, doubled or late, on their way over the bridge to a plugin of the layer.

The outside is a bus, the layer is in shared memory under the executor, and all go by one virtual clock.
"""

import logging

import numpy as np
import pytest
from support.integration.bridged import BRIDGE, BridgedWorld
from support.integration.fault_layer import PLUGIN, SPEED, WHEEL_SPEED, FaultLayer
from support.plugins.plugin import WHEELS, configuration

from solfer.config import load
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginState
from solfer.transport import JointMessage

UPPER, LOWER = "upper_body", "lower_body"
PERIOD = 0.005
"""Time from one message of the peer to the next, and from one turn of the bridge to the next [s]."""

LARGEST_STEP = 1.001 * SPEED * PERIOD
"""What the peer's command changes from one message to the next [rad]."""

SILENT = 0.2 + 2 * PERIOD
"""Time without a message that fits until it counts: the pipe's own, and the bridge's [s]."""

STRIKES, RATE = 10, 500.0
SAFE = SILENT * RATE + STRIKES + 2
"""Cycles from the last good message until the robot holds."""


class Peer:
    """Turns the torso and drives the wheels, by references for both halves of the robot.

    Attributes:
        bend: Makes messages of a message; each of them is published, in their order.
        published: Number of turns so far.
    """

    def __init__(self, world):
        node = MemoryMiddleware(world.bus, "peer")
        self._writers = [node.writer(topic, "solfer/JointCommand") for topic in (UPPER, LOWER)]
        dofs, q = world.simulation.kinematics.dofs[6:], world.simulation.q[6:].copy()
        self._wanted = JointMessage(tuple(dofs), position=q, velocity=np.zeros(len(q)))
        self._wanted.velocity[[dofs.index(wheel) for wheel in WHEELS]] = WHEEL_SPEED
        self._yaw = dofs.index("torso_yaw")
        self.bend, self.published = lambda message: [message], 0
        # between two turns of the bridge: at the same time rounding would decide which of them comes first
        world.bus.every(PERIOD, self._publish, start=world.bus.time + PERIOD / 2.0)

    def _publish(self):
        self._wanted.position[self._yaw] += SPEED * PERIOD
        message = JointMessage(self._wanted.names, self._wanted.position.copy(), self._wanted.velocity.copy())
        self.published += 1
        for each in self.bend(message):
            for writer in self._writers:
                writer.write(each)


@pytest.fixture
def crossing(tmp_path):
    """Make a layer with a plugin that follows a peer outside, and the peer."""
    file = configuration(tmp_path, robot="merged", layer="RT", **{"class": "solfer.components:Component"})
    world = BridgedWorld(tmp_path, [load(file, PLUGIN, middleware="XBOT")])
    layer, peer = FaultLayer(world, tmp_path, [(PLUGIN, file)]), Peer(world)
    layer.begin_with()
    world.run(0.3)
    assert layer.turning()
    yield layer, peer
    world.close()


def shortened(message):
    """Leaves numbers out."""
    message.velocity, message.block = message.velocity[:-2], None
    return [message]


def renamed(*names):
    """Make a change of names at the beginning of a message."""

    def bend(message):
        message.names = (*names, *message.names[len(names) :])
        return [message]

    return bend


def not_finite(message):
    """Make a change of a number to NaN."""
    message.velocity[:] = np.nan
    return [message]


WRONG = {
    "size": (shortened, "40 numbers in 'velocity' (expected: 42 numbers, one for each name)"),
    "unknown": (renamed("torso_jaw"), "unknown joint 'torso_jaw' (did you mean torso_yaw?)"),
    "twice": (renamed("torso_yaw", "torso_yaw"), "it has joints twice: torso_yaw"),
    "nan": (not_finite, "that is not a finite number"),
}
"""What is wrong with a message, and the warning."""


@pytest.fixture(params=WRONG)
def wrong(request):
    return WRONG[request.param]


def refusals(caplog, pipe, text):
    """List the warnings of a pipe that a message was refused for this reason."""
    published = f"feedback '{pipe}' refuses a message of {BRIDGE}: "
    return [
        record
        for record in caplog.records
        if record.levelno == logging.WARNING
        and record.getMessage().startswith(published)
        and text in record.getMessage()
    ]


@pytest.mark.daily(1)
def test_a_message_that_does_not_fit_is_refused(crossing, wrong, caplog):
    """One wrong message is refused and the motion goes on; if all are wrong, the robot rests until good ones return."""
    layer, peer = crossing
    bend, text = wrong
    begin, wrong_one = layer.now, peer.published + 10
    peer.bend = lambda message: bend(message) if peer.published == wrong_one else [message]
    layer.world.run(0.1)
    received = {feedback.name: feedback for feedback in layer[PLUGIN].plugin.feedbacks}
    assert [received[name].refused for name in (UPPER, LOWER)] == [1, 1]
    assert refusals(caplog, UPPER, text) and refusals(caplog, LOWER, text)
    assert (layer[PLUGIN].state, layer[PLUGIN].starts) == (PluginState.RUNNING, 1)
    moment, peer.bend = layer.now, bend
    layer.world.run(0.4)
    assert layer[PLUGIN].state is PluginState.STARTING and LOWER in layer[PLUGIN].reason
    assert layer.cycles_until_rest(moment) <= SAFE
    assert layer.largest_step(begin) <= 2 * LARGEST_STEP  # what is refused once is made up for by the next
    peer.bend = lambda message: [message]
    layer.world.run(1.0)
    assert layer[PLUGIN].state is PluginState.RUNNING and layer.turning()


def test_joints_that_a_message_lacks_keep_references(crossing):
    """The outside leaves out `torso_yaw`: its reference stays, nothing is refused, and the wheels turn on."""
    layer, peer = crossing
    begin, yaw = layer.now, layer[PLUGIN].plugin.robot.dof("torso_yaw")
    kept = []

    def without_torso(message):
        kept.append(layer[PLUGIN].plugin.robot.command.position[yaw])
        place = message.names.index("torso_yaw")
        return [
            JointMessage(
                message.names[:place] + message.names[place + 1 :],
                np.delete(message.position, place),
                np.delete(message.velocity, place),
            )
        ]

    peer.bend = without_torso
    layer.world.run(0.5)
    assert layer[PLUGIN].state is PluginState.RUNNING and layer.turning()
    assert len(set(kept[3:])) == 1
    assert all(feedback.refused == 0 for feedback in layer[PLUGIN].plugin.feedbacks)
    assert layer.largest_step(begin) <= LARGEST_STEP


@pytest.mark.daily(1)
@pytest.mark.parametrize("times", [2, 100])
def test_of_messages_that_come_together_the_newest_counts(crossing, times):
    """Repeated older messages are dropped at the bridge, one per period passes, and no command steps back."""
    layer, peer = crossing
    begin, bridge = layer.now, layer.world.bridge
    passed, dropped = bridge.crossings[UPPER].passed, bridge.crossings[UPPER].dropped

    def late(message):
        """Publish earlier messages once more, in their order, together with the newest one."""
        older = [
            JointMessage(message.names, message.position - 0.1 * back, message.velocity)
            for back in range(times - 1, 0, -1)
        ]
        return [*older, message]

    peer.bend = late
    layer.world.run(0.5)
    assert layer[PLUGIN].state is PluginState.RUNNING and layer.turning()
    assert bridge.crossings[UPPER].passed - passed == pytest.approx(0.5 / PERIOD, abs=1)
    assert bridge.crossings[UPPER].dropped - dropped == pytest.approx(0.5 / PERIOD * (times - 1), abs=times)
    assert layer.largest_step(begin) <= LARGEST_STEP


def test_a_repeated_message_counts_once(crossing):
    layer, peer = crossing
    feedback = next(each for each in layer[PLUGIN].plugin.feedbacks if each.name == UPPER)
    begin, accepted = layer.now, feedback.accepted
    peer.bend = lambda message: [message, message]
    layer.world.run(0.5)
    assert feedback.accepted - accepted == pytest.approx(0.5 / PERIOD, abs=1)
    assert layer.largest_step(begin) <= LARGEST_STEP
