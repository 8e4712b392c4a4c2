"""Pipes and calibrations by name: sets of pipes, and the generic part merged with the middleware's part."""

from collections.abc import Iterable, Iterator
from typing import Any

from solfer.config.kinds.table import record_of
from solfer.config.records.calibration import CalibrationRecord
from solfer.config.records.middlewares import MIDDLEWARES, MiddlewareKind
from solfer.config.records.pipes import AnyPipeRecord, ControllerRecord, DofsRecord, FeedbackRecord, PipeRecord
from solfer.config.records.record import RecordType, parse
from solfer.config.yaml.merge import overlaid
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.errors import nearest

FEEDBACK = "feedback"
"""Direction of the pipes that a plugin receives."""

CONTROLLER = "controller"
"""Direction of the pipes that a plugin sends to."""


class Library:
    """The pipes of one direction: `feedback` with the sets `feedbacks`, or `controller` with the sets `controllers`.

    Attributes:
        names: Names of all pipes.
        used: Direction and name of the pipes that were looked up.
        dofs: DoFs of these pipes, also of those that have a mistake elsewhere.
    """

    def __init__(self, tree: YamlNode, middleware: str, direction: str, problems: Problems):
        self._direction = direction
        self._sets = f"{direction}s"
        self._middleware = MIDDLEWARES[middleware]
        self._generic, self._special = tree.get(direction), tree.get(self._middleware.section, direction)
        self._tree = tree
        self._problems = problems
        self.names = tuple(tree.entries(direction) | tree.entries(self._middleware.section, direction))
        self.used: set[tuple[str, str]] = set()
        self.dofs: list[DofsRecord] = []

    def of_set(self, chosen: YamlNode) -> tuple[Any, ...]:
        """Return the pipes of the set that `chosen` names."""
        node = self.list_of(self.find_set(chosen))
        return () if node is None else self.of_list(node)

    def check_list(self, node: YamlNode | None) -> None:
        """Check the names in a list of pipes, if there is one."""
        for _ in self._listed(node) if node is not None else ():
            continue

    def find_set(self, chosen: YamlNode) -> YamlNode | None:
        """Return the set that `chosen` names; None, with an error, if there is none."""
        known = self._tree.entries(self._sets)
        if chosen.value in self.names and chosen.value not in known:
            key = "list: " if self._direction == FEEDBACK else ""
            what = f"'{chosen.value}' is a {self._direction} pipe, and not a set of them"
            self._problems.add(chosen.mark, what, f"a set, or a list of pipes: `{key}[{chosen.value}]`")
        elif chosen.value not in known:
            self._problems.unknown(chosen.mark, f"{self._direction} set", str(chosen.value), known)
        return known.get(str(chosen.value))

    def list_of(self, node: YamlNode | None) -> YamlNode | None:
        """Return the list in a set, which is written as a list or as a map with the key `list`."""
        if node is None or not isinstance(node.value, dict):
            return node
        for key, extra in node.items():
            if key != "list":
                self._problems.unknown(extra.head, "key", key, ("list",))
        return node.get("list")

    def of_list(self, node: YamlNode) -> tuple[Any, ...]:
        """Return the pipes of a list, in its order; `[all]` is every pipe; pipes with the space SKIP are left out."""
        records = [self.pipe(name, mark) for name, mark in self._listed(node)]
        return tuple(record for record in records if record is not None)

    def _listed(self, node: YamlNode) -> Iterator[tuple[str, Mark]]:
        """Yield the existing names in a list of pipes, each with its place."""
        if not isinstance(node.value, tuple):
            self._problems.add(node.mark, f"expected a list of pipes, got {node.kind}")
            return
        seen: set[object] = set()
        for item in node.value:
            if not isinstance(item.value, str):
                self._problems.add(item.mark, f"expected the name of a pipe, got {item.kind}")
            elif item.value in seen:
                self._problems.add(item.mark, f"the pipe '{item.value}' stands twice in the list", "it once")
            elif item.value == "all" and len(node.value) == 1:
                yield from ((name, item.mark) for name in self.names)
            elif item.value not in self.names:
                self._problems.unknown(item.mark, f"{self._direction} pipe", item.value, self.names)
            else:
                yield item.value, item.mark
            seen.add(item.value if isinstance(item.value, str) else None)

    def pipe(self, name: str, mark: Mark) -> Any:
        """Read the pipe `name`, named at `mark`; None if it is to be left out, or wrong."""
        parts = [part.get(name) for part in (self._generic, self._special) if part is not None]
        node = overlaid(parts, self._problems)
        self.used.add((self._direction, name))
        if node is None:
            self._problems.missing(mark, f"the pipe '{name}' has no content", f"'{self._direction}.{name}' with keys")
            return None
        space = node.get("space")
        if space is not None and space.value == "SKIP":
            return None
        base: type[PipeRecord] = FeedbackRecord if self._direction == FEEDBACK else ControllerRecord
        kind = record_of(base, space and space.value)
        record = parse(node, kind, self._problems, name=name)
        if record is not None:
            self._require(record, parts[-1] or node)
            self._warn_of_idle(record, node)
        dofs = node.get("dofs")
        found = record.dofs if record is not None else dofs and parse(dofs, DofsRecord, Problems())
        self.dofs += [found] if found else []
        return record

    def _require(self, record: AnyPipeRecord, part: YamlNode) -> None:
        """Require keys that the values of others, or the middleware, make necessary."""
        for key in _needed(record, self._middleware):
            if getattr(record, key) is None:
                section = "" if key in ("function", "type") else f"{self._middleware.section}."
                meaning = type(record).model_fields[key].description
                expected = f"'{section}{self._direction}.{record.name}.{key}': {meaning}"
                self._problems.missing(part.head, f"the pipe '{record.name}' has no '{key}'", expected)

    def _warn_of_idle(self, record: AnyPipeRecord, node: YamlNode) -> None:
        """Warn of keys that have no effect together with the values of others, or that are close to a known one."""
        for name in getattr(record.interface, "model_extra", None) or ():
            near = nearest(name, type(record.interface).model_fields, 1)
            if near:
                what = f"an interface that the component has to add to the State; did you mean {near[0]}?"
                self._problems.warn(node.nearest(("interface", name)).head, what)
        if not isinstance(record, FeedbackRecord) or record.sensor is None:
            return
        source = node.get("source")
        if not record.reads_sensor:
            what = "has no effect: only a pipe of a rigid body (space: OPERATIONAL) with `layer: online` reads a sensor"
            self._problems.warn(node.nearest(("sensor",)).head, what)
        elif source is not None and source.value != record.source:
            what = f"has no effect: the sensor of '{record.sensor}' is read; with `message` it would be this topic"
            self._problems.warn(source.head, what)


