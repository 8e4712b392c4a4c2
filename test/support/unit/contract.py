"""One pipe of each space in both directions, and messages for it, for the tests that hold for every middleware."""

import copy
from dataclasses import dataclass

import numpy as np
from support.unit.joint_pipes import RATE, dofs, make_robot

from solfer.components import Port
from solfer.config.kinds.body import BodyControllerRecord, BodyFeedbackRecord
from solfer.config.kinds.contact import ContactControllerRecord, ContactFeedbackRecord
from solfer.config.kinds.joint import JointCommandRecord, JointFeedbackRecord
from solfer.config.kinds.point import PointControllerRecord, PointFeedbackRecord
from solfer.numerics.rotations import quaternion_from_rotation, rotation_from_angles
from solfer.pipes import PipeContext, factory
from solfer.points import PointContact
from solfer.transport import BodyMessage, JointMessage
from solfer.transport.messages import PointsMessage, VectorMessage, WrenchMessage

JOINTS, POINTS = ("roll", "shoulder"), ("left", "right", "rear")


@dataclass
class End:
    """A pipe, and the numbers at its inner end: what a feedback has written, or what a controller sends."""

    pipe: object
    numbers: np.ndarray


class Joints:
    """Positions of two joints."""

    kind, names, size = "solfer/JointCommand", JOINTS, 2
    record = {
        "name": "pipe",
        "space": "JOINT",
        "dofs": dofs(type="actuated"),
        "interface": {"position": True},
        "function": "reference",
    }

    def listen(self, wire, topic):
        robot = make_robot()
        record = JointFeedbackRecord.model_validate(self.record | {"source": topic, "message": self.kind})
        return End(factory.feedback(record, around(robot, wire)), robot.command.position[6:])

    def publish(self, wire, topic):
        robot = make_robot()
        record = JointCommandRecord.model_validate(self.record | {"sink": topic, "type": "reference"})
        return End(factory.controller(record, around(robot, wire)), robot.command.position[6:])

    def message(self, numbers, names=JOINTS):
        return JointMessage(names, position=numbers)

    def unknown(self):
        return self.message(np.zeros(2), ("roll", "shuolder")), "unknown joint 'shuolder'"

    def longer(self):
        return JointMessage(JOINTS, position=np.zeros(3))


class Added(Joints):
    """An interface that was added to the State online, beside one that every State has."""

    size = 2
    record = Joints.record | {"interface": {"velocity": True, "bias": True}}

    def listen(self, wire, topic):
        robot = make_robot()
        numbers = robot.command.add("bias")
        record = JointFeedbackRecord.model_validate(self.record | {"source": topic})
        return End(factory.feedback(record, around(robot, wire)), numbers[6:])

    def publish(self, wire, topic):
        robot = make_robot()
        numbers = robot.command.add("bias")
        record = JointCommandRecord.model_validate(self.record | {"sink": topic, "type": "reference"})
        return End(factory.controller(record, around(robot, wire)), numbers[6:])

    def message(self, numbers, names=JOINTS):
        return JointMessage(
            names,
            velocity=np.zeros(len(names)),
            interfaces=("other", "bias"),
            values=np.array([numbers, numbers]) * [[2.0], [1.0]],
        )

    def unknown(self):
        return self.message(np.zeros(2), ("roll", "shuolder")), "unknown joint 'shuolder'"

    def longer(self):
        return JointMessage(JOINTS, velocity=np.zeros(2), interfaces=("bias",), values=np.zeros((1, 3)))


class Measurement(Joints):
    """The same, measured."""

    record = Joints.record | {"function": "state"}

    def listen(self, wire, topic):
        robot = make_robot()
        robot.upper_limits.velocity[:] = np.inf  # messages come at once: no joint leaps
        record = JointFeedbackRecord.model_validate(self.record | {"source": topic, "message": self.kind})
        return End(factory.feedback(record, around(robot, wire)), robot.state.position[6:])

    def publish(self, wire, topic):
        robot = make_robot()
        record = JointCommandRecord.model_validate(self.record | {"sink": topic, "type": "reference"})
        return End(factory.controller(record, around(robot, wire)), robot.state.position[6:])


