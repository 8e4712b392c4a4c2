"""Sound sensors of a robot that is driven hard: what they measure may contradict nothing."""

from contextlib import closing
from pathlib import Path

import numpy as np
from support.integration.world import CONFIG, ROBOT
from support.paper.full_control import Nodes

from breaking.sensors import PERIOD, Saying, logged
from solfer.middleware.memory import FaultsRecord, MemoryMiddleware, read_faults
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.transport.lower_level import REFUSALS_TOPIC
from solfer.transport.messages import FieldsMessage
from solfer_tools.demo.waving import Waving

ALARMS = (
    "leaps by",
    "otherwise than by its velocities",
    "from the mean of the accelerometer",
    "an angular velocity of",
    "no number has changed",
    "' does not follow '",
    "a specific force of",
    "the accelerometer measures",
    "the ground turns by",
    "arrivals count instead",
)
"""Parts of the messages that name a sensor, a motor or a joint."""

PUSH, PUSHED, LINKS = 300.0, 0.3, ("pelvis", "wheel_1", "arm1_7", "arm2_4")
"""Force [N] and time [s] of a push, and the links that are pushed."""

SPEED, TURN = 0.4, 0.4
"""Largest velocities that are commanded [m/s, rad/s]."""

LOOK = 0.002
"""Period in which the true speeds are compared with the limits [s]."""

FALL = 2.0
"""Time for which the robot is watched when it is pushed over [s]."""


class Noisy(Nodes):
    """The robot of Fig. 5 with three times the errors of the shipped sensors and of the mock's joints.

    Args:
        faults: Those of the transport; None: it has none.
        world: File of the world; None: a plane.
    """

    def __init__(self, faults: FaultsRecord | None, world: Path | None):
        self._world = world
        super().__init__(None, faults)

    def offer(self, middleware):
        """See `World.offer`."""
        bundle = read_bundle(ROBOT / "robot.yaml")
        sensors, imu = bundle.sensors, bundle.sensors.imu
        errors = {name: _tripled(getattr(imu, name)) for name in ("gyroscope", "accelerometer")}
        joints = _tripled(sensors.joint_noise).model_copy(update={"position": 3e-4, "velocity": 6e-3})
        sensors = sensors.model_copy(update={"imu": imu.model_copy(update=errors), "joint_noise": joints})
        simulation = Simulation.from_file(bundle.model_copy(update={"sensors": sensors}), world=self._world)
        return simulation, SimulationServer(simulation, middleware)


def _tripled(record):
    """Return a record of errors, each three times as large."""
    return record.model_copy(update={name: 3.0 * value for name, value in record if isinstance(value, float)})


def find_alarms(seed: int, duration: float) -> tuple[list[tuple[float, str]], bool]:
    """Drive, push and reset a robot whose sensors are sound, and push it over in the end.

    Every 3 s on average another velocity is drawn, every 2 s a push, every 20 s a reset. Odd seeds have the transport
    of `config/transport/bad.yaml`, every other pair of seeds a ramp of 5 degrees.

    Args:
        seed: Seed of what is drawn.
        duration: Time until the robot is pushed over [s].

    Returns:
        The alarms, each with its time [s], and whether the robot lies in the end. A joint that is named because it is
        faster than it may be, and was, as in a fall on it, is no false alarm.
    """
    faults = _without_loss(read_faults(CONFIG / "transport" / "bad.yaml"), REFUSALS_TOPIC) if seed % 2 else None
    draw = np.random.default_rng(seed)
    slope = CONFIG / "worlds" / "slope.yaml" if seed % 4 >= 2 else None
    with closing(Noisy(faults, slope)) as world:
        log = Saying(lambda: world.bus.time)
        kinematics = world.simulation.kinematics
        joints = np.array(kinematics.dofs[6:])
        is_fast = np.zeros(len(joints), dtype=bool)
        limit = 2.0 * kinematics.velocity_limit[6:]
        world.bus.every(LOOK, lambda: np.logical_or(is_fast, np.abs(world.simulation.v[6:]) > limit, out=is_fast))
        with logged(log):
            _drive(world, draw, duration)
            world.simulation.pushes.add("pelvis", (0.0, 1500.0, 500.0), (0.0, 0.0, 0.0), 1.0)
            world.run(FALL)
        lies = bool(world.simulation.state.now.rotation("pelvis")[2, 2] < 0.5)
    fast = [f"'{name}' leaps" for name in joints[is_fast]] + [f"'{name}' at" for name in joints[is_fast]]
    alarms = [each for each in log.said if any(alarm in each[1] for alarm in ALARMS)]
    return [each for each in alarms if not any(name in each[1] for name in fast)], lies


def _without_loss(faults: FaultsRecord, topic: str) -> FaultsRecord:
    """Return faults of which a topic loses no message: there is no second one of a reset, and TCP loses none."""
    others = faults.topics["*"]
    return faults.model_copy(update={"topics": {topic: others.model_copy(update={"loss": 0.0}), **faults.topics}})


def _drive(world: Nodes, draw: np.random.Generator, duration: float) -> None:
    simulation = world.simulation
    world.run(1.0)
    stick = MemoryMiddleware(world.bus, "stick").writer("locomotion/cmd_vel", "geometry_msgs/Twist")
    waving = Waving(MemoryMiddleware(world.bus, "waving"), "hands", world.hands())
    begin = world.bus.time
    zero = {"x": 0.0, "y": 0.0, "z": 0.0}
    velocity = np.zeros(3)
    for _ in range(round(duration / PERIOD)):
        if draw.random() < PERIOD / 3.0:
            velocity = draw.uniform(-1.0, 1.0, 3) * (SPEED, SPEED, TURN) * draw.integers(0, 2, 3)
        if draw.random() < PERIOD / 2.0:
            force = draw.normal(size=3) * (1.0, 1.0, 0.0)
            simulation.pushes.add(
                str(draw.choice(LINKS)), PUSH / np.linalg.norm(force) * force, (0.0, 0.0, 0.0), PUSHED
            )
        if draw.random() < PERIOD / 20.0:
            simulation.reset()
            begin = world.bus.time
        x, y, turn = velocity.tolist()
        stick.write(FieldsMessage({"linear": zero | {"x": x, "y": y}, "angular": zero | {"z": turn}}))
        waving.send(world.bus.time - begin)
        world.run(PERIOD)
