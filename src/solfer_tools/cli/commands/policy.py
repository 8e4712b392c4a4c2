"""Check that a trained network fits its contract and a robot.

`solfer policy check FILE --robot BUNDLE` prints what the component `policy` would do with a network: its sizes, the
terms of its observations, and its joints with their gains. FILE is the network, if its metadata have everything, or a
main configuration, of which -n names the module. What does not fit is an error, and the exit code is 2.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_search_paths


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    check = actions.add_parser("check", help="check a network", description="Check that a network fits a robot.")
    check.add_argument("file", metavar="FILE", help="the ONNX file, or a main configuration")
    check.add_argument("--robot", required=True, metavar="BUNDLE", help="a shipped robot, or the file of a bundle")
    check.add_argument("-n", dest="name", default="policy", metavar="NAME", help="the module (default: policy)")
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
    from solfer.robot import Robot
    from solfer.robot.description.shipped import robot_of

    file = Path(options.file)
    if file.suffix == ".onnx":
        tags = PolicyTags(file=str(file.absolute()))
    else:
        tags = load(options.file, options.name, search_paths=options.search_paths).tags(PolicyTags)
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
    return 0
