"""What several tests of watch share."""

import numpy as np
from support.unit.joint_pipes import RATE, make_robot, published, received

from solfer.components import Component
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.pipes import PipeContext, factory
from solfer.plugins import Plugin, PluginParts
from solfer.plugins.feedback_timeout import FeedbackTimeout, FeedbackTimeouts
from solfer.plugins.outputs.outputs import Outputs
from solfer.plugins.outputs.start_blend import StartBlend
from solfer.transport import Inbox, JointMessage

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
    """A plugin that receives the topic `joints`, and perhaps the topic `desired`, and a node that publishes there."""

    def __init__(self, start=0.0, stall=None, desired=None, **tags):
        self.bus = Bus()
        self.bus.run_until(start)
        self.middleware = MemoryMiddleware(self.bus, "cart")
        robot = make_robot()
        context = PipeContext(robot, self.middleware, {}, RATE)
        record = received(**({"initialize": True} | tags))
        self.watch = FeedbackTimeout.from_record(factory.feedback(record, context), record, RATE)
        self.desired = None
        if desired is not None:
            record = received(**({"initialize": True, "name": "desired", "source": "desired"} | desired))
            self.desired = FeedbackTimeout.from_record(factory.feedback(record, context), record, RATE)
        out = factory.controller(published(sink="out", interface={"position": True, "velocity": True}), context)
        self.component = Counting(robot)
        outputs = Outputs([(out, None)], StartBlend("cart", (), robot, RATE), robot, 1.0 / RATE)
        watches = [watch for watch in (self.watch, self.desired) if watch]
        self.plugin = Plugin(
            PluginParts(self.component, robot, watches, outputs, Inbox(), RATE, self.middleware, stall=stall)
        )
        self.sent = MemoryMiddleware(self.bus, "ear").queue("out", "solfer/JointCommand", 10000)
        self.names = robot.dofs

    def speak(self, position=0.0, sender="speaker", names=None, topic="joints"):
        """One message."""
        names = self.names if names is None else names
        writer = MemoryMiddleware(self.bus, sender).writer(topic, "solfer/JointCommand")
        writer.write(JointMessage(names, position=np.full(len(names), position)))

    def served(self, later=0.0):
        """Read the topic `joints` as a cycle does so much `later`; return whether a running plugin can work with it."""
        reads(self.watch, self.bus.time + later)
        return self.watch.serves(True)

    def cycles(self, count, speaks=False):
        """Cycles of the plugin, each with a message before it or not."""
        for _ in range(count):
            if speaks:
                self.speak()
                self.speak(topic="desired")
            self.plugin.cycle()
            self.bus.run_until(self.bus.time + PERIOD)


def reads(watch, now, distance=0.0):
    """Read a feedback with its timeout at a time [s]; return whether nothing is missing or late."""
    timeouts = FeedbackTimeouts([watch])
    timeouts.read(now, distance)
    return timeouts.complete
