"""Scenario files: the author's own, and every mistake with its place."""

import logging
import re
from pathlib import Path

import numpy as np
import pytest
from support.unit.scenarios import RELATIVE, text_of

from solfer.errors import ConfigError, SolferError, SolferErrors, UnknownName
from solfer_tools.scenarios import read_scenario

ABSOLUTE = {"circular", "events", "events_25", "straight", "support"}


@pytest.fixture
def read(tmp_path):
    """Read the text of a scenario."""

    def read(text):
        path = tmp_path / "file.yaml"
        path.write_text(text)
        return read_scenario(path)

    return read


def shipped(repository):
    return sorted((repository / "config" / "scenarios").glob("*.yaml"))


@pytest.mark.slow
def test_the_files_of_the_original_are_read(repository):
    scenarios = {path.stem: read_scenario(path) for path in shipped(repository)}
    assert len(scenarios) == 11
    assert {name for name, each in scenarios.items() if each.is_absolute} == ABSOLUTE
    for scenario in scenarios.values():
        assert scenario.legs == 4 and scenario.duration > 1.0 and len(scenario.periods) == len(scenario.pattern)
    np.testing.assert_array_equal(scenarios["circular"].vertices[2], (-0.66, 0.25, 0.3035))
    np.testing.assert_array_equal(scenarios["support"].constant, (0.2, 0.0, 0.0, 0.0))
    assert [step.type for step in scenarios["circular"].pattern].count("circle") == 2


def test_a_pattern_ends_where_numbers_do_not_go_on(repository, caplog):
    with caplog.at_level(logging.WARNING):
        scenario = read_scenario(repository / "config/scenarios/straight.yaml")
    assert len(scenario.pattern) == 13
    assert "straight.yaml:128:3: pattern.15: step 15 and all below it are never reached" in caplog.text


@pytest.mark.slow
def test_of_a_number_twice_the_later_step_counts(repository, caplog):
    with caplog.at_level(logging.WARNING):
        scenario = read_scenario(repository / "config/scenarios/events.yaml")
    assert scenario.pattern[8].type == "claim" and len(scenario.pattern) == 18
    assert "events.yaml:101:3: pattern.9: the key '9' stands twice" in caplog.text


def test_a_file_that_is_not_yaml_says_where(repository):
    with pytest.raises(ConfigError, match=r"hw\.yaml:9:2: not YAML: .* map that begins in line 1"):
        read_scenario(repository / "test/data/scenarios/hw.yaml")


def test_a_missing_file_has_near_names(repository):
    with pytest.raises(ConfigError, match="did you mean: circular.yaml"):
        read_scenario(repository / "config/scenarios/circulr.yaml")


MISTAKES = [
    ("type: move", "type: mvoe", UnknownName, "26:11: pattern.2.type: unknown verb 'mvoe'", "move"),
    ("type: move", "type: 7", UnknownName, "26:11: pattern.2.type: unknown verb '7'", "one of move, turn, circle"),
    ("type: move\n    ", "", ConfigError, "25:3: pattern.2: the key 'type' is missing", "the verb: move, turn"),
    ("type: move", "tpye: move", ConfigError, "25:3: pattern.2: the key 'type' is missing", "did you mean: type?"),
    ("vel: 0.1", "vel:", ConfigError, "3:1: vel: the key 'vel' has no value", "fraction of what is left"),
    ("vel: 0.1", "vel: fast", ConfigError, "3:6: vel: expected a number, got 'fast'", ""),
    ("vel: 0.1", "vel: 1.5", ConfigError, "3:6: vel: expected a number of at most 1, got 1.5", ""),
    ("vel: 0.1", "vel: .nan", ConfigError, "3:6: vel: expected a finite number, got nan", ""),
    ("vel: 0.1", "vel: 0.1\nvel: 0.2", ConfigError, "4:1: vel: the key 'vel' stands twice", "in line 3"),
    ("dt: 0.01\n", "", ConfigError, "1:1: the key 'dt' is missing", "period [s]"),
    ("dt: 0.01", "dt: 0", ConfigError, "4:5: dt: expected a number of at least 0.0001, got 0", ""),
    ("y cp:", "y_cp:", UnknownName, "6:1: y_cp: unknown key 'y_cp'", "y cp"),
    ("pattern:", "patern:", UnknownName, "20:1: patern: unknown key 'patern'", "pattern"),
    ("base now: [0.0, ", "base now: [", ConfigError, "1:11: base now: expected a list of at least 4 values", "of 3"),
    ("x cp: [0.0, ", "x cp: [", ConfigError, "5:7: x cp: 3 numbers for 4 legs", "4 numbers"),
    ("  - [0.1, 0.1", "  - [0.1", ConfigError, "10:5: x cp ref[1]: 3 numbers for 4 legs", "4 numbers"),
    ("  - [0.1, 0.1", "  - [0.1, x", ConfigError, "10:11: x cp ref[1][1]: expected a number, got 'x'", ""),
    ("x_cp: 1", "x_cp: 2", ConfigError, "27:11: pattern.2.x_cp: there is no 2 in 'x cp ref'", "0 to 1"),
    ("base: 1", "base: 9", ConfigError, "30:11: pattern.2.base: there is no 9 in 'base ref'", "0 to 1"),
    ("cs: 0", "cs: 1", ConfigError, "31:9: pattern.2.cs: there is no 1 in 'cs ref'", "0 to 0"),
    ("cs: 0", "cs: 0\n    cs: 0", ConfigError, "32:5: pattern.2.cs: the key 'cs' stands twice", "in line 31"),
    ("cs: 0", "leg: 0", UnknownName, "31:5: pattern.2.leg: unknown key 'leg'", "one of x_cp, y_cp"),
    ("y_cp: 0\n    ", "", ConfigError, "25:3: pattern.2: the key 'y_cp' is missing", "row of `y cp ref`"),
    ("steps: 10", "steps: 1.5", ConfigError, "34:12: pattern.3.steps: expected a whole number, got 1.5", ""),
    ("steps: 10", "steps: -1", ConfigError, "34:12: pattern.3.steps: expected a number of at least 0", "-1"),
    ("type: wait\n    steps: 10", "type: claim\n    leg: 4", ConfigError, "34:10: pattern.3.leg: there is no 4", "3"),
    ("[3, 0, 0.25]", "[3, 0]", ConfigError, "24:9: pattern.1.motions[0]: expected a longer list", "list of 2"),
    ("[3, 0, 0.25]", "[4, 0, 0.2]", ConfigError, "24:10: pattern.1.motions[0][0]: expected a number of at most 3", "4"),
    ("[3, 0, 0.25]", "[1, 4, 0.2]", ConfigError, "24:13: pattern.1.motions[0][1]: there is no 4 in 'x cp'", "0 to 3"),
    ("[3, 0, 0.25]", "[1, 0, 2.0]", ConfigError, "24:16: pattern.1.motions[0][2]: a speed of 2", "above 0, up to 1"),
    ("[3, 0, 0.25]", "[3, 0, 0.0]", ConfigError, "25:3: pattern.2: step 2 of the pattern, 'move', never ends", "5 mm"),
    ("[3, 0, 0.25]", "[3, 0, 7.9]", ConfigError, "25:3: pattern.2: step 2 of the pattern, 'move', never ends", "5 mm"),
    ("[3, 0, 0.25]", "[3, 0, 1.0e-5]", ConfigError, "25:3: pattern.2: step 2 of the pattern, 'move', takes more", ""),
    ("  2:", "  two:", ConfigError, "25:3: pattern.two: 'two' is no number of a step", "1, 2, 3 and so on"),
    ("  1:", "  4:", ConfigError, "20:1: pattern: the pattern does not begin with step 1", "from 1 on"),
]


