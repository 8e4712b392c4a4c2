"""The rooms of docs/architecture.md: who may import whom, where third parties stop, and how long a file may be."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
PACKAGE = REPOSITORY / "src" / "solfer"

ROOMS = (
    "errors.py",
    "throttle.py",
    "supervision.py",
    "numerics",
    "config",
    "scenarios",
    "recording",
    "model",
    "dynamics",
    "points",
    "robot",
    "tasks",
    "components",
    "transport",
    "navigation",
    "pipes",
    "plugins",
    "replay",
    "lower_level",
    "middleware/memory",
    "middleware/shared_memory",
    "realtime",
    "middleware/ros",
    "middleware/bridge",
    "simulation",
    "demo",
    "cli",
)
"""From top to bottom, as in the table: a room imports only from itself and from those before it."""

APART = ("solfer.plugins", "solfer.middleware", "solfer.simulation")
NODES = "nodes"
ROS = frozenset({"middleware/ros"})
BORDERS = {
    "yaml": frozenset({"config"}),
    "mcap": frozenset({"recording"}),
    "zstandard": frozenset({"recording"}),
    "rosbags": frozenset({"recording"}),
    "numba": frozenset({"numerics", "points"}),
    "mmap": frozenset({"middleware/shared_memory", "realtime"}),
    "fcntl": frozenset({"middleware/shared_memory"}),
    "pybullet": frozenset({"simulation"}),
    "pybullet_data": frozenset({"simulation"}),
    "pinocchio": frozenset({"numerics", "model", "lower_level"}),
    "solfer.msg": ROS,
    "solfer.srv": ROS,
    **dict.fromkeys(
        "rospy roslib rosgraph rosnode rosparam rosservice roslaunch rostopic genpy tf tf2_ros tf2_msgs "
        "actionlib_msgs diagnostic_msgs geometry_msgs nav_msgs rosgraph_msgs sensor_msgs std_msgs std_srvs".split(),
        ROS,
    ),
}
"""Modules that only some rooms may import."""

SOURCES = sorted(PACKAGE.rglob("*.py"))
LONGEST = 400  # [lines]


def room_of(name: str) -> str | None:
    """Return the room of a dotted module name; None for the package itself and the folder of middlewares."""
    parts = name.split(".")[1:]
    for room in ROOMS:
        path = room.removesuffix(".py").split("/")
        if parts[: len(path)] == path:
            return room
    return None


def module_name(path: Path) -> str:
    """Return the dotted name of a source file."""
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(tree: ast.AST, module: str, is_package: bool) -> set[str]:
    """Dotted names of all that is imported, wherever the statement stands; `from a import b` yields `a.b`."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            package = module.split(".") if is_package else module.split(".")[:-1]
            base = package[: len(package) - node.level + 1] if node.level else []
            start = ".".join([*base, *([node.module] if node.module else [])])
            names.update(f"{start}.{alias.name}" for alias in node.names)
    return names


def imports_of_file(path: Path) -> set[str]:
    """As `imports_of`, of a source file."""
    return imports_of(ast.parse(path.read_text()), module_name(path), path.name == "__init__.py")


def broken_order(room: str | None, imported: set[str]) -> list[str]:
    """List imports that lead to a room further down."""
    allowed = ROOMS[: ROOMS.index(room) + 1] if room else ()
    inside = (name for name in imported if name.split(".")[0] == "solfer" and name not in BORDERS)
    return sorted(name for name in inside if room_of(name) is not None and room_of(name) not in allowed)


def broken_borders(room: str | None, imported: set[str]) -> list[str]:
    """List imports of third parties that belong to other rooms."""
    return sorted(
        name
        for name in imported
        for module, rooms in BORDERS.items()
        if (name == module or name.startswith(module + ".")) and room not in rooms
    )


def shown(path: Path) -> str:
    """Return the path from the repository on."""
    return str(path.relative_to(REPOSITORY))


def offenders(broken: dict[str, list[str]]) -> dict[str, list[str]]:
    """Return the files with something broken, and what it is."""
    return {path: names for path, names in broken.items() if names}


