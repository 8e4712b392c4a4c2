"""What runs in a study: the file, what varies in it, and the runs that this makes."""

import hashlib
import itertools
import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, JsonValue
from pydantic.dataclasses import dataclass as checked

from solfer import errors
from solfer.config.records.record import parse
from solfer.config.yaml.files import check_file, read_node
from solfer.config.yaml.nodes import Key, Mark, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.config.yaml.search import anchored
from solfer.errors import ConfigError, SolferError, SolferErrors, UnknownName, raise_all, singles
from solfer.recording.versions import versions
from solfer_tools.study.measures import check_expressions
from solfer_tools.study.records import DRAWN_KEYS, StudyRecord, VariationRecord
from solfer_tools.study.robot import files_of
from solfer_tools.study.simulated_run import check_tags, configurations_of, function_of, listed, rehearse

CODE_FOLDERS = tuple(Path(file).resolve() for file in (Path(errors.__file__).parent, Path(__file__).parents[1]))
"""Folders of the code; that of `solfer.__init__` may be one of catkin's."""

CONFIGURATION_KEY = "configuration"
"""First key of a path into the configuration of the plugins; others lead into the study itself."""

ROW = ("run", "id", "seed")
"""First columns of the table, before those of variations."""

OUTCOME = ("failed", "failure")
"""Columns of the table between those of variations and of measures."""

MOST_RUNS = 1_000_000

ShortHash = Annotated[str, Field(pattern="^[0-9a-f]{16}$")]


@checked(frozen=True)
class PlannedRun:
    """A run of a study.

    Attributes:
        index: Its place in the table.
        seed: Of noise and transport.
        variations: The values of what varies, by name.
        key: Hash of all that decides what it does, but the code.
        id: The same with the code: name of its folder.
    """

    index: int
    seed: int
    variations: dict[str, JsonValue]
    key: Annotated[str, Field(pattern="^[0-9a-f]{64}$")]
    id: ShortHash

    @property
    def text(self) -> str:
        """Names and values of what varies, for people."""
        return ", ".join(f"{name} {shown(value)}" for name, value in self.variations.items())


def shown(value: Any) -> str:
    """Write a value for people: a number with few digits, others as in JSON."""
    if isinstance(value, float):
        return f"{value:.5g}"
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


@dataclass(frozen=True)
class Plan:
    """The runs of a study.

    Attributes:
        code: Hash of the package's files, and of the versions of what it works with.
        runs: The runs.
    """

    code: str
    runs: tuple[PlannedRun, ...]


