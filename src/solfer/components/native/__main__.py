"""Prints the folder of the headers, for CMake: `python3 -m solfer.components.native`."""

from solfer.components.native import INCLUDE

print(INCLUDE)
