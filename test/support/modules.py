"""Modules that a test imported from a folder of its own."""

import sys


def forget(package):
    """Take a package and its modules out of Python, so that the next test of this process does not find them."""
    for name in [name for name in sys.modules if name == package or name.startswith(f"{package}.")]:
        del sys.modules[name]
