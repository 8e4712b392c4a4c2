"""The whole check of a main configuration: its grammar, then names that need the robot, then tags of components."""

import argparse

from solfer.config import Report, check


def report_of(options: argparse.Namespace) -> Report:
    """What a check with the options of `solfer check` finds."""
    return check(options.file, options.names, search_paths=options.search_paths, system=options.system)
