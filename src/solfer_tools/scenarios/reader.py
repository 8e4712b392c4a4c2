"""Reads scenario files: every mistake with its place."""

import logging
import os
import statistics
from collections.abc import Sequence
from dataclasses import replace

from solfer.config.records.record import field_names, parse
from solfer.config.yaml.files import opened
from solfer.config.yaml.nodes import Key, YamlNode
from solfer.config.yaml.problems import Problems
from solfer.errors import nearest
from solfer_tools.scenarios.player import count_periods
from solfer_tools.scenarios.records import (
    BASE_ROW,
    VERBS,
    FootprintRecord,
    LegRecord,
    MoveRecord,
    ScenarioRecord,
    SpeedRecord,
    Step,
)
from solfer_tools.scenarios.scenario import Scenario

logger = logging.getLogger(__name__)

PATTERN = "pattern"


def read_scenario(path: str | os.PathLike) -> Scenario:
    """Read a scenario file.

    The steps of the pattern are numbered from 1 on, and end before the first one that is not the next. Of a number that
    stands twice the later step counts; that, and steps that are never reached, is logged.

    Raises:
        ConfigError: The file is missing or not YAML, a value does not fit, or a step would never end.
        UnknownName: There is no such key or verb.
        SolferErrors: Several of these.
    """
    problems = Problems()
    file = opened(path, later=(PATTERN,))
    problems.reading(file.path)
    problems.absorb(file.problems)
    node = file.node
    record = parse(_without_pattern(node), ScenarioRecord, problems, also=(PATTERN,))
    pattern = _pattern(node, problems)
    if record is not None:
        _check_legs(node, record, problems)
        for step in pattern:
            _check_step(step, record, problems)
    problems.log(logger)
    problems.raise_if_any()
    assert record is not None
    scenario = Scenario(file.path, record, tuple(pattern))
    return replace(scenario, periods=count_periods(scenario))


def _without_pattern(node: YamlNode) -> YamlNode:
    if not isinstance(node.value, dict):
        return node
    return replace(node, value={key: child for key, child in node.items() if key != PATTERN})


def _pattern(node: YamlNode, problems: Problems) -> list[Step]:
    """Parse the steps that are played, and note what is wrong with any of them."""
    if not isinstance(node.value, dict):
        return []
    pattern = node.get(PATTERN)
    if pattern is None:
        others = set(node.entries()) - set(field_names(ScenarioRecord))
        if not any(nearest(PATTERN, [name]) for name in others):  # else reported as an unknown key
            problems.missing(node.head, f"the key '{PATTERN}' is missing", "the steps, numbered from 1 on")
        return []
    if not isinstance(pattern.value, dict):
        problems.add(pattern.mark, f"expected a map of numbered steps, got {pattern.kind}", "1: and a step, 2: ...")
        return []
    steps = []
    expected = 1
    ended = False
    for key, child in pattern.items():
        if not (key.isascii() and key.isdecimal()) or key != str(int(key)):
            problems.add(child.head, f"'{key}' is no number of a step", "1, 2, 3 and so on")
            continue
        step = _step(child, problems)
        number = int(key)
        if number == 0:
            problems.warn(child.head, "step 0 is never reached: steps begin at 1")
        elif number == expected and not ended:
            steps += [step] if step is not None else []
            expected += 1
        elif not ended:
            ended = True
            problems.warn(child.head, f"step {number} and all below it are never reached: here should be {expected}")
    if expected == 1 and not problems:
        problems.add(pattern.head, "the pattern does not begin with step 1", "steps that are numbered from 1 on")
    return steps


def _step(node: YamlNode, problems: Problems) -> Step | None:
    if not isinstance(node.value, dict):
        problems.add(node.mark, f"expected a step, got {node.kind}", "a map such as {type: wait, steps: 1}")
        return None
    verb = node.get("type")
    if verb is None:
        has = [name for name in node.entries() if nearest("type", [name], likeness=0.7)]
        problems.add(node.head, "the key 'type' is missing", f"the verb: {', '.join(VERBS)}", has and ("type",))
        return None
    name = verb.value if isinstance(verb.value, str) else verb.kind
    if name not in VERBS:
        problems.unknown(verb.mark, "verb", name, VERBS)
        return None
    return parse(node, VERBS[name], problems)


def _check_legs(node: YamlNode, record: ScenarioRecord, problems: Problems) -> None:
    """Check that all lists of legs are of one length: that of most of them."""
    lists = {"x cp": "x_cp", "y cp": "y_cp", "z cp": "z_cp"}
    tables = {"x cp ref": "x_cp_ref", "y cp ref": "y_cp_ref", "z cp ref": "z_cp_ref", "cs ref": "cs_ref"}
    lengths: dict[tuple[Key, ...], int] = {(key,): len(getattr(record, field)) for key, field in lists.items()}
    for key, field in tables.items():
        lengths |= {(key, row): len(each) for row, each in enumerate(getattr(record, field) or ())}
    legs = statistics.mode(lengths.values())
    for path, length in lengths.items():
        if length != legs:
            problems.add(node.nearest(path).mark, f"{length} numbers for {legs} legs", f"{legs} numbers, as elsewhere")


def _check_step(step: Step, record: ScenarioRecord, problems: Problems) -> None:
    """Check what a step refers to: rows of tables, legs, and speeds."""
    if isinstance(step, FootprintRecord):
        names = {"x_cp": "x cp ref", "y_cp": "y cp ref", "z_cp": "z cp ref", "base": "base ref", "cs": "cs ref"}
        rows = {"x_cp": record.x_cp_ref, "y_cp": record.y_cp_ref, "z_cp": record.z_cp_ref}
        if isinstance(step, MoveRecord):
            rows |= {"base": record.base_ref}
            rows |= {"cs": record.cs_ref or ()} if step.cs is not None else {}
        for key, table in rows.items():
            _check_index(step, (key,), getattr(step, key), table=table, name=f"'{names[key]}'", problems=problems)
    elif isinstance(step, LegRecord):
        _check_index(step, ("leg",), step.leg, table=record.x_cp, name="'x cp'", problems=problems)
    elif isinstance(step, SpeedRecord):
        for index, (row, column, value) in enumerate(step.motions):
            path = ("motions", index, 1)
            of = "the base" if row == BASE_ROW else "'x cp'"
            _check_index(
                step,
                path,
                column,
                table=record.base_now if row == BASE_ROW else record.x_cp,
                name=of,
                problems=problems,
            )
            if row != BASE_ROW and not 0.0 < value <= 1.0:
                mark = step.place("motions", index, 2)
                assert mark is not None
                problems.add(
                    mark, f"a speed of {value:g}", "a fraction of the way left in each period: above 0, up to 1"
                )


def _check_index(
    step: Step, path: Sequence[Key], index: int, table: Sequence[object], name: str, *, problems: Problems
) -> None:
    """Check that an index is one of a table."""
    if index < len(table):
        return
    mark = step.place(*path)
    assert mark is not None
    has = f"0 to {len(table) - 1}, as {name} has {len(table)}" if table else f"a file with {name}"
    problems.add(mark, f"there is no {index} in {name}", has)
