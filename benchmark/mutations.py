#!/usr/bin/env python3
"""Which small changes of `src/` the tests notice: mutations by room, drawn by a seed.

Run with `./run exec python benchmark/mutations.py [--room ROOM...] [--count N] [--seed S] [--results FILE]
[--tree PATH] [--limit SECONDS] [--report]`; `./run test` installs the operators, which are those of cosmic-ray. Files
are drawn by their sizes, then a place, then one of its changes. Docstrings, annotations, texts of errors, messages of
the log and `__repr__` do not count.

A copy of the tree below `build/mutations/` is changed, never the tree itself. Tests are those of the room, then those
of the rooms that import it and integration tests with the name of the file; one that fails in the unchanged copy, too,
kills nothing and is left out. `--tree` measures another checkout, such as one of an older commit, with the same
mutations: those whose lines are not in it are `absent`.

Each trial is one line of the results: `file`, `line`, `operator`, `diff`, `state`, the `test` that failed, `seconds`.
The state is `killed`, `crashed` (a signal ended the tests, as compiled code does that reads beyond its arrays), `timed
out` (tests of the room did not end), or `survived`; `complete` says whether all tests of other rooms ended within the
limit. A trial that is in the file already is not run again. The table has rooms with the share that was noticed, and
the survivors; what crashed is among the killed.
"""

import ast
import difflib
import hashlib
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from form import parser_of

from solfer.supervision import supervise

try:
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator, operator_names
except ImportError:
    sys.exit("cosmic-ray is missing: `./run test` installs it")

ROOT = Path(__file__).resolve().parents[1]
UNUSED = ("RemoveDecorator", "VariableReplacer", "VariableInserter")
OPERATORS = [name for name in operator_names() if not name.endswith(UNUSED)]
LOGS = {"debug", "info", "warning", "error", "exception", "critical", "log"}
FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+?::.+?|\S+)(?: - .*)?$", re.MULTILINE)
BASELINE = 600.0
"""Time for a test of the unchanged copy, which may have to compile kernels [s]."""


class Mutation(NamedTuple):
    """A change of some lines.

    Attributes:
        file: The file, from the tree on.
        operator: The operator of cosmic-ray.
        line: First line that changes.
        old: Lines before, which may be empty.
        new: Lines after.
    """

    file: str
    operator: str
    line: int
    old: tuple[str, ...]
    new: tuple[str, ...]

    @property
    def diff(self) -> str:
        """The change, without its place."""
        return "\n".join((*(f"-{line}" for line in self.old), *(f"+{line}" for line in self.new)))

    @property
    def key(self) -> tuple[str, int, str]:
        """What distinguishes it."""
        return self.file, self.line, self.diff

    def applied(self, text: str) -> str | None:
        """Return a changed text, at the lines nearest to the place; None: it does not have them."""
        lines, size = text.split("\n"), len(self.old)
        places = [at for at in range(len(lines) - size + 1) if tuple(lines[at : at + size]) == self.old]
        if not places:
            return None
        at = min(places, key=lambda place: abs(place + 1 - self.line))
        return "\n".join((*lines[:at], *self.new, *lines[at + size :]))


class Sources:
    """Modules of the package in the folder `src` of a tree, their rooms and tests.

    Args:
        tree: The tree.
    """

    def __init__(self, tree: Path):
        self.tree = tree
        (self.package,) = (path.parent for path in sorted(tree.glob("src/*/__init__.py")))
        self.files = sorted(path for path in self.package.rglob("*.py") if path.name != "__init__.py")

    def room(self, path: Path) -> str:
        """Return the room of a file: a folder or file of the package, or of its folder `middleware`."""
        parts = path.relative_to(self.package).with_suffix("").parts
        return "/".join(parts[: 2 if parts[0] == "middleware" else 1])

    def importing(self, room: str) -> list[str]:
        """Return the rooms that import another one, those that import it most first."""
        name = ".".join((self.package.name, *room.split("/")))
        statement = re.compile(rf"^\s*(?:from|import) {re.escape(name)}\b", re.MULTILINE)
        counts = Counter[str]()
        for path in self.files:
            counts[self.room(path)] += len(statement.findall(path.read_text()))
        return [other for other, count in counts.most_common() if count and other != room]

    def tests(self, room: str) -> list[str]:
        """Return the unit tests of a room, a folder or a file, from the tree on."""
        name = room.rpartition("/")[2]
        found = (self.tree / "test/unit" / name, self.tree / "test/unit" / f"test_{name}.py")
        return [str(path.relative_to(self.tree)) for path in found if path.exists()]

    def tests_of_others(self, path: Path) -> list[str]:
        """Return the tests of the rooms that import a file's room, and integration tests with the file's name."""
        units = [test for room in self.importing(self.room(path)) for test in self.tests(room)]
        names = {path.stem, path.parent.name} - {self.package.name, "kernel", "component"}
        whole = sorted((self.tree / "test/integration").rglob("test_*.py"))
        return units + [str(test.relative_to(self.tree)) for test in whole if any(name in test.stem for name in names)]


