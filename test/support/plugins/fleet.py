"""Plugins of one process on a floating cart, in memory: their configuration, their messages and their cycles."""

import copy
import re

import numpy as np
import yaml
from support.unit.cart import URDF

from solfer.components import Component, Port
from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Registry, Sharing, generate
from solfer.transport import JointMessage

RATE = 200.0
JOINTS = {"chain": "all", "type": "actuated", "mapping": "RBDL"}
BASE = {"chain": "all", "type": "unactuated", "mapping": "RBDL"}
MOVING = {"position": True, "velocity": True}


def tree():
    """Return the configuration that tests change: `joints` and `base` are measured, all plugins receive the joints."""
    module = {
        "class": "support.plugins.fleet:Reader",
        "layer": "NRT",
        "robot": "jointed",
        "controller": [],
        "mode": "full",
        "kinematics": True,
        "dynamics": False,
        "model_change": False,
    }

    def receives(*names):
        return {"feedback": {"list": list(names)}, "actuators": {"read": False}, "contacts": {"read": False}}

    joints = {"space": "JOINT", "dofs": JOINTS, "interface": MOVING, "function": "state"}
    base = {"space": "JOINT", "dofs": BASE, "interface": {"position": True}, "function": "state"}
    body = {"space": "OPERATIONAL", "dofs": BASE | {"type": "body", "name": "base"}, "interface": {"position": True}}
    command = {"type": "reference", "dofs": JOINTS, "interface": {"position": True}}
    return {
        "middleware": "ROS",
        "system": "SM",
        "robot": {
            "name": "cart",
            "rate": RATE,
            "jointed": receives("joints"),
            "based": receives("joints", "base"),
            "encoded": receives("encoders"),
            "imu": receives("joints", "imu"),
            "tracked": receives("joints", "tracker"),
            "smooth": receives("smooth"),
            "deaf": receives(),
        },
        "feedback": {
            "joints": joints,
            "encoders": joints | {"dofs": JOINTS | {"chain": "front"}},
            "smooth": joints | {"filter": {"frequency": 20.0}},
            "base": base,
            "imu": body | {"convention": {"position": {"type": "NONE"}}},
            "tracker": body,
        },
        "controller": {
            "base": base | {"type": "reference"},
            "wanted_base": base | {"type": "reference", "function": "reference"},
            "left": command,
            "right": command,
        },
        "ros": {
            "source": {"urdf": "/cart", "srdf": "/semantics"},
            "feedback": {
                "joints": {"source": "joint_states", "message": "sensor_msgs/JointState"},
                "encoders": {"source": "encoders", "message": "sensor_msgs/JointState"},
                "smooth": {"source": "joint_states", "message": "sensor_msgs/JointState"},
                "base": {"source": "base", "message": "solfer/JointCommand", "initialize": True},
                "imu": {"source": "imu", "message": "sensor_msgs/Imu"},
                "tracker": {"source": "tracker", "message": "geometry_msgs/PoseStamped"},
            },
            "controller": {
                "base": {"sink": "base"},
                "wanted_base": {"sink": "base"},
                "left": {"sink": "left"},
                "right": {"sink": "right"},
            },
        },
        "modules": {name: copy.deepcopy(module) for name in ("first", "second", "third")},
    }


SRDF = """<robot name="cart"><group name="front"><joint name="free"/><joint name="shoulder"/></group>
  <group name="wheels"><joint name="roll"/></group></robot>"""


class Reader(Component):
    """Keeps what it sees of its Robot, and commands a number of its own."""

    def init(self):
        self.seen = []

    def update(self):
        robot = self.model
        self.seen.append((robot.state.position.copy(), robot.kinematics.position("arm").copy(), robot.gravity.copy()))
        robot.command.position[:] = len(self.seen) + sum(map(ord, self.name))


class Balance(Reader):
    """Reads centre of mass and inertia as well."""

    def update(self):
        super().update()
        robot = self.model
        self.seen.append((robot.center_of_mass.value.copy(), robot.dynamics.inertia.copy(), robot.dynamics.bias.copy()))


class Estimator(Reader):
    """Writes the base of its Robot: forward by a step in each cycle."""

    def update(self):
        super().update()
        self.model.state.position[0] += 0.01
        self.model.state.position[4] = 0.001 * len(self.seen)


class Ported(Reader):
    """Receives and publishes a single Point, and several."""

    def __init__(self, *args):
        super().__init__(*args)
        self.inputs["goal"], self.inputs["marks"] = Port("pose"), Port("position", 2)
        self.outputs["push"], self.outputs["feet"] = Port("force"), Port("force", 2)


class Fleet:
    """Plugins that share what they can, and the cart that publishes its joints.

    Args:
        folder: Where to write their configuration.
        changed: The configuration; see `tree`.
        names: Its modules, in the order of their cycles.
        together: Whether they share Robots.
        faults: Faults of the transport; None: there are none.
    """

    def __init__(self, folder, changed, names, together=True, faults=None):
        self.configurations = loaded(folder, changed, names)
        self.bus = Bus(
            {
                "/cart": re.sub(r'velocity="\d+"', 'velocity="1000"', URDF),  # no joint leaps
                "/semantics": SRDF,
            },
            faults,
        )
        self.middlewares = [MemoryMiddleware(self.bus, name) for name in names]
        self.sharing = Sharing(self.configurations) if together else None
        self.plugins = [
            generate(each, middleware, Registry().find(each.name, each.module.class_), self.sharing)
            for each, middleware in zip(self.configurations, self.middlewares, strict=True)
        ]
        self._writers, self._robot = {}, MemoryMiddleware(self.bus, "robot")
        self.asleep = set()

    def publish(self, topic="joint_states", names=("shoulder", "roll"), message="sensor_msgs/JointState", **fields):
        """Publish numbers of joints by the message's field."""
        if topic not in self._writers:
            self._writers[topic] = self._robot.writer(topic, message)
        self._writers[topic].write(JointMessage(names, **{key: np.array(value) for key, value in fields.items()}))

    def cycle(self, **fields):
        """Publish joints, if any are given, and let all plugins make a cycle."""
        if fields:
            self.publish(**fields)
        self.bus.run_until(self.bus.time + 1.0 / RATE)
        if self.sharing is not None:
            self.sharing.turns.next()
        for plugin in self.plugins:
            if plugin.name not in self.asleep:
                plugin.cycle()


def loaded(folder, changed, names):
    """Write a configuration, and load some of its modules."""
    file = folder / "main.yaml"
    file.write_text(yaml.safe_dump({"mwoibn": changed}))
    return [load(file, name) for name in names]


def still(shoulder=0.1, roll=0.2):
    """Return the fields of a message of joints at rest."""
    return {"position": [shoulder, roll], "velocity": [0.0, 0.0]}
