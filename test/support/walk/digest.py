"""A digest of objects that run: their numbers, names and parts, without the records that they were made from."""

import functools
import hashlib
import logging
import re
import threading
import types
import weakref
from collections import deque
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from solfer.config import Record
from solfer.config.loading.configuration import Configuration
from solfer.config.yaml.nodes import Mark, YamlNode
from solfer.middleware.memory.bus import Bus, Topic
from solfer.numerics.blocks import MemoryBlock
from solfer.plugins.timing.cycle_timing import CycleTiming
from solfer.points.point import Layout
from solfer.points.program import Instruction, Program
from solfer.throttle import Throttle

LEFT_OUT = (
    Record,  # a tag that goes no further than its record has no effect
    Configuration,
    YamlNode,
    Mark,
    Bus,  # the whole world hangs on these; what is published is digested by itself
    Topic,
    Program,  # addresses
    Instruction,
    Layout,
    CycleTiming,
    Throttle,
    logging.Logger,
    types.ModuleType,
    type(threading.Lock()),
    type(threading.RLock()),
    weakref.ref,
    memoryview,
)
ADDRESSES = ("numba", "llvmlite", "pinocchio", "concurrent", "threading", "pybullet", "ctypes")
"""Packages whose objects have nothing that a tag could change, or only what is seen elsewhere."""


PLACE = re.compile(r"[^ ]*\.yaml(:\d+)+(: [\w.]+)?")
"""Places in files, which move with every change; they are for errors."""

UNSTEADY = (
    "_version",
    "client",
    "_client",
    "_program",
)
"""Attributes that count what happened in this process before."""

LEAST_ADDRESS = 0x400000
"""Whole numbers from here on are addresses of what is elsewhere, or times."""


class Digest:
    """Digests objects, each of them once."""

    def __init__(self) -> None:
        self._hash, self._seen, self._kept = hashlib.sha256(), {}, []

    def add(self, value: Any) -> "Digest":
        """Add an object with all its parts."""
        pending = deque([value])
        while pending:
            pending.extendleft(reversed(self._one(pending.popleft())))
        return self

    def text(self) -> str:
        """Return the digest."""
        return self._hash.hexdigest()

    def _one(self, value: Any) -> list[Any]:
        """Add an object itself; return its parts."""
        if isinstance(value, np.ndarray):
            self._put(value.dtype.str, value.shape)
            if value.dtype == object:
                return value.ravel().tolist()
            if value.dtype == np.int64:
                value = np.where(value < LEAST_ADDRESS, value, LEAST_ADDRESS)
            self._hash.update(np.ascontiguousarray(value).tobytes())
            return []
        if isinstance(value, int | np.integer) and value >= LEAST_ADDRESS:
            value = LEAST_ADDRESS
        if isinstance(value, str):
            value = PLACE.sub("", value)
        if value is None or isinstance(value, bool | int | float | complex | str | bytes | np.generic | Enum | Path):
            self._put(type(value).__name__, value)
            return []
        if isinstance(value, type):
            self._put(value.__qualname__)
            return []
        if isinstance(value, LEFT_OUT) or type(value).__module__.startswith(ADDRESSES):
            return []
        if isinstance(value, Digest):
            return []
        if id(value) in self._seen:
            self._put("again", self._seen[id(value)])
            return []
        self._seen[id(value)] = len(self._seen)
        self._kept.append(value)  # so that no other object gets its id
        return self._parts(value)

    def _parts(self, value: Any) -> list[Any]:
        self._put(type(value).__qualname__)
        if isinstance(value, dict):
            return [part for item in value.items() for part in item]
        if isinstance(value, set | frozenset):
            return sorted(value, key=repr)
        if isinstance(value, list | tuple | deque):
            self._put(len(value))
            return list(value)
        if isinstance(value, functools.partial):
            return [value.func, value.args, value.keywords]
        if isinstance(value, types.MethodType):
            return [value.__func__.__qualname__, value.__self__]
        if isinstance(value, MemoryBlock):  # its record has addresses of its arrays
            numbers = [name for name in value.record.dtype.names if name not in value.arrays]
            return [[value.record[name].item() for name in numbers], value.arrays]
        if isinstance(value, types.FunctionType):
            cells = [cell.cell_contents for cell in value.__closure__ or () if _full(cell)]
            return [value.__qualname__, cells, value.__defaults__]
        slots = [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ()) if name[:2] != "__"]
        inside = getattr(value, "__dict__", {})
        held = {name: getattr(value, name) for name in slots if hasattr(value, name)}
        held |= inside if isinstance(inside, dict) else {}
        return [part for item in sorted(held.items()) if item[0] not in UNSTEADY for part in item]

    def _put(self, *words: Any) -> None:
        self._hash.update(repr(words).encode())


def _full(cell: Any) -> bool:
    try:
        cell.cell_contents  # noqa: B018 a cell may be empty
    except ValueError:
        return False
    return True