def draw(sources: Sources, rooms: Sequence[str], count: int, seed: int) -> list[Mutation]:
    """Draw mutations of some rooms, or of all if none is given."""
    chance, found, tried = random.Random(seed), dict[tuple[str, int, str], Mutation](), set()
    files = [path for path in sources.files if not rooms or sources.room(path) in rooms]
    sizes, places = [path.stat().st_size for path in files], dict[Path, dict[Any, list[tuple[str, int]]]]()
    for _ in range(20 * count):
        if len(found) == count:
            break
        path = chance.choices(files, sizes)[0]
        text = path.read_text()
        if path not in places:
            places[path] = defaultdict(list)
            for operator, occurrence, place in positions(text):
                places[path][place].append((operator, occurrence))
        if not places[path]:
            continue
        operator, occurrence = chance.choice(places[path][chance.choice(sorted(places[path]))])
        if (path, operator, occurrence) in tried:
            continue
        tried.add((path, operator, occurrence))
        mutated = mutate_code(text, get_operator(operator)(), occurrence)
        if mutated is not None and is_other(text, mutated):
            mutation = changed(str(path.relative_to(sources.tree)), operator.rpartition("/")[2], text, mutated)
            found.setdefault(mutation.key, mutation)
    return list(found.values())


def positions(text: str) -> Iterator[tuple[str, int, tuple[int, int]]]:
    """Yield the mutations of a module that count: operator, its occurrence, and the place (line, column)."""
    nodes, ignored = list(ast_nodes(get_ast(text))), list(uncounted(ast.parse(text)))
    for name in OPERATORS:
        operator, occurrence = get_operator(name)(), 0
        for node in nodes:
            for place, _ in operator.mutation_positions(node):
                if not any(start <= place < end for start, end in ignored):
                    yield name, occurrence, place
                occurrence += 1


