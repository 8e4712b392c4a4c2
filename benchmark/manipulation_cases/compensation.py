"""How well compensation holds CENTAURO: on soft springs with and without a payload, arms without springs, cycles."""

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test"))

from points import URDF, RandomStates, in_units  # noqa: E402
from support.integration.carried import CarriedWorld  # noqa: E402
from support.integration.world import World  # noqa: E402
from support.unit.two_mass import response_errors  # noqa: E402
from tasks import CONTACTS, NOMINAL, gravity_compensation  # noqa: E402

from solfer import Robot  # noqa: E402
from solfer.components.compliance_compensation import ComplianceCompensation  # noqa: E402
from solfer.components.gravity_compensation import GravityCompensation, GravityTags  # noqa: E402

CONFIG = ROOT / "config"
SOFT, FREE = "- {chain: arms, stiffness: 50, damping: 5}", "- {chain: arms, stiffness: 0, damping: 5}"
NOISE = 0.3
"""Standard deviation of the torques that are sent, in each cycle anew [Nm]."""

Row = tuple[str, float, str, float | None]
"""Case, value, unit, and the most that it may be; without that it is only printed."""


class Noisy(GravityCompensation):
    """Gravity compensation with noise on each torque."""

    def update(self) -> None:
        """See `Component.update`."""
        super().update()
        noise = self.__dict__.setdefault("noise", np.random.default_rng(1))
        self._torque += noise.normal(0.0, NOISE, len(self._torque))


def standing(payload: float, duration: float = 30.0) -> Row:
    """Stand on soft springs, from before the start on."""
    world = CarriedWorld(payload)
    world.run(0.5)
    world.heights.clear()
    world.plugin("soft_compensation")
    world.run(duration)
    held = f" with {payload:g} kg in a hand" if payload else ""
    sag = world.sag()
    world.close()
    return f"base within, {duration:g} s, 300 and 50 Nm/rad{held}", sag, "m", 0.005


def varied(seed: int, duration: float = 30.0) -> Row:
    """Stand on soft springs with masses up to 20 % wrong, arms in a drawn posture."""
    world = CarriedWorld(joints=drawn_arms(np.random.default_rng(seed)), wrong=seed)
    world.run(0.5)
    world.heights.clear()
    world.plugin("soft_compensation")
    world.run(duration)
    sag = world.sag()
    world.close()
    return f"base within, {duration:g} s, masses 20 % wrong, posture {seed}", sag, "m", None


def drawn_arms(random: np.random.Generator) -> dict[str, float]:
    """Draw joints of the arms around those of the robot's first state [rad]."""
    world = CarriedWorld(friction=False)
    joints, drawn, model = world.simulation.q, {}, world.simulation.kinematics
    for dof, name in enumerate(model.dofs):
        if name.startswith(("j_arm1", "j_arm2")):
            lower, upper = model.lower_position[dof] + 0.3, model.upper_position[dof] - 0.3
            drawn[name] = float(np.clip(joints[dof] + random.uniform(-0.3, 0.3), lower, upper))
    world.close()
    return drawn


def free_arms(folder: Path) -> Path:
    """Write the configuration with arms that have no stiffness."""
    for name in ("support", "robots"):
        (folder / name).symlink_to(CONFIG / name)
    file = folder / "centauro.yaml"
    file.write_text((CONFIG / "centauro.yaml").read_text().replace(SOFT, FREE))
    return file


def pushed(file: Path, seed: int, target: str | None = None, duration: float = 10.0) -> tuple[float, float]:
    """Push a hand 10 cm aside in a posture drawn by `seed`; how far it was pushed, and goes once it rests [m]."""
    random = np.random.default_rng(seed)
    world = CarriedWorld(friction=False, joints=drawn_arms(random))
    world.run(0.2)
    world.plugin("soft_compensation", file, target)
    world.run(1.2)
    direction = random.normal(size=3)
    gone = world.push_aside(0.1, direction / np.linalg.norm(direction), force=5.0)
    world.run(1.0)
    rest, furthest = world.hand(), 0.0
    for _ in range(round(duration / 0.1)):
        world.run(0.1)
        furthest = max(furthest, float(np.linalg.norm(world.hand() - rest)))
    world.close()
    return gone, furthest


