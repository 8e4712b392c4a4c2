"""Dataclasses are frozen: whoever is handed one can rely on it, also where it is the default of an argument."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "solfer"
CHANGED = {
    "cli/allocations/meter.py": {"LineCost"},
    "components/trajectories/follower.py": {"_Course"},
    "components/wheeled_motion/targets.py": {"Stream"},
    "config/loading/check.py": {"CheckReport"},
    "demo/record.py": {"Trace"},
    "demo/story.py": {"Show"},
    "middleware/memory/bus.py": {"_Entry"},
    "middleware/ros/topic_publisher.py": {"SendBacklog"},
    "middleware/shared_memory/rpc/calls.py": {"_PendingCall"},
    "middleware/shared_memory/rpc/services.py": {"_Call"},
    "numerics/solvers/qp.py": {"Problem"},
    "realtime/schedule.py": {"Schedule"},
    "replay/replay.py": {"Replay"},
    "transport/messages.py": {
        "BodyMessage",
        "FieldsMessage",
        "ImuMessage",
        "JointMessage",
        "PointsMessage",
        "RefusalMessage",
        "VectorMessage",
        "WrenchMessage",
    },
}
"""Those that are filled or counted in after they were made, by their file."""


def changeable(text: str) -> set[str]:
    """Return the names of the dataclasses in a module's text that are not frozen."""
    found = set()
    for node in ast.walk(ast.parse(text)):
        for each in node.decorator_list if isinstance(node, ast.ClassDef) else ():
            options = {option.arg: ast.unparse(option.value) for option in getattr(each, "keywords", ())}
            name = ast.unparse(each.func if isinstance(each, ast.Call) else each)
            if name.split(".")[-1] == "dataclass" and options.get("frozen") != "True":
                found.add(node.name)
    return found


@pytest.mark.slow
def test_dataclasses_are_frozen():
    found = {str(path.relative_to(PACKAGE)): changeable(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}
    assert {file: names for file, names in found.items() if names} == CHANGED


@pytest.mark.parametrize(
    ("decorator", "names"),
    [
        ("dataclass", {"A"}),
        ("dataclasses.dataclass(order=True)", {"A"}),
        ("dataclass(frozen=False)", {"A"}),
        ("dataclass(frozen=True)", set()),
        ("final", set()),
    ],
)
def test_a_changeable_dataclass_is_found(decorator, names):
    assert changeable(f"@{decorator}\nclass A:\n    x: int\n") == names
