"""What is run with the files of the walk, and digested: plugins, a robot's simulation, its hardware, an RT layer."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
from support.bullet import raw_bullet
from support.walk.digest import Digest

from solfer.components import Component
from solfer.config import Configuration, load
from solfer.config.loading.rt_layer import read_layer
from solfer.config.loading.shared import load_shared
from solfer.interfaces.port import Port
from solfer.lower_level import LowerLevelServer
from solfer.middleware.bridge.routes import routes
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.numerics.rotations import quaternion_product
from solfer.plugins import Plugin, Registry, budget_of, generate
from solfer.realtime.emergency_stop import EmergencyStopLatch
from solfer.realtime.executor import Executor, ExecutorRules
from solfer.realtime.schedule import ScheduleRequest
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bullet import BulletEngine
from solfer.simulation.bundle import load_bundle, read_bundle
from solfer.simulation.mock_hardware.mock_hardware import MockHardware
from solfer.simulation.server.publications import robot_parameters
from solfer.telemetry.black_box import BlackBox
from solfer.transport.inbox import Inbox
from solfer.transport.messages import BodyMessage, ImuMessage, JointMessage, PointsMessage, VectorMessage, WrenchMessage

CYCLES, STEPS = 6, 12
JOINTS = ("shoulder", "elbow", "roll")
TURN = np.array((0.1, -0.2, 0.3, 0.9)) / np.linalg.norm((0.1, -0.2, 0.3, 0.9))


class Walker(Component):
    """Moves everything a little, and publishes where its inputs are."""

    def __init__(self, robot, tags=None, name=""):
        super().__init__(robot, tags, name)
        self.inputs = {"goal": Port("position"), "marks": Port("position", 2), "dots": Port("position", 2)}
        self.outputs = {"tip": Port("position")}
        if self.dynamics:
            robot.dynamics.subscribe({"bias": 1})
        self.count = 0

    def move_world(self, move):
        self.count += 10

    def update(self):
        self.count += 1
        command, model = self.model.command, self.model
        command.position[:] = model.state.position + 0.01 * self.count
        command.velocity[:], command.torque[:] = 0.1 * self.count, 0.2 * self.count
        ports = [port for port in self.inputs.values() if port.fresh]
        self.outputs["tip"].value[:] = model.kinematics.position("hand") + sum(port.value.sum() for port in ports)
        if self.modify:
            model.state.position[:3] += 0.01


class Others:
    """The robot's lower level, and those who publish what a plugin receives."""

    def __init__(self, folder: Path):
        self.bus, self.digest = Bus(), Digest()
        self._way, self._newest = 0.01 * np.arange(1.0, 1.0 + len(JOINTS)), 0.0
        node = MemoryMiddleware(self.bus, "cart")
        self._inbox = Inbox()
        self._lower_level = load_bundle(folder / "bundle.yaml").lower_level
        self._lower_level.start(np.zeros(9))
        self._server = LowerLevelServer(self._lower_level, node, self._inbox)
        joints = [node.writer(topic, "sensor_msgs/JointState") for topic in ("joint_states", "motor_states", "wishes")]
        self._joints, self._springs = joints, node.writer("springs", "solfer/JointCommand")
        self._rest = [
            (node.writer("odometry", "nav_msgs/Odometry"), self._odometry),
            (node.writer("imu", "sensor_msgs/Imu"), lambda k: ImuMessage("case", TURN, np.array((0.1, 0.2, 0.3 * k)))),
            (
                node.writer("angles", "geometry_msgs/Vector3Stamped"),
                lambda k: VectorMessage("base", 0.1 * TURN[:3] * k),
            ),
            (node.writer("goal", "geometry_msgs/PointStamped"), lambda k: VectorMessage("hand", TURN[:3] * k)),
            (node.writer("marks", "solfer/RobotPoints"), self._marks("a", "b")),
            (node.writer("dots", "solfer/RobotPoints"), self._marks()),
            (node.writer("foot", "geometry_msgs/WrenchStamped"), self._wrench("wheel")),
            (node.writer("contacts/rolling", "geometry_msgs/WrenchStamped"), self._wrench("wheel")),
            (node.writer("feet", "solfer/RobotPoints"), self._wrenches),
        ]
        self.bus.every(0.002, self._serve)
        self.publish(1)

    def publish(self, k: int) -> None:
        """Publish everything once; `k` counts, and joints become faster and faster."""
        speeds = 0.02 * k * np.arange(1.0, 1.0 + len(JOINTS))
        self._way, self._newest = self._way + (self.bus.time - self._newest) * speeds, self.bus.time
        for index, writer in enumerate(self._joints):
            names, times = JOINTS[::-1] if index == 2 else JOINTS, 1.0 + index
            writer.write(
                JointMessage(names, times * self._way, times * speeds, 1.5 * times * speeds, stamp=self.bus.time)
            )
        numbers = 0.1 * k * np.arange(1.0, 1.0 + len(JOINTS))
        self._springs.write(
            JointMessage(
                JOINTS,
                stiffness=numbers,
                damping=2.0 * numbers,
                interfaces=("acceleration",),
                values=3.0 * numbers[None],
            )
        )
        for writer, message in self._rest:
            writer.write(message(k))

    def _serve(self) -> None:
        self._server.receive_commands()
        self._inbox.apply()
        self._lower_level.update(np.zeros(9), np.zeros(9), 0.002)

    def run(self, plugin: Plugin) -> None:
        """Let a plugin cycle, and digest all that it publishes."""
        for topic in self.bus._topics.values():
            topic.listeners.append(lambda message, name=topic.name: self.digest.add((name, message)))
        for k in range(2, CYCLES):
            self.bus.run_until(self.bus.time + 1.0 / plugin.rate)
            self.publish(k)
            plugin.cycle()
            if k == CYCLES // 2 and f"{plugin.name}/trajectory" in self.bus._services:
                self.bus.call(f"{plugin.name}/trajectory", joints=("shoulder",), positions=(0.3,))
                self.bus.call(f"{plugin.name}/trajectory", joints=("roll",), velocities=(1.0,))
            if k == CYCLES // 2 and f"{plugin.name}/reference" in self.bus._services:
                task = next(iter(plugin.component.references.targets))
                self.bus.call(f"{plugin.name}/reference", task=task, values=(0.05, 0.0, 0.1), relative=True)
            if k == CYCLES // 2 and f"{plugin.name}/lift" in self.bus._services:
                self.bus.call(f"{plugin.name}/lift", contacts=("tip",), lifted=True)

    @staticmethod
    def _odometry(k: int) -> BodyMessage:
        speed = np.array((0.1, 0.2, 0.3))
        turn = quaternion_product((0.0, 0.0, np.sin(0.025 * k), np.cos(0.025 * k)), TURN)
        return BodyMessage("world", "base", 0.1 * k * TURN[:3], np.array(turn), speed, speed[::-1].copy())

    @staticmethod
    def _marks(*names: str) -> Callable[[int], PointsMessage]:
        return lambda k: PointsMessage("world", names, 0.1 * k + np.arange(6.0).reshape(2, 3))

    @staticmethod
    def _wrench(frame: str) -> Callable[[int], WrenchMessage]:
        return lambda k: WrenchMessage(frame, np.array((1.0, 2.0, 30.0 * k)), np.array((0.1, 0.2, 0.3)))

    @staticmethod
    def _wrenches(k: int) -> PointsMessage:
        return PointsMessage("world", ("rolling", "tip"), 0.1 * k + np.arange(12.0).reshape(2, 6))


