"""Plugins: one component, one Robot and its pipes, under any middleware."""

from solfer.plugins.generation.check import check_file, load_checked
from solfer.plugins.generation.generator import Generator, generate
from solfer.plugins.generation.registry import Registry
from solfer.plugins.generation.together import Members, budget_of, generate_shared
from solfer.plugins.life.plugin_set import PluginSet
from solfer.plugins.plugin import Plugin, PluginParts
from solfer.plugins.sharing.robots import Sharing
from solfer.plugins.timing.loop import LoopStatistics, run
from solfer.plugins.trace import CycleTrace, TraceEvent, TraceLog
from solfer.transport.plugin_state import PluginState

__all__ = [
    "CycleTrace",
    "Generator",
    "Members",
    "Plugin",
    "PluginParts",
    "PluginSet",
    "PluginState",
    "Registry",
    "Sharing",
    "LoopStatistics",
    "TraceEvent",
    "TraceLog",
    "budget_of",
    "check_file",
    "generate",
    "generate_shared",
    "load_checked",
    "run",
]