class Study:
    """The file of a study, whose values may vary.

    Args:
        node: The file.

    Attributes:
        file: Its path.
        record: The file as it is, without variations.

    Raises:
        SolferError: The file is wrong. SolferErrors: Several mistakes.
    """

    def __init__(self, node: YamlNode):
        self._node = node
        self.file = node.mark.file
        self.record = _parsed(node)
        self._check()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of what varies or is searched."""
        return tuple(self.variations)

    @cached_property
    def variations(self) -> dict[str, VariationRecord]:
        """What varies or is searched, by name."""
        searched = {} if self.record.search is None else self.record.search.parameters
        return {**self.record.vary, **searched}

    def settings(self, variations: Mapping[str, Any]) -> tuple[StudyRecord, YamlNode | None]:
        """Return the record of a run, and what is laid over the configuration; None: nothing.

        Raises:
            SolferError: A value does not fit. SolferErrors: Several mistakes.
        """
        node = self._node
        over = None
        for name, value in variations.items():
            path = self.path(name)
            # with the place where it stands in the file
            written = _node_of(value, self.variations[name].place() or self._node.mark)
            if path[0] == CONFIGURATION_KEY:
                over = _with(over or YamlNode({}, written.mark), path[1:], written)
            else:
                node = _with(node, path, written)
        return _parsed(node), over

    def points(self, runs: int | None = None) -> Iterator[tuple[int, dict[str, Any]]]:
        """Yield seed and variations of each run: of each point of the grid as many as the file, or `runs`, requests."""
        vary = self.record.vary
        seed = self.record.seed
        grids = {name: each.grid for name, each in vary.items() if each.grid is not None}
        lists = {name: each.list for name, each in vary.items() if each.list is not None}
        rows = list(zip(*lists.values(), strict=True)) if lists else [()]
        place = 0
        for point in itertools.product(*grids.values()):
            for row in rows:
                for count in range(runs or self.record.runs):
                    chosen = dict(zip(grids, point, strict=True)) | dict(zip(lists, row, strict=True))
                    draw = np.random.default_rng((seed, place))
                    drawn = {name: _drawn(each, draw) for name, each in vary.items() if each.kind in DRAWN_KEYS}
                    yield seed + count, {name: (chosen | drawn)[name] for name in vary}
                    place += 1

    def plan(self, runs: int | None = None) -> Plan:
        """Plan all runs of the grid.

        Raises:
            SolferError: A value does not fit, or there are too many runs. SolferErrors: Several mistakes.
        """
        vary = self.record.vary.values()
        lengths = [len(each.grid) for each in vary if each.grid is not None]
        lengths += [len(each.list) for each in vary if each.list is not None][:1]
        if (count := math.prod(lengths) * (runs or self.record.runs)) > MOST_RUNS:
            raise ConfigError(f"{count} runs", where=str(self._node.mark), expected=f"{MOST_RUNS} at most")
        self.check_values()
        return Plan(code_hash(), tuple(self.planned(index, *point) for index, point in enumerate(self.points(runs))))

    def empty_plan(self) -> Plan:
        """Return the plan of a search, which adds its runs one by one."""
        return Plan(code_hash(), ())

    def planned(self, index: int, seed: int, variations: Mapping[str, Any]) -> PlannedRun:
        """Plan a run."""
        record, over = self.settings(variations)
        decisive = {"plugins", "simulation", "motion", "settle", "duration", "measure", "fails"}
        undecided = {"measure": {name: {"unit"} for name in record.measure}}
        settings = _without_places(record.model_dump(include=decisive, exclude=undecided))
        changes = None if over is None else over.plain()
        files = [_file_hash(str(path)) for path in _files(record)]
        key = _hash(json.dumps([settings, changes, seed, files], sort_keys=True), self._unchanged)
        return PlannedRun(index, seed, dict(variations), key=key, id=_hash(key, code_hash())[:16])

    def check_values(self) -> None:
        """Check each value by itself, and the ends of what is drawn, before anything runs.

        Raises:
            SolferError: A value does not fit. SolferErrors: Several mistakes.
        """
        errors: list[SolferError] = []
        used = [configuration.name for _, configuration in listed(configurations_of(self.record, None))]
        for name, each in self.variations.items():
            path = self.path(name)
            if path[:2] == (CONFIGURATION_KEY, "modules") and path[2] not in used:
                errors.append(UnknownName("configuration of a plugin of the study", path[2], used, where=each.where()))
        raise_all(errors)
        _files(self.record)
        motion = self.record.motion
        if motion.function is not None:
            function_of(motion.function, motion.where("function"))
        rehearse(self.record)
        alone = [{name: value} for name, each in self.variations.items() for value in _ends(each)]
        for variations in alone:
            try:
                record, over = self.settings(variations)
                _files(record)
                if over is not None:
                    check_tags(configurations_of(record, over))
            except (SolferError, SolferErrors) as error:
                errors += [each for each in singles([error]) if str(each) not in map(str, errors)]
        raise_all(errors)

    @cached_property
    def _unchanged(self) -> str:
        """Hash of the effective configuration without changes; files count by their contents."""
        values = [
            [configuration.module.name, list(path), _file_hash(str(value)) if path[-1] == "file" else value]
            for _, configuration in listed(configurations_of(self.record, None))
            for path, value, _ in configuration.effective()
        ]
        return _hash(json.dumps(values))

    def text(self) -> str:
        """Write the file as it can be read in any folder, in JSON, which is YAML."""
        return json.dumps(anchored(self._node).plain(), indent=1)

    def path(self, name: str) -> tuple[str, ...]:
        """Return the keys that lead to what varies."""
        return tuple((self.variations[name].path or name).split("/"))

    def _check(self) -> None:
        problems = Problems()
        record = self.record
        lists = {name: each for name, each in record.vary.items() if each.list is not None}
        sizes = {len(each.list or ()) for each in lists.values()}
        if len(sizes) > 1:
            mark = next(iter(lists.values())).place("list") or self._node.mark
            problems.add(mark, f"lists of different lengths: {', '.join(lists)}", "lists that go together")
        for name, each in self.variations.items():
            path = self.path(name)
            mark = each.place() or self._node.mark
            varying = ("simulation", "motion", "duration", "settle", CONFIGURATION_KEY)
            if path[0] not in varying:
                problems.unknown(mark, "begin of a path", path[0], varying)
            elif path[0] == CONFIGURATION_KEY and len(path) < 3:
                problems.add(mark, f"'{'/'.join(path)}' leads to no tag", "configuration/modules/NAME/TAG")
        for name in (*self.variations, *record.measure):
            if name in (*ROW, *OUTCOME) or (name in self.variations and name in record.measure):
                mark = (self.variations.get(name) or record.measure[name]).place() or self._node.mark
                problems.add(mark, f"two columns of the table are named '{name}'", "another name")
        search = record.search
        if search is not None and (goal := search.minimize or search.maximize) not in record.measure:
            problems.unknown(search.place() or self._node.mark, "measure", str(goal), record.measure)
        problems.raise_if_any()
        check_expressions(record, self.variations)


def read_study(file: str | os.PathLike) -> Study:
    """Read the file of a study.

    Raises:
        ConfigError: It is missing, not YAML, or a value does not fit.
        UnknownName: It has an unknown key. SolferErrors: Several mistakes.
    """
    problems = Problems()
    node = read_node(file, problems)
    problems.raise_if_any()
    return Study(node)


def study_of(text: str, file: str) -> Study:
    """Return the study of a text that `Study.text` returned, which stood in a file.

    Raises:
        SolferError: It is wrong.
    """
    return Study(_node_of(json.loads(text), Mark(file, 1, 1)))


def record_of(tree: Mapping[str, Any], changes: Mapping[str, Any]) -> tuple[StudyRecord, YamlNode | None]:
    """Return the record of a study that is given as maps and lists, and changes by their paths as a tree.

    Raises:
        SolferError: A value does not fit. SolferErrors: Several mistakes.
    """
    mark = Mark(os.path.join(os.getcwd(), "run"), 1, 1)
    over = None
    for path, value in changes.items():
        over = _with(over or YamlNode({}, mark), tuple(path.split("/")), _node_of(value, mark))
    record = _parsed(_node_of(tree, mark))
    check_expressions(record, ())
    return record, over


@cache
def code_hash() -> str:
    """Return a hash of the package's Python files, and of the versions of what it works with."""
    contents = [
        f"{path.relative_to(folder)} {_file_hash(str(path))}"
        for folder in CODE_FOLDERS
        for path in sorted(folder.rglob("*.py"))
    ]
    return _hash(*contents, json.dumps(versions(), sort_keys=True))[:16]


