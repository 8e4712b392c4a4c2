"""A component that follows a sine with feedback, and recordings of it in memory and in shared memory."""

import math
from contextlib import closing

import numpy as np
from support.plugins import fleet

from solfer.components import Component, Service
from solfer.middleware.memory import MemoryMiddleware
from solfer.plugins import PluginSet
from solfer.recording.writer import RecordingWriter
from solfer.telemetry.black_box import BlackBox
from solfer.telemetry.drain import RecordDrain
from solfer.transport.lower_level import Answer
from solfer.transport.messages import WrenchMessage
from solfer.transport.middleware import SWITCH_ONE, Flag

GAIN, AMPLITUDE, FREQUENCY = 0.3, 0.4, 0.5

CALLS = {150: ("shift", {"data": True})}

WRENCH = "geometry_msgs/WrenchStamped"
CONTACTS = """cart:
  contacts:
    tip: {name: tip, end_frame: arm, type: contact_point, position: [0, 0, -0.5], topic: tip, interface: world,
      message: geometry_msgs/WrenchStamped, constraint_matrix: {force_3: [0, 0, 0, 0, 0, 1]}, initialize: false}
"""


class Sine(Component):
    """Moves its joints along a sine, and adds a part of what they still miss."""

    gain = GAIN

    def init(self):
        self._time, self._begin = 0.0, self.model.state.position.copy()
        self._want = self._begin.copy()

    def services(self):
        return (Service("shift", SWITCH_ONE, Flag, Answer, self._shift),)

    def _shift(self, request):
        self._begin += 0.3 if request.data else -0.3
        return Answer(True)

    def update(self):
        self._time += self.period
        np.add(self._begin, AMPLITUDE * math.sin(2.0 * math.pi * FREQUENCY * self._time), out=self._want)
        self._want += self.gain * (self._want - self.model.state.position)
        self.model.command.position[:] = self._want


class Pressing(Sine):
    """The same, and gives way to the force on the contact."""

    def update(self):
        super().update()
        self.model.command.position[:] += 1e-3 * self.model.contacts["tip"].wrench[2:5].sum()


class Paced(Sine):
    """The same in the robot's time."""

    def update(self):
        self._time += self.time_step - self.period
        super().update()


class Averaging(Sine):
    """The same, and adds a part of the mean of all that was measured since the cycle before."""

    def update(self):
        super().update()
        (history,) = self.model.state.histories
        if history.count:
            position = history.values[: history.count, history.interfaces.index("position")]
            self.model.command.position[history.dofs] += 0.1 * position.mean(axis=0)


class Strong(Sine):
    """The same with another gain for one joint."""

    def update(self):
        super().update()
        roll = self.model.dof("roll")
        desired, position = self.model.command.position, self.model.state.position
        desired[roll] += 0.1 * (desired[roll] - position[roll])


def tree(component="Sine"):
    """Return the configuration of `first`, which has the component, of this module or another, and sends to `left`."""
    changed = fleet.tree()
    target = component if ":" in component else f"{__name__}:{component}"
    changed["modules"] = {"first": changed["modules"]["first"] | {"class": target, "controller": ["left"]}}
    return changed


class Follower:
    """Joints that follow what they are sent, late and noisily, in memory.

    Args:
        folder: Where the configuration is.
        component: Of this module.
    """

    def __init__(self, folder, component="Sine"):
        self.fleet = fleet.Fleet(folder, self.tree(folder, component), ("first",), together=False)
        self.plugin = self.fleet.plugins[0]
        self._drawn, self.position = np.random.default_rng(3), np.array([0.1, 0.2])

    @staticmethod
    def tree(folder, component):
        """Return the configuration; files of it may be made in the folder."""
        return tree(component)

    def move(self):
        """Publish where the joints are now."""
        dofs = [self.plugin.robot.dof(name) for name in ("shoulder", "roll")]
        if self.plugin.running:
            self.position += 0.2 * (self.plugin.robot.command.position[dofs] - self.position)
        noisy = self.position + self._drawn.normal(0.0, 1e-3, 2)
        self.fleet.publish(position=noisy, velocity=np.zeros(2))


class Slow(Follower):
    """The same for a robot whose time goes at 0.6 of the clock, as in a slow simulation."""

    def __init__(self, folder, component="Sine"):
        super().__init__(folder, component)
        self.plugin.robot_time.advance = self._slowly

    def _slowly(self, now, stamp, accepted):
        passed = 0.6 / self.plugin.rate
        self.plugin.overload.advance(passed)
        return passed


class EveryMessage(Follower):
    """The same with every message of the joints."""

    @staticmethod
    def tree(folder, component):
        """See `Follower.tree`."""
        changed = tree(component)
        changed["feedback"]["joints"]["history"] = 4
        return changed


class Pressed(Follower):
    """The same with a contact, on which the ground pushes more and more."""

    @staticmethod
    def tree(folder, component):
        """See `Follower.tree`."""
        changed, file = tree(component), folder / "contacts.yaml"
        file.write_text(CONTACTS)
        changed["ros"]["source"]["contacts"] = {"file": str(file)}
        changed["ros"]["controller"]["ground"] = {"sink": "ground", "message": "solfer/RobotPoints"}
        changed["controller"]["ground"] = {"space": "CONTACTS", "type": "reference"}
        changed["robot"]["jointed"]["contacts"] = {"read": True, "feedback": True}
        changed["modules"]["first"]["controller"].append("ground")
        return changed

    def __init__(self, folder, component="Pressing"):
        super().__init__(folder, component)
        self._force, self._sensor = 0.0, MemoryMiddleware(self.fleet.bus, "sensor").writer("tip", WRENCH)

    def move(self):
        """See `Follower.move`."""
        super().move()
        self._force += 0.5
        self._sensor.write(WrenchMessage("world", np.array((0.1, 0.0, self._force)), np.array((0.0, 0.2, 0.0))))


def recorded(folder, component="Sine", cycles=300, made=Follower, calls=CALLS):
    """Record the component in memory; a message comes in two of three cycles, the first one late. Returns the file.

    `calls` are the services that are called, by the cycle, with their fields.
    """
    follower = made(folder, component)
    bus = follower.fleet.bus

    def step(cycle):
        bus.run_until((cycle + 1) / fleet.RATE)
        if cycle in calls:
            service, fields = calls[cycle]
            bus.call(f"first/{service}", None, **fields)
        if cycle > 5 and cycle % 3:
            follower.move()

    return taped(folder, follower.plugin, bus, step, cycles=cycles)


def taped(folder, plugin, bus, step, *, cycles):
    """Record a plugin on a bus; `step` lets a period pass, and takes the number of the cycle. Returns the file."""
    box_at = folder / "box"
    box_at.mkdir()
    plugins = PluginSet([plugin])
    with closing(BlackBox(box_at, [plugin], seconds=5.0)) as box:
        plugins.changed = lambda index, managed: box.note(index, managed, round(1e9 * bus.time))
        plugins.start()
        for cycle in range(cycles):
            step(cycle)
            plugins.cycle()
            box.record(round(1e9 * bus.time), 0, 0)
        return _drained(box_at)


def _drained(folder):
    """Make a file of what was recorded."""
    drain = RecordDrain(folder)
    files = {name: text.encode() for name, text in drain.layout.attachments.items()}
    with closing(RecordingWriter(folder / "run.mcap", files)) as writer:
        drain.into(writer).fill()
        writer.finish(drain.lost)
    return folder / "run.mcap"
