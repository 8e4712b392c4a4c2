"""CENTAURO in PyBullet with sensors that err, `odometry` and `ground_forces` beside it, and what really pushes it."""

from pathlib import Path

import numpy as np

from solfer.config import load
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.model.urdf.cut import cut
from solfer.plugins import Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer
from solfer.simulation.bundle import read_bundle
from solfer.simulation.sensors.records import SensorsRecord

CONFIG = Path(__file__).resolve().parents[2] / "config"
ROBOT = CONFIG / "robots" / "centauro"
STEP, PERIOD, DELAY = 0.001, 0.005, 0.002  # [s]
SETTLING, RESTING = 2.0, 3.0  # before the odometry begins, and before anything is measured [s]
RADIUS = 0.078  # [m]
SIDES = np.array((1.0, -1.0, 1.0, -1.0))
LEGS = (1, 2, 3, 4)
WHEELS = tuple(f"wheel_{leg}" for leg in LEGS)
LEG_JOINTS = ("hip_yaw", "hip_pitch", "knee_pitch")


def sensors(seed: int, noise: float) -> SensorsRecord:
    """Return the shipped sensors with errors times a factor, which are late unless it is zero."""
    made = read_bundle(ROBOT / "robot.yaml").sensors.model_dump(exclude_unset=True)
    for name in ("imu", "joint_noise"):
        made[name]["exact"] = noise == 0.0
    for drift in ("gyroscope", "accelerometer"):
        made["imu"][drift] = {key: noise * value for key, value in made["imu"][drift].items()}
    for error in ("effort", "effort_offset"):
        made["joint_noise"][error] *= noise
    return SensorsRecord.model_validate(made | {"seed": seed, "delay": DELAY if noise else 0.0})


class ForcesWorld:
    """The robot, what moves it, and the two plugins with their shipped configurations.

    Args:
        seed: Seed of all errors.
        noise: Factor of all errors; 0: none.
        world: File of the world; None: a plane.
        file: The configuration.
        name: Name of the module of the forces.

    Attributes:
        forces: The plugin `ground_forces`.
        truth: What the ground does to each wheel in each step of 1 ms, world axes, each of shape (4, 3) [N].
        rows: What the plugin says in each cycle: steps so far, forces, shape (4, 3) [N], which wheels touch, shape
            (4,), and the push, shape (6,) [N, Nm].
    """

    def __init__(
        self,
        seed: int,
        noise: float = 1.0,
        world: str | None = None,
        file: Path = CONFIG / "centauro.yaml",
        name: str = "ground_forces",
    ):
        text = (ROBOT / "centauro.urdf").read_text()
        description = Description.from_text(text)
        parts = {f"/robot_{part}_body": cut(description, "torso_2", part) for part in ("lower", "upper")}
        srdf = (ROBOT / "centauro.srdf").read_text()
        self.bus = Bus({"/robot_description": text, "/robot_semantic_description": srdf, **parts})
        bundle = read_bundle(ROBOT / "robot.yaml").model_copy(update={"sensors": sensors(seed, noise)})
        self.simulation = Simulation.from_file(bundle, world=world)
        self._server = SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator"))
        self.truth: list[np.ndarray] = []
        self.rows: list[tuple[int, np.ndarray, np.ndarray, np.ndarray]] = []
        self.bus.every(STEP, self._step)
        self._file = file
        self.driver = self._plugin("joint_states", "joint_states")
        self.bus.every(PERIOD, self.driver.cycle)
        self.run(SETTLING)
        self.odometry = self._plugin("odometry", "odometry3")
        self.bus.every(PERIOD, self.odometry.cycle)
        self.run(0.1)
        self.forces = self._plugin(name, "ground_forces")
        self.bus.every(PERIOD, self._cycle)
        self.run(RESTING)

    def close(self) -> None:
        """Release the simulation."""
        self.simulation.close()

    def run(self, duration: float) -> None:
        """Let time pass [s]."""
        self.bus.run_until(self.bus.time + duration)

    def _plugin(self, name: str, plugin: str) -> Plugin:
        return generate(load(self._file, name), MemoryMiddleware(self.bus, name), Registry().find(plugin))

    def _step(self) -> None:
        self._server.cycle()
        contacts = self.simulation.contacts()
        self.truth.append(np.array([contacts.get(wheel, np.zeros(3)) for wheel in WHEELS]))

    def _cycle(self) -> None:
        self.forces.cycle()
        component = self.forces.component
        forces = np.array([contact.force for contact in component.contacts])
        push = component.outputs["external_wrench"].value.copy()
        self.rows.append((len(self.truth), forces, component.touch.touching.copy(), push))

    def move(self, **fields) -> float:
        """Ask the driver for a motion, and return how long it takes [s]."""
        reply = self.bus.call("joint_states/trajectory", **fields)
        self.run(0.01)
        answer = reply.result(0)
        assert answer.success, answer.message
        return answer.duration

    def roll(self, speeds: np.ndarray) -> None:
        """Let the wheels roll with speeds over the ground [m/s], shape (4,)."""
        wheels = tuple(f"j_{wheel}" for wheel in WHEELS)
        self.move(joints=wheels, velocities=tuple((SIDES * speeds / RADIUS).tolist()))


class Legs:
    """Joints of the legs that put the wheels where they are desired, seen from the base.

    Args:
        world: Where the robot stands.
    """

    def __init__(self, world: ForcesWorld):
        self._robot = world.driver.robot.twin()
        self._robot.state.position[:] = world.driver.robot.state.position
        self._robot.state.position[:6] = 0.0
        self.joints = [tuple(f"{joint}_{leg}" for joint in LEG_JOINTS) for leg in LEGS]
        self._places = [self._place(leg) for leg in LEGS]

    def _place(self, leg: int) -> np.ndarray:
        self._robot.update()
        return self._robot.kinematics.position(f"wheel_{leg}").copy()

    def reach(self, leg: int, offset: np.ndarray) -> tuple[float, ...]:
        """Return the positions of the joints of a leg that put its wheel off from where it was, shape (3,) [m]."""
        robot, desired = self._robot, self._places[leg - 1] + offset
        dofs = [robot.dof(joint) for joint in self.joints[leg - 1]]
        for _ in range(100):
            error = desired - self._place(leg)
            if abs(error).max() < 1e-6:
                break
            jacobian = robot.kinematics.jacobian(f"wheel_{leg}")[:3, dofs]
            robot.state.position[dofs] += np.clip(np.linalg.lstsq(jacobian, error, rcond=1e-3)[0], -0.1, 0.1)
        return tuple(robot.state.position[dofs].tolist())