IMPORTS = tuple((path, module_name(path), imports_of_file(path)) for path in SOURCES)
"""Each source file, its dotted name, and what it imports."""


def test_the_order_is_that_of_the_architecture_page():
    text = (REPOSITORY / "docs" / "architecture.md").read_text()
    text = text.split("## Rooms")[1].split("\n## ")[0]
    table = [row.rstrip("/") for row in re.findall(r"^\| `([\w./]+)` \|", text, re.MULTILINE)]
    assert [name for name in table if name != NODES] == list(ROOMS)


def test_a_room_imports_only_from_rooms_above_it():
    broken = {shown(path): broken_order(room_of(name), imported) for path, name, imported in IMPORTS}
    assert offenders(broken) == {}


MEETING = {"src/solfer/cli/allocations/standing_robot.py"}
"""What offers a simulated robot in memory to `solfer check --allocations`."""


def test_plugins_middlewares_and_the_simulation_meet_only_in_nodes():
    met = {
        shown(path): sorted({full.split(".")[1] for full in (name, *imported) if full.startswith(APART)})
        for path, name, imported in IMPORTS
    }
    assert {path for path, rooms in met.items() if len(rooms) > 1} == MEETING


def test_third_parties_stop_at_the_border_of_their_room():
    broken = {shown(path): broken_borders(room_of(name), imported) for path, name, imported in IMPORTS}
    assert offenders(broken) == {}


def test_a_source_file_belongs_to_a_room():
    homeless = [shown(path) for path, name, _ in IMPORTS if path.name != "__init__.py" and room_of(name) is None]
    assert homeless == [], "not in a row of the table in docs/architecture.md"


@pytest.mark.parametrize(
    ("statement", "broken"),
    [
        ("from solfer.plugins import Plugin", ["solfer.plugins.Plugin"]),
        ("from solfer import plugins", ["solfer.plugins"]),
        ("from ..plugins.loop import run", ["solfer.plugins.loop.run"]),
        ("def late():\n    import solfer.cli", ["solfer.cli"]),
        ("from solfer.robot import Robot", []),
        ("from . import messages", []),
    ],
)
def test_the_order_is_checked_for_every_kind_of_import(statement, broken):
    imported = imports_of(ast.parse(statement), "solfer.pipes.dofs", is_package=False)
    assert broken_order("pipes", imported) == broken


@pytest.mark.parametrize("statement", ["import yaml", "from yaml import nodes", "from solfer.msg import JointCommand"])
def test_borders_are_checked_for_every_kind_of_import(statement):
    imported = imports_of(ast.parse(statement), "solfer.pipes.dofs", is_package=False)
    assert len(broken_borders("pipes", imported)) == 1


def code_files() -> list[Path]:
    """Python files of the package and the tests, and the nodes, which have no ending."""
    files = [path for folder in ("src", "test") for path in (REPOSITORY / folder).rglob("*.py")]
    return sorted(files + [path for path in (REPOSITORY / NODES).iterdir() if path.is_file()])


def test_no_file_is_longer_than_400_lines():
    lines = {shown(path): len(path.read_text().splitlines()) for path in code_files()}
    assert {path: count for path, count in lines.items() if count > LONGEST} == {}


def is_made(path: Path) -> bool:
    """Whether a path, relative to the repository, is hidden or made by a build."""
    return any(part in ("build", "out", "__pycache__") or part.startswith(".") for part in path.parts)


def shipped_files() -> list[Path]:
    """List what git tracks; without git, as in an unpacked archive, all files outside hidden and built folders."""
    git = subprocess.run(["git", "ls-files", "-z"], cwd=REPOSITORY, capture_output=True, text=True, check=False)
    if git.returncode == 0:
        return [path for name in git.stdout.split("\0") if name and (path := REPOSITORY / name).is_file()]
    return [path for path in REPOSITORY.rglob("*") if path.is_file() and not is_made(path.relative_to(REPOSITORY))]


def test_no_shipped_file_holds_a_path_of_one_machine():
    machine = re.compile(rb"(?<![\w.$}/])/(home|root|Users|work)/\w")
    holders = [shown(path) for path in shipped_files() if machine.search(path.read_bytes())]
    assert holders == []
