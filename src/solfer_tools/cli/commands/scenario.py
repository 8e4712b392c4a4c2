"""Print what a scenario file does: its steps with their times, where the base and the vertices go, and how far.

With --plot the way of the base and of the vertices is drawn, seen from above, and all of it over time.
"""

import argparse
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", help="the scenario")
    parser.add_argument("--plot", metavar="OUT", type=Path, help="write the picture, .png or .pdf")


def run(options: argparse.Namespace) -> int:
    """Print the table, and draw.

    Raises:
        SolferError: The scenario is wrong, or the picture cannot be written.
    """
    from solfer.cli.columns import aligned
    from solfer_tools.cli.scenario_trace import ScenarioTrace
    from solfer_tools.scenarios import read_scenario

    if options.plot is not None:
        from solfer_tools.review import check_suffix

        check_suffix(options.plot)
    trace = ScenarioTrace(read_scenario(options.file))
    for line in aligned(trace.rows()):
        print(line)
    print(trace.summary())
    if options.plot is not None:
        from solfer_tools.cli.scenario_page import scenario_page
        from solfer_tools.review import save

        save([("scenario", scenario_page(trace))], options.plot)
        print(options.plot)
    return 0
