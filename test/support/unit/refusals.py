"""Refusals: their class, their place and words of their text."""

import pytest


def check_refusal(call, error, place, words):
    """Check that a call is refused by an error of that very class, at a place, and with these words."""
    with pytest.raises(error) as refusal:
        call()
    assert (type(refusal.value), refusal.value.where) == (error, place), refusal.value
    assert words in refusal.value.line, refusal.value


def place_of(text, part, file):
    """Return file, line and column where the text of a file has a part for the first time."""
    lines = text[: text.index(part)].split("\n")
    return f"{file}:{len(lines)}:{len(lines[-1]) + 1}"
