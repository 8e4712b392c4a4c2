"""Plugins: one component, one Robot and its pipes, under any middleware."""

from solfer.plugins.generation.check import check_file, load_checked
from solfer.plugins.generation.generator import Generator, generate
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.sharing import Sharing
from solfer.plugins.loop import LoopStatistics, run
from solfer.plugins.plugin import LoopState, Plugin

__all__ = [
    "Generator",
    "LoopState",
    "Plugin",
    "Registry",
    "Sharing",
    "LoopStatistics",
    "check_file",
    "generate",
    "load_checked",
    "run",
]