def _parsed(node: YamlNode) -> StudyRecord:
    problems = Problems()
    record = parse(node, StudyRecord, problems)
    problems.raise_if_any()
    assert record is not None  # there was no mistake
    return record


def _drawn(record: VariationRecord, draw: np.random.Generator) -> Any:
    """Draw a value."""
    if record.choice is not None:
        return record.choice[int(draw.integers(len(record.choice)))]
    low, high = record.normal or record.uniform or record.log_uniform or (1.0, 1.0)
    if record.normal is not None:
        return float(draw.normal(low, high))
    if record.uniform is not None:
        return float(draw.uniform(low, high))
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _with(node: YamlNode, path: tuple[Key, ...], value: YamlNode) -> YamlNode:
    """Return a tree with a value at a path; places of lists count from 0.

    Raises:
        ConfigError: The path leads through a value that is neither a map nor a list, or beyond a list's end.
    """
    if not path:
        return value
    first = path[0]
    rest = path[1:]
    if isinstance(node.value, tuple):
        if not str(first).isdigit() or int(first) >= len(node.value):
            raise ConfigError(
                f"'{first}' is no place of a list of {len(node.value)}",
                where=str(value.mark),
                expected="a place from 0 on",
            )
        items = list(node.value)
        items[int(first)] = _with(items[int(first)], rest, value)
        return replace(node, value=tuple(items))
    entries: dict[Any, YamlNode] = dict(node.value) if isinstance(node.value, dict) else {}
    entries[first] = _with(entries.get(first, YamlNode({}, value.mark)), rest, value)
    return replace(node, value=entries)


def _node_of(value: Any, mark: Mark) -> YamlNode:
    """Return a value as a tree, all of it at one place."""
    if isinstance(value, Mapping):
        return YamlNode({str(key): _node_of(each, mark) for key, each in value.items()}, mark, mark)
    if isinstance(value, (list, tuple)):
        return YamlNode(tuple(_node_of(each, mark) for each in value), mark)
    return YamlNode(value, mark, mark)


def _ends(record: VariationRecord) -> Iterable[Any]:
    """List the values of a variation, or the ends of what is drawn."""
    if record.normal is not None:
        return (record.normal[0],)
    return record.grid or record.list or record.choice or record.uniform or record.log_uniform or ()


def _without_places(data: Any) -> Any:
    """Return data without the places of files, whose contents count."""
    if isinstance(data, Mapping):
        return {str(key): _without_places(each) for key, each in data.items() if key not in ("file", "path")}
    return [_without_places(each) for each in data] if isinstance(data, (list, tuple)) else data


def _files(record: StudyRecord) -> list[Path]:
    """List the files whose contents decide what a run does, beside the configuration's own."""
    motion = record.motion
    named = [(each.location, each.where()) for each in (motion.scenario, motion.references) if each is not None]
    for path, where in named:
        check_file(path, where)
    return [*files_of(record.simulation), *(path for path, _ in named)]


@cache
def _file_hash(path: str) -> str:
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def _hash(*parts: str) -> str:
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()
