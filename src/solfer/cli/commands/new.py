"""Make the first files of a component of your own.

`solfer new component NAME` makes a catkin package: a component that swings a joint of CENTAURO, a configuration, a
launch file, and a test that passes at once and needs no ROS master. Change the component from there.
"""

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    kinds = parser.add_subparsers(metavar="KIND", required=True)
    summary = "a catkin package with a component, its configuration, a launch file and a test"
    component = kinds.add_parser("component", help=summary, description=f"Make {summary}.")
    component.add_argument("name", metavar="NAME", help="name of the component, such as `swing_joint`")
    component.add_argument(
        "--package",
        type=Path,
        metavar="DIR",
        help="folder to make; its last part is the package's name (default: NAME, here)",
    )


def run(options: argparse.Namespace) -> int:
    """Write the files and print the next steps.

    Raises:
        SolferError: A name cannot be used, or the folder exists or cannot be written.
    """
    from solfer.cli.skeleton import Skeleton

    folder = options.package or Path(options.name)
    skeleton = Skeleton(options.name, folder)
    skeleton.write()
    print(f"{folder} is a catkin package now, with the component {skeleton.target}.\n")
    print(f"  python3 -m pytest {folder}")
    print("      tries it on a simulated CENTAURO in one process")
    print(f"  solfer check {folder}/config/{options.name}.yaml")
    print("      checks its configuration")
    print(f"  roslaunch {skeleton.package} {options.name}.launch")
    print(
        "      runs it under ROS, once your workspace is built (catkin_make) and sourced; with layer:=RT in real time"
    )
    return 0
