"""Laying files over each other."""

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from solfer.config.yaml.compose import compose
from solfer.config.yaml.merge import merge, overlaid
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.config.yaml.problems import Problems

SCALARS = st.integers() | st.booleans() | st.text("abc", min_size=1)
LISTS = st.lists(SCALARS, max_size=3)
NAMES = st.sampled_from("abcd")
MAPS = st.dictionaries(NAMES, st.recursive(SCALARS | LISTS, lambda x: st.dictionaries(NAMES, x), max_leaves=8))


def as_node(value: object, file: str = "x") -> YamlNode:
    if isinstance(value, dict):
        value = {key: as_node(child, file) for key, child in value.items()}
    elif isinstance(value, list):
        value = tuple(as_node(child, file) for child in value)
    return YamlNode(value, Mark(file, 1, 1))


def merged(base: object, over: object, path: tuple = ()) -> tuple[object, Problems]:
    problems = Problems()
    return merge(as_node(base), as_node(over), problems, path).plain(), problems


def expected(base: dict, over: dict) -> tuple[dict, bool]:
    """Merge by the rule in its plainest form: maps recursively, all else replaced; note clashes of kinds."""
    result, clash = copy.deepcopy(base), False
    for key, value in over.items():
        if key in base and isinstance(base[key], dict) and isinstance(value, dict):
            result[key], below = expected(base[key], value)
            clash |= below
        elif key in base and isinstance(base[key], dict) != isinstance(value, dict):
            clash = True
        else:
            result[key] = value
    return result, clash


@pytest.mark.slow
@given(MAPS, MAPS)
def test_maps_are_merged_and_all_else_is_replaced(base, over):
    result, problems = merged(base, over)
    assert (result, bool(problems)) == expected(base, over)


@pytest.mark.slow
@given(MAPS)
def test_merging_nothing_or_itself_changes_nothing(tree):
    assert merged(tree, {})[0] == merged({}, tree)[0] == merged(tree, tree)[0] == merged(tree, None)[0] == tree


@pytest.mark.parametrize("value", [1, "text", ["x"], {"b": 1}])
def test_an_empty_key_changes_nothing(value):
    assert merged({"a": value}, {"a": None})[0] == merged({"a": None}, {"a": value})[0] == {"a": value}


@pytest.mark.slow
@given(MAPS, MAPS, MAPS)
def test_merging_is_associative(a, b, c):
    left, problems = merged(merged(a, b)[0], c)
    below, more = merged(b, c)
    right, most = merged(a, below)
    if not (problems or more or most or merged(a, b)[1]):
        assert left == right


@pytest.mark.slow
@given(MAPS, MAPS)
def test_each_value_keeps_its_file(base, over):
    def check(node: YamlNode, first: YamlNode | None, second: YamlNode | None) -> None:
        if isinstance(node.value, dict):
            for key, child in node.items():
                check(child, first.get(key) if first else None, second.get(key) if second else None)
        else:
            writer = second if second is not None and second.plain() == node.plain() else first
            assert node.mark.file == writer.mark.file

    problems = Problems()
    first, second = as_node(base, "base"), as_node(over, "over")
    result = merge(first, second, problems)
    if not problems:
        check(result, first, second)


@pytest.mark.parametrize(
    ("path", "base", "over", "result"),
    [
        (("ros", "source"), {"urdf": "/a"}, {"urdf": {"file": "b"}}, {"urdf": {"file": "b"}}),
        (("ros", "source"), {"urdf": {"path": "p", "file": "b"}}, {"urdf": "/a"}, {"urdf": "/a"}),
        (("ros", "source"), {"urdf": {"path": "p", "file": "b"}}, {"urdf": {"file": "c"}},
         {"urdf": {"path": "p", "file": "c"}}),
        (("robot", "r"), {"feedback": {"layer": "a"}}, {"feedback": {"list": ["x"]}}, {"feedback": {"list": ["x"]}}),
        (("robot", "r"), {"feedback": {"list": ["x"]}}, {"feedback": {"layer": "a"}}, {"feedback": {"layer": "a"}}),
        (("robot", "r"), {"feedback": {"layer": "b"}}, {"feedback": {"layer": "a"}}, {"feedback": {"layer": "a"}}),
        ((), {"controllers": {"d": {"list": ["x"]}}}, {"controllers": {"d": ["y"]}}, {"controllers": {"d": ["y"]}}),
        ((), {"layers": {"RT": "a"}}, {"layers": {"RT": {"file": "b"}}}, {"layers": {"RT": {"file": "b"}}}),
        (("modules", "m"), {"controller": "direct"}, {"controller": ["x"]}, {"controller": ["x"]}),
    ],
)  # fmt: skip
def test_alternatives_of_the_grammar_replace_each_other(path, base, over, result):
    got, problems = merged(base, over, path)
    assert got == result
    assert not problems


def test_a_clash_keeps_the_earlier_value():
    problems = Problems()
    base = compose("feedback:\n  dofs: {chain: all}\n", "main.yaml", problems)
    over = compose("feedback:\n  dofs: wheels\n", "over.yaml", problems)
    result = merge(base, over, problems)
    assert result.plain() == {"feedback": {"dofs": {"chain": "all"}}}
    with pytest.raises(Exception, match=r"over.yaml:2:9: feedback.dofs: 'wheels' cannot replace a map") as caught:
        problems.raise_if_any()
    assert "main.yaml:2:9" in caught.value.expected


def test_parts_are_laid_over_in_their_order():
    problems = Problems()
    parts = [as_node({"a": 1, "b": {"c": 1}}), None, as_node({"b": {"c": 2, "d": 2}}), as_node({"b": {"d": 3}})]
    assert overlaid(parts, problems).plain() == {"a": 1, "b": {"c": 2, "d": 3}}
    assert overlaid((None, parts[0], None), problems) is parts[0] and overlaid((None,), problems) is None
    assert not problems
