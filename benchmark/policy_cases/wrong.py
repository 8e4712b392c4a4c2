"""Contracts with a wrong order of the legs or a wrong sign of a joint, and what `solfer policy check` says of them."""

from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from copy import deepcopy
from io import StringIO
from itertools import chain, permutations
from pathlib import Path
from typing import Any

import yaml
from policy_cases.robots import WalkingRobot

from solfer_tools.cli.main import main as solfer

SECONDS = 4
"""How long a rollout has each of its commands [s]."""


def wrong_orders(robot: WalkingRobot) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a title and a contract for each order of the legs but the right one; the names alone are wrong.

    Of two legs there is one, and then each of their joints is exchanged alone.
    """
    orders = {f"legs {order}": [robot.legs[leg] for leg in order] for order in permutations(range(len(robot.legs)))}
    for title, legs in list(orders.items())[1:]:
        yield title, _renamed(robot, dict(zip(chain(*robot.legs), chain(*legs), strict=True)))
    if len(robot.legs) == 2:
        for left, right in zip(*robot.legs, strict=True):
            yield f"{left} for {right}", _renamed(robot, {left: right, right: left})


def _renamed(robot: WalkingRobot, names: dict[str, str]) -> dict[str, Any]:
    contract = deepcopy(robot.contract)
    contract["joints"] = [names.get(joint, joint) for joint in robot.joints]
    return contract


def wrong_signs(robot: WalkingRobot) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a title and a contract for each leg's joint whose sign is wrong: as observed, as acted on, and as both."""
    count = len(robot.joints)
    for joint in chain(*robot.legs):
        number = robot.joints.index(joint)
        signs = [-1.0 if each == number else 1.0 for each in range(count)]
        for what in ("observed", "acted on", "both"):
            contract = deepcopy(robot.contract)
            if what != "acted on":
                for term in contract["observations"]:
                    if term["term"] in ("joint_position", "joint_velocity"):
                        term["scale"] = [term.get("scale", 1.0) * sign for sign in signs]
            if what != "observed":
                scale = contract["action"]["scale"]
                scale = scale if isinstance(scale, list) else count * [scale]
                contract["action"]["scale"] = [each * sign for each, sign in zip(scale, signs, strict=True)]
            if what == "both":
                contract["default"][number] *= -1.0
            yield f"sign of {joint}, {what}", contract


def checked(file: Path, contract: dict[str, Any], push: float) -> tuple[int, str]:
    """Return exit code and error of the check of a configuration with another contract, and with pushes [m/s]."""
    tree = yaml.safe_load(file.read_text())
    module = tree["mwoibn"]["modules"]["policy"]
    springs = module["action"]["springs"]
    module |= contract | {"action": contract["action"] | {"springs": springs}}
    changed = file.with_name("wrong.yaml")
    changed.write_text(yaml.safe_dump(tree, sort_keys=False))
    bundle = file.parent / f"robots/{file.stem}/robot.yaml"
    words = ["policy", "check", str(changed), "--robot", str(bundle), "--rollout", str(SECONDS)]
    words += ["--push", str(push)]
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as error:
        code = solfer(words)
    return code, error.getvalue().strip().partition("\n")[0].partition(": policy: ")[2]
