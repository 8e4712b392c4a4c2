"""The parts of `benchmark/estimation.py`, whose folder is no package."""

import importlib
import sys
from pathlib import Path
from types import ModuleType

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmark"


def part(name: str) -> ModuleType:
    """Import a module of the folder `benchmark`, such as `estimation_cases.log`."""
    if str(BENCHMARK) not in sys.path:
        sys.path.append(str(BENCHMARK))
    return importlib.import_module(name)
