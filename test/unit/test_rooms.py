"""The rooms of docs/explanation/architecture.md, as far as import-linter does not check them."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # pytest brings it along

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize(("contract", "package"), [("rooms", "solfer"), ("tools", "solfer_tools")])
def test_the_order_is_that_of_the_architecture_page(contract, package):
    text = (REPOSITORY / "docs/explanation/architecture.md").read_text()
    text = text.split(f"| room in `src/{package}/` |")[1].split("\n\n")[0]
    table = [
        row.rstrip("/").removesuffix(".py").replace("/", ".")
        for row in re.findall(r"^\| `([\w./]+)` \|", text, re.MULTILINE)
    ]
    contracts = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (rooms,) = (each["layers"] for each in contracts if each["id"] == contract)
    assert table == rooms[::-1] and len(table) > 10


def test_generated_messages_stop_where_ros_does():
    """Import-linter does not see `solfer.msg` and `solfer.srv`, which catkin makes."""
    statement, package = (
        re.compile(r"^\s*(?:from|import) solfer\.(?:msg|srv)\b", re.MULTILINE),
        REPOSITORY / "src",
    )
    files = {path for path in package.rglob("*.py") if statement.search(path.read_text())}
    room = package / "solfer/middleware/ros"
    assert files and all(room in path.parents for path in files - {package / "solfer/ros_statistics.py"})


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
    holders = [str(path.relative_to(REPOSITORY)) for path in shipped_files() if machine.search(path.read_bytes())]
    assert holders == []
