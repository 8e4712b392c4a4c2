"""Fences that Python calls between accesses to memory that processes share; see `segments/words.py`."""

from solfer.numerics.compilation import cached
from solfer.numerics.pointers import acquire_fence, release_fence


def _acquire():
    acquire_fence()


def _release():
    release_fence()


acquire = cached("void()", _acquire)
"""acquire(): all later accesses wait for all earlier reads."""

release = cached("void()", _release)
"""release(): all later writes wait for all earlier accesses."""
