"""The files of a small robot and of plugins on it, in which every tag of the configuration has something to change."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from solfer.config.yaml.compose import LOADER
from solfer.model import Description
from solfer.model.urdf.cut import cut

DATA = Path(__file__).parents[2] / "data" / "walk"
FILES = {path.stem: yaml.load(path.read_text(), LOADER) for path in DATA.glob("*.yaml") if path.stem != "changes"}
FILES["fixed"] = FILES["bundle"] | {"floating_base": False}
URDF = (DATA / "cart.urdf").read_text()
SRDF = (DATA / "cart.srdf").read_text()

ROBOT = {
    "urdf.urdf": URDF,
    "bare.urdf": URDF.replace('effort="40"', 'effort="20"'),
    "other.urdf": cut(Description.from_text(URDF), "hand", "lower"),
    "smaller.urdf": cut(Description.from_text(URDF), "arm", "lower"),
    "srdf.srdf": SRDF,
    "other.srdf": SRDF.replace('value="0.2"', 'value="0.3"'),
    "way.csv": "0.5,0.1,0,0.1,0,0,0,1\n",
    "other_way.csv": "0.5,0,0,0.2,0,0,0,1\n",
}
"""Texts by file: descriptions of the robot, and of another one with fewer joints, and ways of its hand."""


def write(folder: Path, changes: Mapping[str, Any]) -> None:
    """Write all files with changes, and remove others.

    Args:
        folder: Where to write.
        changes: Values by their path, `file/key/key`, or without a file below `mwoibn` of the main one; None removes.
    """
    for path in folder.glob("*.yaml"):
        path.unlink()
    for name, text in ROBOT.items():
        (folder / name).write_text(text)
    np.save(folder / "hill", [[0.0, 0.1], [0.2, 0.5]])
    (folder / "soft").mkdir(exist_ok=True)
    files = FILES
    for place, value in changes.items():
        keys = place.split("/")
        in_main = keys[0] in FILES["main"]["mwoibn"]
        files = _put(files, ["main", "mwoibn", *keys] if in_main else keys, value)
    for name, content in files.items():
        (folder / f"{name}.yaml").write_text(json.dumps(content))


def _put(tree: Any, path: list[str], value: Any) -> Any:
    key, *rest = path
    copy = dict(tree or {})
    if rest:
        copy[key] = _put(copy.get(key), rest, value)
    elif value is None:
        copy.pop(key, None)
    else:
        copy[key] = value
    return copy
