"""Contracts with a wrong order of the legs or a wrong sign of a joint, and what `solfer policy check` says of them."""

from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from copy import deepcopy
from io import StringIO
from itertools import permutations
from pathlib import Path
from typing import Any

import yaml
from policy_cases.robots import WalkingRobot

from solfer_tools.cli.main import main as solfer

SECONDS = 4
"""How long a rollout has each of its commands [s]."""

PUSH = 0.6
"""Speed that its pushes give the robot [m/s]."""


def wrong_orders(robot: WalkingRobot, legs: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a title and a contract for each order of the legs but the right one; the names alone are wrong."""
    size = len(robot.joints) // legs
    parts = [robot.joints[leg * size : (leg + 1) * size] for leg in range(legs)]
    for order in list(permutations(range(legs)))[1:]:
        contract = deepcopy(robot.contract)
        contract["joints"] = [joint for leg in order for joint in parts[leg]]
        yield f"legs {order}", contract


def wrong_signs(robot: WalkingRobot) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield a title and a contract for each joint whose sign is wrong: as observed, as acted on, and as both."""
    count = len(robot.joints)
    for number, joint in enumerate(robot.joints):
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


def checked(file: Path, contract: dict[str, Any]) -> tuple[int, str]:
    """Return exit code and error of the check of a configuration with another contract."""
    tree = yaml.safe_load(file.read_text())
    module = tree["mwoibn"]["modules"]["policy"]
    springs = module["action"]["springs"]
    module |= contract | {"action": contract["action"] | {"springs": springs}}
    changed = file.with_name("wrong.yaml")
    changed.write_text(yaml.safe_dump(tree, sort_keys=False))
    bundle = file.parent / f"robots/{file.stem}/robot.yaml"
    words = ["policy", "check", str(changed), "--robot", str(bundle), "--rollout", str(SECONDS)]
    words += ["--push", str(PUSH)]
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as error:
        code = solfer(words)
    return code, error.getvalue().strip().partition("\n")[0].partition(": policy: ")[2]
