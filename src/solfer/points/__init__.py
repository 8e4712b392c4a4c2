"""Robot Points and Handler (sections 1.3 and 1.4 of the paper): values with their Jacobians, updated as a group.

Names are imported when they are first used: the compiled kernel behind them takes a while to load.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import Any


def _homes() -> dict[str, str]:
    """Return the names in the `__all__` of this room's files, each with the module that is imported for it."""
    folder = Path(__file__).parent
    homes = dict[str, str]()
    for path in sorted([*folder.glob("[a-z]*.py"), *folder.glob("contact/[a-z]*.py")]):
        module = ".".join((__name__, *path.relative_to(folder).with_suffix("").parts))
        for names in re.findall(r"^__all__ = \[(.*?)\]", path.read_text(), re.MULTILINE | re.DOTALL):
            homes |= dict.fromkeys(re.findall(r'"(\w+)"', names), module)
    return homes


_HOMES = _homes()

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(import_module(_HOMES[name]), name)
