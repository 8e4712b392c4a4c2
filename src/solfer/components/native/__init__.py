"""Components in libraries of their own, in C++ or another compiled language, which run as those in Python do."""

from pathlib import Path

INCLUDE = Path(__file__).parent / "include"
"""Folder of the headers `solfer/component.hpp` and `solfer/component.h`."""
