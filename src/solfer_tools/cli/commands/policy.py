"""Check that a trained network fits its contract and a robot.

`solfer policy check FILE --robot BUNDLE` prints what the component `policy` would do with a network: its sizes, the
terms of its observations, and its joints with their gains. FILE is the network, if its metadata have everything, or a
main configuration, of which -n names the module. `--rollout` lets the plugin of a main configuration move its robot in
memory, with one commanded velocity after the other. What does not fit, a robot that falls, and one that does not reach
a velocity are errors, and the exit code is 2.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from solfer.cli.options import Number, add_search_paths

if TYPE_CHECKING:
    from solfer.config import Configuration


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    check = actions.add_parser("check", help="check a network", description="Check that a network fits a robot.")
    check.add_argument("file", metavar="FILE", help="the ONNX file, or a main configuration")
    check.add_argument("--robot", required=True, metavar="BUNDLE", help="a shipped robot, or the file of a bundle")
    check.add_argument("-n", dest="name", default="policy", metavar="NAME", help="the module (default: policy)")
    check.add_argument(
        "--rollout", type=Number(2, 1000, "s", int), metavar="SECONDS", help="simulate it, so long for each command"
    )
    check.add_argument(
        "--command",
        type=Number(-10.0, 10.0, "m/s, rad/s", zero=True),
        nargs=3,
        action="append",
        metavar=("X", "Y", "YAW"),
        help="a commanded velocity of the rollout; may stand several times (default: both ways along x, y and about z)",
    )
    check.add_argument(
        "--push",
        type=Number(0.01, 10.0, "m/s", zero=True),
        default=0.0,
        metavar="SPEED",
        help="push the robot of the rollout in every second second, to its left and right in turns (default: 0 m/s)",
    )
    add_search_paths(check)


def run(options: argparse.Namespace) -> int:
    """Check and print.

    Raises:
        SolferError: The network does not fit.
    """
    from solfer.cli.columns import aligned
    from solfer.components.policy import Policy, PolicyTags
    from solfer.components.policy.contract import widths
    from solfer.config import load
    from solfer.errors import ComponentError
    from solfer.robot import Robot
    from solfer.robot.description.shipped import robot_of

    file = Path(options.file)
    configuration = None
    if file.suffix == ".onnx":
        tags = PolicyTags(file=str(file.absolute()))
        if options.rollout:
            raise ComponentError("--rollout of a network alone", expected="a main configuration with its plugin")
    else:
        configuration = load(options.file, options.name, search_paths=options.search_paths)
        tags = configuration.tags(PolicyTags)
    name, files = robot_of(options.robot)
    robot = Robot.load(files.urdf, files.srdf, files.floating_base, name=name, others=files.others)
    component = Policy(robot, tags, options.name)
    contract = component.contract
    network = component.network
    states = ", ".join(network.states) or "none"
    print(f"{tags.file}: {len(network.observations)} observations, {len(network.actions)} actions, states: {states}\n")
    sizes = widths(contract.terms, len(contract.joints))
    rows = [(name, str(size), str(term.history)) for (name, size), term in zip(sizes, contract.terms, strict=True)]
    print("\n".join(aligned([("term", "numbers", "history"), *rows])), end="\n\n")
    gains = [contract.gains.get(name, [None] * len(contract.joints)) for name in ("stiffness", "damping")]
    table = zip(contract.joints, contract.default, contract.scale, *gains, strict=True)
    cells = [(name, *("lower level's" if each is None else f"{each:g}" for each in others)) for name, *others in table]
    print("\n".join(aligned([("joint", "default", "scale", "stiffness", "damping"), *cells])))
    if configuration is not None and options.rollout:
        _roll_out(configuration, options)
    return 0


def _roll_out(configuration: "Configuration", options: argparse.Namespace) -> None:
    """Simulate the plugin, and print a row for each second."""
    from solfer.cli.columns import aligned
    from solfer.robot.description.shipped import RobotFiles
    from solfer_tools.cli.policy_rollout import COMMANDS, rollout

    path = Path(options.robot)
    given = RobotFiles(path) if path.is_file() else None
    rows: list[tuple[str, ...]] = [
        ("command", "ahead [m/s]", "left [m/s]", "turn [rad/s]", "distance [m]", "tilt [rad]")
    ]
    try:
        commands = options.command or COMMANDS
        for row in rollout(configuration, given, commands, seconds=options.rollout, push=options.push):
            numbers = (f"{each:.2f}" for each in (*row.velocity, row.distance, row.tilt))
            rows.append((" ".join(f"{each:g}" for each in row.command), *numbers))
    finally:  # also what came before the end of one that falls
        if len(rows) > 1:
            print("\n" + "\n".join(aligned(rows)))
