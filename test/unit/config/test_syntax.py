"""Texts that are not YAML: the error names the place and the cure, in words of ours."""

import pytest

from solfer.config.yaml.compose import compose
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError

TEXTS = {
    "a: {b: 1\nc: 2\n": ("2:2", "the map that begins with '{' in line 1"),
    "a: [1, 2\nb: 3\n": ("2:2", "the list that begins with '[' in line 1"),
    "a:\n  b 1\n  c: 2\n": ("3:4", "a colon where no key can be"),
    "a: b: c\n": ("1:5", "a colon where no key can be"),
    'a: "abc\nb: 2\n': ("3:1", "the quote in line 1"),
    "a:\n    b: 1\n  c: 2\n": ("3:3", "the map that begins in line 1"),
    'a: "x" y\n': ("1:8", "the map that begins in line 1"),
    "a:\n  - 1\n  b: 2\n": ("3:3", "the list that begins in line 2"),
    "a: *\n": ("1:5", "no name behind '*'"),
    "a: &\n": ("1:5", "no name behind '&'"),
    "%foo\na: 1": ("1:5", "begins with '%'"),
    "a: @x\n": ("1:4", "a value begins with '@'"),
    "a: `x\n": ("1:4", "a value begins with '`'"),
    "a:\n\tb: 1\n": ("2:1", "a tab in the indentation"),
    'a: "\\q"\n': ("1:5", "no such escape"),
    "a: 1\n...\nb": ("3:1", "behind the end of the document"),
    "a: |x\n b\n": ("1:5", "behind '|' or '>'"),
    "a: [1,,2]\n": ("1:7", "no value here"),
    "a: !<x\n": ("1:7", "cannot be read"),
    "a: \x01": ("1:1", "characters that YAML forbids"),
}


@pytest.mark.parametrize(("text", "place", "words"), [(text, *found) for text, found in TEXTS.items()])
def test_a_text_that_is_not_yaml(text, place, words):
    with pytest.raises(ConfigError) as caught:
        compose(text, "a.yaml", Problems())
    error = caught.value
    assert error.where == f"a.yaml:{place}" and error.what.startswith("not YAML: ") and words in error.what
    assert error.expected and "did not find" not in str(error)
