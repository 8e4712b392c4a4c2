"""Prints the folder of the headers, for CMake: `python3 -m solfer.components.native`."""

from solfer.components.native import INCLUDE

if __name__ == "__main__":
    print(INCLUDE)
