"""Pictures of robots that stand, reach or drive in simulation, each as `solfer new robot` configures it.

    python benchmark/gallery.py [--robots NAME...] [--folder FOLDER]

They are those of docs/tutorials/gallery.md. Most robots move by their plugin `inverse_kinematics`, in memory: one with
a floating base moves it above its feet, any other the tip of its longest chain of joints. Some only stand, with
`joint_states`. Those on wheels are of `examples/wheeled_quadruped.py`, and drive. A line has the number of DoFs, the
link that moved, its way, and how far this is from the desired one, by what the simulation measures. The exit code is 1
if that is more than 5 mm, or a base has tilted. The robots come with `pip install -r requirements-examples.txt` and
PyBullet. The progress goes to stderr.
"""

import logging
import math
import sys
import tempfile
from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from driving_cases.world import PERIOD, World
from form import Figures, parser_of
from PIL import Image
from robots import state_srdf

from solfer.config import load
from solfer.errors import SolferError
from solfer.interfaces.geometry import Twist, Vector
from solfer.middleware.memory import Bus, MemoryMiddleware
from solfer.model import Description
from solfer.numerics.rotations import rotation_from_quaternion
from solfer.plugins import Registry, generate
from solfer.simulation import Simulation, SimulationServer, read_bundle
from solfer.simulation.rendering.renderer import Renderer
from solfer.simulation.server.publications import robot_parameters
from solfer_tools.cli.skeletons.collections import EXAMPLES, find_robot, folder_of
from solfer_tools.cli.skeletons.robot import RobotSkeleton, tip_of

sys.path.append(str(Path(__file__).resolve().parents[1] / "examples"))
import wheeled_quadruped

STEP, SETTLE, MOVE = 0.001, 4.0, 5.0  # [s]
NEAR, TILTED = 0.005, math.radians(10.0)
"""Largest distance from where the robot is to be [m], and largest tilt of a floating base [rad]."""

SPEED = 0.2
"""Speed of a robot on wheels [m/s]."""

SIZE, QUALITY = (360, 300), 80
"""Width and height of the pictures [pixel], and quality of the JPEG."""


@dataclass(frozen=True)
class Shown:
    """A robot of the gallery.

    Attributes:
        source: `COLLECTION:NAME`, as `solfer new robot --from` takes it.
        srdf: SRDF below the robots of example-robot-data; empty: none.
        joints: Positions of some joints at the start, where there is no SRDF [rad].
        floating: Whether its base floats.
        way: Where base or tip go from their start, in the world, shape (3,) [m]; all zero: the robot only stands.
        yaw: Direction in which the camera looks, about the vertical [deg].
    """

    source: str
    srdf: str = ""
    joints: Mapping[str, float] = field(default_factory=dict)
    floating: bool = True
    way: tuple[float, float, float] = (0.0, 0.0, -0.03)
    yaw: float = 130.0


def example(urdf: str, srdf: str = "", **more: Any) -> Shown:
    """Make a robot of example-robot-data; the SRDF lies in a folder `srdf` of the same robot."""
    return Shown(f"{EXAMPLES}:{urdf}", f"{urdf.split('/')[0]}/srdf/{srdf}.srdf" if srdf else "", **more)


STANDS = (0.0, 0.0, 0.0)
LEG = {"hip_pitch": -0.3, "knee": 0.6, "ankle_pitch": -0.3}
G1 = {f"{side}_{joint}_joint": angle for side in ("left", "right") for joint, angle in LEG.items()}
"""Bent knees; G1 has no SRDF [rad]."""

ROBOTS = {
    "panda": example("panda_description/urdf/panda", "panda", floating=False, way=(0.1, 0.2, -0.1)),
    "kuka_iiwa": Shown("pybullet_data:kuka_iiwa/model", floating=False, way=(0.3, 0.3, -0.3), yaw=60.0),
    "xarm7": example("xarm_description/urdf/xarm7", "xarm7", floating=False, way=(0.15, 0.1, 0.15), yaw=160.0),
    "z1": example("z1_description/urdf/z1", "z1", floating=False, way=(0.1, 0.05, 0.1), yaw=160.0),
    "so101": example("so_arm_description/urdf/so101", floating=False, way=(-0.05, 0.05, 0.05)),
    "tiago": example("tiago_description/robots/tiago_no_hand", floating=False, way=(0.0, 0.0, 0.05)),
    "tiago_pro": example("tiago_pro_description/robots/tiago_pro", floating=False, way=(0.0, 0.0, 0.05)),
    "talos": example("talos_data/robots/talos_reduced", "talos"),
    "g1": example("g1_description/urdf/g1_29dof_rev_1_0", joints=G1, way=STANDS),
    "go2": example("go2_description/urdf/go2", "go2"),
    "anymal_c": example("anymal_c_simple_description/urdf/anymal", "anymal"),
    "b1-z1": example("b1_description/urdf/b1-z1", "b1-z1"),
    "solo12": example("solo_description/robots/solo12", "solo"),
    "hyq": example("hyq_description/robots/hyq_no_sensors", "hyq"),
    "centauro": example("centauro_description/urdf/centauro", "centauro", way=STANDS),
    "r2d2": Shown("pybullet_data:r2d2", way=STANDS),
}
WHEELED = {f"wheeled_{name}": name for name in wheeled_quadruped.ROBOTS}


