"""YAML to Nodes: values as YAML 1.2 defines them, places as an editor shows them."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solfer.config.yaml.compose import compose
from solfer.config.yaml.nodes import YamlNode
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError, SolferError, SolferErrors

LARGEST = 200_000  # values of a file, aliases counted


def node_of(text: str) -> YamlNode:
    problems = Problems()
    node = compose(text, "x.yaml", problems)
    problems.raise_if_any()
    return node


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("1e-3", 0.001),
        ("5e1", 50.0),
        ("-1.5E+2", -150.0),
        (".5", 0.5),
        ("2.", 2.0),
        ("0777", 777),
        ("0o17", 15),
        ("0x1F", 31),
        ("+12", 12),
        ("-.inf", -math.inf),
        ("1:30", "1:30"),
        ("1_000", "1_000"),
        ("yes", "yes"),
        ("off", "off"),
        ("true", True),
        ("~", None),
        ("", None),
        ("'1'", "1"),
        ('"true"', "true"),
        ("2024-01-01", "2024-01-01"),
        ("123456789012345678901", 123456789012345678901.0),
        ("0x" + "f" * 40, "0x" + "f" * 40),
        ("!!str 5", "5"),
        ("!!float 5", 5.0),
    ],
)
def test_words_are_those_of_yaml_1_2(word, value):
    got = node_of(f"a: {word}").get("a")
    assert (got.value if got else None) == value
    assert type(got.value if got else None) is type(value)


def test_nan_is_a_number():
    assert math.isnan(node_of("a: .nan").get("a").value)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**17), 10**17) | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "Zs"))),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text("abcxyz_", min_size=1), inner, max_size=4),
    max_leaves=20,
)  # fmt: skip


@pytest.mark.slow
@given(json_values)
def test_json_is_read_as_yaml(value):
    assert node_of(json.dumps({"top": value}, ensure_ascii=False)).plain() == {"top": value}


def test_places_count_from_one_and_characters_not_bytes():
    node = node_of("# ä\nläufer:\n  äö: [1, {b: 2}]\n")
    value = node.get("läufer", "äö", 1, "b")
    assert str(value.mark) == "x.yaml:3:15: läufer.äö[1].b"
    assert str(value.head) == "x.yaml:3:12: läufer.äö[1].b"


@pytest.mark.parametrize("character", ["\x85", "\u2028", "\u2029"])
def test_lines_end_where_those_of_yaml_1_2_do(character):
    """In a comment, a text in quotes and a key; the place of a mistake below is that of an editor."""
    text = f"# one{character}two: 3\na: 'b{character}\ue000c'\nd{character}e: 5  # f{character}\n"
    node = node_of(text)
    assert node.plain() == {"a": f"b{character}\ue000c", f"d{character}e": 5}
    assert str(dict(node.items())[f"d{character}e"].mark) == f"x.yaml:3:6: d{character}e"
    with pytest.raises(ConfigError, match=r"^x.yaml:4:5: not YAML: a colon where no key can be"):
        node_of(f"{text}g: h: i\n")


def test_aliases_keep_the_places_of_their_content():
    node = node_of("one: &one {a: 1}\ntwo: *one\n")
    assert str(node.get("two").mark) == "x.yaml:2:6: two"
    assert str(node.get("two", "a").mark) == "x.yaml:1:15: one.a"


def test_an_anchor_may_be_defined_again():
    assert node_of("a: &x 1\nb: *x\nc: &x 2\nd: *x\n").plain() == {"a": 1, "b": 1, "c": 2, "d": 2}


def test_own_keys_win_over_merge_keys():
    node = node_of("p: &p {a: 1, b: 2}\nq: &q {b: 3, c: 4}\nr:\n  <<: [*p, *q]\n  a: 9\n")
    assert node.get("r").plain() == {"a": 9, "b": 2, "c": 4}
    assert node.get("r", "c").mark.line == 2


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("", "x.yaml:1:1", "the file is empty"),
        ("# only a comment\n", "x.yaml:1:1", "the file is empty"),
        ("a:\n\tb: 1\n", "x.yaml:2:1", "not YAML: a tab in the indentation"),
        ("a: [1, 2\nb: 3\n", "x.yaml:2:2", "not YAML"),
        ("a: b: c\n", "x.yaml:1:5", "not YAML"),
        ("a: *b\n", "x.yaml:1:4: a", "no anchor '&b'"),
        ("a: &a [*a]\n", "x.yaml:1:8: a[0]", "no anchor '&a' is complete"),
        ("a: 1\n---\nb: 2\n", "x.yaml:2:1", "a second YAML document"),
        ("[a, b]: 1\n", "x.yaml:1:1", "a key has to be a plain word"),
        ("a: \x07\n", "x.yaml:1:1", "characters that YAML forbids"),
        ("a: 1\nb: 2\na: 3\n", "x.yaml:3:1: a", "the key 'a' stands twice"),
        ("a:\n  <<: 3\n", "x.yaml:2:7: a.<<", "expected a map behind '<<', got 3"),
        ("a:\n  <<: [[b]]\n", "x.yaml:2:8: a.<<[0]", "expected a map behind '<<', got a list"),
        ("a:\n  <<: [~]\n", "x.yaml:2:8: a.<<[0]", "expected a map behind '<<', got nothing"),
        ("a: !!int x\n", "x.yaml:1:4: a", "'x' is not of the tag's kind '!!int'"),
        ("a: !robot x\n", "x.yaml:1:4: a", "unknown tag '!robot'"),
        ("[" * 100, "x.yaml:1:65", "more than 64 levels"),
    ],
)
def test_what_is_not_ours_is_placed(text, where, what):
    with pytest.raises(ConfigError) as caught:
        node_of(text)
    assert caught.value.where == where
    assert what in caught.value.what


def test_aliases_cannot_grow_without_bound():
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
    with pytest.raises(ConfigError, match="values, aliases counted"):
        node_of("\n".join(lines))


def test_each_value_and_each_alias_counts():
    lines, size, sizes = [], 1, [1]  # the map
    for name, (count, inner) in enumerate([(10, 0), (10, 1), (10, 2), (10, 3), (16, 4), (8, 3)], 1):
        lines.append(f"a{name}: &a{name} [{', '.join([f'*a{inner}' if inner else 'x'] * count)}]")
        sizes.append(1 + count * sizes[inner])
        size += sizes[-1]
    values = LARGEST - size - 1
    lines.append(f"b: [{'1,' * values}]")
    assert len(node_of("\n".join(lines)).get("b").value) == values == 988
    with pytest.raises(ConfigError, match="values, aliases counted") as caught:
        node_of("\n".join([*lines, "c: 3"]))
    assert caught.value.where == "x.yaml:8:4: c"


def test_all_doubled_keys_are_reported():
    with pytest.raises(SolferErrors) as caught:
        node_of("a: 1\na: 2\nb: {c: 1, c: 2}\n")
    assert [error.where for error in caught.value.errors] == ["x.yaml:2:1: a", "x.yaml:3:11: b.c"]


def test_where_later_keys_count_they_are_warnings():
    problems = Problems()
    node = compose("a:\n  x: 1\n  y: 2\n  x: 3\nb: 4\n", "x.yaml", problems, later=("a",))
    assert not problems and node.plain() == {"a": {"x": 3, "y": 2}, "b": 4}
    (notice,) = problems.notices
    assert str(notice) == "x.yaml:4:3: a.x: the key 'x' stands twice: this one counts, not that in line 2"


def test_elsewhere_a_key_that_stands_twice_stays_a_mistake():
    problems = Problems()
    compose("a: {x: 1, x: 2}\nb: 3\nb: 4\n", "x.yaml", problems, later=("a",))
    assert [str(error) for error in problems.errors] == [
        "x.yaml:3:1: b: the key 'b' stands twice\n  expected: only the one in line 2"
    ]


@pytest.mark.parametrize(
    "value", ["!foo 1", "!foo [1]", "!foo {b: 1}", "!!set {b: 1}", "!!python/tuple [1]", "!!map [1]"]
)
def test_unknown_tags_are_errors_on_every_kind_of_value(value):
    problems = Problems()
    compose(f"a: {value}", "x.yaml", problems)
    with pytest.raises(SolferError, match="unknown tag") as caught:
        problems.raise_if_any()
    assert caught.value.where == "x.yaml:1:4: a"


def test_tags_of_keys_and_known_tags():
    problems = Problems()
    assert compose("a: !!seq [1]\nb: !!map {c: !!int 1}\n!!str d: ! x", "x.yaml", problems).plain() == {
        "a": [1], "b": {"c": 1}, "d": "x",
    }  # fmt: skip
    problems.raise_if_any()
    compose("!foo a: 1", "x.yaml", problems)
    with pytest.raises(SolferError, match="unknown tag '!foo'"):
        problems.raise_if_any()
