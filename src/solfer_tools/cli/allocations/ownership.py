"""Whose a line of code is, by its file."""

import sys
import sysconfig
from enum import IntEnum
from pathlib import Path
from types import ModuleType

from solfer import errors

SOLFER = Path(errors.__file__).parent


class CodeOwner(IntEnum):
    """Whose a file is.

    Attributes:
        LINES: The component's or solfer's: its lines are named.
        LIBRARY: A library's: what it allocates counts at the line that calls it.
        STAND_IN: It stands in for the middleware, the recording or the robot: what it allocates does not count.
    """

    LINES = 0
    LIBRARY = 1
    STAND_IN = 2


class Ownership:
    """Finds the owners of files.

    Args:
        component: The component's module.
    """

    def __init__(self, component: ModuleType):
        self._component = _home(component)
        installed = [path for path in sys.path if path.rstrip("/").endswith(("site-packages", "dist-packages"))]
        self._libraries = {f"{Path(path)}/" for path in (*sysconfig.get_paths().values(), *installed) if path}
        # rooms that stand around a plugin here, and not where it works
        rooms = (*(SOLFER / room for room in ("cli", "middleware", "simulation")), Path(__file__).parents[2])
        self._stand_ins = tuple(f"{room}/" for room in rooms)
        self._known: dict[str, CodeOwner] = {}

    def of(self, file: str) -> CodeOwner:
        """Return whose a file is."""
        owner = self._known.get(file)
        if owner is None:
            owner = self._known[file] = self._judged(file)
        return owner

    def of_component(self, file: str) -> bool:
        """Return whether a file is one of the component's package."""
        return file.startswith(self._component)

    def _judged(self, file: str) -> CodeOwner:
        if file.startswith(self._stand_ins):
            return CodeOwner.STAND_IN
        if self.of_component(file) or file.startswith(f"{SOLFER}/"):
            return CodeOwner.LINES
        foreign = file.startswith("<") or any(file.startswith(path) for path in self._libraries)
        return CodeOwner.LIBRARY if foreign else CodeOwner.LINES


def _home(module: ModuleType) -> str:
    """Return how the names of the files of a module's package begin."""
    top = sys.modules.get(module.__name__.partition(".")[0])
    if top in (None, module, sys.modules["solfer"]) or getattr(top, "__file__", None) is None:
        return str(module.__file__)
    return f"{Path(str(top.__file__)).parent}/"
