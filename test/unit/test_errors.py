"""Errors: what they say of a failure in the code of others, and how several are compared."""

import json

import numpy as np
import pytest

from solfer.errors import (
    LONGEST_NAME,
    LONGEST_TEXT,
    ConfigError,
    SolferErrors,
    UnknownName,
    described,
    located,
    nearest,
    repeats,
    singles,
)
from solfer.model import State


def inner():
    raise ValueError("no such gain")


def outer():
    inner()


def in_a_library():
    np.linalg.inv(json.loads("3"))


def failure(call):
    with pytest.raises(Exception) as caught:
        call()
    return caught.value


def line_of(function, offset=1):
    return function.__code__.co_firstlineno + offset


def test_a_failure_names_the_lines_of_its_author():
    text = located(failure(outer))
    assert text.startswith("ValueError: no such gain (at ")
    assert text.endswith(f"{__file__}:{line_of(outer)} in outer, {__file__}:{line_of(inner)} in inner)")


@pytest.mark.parametrize("call", [in_a_library, lambda: State(("a",))["colour"]])
def test_our_places_and_those_of_libraries_are_left_out(call):
    text = located(failure(call))
    last = text.rpartition(", ")[2].rpartition("(at ")[2]
    assert last.startswith(f"{__file__}:{line_of(call, call is in_a_library)} in ")
    assert "site-packages" not in text and "model/state.py" not in text


def test_an_error_without_a_place_says_none():
    assert located(ConfigError("wrong", expected="right")) == "wrong (expected: right)"


def test_several_errors_are_seen_one_by_one():
    first, second = ConfigError("a 'b'", where="x:1:2"), UnknownName("c", "d", ("e",))
    assert list(singles([SolferErrors([first, SolferErrors([second])]), first])) == [first, second, first]


@pytest.mark.parametrize(
    ("what", "where", "repeated"),
    [("not 'b' again", "x:1:2", True), ("'c'", "x:1:2", False), ("'b'", "x:1:3", False), ("'b'", "", False)],
)
def test_an_error_repeats_another_at_its_place(what, where, repeated):
    assert repeats(ConfigError(what, where=where), [ConfigError("a 'b'", where="x:1:2")]) is repeated


def test_long_names_are_not_compared():
    known = ["a" * LONGEST_NAME, "b"]
    assert nearest("a" * LONGEST_NAME, known) == known[:1]
    assert nearest("a" * (LONGEST_NAME + 1), known) == []


@pytest.mark.parametrize("length", [LONGEST_TEXT, LONGEST_TEXT + 1])
def test_a_long_description_is_cut(length):
    cut = "..." if length > LONGEST_TEXT else ""
    assert described(ConfigError("x" * length)) == "x" * LONGEST_TEXT + cut
