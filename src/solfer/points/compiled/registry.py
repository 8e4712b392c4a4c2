"""The table of kernels, in which each registers itself."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from numba import njit


@dataclass(frozen=True)
class Kernel:
    """An operation on one point.

    Attributes:
        name: Name of the operation.
        function: What is compiled; arguments as in `kernel`.
    """

    name: str
    function: Callable[..., Any]


KERNELS: dict[str, Kernel] = {}
"""All kernels by their names."""


def kernel(function: Callable[..., None]) -> Kernel:
    """Register a function as an operation that instructions may name.

    It has the arguments `row`, a record `instruction.INSTRUCTION`, `program`, a record `instruction.PROGRAM`, and
    `with_jacobian`, whether the Jacobian is written; it writes value and Jacobian in place and allocates nothing. All
    files of this folder are compiled together, and no others.
    """
    name = function.__name__
    if name in KERNELS or not function.__module__.startswith(f"{__package__}."):
        raise ValueError(f"the kernel '{name}' of {function.__module__} has to be in {__package__}, and once")
    KERNELS[name] = Kernel(name, njit(function))
    return KERNELS[name]
