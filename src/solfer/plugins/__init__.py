"""One component, one Robot and its pipes make a plugin that runs under any middleware."""

from solfer.plugins.check import check_file
from solfer.plugins.generator import Generator, generate
from solfer.plugins.loop import Statistics, run
from solfer.plugins.plugin import Life, Plugin
from solfer.plugins.registry import Registry
from solfer.plugins.sharing import Sharing

__all__ = ["Generator", "Life", "Plugin", "Registry", "Sharing", "Statistics", "check_file", "generate", "run"]
