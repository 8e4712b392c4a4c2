"""Draw plugins with their Robots and pipes.

Pipes lead between plugins, the robot's sensors and its lower level. Two plugins are connected where their pipes name
the same topic. Colours are those of the paper's figures: plugins blue, Robots pink, components green, sensors, lower
level and other topics yellow, a shared plugin purple.
"""

import argparse
from pathlib import Path

from solfer.cli.options import add_file, add_search_paths, add_system


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    add_file(parser)
    parser.add_argument(
        "-n",
        dest="names",
        metavar="NAME",
        action="append",
        required=True,
        help="plugin configuration to draw; repeat it for each one",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help="picture to write: .svg, .png (both need Graphviz) or .dot (Graphviz' own text)",
    )
    parser.add_argument("--text", action="store_true", help="print the pipes as text; the default without -o")
    add_search_paths(parser)
    add_system(parser)


def run(options: argparse.Namespace) -> int:
    """Draw, print, or both.

    Raises:
        SolferError: A configuration is wrong, Graphviz is missing, or the file cannot be written.
    """
    from solfer_tools.cli.diagram import dot_text, draw, network_of, plain_text

    network = network_of(options.file, options.names, options.system, search_paths=options.search_paths)
    if options.output is not None:
        draw(dot_text(network), options.output)
    if options.text or options.output is None:
        print(plain_text(network))
    return 0