@dataclass(frozen=True)
class Found:
    """What a robot has done.

    Attributes:
        simulation: The robot as it is at the end.
        link: What moved.
        way: Its way, shape (3,) [m].
        away: Its distance from where it was to be [m].
    """

    simulation: Simulation
    link: str
    way: np.ndarray
    away: float

    @property
    def tilt(self) -> float:
        """Tilt of a floating base [rad]."""
        if not self.simulation.floating:
            return 0.0
        return math.acos(min(1.0, rotation_from_quaternion(self.simulation.body.orientation)[2, 2]))


def move(shown: Shown, folder: Path) -> Found:
    """Let a robot stand, and move its base or its tip.

    Raises:
        SolferError: The robot cannot be used, or refuses to move.
    """
    urdf = find_robot(shown.source)
    srdf = folder_of(EXAMPLES) / shown.srdf if shown.srdf else None
    if shown.joints:
        srdf = folder / "state.srdf"
        srdf.write_text(state_srdf(Description.from_file(urdf).name, shown.joints))
    RobotSkeleton("shown", folder / "shown", urdf, srdf, shown.floating).write()
    bundle = read_bundle(folder / "shown/config/robots/shown/robot.yaml")
    simulation = Simulation.from_file(bundle)
    bus = Bus(robot_parameters(bundle))
    bus.every(STEP, SimulationServer(simulation, MemoryMiddleware(bus, "simulator")).cycle)
    name = "inverse_kinematics" if any(shown.way) else "joint_states"
    configuration = load(folder / "shown/config/shown.yaml", name)
    plugin = generate(configuration, MemoryMiddleware(bus, name), Registry().find(name))
    bus.every(1.0 / plugin.rate, plugin.cycle)
    bus.run_until(SETTLE)
    kinematics = simulation.kinematics
    task, link = ("base", kinematics.base_link) if shown.floating else ("tip", tip_of(kinematics.twin()))
    start = simulation.state.now.position(link).copy()
    if any(shown.way):
        values = (*shown.way, 0.0, 0.0, 0.0, 1.0) if shown.floating else shown.way
        reply = bus.call(f"{name}/reference", task=task, values=values, relative=True)
        bus.run_until(bus.time + 0.1)
        if not reply.result(0).success:
            raise SolferError(reply.result(0).message)
    bus.run_until(bus.time + MOVE)
    way = simulation.state.now.position(link) - start
    return Found(simulation, link, way, float(np.linalg.norm(way - shown.way)))


def drive(name: str, folder: Path) -> Found:
    """Put a quadruped on wheels, and let it drive forward and come to rest."""
    quadruped = wheeled_quadruped.ROBOTS[name]
    wheeled_quadruped.write(folder, name, quadruped, quadruped.steers, folder_of(EXAMPLES).parent)
    world = World(folder, "base: link", robot=folder / "robot.yaml")
    world.bus.every(PERIOD, world.cycle, cycles=True)
    world.run(SETTLE)
    base = world.driven.base
    start = world.simulation.state.now.position(base).copy()
    for _ in range(6):
        world.component.drive.receive(Twist(Vector(SPEED)))
        world.run(0.5)
    world.run(SETTLE)
    place, desired = world.simulation.state.now.position(base), world.component.references.position
    return Found(world.simulation, base, place - start, float(np.linalg.norm((place - desired)[:2])))


def draw(simulation: Simulation, picture: Path, yaw: float) -> None:
    """Write a JPEG of the robot as it is now."""
    with closing(Renderer(simulation.kinematics.description, simulation.kinematics.twin(), *SIZE, yaw=yaw)) as renderer:
        Image.fromarray(renderer.image(simulation.q)).save(picture, quality=QUALITY, optimize=True)


def show(name: str, picture: Path, figures: Figures) -> bool:
    """Let a robot move, write its picture and its line; return whether it is where it was to be.

    Raises:
        SolferError: The robot cannot be used, or refuses to move.
    """
    with tempfile.TemporaryDirectory() as folder:
        found = drive(WHEELED[name], Path(folder)) if name in WHEELED else move(ROBOTS[name], Path(folder))
        with closing(found.simulation) as simulation:
            draw(simulation, picture, ROBOTS[name].yaw if name in ROBOTS else 130.0)
            moved = ", ".join(f"{round(part, 3) + 0.0:g}" for part in found.way)
            tilt = math.degrees(found.tilt)
            dofs = simulation.kinematics.size
            figures.row(name, dofs=dofs, link=found.link, moved_m=moved, away_mm=1e3 * found.away, tilt_deg=tilt)
    return found.away <= NEAR and found.tilt <= TILTED


def main() -> int:
    """Draw the pictures; return the exit code."""
    parser = parser_of(__doc__)
    names = [*ROBOTS, *WHEELED]
    parser.add_argument("--robots", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names))
    place = Path("out/gallery")
    parser.add_argument("--folder", type=Path, default=place, help="of the pictures (default: %(default)s)")
    options = parser.parse_args()
    logging.disable(logging.WARNING)  # of files of others
    options.folder.mkdir(parents=True, exist_ok=True)
    failed = 0
    figures = Figures(options.json)
    for number, name in enumerate(options.robots, start=1):
        print(f"{number}/{len(options.robots)} {name}", file=sys.stderr, flush=True)
        try:
            failed += not show(name, options.folder / f"{name}.jpg", figures=figures)
        except SolferError as error:
            print(f"{name}: {error}", file=sys.stderr)
            failed += 1
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
