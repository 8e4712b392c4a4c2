"""Make the first files of a component or of a robot of your own.

`solfer new component NAME` makes a catkin package: a component that swings a joint of CENTAURO, a configuration, a
launch file, and a test that passes at once and needs no ROS master. Change the component from there. With `--cpp` it is
in C++, in a library of its own, and the test compares it with its twin in Python.

`solfer new robot NAME --urdf FILE` makes one for a robot: the file that describes it, a configuration with one plugin
that moves its joints, a launch file, and a test that simulates it. `--from COLLECTION:NAME` takes a robot of
example-robot-data, pybullet_data, robot_descriptions or MuJoCo's menagerie instead, `--from FILE.xml` one that MJCF
describes, which becomes a URDF.
"""

import argparse
import logging
from pathlib import Path

from solfer.cli.options import add_robot_files

logger = logging.getLogger(__name__)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    kinds = parser.add_subparsers(metavar="KIND", required=True)
    summary = "a catkin package with a component, its configuration, a launch file and a test"
    component = kinds.add_parser("component", help=summary, description=f"Make {summary}.")
    component.add_argument("name", metavar="NAME", help="name of the component, such as `swing_joint`")
    component.add_argument(
        "--cpp", action="store_true", help="in C++, with a twin in Python that the test compares it with"
    )
    component.set_defaults(write=_write_component)
    summary = "a catkin package with a robot, a configuration with one plugin, a launch file and a test"
    robot = kinds.add_parser("robot", help=summary, description=f"Make {summary}.")
    robot.add_argument("name", metavar="NAME", help="name of the robot, such as `my_robot`")
    add_robot_files(robot, source=True)
    robot.add_argument(
        "--floating-base", action="store_true", default=None, help="let the base float (default: as in the URDF)"
    )
    robot.set_defaults(write=_write_robot)
    for kind in (component, robot):
        kind.add_argument(
            "--package",
            type=Path,
            metavar="DIR",
            help="folder to make; its last part is the package's name (default: NAME, here)",
        )


def run(options: argparse.Namespace) -> int:
    """Write the files and print the next steps.

    Raises:
        SolferError: A name or a file cannot be used, or the folder exists or cannot be written.
    """
    options.write(options.name, options.package or Path(options.name), options)
    return 0


def _write_component(name: str, folder: Path, options: argparse.Namespace) -> None:
    from solfer_tools.cli.skeletons.component import ComponentSkeleton

    skeleton = ComponentSkeleton(name, folder, options.cpp)
    skeleton.write()
    print(f"{folder} is a catkin package now, with the component {skeleton.target}.\n")
    test = "tries it on a simulated CENTAURO in one process"
    _print_steps(name, folder, skeleton.package, test=f"builds it, and {test}" if options.cpp else test)
    print("      with layer:=RT in real time")


def _write_robot(name: str, folder: Path, options: argparse.Namespace) -> None:
    from solfer.errors import ModelError
    from solfer.simulation.mujoco.mjcf import convert_mjcf, is_mjcf
    from solfer_tools.cli.skeletons.collections import find_robot
    from solfer_tools.cli.skeletons.robot import RobotSkeleton

    urdf = options.urdf if options.source is None else find_robot(options.source)
    srdf = options.srdf
    made: dict[str, bytes] = {}
    if is_mjcf(urdf):
        if options.source is None:
            raise ModelError("the file is MJCF, not URDF", where=f"--urdf {urdf}", expected=f"--from {urdf}")
        made = convert_mjcf(urdf, name)
        urdf = Path(f"{name}.urdf")
        states = Path(f"{name}.srdf")
        if states.name in made and srdf is None:
            srdf = states
        elif states.name in made:
            del made[states.name]
            logger.warning("%s: its keyframes and excluded contacts are left out: --srdf has those", options.source)
    skeleton = RobotSkeleton(name, folder, urdf, srdf=srdf, floating_base=options.floating_base, made=made)
    skeleton.write()
    _simulate(skeleton.bundle)
    print(f"{folder} is a catkin package now, with the robot {name} of {skeleton.dofs} DoFs.\n")
    _print_steps(
        name, folder, skeleton.package, test="simulates the robot, and moves one of its joints, in one process"
    )


def _simulate(bundle: Path) -> None:
    """Warn of a robot that the simulation refuses, or that does not keep its posture; hardware may use the package."""
    from solfer.errors import SolferError
    from solfer.simulation.trial import simulate_for_a_second

    try:
        wrong = simulate_for_a_second(bundle)
    except SolferError as error:
        wrong = f"the simulation refuses this robot: {error}"
    if wrong:
        logger.warning("%s", wrong)


def _print_steps(name: str, folder: Path, package: str, test: str) -> None:
    print(f"  python3 -m pytest {folder}")
    print(f"      {test}")
    print(f"  solfer check {folder}/config/{name}.yaml")
    print("      checks its configuration")
    print(f"  roslaunch {package} {name}.launch")
    print("      runs it under ROS, once your workspace is built (catkin_make) and sourced")