@pytest.mark.parametrize(("old", "new", "kind", "what", "cure"), MISTAKES, ids=[each[3] for each in MISTAKES])
def test_a_mistake_is_one_error_with_its_place(read, old, new, kind, what, cure):
    with pytest.raises(kind) as caught:
        read(text_of(old, new))
    assert not isinstance(caught.value, SolferErrors)
    assert f"file.yaml:{what}" in str(caught.value) and cure in str(caught.value)


@pytest.mark.parametrize("text", ["", "7", "[1]", "pattern: []", "pattern: {1: 2}", "{]", "\t", "a: \x01"])
def test_what_is_no_scenario_is_refused(read, text):
    with pytest.raises((ConfigError, SolferErrors), match=r"file\.yaml:1:"):
        read(text)


def test_several_mistakes_are_reported_at_once(read):
    text = text_of("vel: 0.1", "vel: fast").replace("type: wait", "type: wiat")
    with pytest.raises(SolferErrors) as caught:
        read(text)
    assert [error.where.split(":")[1] for error in caught.value.errors] == ["3", "33"]


def test_a_file_cut_off_anywhere_raises_nothing_else(read):
    text = text_of()
    for end in range(0, len(text), 7):
        try:
            read(text[:end])
        except (ConfigError, UnknownName, SolferErrors):
            continue


def test_other_numbers_of_legs_are_read(read):
    text = RELATIVE.replace("0.1, 0.1, -0.1, -0.1", "0.1, 0.1, 0.1").replace("0.1, -0.1, 0.1, -0.1", "0, 0, 0")
    lines = text.replace("p: [0.0, 0.0, 0.0, 0.0]", "p: [0.0, 0.0, 0.0]").splitlines()
    base = next(index for index, line in enumerate(lines) if "base ref" in line)
    lines[:base] = [line.replace("- [0.0, 0.0, 0.0, 0.0]", "- [0.0, 0.0, 0.0]") for line in lines[:base]]
    assert read("\n".join(lines)).legs == 3


@pytest.mark.parametrize("begin", ["base now", "x cp", "y cp", "z cp"])
def test_a_file_is_absolute_if_base_or_vertices_begin_somewhere(read, begin):
    assert not read(RELATIVE).is_absolute
    assert read(text_of(f"{begin}: [0.0", f"{begin}: [0.3")).is_absolute


@pytest.mark.parametrize("verb", ["{a: 1}", "[wait]", "1", "~"])
def test_a_verb_of_the_wrong_type_is_one_error(tmp_path, verb):
    good = (Path(__file__).parents[3] / "config/scenarios/straight.yaml").read_text()
    file = tmp_path / "wrong.yaml"
    file.write_text(re.sub(r"type: \w+", lambda _: f"type: {verb}", good, count=1))
    with pytest.raises(SolferError) as caught:
        read_scenario(file)
    assert re.match(rf"{re.escape(str(file))}:\d+:\d+: pattern", caught.value.where), caught.value
