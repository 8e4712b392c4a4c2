"""What the server of a lower level publishes of refused commands and of new beginnings."""

import numpy as np
from support.unit.cart import claim, make

from solfer.lower_level import LowerLevelServer
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport.inbox import Inbox
from solfer.transport.lower_level import ALL_OWNERS, REFUSALS_TOPIC
from solfer.transport.messages import REFUSALS, JointMessage


class ServedCart:
    """A cart whose lower level is on a bus, a node that receives its refusals, and one that commands its wheel."""

    def __init__(self):
        self.bus, self.lower_level = Bus(), make()
        self.server = LowerLevelServer(self.lower_level, MemoryMiddleware(self.bus, "robot"), Inbox())
        self._receiver = MemoryMiddleware(self.bus, "receiver").queue(REFUSALS_TOPIC, REFUSALS)
        self._driver = MemoryMiddleware(self.bus, "/driver").writer("wheel/command", "solfer/JointCommand")

    def drive(self, name="roll"):
        """Command the wheel, or a joint that does not exist."""
        self._driver.write(JointMessage((name,), velocity=np.array([1.0])))

    def receive(self, later=0.1):
        """Run a cycle, `later` [s] than the one before; return owners and claims of what was published."""
        self.bus.run_until(self.bus.time + later)
        self.server.receive_commands()
        return [(message.owners, message.claims) for message in self._receiver.drain()]


def test_a_new_beginning_ends_all_claims_once():
    stage = ServedCart()
    claim(stage.lower_level, "/driver", ("wheel",))
    assert stage.receive() == []
    stage.lower_level.start(np.zeros(8))
    assert stage.receive() == [((ALL_OWNERS,), (True,))]
    assert stage.receive() == []
    stage.drive()
    assert stage.receive() == [(("/driver",), (True,))]


def test_refusals_wait_for_their_turn():
    stage, counts = ServedCart(), []
    for wait in (0.1, 0.119, 0.121, 0.13, 0.142):  # [s] since the beginning
        stage.drive("rol")
        stage.bus.run_until(wait)
        counts.append(len(stage.receive(0.0)))
    assert counts == [1, 0, 1, 0, 1]


def test_a_wrong_command_leaves_its_claim():
    stage = ServedCart()
    claim(stage.lower_level, "/driver", ("wheel",))
    stage.drive("rol")
    assert stage.receive() == [(("/driver",), (False,))]
    stage.drive()
    assert stage.receive() == []
