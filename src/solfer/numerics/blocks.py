"""Blocks: all that a compiled loop reads and writes, which it gets as one address.

A layout names numbers and arrays with their shapes. `BlockLayout.at(address)` is a named tuple of them:

    layout = BlockLayout("Polygon", count=int, margin=float, vertices=(float, "count", 3), lifted=(bool, "count"))
    polygon_at = layout.at

    def _shift(address, distance):
        polygon = polygon_at(address)
        for index in range(polygon.count):
            polygon.vertices[index, 2] += distance

The arrays are those of the caller, who keeps a `MemoryBlock` of them; what a loop does not use costs nothing. At the
address of a block such a function also runs without the compiler, under a debugger: `_shift(block.address, 0.1)`.
"""

import re
from collections import namedtuple
from typing import Any

import numpy as np
from numba import boolean, carray, float64, from_dtype, int64, njit

from solfer.numerics.pointers import address, pointer_to

_TYPES = {float: float64, int: int64, bool: boolean}


class BlockLayout:
    """The names, types and shapes of what a block holds.

    Args:
        name: Name of the tuples.
        fields: `int` or `float` for a number, and (type, *shape) for an array of numbers or NumPy records, in whose
            shape a text is made of numbers of the block, such as `(float, "count", 3)` or `(float, "3 * count")`.

    Attributes:
        at: Compiled function that returns what is at an address.
        tuple: The type of what it returns.
    """

    def __init__(self, name: str, **fields: Any):
        self.fields = fields
        self.tuple = namedtuple(name, list(fields))  # type: ignore[misc]  # names are those of the fields
        self.record = np.dtype([(field, np.float64 if kind is float else np.int64) for field, kind in fields.items()])
        record = from_dtype(self.record)
        known: dict[str, Any] = {"Tuple": self.tuple, "carray": carray, "pointer": pointer_to(record)}
        parts = []
        for field, kind in fields.items():
            place = f"record.{field}"
            if isinstance(kind, tuple):
                base, *shape = kind
                known[f"pointer_{field}"] = pointer_to(_TYPES.get(base) or from_dtype(np.dtype(base)))
                sizes = [re.sub(r"([a-z]\w*)", r"record.\1", str(size)) for size in shape]
                place = f"carray(pointer_{field}({place}), ({', '.join(sizes)},))"
            parts.append(place)
        text = (
            f"def at(address):\n    record = carray(pointer(address), (1,))[0]\n    return Tuple({', '.join(parts)})\n"
        )
        exec(text, known)
        self.at: Any = njit(inline="always")(known["at"])

    def shape(self, field: str, numbers: dict[str, Any]) -> tuple[int, ...]:
        """Return the shape of an array of a block with these numbers."""
        return tuple(eval(str(size), {}, numbers) for size in self.fields[field][1:])


class MemoryBlock:
    """The numbers and arrays of a compiled loop; it keeps the arrays alive.

    Args:
        layout: The layout.
        fields: Numbers, and arrays that stay where they are, of its types and shapes. None stands for an array that the
            loop does not touch, and what is left out is 0.

    Attributes:
        arrays: The arrays by their names.
        record: The numbers, which may be changed, and the addresses of the arrays, shape ().
        address: What a compiled loop gets.
    """

    def __init__(self, layout: BlockLayout, **fields: Any):
        self.arrays = {name: value for name, value in fields.items() if isinstance(value, np.ndarray)}
        self.record = np.zeros((), layout.record)
        for name, value in fields.items():
            if name not in self.arrays:
                self.record[name] = 0 if value is None else value
        for name, array in self.arrays.items():
            base = np.dtype(layout.fields[name][0])
            shape = layout.shape(name, fields)
            assert array.dtype == base and array.shape == shape and array.flags.c_contiguous, (name, base, shape)
            self.record[name] = address(array)
        self.address = address(self.record)
