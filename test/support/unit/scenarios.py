"""Scenario files that tests write."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from solfer_tools.scenarios import Scenario, read_scenario

RELATIVE = """
    base now: [0.0, 0.0, 0.0, 0.0]
    base_const_vel: [0.0, 0.0, 0.0, 0.0]
    vel: 0.1
    dt: 0.01
    x cp: [0.0, 0.0, 0.0, 0.0]
    y cp: [0.0, 0.0, 0.0, 0.0]
    z cp: [0.0, 0.0, 0.0, 0.0]
    x cp ref:
      - [0.0, 0.0, 0.0, 0.0]
      - [0.1, 0.1, -0.1, -0.1]
    y cp ref:
      - [0.0, 0.0, 0.0, 0.0]
    z cp ref:
      - [0.0, 0.0, 0.0, 0.0]
    base ref:
      - [0.0, 0.0, 0.0, 0.0]
      - [1.0, 0.0, 0.0, 0.0]
    cs ref:
      - [0.1, -0.1, 0.1, -0.1]
    pattern:
      1:
        type: speed
        motions:
          - [3, 0, 0.25]
      2:
        type: move
        x_cp: 1
        y_cp: 0
        z_cp: 0
        base: 1
        cs: 0
      3:
        type: wait
        steps: 10
"""
"""A file that is relative: a change of speed, a move and a pause."""


def text_of(old: str = "", new: str = "") -> str:
    """Return the text of RELATIVE, with one part replaced."""
    text = textwrap.dedent(RELATIVE).lstrip()
    assert old in text
    return text.replace(old, new, 1)


def made(folder: Any, pattern: Sequence[Mapping[str, Any]], legs: int = 4, **keys: Any) -> Scenario:
    """Write and read a scenario with a pattern; `keys` are those of the file, with `_` for each space."""
    zeros = [0.0] * legs
    content: dict[str, Any] = {
        "base now": [0.0] * 4, "vel": 0.1, "dt": 0.01, "x cp": zeros, "y cp": zeros, "z cp": zeros,
        "x cp ref": [zeros], "y cp ref": [zeros], "z cp ref": [zeros], "base ref": [[0.0] * 4],
    }  # fmt: skip
    for key, value in keys.items():
        content[key if key == "base_const_vel" else key.replace("_", " ")] = value
    path = folder / "scenario.yaml"
    path.write_text(yaml.safe_dump(content | {"pattern": dict(enumerate(pattern, 1))}, sort_keys=False))
    return read_scenario(path)
