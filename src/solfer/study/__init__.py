"""Studies, by its name before 0.2.0: it is `solfer_tools.study` now."""

import warnings
from importlib import import_module
from typing import Any

_TOOLS = import_module("solfer_tools.study")
__all__ = list(_TOOLS.__all__)

warnings.warn("solfer.study is solfer_tools.study now; this name goes with 0.3", FutureWarning, stacklevel=2)


def __getattr__(name: str) -> Any:
    return getattr(_TOOLS, name)
