"""Loads libraries of components, and finds the classes in them."""

import ctypes
import os
import platform
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from solfer.components.native.records import INTERFACE, ClassRecord, LibraryRecord, text
from solfer.errors import ComponentError, UnknownName

SEPARATOR = "::"
"""Between library and class in `class: libmy_controller.so::Name`."""

SYMBOL = "solfer_library"


@dataclass(frozen=True, eq=False)
class NativeClass:
    """A class of a library.

    Attributes:
        name: Its name.
        record: Its functions and tags, in the memory of the library.
        file: The library.
    """

    name: str
    record: ClassRecord
    file: Path


def find_class(target: str, where: str = "") -> NativeClass:
    """Find `library::Class`.

    Args:
        target: A library with a path, or one in a folder of `library_folders`, and the name of a class.
        where: Place of the target, for errors.

    Raises:
        UnknownName: There is no such library, or it has no such class.
        ComponentError: The library cannot be loaded, or is none of components for this version.
    """
    file, _, name = target.partition(SEPARATOR)
    path = _found(file, where)
    classes = _classes(path, path.stat().st_mtime_ns, where)
    if name not in classes:
        raise UnknownName(f"component in {path}", name, classes, where=where)
    return classes[name]


def library_folders() -> Iterator[Path]:
    """Yield the folders for libraries that are named without one: of the sourced workspaces, and of the linker."""
    for prefix in filter(None, os.environ.get("CMAKE_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(prefix) / "lib"
    yield from map(Path, filter(None, os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep)))


def _found(file: str, where: str) -> Path:
    if os.sep in file:
        path = Path(file)
        if not path.is_file():
            near = [each.name for each in sorted(path.parent.glob("*.so"))] if path.parent.is_dir() else []
            raise UnknownName(f"library in {path.parent}", path.name, near, where=where)
        return path.resolve()
    folders = list(dict.fromkeys(library_folders()))
    for folder in folders:
        if (folder / file).is_file():
            return (folder / file).resolve()
    near = sorted({each.name for folder in folders if folder.is_dir() for each in folder.glob("*.so")})
    expected = "one in the lib folder of a workspace that is built and sourced, or of LD_LIBRARY_PATH, or a path to it"
    raise UnknownName("library", file, near, where=where, expected=expected)


@cache
def _classes(path: Path, _changed: int, where: str) -> dict[str, NativeClass]:
    """Load a library; one that has changed since this process loaded it would not be loaded again by the system."""
    if path in _LOADED and _LOADED[path] != _changed:
        what = f"{path} has been built again since this process loaded it"
        raise ComponentError(what, where=where, expected="a new start of the process")
    try:
        library = ctypes.PyDLL(os.fspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        what = f"{path} cannot be loaded: {str(error).removeprefix(f'{path}: ')}"
        expected = f"a shared library for {platform.machine()} with all that it needs (`ldd {path.name}` lists it)"
        raise ComponentError(what, where=where, expected=expected) from error
    _LOADED[path] = _changed
    entry = getattr(library, SYMBOL, None)
    if entry is None:
        what = f"{path} has no symbol '{SYMBOL}'"
        expected = "SOLFER_LIBRARY(SOLFER_COMPONENT(...)) in one of its files, see solfer/component.hpp"
        raise ComponentError(what, where=where, expected=expected)
    entry.restype = ctypes.POINTER(LibraryRecord)
    record = entry()
    if not record:
        raise ComponentError(
            f"a class of {path} cannot declare its tags", where=where, expected="no bound before a tag"
        )
    if record[0].interface_number != INTERFACE:
        what = f"{path} was built for version {record[0].interface_number} of solfer/component.h"
        expected = f"version {INTERFACE}, that of this solfer: build the library again"
        raise ComponentError(what, where=where, expected=expected)
    found = (record[0].classes[index][0] for index in range(record[0].class_count))
    return {(name := text(each.name)): NativeClass(name, each, path) for each in found}


_LOADED: dict[Path, int] = {}
"""Libraries of this process, and when they were built [ns]."""
