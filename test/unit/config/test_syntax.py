"""Texts that are not YAML: the error names the place and the cure, in words of ours."""

import pytest

from solfer.config.yaml.compose import compose
from solfer.config.yaml.problems import Problems
from solfer.errors import ConfigError

TEXTS = {
    "a: {b: 1\nc: 2\n": ("2:2", "the map that begins with '{' in line 1"),
    "a: [1, 2\nb: 3\n": ("2:2", "the list that begins with '[' in line 1"),
    "a:\n  b 1\n  c: 2\n": ("2:3", "the key 'b' is not apart from its value, '1'"),
    "a: 1\nb 2\nc: 3\n": ("2:1", "the key 'b' is not apart from its value, '2'"),
    "a: 1\nb:2\nc: 3\n": ("2:1", "the key 'b' is not apart from its value, '2'"),
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
    "a:\n  b: 1\n  c:\u00a02\n": ("3:5", "NO-BREAK SPACE (U+00A0) instead of a blank"),
    "a:\u00a02\n": ("1:3", "NO-BREAK SPACE (U+00A0)"),
    "a:\n\u00a0\u00a0b: 1\n": ("2:1", "NO-BREAK SPACE (U+00A0)"),
    "a: 1\n\u200bb: 2\n": ("2:1", "ZERO WIDTH SPACE (U+200B)"),
    "a: 1\u3000\n": ("1:5", "IDEOGRAPHIC SPACE (U+3000)"),
    "a: {b:\u20091}\n": ("1:7", "THIN SPACE (U+2009)"),
    "a: \x01": ("1:1", "characters that YAML forbids"),
}


@pytest.mark.parametrize(("text", "place", "words"), [(text, *found) for text, found in TEXTS.items()])
def test_a_text_that_is_not_yaml(text, place, words):
    with pytest.raises(ConfigError) as caught:
        compose(text, "a.yaml", Problems())
    error = caught.value
    assert error.where == f"a.yaml:{place}" and error.what.startswith("not YAML: ") and words in error.what
    assert error.expected and "did not find" not in str(error)


@pytest.mark.parametrize(
    "text", ["a: 5\u00a0m\n", "a: '\u00a0b:\u00a0c'\n", "# b:\u00a0c\na: 1  # d:\u00a0e\n", "a: é\n"]
)
def test_blanks_of_other_kinds_stay_inside_of_texts(text):
    compose(text, "a.yaml", Problems())
