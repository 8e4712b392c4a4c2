"""An upper body with a plugin on a bus, and its page."""

import re

from scipy.spatial.transform import Rotation

from solfer import Robot
from solfer.interfaces.declaration import Accepted, Service
from solfer.interfaces.geometry import Pose, Turn, Vector
from solfer.interfaces.task_references import TaskReferences
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.transport import Inbox, JointMessage
from solfer.transport.declared.fields import message_of
from solfer.transport.health import Health
from solfer.transport.lower_level import Answer
from solfer.transport.middleware import NoFields
from solfer.transport.parameters import GetParameters, ParametersReply, SetParameters
from solfer_tools.scene import LiveScene
from solfer_tools.view import Page, PageServer

PERIOD = 0.05
GOAL = Pose(Vector(0.5, 0.2, 0.3), Turn(*Rotation.from_euler("z", 0.3).as_quat()))


class PageBench:
    """An upper body with a plugin `hands` on a bus, its page, and one that looks at it."""

    def __init__(self, robot, control, foxglove=False, simulation=None):
        self.bus, self.robot = Bus(), robot
        self.node, self.inbox, self.asked = MemoryMiddleware(self.bus, "hands"), Inbox(), []
        self.is_publishing = True
        self.states = self.node.writer("joint_states", "sensor_msgs/JointState")
        self.references = self.node.writer("hands/references", "solfer/TaskReferences")
        self.moved = self.node.queue("hands/left/reference", "geometry_msgs/PoseStamped")
        self.driven = self.node.queue("hands/cmd_vel", "geometry_msgs/Twist")
        self.gain = "2"
        self.takes = self.refusal = ""
        self.offer("hands/get_parameters", GetParameters, ParametersReply, lambda _: self.parameters)
        self.offer("hands/set_parameters", SetParameters, Accepted, self.note)
        self.offer("lower_level/emergency_stop", NoFields, Answer, self.note)
        self.offer(
            "lower_level/reset_emergency_stop", NoFields, Answer, lambda _: self.asked.append("clear") or Answer()
        )
        self.node.report("hands", Health.WARNING, "waits for <odometry>", {"cycle p99 [ms]": 1.25})
        viewer = MemoryMiddleware(self.bus, "view")
        self.scene = LiveScene(Robot.load(robot.description.text), viewer)
        self.server = PageServer(0)
        self.page = Page(self.server, robot.description, viewer, control=control, simulation=simulation)
        if foxglove:
            self.page.serve_foxglove(self.server)
        self.clients = []

    def offer(self, name, request, reply, handler):
        owner, _, last = name.rpartition("/")
        self.node.serve(owner, [Service(last, "", request, reply, handler)], self.inbox.submit)

    @property
    def parameters(self):
        return ParametersReply(
            names=("gain",), types=("number",), values=(self.gain,), defaults=("2",), units=("1/s",), minimums=("0",),
            maximums=("100",), descriptions=("how fast",),
        )  # fmt: skip

    def note(self, request):
        self.asked.append(request)
        if isinstance(request, SetParameters) and self.refusal:
            return Accepted(False, self.refusal)
        if isinstance(request, SetParameters):
            self.gain = self.takes or request.values[0]
        return Answer() if isinstance(request, NoFields) else Accepted()

    def clear(self, _):
        self.asked.append("clear")
        return Answer()

    def run(self, cycles=6):
        """Let cycles of the page pass."""
        for _ in range(cycles):
            self.bus.run_until(self.bus.time + PERIOD)
            self.inbox.apply()
            if self.is_publishing:
                joints = tuple(self.robot.dofs)
                self.states.write(JointMessage(joints, position=self.robot.command.position.copy()))
                own = TaskReferences(("left",), ("pose",), ("torso_2",), ("arm1_7",), (GOAL,), (GOAL,))
                self.references.write(message_of("solfer/TaskReferences", own))
            self.state = self.scene.update() or self.scene.update()
            self.page.update(self.state)
            for client, wait in zip(self.clients, (0.03, 0.003), strict=False):  # the other's is there by then
                client.receive(wait)

    def until(self, condition, cycles=60):
        """Let cycles pass until a condition holds."""
        while not condition():
            assert cycles, "it does not come"
            self.run(1)
            cycles -= 1

    @property
    def content(self):
        """All texts of the first page."""
        return self.clients[0].content

    @property
    def beat(self):
        return int(re.search(r'data-count="(\d+)"', self.content)[1])
