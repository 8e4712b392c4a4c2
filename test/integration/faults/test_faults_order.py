"""Messages that are older than what is known already, in shared memory under the executor; on a virtual clock."""

import numpy as np
from support.bus_clock import BusClock
from support.integration.fault_layer import PLUGIN, FaultLayer, Relay, relayed
from support.integration.xbot_world import XbotWorld

from solfer.middleware.shared_memory import Namespace, XbotMiddleware
from solfer.plugins import PluginState
from solfer.transport import JointMessage, MessageStatus


def test_nothing_begins_with_what_is_old(shared, tmp_path):
    relay = Relay(shared)
    shared.run(0.1)
    layer = FaultLayer(shared, tmp_path, [(PLUGIN, relayed(tmp_path))])
    relay.bend = lambda _: None  # it lives, and publishes nothing any more
    shared.run(0.5)
    layer.begin_with(until=PluginState.STARTING)
    assert not shared.simulation.lower_level.claims.owners() and layer.largest_step() == 0.0
    relay.bend = lambda message: message
    shared.run(0.5)
    assert layer[PLUGIN].state is PluginState.RUNNING


class Asleep(BusClock):
    """A clock of a node that reads it, and stands still before it publishes."""

    late = 0.0

    def now(self):
        return super().now() - self.late


def test_of_two_senders_the_later_message_counts(tmp_path):
    """A sender that stalls for 50 ms between its stamp and its message must not replace a newer one."""
    world = XbotWorld(tmp_path)
    clock = Asleep(world.bus)
    late = XbotMiddleware(Namespace("test", tmp_path), "late", clock=clock)
    writers = [node.writer("t", "solfer/JointCommand") for node in (world.node("prompt"), late)]
    reader = world.node("reader").reader("t", "solfer/JointCommand")

    def publish(writer, number):
        writer.write(JointMessage(("joint",), position=np.array([number])))

    for writer in writers:
        publish(writer, 0.0)
    assert reader.read() is MessageStatus.NEW
    world.run(0.1)
    clock.late = 0.05
    publish(writers[0], 1.0)
    assert reader.read() is MessageStatus.NEW and reader.message.position == 1.0
    arrival = reader.arrival
    publish(writers[1], 2.0)
    assert reader.read() is MessageStatus.OLD and reader.arrival == arrival
    assert reader.message.position == 1.0 and reader.message.sender == "prompt"
    world.run(0.1)
    clock.late = 0.0
    publish(writers[1], 3.0)
    assert reader.read() is MessageStatus.NEW and reader.message.position == 3.0
    world.close()
