"""Refusals: their class, their place and words of their text."""

import pytest


def check_refusal(call, error, place, words):
    """Check that a call is refused by an error of that very class, at a place, and with these words."""
    with pytest.raises(error) as refusal:
        call()
    assert (type(refusal.value), refusal.value.where) == (error, place), refusal.value
    assert words in refusal.value.line, refusal.value
