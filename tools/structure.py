#!/usr/bin/env python3
"""Prints figures of the code's structure: its size, its constants, its rooms.

Run with `./run exec python tools/structure.py`; `--list` prints what the figures count, one place a line.

Rooms are those of the contracts `rooms` and `tools` in pyproject.toml; a room stands one floor above the highest that
it imports from. Tokens count neither docstrings nor comments. A constant of a module is an upper-case name that it
assigns.
"""

import argparse
import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import grimp
from importlinter.api import read_configuration

REPOSITORY = Path(__file__).resolve().parents[1]
SOURCE = REPOSITORY / "src"
TRUNK = SOURCE / "solfer"
MOST_FILES = 13
"""Files of a folder above which it is listed."""


def rooms() -> list[str]:
    """Return the rooms, the highest first; those of the tools stand above the trunk."""
    contracts = read_configuration(str(REPOSITORY / "pyproject.toml"))["contracts_options"]
    layers = {contract["id"]: contract["layers"] for contract in contracts if contract["id"] in ("tools", "rooms")}
    return [*(f"solfer_tools.{room}" for room in layers["tools"]), *(f"solfer.{room}" for room in layers["rooms"])]


def arrows(modules: grimp.ImportGraph) -> set[tuple[str, str]]:
    """Return the pairs of rooms of which the first imports from the second."""
    names = rooms()

    def room_of(module: str) -> str:
        return next((room for room in names if module == room or module.startswith(f"{room}.")), "")

    pairs = {
        (room_of(importer), room_of(imported))
        for importer in modules.modules
        for imported in modules.find_modules_directly_imported_by(importer)
    }
    return {(above, below) for above, below in pairs if above and below and above != below}


def floors(pairs: set[tuple[str, str]]) -> dict[str, int]:
    """Return the floor of each room; arrows in a circle do not count."""
    names = rooms()
    order = {room: index for index, room in enumerate(names)}
    found: dict[str, int] = {}
    for room in reversed(names):
        below = [found[other] for one, other in pairs if one == room and order[other] > order[room]]
        found[room] = 1 + max(below, default=0)
    return found


def constants(tree: ast.Module) -> Iterator[tuple[str, bool]]:
    """Yield the upper-case names that a module assigns, and whether it does so in a tuple."""
    for node in tree.body:
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        for target in targets:
            for each in target.elts if isinstance(target, ast.Tuple) else [target]:
                if isinstance(each, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]*", each.id):
                    yield each.id, isinstance(target, ast.Tuple)


def tokens(text: str) -> int:
    """Count the tokens of a file without docstrings, comments and line ends."""
    skipped = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
    count = 0
    begins = True
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT):
            begins = True
        elif token.type not in skipped:
            count += not (begins and token.type == tokenize.STRING)
            begins = False
    return count


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--list", action="store_true", help="print what the figures count")
    options = parser.parse_args()
    files = {path: path.read_text() for path in sorted(SOURCE.rglob("*.py"))}
    words = Counter(word for text in files.values() for word in set(re.findall(r"\b_?[A-Z][A-Z0-9_]+\b", text)))
    lists: dict[str, list[str]] = {"constants": [], "in tuples": [], "used once": [], "named after their module": []}
    for path, text in files.items():
        for name, is_packed in constants(ast.parse(text)):
            place = f"{path.relative_to(SOURCE)} {name}"
            module = path.parent.name if path.stem == "__init__" else path.stem
            lists["constants"].append(place)
            if is_packed:
                lists["in tuples"].append(place)
            if words[name] == 1 and len(re.findall(rf"\b{name}\b", text)) == 2:
                lists["used once"].append(place)
            if name.lower().lstrip("_").startswith(f"{module.removesuffix('s')}_"):
                lists["named after their module"].append(place)
    sys.path.insert(0, str(SOURCE))  # before the messages that catkin makes
    graph = grimp.build_graph("solfer", "solfer_tools", exclude_type_checking_imports=True)
    pairs = arrows(graph)
    order = {room: index for index, room in enumerate(rooms())}
    lists["arrows that run up"] = [f"{one} -> {other}" for one, other in sorted(pairs) if order[other] < order[one]]
    lists["circles of two files"] = [
        f"{one} <-> {other}"
        for one in sorted(graph.modules)
        for other in sorted(graph.find_modules_directly_imported_by(one))
        if one < other and one in graph.find_modules_directly_imported_by(other)
    ]
    lists[f"folders of more than {MOST_FILES} files"] = [
        f"{folder.relative_to(SOURCE)} {count}"
        for folder, count in sorted(Counter(path.parent for path in files if path.stem != "__init__").items())
        if count > MOST_FILES
    ]
    floor = floors(pairs)
    figures = {
        "lines": sum(text.count("\n") for text in files.values()),
        "lines of the trunk": sum(text.count("\n") for path, text in files.items() if TRUNK in path.parents),
        "tokens": sum(tokens(text) for text in files.values()),
        "rooms": len(floor),
        "floors": max(floor.values()),
        "arrows": len(pairs),
        **{name: len(places) for name, places in lists.items()},
    }
    for name, figure in figures.items():
        print(f"{figure:>8}  {name}")
        if options.list and name in lists and name != "constants":
            print("".join(f"{'':10}{place}\n" for place in lists[name]), end="")


if __name__ == "__main__":
    main()
