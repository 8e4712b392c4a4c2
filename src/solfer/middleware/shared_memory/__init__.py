"""The stand-in for XBotCore: shared memory between processes, without ROS."""

from importlib import import_module
from typing import Any

_HOMES = {
    "Namespace": "solfer.segments.namespace",
    "XbotMiddleware": "solfer.middleware.shared_memory.middleware",
}
__all__ = ["Namespace", "XbotMiddleware"]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    # imported when it is first used: an emergency stop needs the memory and nothing else
    return getattr(import_module(_HOMES[name]), name)