def digest_of(configuration: Configuration, folder: Path, name: str = "joint_states") -> str:
    """Make a plugin, let it run for some cycles, and digest what it published and what it is."""
    others = Others(folder)
    generator = Registry().find(name, configuration.module.class_)
    plugin = generate(configuration, MemoryMiddleware(others.bus, configuration.module.name), generator)
    others.run(plugin)
    robot = plugin.robot
    states = [robot.state, robot.motor, robot.command, robot.lower_limits, robot.upper_limits]
    parts = [robot.maps, robot.selectors, robot.actuators, robot.contacts, robot.contacts.constraints]
    others.digest.add([robot.name, states, parts, robot.kinematics.tree, robot.dynamics.inertia, robot.semantics])
    return others.digest.add(plugin).text()


def module(name: str, **options: str) -> Callable[[Path], str]:
    """Return the bench of a module of the main file."""
    return lambda folder: digest_of(load(folder / "main.yaml", name, **options), folder)


def shared(folder: Path) -> str:
    """Run the plugins of a shared plugin, each for itself."""
    loaded = load_shared(folder / "main.yaml", "both")
    return Digest().add(budget_of(loaded.record)).text() + "".join(
        digest_of(one.configuration, folder, one.plugin) + Digest().add([one.name, one.requires]).text()
        for one in loaded.plugins
    )


