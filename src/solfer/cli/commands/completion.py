"""Print what makes bash complete `solfer`: commands, options, configurations, robots, plugins and files.

`eval "$(solfer completion)"` turns it on in a shell; in ~/.bashrc, behind the line that sources the workspace, in all.
"""

import argparse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of the sub-command."""
    parser.add_argument("words", metavar="WORD", nargs="*", help="complete the last one of these words, and print how")


def run(options: argparse.Namespace) -> int:
    """Print the script, or one line for each completion."""
    from solfer.cli.completion import BASH_SCRIPT, candidates
    from solfer.cli.main import parser

    if options.words:
        print("".join(f"{word}\n" for word in candidates(parser(), options.words)), end="")
    else:
        print(BASH_SCRIPT, end="")
    return 0
