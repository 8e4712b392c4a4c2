"""Every tag of the configuration acts: changing it changes what runs, or a warning says why it does not."""

import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest
from support.walk.changes import ONE_VALUE, REFUSED, RUNS, WARNED, Change
from support.walk.files import write

from solfer.errors import SolferError, SolferErrors

PAGE = (Path(__file__).parents[3] / "docs/reference/configuration.md").read_text()


def tags() -> Iterator[tuple[str, str, str]]:
    """Yield section, tag and row of the page of all tags, which another test compares with the records."""
    section = ""
    for line in PAGE.splitlines():
        if line.startswith("### "):
            section = line[4:]
        elif section and (row := re.match(r"\| `([^`]+)` \| (.*)", line)) and not row[2].startswith("keys below"):
            yield section, row[1], row[2]


class Walk:
    """The files of the walk in a folder, in which a change is made, run, and taken back."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.digest = cache(self._digest)

    def _digest(self, bench, changes: str) -> str:
        write(self.folder, json.loads(changes))
        return bench(self.folder)

    def acts(self, change: Change) -> bool:
        """Return whether what runs is another than without the change."""
        before, after = json.dumps(dict(change.before)), json.dumps({**change.before, **change.after})
        return self.digest(change.bench, before) != self.digest(change.bench, after)


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return Walk(tmp_path_factory.mktemp("walk"))


def test_every_tag_has_an_entry():
    known = {(section, tag) for section, entries in RUNS.items() for tag in entries}
    others = [set(REFUSED), set(ONE_VALUE), set(WARNED)]
    assert {(section, tag) for section, tag, _ in tags()} == known.union(*others)
    assert sum(map(len, others)) + len(known) == len(known.union(*others))


@pytest.mark.daily(6)
@pytest.mark.slow
@pytest.mark.parametrize("section", RUNS)
def test_tags_change_what_runs(walk, section):
    assert [tag for tag, change in RUNS[section].items() if not walk.acts(change)] == []


@pytest.mark.parametrize("place", REFUSED, ids=lambda place: place[1])
def test_other_values_alone_are_refused(walk, place):
    change = REFUSED[place]
    walk.digest(change.bench, json.dumps(dict(change.before)))
    with pytest.raises((SolferError, SolferErrors), match=f"{place[1].rpartition('.')[2]}|carries"):
        walk.acts(change)


@pytest.mark.slow
def test_runs_without_a_change_are_alike(walk):
    changes = [change for entries in RUNS.values() for change in entries.values()]
    for bench, before in {change.bench: change.before for change in changes}.items():
        write(walk.folder, before)
        assert bench(walk.folder) == bench(walk.folder)


def test_few_tags_warn_of_their_reason():
    rows = {(section, tag): row for section, tag, row in tags()}
    for place, reason in WARNED.items():
        assert f"no effect: {reason}" in rows[place]
    assert len(WARNED) <= 0.1 * len(rows)
    for place in ONE_VALUE:
        assert " or " not in rows[place].split("|")[0]
