"""The changes of test/data/walk/changes.yaml, and what is run with and without them."""

from collections.abc import Callable, Iterator, Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from support.walk import benches, estimators, wheels
from support.walk.files import DATA

from solfer.components.support_shaping import SupportShaping
from solfer.config.yaml.compose import LOADER

BENCHES: dict[str, Callable[[Path], str]] = {
    bench.__name__: bench
    for bench in (
        benches.shared,
        benches.simulation,
        benches.server,
        benches.bridge,
        benches.hardware,
        benches.layer,
        benches.named_layer,
        wheels.driving,
        wheels.lifting,
        wheels.far,
        wheels.shaping,
        wheels.standing,
    )
} | {
    "lifted": partial(wheels.lifting, kind=SupportShaping),
    "strayed": partial(wheels.far, kind=SupportShaping),
    "odometry": estimators.ODOMETRY,
    "stamped_odometry": estimators.STAMPED,
    "ground_forces": estimators.GROUND,
}


class Change(NamedTuple):
    """What is run, and values by their path in the files; `before` holds with and without the tag's own change."""

    bench: Callable[[Path], str]
    after: Mapping[str, Any]
    before: Mapping[str, Any] = {}


@cache
def _bench(run: str) -> Callable[[Path], str]:
    """Return what runs: a bench, or a module of the main file with options, such as `walk system=HW`."""
    name, *options = run.split()
    return BENCHES.get(name) or benches.module(name, **dict(option.split("=") for option in options))


def _changes(
    group: Mapping[str, Any], around: Change, below: str = "", named: str = ""
) -> Iterator[tuple[str, Change]]:
    """Yield the changes of a group by tag; the file says what its keys mean."""
    below += group.get("below", "")
    named += group.get("named", "")

    def placed(values: Mapping[str, Any]) -> dict[str, Any]:
        return {(below + path[2:] if path[0] == "." else path).rstrip("/"): value for path, value in values.items()}

    bench = _bench(group["run"]) if "run" in group else around.bench
    before = {**around.before, **placed(group.get("before", {}))}
    for tag, value in group.get("values", {}).items():
        yield named + tag, Change(bench, {below + tag.replace(".", "/"): value}, before)
    for tag in group.get("tags", ()):
        yield named + tag, Change(bench, placed(group["to"]), before)
    for part in group.get("changes", ()):
        yield from _changes(part, Change(bench, {}, before), below, named)


def _of(part: str) -> dict[str, dict[str, Change]]:
    return {section: dict(_changes(group, Change(benches.layer, {}))) for section, group in TABLE[part].items()}


TABLE = yaml.load((DATA / "changes.yaml").read_text(), LOADER)
RUNS = _of("runs")
REFUSED = {(section, tag): change for section, changes in _of("refused").items() for tag, change in changes.items()}
ONE_VALUE = {(section, tag): reason for section, tags in TABLE["one_value"].items() for tag, reason in tags.items()}
WARNED = {(section, tag): reason for section, tags in TABLE["warned"].items() for tag, reason in tags.items()}
