"""A layer in shared memory on a virtual clock, parts of which fail, and all commands to its robot meanwhile."""

import numpy as np
import yaml
from support.integration.world import STEP
from support.plugins.plugin import WHEELS, configuration
from support.realtime.executor_plugins import Layer

from solfer.components.move_joints import MoveJoints
from solfer.plugins import PluginState
from solfer.realtime.executor import ExecutorRules
from solfer.transport.messages import copied

GOAL, SPEED = "mammal_wide_high", 0.5
"""Where the joints move, and how fast they do at most [rad/s]."""

RATE = 500.0  # of the layer RT [Hz]
LARGEST_STEP = 1.001 * SPEED / RATE
"""Largest step of a commanded position while the robot moves, and when it comes to rest [rad]."""

AT_ONCE = 2
"""Cycles from a fault until the robot holds: the one in which it is seen, and the lower level's next step."""

WHEEL_SPEED = 1.0  # [rad/s]
SAG = 0.05
"""How far springs give way to the weight: a plugin that starts anew begins there [rad]."""

RELAYED, RELAY = "relayed_states", "relay"
RELAY_PERIOD = 0.002  # [s]
JOINT_STATE = "sensor_msgs/JointState"
PLUGIN = "test"


class FaultLayer(Layer):
    """An executor with plugins beside the simulated CENTAURO, and everything between them in shared memory.

    After each of its steps it records what the robot's lower level has accepted.

    Args:
        world: The world, in shared memory.
        folder: Where the emergency stop is.
        plugins: Name, and file and class where they are not the shipped ones, of each plugin.
        rules: The rules of the executor.

    Attributes:
        rows: Time [s], accepted positions [rad], and accepted speeds of the wheels [rad/s].
        moved: When a motion was asked for last [s].
    """

    def __init__(self, world, folder, plugins, rules=None):
        self.rows, self.moved = [], 0.0
        controllers = world.simulation.lower_level.controllers
        self._position, self._velocity = controllers["position_controller"], controllers["velocity_controller"]
        super().__init__(world, folder / "stop", plugins, rules or ExecutorRules(blend=0.2))
        world.bus.every(STEP, self._look)

    @property
    def now(self):
        """Time of the world [s]."""
        return self.world.bus.time

    @property
    def wheels(self):
        """DoFs of the wheels."""
        return self._velocity.dofs

    @property
    def held(self):
        """DoFs of the joints that hold a position."""
        return self._position.dofs

    def begin_with(self, name=PLUGIN, until=PluginState.RUNNING):
        """Start a plugin, and wait until it is where it can be."""
        statistics = self.executor.switchboard
        statistics.commit(statistics.plan(start=[name]))
        self.world.run(0.4)
        assert self[name].state is until, self[name].reason

    def turning(self):
        """Return whether the wheels are commanded to turn."""
        return bool(self._velocity.velocity.all())

    def ask_to_move(self, name=PLUGIN):
        """Ask for a motion of all joints and the wheels."""
        trajectory, self.moved = self[name].plugin.component.trajectory, self.now
        trajectory(MoveJoints(GOAL, speed=SPEED))
        trajectory(MoveJoints(joints=WHEELS, velocities=(WHEEL_SPEED,) * 4))

    def move(self, name=PLUGIN):
        """Let all joints and the wheels move, and wait until they do; returns the moment."""
        self.ask_to_move(name)
        self.world.run(0.5)
        assert np.abs(self._velocity.velocity).min() == WHEEL_SPEED
        return self.now

    def cycles_until_rest(self, moment):
        """Count the cycles from a moment until the commands held, once and for all."""
        late = [
            time
            for (time, before, _), (_, after, speed) in zip(self.rows, self.rows[1:], strict=False)
            if time >= moment and (speed.any() or (after != before).any())
        ]
        return (late[-1] + STEP - moment) * self.executor.rate if late else 0.0

    def largest_step(self, since=0.0):
        """Find the largest change of a commanded position in one step [rad]; fails if any is not finite."""
        positions = np.array([position for time, position, _ in self.rows if time >= since])
        assert np.isfinite(positions).all()
        return np.abs(np.diff(positions, axis=0)).max(initial=0.0)

    def _look(self):
        self.rows.append((self.now, self._position.position.copy(), self._velocity.velocity.copy()))


class Relay:
    """Publishes joint states on another topic, each as `bend` makes it: None is not published.

    Attributes:
        bend: Makes of a message what is published.
        published: Number of messages that were published.
    """

    def __init__(self, world):
        self._node = node = world.node(RELAY)
        self._reader, self._writer = node.reader("joint_states", JOINT_STATE), node.writer(RELAYED, JOINT_STATE)
        self.bend, self.published = lambda message: message, 0
        world.bus.every(RELAY_PERIOD, self._publish)

    def close(self):
        """End; the last message is not new for later readers."""
        self.bend = lambda _: None
        self._node.close()

    def _publish(self):
        if self._reader.read():
            message = self._reader.message
            bent = self.bend(copied(message))
            if bent is not None:
                self._writer.write(bent)
                self.published += 1


def moving(folder, pipe=None, **tags):
    """Load `JointStates` in the layer RT; `pipe` and `tags` change the pipe of the robot's state.

    Args:
        folder: Folder for the file.
        pipe: Its tags in the middleware's block, such as `source`.
        **tags: Its tags in the library of feedbacks.
    """
    path = configuration(folder, **{"class": "solfer.components.joint_states:JointStates", "layer": "RT"})
    root = yaml.safe_load(path.read_text())
    tree = root["mwoibn"]
    tree["middleware"] = "XBOT"
    tree["feedback"]["link_side_online"] |= tags
    tree["xbot"]["feedback"]["link_side_online"] |= pipe or {}
    path.write_text(yaml.safe_dump(root))
    return path


def relayed(folder, **tags):
    """Load the same, with the robot received by a relay."""
    return moving(folder, {"source": RELAYED}, **tags)