class Body:
    """The pose of the floating base."""

    kind, size = "nav_msgs/Odometry", 6
    record = {
        "name": "pipe",
        "space": "OPERATIONAL",
        "dofs": dofs(type="body", name="base"),
        "interface": {"position": True},
        "function": "state",
    }

    def listen(self, wire, topic):
        robot = make_robot()
        record = BodyFeedbackRecord.model_validate(self.record | {"source": topic, "message": self.kind})
        return End(factory.feedback(record, around(robot, wire)), robot.state.position[:6])

    def publish(self, wire, topic):
        robot = make_robot()
        more = {"sink": topic, "type": "reference", "message": self.kind}
        pipe = factory.controller(BodyControllerRecord.model_validate(self.record | more), around(robot, wire))
        return End(pipe, robot.state.position[:6])

    def message(self, numbers, child="base"):
        turned = rotation_from_angles(np.nan_to_num(numbers[3:]).tolist(), (0, 1, 2))
        return BodyMessage("world", child, numbers[:3].copy(), np.array(quaternion_from_rotation(turned)))

    def unknown(self):
        return self.message(np.zeros(6), "arm"), "it describes 'arm'"


class Point:
    """One Robot Point of a quantity."""

    size = 3

    def __init__(self, quantity="position", kind="geometry_msgs/PointStamped", size=3):
        self.quantity, self.kind, self.size = quantity, kind, size
        self.record = {"name": "pipe", "space": "POINT", "quantity": quantity}

    def listen(self, wire, topic):
        port = Port(self.quantity, self.count)
        record = PointFeedbackRecord.model_validate(self.record | {"source": topic})
        return End(factory.feedback(record, around(make_robot(), wire, inputs={"pipe": port})), port.value.reshape(-1))

    def publish(self, wire, topic):
        port = Port(self.quantity, self.count)
        record = PointControllerRecord.model_validate(self.record | {"sink": topic, "type": "reference"})
        pipe = factory.controller(record, around(make_robot(), wire, outputs={"pipe": port}))
        return End(pipe, port.value.reshape(-1))

    count = None

    def message(self, numbers, frame="world"):
        if self.quantity == "wrench":
            return WrenchMessage(frame, numbers[:3].copy(), numbers[3:].copy())
        return VectorMessage(frame, numbers)

    def unknown(self):
        return self.message(np.zeros(self.size), "arm"), "axes of 'arm'"


class Points(Point):
    """Three forces."""

    names, count = POINTS, 3

    def __init__(self):
        super().__init__("force", "solfer/RobotPoints", 9)
        self.record = {"name": "pipe", "space": "POINTS", "quantity": "force", "names": POINTS}

    def message(self, numbers, names=POINTS):
        return PointsMessage("world", names, np.reshape(numbers, (len(names), -1)))

    def unknown(self):
        return self.message(np.zeros(9), ("left", "right", "raer")), "unknown Point 'raer'"

    def longer(self):
        return self.message(np.zeros(12))


class Contact(Point):
    """What acts on one contact, at the origin of its link."""

    names = POINTS[:1]

    def __init__(self, kind="geometry_msgs/WrenchStamped", size=6):
        super().__init__("wrench", kind, size)
        self.record = {"name": "pipe", "space": "CONTACT", "contact": self.names[0]}

    def listen(self, wire, topic):
        robot = self.standing()
        record = ContactFeedbackRecord.model_validate(self.record | {"source": topic})
        return End(factory.feedback(record, around(robot, wire)), robot.contacts.wrenches.reshape(-1))

    def publish(self, wire, topic):
        robot = self.standing()
        record = ContactControllerRecord.model_validate(self.record | {"sink": topic, "type": "reference"})
        return End(factory.controller(record, around(robot, wire)), robot.contacts.wrenches.reshape(-1))

    def standing(self):
        robot = make_robot()
        for name in self.names:
            robot.contacts.add(PointContact("base", robot), name)
        return robot


class Contacts(Contact):
    """What acts on three of them."""

    names = POINTS

    def __init__(self):
        super().__init__("solfer/RobotPoints", 18)
        self.record = {"name": "pipe", "space": "CONTACTS", "names": POINTS}

    def message(self, numbers, names=POINTS):
        return PointsMessage("world", names, np.reshape(numbers, (len(names), -1)))

    def unknown(self):
        return self.message(np.zeros(18), ("left", "right", "raer")), "unknown contact 'raer'"

    def longer(self):
        return self.message(np.zeros(21))


def keeping(case, history):
    """Return a case whose feedback hands over every message."""
    other = copy.copy(case)
    other.record = case.record | {"history": history}
    return other


def around(robot, wire, **ports):
    """Surroundings of a pipe."""
    return PipeContext(robot, wire.middleware, {}, RATE, **ports)


ALL = {
    "joint": Joints(),
    "added": Added(),
    "operational": Body(),
    "point": Point(),
    "wrench": Point("wrench", "geometry_msgs/WrenchStamped", 6),
    "points": Points(),
    "contact": Contact(),
    "contacts": Contacts(),
}
NAMED = {name: ALL[name] for name in ("joint", "added", "points", "contacts")}
MEASURED = {"measurement": Measurement(), "operational": ALL["operational"]}
