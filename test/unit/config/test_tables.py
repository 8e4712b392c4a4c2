"""Kinds of pipes and middlewares stand in one table each, and nothing else knows their names."""

import ast
from pathlib import Path

import pytest
import yaml

from solfer.config import load
from solfer.config.kinds.table import KINDS
from solfer.config.records.middlewares import MIDDLEWARES
from solfer.config.records.pipes import HOMES
from solfer.pipes.kinds import PIPE_KINDS as PIPES

PACKAGE = Path(__file__).resolve().parents[3] / "src" / "solfer"
TABLE = {"config/records/middlewares.py"}


def words_in(path) -> set[str]:
    """Texts of a file that are whole words, outside of docstrings."""
    return {
        node.value for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Constant)
        if isinstance(node.value, str)
    }  # fmt: skip


def users(words, *homes) -> dict[str, set[str]]:
    """Source files outside of their table and `homes` that contain one of the words."""
    found = {str(path.relative_to(PACKAGE)): words_in(path) & set(words) for path in PACKAGE.rglob("*.py")}
    return {path: words for path, words in found.items() if words and path not in TABLE and not path.startswith(homes)}


@pytest.mark.slow
def test_only_its_home_knows_a_kind():
    assert users(HOMES, *(f"{folder}/{home}" for home in HOMES.values() for folder in ("config/kinds", "pipes"))) == {
        "config/records/pipes.py": set(HOMES),  # the table
        "robot/contact_pipes.py": {"CONTACT"},
    }


@pytest.mark.slow
def test_only_the_table_names_middlewares():
    assert users({*MIDDLEWARES, "ros", "xbot"}) == {}


def test_the_table_of_pipes_is_that_of_records():
    assert list(PIPES) == list(KINDS) == list(HOMES)
    for space, kind in PIPES.items():
        assert kind.space == space and kind.records is KINDS[space]
        assert kind.feedback.__module__ == kind.controller.__module__ == f"solfer.pipes.{HOMES[space]}.factory"


@pytest.mark.parametrize("middleware", MIDDLEWARES.values(), ids=MIDDLEWARES)
def test_each_middleware_has_its_section(tmp_path, middleware):
    """A minimal configuration is made from the table alone, so a new middleware needs no other change."""
    joints = {"space": "JOINT", "function": "state", "interface": {"position": True}}
    joints["dofs"] = {"chain": "all", "type": "all", "mapping": "RBDL"}
    here = {"source": "joints", "message": "sensor_msgs/JointState", "timeout": 0.5}
    robot = {"feedback": {"list": ["joints"]}, "actuators": {"read": False}, "contacts": {"read": False}}
    switches = dict.fromkeys(("kinematics", "dynamics", "model_change"), False)
    root = {
        "middleware": middleware.name,
        "system": "SM",
        "robot": {"name": "r", "rate": 100.0, "one": robot},
        "feedback": {"joints": joints},
        "controllers": {"none": []},
        middleware.section: {"source": {"urdf": "robot_description"}, "feedback": {"joints": here}},
        "modules": {"m": {"layer": middleware.layer, "mode": "idle", "robot": "one", "controller": "none", **switches}},
    }
    if not middleware.named:
        root[middleware.section]["feedback"]["joints"]["layer"] = "RT"
    file = tmp_path / "main.yaml"
    file.write_text(yaml.safe_dump({"mwoibn": root}))
    (pipe,) = load(file, "m").feedbacks
    assert (pipe.source, pipe.timeout, pipe.function) == ("joints", 0.5, "state")