def simulation(folder: Path) -> str:
    """Step the robot in its world, and publish what it measures."""
    world = folder / "world.yaml"
    bundle = read_bundle(folder / "bundle.yaml")
    digest, bus = Digest().add(robot_parameters(bundle)), Bus()
    with closing(Simulation.from_file(folder / "bundle.yaml", world=world)) as robot:
        server = SimulationServer(robot, MemoryMiddleware(bus, "cart"))
        with closing(server):
            for topic in bus._topics.values():
                topic.listeners.append(lambda message, name=topic.name: digest.add((name, message)))
            command = MemoryMiddleware(bus, "walk").writer("wheel_controller/command", "solfer/JointCommand")
            for _ in range(STEPS):
                command.write(JointMessage(("roll",), velocity=np.array([2.0])))
                server.cycle()
            if isinstance(robot._engine, BulletEngine):
                bullet, client, *_ = raw_bullet(robot)
                bodies = [bullet.getBodyUniqueId(index, client) for index in range(bullet.getNumBodies(client))]
                digest.add([bullet.getDynamicsInfo(body, -1, client)[:10] for body in bodies])
                digest.add([bullet.getBasePositionAndOrientation(body, client) for body in bodies])
                digest.add([bullet.getAABB(body, -1, client) for body in bodies])
                digest.add([bullet.getCollisionShapeData(body, -1, client) for body in bodies])
            digest.add([robot.q, robot.v, robot.torque, robot._groups, robot.lower_level, robot.body.links])
            digest.add([server.inbox, server._lower_level])
    return digest.text()


class LimitKeeper(MemoryMiddleware):
    """Keeps the limits of what is received, which have no meaning in memory."""

    limits: list[tuple] = []

    def queue(self, topic, message, size=64, largest=None):
        """See `Middleware.queue`."""
        self.limits.append((topic, size, largest))
        return super().queue(topic, message, size, largest)

    def serve(self, owner, services, submit):
        """See `Middleware.serve`."""
        self.limits += [(owner, service.name, service.largest) for service in services]
        super().serve(owner, services, submit)


def server(folder: Path) -> str:
    """Flood the lower level with commands, of a sender with a lease and of others."""
    bus, lower_level = Bus(), load_bundle(folder / "bundle.yaml").lower_level
    node = LimitKeeper(bus, "cart")
    node.limits = []
    offered = LowerLevelServer(lower_level, node, Inbox(ration=lower_level.ration.requests))
    lower_level.start(np.zeros(9))
    writers = [MemoryMiddleware(bus, name).writer("wheel_controller/command", "solfer/JointCommand") for name in "abc"]
    taken = []
    for _ in range(3):
        for writer in writers * 40:
            writer.write(JointMessage(("roll",), velocity=np.array([1.0])))
        offered.receive_commands()
        taken.append((offered.most, offered.dropped, lower_level.refused))
    return Digest().add([taken, node.limits]).text()


def bridge(folder: Path) -> str:
    """List what a bridge forwards for a plugin of the RT layer."""
    return Digest().add(routes([load(folder / "main.yaml", "walk", middleware="XBOT", layer="RT")])).text()


def hardware(folder: Path) -> str:
    """Step the robot behind the wiring of its hardware."""
    digest, bus = Digest(), Bus()
    mock = MockHardware.from_file(folder / "mock.yaml", MemoryMiddleware(bus, "cart"))
    with closing(mock):
        for topic in bus._topics.values():
            topic.listeners.append(lambda message, name=topic.name: digest.add((name, message)))
        for _ in range(STEPS):
            mock.cycle()
        digest.add([mock.simulation.q, mock.simulation.lower_level, mock._wiring])
    return digest.text()


def layer(folder: Path, file: str = "layer.yaml") -> str:
    """Make the executor of an RT layer with its plugins, as the node does, and digest it and what it asks for."""
    read = read_layer(folder / file)
    plugins, others = [], []
    for listed in read.load():
        configuration = listed.configuration
        others.append(Others(folder))
        middleware = MemoryMiddleware(others[-1].bus, configuration.module.name)
        plugins.append(generate(configuration, middleware, Registry().find(listed.plugin, configuration.module.class_)))
    rules = ExecutorRules(*(getattr(read.executor, name) for name in ("blend", "budget", "overruns", "grace")))
    memory = folder / "memory"
    memory.mkdir(exist_ok=True)
    box = BlackBox(memory, plugins, read.executor.record) if read.executor.record else None
    try:
        executor = Executor(
            plugins, others[0].bus and MemoryMiddleware(others[0].bus, "xbot"), EmergencyStopLatch(memory), rules=rules
        )
        executor.switchboard.commit(executor.switchboard.plan(read.executor.start))
        asked = ScheduleRequest(**dict(read.executor.schedule))
        parts = [
            executor.rate,
            executor._rules,
            [(one.name, one.state) for one in executor.plugins],
            vars(asked),
            box and box.size,
        ]
        return Digest().add(parts).text()
    finally:
        if box is not None:
            box.close()


def named_layer(folder: Path) -> str:
    """Make the executor of the RT layer that the main file names."""
    return layer(folder, "main.yaml")
