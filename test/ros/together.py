#!/usr/bin/env python3
"""Several files of tests in one process, as one more takes seconds to start: `together.py FILE...`."""

import sys
import unittest

import rostest


def load_tests(loader: unittest.TestLoader, *_: object) -> unittest.TestSuite:
    """Return the tests of all files, in their order; each file may also be a node of its own."""
    files = filter(str.isidentifier, sys.argv[1:])
    return unittest.TestSuite(loader.loadTestsFromName(f"{file}_test") for file in files)


if __name__ == "__main__":
    rostest.rosrun("solfer", "together", "__main__")