def _needed(record: AnyPipeRecord, middleware: MiddlewareKind) -> Iterator[str]:
    if isinstance(record, FeedbackRecord):
        yield from record.content.needed
        if middleware.named:
            yield from ("source", "message")
    elif middleware.named:
        yield "type"
        if not record.lower_level:
            yield "sink"
    if not middleware.named:
        if (record.source if isinstance(record, FeedbackRecord) else record.sink) is None:
            yield "layer"
        if record.layer in ("RT", "NRT"):
            yield "source" if isinstance(record, FeedbackRecord) else "sink"


def named_records(node: YamlNode | None, record: type[RecordType], problems: Problems) -> dict[str, RecordType]:
    """Read the records of a map from names to maps; names without a value are left out."""
    found = {}
    for name, child in node.items() if node else ():
        parsed = parse(child, record, problems, name=name) if child.value is not None else None
        if parsed is not None:
            found[name] = parsed
    return found


def read_calibrations(
    tree: YamlNode, pipes: Iterable[AnyPipeRecord], problems: Problems
) -> dict[str, CalibrationRecord]:
    """Read all calibrations; those that `pipes` name have to exist, and belong to the hardware's pipes."""
    calibrations = named_records(tree.get("calibration"), CalibrationRecord, problems)
    for calibration in calibrations.values():
        _check_names(calibration, problems)
    known = tree.entries("calibration")
    pipes = tuple(pipes)
    for pipe in pipes:
        if pipe.calibration is None:
            continue
        if pipe.calibration not in known:
            problems.unknown(pipe.place("calibration"), "calibration", pipe.calibration, known)
        what = _not_hardware(pipe)
        if what:
            problems.add(pipe.place("calibration"), f"the pipe '{pipe.name}' {what}", "no calibration here")
    _check_all_or_none(pipes, problems)
    return calibrations


def _check_all_or_none(pipes: tuple[AnyPipeRecord, ...], problems: Problems) -> None:
    """Check that a plugin that commands calibrated joints receives them calibrated, and vice versa."""
    commands = [pipe for pipe in pipes if isinstance(pipe, ControllerRecord) and pipe.lower_level]
    received = [pipe for pipe in pipes if isinstance(pipe, FeedbackRecord) and not _not_hardware(pipe)]
    receives_calibrated = any(pipe.calibration for pipe in received)
    if receives_calibrated or any(pipe.calibration for pipe in commands):
        faulty = [pipe for pipe in commands if not pipe.calibration] + ([] if receives_calibrated else received)
        for pipe in faulty:
            what = f"the pipe '{pipe.name}' has no calibration, but others to and from the hardware have one"
            problems.add(pipe.place(), what, "the key 'calibration' in all of them, or in none")


def _check_names(calibration: CalibrationRecord, problems: Problems) -> None:
    owners: dict[str, str] = {}
    for joint, record in calibration.joints.items():
        name = calibration.hardware(joint)
        owner = owners.setdefault(name, joint)
        if owner != joint:
            what = f"the hardware's joint '{name}' stands for '{owner}' and for '{joint}'"
            problems.add(record.place("name"), what, "a name of its own for each joint")


def _not_hardware(pipe: AnyPipeRecord) -> str:
    """Return why the other end of a pipe is not the robot's hardware; empty if it is."""
    if not pipe.content.joints:
        return "carries no joints"
    if isinstance(pipe, ControllerRecord):
        return "" if pipe.lower_level else "goes to other plugins"
    return "" if pipe.function in ("state", "motor") else "carries references of other plugins"