def carried(calls: int) -> Iterator[Row]:
    """Measure a cycle of torques that carry the robot on four wheels, in u, with the bias; then the whole component."""
    robot = Robot.load(URDF, URDF.with_suffix(".srdf"), contacts=CONTACTS)
    for dof, name in enumerate(robot.dofs):
        robot.state.position[dof] = sum(angle for part, angle in NOMINAL.items() if part in name)
    robot.update()
    move, component = RandomStates(robot), GravityCompensation(robot, GravityTags(track="wheels"))
    component.set_rate(500.0)
    component.init()

    def move_on() -> None:
        move()
        robot.update()

    def cycle() -> None:
        robot.dynamics.update()
        component.update()
        component.send()

    yield "cycle, torques on four contacts, with bias", in_units(gravity_compensation(robot), calls, move_on), "u", 1.6
    yield "cycle of the component, four contacts, with bias", in_units(cycle, calls, move_on), "u", None


def swings() -> Iterator[Row]:
    """Let springs of three stiffnesses swing between two masses."""
    for stiffness in (6000.0, 20000.0, 80000.0):
        frequency, damping = response_errors(stiffness, 0.02)
        yield f"two masses, {stiffness:g} Nm/rad, error of the frequency", frequency, "1", 0.01
        yield f"two masses, {stiffness:g} Nm/rad, error of the damping", damping, "1", 0.05


def deflected(*plugins: str) -> float:
    """Hold the robot by plugins; how far its arms are from where they are commanded after a while [rad]."""
    world = World()
    commanding, *_ = [world.plugin(name) for name in plugins]
    world.run(2.0)
    arms = np.array([name.startswith("j_arm") for name in commanding.robot.dofs])
    away = world.simulation.q - commanding.robot.command.position
    world.close()
    return float(np.linalg.norm(away[arms]))


def drift(cycles: int = 120_000) -> float:
    """Compensate springs under a constant reference; how far the last command is from the first [rad]."""
    robot = Robot.load(URDF, actuators=URDF.with_name("actuators.yaml"), name="centauro")
    robot.command.torque[:] = np.random.default_rng(0).uniform(-50.0, 50.0, robot.size)
    component = ComplianceCompensation(robot)
    component.init()
    component.update()
    component.send()
    first = robot.command.position.copy()
    for _ in range(cycles):
        component.update()
        component.send()
    return float(np.abs(robot.command.position - first).max())


def rows(postures: int, calls: int) -> Iterator[Row]:
    """Measure all cases."""
    yield from carried(calls)
    yield from swings()
    without = deflected("desired_joints", "gravity_compensation")
    compensated = deflected("desired_joints", "spring_compensation", "compliance_compensation")
    yield "arms at rest, off with springs compensated, by without", compensated / without, "1", 0.1
    yield "springs compensated, command after 120 000 cycles, off", drift(), "rad", 1e-6
    yield standing(0.0)
    yield standing(5.0)
    for seed in range(1, 4):
        yield varied(seed)
    yield from pushes(postures)


def pushes(postures: int) -> Iterator[Row]:
    """Push a hand of arms without stiffness, in postures that are drawn."""
    with tempfile.TemporaryDirectory() as folder:
        file = free_arms(Path(folder))
        for seed in range(postures):
            gone, moved = pushed(file, seed)
            yield f"hand pushed {100 * gone:.1f} cm, posture {seed}, goes in 10 s", moved, "m", 0.02
        _, moved = pushed(file, 0, "manipulation_cases.compensation:Noisy")
        yield f"the same with torque noise of {NOISE} Nm, posture 0", moved, "m", None
