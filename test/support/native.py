"""Libraries of components that tests compile, and twins of these components in Python."""

import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solfer.components import Component
from solfer.components.native import INCLUDE
from solfer.config import Record
from solfer.errors import ComponentError
from solfer.interfaces.declaration import Accepted, Service, TopicIn
from solfer.points import CenterOfMass, Handler, LinearPoint
from solfer.robot import Robot

SOURCES = Path(__file__).parents[1] / "cpp"
LISTINGS = Path(__file__).parents[2] / "examples" / "cpp" / "listings.cpp"
FLAGS = ("-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{INCLUDE}")


def build(library: Path, *words: str, source: Path = SOURCES / "components.cpp") -> Path:
    """Compile a library, and return it."""
    subprocess.run(["g++", *FLAGS, "-shared", "-fPIC", *words, source, "-o", library], check=True)
    return library


@dataclass(frozen=True)
class Offset:
    """std_msgs/Float64MultiArray."""

    data: tuple[float, ...]


@dataclass(frozen=True)
class Switch:
    """Request of std_srvs/SetBool."""

    data: bool


class JointSpaceTwin(Component):
    """The law of `JointSpace` in components.cpp, in the same order of operations."""

    class Tags(Record):
        """Tags of the same names and defaults."""

        joints: str = "all"
        stiffness: float = 100.0
        damping: float = 2.0

    def __init__(self, robot: Robot, tags: Tags, name: str = "twin"):
        super().__init__(robot, tags, name)
        self.dynamics = True
        robot.dynamics.subscribe("bias")
        self.joints = robot.selectors[tags.joints].indices
        self.held = self.torque = np.zeros(robot.size)
        self.offset = np.zeros(robot.size)

    def topics(self):
        """Receive the offset of the first two joints."""
        return (TopicIn("offset", "std_msgs/Float64MultiArray", Offset, self.take),)

    def services(self):
        """Offer to forget the offset."""
        return (Service("zero", "std_srvs/SetBool", Switch, reply=Accepted, handler=self.zero),)

    def take(self, message):
        """Take an offset."""
        self.offset[self.joints[:2]] = message.data

    def zero(self, request):
        """Forget the offset."""
        if not request.data:
            raise ComponentError("there is nothing to do without `data`")
        self.offset[:] = 0.0
        return Accepted()

    def init(self):
        """Hold where the joints are."""
        self.held = self.start_position.copy()
        self.model.command.position[:] = self.held

    def update(self):
        """Compute torques."""
        state, tags = self.model.state, self.tags
        spring = tags.stiffness * (self.held + self.offset - state.position)
        self.torque = spring - tags.damping * state.velocity + self.model.dynamics.bias

    def send(self):
        """Command torques."""
        self.model.command.torque[self.joints] = self.torque[self.joints]


class TaskTrackingTwin(Component):
    """The law of `TaskTracking` in listings.cpp, by NumPy."""

    class Tags(Record):
        """Tags of the same names and defaults."""

        gain: float = 5.0
        damping: float = 1e-4
        way: tuple[float, ...]
        hands: str
        torso: str

    def __init__(self, robot: Robot, tags: Tags, name: str = "twin"):
        super().__init__(robot, tags, name)
        torso = LinearPoint(tags.torso, robot)
        hands = [LinearPoint(link, robot) for link in robot.links(tags.hands)]
        tasks = [CenterOfMass(robot), *(hand - torso for hand in hands)]
        self.tasks = Handler(tasks)
        self.points = Handler([torso, *hands, *tasks])
        self.positions = np.zeros(robot.size)

    def init(self):
        """Begin where the joints are."""
        self.positions = self.start_position.copy()
        self.points.update()
        self.tasks.update()
        self.references = self.tasks.value + self.tags.way

    def update(self):
        """Let the errors decay."""
        self.points.update()
        self.tasks.update()
        jacobian = self.tasks.jacobian
        square = jacobian @ jacobian.T + self.tags.damping * np.eye(len(jacobian))
        change = jacobian.T @ np.linalg.solve(square, self.tasks.value - self.references)
        self.positions -= self.tags.gain * self.time_step * change

    def send(self):
        """Command positions."""
        self.model.command.position[:] = self.positions
