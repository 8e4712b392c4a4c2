"""The shared plugin of Fig. 5 from one configuration, in memory and in an RT layer, on a robot that stands."""

import math

import numpy as np
import yaml
from support.integration.world import CONFIG, STEP, World
from support.integration.xbot_world import XbotWorld
from support.shared.figure_5 import ORDER, module, write

from solfer.components import Component
from solfer.components.joint_states import JointStates
from solfer.config import load_shared
from solfer.config.loading.rt_layer import read_layer
from solfer.realtime.executor import ExecutorRules
from solfer.transport.lower_level import answered_service
from solfer.transport.middleware import TRIGGER, NoFields

LISTED = ("upper_body", *ORDER, "wave")
"""The members of the shared plugin, in the order of their cycles."""

MOVED = ("j_arm", "torso", "neck_p", "neck_y")
"""How the joints begin that are asked to move."""

STEPS = 300, 750, 1200
"""Steps of the simulation: when the upper body is asked to move, when to move elsewhere, and the last one."""

BLEND = 0.2
"""Time in which commands blend in, the same in every layer [s]."""

BEGIN = 1.0 + STEP / 2.0
"""When the robot and the plugins begin in the tests' own time [s]: plugins run between two steps of the simulation."""


class BreakableJoints(JointStates):
    """Moves joints; raises in the next cycle when it is asked to, by the service `<name>/fail`."""

    def services(self):
        """See `Component.services`."""
        return (*super().services(), answered_service("fail", TRIGGER, NoFields, work=self._fail))

    def _fail(self, _):
        self.update = self._broken

    def _broken(self):
        raise ArithmeticError("broken on request")


class Wave(Component):
    """Commands what depends on all that it has received."""

    def init(self):
        self._time, self._begin = 0.0, self.model.state.position.copy()

    def update(self):
        self._time += self.period
        desired, position = self.model.command.position, self.model.state.position
        desired[:] = 0.9 * desired + 0.1 * self._begin + 0.04 * math.sin(math.pi * self._time)
        desired += 0.03 * (desired - position)


def requests(positions):
    """Return two motions of the upper body from the measured `positions` of joints by name [rad]."""
    joints = tuple(name for name in positions if name.startswith(MOVED))
    return [
        {"joints": joints, "positions": tuple(round(positions[name], 3) + step for name in joints), "speed": 1.0}
        for step in (0.25, 0.1)
    ]


def write_listed(folder):
    """Write the configuration of all middlewares, with the upper body in the shared plugin, and return the file."""
    tags = {name: {"blend": BLEND} for name in LISTED}
    tags["upper_body"] |= {
        "class": f"{__name__}:BreakableJoints",
        "secondary_file": {"file": str(CONFIG / "support" / "upper_body.yaml")},
    }
    tags["wave"] |= module(f"{__name__}:Wave", "whole", ["wave"])
    return write(folder, shared={"plugins": ["upper_body", *(f"{name}::{name}" for name in LISTED[1:])]}, **tags)


def write_layer(file, rate):
    """Write an RT layer of the shared plugin alone, at the rate of the layer outside, and return the file."""
    layer = {
        "XBotRTPlugins": {"plugins": ["shared"]},
        "mwoibn": {"config_file": {"file": file.name}},
        "executor": {"rate": rate, "blend": BLEND, "start": ["shared"]},
    }
    path = file.with_name("layer.yaml")
    path.write_text(yaml.safe_dump(layer))
    return path


class _Listed:
    """What both worlds have; the robot stands still until the plugins are made, and both begin with the first step.

    Attributes:
        listed: Names of the plugins, in the order of their cycles.
        set: The plugins in their loop.
        sent: What the command pipes of all of them have sent, one row for each cycle.
        names: The plugin, the pipe, the field, the DoF or Point, or its number in what has no names, and the number of
            each column of it.
    """

    listed, is_perfect = LISTED, False

    def __init__(self, file, *args):
        super().__init__(*args)
        self.pause(True)
        self.set = self._made(file)
        pipes = [(plugin.name, pipe) for plugin in self._plugins() for pipe, _ in plugin.outputs.controllers]
        fields = [
            (owner, pipe, name, getattr(pipe.sent, name)) for owner, pipe in pipes for name in self._fields(pipe.sent)
        ]
        self.names = tuple(
            (owner, pipe.name, name, getattr(pipe.sent, "names", range(index[0] + 1))[index[0]], *index[1:])
            for owner, pipe, name, numbers in fields
            for index in np.ndindex(numbers.shape)
        )
        self._numbers = tuple(numbers for *_, numbers in fields)
        self.sent = []
        self.bus.run_until(BEGIN)
        self.pause(False)
        self.set.switchboard.commit(self.set.switchboard.plan(self.listed))
        for work in (self.set.cycle, self._note):
            self.bus.every(1.0 / self.set.rate, work, BEGIN + STEP)

    def move(self, motions, steps=STEPS):
        """Ask for `motions` of the upper body at a step each, while the legs swing, until the last step."""
        for step, motion in zip(steps, motions, strict=False):
            self.bus.run_until(BEGIN + (step - 0.25) * STEP)
            reply = self.ask("upper_body/trajectory", **motion)
            assert reply.success, reply.message
        self.bus.run_until(BEGIN + (steps[-1] + 0.25) * STEP)

    def positions(self):
        """Return the joints of the simulated robot by name [rad]."""
        robot = self.set.plugins[-1].plugin.robot
        return {name: float(value) for name, value in zip(robot.dofs[6:], self.simulation.q[6:], strict=True)}

    def _plugins(self):
        return [managed.plugin for managed in self.set.plugins]

    @staticmethod
    def _fields(message):
        fields = [name for name, value in vars(message).items() if isinstance(value, np.ndarray)]
        return [name for name in fields if name != "block"]  # which holds the others

    def _note(self):
        self.sent.append(np.concatenate([numbers.ravel() for numbers in self._numbers]))


class InMemory(_Listed, World):
    """CENTAURO on a bus, and the shared plugin of a file."""

    def _made(self, file):
        return self.together(load_shared(file).plugins)


class InLayer(_Listed, XbotWorld):
    """CENTAURO in shared memory, and the shared plugin of a layer's file under its executor."""

    def _made(self, file):
        layer = read_layer(file)
        rules = layer.executor
        return self.executor(layer.load(), ExecutorRules(rules.blend, rules.budget, rules.overruns, rules.grace))
