"""The kernel: executes the points' instructions in order. It is compiled, or read from the cache, on import.

It keeps the lock of Python's interpreter: releasing it for a microsecond may cost milliseconds to get it back.
"""

from collections.abc import Callable
from enum import IntEnum
from importlib import import_module
from pathlib import Path
from typing import Any

from numba import carray, njit

from solfer.numerics.compilation import cached
from solfer.points.compiled.algebra import orientation_difference
from solfer.points.compiled.instruction import instructions, integers, jacobian_of, programs
from solfer.points.compiled.registry import KERNELS, Kernel

FILES = sorted(Path(__file__).parent.glob("*.py"))

for _file in FILES:
    if _file != Path(__file__):
        import_module(f"{__package__}.{_file.stem}")

Operation = IntEnum("Operation", sorted(KERNELS))  # type: ignore[misc]  # each file adds its own
"""Numbers of the kernels in instructions."""


def _dispatcher(kernels: dict[str, Kernel]) -> Callable[..., Any]:
    """Write the function that calls the kernel of an instruction: the compiler needs to see every call."""
    calls = (f"    if row.operation == {one}: return {one.name}(row, program, with_jacobian)" for one in Operation)
    names = {name: one.function for name, one in kernels.items()}
    exec("\n".join(("def dispatch(row, program, with_jacobian):", *calls)), names)
    return njit(names["dispatch"])


dispatch = _dispatcher(KERNELS)


def _run(address, with_jacobians):
    """Update the points of the program at an address; see `solfer.points.compiled.instruction`."""
    program = carray(programs(address), (1,))[0]
    rows = carray(instructions(program.instructions), (program.count,))
    for index in range(program.count):
        row = rows[index]
        flags = carray(integers(row.flags), (2,))
        if with_jacobians and flags[0]:
            jacobian_of(row, program)[:] = 0.0
            flags[0] = 0
        dispatch(row, program, with_jacobians and not flags[1])


def _difference(a, b, out):
    """Compute a difference; see `orientation_difference`."""
    orientation_difference(a, b, out)


run = cached("void(int64, boolean)", _run, sources=FILES)
difference = cached("void(float64[::1], float64[::1], float64[::1])", _difference, sources=FILES)
