"""SOL-FER: Simplifying Operations in Locomotion, a Framework for Efficient Research."""

from importlib import import_module
from typing import Any

__all__ = ["Robot"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    # imported when it is first used: commands that need no Robot start without Pinocchio
    return getattr(import_module("solfer.robot"), name)
