"""Scenarios: files of where the base and the wheels of a robot go, and what plays them, step by step."""

from solfer_tools.scenarios.player import Player
from solfer_tools.scenarios.reader import read_scenario
from solfer_tools.scenarios.scenario import Scenario

__all__ = ["Player", "Scenario", "read_scenario"]
