"""Values in the text of a YAML file."""

import random

import pytest
import yaml

from solfer.config.yaml.edit import edited
from solfer.errors import ConfigError

TEXT = """\
# head
top:
  one: 1   # a number
  block:
    - 1.0  # first
    - {a: x, b: [1, 2]}

  "quoted key": 'text'  # in quotes
  empty:
  literal: |
    some text
  flow: {c: 1, d: {}}
# tail
last: end"""


def comments(text):
    return [line.partition("#")[2] for line in text.splitlines() if "#" in line]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("top", "one"), 2.5),
        (("top", "one"), [1.0, 2.0]),
        (("top", "block", 0), 3),
        (("top", "block", 1, "b", 1), 7),
        (("top", "block", 1, "c", "d"), "new: text"),
        (("top", "quoted key"), "é"),
        (("top", "empty"), True),
        (("top", "empty", "x", "y"), [0.5, 1.0]),
        (("top", "literal"), "t"),
        (("top", "new", "deep"), {"k": 1e-7}),
        (("top", "flow", "d", "e"), 1),
        (("top", "flow", "e"), 1),
        (("last",), 1),
        (("more", "m"), 1),
    ],
)
def test_one_value_changes_and_nothing_else(path, value):
    expected = yaml.safe_load(TEXT)
    place = expected
    for key in path[:-1]:
        if isinstance(place, dict) and place.get(key) is None:
            place[key] = {}
        place = place[key]
    place[path[-1]] = value
    found = edited(TEXT, "file", {path: value})
    assert yaml.safe_load(found) == expected
    assert comments(found) == comments(TEXT)


@pytest.mark.parametrize("path", [("top", "block", 5), ("top", "one", "below"), ("top", "flow", 0), ("top", 1)])
def test_what_has_no_place_is_refused(path):
    with pytest.raises(ConfigError, match="cannot be written here"):
        edited(TEXT, "file", {path: 1})


def test_lines_of_yaml_1_1_do_not_move_the_place():
    text = "# a\u2028b\nc: 'd\x85e'\nf: 1\n"
    assert edited(text, "x.yaml", {("f",): 2}) == text.replace("f: 1", "f: 2")


def test_a_new_text_is_a_tree():
    values = {("a", "b", "c"): 1.5, ("a", "d"): [1, 2]}
    assert yaml.safe_load(edited("", "file", values)) == {"a": {"b": {"c": 1.5}, "d": [1, 2]}}


@pytest.mark.parametrize("line", ["one: &mark 1\ntwo: *mark\n", "one: *no\n", "base: &b {x: 1}\none: *b\n"])
def test_anchors_are_kept_or_refused(line):
    try:
        found = edited(line, "file", {("one",): 3})
    except ConfigError:
        return
    assert yaml.safe_load(found) == yaml.safe_load(line) | {"one": 3}


def test_many_values_at_once():
    """Numbers of the text change one after the other, in any order."""
    draw = random.Random(4)
    paths = [("top", "one"), ("top", "block", 0), ("top", "block", 1, "b", 0), ("top", "flow", "c"), ("top", "n")]
    for _ in range(20):
        draw.shuffle(paths)
        found = yaml.safe_load(edited(TEXT, "file", {path: draw.random() for path in paths}))
        assert found["top"]["quoted key"] == "text" and found["last"] == "end"
