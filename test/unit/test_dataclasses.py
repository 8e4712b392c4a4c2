"""Dataclasses are frozen: whoever is handed one can rely on it, also where it is the default of an argument."""

import ast
from pathlib import Path

import pytest

PACKAGES = Path(__file__).resolve().parents[2] / "src"
CHANGED = {
    "solfer_tools/cli/allocations/meter.py": {"LineCost"},
    "solfer/components/trajectories/follower.py": {"_Course"},
    "solfer/components/wheeled_motion/support/step.py": {"Step"},
    "solfer/components/wheeled_motion/targets.py": {"Stream"},
    "solfer/config/loading/check.py": {"CheckReport"},
    "solfer_tools/demo/record.py": {"Trace"},
    "solfer_tools/demo/story.py": {"Show"},
    "solfer/middleware/memory/bus.py": {"_Entry"},
    "solfer/middleware/ros/topic_publisher.py": {"SendBacklog"},
    "solfer/middleware/shared_memory/rpc/calls.py": {"_PendingCall"},
    "solfer/middleware/shared_memory/rpc/services.py": {"_Call"},
    "solfer/numerics/solvers/qp.py": {"Problem"},
    "solfer/realtime/schedule.py": {"Schedule"},
    "solfer_tools/replay/replay.py": {"Replay"},
    "solfer/transport/messages.py": {
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
    found = {str(path.relative_to(PACKAGES)): changeable(path.read_text()) for path in sorted(PACKAGES.rglob("*.py"))}
    assert {file: names for file, names in found.items() if names} == CHANGED