def uncounted(tree: ast.AST) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield begin and end of what does not count; columns are those of ASCII."""
    for node in ast.walk(tree):
        parts: list[Any] = []
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            parts = [node] if node.name in ("__repr__", "__str__") else [node.returns]
        elif isinstance(node, ast.arg | ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.JoinedStr):
            parts = [node]
        elif isinstance(node, ast.Raise):
            parts = [node.exc]
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            parts = [node]
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in LOGS:
            parts = [node]
        yield from (((part.lineno, part.col_offset), (part.end_lineno, part.end_col_offset)) for part in parts if part)


def is_other(text: str, mutated: str) -> bool:
    """Whether a module is another program."""
    try:
        return ast.dump(ast.parse(text)) != ast.dump(ast.parse(mutated))
    except SyntaxError:
        return False


def changed(file: str, operator: str, text: str, mutated: str) -> Mutation:
    """Return the change from one text to another, of whole lines."""
    old, new = text.split("\n"), mutated.split("\n")
    blocks = [
        code for code in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes() if code[0] != "equal"
    ]
    begin, end = blocks[0][1], blocks[-1][2]
    return Mutation(file, operator, begin + 1, tuple(old[begin:end]), tuple(new[blocks[0][3] : blocks[-1][4]]))


class Copy:
    """A copy of a tree, in which tests run.

    Args:
        tree: The tree.
        folder: Where the copy is; what is there of it is used again, so that kernels stay compiled.
    """

    def __init__(self, tree: Path, folder: Path):
        self.folder, self._baseline, self._left_out = folder, folder / "build/baseline.json", list[str]()
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=tree, capture_output=True
        )
        names = {name for name in listed.stdout.decode().split("\0") if name and (tree / name).is_file()}
        if listed.returncode or not names:
            names = {str(path.relative_to(tree)) for path in tree.rglob("*") if path.is_file()}
        for name in names:
            source, target = tree / name, folder / name
            if not target.is_file() or target.read_bytes() != source.read_bytes():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(source, target)
        for path in [*folder.glob("src/**/*.py"), *folder.glob("test/**/*.py")]:
            if str(path.relative_to(folder)) not in names and path.resolve().is_relative_to(folder.resolve()):
                path.unlink()
        (folder / "build").mkdir(exist_ok=True)
        self.sources = Sources(folder)
        for made in ROOT.glob("build/ws/devel/lib/python3/dist-packages/solfer/[ms]*"):
            link = self.sources.package / made.name
            if self.sources.package.name == "solfer" and not link.exists():
                link.symlink_to(made)
        own = {
            "NUMBA_CACHE_DIR": "numba",
            "PYTHONPYCACHEPREFIX": "python",
            "HYPOTHESIS_STORAGE_DIRECTORY": "hypothesis",
        }
        places = [str(folder / "src"), *filter(None, [os.environ.get("PYTHONPATH")])]
        self._environment = os.environ | {name: str(folder / "build" / place) for name, place in own.items()}
        self._environment["PYTHONPATH"] = os.pathsep.join(places)

    def prepare(self) -> None:
        """Load all unit tests once, so that kernels are compiled before the time of a trial counts."""
        self._run(["test/unit", "--collect-only"], BASELINE)

    def trial(self, mutation: Mutation, limit: float) -> dict[str, Any]:
        """Run the tests on a mutation, for `limit` [s] at most; return the result."""
        path = self.folder / mutation.file
        text = path.read_text() if path.is_file() else ""
        mutated = mutation.applied(text) if text else None
        found = {"file": mutation.file, "line": mutation.line, "operator": mutation.operator, "diff": mutation.diff}
        if mutated is None:
            return found | {"state": "absent", "test": "", "complete": True, "seconds": 0.0}
        own, others = self.sources.tests(self.sources.room(path)), self.sources.tests_of_others(path)
        begun, times = time.monotonic(), (path.stat().st_atime, path.stat().st_mtime)
        while True:
            try:
                path.write_text(mutated)
                state, test, is_complete = self._state(own, others, limit)
            finally:
                path.write_text(text)
                os.utime(path, times)
            seconds = round(time.monotonic() - begun, 1)
            if state != "killed" or self._passes(test):
                return found | {"state": state, "test": test, "complete": is_complete, "seconds": seconds}

    def _state(self, own: list[str], others: list[str], limit: float) -> tuple[str, str, bool]:
        """Run the tests on what is changed; return state, failed test, and whether all tests ended."""
        end = time.monotonic() + limit
        code, failed = self._run(own, limit) if own else (0, [])
        if code is None:
            return "timed out", "", True
        if code in (0, 5) and others:
            code, failed = self._run(others, end - time.monotonic())
        if code is None or code in (0, 5):
            return "survived", "", code is not None
        if code < 0:  # a signal: what is compiled reads beyond its arrays
            return "crashed", "", True
        if not failed or failed[0] in self._left_out:
            raise RuntimeError(f"pytest ends with {code}; see {self.folder}/build/tests.log")
        return "killed", failed[0], True

    def _passes(self, test: str) -> bool:
        """Whether a test passes without a mutation; one that does not is left out from now on."""
        known: dict[str, bool] = json.loads(self._baseline.read_text()) if self._baseline.is_file() else {}
        if test not in known:
            known[test] = self._run([test], BASELINE)[0] == 0
            self._baseline.write_text(json.dumps(known))
        self._left_out = [name for name, passes in known.items() if not passes]
        return known[test]

    def _run(self, tests: list[str], limit: float) -> tuple[int | None, list[str]]:
        """Run tests; return the exit code, None where they did not end within the limit, and what failed."""
        options = [f"--deselect={name}" for name in self._left_out]
        loaded = [name for name in tests if name not in self._left_out]  # the others are files that do not load
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", *options, *loaded]
        log = self.folder / "build/tests.log"
        with log.open("w") as stream:
            process = subprocess.Popen(
                command,
                cwd=self.folder,
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
            try:
                code: int | None = process.wait(max(limit, 0.1))
            except subprocess.TimeoutExpired:
                code = None
            finally:
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGKILL)
                    process.wait()
        return code, FAILED.findall(log.read_text(errors="replace"))


def read_results(file: Path) -> list[dict[str, Any]]:
    """Read the trials that are done."""
    lines = file.read_text().splitlines() if file.is_file() else []
    return [json.loads(line) for line in lines if line.endswith("}")]


def run(copy: Copy, mutations: Sequence[Mutation], results: Path, limit: float) -> None:
    """Run the trials that are not done yet, and add them to the results."""
    done = {(each["file"], each["line"], each["diff"]) for each in read_results(results)}
    left = [mutation for mutation in mutations if mutation.key not in done]
    if left:
        copy.prepare()
    for index, mutation in enumerate(left, 1):
        print(f"{index}/{len(left)} {mutation.file}:{mutation.line}", end=" ", file=sys.stderr, flush=True)
        result = copy.trial(mutation, limit)
        print(f"{result['state']} {result['test']}", file=sys.stderr, flush=True)
        with results.open("a") as stream:
            stream.write(json.dumps(result) + "\n")


def report(results: list[dict[str, Any]], sources: Sources) -> Iterator[str]:
    """Yield the table by room, and the survivors."""
    rooms = defaultdict(Counter)
    for each in results:
        rooms[sources.room(sources.tree / each["file"])][each["state"]] += 1
    rooms["all"] = sum(rooms.values(), Counter())
    yield "| room | trials | killed | timed out | survived | noticed |\n|---|---|---|---|---|---|"
    for room, states in sorted(rooms.items(), key=lambda each: (each[0] == "all", each[0])):
        count, late = states.total() - states["absent"], states["timed out"]
        killed = states["killed"] + states["crashed"]
        share = f"{100 * (killed + late) / count:.0f} %" if count else ""
        yield f"| `{room}` | {count} | {killed} | {late} | {states['survived']} | {share} |"
    for each in results:
        if each["state"] == "survived":
            note = "" if each["complete"] else " (tests of other rooms did not end in time)"
            yield f"\n{each['file']}:{each['line']} {each['operator']}{note}\n{each['diff']}"


def main() -> int:
    """Run what the command line asks for; return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument(
        "--room", nargs="+", default=(), help="rooms, such as points or middleware/memory; default: all"
    )
    parser.add_argument("--count", type=int, default=60, help="mutations that are drawn (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=20261201, help="by which they are drawn (default: %(default)s)")
    parser.add_argument("--tree", type=Path, default=ROOT, help="the checkout that is measured; default: this one")
    parser.add_argument("--results", type=Path, default=ROOT / "build/mutations.jsonl", help="file of the results")
    parser.add_argument("--limit", type=float, default=300.0, help="of one trial [s] (default: %(default)s)")
    parser.add_argument("--report", action="store_true", help="only print what the results say")
    given = parser.parse_args()
    sources = Sources(ROOT)
    rooms = {sources.room(path) for path in sources.files}
    for room in given.room:
        if room not in rooms:
            parser.error(f"there is no room '{room}'; there are {', '.join(sorted(rooms))}")
    if not given.report:
        name = hashlib.sha256(str(given.tree.resolve()).encode()).hexdigest()[:8]
        copy = Copy(given.tree.resolve(), ROOT / "build/mutations" / name)
        run(copy, draw(sources, given.room, given.count, given.seed), given.results, given.limit)
    results = read_results(given.results)
    for line in map(json.dumps, results) if given.json else report(results, sources):
        print(line)
    return 0


if __name__ == "__main__":
    supervise()
    sys.exit(main())
