"""Messages that are older than what is known already, in shared memory under the executor; on a virtual clock."""

import numpy as np
from fault_layer import PLUGIN, FaultLayer, Relay, relayed
from xbot_world import XbotWorld

from solfer.middleware.xbot import Namespace, XbotMiddleware
from solfer.middleware.xbot.bus_clock import BusClock
from solfer.middleware.xbot.lifecycle import Stage
from solfer.pipes import JointMessage, Status


def test_nothing_begins_with_what_is_old(shared, tmp_path):
    relay = Relay(shared)
    shared.run(0.1)
    layer = FaultLayer(shared, tmp_path, [(PLUGIN, relayed(tmp_path))])
    relay.bend = lambda _: None  # it lives, and says nothing any more
    shared.run(0.5)
    layer.begin_with(until=Stage.STARTING)
    assert not shared.simulation.lower_level.claims.owners() and layer.largest_step() == 0.0
    relay.bend = lambda message: message
    shared.run(0.5)
    assert layer[PLUGIN].stage is Stage.RUNNING


class Asleep(BusClock):
    """A clock of somebody who looks at it, and goes to sleep before he speaks."""

    late = 0.0

    def now(self):
        return super().now() - self.late


def test_of_two_senders_what_was_sent_earlier_does_not_replace_what_was_sent_later(tmp_path):
    world = XbotWorld(tmp_path)
    clock = Asleep(world.bus)
    late = XbotMiddleware(Namespace("test", tmp_path), "late", clock=clock)
    writers = [node.writer("told", "solfer/JointCommand") for node in (world.node("prompt"), late)]
    reader = world.node("ear").reader("told", "solfer/JointCommand")

    def tell(writer, number):
        writer.write(JointMessage(("joint",), position=np.array([number])))

    for writer in writers:
        tell(writer, 0.0)
    assert reader.read() is Status.NEW
    world.run(0.1)
    clock.late = 0.05
    tell(writers[0], 1.0)
    assert reader.read() is Status.NEW and reader.message.position == 1.0
    arrival = reader.arrival
    tell(writers[1], 2.0)
    assert reader.read() is Status.OLD and reader.arrival == arrival
    assert reader.message.position == 1.0 and reader.message.sender == "prompt"
    world.run(0.1)
    clock.late = 0.0
    tell(writers[1], 3.0)
    assert reader.read() is Status.NEW and reader.message.position == 3.0
    world.close()
