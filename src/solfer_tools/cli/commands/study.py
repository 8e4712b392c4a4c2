"""Make many simulated runs of one configuration, and measure them: on this machine, with Dask, or with Slurm.

The folder is the truth: any number of workers on any machines share it, what was killed is taken up again, and the same
command goes on with a study. `solfer study report DIR` writes a page of its results. `--rerun ID` repeats one run.
"""

import argparse
import sys
from pathlib import Path


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("file", metavar="FILE", help="the study, or `report`")
    parser.add_argument("folder", metavar="DIR", nargs="?", type=Path, help="with `report`: folder of the study")
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder of the study")
    parser.add_argument("--runs", metavar="N", type=int, help="runs of each point of the grid, instead of the file's")
    parser.add_argument("--engine", choices=("local", "dask", "slurm"), default="local", help="starts the workers")
    parser.add_argument("--workers", metavar="N", type=int, help="how many (default: processors of this machine)")
    parser.add_argument("--scheduler", metavar="ADDRESS", default="", help="of Dask (default: a cluster of its own)")
    parser.add_argument(
        "--slurm", metavar="KEY=VALUE", nargs="+", default=[], help="parameters of jobs, such as partition=short"
    )
    parser.add_argument("--record", action="store_true", help="record each run, MCAP")
    parser.add_argument("--dry", action="store_true", help="list the runs and the hours they take, and run nothing")
    parser.add_argument("--force", action="store_true", help="let results of other code count")
    parser.add_argument(
        "--map",
        nargs=4,
        metavar=("X", "Y", "MEASURE", "OUT"),
        help="with `report`: draw a measure, or `failed`, over two variables, .png or .pdf",
    )
    parser.add_argument("--rerun", metavar="ID", help="repeat one run of --out, here")
    parser.add_argument("--gui", action="store_true", help="with --rerun: open PyBullet's window")


def run(options: argparse.Namespace) -> int:
    """Carry out what the command line requests.

    Raises:
        SolferError: The study is wrong, or cannot go on.
    """
    from solfer_tools.cli.study import actions

    if options.file == "report":  # in place of a file
        return actions.report(options.folder or options.out, options.map)
    try:
        if options.rerun is not None:
            return actions.rerun(options)
        return actions.dry(options) if options.dry else actions.carry_out(options)
    except KeyboardInterrupt:
        print("ended; the same command goes on" if options.rerun is None else "ended", file=sys.stderr)
        return 130
