"""Blocks of numbers and arrays: what compiled loops see at their address, and the same loop without the compiler."""

import numpy as np
import pytest
from numpy.testing import assert_equal

from solfer.numerics.blocks import BlockLayout, MemoryBlock
from solfer.numerics.compilation import cached

SPRING = np.dtype([("stiffness", float), ("count", np.int64)])
LAYOUT = BlockLayout(
    "Springs",
    size=int,
    factor=float,
    spring=(SPRING, 1),
    forces=(float, 2, "size"),
    held=(bool, "size"),
    dofs=(int, "2 * size"),
)
springs_at = LAYOUT.at


def _scale(address):
    """Write forces of springs that are not held to the row of the second ones."""
    springs = springs_at(address)
    for index in range(springs.size):
        if not springs.held[index]:
            stiffness = springs.factor * springs.spring[0]["stiffness"]
            springs.forces[1, index] = stiffness * springs.forces[0, springs.dofs[index]]


def make(**changed):
    fields = {
        "size": 3,
        "factor": 2.0,
        "spring": np.array([(5.0, 1)], dtype=SPRING),
        "forces": np.array([[1.0, 2.0, 3.0], [7.0, 7.0, 7.0]]),
        "held": np.array([False, True, False]),
        "dofs": np.array([2, 1, 0, 0, 0, 0]),
    }
    return fields | changed


def test_a_loop_writes_the_arrays_of_its_caller():
    fields = make()
    block = MemoryBlock(LAYOUT, **fields)
    cached("void(int64)", _scale)(block.address)
    assert_equal(fields["forces"][1], [30.0, 7.0, 10.0])
    block.record["factor"] = 1.0
    _scale(block.address)  # without the compiler
    assert_equal(fields["forces"][1], [15.0, 7.0, 5.0])


@pytest.mark.parametrize(
    "changed",
    [{"forces": np.zeros((3, 2))}, {"dofs": np.zeros(6)}, {"held": np.zeros(6, dtype=bool)[::2]}, {"size": 2}],
    ids=["shape", "type", "not contiguous", "size"],
)
def test_other_arrays_are_refused(changed):
    with pytest.raises(AssertionError):
        MemoryBlock(LAYOUT, **make(**changed))
